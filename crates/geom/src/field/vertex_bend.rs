//! [`VertexBend`]: an estimate as walks want it, in half the memory.
//!
//! A walk visits vertices all over the surface, and waits for their memory more than for anything else. Single precision is enough where
//! it looks at them: what it takes from here is of second order in the length of an edge.

use crate::Vec3;
use crate::curvature::Principal;

/// Normal and curvature tensor of the fitted surface at a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct VertexBend {
    normal: [f32; 3],
    /// `xx, yy, zz, xy, yz, zx`, times a length of the surface, so that no scale of a mesh is beyond the range of single precision.
    tensor: [f32; 6],
    /// Whether there is an estimate.
    pub is_known: bool,
}

impl VertexBend {
    /// `scale` is the length that curvatures are multiplied by.
    #[allow(clippy::cast_possible_truncation, reason = "single precision is the point")]
    pub fn new(principal: Option<&Principal>, scale: f64) -> Self {
        let Some(p) = principal else { return Self { normal: [0.0; 3], tensor: [0.0; 6], is_known: false } };
        let form = |i: usize, j: usize| {
            let [max, min] = [p.d1[i] * p.d1[j], p.d2[i] * p.d2[j]];
            (p.kappa_max * scale * max + p.kappa_min * scale * min) as f32
        };
        let n = p.normal();
        Self {
            normal: [n.x as f32, n.y as f32, n.z as f32],
            tensor: [form(0, 0), form(1, 1), form(2, 2), form(0, 1), form(1, 2), form(2, 0)],
            is_known: true,
        }
    }

    /// Outward unit normal.
    pub fn normal(&self) -> Vec3 {
        let [x, y, z] = self.normal.map(f64::from);
        Vec3::new(x, y, z)
    }

    /// The second fundamental form of a vector, times the scale.
    pub fn form(&self, v: &Vec3) -> f64 {
        let [xx, yy, zz, xy, yz, zx] = self.tensor.map(f64::from);
        xx * v.x * v.x
            + yy * v.y * v.y
            + zz * v.z * v.z
            + 2.0 * (xy * v.x * v.y + yz * v.y * v.z + zx * v.z * v.x)
    }

    /// Curvature of the section by a plane with this normal, times the scale; the mean curvature where the plane is the tangent plane.
    pub fn section(&self, plane_normal: &Vec3) -> f64 {
        let along = plane_normal.cross(&self.normal());
        let squared = along.norm_squared();
        if squared > 0.0 {
            self.form(&along) / squared
        } else {
            0.5 * self.tensor[..3].iter().copied().map(f64::from).sum::<f64>()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::direction::section_curvature;
    use super::*;

    /// Against the estimate itself, at scales far beyond the range of single precision.
    #[test]
    fn is_the_estimate_in_single_precision() {
        let d1 = Vec3::new(0.6, 0.0, 0.8);
        let d2 = Vec3::new(-0.64, 0.6, 0.48);
        for scale in [1e-150, 1.0, 1e150] {
            let principal = Principal { kappa_max: 3.0 / scale, kappa_min: -0.5 / scale, d1, d2 };
            let bend = VertexBend::new(Some(&principal), scale);
            assert!((bend.normal() - principal.normal()).norm() < 1e-7);
            for v in [Vec3::x(), Vec3::new(0.3, -0.9, 0.2), Vec3::new(-1.0, 0.5, 2.0)] {
                let form = (v.transpose() * principal.tensor() * v)[0] * scale;
                assert!((bend.form(&v) - form).abs() < 1e-6 * v.norm_squared(), "{} {form}", bend.form(&v));
                let expected = section_curvature(&principal, &v.normalize()) * scale;
                let found = bend.section(&v.normalize());
                assert!((found - expected).abs() < 1e-5, "{found} {expected}");
            }
        }
        let sphere = Principal { kappa_max: 2.0, kappa_min: 2.0, d1: Vec3::x(), d2: Vec3::y() };
        assert!((VertexBend::new(Some(&sphere), 1.0).section(&Vec3::z()) - 2.0).abs() < 1e-6);
    }
}
