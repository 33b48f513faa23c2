//! [`Bvh`]: triangles, and a hierarchy that finds what a ray meets.

use glam::Vec3;

use super::build::{WideTree, build};
use super::kernels::{Simd, trace_all, traverse};
use super::ray::{Hit, PreparedRay, Ray};
use super::surface_point::SurfacePoint;
use super::triangle;

/// Triangles that rays can be traced against. Both sides of a triangle are hit.
pub struct Bvh {
    triangles: Vec<[Vec3; 3]>,
    pub(super) tree: WideTree,
    simd: Simd,
}

impl std::fmt::Debug for Bvh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let nodes = self.tree.nodes.len();
        write!(f, "Bvh({} triangles, {nodes} nodes, {:?})", self.triangles.len(), self.simd)
    }
}

impl Bvh {
    /// Builds the hierarchy. There may be no triangles at all; degenerate ones are kept and never hit.
    ///
    /// # Panics
    ///
    /// If a coordinate is not finite.
    #[must_use]
    pub fn new(triangles: Vec<[Vec3; 3]>) -> Self {
        for (index, corners) in triangles.iter().enumerate() {
            assert!(corners.iter().all(|p| p.is_finite()), "triangle {index} is not finite: {corners:?}");
        }
        let tree = build(&triangles);
        Self { triangles, tree, simd: Simd::detect() }
    }

    /// Builds the hierarchy over the triangles of a mesh, rounded to single precision.
    ///
    /// # Panics
    ///
    /// If a coordinate is too large for `f32`.
    #[must_use]
    pub fn from_mesh(mesh: &crate::Mesh) -> Self {
        let triangle = |t: usize| mesh.corners(t).map(|p| to_f32(&p));
        Self::new((0..mesh.triangles().len()).map(triangle).collect())
    }

    /// The corners of all triangles, in the order they were given.
    #[must_use]
    pub fn triangles(&self) -> &[[Vec3; 3]] {
        &self.triangles
    }

    /// The hit with the smallest `t`; of several the one with the lowest triangle index.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<Hit> {
        let prepared = PreparedRay::new(ray);
        let found = traverse::<false>(self.simd, &self.tree, prepared)?;
        let corners = self.triangles[found.triangle as usize].map(|p| p.to_array());
        let hit = triangle::intersect(&prepared, &corners).expect("the kernels agree with the scalar test");
        let [u, v, w] = hit.weights;
        let scale = 1.0 / (u + v + w);
        Some(Hit { t: hit.t, triangle: found.triangle, barycentrics: [u * scale, v * scale, w * scale] })
    }

    /// [`Self::closest_hit`] of every ray. Rays that follow each other and go much the same way, as those of neighbouring pixels or towards one
    /// distant light do, are traced together, which is faster.
    ///
    /// # Panics
    ///
    /// If there are not as many answers as rays.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), hits.len(), "an answer for every ray");
        self.closest_hits_with(self.simd, rays, hits);
    }

    pub(super) fn closest_hits_with(&self, simd: Simd, rays: &[Ray], hits: &mut [Option<Hit>]) {
        trace_all(simd, &self.tree, rays, hits, |ray| self.closest_hit(ray), |hit| hit);
    }

    /// Whether the ray meets any triangle at `0 < t <= t_max`.
    #[must_use]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        traverse::<true>(self.simd, &self.tree, PreparedRay::new(ray)).is_some()
    }

    /// [`Self::any_hit`] of every ray; traced together as by [`Self::closest_hits`].
    ///
    /// # Panics
    ///
    /// If there are not as many answers as rays.
    pub fn any_hits(&self, rays: &[Ray], any: &mut [bool]) {
        assert_eq!(rays.len(), any.len(), "an answer for every ray");
        trace_all(self.simd, &self.tree, rays, any, |ray| self.any_hit(ray), |hit| hit.is_some());
    }

    /// The point of a hit, with its error bound and the triangle's normal.
    ///
    /// # Panics
    ///
    /// If the hit's triangle is out of range.
    #[must_use]
    pub fn surface_point(&self, hit: &Hit) -> SurfacePoint {
        SurfacePoint::new(self.triangles[hit.triangle as usize], hit.barycentrics)
    }
}

