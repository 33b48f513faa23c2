use osculate_geom::rays::{Bvh, Ray};

use super::*;
use crate::micro::{MicroReport, TileMesh};

fn fields() -> impl Iterator<Item = (&'static str, fn(Vec2) -> Texel)> {
    BUILTINS.iter().filter_map(|builtin| match builtin.recipe {
        Recipe::Field { texel, .. } => Some((builtin.name, texel)),
        Recipe::Mesh(_) => None,
    })
}

#[test]
fn recipes_repeat() {
    for (name, texel) in fields() {
        let differs = |i: u16| {
            // Off the lattice, and over the border.
            let uv = Vec2::new(f32::from(i) * 0.013_7 - 0.5, f32::from(i) * 0.031_3 - 0.25).fract();
            // Rounding of the coordinates (1e-7) times slopes of up to a thousand.
            (texel(uv).height - texel(uv + Vec2::new(1.0, -1.0)).height).abs() > 1e-4
        };
        // Where a strand or a plate ends, a point may change sides.
        let changed = (0..400).filter(|&i| differs(i)).count();
        assert!(changed <= 8, "{name}: {changed} of 400 points");
    }
}

#[test]
fn height_fields_fill_their_depth_tile_and_are_coloured() {
    for builtin in &BUILTINS {
        let micro = builtin.build(96);
        let Geometry::HeightField(field) = &micro.geometry else { continue };
        let report = MicroReport::new(&micro);
        let facts = report.field.unwrap();
        assert_eq!(report.z, [-0.1, 0.0], "{}", builtin.name);
        assert!(facts.seam.u.ratio < 2.0 && facts.seam.v.ratio < 2.0, "{}: {facts:?}", builtin.name);
        assert!((0.2..0.9).contains(&facts.mean_height), "{}: {facts:?}", builtin.name);
        let albedo = field.maps().albedo.texels();
        let mean = albedo.iter().sum::<Vec3>() / albedo.len() as f32;
        let spread = albedo.iter().map(|c| (*c - mean).length()).sum::<f32>() / albedo.len() as f32;
        assert!(spread > 0.02, "{}: varied, {spread}", builtin.name);
        assert!(albedo.iter().all(|c| c.max_element() < 0.95), "{}: no paint is whiter", builtin.name);
    }
}

/// Twice the texels hardly change the surface: nothing in it is finer than they can show.
#[test]
fn height_fields_are_band_limited() {
    for (name, texel) in fields() {
        let (coarse, fine) = (height_field(128, 0.1, texel), height_field(256, 0.1, texel));
        let points =
            (0..4000_u32).map(|i| Vec2::new((i as f32 * 0.618_034).fract(), (i as f32 * 0.754_878).fract()));
        let squares = points.map(|uv| (coarse.heights().lookup(uv) - fine.heights().lookup(uv)).powi(2));
        let difference = (squares.sum::<f32>() / 4000.0).sqrt();
        assert!(difference < 0.06, "{name}: {difference} of the depth");
    }
}

#[test]
fn the_same_recipe_gives_the_same_bits() {
    for name in ["cave", "basket-weave"] {
        let build = || Builtin::find(name).unwrap().build(32).hash();
        assert_eq!(build(), build());
    }
    assert!(Builtin::find("Stone 1").is_some() && Builtin::find("perforated_leather").is_some());
    assert!(Builtin::find("stone").is_none());
}

fn tile_mesh(name: &str) -> TileMesh {
    match Builtin::find(name).unwrap().build(1).geometry {
        Geometry::TileMesh(mesh) => mesh,
        Geometry::HeightField(_) => panic!("{name} is a mesh"),
    }
}

/// All copies over the unit square and half a tile around.
fn copies(mesh: &TileMesh) -> Vec<[Vec3; 3]> {
    let shifts =
        (-2..=2_i8).flat_map(|y| (-2..=2_i8).map(move |x| Vec3::new(f32::from(x), f32::from(y), 0.0)));
    shifts
        .flat_map(|shift| {
            mesh.triangles().iter().map(move |t| t.vertices.map(|v| mesh.positions()[v as usize] + shift))
        })
        .filter(|t| t.iter().any(|p| p.truncate().abs().max_element() < 1.6))
        .collect()
}

/// From above, every ray enters and leaves matter in turn: the solids are closed, turned outward, and do not run into one another.
#[test]
fn meshes_are_solid_and_strands_do_not_meet() {
    for (name, open) in [("basket-weave", 0.08..0.25), ("perforated-leather", 0.2..0.3)] {
        let mesh = tile_mesh(name);
        let bvh = Bvh::new(copies(&mesh));
        let mut through = 0;
        for i in 0..6000_u16 {
            let uv = Vec2::new((f32::from(i) * 0.618_034).fract(), (f32::from(i) * 0.754_878).fract());
            let mut origin = uv.extend(1.0);
            let mut crossings = Vec::new();
            while let Some(hit) = bvh.closest_hit(&Ray::new(origin, Vec3::NEG_Z)) {
                let point = bvh.surface_point(&hit);
                crossings.push(point.normal.z > 0.0);
                origin = point.position - Vec3::Z * 1e-6;
            }
            through += usize::from(crossings.is_empty());
            let in_turn =
                crossings.iter().enumerate().all(|(k, &up)| up == (k % 2 == 0)) && crossings.len() % 2 == 0;
            // Rays along a wall graze it.
            let grazing = crossings.len() % 2 == 1;
            assert!(in_turn || grazing, "{name} at {uv}: {crossings:?}");
        }
        let share = through as f32 / 6000.0;
        assert!(open.contains(&share), "{name}: {share} is open");
        let report =
            MicroReport::new(&Microstructure { name: String::new(), geometry: Geometry::TileMesh(mesh) });
        assert!((report.mesh.unwrap().see_through - share).abs() < 0.02);
        // No vertex of the grain need lie on the very top of a pebble: a thousandth of the depth is left.
        let filled = report.z[1] > -1e-3 * report.depth && report.z[0] < -0.999 * report.depth;
        assert!(filled, "{name} fills its depth: {:?}", report.z);
    }
}

/// A basket is no height field: there are rays through more than one strand.
#[test]
fn threads_pass_over_and_under() {
    let bvh = Bvh::new(copies(&tile_mesh("basket-weave")));
    let crossing = |k: f32| {
        let origin = Vec3::new((k + 0.5) / 6.0, 0.5 / 6.0 + 0.029, 1.0);
        bvh.closest_hit(&Ray::new(origin, Vec3::NEG_Z)).map(|hit| 1.0 - hit.t).unwrap()
    };
    // Red on top lies at 0, grey on top below it, in turn.
    let heights: Vec<f32> = [0.0, 1.0, 2.0, 3.0].map(crossing).to_vec();
    assert!((heights[0] - heights[2]).abs() < 1e-4 && (heights[1] - heights[3]).abs() < 1e-4, "{heights:?}");
    assert!((heights[0] - heights[1]).abs() > 0.002, "{heights:?}");
}
