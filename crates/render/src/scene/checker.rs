//! Ranges of the values in a scene file.

use std::path::Path;

use glam::Vec3;

use super::SceneFileError;

/// Checks values, and says where they stand.
pub(super) struct Checker<'a> {
    /// The scene file's name, for messages.
    pub file: String,
    /// What its paths are relative to.
    pub folder: &'a Path,
}

impl Checker<'_> {
    pub(super) fn error(
        &self,
        key: &str,
        value: impl std::fmt::Display,
        problem: impl std::fmt::Display,
    ) -> SceneFileError {
        SceneFileError::Value {
            file: self.file.clone(),
            key: key.into(),
            value: value.to_string(),
            problem: problem.to_string(),
        }
    }

    pub(super) fn finite(&self, key: &str, value: f32) -> Result<f32, SceneFileError> {
        if value.is_finite() { Ok(value) } else { Err(self.error(key, value, "must be finite")) }
    }

    pub(super) fn range(&self, key: &str, value: f32, least: f32, most: f32) -> Result<f32, SceneFileError> {
        if (least..=most).contains(&value) {
            return Ok(value);
        }
        let problem = if most == f32::MAX {
            format!("must be at least {least}")
        } else {
            format!("must be {least} to {most}")
        };
        Err(self.error(key, value, problem))
    }

    pub(super) fn point(&self, key: &str, value: [f32; 3]) -> Result<Vec3, SceneFileError> {
        let value = Vec3::from(value);
        if value.is_finite() { Ok(value) } else { Err(self.error(key, value, "must be finite")) }
    }

    pub(super) fn direction(&self, key: &str, value: [f32; 3]) -> Result<Vec3, SceneFileError> {
        let found = Vec3::from(value).try_normalize();
        found.ok_or_else(|| self.error(key, Vec3::from(value), "must be finite and not zero"))
    }

    pub(super) fn colour(&self, key: &str, value: [f32; 3]) -> Result<Vec3, SceneFileError> {
        let colour = self.point(key, value)?;
        if colour.min_element() >= 0.0 {
            Ok(colour)
        } else {
            Err(self.error(key, colour, "must not be negative"))
        }
    }

    pub(super) fn read(&self, key: &str, path: &Path) -> Result<Vec<u8>, SceneFileError> {
        std::fs::read(self.folder.join(path)).map_err(|e| self.error(key, path.display(), e))
    }
}
