//! [`Glance`]: a ray where it enters the surface, as tables want to know it.
//!
//! What [`Start`](super::start::Start) is for walks, but in single precision, and for the three corners of the triangle at once: a table's own
//! numbers are coarser by far.

use glam::{BVec4A, Mat4, Vec3A, Vec4, Vec4Swizzles};

use super::direction::{NORMAL_INCIDENCE_SINE, unit};
use super::surface_field::{CurvatureField, SurfacePoint};
use crate::Vec3;
use crate::curvature::Principal;

/// An estimate in single precision: principal directions, each with its curvature times a length of the surface, so that no scale of a mesh
/// is beyond the range. All zero where there is none.
#[derive(Debug, Clone, Copy)]
pub(super) struct Axes {
    max: Vec4,
    min: Vec4,
}

impl Axes {
    /// `scale` is the length that curvatures are multiplied by.
    pub fn new(principal: Option<&Principal>, scale: f64) -> Self {
        /// Beyond this there is no telling apart, but sums and products stay finite.
        const MOST: f64 = 1e30;
        let axis = |d: &Vec3, kappa: f64| narrow(d).extend(single((kappa * scale).clamp(-MOST, MOST)));
        match principal {
            None => Self { max: Vec4::ZERO, min: Vec4::ZERO },
            Some(p) => Self { max: axis(&p.d1, p.kappa_max), min: axis(&p.d2, p.kappa_min) },
        }
    }
}

/// A ray at the point where it enters the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Glance {
    pub triangle: usize,
    corners: Lanes,
    w: Vec3A,
    /// Cosine between the direction to the viewer and the normal, 0 where it is below the horizon.
    pub cosine: f32,
    /// `None` at normal incidence.
    pub section: Option<GlanceSection>,
    /// The length that curvatures in here are multiplied by.
    scale: f64,
}

/// The plane in which the ray travels.
#[derive(Debug, Clone, Copy)]
pub(super) struct GlanceSection {
    /// Unit, tangential, the way the ray travels.
    pub forward: Vec3A,
    /// Unit normal of the plane.
    pub plane: Vec3A,
    kappa: f32,
}

impl Glance {
    /// `None` if no corner has an estimate, or `w` has no direction.
    #[inline]
    pub fn new(field: &CurvatureField<'_>, point: SurfacePoint, w: &Vec3) -> Option<Self> {
        /// Sine below which the plane of ray and normal is that of their rounding.
        const NO_PLANE_SINE: f32 = 1e-6;
        let w = Vec3A::from(narrow(&unit(w)?));
        let corners = Lanes::of(field, point)?;
        let normal = corners.normal();
        let facing = normal.dot(w);
        let tangential = normal * facing - w;
        let sine = tangential.length();
        let has_plane = normal != Vec3A::ZERO && sine >= NO_PLANE_SINE;
        let section = has_plane.then(|| {
            let forward = tangential / sine;
            let plane = normal.cross(forward).normalize();
            GlanceSection { forward, plane, kappa: corners.section(plane) }
        });
        let (cosine, scale) = (facing.clamp(0.0, 1.0), field.bend_scale());
        Some(Self { triangle: point.triangle, corners, w, cosine, section, scale })
    }

    /// Curvature along the ray (Kuznetsov et al. 2022, eqs. 1 and 4), 1/length.
    #[inline]
    pub fn along(&self) -> f64 {
        f64::from(self.corners.along(self.w)) / self.scale
    }

    /// Curvature of the section and more, which is in the field's unit of length; 1/length.
    #[inline]
    pub fn kappa(&self, section: &GlanceSection, more: f32) -> f64 {
        f64::from(section.kappa + more) / self.scale
    }

    /// Curvature across the plane of the section, by Euler's theorem; the mean curvature where there is no plane. 1/length.
    #[inline]
    pub fn across(&self) -> f64 {
        let sum = self.corners.sum_of_principals();
        f64::from(self.section.map_or(sum / 2.0, |section| sum - section.kappa)) / self.scale
    }

