//! Writes every hard case as a `.ply` with 64-bit coordinates, and what is known about its vertices as a `.csv` beside it, for
//! `tools/reference/hard_case_peers.py`.
//!
//!     cargo run --release -p osculate-tests --example export_hard_cases -- DIRECTORY

use std::fs;
use std::io;
use std::path::Path;

use osculate_geom::Mesh;
use osculate_tests::hard_cases::{Truth, hard_cases};

fn main() -> io::Result<()> {
    let directory = std::env::args_os().nth(1).ok_or_else(|| io::Error::other("name a directory"))?;
    let directory = Path::new(&directory);
    fs::create_dir_all(directory)?;
    for case in hard_cases() {
        let mesh = (case.mesh)();
        fs::write(directory.join(case.name).with_extension("ply"), ply(&mesh))?;
        let truths = (case.truth)(&mesh);
        fs::write(directory.join(case.name).with_extension("csv"), csv(&truths, case.share))?;
    }
    Ok(())
}

/// Binary, so that every bit arrives.
fn ply(mesh: &Mesh) -> Vec<u8> {
    let (vertices, faces) = (mesh.positions().len(), mesh.triangles().len());
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
         property double z\nelement face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    .into_bytes();
    bytes.extend(mesh.positions().iter().flatten().flat_map(|x| x.to_le_bytes()));
    for triangle in mesh.triangles() {
        bytes.push(3);
        bytes.extend(triangle.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes
}

/// The share that must be right, then a line a vertex: kind, `kappa_max`, `kappa_min`, tolerance. Other tools state no error, so an
/// honest estimate is a right one.
fn csv(truths: &[Truth], share: f64) -> String {
    let line = |truth: &Truth| match truth {
        Truth::Known { kappa: [max, min], tolerance } | Truth::Honest { kappa: [max, min], tolerance } => {
            format!("known,{max:e},{min:e},{tolerance:e}\n")
        }
        Truth::Undetermined => "undetermined,,,\n".to_owned(),
        Truth::Free => "free,,,\n".to_owned(),
    };
    format!("{share},,,\n{}", truths.iter().map(line).collect::<String>())
}
