//! Small vector helpers that sampling and shading share.

use glam::Vec3;

/// Rec. 709 luminance of a linear RGB colour.
pub(crate) fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

/// Two unit vectors that make a right-handed frame `(t, b, n)` with the unit vector `n`.
///
/// Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
pub(crate) fn tangents(n: Vec3) -> (Vec3, Vec3) {
    let sign = 1.0_f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), Vec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// An orthonormal frame whose z axis is the normal.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Frame {
    pub t: Vec3,
    pub b: Vec3,
    pub n: Vec3,
}

impl Frame {
    pub(crate) fn new(n: Vec3) -> Self {
        let (t, b) = tangents(n);
        Self { t, b, n }
    }

    pub(crate) fn local_from_world(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.t), v.dot(self.b), v.dot(self.n))
    }

    pub(crate) fn world_from_local(&self, v: Vec3) -> Vec3 {
        v.x * self.t + v.y * self.b + v.z * self.n
    }
}

/// A uniform point in the unit disk (Shirley and Chiu's concentric map).
pub(crate) fn concentric_disk(u: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0, 0.0];
    }
    let quarter = std::f32::consts::FRAC_PI_4;
    let (r, phi) =
        if a.abs() > b.abs() { (a, quarter * (b / a)) } else { (b, 2.0 * quarter - quarter * (a / b)) };
    [r * phi.cos(), r * phi.sin()]
}

/// A cosine-distributed direction around +z.
pub(crate) fn cosine_hemisphere(u: [f32; 2]) -> Vec3 {
    let [x, y] = concentric_disk(u);
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// The power heuristic (Veach 1997) with exponent 2 for one sample from each of two densities.
pub(crate) fn power_heuristic(this: f32, other: f32) -> f32 {
    // Divided first, so that densities near the largest float do not overflow.
    let ratio = other / this;
    1.0 / (1.0 + ratio * ratio)
}
