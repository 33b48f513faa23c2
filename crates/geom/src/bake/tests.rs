//! Round trips through both formats, bit by bit.

use proptest::prelude::*;
use tempfile::tempdir;

use super::*;
use crate::curvature::{CurvatureOptions, Method, Neighbourhood, Principal, Status, VertexCurvature};
use crate::field::{BakedError, BakedMinimum, WalkLength};
use crate::mesh::{Material, Part, TextureImage};
use crate::{Mesh, Vec3};

fn provenance() -> Provenance {
    let options = CurvatureOptions {
        method: Method::Libigl,
        neighbourhood: Some(Neighbourhood::Radius(0.1 + 0.2)),
        ..Default::default()
    };
    let source = Source { file: "häßlich \"name\" \u{1f40b}.obj".to_owned(), sha256: "00".repeat(32) };
    Provenance::new(source, options)
}

fn known(kappa_max: f64, kappa_min: f64, d1: Vec3, d2: Vec3) -> VertexCurvature {
    let principal = Principal { kappa_max, kappa_min, d1, d2 };
    VertexCurvature { principal: Some(principal), error: 0.25, status: Status::Ok }
}

/// Two parts with materials, an unused vertex, two UV sets, an undetermined vertex, an estimate of unknown error.
fn sample() -> BakedMesh {
    let p = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [5., 5., 5.]].map(Vec3::from);
    let uvs = vec![[0.1, 0.3], [1.0, -0.0], [1e-9, 1.0 - 1e-9], [300.0, -7.25], [0.0, 1.0]];
    let part = |name: &str, triangles, material| Part { name: name.into(), triangles, material };
    let texture = TextureImage { mime_type: "image/png".into(), bytes: vec![1, 2, 3, 4, 5] };
    let shiny = Material {
        name: "shiny".into(),
        base_color: [0.25, 0.5, 1.0],
        metallic: 1.0,
        roughness: 0.125,
        base_color_texture: Some(texture),
    };
    let mesh = Mesh::new(p.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
        .unwrap()
        .with_normals(vec![
            Vec3::z(),
            Vec3::new(0.0, 0.1, 1.0),
            Vec3::z() * 3.0,
            Vec3::zeros(),
            Vec3::zeros(),
        ])
        .unwrap()
        .with_uv_set(uvs.clone())
        .unwrap()
        .with_uv_set(uvs)
        .unwrap()
        .with_parts(
            vec![part("first", 0..1, Some(1)), part("", 1..2, None)],
            vec![Material::default(), shiny],
        )
        .unwrap();
    let mut curvature = vec![known(2.0, -1.0 / 3.0, Vec3::x(), Vec3::y()); 5];
    curvature[1].error = f64::INFINITY;
    curvature[2] = VertexCurvature::undetermined(Status::RankDeficient);
    curvature[3].status = Status::Boundary;
    curvature[4] = VertexCurvature::undetermined(Status::Isolated);
    BakedMesh::new(mesh, curvature, provenance())
}

/// What is read back, and the bytes; checks that writing that again gives the same bytes.
fn round_trip(baked: &BakedMesh, name: &str, write: impl Fn(&Path, &BakedMesh)) -> BakedMesh {
    let directory = tempdir().unwrap();
    let (first, second) = (directory.path().join(name), directory.path().join(format!("again-{name}")));
    write(&first, baked);
    let back = read_baked(&first).unwrap();
    write(&second, &back);
    assert!(
        std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap(),
        "{name} changes when rewritten"
    );
    back
}

fn check_against(baked: &BakedMesh, back: &BakedMesh, narrow: impl Fn(f64) -> f64) {
    assert_eq!(back.provenance, baked.provenance);
    assert_eq!(back.mesh().triangles(), baked.mesh().triangles());
    let same = |what: &str, found: f64, expected: f64| {
        assert!(found == narrow(expected), "{what}: {found:e} for {expected:e}");
    };
    for (p, q) in back.mesh().positions().iter().zip(baked.mesh().positions()) {
        (0..3).for_each(|k| same("position", p[k], q[k]));
    }
    for (found, expected) in back.curvature().iter().zip(baked.curvature()) {
        assert_eq!(found.status, expected.status);
        assert_eq!(found.principal.is_some(), expected.principal.is_some());
        same("error", found.error, expected.error);
        if let (Some(found), Some(expected)) = (found.principal, expected.principal) {
            same("kappa_max", found.kappa_max, expected.kappa_max);
            same("kappa_min", found.kappa_min, expected.kappa_min);
            (0..3).for_each(|k| same("d1", found.d1[k], expected.d1[k]));
            assert!((found.d2.norm() - 1.0).abs() < 1e-6 && found.d1.dot(&found.d2).abs() < 1e-6);
        }
    }
    for n in back.mesh().normals().unwrap() {
        assert!((n.norm() - 1.0).abs() < 1.3e-7, "{n}");
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "the test states independently what f32 makes of a number"
)]
fn to_f32(x: f64) -> f64 {
    f64::from(x as f32)
}

