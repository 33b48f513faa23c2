//! [`MeshTracer`]: a tile mesh that is bent for each query on its own.

use glam::{Vec2, Vec3};

use super::bent_mesh::{BentMesh, MeshRay, TileBvh};
use super::first_features;
use super::tile::TileSurface;
use super::transport::{PatchSample, Space, Transport};
use super::{TileOptions, TilePoint};
use crate::micro::TileMesh;
use crate::model::TextureShape;
use crate::query::Query;
use crate::random::Random;
use crate::samples::Features;

/// Traces a tile mesh. One hierarchy serves all curvatures and directions, where a [`Patch`](super::Patch) serves one of each.
#[derive(Debug)]
pub(crate) struct MeshTracer {
    tile: TileSurface,
    flat: TileBvh,
}

/// What stands at a point of the tile, seen from straight above.
#[derive(Debug, Clone, Copy)]
pub(super) struct Top {
    pub z: f32,
    pub point: TilePoint,
}

impl MeshTracer {
    /// Prepares a mesh; of the options only the shading matters.
    pub fn new(mesh: &TileMesh, options: &TileOptions) -> Self {
        // Triangles are bent exactly, so that no edge is too long for a curvature.
        let tile = TileSurface::from_mesh(mesh, &TileOptions { largest_curvature: 0.0, ..*options });
        let flat = TileBvh::new(&tile);
        Self { tile, flat }
    }

    fn bent(&self, uv: Vec2, wo: Vec3, kappa: f32, wi: Vec3) -> (BentMesh<'_>, MeshRay) {
        BentMesh::new(&self.tile, &self.flat, uv, kappa, wo, wi)
    }

    /// Whether a ray from the viewer hits.
    pub fn hits(&self, uv: Vec2, wo: Vec3, kappa: f32) -> bool {
        let (space, ray) = self.bent(uv, wo, kappa, Vec3::Z);
        wo.z > 0.0 && space.hits(&ray)
    }

    /// Texture coordinates of the first hit less those of the entry point; `None` where the ray passes.
    pub fn offset(&self, uv: Vec2, wo: Vec3, kappa: f32) -> Option<Vec2> {
        let (space, ray) = self.bent(uv, wo, kappa, Vec3::Z);
        if wo.z > 0.0 { space.closest(&ray).as_ref().map(BentMesh::offset) } else { None }
    }

    /// Where a query's ray hits, and the mean of so many paths from there; `None` where it passes.
    pub fn sample(
        &self,
        transport: &Transport,
        query: &Query,
        paths: u32,
        random: &mut Random,
    ) -> Option<PatchSample> {
        let Query { uv, wo, wi, kappa_hat } = *query;
        if wo.z <= 0.0 {
            return None;
        }
        let (space, ray) = self.bent(uv, wo, kappa_hat, wi);
        let hit = space.closest(&ray)?;
        let sum: Vec3 = (0..paths).map(|_| transport.radiance(&space, ray, hit, random)).sum();
        Some(PatchSample { offset: BentMesh::offset(&hit), rgb: sum / paths as f32 })
    }

    /// What feature textures may begin with.
    pub fn first_features(&self, which: Features, shape: TextureShape, random: &mut Random) -> Vec<f32> {
        let maps = match which {
            Features::Rays => first_features::cover(&|uv| self.top(uv), self.tile.depth(), shape),
            Features::Colour => first_features::tops(&|uv| self.top(uv), self.tile.depth(), shape),
        };
        first_features::standardised(&maps, shape, random)
    }

