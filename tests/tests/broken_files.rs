//! Every broken file gives one message that names the file, the element and the value; odd ones are read.

use std::fs;

use osculate_geom::io::read_mesh;
use osculate_tests::broken_files::{broken_files, odd_files};

#[test]
fn broken_files_are_refused_with_a_message_that_helps() {
    let files = broken_files();
    assert!(files.len() >= 45, "only {} broken files", files.len());
    let mut wrong = Vec::new();
    for file in files {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(file.name);
        fs::write(&path, &file.bytes).unwrap();
        for (name, bytes) in &file.companions {
            fs::write(directory.path().join(name), bytes).unwrap();
        }
        match read_mesh(&path) {
            Ok(read) => wrong.push(format!("{}: read as {:?}", file.name, read.mesh)),
            Err(error) => {
                let message = error.to_string();
                let named = message.starts_with(&format!("{}: ", path.display()));
                if !named || !message.contains(file.expect) || message.contains('\n') || message.len() > 400 {
                    wrong.push(format!("{}: {message:?} does not say {:?}", file.name, file.expect));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn odd_files_are_read() {
    for file in odd_files() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(file.name);
        fs::write(&path, &file.bytes).unwrap();
        let read = read_mesh(&path).unwrap_or_else(|error| panic!("{error}"));
        let counts = (read.mesh.positions().len(), read.mesh.triangles().len());
        assert_eq!(counts, (file.vertices, file.triangles), "{}", file.name);
    }
}

#[test]
fn missing_files_and_directories_are_named() {
    let directory = tempfile::tempdir().unwrap();
    let missing = read_mesh(&directory.path().join("none.obj")).unwrap_err().to_string();
    assert!(missing.contains("none.obj: cannot be read: "), "{missing}");
    fs::create_dir(directory.path().join("d.ply")).unwrap();
    let folder = read_mesh(&directory.path().join("d.ply")).unwrap_err().to_string();
    assert!(folder.contains("d.ply: cannot be read: not a regular file"), "{folder}");
}

/// Cutting a valid file anywhere must not panic, and must not take long.
#[test]
fn every_prefix_of_every_odd_file_is_handled() {
    for file in odd_files() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join(file.name);
        for end in 0..file.bytes.len() {
            fs::write(&path, &file.bytes[..end]).unwrap();
            if let Err(error) = read_mesh(&path) {
                assert!(error.to_string().contains(file.name), "{error}");
            }
        }
    }
}