#[test]
fn glb_keeps_rows_parts_materials_and_provenance() {
    let baked = sample();
    let back = round_trip(&baked, "a.glb", |p, b| write_glb(p, b).unwrap());
    check_against(&baked, &back, to_f32);
    assert_eq!(back.mesh().parts(), baked.mesh().parts());
    assert_eq!(back.mesh().materials(), baked.mesh().materials());
    assert_eq!(back.mesh().normals().unwrap()[3], Vec3::z(), "a zero normal is computed");
    for (found, expected) in back.mesh().uv_sets().iter().zip(baked.mesh().uv_sets()) {
        for (found, expected) in found.iter().zip(expected) {
            assert_eq!(found[0], to_f32(expected[0]));
            assert_eq!(found[1], 1.0 - to_f32(1.0 - expected[1]));
        }
    }
}

#[test]
fn ply_keeps_rows_and_provenance_in_both_precisions() {
    let baked = sample();
    let back = round_trip(&baked, "a.ply", |p, b| write_ply(p, b, Precision::F32).unwrap());
    check_against(&baked, &back, to_f32);
    let back = round_trip(&baked, "a.ply", |p, b| write_ply(p, b, Precision::F64).unwrap());
    check_against(&baked, &back, |x| x);
    assert_eq!(back.curvature(), baked.curvature(), "d2 is stored too");
    assert_eq!(back.mesh().uv_sets(), baked.mesh().uv_sets());
}

/// [`sample`] with rows of a filter whose values are all different.
fn with_filter(azimuths: usize) -> BakedMesh {
    let baked = sample();
    let vertices = baked.curvature().len();
    let lowering = (0..azimuths * vertices).map(|i| 0.1 + i as f32 * 0.713_7).collect();
    let mut bound: Vec<f32> = (0..vertices).map(|i| 1e-7 + i as f32).collect();
    bound[1] = crate::field::SkipBounds::UNKNOWN;
    bound[2] = 0.0;
    let record = FilterRecord {
        azimuths,
        walk: WalkLength::ShellAt { depth: 0.1 + 0.2, cosine: 0.2 },
        bound_length: 1.0 / 3.0,
        error: Some(BakedError { queries: 7, median: 0.1, p99: 0.2, max: 1.0 / 7.0, proved: None }),
    };
    baked.with_filter(FilterRows::new(azimuths, lowering, bound).unwrap(), record)
}

#[test]
fn filters_come_back_to_the_bit() {
    for azimuths in BakedMinimum::AZIMUTHS {
        let baked = with_filter(azimuths);
        for back in [
            round_trip(&baked, "a.glb", |p, b| write_glb(p, b).unwrap()),
            round_trip(&baked, "a.ply", |p, b| write_ply(p, b, Precision::F32).unwrap()),
            round_trip(&baked, "a.ply", |p, b| write_ply(p, b, Precision::F64).unwrap()),
        ] {
            assert_eq!(back.filter(), baked.filter());
            assert_eq!(back.provenance, baked.provenance);
        }
    }
}

#[test]
fn a_baked_filter_is_that_of_the_field_on_all_copies() {
    let mesh = crate::shapes::torus_with_uv(1.0, 0.4, 30, 16);
    let options = BakeOptions {
        filter: Some(FilterOptions { azimuths: 8, walk: Some(WalkLength::Fixed(0.3)) }),
        ..BakeOptions::default()
    };
    let baked = bake(mesh, provenance().source, &options).unwrap();
    let record = baked.provenance.filter.unwrap();
    assert_eq!((record.azimuths, record.walk, record.bound_length), (8, WalkLength::Fixed(0.3), 0.3));
    let error = record.error.unwrap();
    assert!(error.median <= error.p99 && error.p99 <= error.max && error.max <= error.proved.unwrap());
    let surface = crate::mesh::Surface::new(baked.mesh(), crate::mesh::Weld::Exact);
    let estimated = crate::curvature::estimate(&surface, &options.curvature).unwrap();
    let field = crate::field::CurvatureField::new(surface, estimated);
    let (table, bounds) = (
        baked.filter().unwrap().minimum(field.surface(), record.walk),
        baked.filter().unwrap().bounds(field.surface(), record.bound_length),
    );
    assert_eq!(table, BakedMinimum::new(&field, 8, WalkLength::Fixed(0.3)));
    let direct = crate::field::SkipBounds::new(&field, 0.3);
    for triangle in 0..field.surface().triangles().len() {
        assert!(bounds.bound(triangle) >= direct.bound(triangle));
    }
}

