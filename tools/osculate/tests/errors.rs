//! Files that break their format, through the real binary: exit code 2, one line, nothing written.

mod common;

use common::Workspace;
use osculate_geom::shapes;
use osculate_tests::broken_files::broken_files;

#[test]
fn every_broken_file_is_one_line_and_exit_code_2() {
    let files = broken_files();
    assert!(files.len() >= 40, "{} files", files.len());
    for file in files {
        let w = Workspace::new();
        std::fs::write(w.path(file.name), &file.bytes).unwrap();
        for (name, bytes) in &file.companions {
            std::fs::write(w.path(name), bytes).unwrap();
        }
        w.refuses(&format!("bake {} -o out.glb", file.name), &[file.name, file.expect]);
        w.refuses(&format!("inspect {}", file.name), &[file.name]);
    }
}

/// A bake that is cut off or altered is a broken bake, not a mesh without curvature.
#[test]
fn a_damaged_bake_says_so() {
    let w = Workspace::new();
    w.write_obj("ball.obj", &shapes::icosphere(1.0, 2));
    for name in ["ball.glb", "ball.ply"] {
        w.ok(&format!("bake ball.obj -o {name}"));
        let whole = w.read(name);
        std::fs::write(w.path(name), &whole[..whole.len() - 100]).unwrap();
        for command in ["inspect", "verify --analytic sphere:1"] {
            w.refuses(&format!("{command} {name}"), &[name]);
        }
    }
    w.ok("bake ball.obj -o ball.ply");
    let text = w.read("ball.ply");
    let marker = b"\"format_version\":1";
    let at = text.windows(marker.len()).position(|window| window == marker).unwrap() + marker.len() - 1;
    let mut newer = text;
    newer[at] = b'9';
    std::fs::write(w.path("ball.ply"), newer).unwrap();
    w.refuses("inspect ball.ply", &["ball.ply", "version 9", "update osculate"]);
}
