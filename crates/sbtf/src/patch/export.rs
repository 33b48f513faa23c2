//! Writing samples to files, for other programs; training needs none.

use std::path::{Path, PathBuf};

use osculate_geom::write_atomically;
use safetensors::tensor::{Dtype, TensorView, serialize};
use thiserror::Error;

use crate::samples::{AppearanceBatch, OpacityBatch, SampleSource};

/// Why samples could not be written.
#[derive(Debug, Error)]
pub enum ExportError {
    /// A file or the folder could not be written.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The format could not hold the rows.
    #[error("{path}: {source}", path = path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What the library says.
        source: safetensors::SafeTensorError,
    },
}

/// Writes the first `batches` batches of `rows` rows of both streams into a folder, as `opacity-000000.safetensors` and
/// `appearance-000000.safetensors` and so on. Each column is a tensor of shape `[rows]`, `f32`, named `uv.x`, `wo.z`, `kappa_hat`
/// and the like, after the fields of [`OpacityBatch`] and [`AppearanceBatch`].
///
/// # Errors
///
/// Where the folder or a file cannot be written. Files that are complete stay; none is left half written.
pub fn export_dataset(
    source: &dyn SampleSource,
    folder: &Path,
    batches: u64,
    rows: usize,
) -> Result<(), ExportError> {
    std::fs::create_dir_all(folder).map_err(|source| ExportError::Io { path: folder.to_owned(), source })?;
    let (mut opacity, mut appearance) = (OpacityBatch::default(), AppearanceBatch::default());
    opacity.resize(rows);
    appearance.resize(rows);
    for index in 0..batches {
        source.fill_opacity(index, &mut opacity);
        write(&folder.join(format!("opacity-{index:06}.safetensors")), &opacity_columns(&opacity))?;
        source.fill_appearance(index, &mut appearance);
        write(&folder.join(format!("appearance-{index:06}.safetensors")), &appearance_columns(&appearance))?;
    }
    Ok(())
}

type Columns<'a> = Vec<(&'static str, &'a [f32])>;

fn opacity_columns(batch: &OpacityBatch) -> Columns<'_> {
    vec![
        ("uv.x", &batch.uv[0]),
        ("uv.y", &batch.uv[1]),
        ("wo.x", &batch.wo[0]),
        ("wo.y", &batch.wo[1]),
        ("wo.z", &batch.wo[2]),
        ("kappa_hat", &batch.kappa_hat),
        ("silhouette_cosine", &batch.silhouette_cosine),
        ("alpha", &batch.alpha),
    ]
}

fn appearance_columns(batch: &AppearanceBatch) -> Columns<'_> {
    vec![
        ("uv.x", &batch.uv[0]),
        ("uv.y", &batch.uv[1]),
        ("wo.x", &batch.wo[0]),
        ("wo.y", &batch.wo[1]),
        ("wo.z", &batch.wo[2]),
        ("wi.x", &batch.wi[0]),
        ("wi.y", &batch.wi[1]),
        ("wi.z", &batch.wi[2]),
        ("kappa_hat", &batch.kappa_hat),
        ("offset.x", &batch.offset[0]),
        ("offset.y", &batch.offset[1]),
        ("rgb.r", &batch.rgb[0]),
        ("rgb.g", &batch.rgb[1]),
        ("rgb.b", &batch.rgb[2]),
    ]
}

fn write(path: &Path, columns: &Columns<'_>) -> Result<(), ExportError> {
    let format = |source| ExportError::Format { path: path.to_owned(), source };
    let bytes: Vec<Vec<u8>> =
        columns.iter().map(|(_, row)| row.iter().flat_map(|x| x.to_le_bytes()).collect()).collect();
    let mut tensors = Vec::with_capacity(columns.len());
    for ((name, row), bytes) in columns.iter().zip(&bytes) {
        tensors.push((*name, TensorView::new(Dtype::F32, vec![row.len()], bytes).map_err(format)?));
    }
    let file = serialize(tensors, None).map_err(format)?;
    write_atomically(path, |out| std::io::Write::write_all(out, &file))
        .map_err(|source| ExportError::Io { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::micro::{Geometry, HeightField, Maps, Microstructure, Reflectance};
    use crate::patch::test_fields::bumps;
    use crate::patch::{DatasetOptions, PatchDataset};
    use safetensors::SafeTensors;

    #[test]
    fn files_hold_the_stream() {
        let tint = Reflectance { albedo: glam::Vec3::new(0.2, 0.5, 0.8), roughness: 0.5, metalness: 0.0 };
        let field = HeightField::new(bumps(32, 0.1).heights().clone(), 0.1, Maps::uniform(tint));
        let micro = Microstructure { name: "bumps".into(), geometry: Geometry::HeightField(field) };
        let dataset = PatchDataset::new(&micro, DatasetOptions::default()).expect("valid options");
        let folder = tempfile::tempdir().expect("a folder");
        export_dataset(&dataset, folder.path(), 2, 100).expect("written");
        let mut batch = AppearanceBatch::default();
        batch.resize(100);
        dataset.fill_appearance(1, &mut batch);
        let bytes = std::fs::read(folder.path().join("appearance-000001.safetensors")).expect("a file");
        let read = SafeTensors::deserialize(&bytes).expect("the format");
        let column = |name: &str| -> Vec<f32> {
            let data = read.tensor(name).expect("a column").data();
            data.chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
        };
        assert_eq!(column("rgb.g"), batch.rgb[1]);
        assert_eq!(column("wi.z"), batch.wi[2]);
        assert_eq!(read.len(), 14);
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 4);
        let blocked = folder.path().join("appearance-000000.safetensors");
        let error = export_dataset(&dataset, &blocked, 1, 1).expect_err("not a folder").to_string();
        assert!(error.contains("appearance-000000"), "{error}");
    }
}