#[test]
fn damaged_filters_are_named() {
    let directory = tempdir().unwrap();
    let (glb, ply) = (directory.path().join("a.glb"), directory.path().join("a.ply"));
    write_glb(&glb, &with_filter(8)).unwrap();
    write_ply(&ply, &with_filter(8), Precision::F32).unwrap();
    let replaced = |path: &Path, old: &[u8], new: &[u8]| {
        assert_eq!(old.len(), new.len());
        let mut bytes = std::fs::read(path).unwrap();
        let at = bytes.windows(old.len()).position(|w| w == old).expect("is in the file");
        bytes[at..at + old.len()].copy_from_slice(new);
        bytes
    };
    // The third value of vertex 0, and the first of vertex 1.
    let (third, next) = (0.1_f32 + 2.0 * 0.713_7, 0.1_f32 + 8.0 * 0.713_7);
    let message = |error: ReadError| error.to_string();
    for (old, new, expect) in [
        (third, f32::NAN, "vertex 0: the filter's NaN is negative or not finite"),
        (third, -1.0, "vertex 0: the filter's -1.0 is negative"),
        (next, f32::INFINITY, "vertex 1: the filter's inf is"),
    ] {
        let (old, new) = (old.to_le_bytes(), new.to_le_bytes());
        let found = message(read_baked_glb(&replaced(&glb, &old, &new)).unwrap_err());
        assert!(found.contains(expect), "{found}");
        let found = message(read_baked_ply(&replaced(&ply, &old, &new)).unwrap_err());
        assert!(found.contains(expect), "{found}");
    }
    for (old, new, expect) in [
        ("\"azimuths\":8", "\"azimuths\":7", "a filter of 7 azimuths; 4, 8, 16 or 32 exist"),
        ("_CURVATURE_FILTER_1", "_CURVATURE_FILTER_9", "no attribute _CURVATURE_FILTER_1"),
        ("_CURVATURE_FILTER_BOUND", "_CURVATURE_FILTER_BOUNT", "no attribute _CURVATURE_FILTER_BOUND"),
        ("\"cosine\":0.2", "\"cosine\":2.0", "lengths are finite and not negative"),
    ] {
        let found = message(read_baked_glb(&replaced(&glb, old.as_bytes(), new.as_bytes())).unwrap_err());
        assert!(found.contains(expect), "{found}");
    }
    let found = message(read_baked_ply(&replaced(&ply, b"filter_7", b"filter_x")).unwrap_err());
    assert!(found.contains("no property filter_7"), "{found}");
}

#[test]
fn points_without_triangles_survive() {
    let mesh = Mesh::new(vec![Vec3::x(), Vec3::y()], vec![]).unwrap();
    let baked = BakedMesh::new(mesh, vec![VertexCurvature::undetermined(Status::Isolated); 2], provenance());
    for (name, back) in [
        ("glb", round_trip(&baked, "a.glb", |p, b| write_glb(p, b).unwrap())),
        ("ply", round_trip(&baked, "a.ply", |p, b| write_ply(p, b, Precision::F32).unwrap())),
    ] {
        check_against(&baked, &back, to_f32);
        assert_eq!(back.mesh().positions().len(), 2, "{name}");
    }
}

#[test]
fn what_does_not_fit_is_named_and_nothing_is_written() {
    let directory = tempdir().unwrap();
    let path = directory.path().join("a.glb");
    let (mesh, mut curvature) = sample().into_parts();
    curvature[3].principal.as_mut().unwrap().kappa_max = 1e39;
    let baked = BakedMesh::new(mesh, curvature, provenance());
    let error = write_glb(&path, &baked).unwrap_err().to_string();
    assert!(error.contains("vertex 3: the curvature 1e39"), "{error}");
    assert!(write_ply(&path, &baked, Precision::F32).is_err());
    let empty = BakedMesh::new(Mesh::new(vec![], vec![]).unwrap(), vec![], provenance());
    assert!(matches!(write_glb(&path, &empty), Err(WriteError::Empty)));
    assert_eq!(std::fs::read_dir(directory.path()).unwrap().count(), 0);
    write_ply(&directory.path().join("a.ply"), &baked, Precision::F64).unwrap();
}