    /// The corners that count, with their shares, and how far a tangential direction is turned from each corner's first axis to its second: a
    /// share of a whole turn in `[0, 1]`.
    #[inline]
    pub fn turns(&self, forward: Vec3A) -> impl Iterator<Item = (usize, f32, f32)> {
        let [x, y] = self.corners.coordinates(forward);
        let (turns, weights) = (turn(x, y).to_array(), self.corners.weights.to_array());
        let vertices = self.corners.vertices;
        (0..3)
            .map(move |k| (vertices[k] as usize, weights[k], turns[k]))
            .filter(|(_, weight, _)| *weight > 0.0)
    }
}

/// Estimates at the corners of a triangle, one in every lane; the fourth lane is empty.
#[derive(Debug, Clone, Copy)]
struct Lanes {
    vertices: [u32; 3],
    /// Of sum one; zero for corners without an estimate.
    weights: Vec4,
    /// x, y and z of both axes.
    max: [Vec4; 3],
    min: [Vec4; 3],
    kappa_max: Vec4,
    kappa_min: Vec4,
}

impl Lanes {
    #[inline]
    fn of(field: &CurvatureField<'_>, point: SurfacePoint) -> Option<Self> {
        let vertices = field.surface().triangles()[point.triangle];
        let (axes, [a, b, c]) = (field.axes(), vertices);
        let [a, b, c] = [&axes[a as usize], &axes[b as usize], &axes[c as usize]];
        let lanes = |[a, b, c]: [Vec4; 3]| {
            let lanes = Mat4::from_cols(a, b, c, Vec4::ZERO).transpose();
            ([lanes.x_axis, lanes.y_axis, lanes.z_axis], lanes.w_axis)
        };
        let (max, kappa_max) = lanes([a.max, b.max, c.max]);
        let (min, kappa_min) = lanes([a.min, b.min, c.min]);
        let is_known = dot(max, max).cmpgt(Vec4::splat(0.5));
        let [wa, wb, wc] = point.barycentric.map(single);
        let weights = Vec4::select(is_known, Vec4::new(wa, wb, wc, 0.0), Vec4::ZERO).max(Vec4::ZERO);
        let sum = weights.element_sum();
        (sum > 0.0).then(|| Self { vertices, weights: weights / sum, max, min, kappa_max, kappa_min })
    }

    /// Unit; zero where the corners' normals cancel.
    #[inline]
    fn normal(&self) -> Vec3A {
        /// Length of a mean of unit vectors below which its direction is that of their rounding.
        const NO_NORMAL: f32 = 1e-6;
        let ([ax, ay, az], [bx, by, bz]) = (self.max, self.min);
        let sum =
            [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx].map(|lanes| lanes.dot(self.weights));
        let sum = Vec3A::from(sum);
        let length = sum.length();
        if length > NO_NORMAL { sum / length } else { Vec3A::ZERO }
    }

    /// Along both axes.
    #[inline]
    fn coordinates(&self, v: Vec3A) -> [Vec4; 2] {
        let v = Vec4::from((v, 0.0));
        let v = [v.xxxx(), v.yyyy(), v.zzzz()];
        [dot(self.max, v), dot(self.min, v)]
    }

    #[inline]
    fn mean(&self) -> Vec4 {
        0.5 * (self.kappa_max + self.kappa_min)
    }

    #[inline]
    fn sum_of_principals(&self) -> f32 {
        (self.kappa_max + self.kappa_min).dot(self.weights)
    }

    /// Curvature of the section by a plane; a corner in whose tangent plane it lies has its mean curvature.
    #[inline]
    fn section(&self, plane: Vec3A) -> f32 {
        let [y, x] = self.coordinates(plane);
        self.euler([x, y]).dot(self.weights)
    }

