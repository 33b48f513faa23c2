//! [`Lights`]: which image was taken under which light.

use std::path::{Path, PathBuf};

use glam::Vec3;
use serde::{Deserialize, Serialize};

use crate::micro::import::{Encoding, ImportError, Problem, Tiling};

/// Most images that are read.
const MAX_IMAGES: usize = 256;

/// The list of a measurement, `lights.toml`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lights {
    /// How the images' codes are meant; there is no default, because a wrong guess bends every normal.
    pub encoding: Encoding,
    /// Perceptual roughness; found from the highlights, unless given.
    pub roughness: Option<f32>,
    /// What becomes of photographs that do not tile.
    #[serde(default)]
    pub tiling: Tiling,
    /// The images.
    pub image: Vec<Light>,
}

/// One image and its light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Light {
    /// File name, relative to the list.
    pub file: String,
    /// To the light: x right and y up in the image, z to the camera. Any length.
    pub direction: [f32; 3],
    /// Value of a white matt surface that faces the light (1).
    #[serde(default = "one")]
    pub intensity: f32,
}

fn one() -> f32 {
    1.0
}

impl Light {
    /// Unit direction to the light.
    #[must_use]
    pub fn unit_direction(&self) -> Vec3 {
        Vec3::from(self.direction).normalize_or_zero()
    }
}

impl Lights {
    /// Reads the list of a directory; returns its path too.
    pub(super) fn read(directory: &Path) -> Result<(PathBuf, Self), ImportError> {
        let toml = directory.join("lights.toml");
        let plain = directory.join("lights.txt");
        let is_plain = plain.is_file() && !toml.is_file();
        let path = if is_plain { plain } else { toml };
        let text =
            std::fs::read_to_string(&path).map_err(|e| ImportError::new(&path, Problem::Unreadable(e)))?;
        let parsed = if is_plain { Self::parse_plain(&text) } else { Self::parse(&text) };
        let lights = parsed.map_err(|problem| ImportError::new(&path, problem))?;
        Ok((path, lights))
    }

    /// Reads and checks `lights.toml`.
    ///
    /// # Errors
    ///
    /// No TOML, unknown keys, values out of range, fewer than three images.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let lights: Self = toml::from_str(text).map_err(|e| Problem::Syntax(Box::new(e)))?;
        lights.check()?;
        Ok(lights)
    }

    /// Reads and checks `lights.txt`: a line `encoding linear` or `encoding srgb`, then lines of file name, x, y, z and perhaps
    /// intensity, separated by blanks; `#` starts a comment.
    ///
    /// # Errors
    ///
    /// A line of another form, and as for [`Self::parse`].
    pub fn parse_plain(text: &str) -> Result<Self, Problem> {
        let mut encoding = None;
        let mut image = Vec::new();
        for (i, line) in text.lines().enumerate() {
            let words: Vec<&str> = line.split('#').next().unwrap_or_default().split_whitespace().collect();
            let bad = || Problem::key("line", format!("{}: {line:?} is not `file x y z [intensity]`", i + 1));
            match words.as_slice() {
                [] => {}
                ["encoding", "linear"] => encoding = Some(Encoding::Linear),
                ["encoding", "srgb"] => encoding = Some(Encoding::Srgb),
                [file, numbers @ ..] if (3..=4).contains(&numbers.len()) => {
                    let numbers: Vec<f32> =
                        numbers.iter().map(|w| w.parse()).collect::<Result<_, _>>().map_err(|_| bad())?;
                    let intensity = numbers.get(3).copied().unwrap_or(1.0);
                    let direction = [numbers[0], numbers[1], numbers[2]];
                    image.push(Light { file: (*file).to_owned(), direction, intensity });
                }
                _ => return Err(bad()),
            }
        }
        let Some(encoding) = encoding else {
            return Err(Problem::key(
                "encoding",
                "is missing; add a line `encoding linear` or `encoding srgb`",
            ));
        };
        let lights = Self { encoding, roughness: None, tiling: Tiling::Require, image };
        lights.check()?;
        Ok(lights)
    }

    fn check(&self) -> Result<(), Problem> {
        let count = self.image.len();
        if !(3..=MAX_IMAGES).contains(&count) {
            return Err(Problem::key("image", format!("{count} are listed; 3 to {MAX_IMAGES} are needed")));
        }
        if let Some(roughness) = self.roughness.filter(|r| !(0.0..=1.0).contains(r)) {
            return Err(Problem::key("roughness", format!("{roughness} is not in [0, 1]")));
        }
        for light in &self.image {
            let direction = light.unit_direction();
            if !(direction.is_finite() && direction.z > 0.0) {
                let what =
                    format!("{:?} of {} does not point to above the surface", light.direction, light.file);
                return Err(Problem::key("direction", what));
            }
            if !(light.intensity > 0.0 && light.intensity.is_finite()) {
                return Err(Problem::key(
                    "intensity",
                    format!("{} of {} is not positive", light.intensity, light.file),
                ));
            }
        }
        Ok(())
    }
}