#[test]
fn damaged_files_are_refused_without_a_panic() {
    let directory = tempdir().unwrap();
    let (glb, ply) = (directory.path().join("a.glb"), directory.path().join("a.ply"));
    write_glb(&glb, &sample()).unwrap();
    write_ply(&ply, &sample(), Precision::F32).unwrap();
    let (glb, ply) = (std::fs::read(glb).unwrap(), std::fs::read(ply).unwrap());
    for cut in 0..glb.len() {
        assert!(read_baked_glb(&glb[..cut]).is_err(), "{cut} bytes of the .glb");
    }
    for cut in 0..ply.len() {
        assert!(read_baked_ply(&ply[..cut]).is_err(), "{cut} bytes of the .ply");
    }
    // Any single wrong byte may be harmless or refused, but never a panic.
    for at in 0..glb.len() {
        let mut bytes = glb.clone();
        bytes[at] ^= 0x55;
        let _ = read_baked_glb(&bytes);
    }
    for at in 0..ply.len() {
        let mut bytes = ply.clone();
        bytes[at] ^= 0x55;
        let _ = read_baked_ply(&bytes);
    }
}

#[test]
fn other_versions_and_other_files_are_told_apart() {
    let directory = tempdir().unwrap();
    let path = directory.path().join("a.ply");
    let mut baked = sample();
    baked.provenance.format_version = FORMAT_VERSION + 1;
    write_ply(&path, &baked, Precision::F32).unwrap();
    assert!(matches!(read_baked(&path), Err(ReadError::Version { .. })));
    std::fs::write(&path, "ply\nformat ascii 1.0\nelement vertex 0\nend_header\n").unwrap();
    assert!(matches!(read_baked(&path), Err(ReadError::NotBaked)));
    assert!(matches!(read_baked(Path::new("a.obj")), Err(ReadError::Extension(_))));
}

fn any_f64() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-1.0..1.0f64, -30..30i32).prop_map(|(x, e)| x * 2f64.powi(e)),
        Just(0.0),
        Just(-0.0),
        -1e37..1e37f64,
        // Around where the flip of v rounds.
        (-4.0..4.0f64).prop_map(|x| 1.0 + x * f64::EPSILON),
        -1e-12..1e-12f64,
    ]
}

fn any_curvature() -> impl Strategy<Value = VertexCurvature> {
    let vector =
        || [any_f64(), any_f64(), any_f64()].prop_filter("a direction", |v| v.iter().any(|&x| x != 0.0));
    let known = (any_f64(), any_f64(), vector(), vector(), any_f64(), 0..6u8);
    let known = known.prop_map(|(a, b, d1, d2, error, status)| {
        let unit = |v: [f64; 3]| {
            let v = Vec3::from(v);
            (v / v.amax()).normalize()
        };
        let principal = Principal { kappa_max: a.max(b), kappa_min: a.min(b), d1: unit(d1), d2: unit(d2) };
        let status = Status::from_number(status).unwrap();
        VertexCurvature { principal: Some(principal), error: error.abs(), status }
    });
    let unknown = (0..6u8).prop_map(|s| VertexCurvature::undetermined(Status::from_number(s).unwrap()));
    prop_oneof![4 => known, 1 => unknown]
}

prop_compose! {
    fn any_baked()(count in 3..9usize)(
        positions in prop::collection::vec([any_f64(), any_f64(), any_f64()], count),
        normals in prop::collection::vec([any_f64(), any_f64(), any_f64()], count),
        uvs in prop::collection::vec([any_f64(), any_f64()], count),
        curvature in prop::collection::vec(any_curvature(), count),
    ) -> BakedMesh {
        let positions = positions.into_iter().map(Vec3::from).collect();
        let normals = normals.into_iter().map(Vec3::from).collect();
        let mesh = Mesh::new(positions, vec![[0, 1, 2], [0, 0, 2]]).unwrap();
        let mesh = mesh.with_normals(normals).unwrap().with_uv_set(uvs).unwrap();
        BakedMesh::new(mesh, curvature, provenance())
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn any_bake_settles_after_one_trip(baked in any_baked()) {
        // `round_trip` asserts that the second file equals the first.
        round_trip(&baked, "a.glb", |p, b| write_glb(p, b).unwrap());
        round_trip(&baked, "a.ply", |p, b| write_ply(p, b, Precision::F32).unwrap());
        let back = round_trip(&baked, "a.ply", |p, b| write_ply(p, b, Precision::F64).unwrap());
        prop_assert_eq!(back.curvature(), baked.curvature());
        prop_assert_eq!(back.mesh().uv_sets(), baked.mesh().uv_sets());
        prop_assert_eq!(back.mesh().positions(), baked.mesh().positions());
    }
}
