//! Orthonormal frames around normals.

use glam::Vec3;

/// Two unit vectors that make a right-handed frame `(t, b, n)` with the unit vector `n`.
///
/// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
#[must_use]
#[inline]
pub fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// An orthonormal frame whose z axis is the normal.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Unit x axis.
    pub t: Vec3,
    /// Unit y axis.
    pub b: Vec3,
    /// Unit z axis, the normal.
    pub n: Vec3,
}

impl Frame {
    /// A frame around a unit normal.
    #[must_use]
    #[inline]
    pub fn new(n: Vec3) -> Self {
        let (t, b) = tangents(n);
        Self { t, b, n }
    }

    /// The vector in this frame.
    #[must_use]
    #[inline]
    pub fn local_from_world(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.t), v.dot(self.b), v.dot(self.n))
    }

    /// The vector outside this frame.
    #[must_use]
    #[inline]
    pub fn world_from_local(&self, v: Vec3) -> Vec3 {
        v.x * self.t + v.y * self.b + v.z * self.n
    }
}