    /// What is seen from straight above, on a flat surface.
    fn top(&self, uv: Vec2) -> Option<Top> {
        let (triangle, weights, z) = self.flat.under(uv)?;
        Some(Top { z, point: self.tile.point(triangle, weights, uv) })
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::micro::{Geometry, Microstructure, TileTriangle};
    use crate::model::{Architecture, Way};
    use crate::patch::test_fields::strip;
    use crate::patch::{Patch, TransportOptions};

    /// A level strap without end: a ray along it lands where the layer down to the strap ends, or passes over it.
    #[test]
    fn a_strap_is_hit_where_its_layer_ends() {
        let tracer = MeshTracer::new(&strap_in_a_layer(), &TileOptions::default());
        let layer = Architecture::paper(0.05);
        let (mut hits, mut random) = (0, Random::new(4, 4, 4));
        for kappa in [0.0, 1e-5, 0.5, 2.5, -0.5, -2.5] {
            for _ in 0..300 {
                let (uv, cosine) =
                    (Vec2::new(random.unit(), 0.3 + 0.4 * random.unit()), random.unit().max(0.05));
                let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
                let way = layer.way_length(Way::Through, wo, kappa);
                let over = kappa > 0.0 && cosine * cosine < 0.05 * kappa * (2.0 - 0.05 * kappa);
                let found = tracer.offset(uv, wo, kappa);
                assert_eq!(found.is_some(), tracer.hits(uv, wo, kappa), "{kappa} {wo}");
                let Some(offset) = found else {
                    assert!(over, "{kappa} {wo}: is not hit");
                    continue;
                };
                hits += 1;
                // A piece may be off by a thousandth of the depth, over the slope of the ray there.
                let slope = (cosine * cosine - (0.1 * kappa).max(0.0)).max(0.0025).sqrt();
                let near = 2e-4 / slope + 1e-5;
                assert!(
                    !over && (offset.x + way).abs() < near && offset.y.abs() < 1e-6,
                    "{kappa} {wo}: {offset} {way}"
                );
            }
        }
        assert!(hits > 1500, "{hits}");
        // Straight down beside the strap.
        assert!(
            !tracer.hits(Vec2::new(0.5, 0.1), Vec3::Z, 1.0) && tracer.hits(Vec2::new(0.5, 0.5), Vec3::Z, 1.0)
        );
        assert!(!tracer.hits(Vec2::splat(0.5), Vec3::NEG_Z, 1.0));
    }

    /// The strap, and beside it two slivers at the top and the floor of its layer: rays are followed through all of that.
    fn strap_in_a_layer() -> TileMesh {
        let strap = strip(0.1);
        let sliver = [0.0, -0.1]
            .map(|z| [Vec2::ZERO, Vec2::new(0.01, 0.0), Vec2::new(0.0, 0.01)].map(|p| p.extend(z)));
        let positions: Vec<Vec3> = strap.positions().iter().chain(sliver.as_flattened()).copied().collect();
        let triangle = |first: u32| TileTriangle { vertices: [first, first + 1, first + 2], material: 0 };
        let triangles = strap.triangles().iter().copied().chain([triangle(4), triangle(7)]).collect();
        TileMesh::new(positions, vec![Vec3::Z; 10], triangles, strap.materials().to_vec(), 0.1)
    }

    /// Against the triangles of patches: two methods that share the bend and the BRDF.
    #[test]
    fn agrees_with_patches() {
        let micro = Microstructure::load("basket-weave").expect("a procedural one").micro;
        let Geometry::TileMesh(mesh) = &micro.geometry else { panic!("a mesh") };
        let tracer = MeshTracer::new(mesh, &TileOptions::default());
        let tile = Arc::new(TileSurface::from_mesh(mesh, &TileOptions::default()));
        let transport = Transport::new(TransportOptions::default());
        let mut random = Random::new(5, 5, 5);
        for (kappa, rotation) in [(1.5, 0.7), (0.0, 2.0), (-1.5, 4.0)] {
            let patch = Patch::new(tile.clone(), kappa, rotation);
            let (mut far, mut torn, mut hits) = (0, 0, 0);
            let (mut sums, mut squares) = ([0.0_f64; 2], 0.0);
            for _ in 0..4000 {
                let mut unit = || random.unit();
                let (uv, cosine) = (Vec2::new(unit(), unit()), 1.0 - unit());
                let wo = ((1.0 - cosine * cosine).sqrt() * -Vec2::from_angle(rotation)).extend(cosine);
                let wi = Vec3::new(unit() - 0.5, unit() - 0.5, unit()).normalize();
                let query = Query { uv, wo, wi, kappa_hat: kappa };
                let a = patch.sample(&transport, uv, wo, wi, &mut random);
                let b = tracer.sample(&transport, &query, 1, &mut random);
                let (Some(a), Some(b)) = (a, b) else {
                    torn += u32::from(a.is_some() != b.is_some());
                    continue;
                };
                hits += 1;
                far += u32::from((a.offset - b.offset).length() > 0.01);
                let pair = [a.rgb, b.rgb].map(|rgb| f64::from(rgb.y));
                sums = [sums[0] + pair[0], sums[1] + pair[1]];
                squares += (pair[0] - pair[1]).powi(2);
            }
            assert!(hits > 2500 && far * 100 < hits && torn < 20, "{kappa}: {far} {torn} of {hits}");
            let deviation = squares.sqrt();
            assert!(
                (sums[0] - sums[1]).abs() < 4.0 * deviation + 0.002 * sums[0],
                "{kappa}: {sums:?} +- {deviation}"
            );
        }
    }

    /// Tints vary linearly over the triangles that were given, also where they are split.
    #[test]
    fn tints_reach_the_reflectance() {
        let mesh = strip(0.1);
        let tints = mesh.positions().iter().map(|p| Vec3::new(p.x, p.y, 1.0)).collect();
        let tracer = MeshTracer::new(&mesh.with_tints(tints), &TileOptions::default());
        for uv in [Vec2::new(0.1, 0.3), Vec2::new(0.51, 0.7), Vec2::new(0.93, 0.41)] {
            let albedo = tracer.top(uv).expect("on the strap").point.reflectance.albedo;
            assert!(albedo.abs_diff_eq(0.5 * uv.extend(1.0), 1e-6), "{uv}: {albedo}");
        }
    }

    #[test]
    fn features_tell_holes_from_threads() {
        let tracer = MeshTracer::new(&strip(0.1), &TileOptions::default());
        let shape = TextureShape { width: 16, height: 16, channels: 8 };
        let texels = tracer.first_features(Features::Rays, shape, &mut Random::new(1, 1, 1));
        // The strap lies between v = 1/4 and 3/4.
        for (row, texel) in texels.chunks_exact(8).enumerate().map(|(i, texel)| (i / 16, texel)) {
            assert_eq!(texel[0] > 0.0, (4..12).contains(&row), "row {row}: {}", texel[0]);
        }
    }
}
