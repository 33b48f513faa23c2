//! Scene files: parsed, built around a mesh of one triangle, and planned.
#![no_main]

use std::path::Path;
use std::sync::Arc;

use libfuzzer_sys::fuzz_target;
use osculate_geom::{Mesh, Vec3};
use osculate_render::scene::{LoadedMesh, SceneFile};
use osculate_render::plan;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(file) = SceneFile::parse(text, "scene.toml") else { return };
    // Images are looked up below a folder that does not exist; an absolute path would leave it.
    if text.contains('/') || text.contains('\\') {
        return;
    }
    let triangle = Mesh::new(vec![Vec3::zeros(), Vec3::x(), Vec3::y()], vec![[0, 1, 2]]).expect("a mesh");
    let mesh = Arc::new(triangle);
    let built = file.build(Path::new("no-such-folder/scene.toml"), &mut |_| {
        Ok(LoadedMesh { mesh: Arc::clone(&mesh), curvature: None, field: None })
    });
    if let Ok(scene) = built {
        assert!(scene.objects.len() >= file.mesh.len());
        let _ = plan(&scene, 8);
    }
});
