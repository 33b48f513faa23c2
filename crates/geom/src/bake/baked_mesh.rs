//! [`BakedMesh`]: a mesh with the curvature of every vertex and where it came from.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::filter_rows::{FilterRecord, FilterRows};
use crate::Mesh;
use crate::curvature::{CurvatureOptions, VertexCurvature};
use crate::mesh::Weld;

/// Version of the attributes and of the provenance that this crate writes. Readers refuse a larger one.
pub const FORMAT_VERSION: u32 = 1;

/// A mesh with curvature at every vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct BakedMesh {
    mesh: Mesh,
    curvature: Vec<VertexCurvature>,
    filter: Option<FilterRows>,
    /// How the curvature came about.
    pub provenance: Provenance,
}

impl BakedMesh {
    /// Joins a mesh and its curvature: one entry per mesh vertex, equal on the copies that a seam makes of one vertex.
    ///
    /// # Panics
    ///
    /// If `curvature` has not one entry per vertex.
    #[must_use]
    pub fn new(mesh: Mesh, curvature: Vec<VertexCurvature>, provenance: Provenance) -> Self {
        assert_eq!(curvature.len(), mesh.positions().len(), "one curvature per mesh vertex");
        Self { mesh, curvature, filter: None, provenance }
    }

    /// The same bake with its filter, and the record of that in the provenance.
    ///
    /// # Panics
    ///
    /// If there is not one row per vertex, or the record has another number of azimuths.
    #[must_use]
    pub fn with_filter(mut self, rows: FilterRows, record: FilterRecord) -> Self {
        assert_eq!(rows.bound().len(), self.curvature.len(), "one row per mesh vertex");
        assert_eq!(rows.azimuths(), record.azimuths, "the record of these rows");
        self.filter = Some(rows);
        self.provenance.filter = Some(record);
        self
    }

    /// The filter, if it was baked.
    #[must_use]
    pub fn filter(&self) -> Option<&FilterRows> {
        self.filter.as_ref()
    }

    /// The mesh. After reading a file its normals are unit: the source file's own, or computed where that had none.
    #[must_use]
    pub fn mesh(&self) -> &Mesh {
        &self.mesh
    }

    /// One entry per mesh vertex.
    #[must_use]
    pub fn curvature(&self) -> &[VertexCurvature] {
        &self.curvature
    }

    /// Gives up the mesh and the curvature.
    #[must_use]
    pub fn into_parts(self) -> (Mesh, Vec<VertexCurvature>) {
        (self.mesh, self.curvature)
    }
}

/// Where a bake came from: enough to make it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of this record and of the attributes, see [`FORMAT_VERSION`].
    pub format_version: u32,
    /// Name and version of the program that wrote the file.
    pub tool: String,
    /// The file that was baked.
    pub source: Source,
    /// The estimator and all its options; the neighbourhood in force is always named.
    pub curvature: CurvatureOptions,
    /// Which vertices were merged before the estimate.
    pub weld: Weld,
    /// Whether the triangles were turned over before the estimate.
    pub facing: Facing,
    /// Where the normals came from.
    pub normals: NormalSource,
    /// What the numbers are measured in.
    pub units: Units,
    /// How the filter was baked, if it was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub filter: Option<FilterRecord>,
}

impl Provenance {
    /// The record of a bake by this version of the crate, of a mesh taken as it is.
    #[must_use]
    pub fn new(source: Source, curvature: CurvatureOptions) -> Self {
        Self {
            format_version: FORMAT_VERSION,
            tool: concat!("osculate ", env!("CARGO_PKG_VERSION")).to_owned(),
            source,
            curvature: CurvatureOptions { neighbourhood: Some(curvature.neighbourhood()), ..curvature },
            weld: Weld::default(),
            facing: Facing::default(),
            normals: NormalSource::default(),
            units: Units::default(),
            filter: None,
        }
    }
}

/// The file that was baked.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// Its name without directories, so that a bake says nothing about the machine that made it.
    pub file: String,
    /// SHA-256 of its bytes in lower-case hexadecimal; files that it refers to are not included.
    pub sha256: String,
}

impl Source {
    /// The record of a file's bytes.
    #[must_use]
    pub fn from_bytes(file: &str, bytes: &[u8]) -> Self {
        Self { file: file.to_owned(), sha256: format!("{:x}", Sha256::digest(bytes)) }
    }

    /// The record of a file, read in pieces.
    ///
    /// # Errors
    ///
    /// What the file system says.
    pub fn read(path: &Path) -> io::Result<Self> {
        let mut file = File::open(path)?;
        let mut digest = Sha256::new();
        let mut piece = vec![0; 1 << 18];
        loop {
            match file.read(&mut piece)? {
                0 => break,
                length => digest.update(&piece[..length]),
            }
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { file: name, sha256: format!("{:x}", digest.finalize()) })
    }
}

/// Which way the triangles face.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Facing {
    /// As in the source file.
    #[default]
    Kept,
    /// Turned over, and the normals with them; curvature has the opposite sign.
    Flipped,
}

/// Where a bake's normals came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum NormalSource {
    /// The source file; computed at vertices where it has a zero normal.
    #[default]
    File,
    /// The mean of the triangle normals around each vertex, weighted by the corner angles, on the welded surface.
    Computed,
}

/// What the numbers of a bake are measured in.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Units {
    /// Positions.
    pub length: String,
    /// Curvatures and their errors.
    pub curvature: String,
}

impl Default for Units {
    /// World units of the source file, and their reciprocal.
    fn default() -> Self {
        Self { length: "source file units".to_owned(), curvature: "1/length".to_owned() }
    }
}