/// The one place where geometry becomes single precision for tracing.
#[must_use]
#[allow(clippy::cast_possible_truncation, reason = "the conversion that f32 tracing asks for")]
pub fn to_f32(v: &crate::Vec3) -> Vec3 {
    Vec3::new(v.x as f32, v.y as f32, v.z as f32)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// `SplitMix64`, so that tests need no generator crate.
    struct Random(u64);

    impl Random {
        fn unit(&mut self) -> f32 {
            self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
        }

        fn vector(&mut self) -> Vec3 {
            Vec3::new(self.unit(), self.unit(), self.unit()) * 2.0 - 1.0
        }
    }

    /// A closed sphere-like mesh with needle triangles at its poles.
    fn ball(rings: usize, scale: f32, center: Vec3) -> Vec<[Vec3; 3]> {
        let point = |i: usize, j: usize| {
            let (theta, phi) = (
                std::f32::consts::PI * i as f32 / rings as f32,
                std::f32::consts::TAU * (j % (2 * rings)) as f32 / (2 * rings) as f32,
            );
            // The poles must be one point each.
            let radius = if i == 0 || i == rings { 0.0 } else { theta.sin() };
            center + scale * Vec3::new(radius * phi.cos(), theta.cos(), radius * phi.sin())
        };
        let mut triangles = Vec::new();
        for i in 0..rings {
            for j in 0..2 * rings {
                let (a, b, c, d) = (point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1));
                triangles.push([a, c, b]);
                triangles.push([a, d, c]);
            }
        }
        triangles
    }

    fn brute_force(triangles: &[[Vec3; 3]], ray: &Ray) -> Option<(f32, u32)> {
        let prepared = PreparedRay::new(ray);
        let mut best: Option<(f32, u32)> = None;
        for (index, corners) in (0..).zip(triangles) {
            if let Some(hit) = triangle::intersect(&prepared, &corners.map(|p| p.to_array()))
                && best.is_none_or(|(t, _)| hit.t < t)
            {
                best = Some((hit.t, index));
            }
        }
        best
    }

    /// All kernels against testing every triangle.
    fn check(bvh: &Bvh, ray: &Ray) {
        let expected = brute_force(&bvh.triangles, ray);
        let mut kernels = vec![Simd::Portable, Simd::detect()];
        kernels.dedup();
        for simd in kernels {
            let found = traverse::<false>(simd, &bvh.tree, PreparedRay::new(ray)).map(|f| f.triangle);
            assert_eq!(found, expected.map(|e| e.1), "{simd:?}, {ray:?}, expected {expected:?}");
            let any = traverse::<true>(simd, &bvh.tree, PreparedRay::new(ray)).is_some();
            assert_eq!(any, expected.is_some(), "{simd:?}, {ray:?}");
        }
    }

    #[test]
    fn agrees_with_brute_force_at_every_scale() {
        let mut random = Random(1);
        for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
            let soup: Vec<[Vec3; 3]> = (0..400)
                .map(|_| {
                    let center = random.vector();
                    [(); 3].map(|()| scale * (center + 0.2 * random.vector()))
                })
                .collect();
            let bvh = Bvh::new(soup);
            for _ in 0..2000 {
                let ray = Ray::new(scale * 2.0 * random.vector(), random.vector());
                check(&bvh, &ray);
                check(&bvh, &Ray { t_max: scale, ..ray });
            }
        }
    }

    #[test]
    fn agrees_with_brute_force_on_degenerate_triangles() {
        let mut random = Random(2);
        let mut soup = ball(6, 1.0, Vec3::ZERO);
        for _ in 0..50 {
            let (p, q) = (random.vector(), random.vector());
            soup.extend([[p, p, p], [p, q, q], [p, 0.5 * (p + q), q], [p, q, p + 1e-7 * random.vector()]]);
        }
        soup.extend(ball(6, 1.0, Vec3::ZERO)); // every triangle twice: ties
        soup.extend(vec![soup[0]; 40]); // no split separates these
        let bvh = Bvh::new(soup);
        for _ in 0..3000 {
            check(&bvh, &Ray::new(2.0 * random.vector(), random.vector()));
        }
        // Axis-parallel rays, also in the planes of boxes and triangles.
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            for i in -4_i16..=4 {
                let offset = f32::from(i) * 0.25 * Vec3::new(axis.z, axis.x, axis.y).abs();
                check(&bvh, &Ray::new(offset - 3.0 * axis, axis));
                check(&bvh, &Ray::new(offset, axis));
            }
        }
    }

    #[test]
    fn nothing_is_hit_without_triangles_or_with_nan() {
        assert_eq!(Bvh::new(Vec::new()).closest_hit(&Ray::new(Vec3::ZERO, Vec3::X)), None);
        let bvh = Bvh::new(ball(4, 1.0, Vec3::ZERO));
        assert_eq!(bvh.closest_hit(&Ray::new(Vec3::NAN, Vec3::X)), None);
        assert_eq!(bvh.closest_hit(&Ray::new(Vec3::ZERO, Vec3::NAN)), None);
    }

    /// Triangles whose sizes and distances grow geometrically, which makes the tree a list.
    pub(in super::super) fn list() -> Vec<[Vec3; 3]> {
        let triangle = |i: i32| {
            let s = 1.25_f32.powi(i - 120);
            [Vec3::new(s, 0.0, 0.0), Vec3::new(s, s, 0.0), Vec3::new(s, 0.0, s)]
        };
        (0..240).map(triangle).collect()
    }

    #[test]
    fn deep_trees_use_the_heap_stack() {
        let bvh = Bvh::new(list());
        for i in 0..200 {
            let s = 1.25_f32.powi(i - 120);
            check(&bvh, &Ray::new(Vec3::new(-1.0, 0.2 * s, 0.3 * s), Vec3::X));
        }
    }

    proptest! {
        /// From inside a closed mesh there is no way out, least of all exactly through edges and vertices.
        #[test]
        fn closed_meshes_do_not_leak(
            exponent in -6_i32..=6,
            shift in prop::array::uniform3(-3.0_f32..3.0),
            start in prop::array::uniform3(-0.3_f32..0.3),
            seed in any::<u64>(),
        ) {
            let scale = 10.0_f32.powi(exponent);
            let center = scale * Vec3::from(shift);
            let bvh = Bvh::new(ball(9, scale, center));
            let origin = center + scale * Vec3::from(start);
            let mut random = Random(seed);
            for corners in bvh.triangles() {
                let along = random.unit();
                for (i, &corner) in corners.iter().enumerate() {
                    let next = corners[(i + 1) % 3];
                    for target in [corner, 0.5 * (corner + next), corner + along * (next - corner)] {
                        let ray = Ray::new(origin, target - origin);
                        prop_assert!(bvh.closest_hit(&ray).is_some(), "leak at {target:?} of {ray:?}");
                        prop_assert!(bvh.any_hit(&ray));
                    }
                }
            }
        }

        /// The same from points on the walls, and right into corners, of a room of two triangles a side.
        #[test]
        fn rooms_do_not_leak(exponent in -6_i32..=6, shift in prop::array::uniform3(-2.0_f32..2.0), seed in any::<u64>()) {
            let scale = 10.0_f32.powi(exponent);
            let corner = |i: usize| {
                let side = |axis: usize| if i >> axis & 1 == 0 { -1.0 } else { 1.0 };
                scale * (Vec3::from(shift) + Vec3::new(side(0), side(1), side(2)))
            };
            let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
            let room = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
            let bvh = Bvh::new(room.map(|t| t.map(corner)).collect());
            let mut random = Random(seed);
            let mut origin = scale * Vec3::from(shift);
            for _ in 0..300 {
                let aim = corner((0..8).find(|&i| random.unit() < 1.0 / (8 - i) as f32).unwrap_or(7)) - origin;
                let direction = if random.unit() < 0.3 && aim.length() > 0.0 { aim } else { random.vector() };
                let inside = bvh.closest_hit(&Ray::new(origin, direction));
                // A direction into the wall that the origin is on leaves the room.
                let Some(hit) = inside else { break };
                let point = bvh.surface_point(&hit);
                origin = point.origin_towards(-direction);
                // Within its rounding error of another wall a point can lie behind that one.
                let in_plane = (origin - scale * Vec3::from(shift)) * (Vec3::ONE - point.normal.abs());
                if in_plane.abs().max_element() > scale * (1.0 - 4e-6) {
                    origin = scale * Vec3::from(shift);
                    continue;
                }
                let back = Ray::new(origin, -point.normal.dot(direction) * point.normal);
                let opposite = bvh.closest_hit(&back);
                prop_assert!(opposite.is_some_and(|h| h.t * back.direction.length() > scale), "{back:?}: {opposite:?}");
            }
        }

        /// A ray that leaves a convex body from its surface meets nothing; one that goes in comes out again.
        #[test]
        fn leaving_a_surface_does_not_hit_it_again(
            exponent in -6_i32..=6,
            shift in prop::array::uniform3(-30.0_f32..30.0),
            seed in any::<u64>(),
        ) {
            let scale = 10.0_f32.powi(exponent);
            let center = scale * Vec3::from(shift);
            let bvh = Bvh::new(ball(9, scale, center));
            let mut random = Random(seed);
            for _ in 0..200 {
                let origin = center + 4.0 * scale * random.vector().normalize();
                let ray = Ray::new(origin, center + 0.5 * scale * random.vector() - origin);
                let hit = bvh.closest_hit(&ray).expect("aims at the ball");
                let point = bvh.surface_point(&hit);
                let out = if random.unit() < 0.5 {
                    random.vector()
                } else {
                    // Grazing.
                    random.vector().cross(point.normal) + 1e-4 * random.unit() * point.normal
                };
                let out = if out.dot(point.normal) < 0.0 { -out } else { out };
                let escape = Ray::new(point.origin_towards(out), out);
                prop_assert!(!bvh.any_hit(&escape), "{escape:?} from {point:?} hits {:?}", bvh.closest_hit(&escape));
                let inward = Ray::new(point.origin_towards(-point.normal), -point.normal);
                let exit = bvh.closest_hit(&inward);
                prop_assert!(exit.is_some_and(|h| h.triangle != hit.triangle), "{inward:?} leaks");
            }
        }
    }
}