    /// As [`kappa_along`](super::direction::kappa_along) has it.
    #[inline]
    fn along(&self, w: Vec3A) -> f32 {
        let [x, y] = self.coordinates(w);
        let squared = x * x + y * y;
        let limit = single(NORMAL_INCIDENCE_SINE * NORMAL_INCIDENCE_SINE);
        let steep = (1.0 - squared / limit).max(Vec4::ZERO);
        let along = self.euler([x, y]);
        (along + steep * steep * (self.mean() - along)).dot(self.weights)
    }

    /// Curvature in the tangential direction with these coordinates, by Euler's theorem.
    #[inline]
    fn euler(&self, [x, y]: [Vec4; 2]) -> Vec4 {
        let squared = x * x + y * y;
        // Smaller coordinates are those of rounding.
        let is_known: BVec4A = squared.cmpgt(Vec4::splat(1e-13));
        let quotient = (self.kappa_max * x * x + self.kappa_min * y * y) / squared;
        Vec4::select(is_known, quotient, self.mean())
    }
}

#[inline]
fn dot([ax, ay, az]: [Vec4; 3], [bx, by, bz]: [Vec4; 3]) -> Vec4 {
    ax * bx + ay * by + az * bz
}

/// The angle from the first axis to vectors with these coordinates, as a share of a whole turn, in `[0, 1]`; 0 for no vector.
///
/// Off by 5e-7 at most, which is nothing against the distance of two entries of a table.
#[inline]
fn turn(x: Vec4, y: Vec4) -> Vec4 {
    /// Of `atan(t) / (2 pi)` over odd powers of `t` in `[0, 1]`; the polynomial whose largest error is least.
    const ODD: [f32; 6] =
        [0.159_151_51, -0.052_936_483, 0.030_780_405, -0.018_467_907, 0.008_312_047, -0.001_839_806_7];
    let (across, along) = (x.abs(), y.abs());
    let is_steep = across.cmplt(along);
    let large = across.max(along);
    let t = across.min(along) / Vec4::select(large.cmpgt(Vec4::ZERO), large, Vec4::ONE);
    let squared = t * t;
    let of_eighth = t * ODD.iter().rev().fold(Vec4::ZERO, |sum, c| sum * squared + *c);
    let of_quarter = Vec4::select(is_steep, 0.25 - of_eighth, of_eighth);
    let of_half = Vec4::select(x.cmplt(Vec4::ZERO), 0.5 - of_quarter, of_quarter);
    Vec4::select(y.cmplt(Vec4::ZERO), 1.0 - of_half, of_half)
}

#[inline]
fn narrow(v: &Vec3) -> glam::Vec3 {
    glam::Vec3::new(single(v.x), single(v.y), single(v.z))
}

#[inline]
#[allow(clippy::cast_possible_truncation, reason = "single precision is the point")]
fn single(x: f64) -> f32 {
    x as f32
}

/// Back to double precision.
#[inline]
pub(super) fn widen(v: Vec3A) -> Vec3 {
    Vec3::new(v.x.into(), v.y.into(), v.z.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_the_library() {
        for step in -4000..=4000 {
            let angle = f64::from(step) * (std::f64::consts::PI / 4000.0);
            let lengths = [1e-30, 0.3, 1.0, 1e30];
            let coordinates = |of: f64| Vec4::from(lengths.map(|length| single(length * of)));
            let found = turn(coordinates(angle.cos()), coordinates(angle.sin()));
            let expected = (angle / std::f64::consts::TAU).rem_euclid(1.0);
            for found in found.to_array() {
                let apart = (f64::from(found) - expected).abs();
                // A turn is none.
                assert!(apart.min(1.0 - apart) < 5e-7, "{angle}: {found} {expected}");
            }
        }
        let axes = turn(Vec4::new(1.0, 0.0, -3.0, 0.0), Vec4::new(0.0, 2.0, 0.0, -4.0));
        assert_eq!(axes.to_array(), [0.0, 0.25, 0.5, 0.75]);
        assert_eq!(turn(Vec4::ZERO, Vec4::ZERO), Vec4::ZERO);
    }
}
