//! The section as a plane curve: points of it, pieces between them, and the curve that has the interpolated curvature.

/// A point of the lifted section in the plane of ray and normal.
#[derive(Debug, Clone, Copy)]
pub(super) struct Planar {
    /// Distance along the ray of the point's foot on it.
    pub t: f64,
    /// Height above the ray.
    pub above: f64,
    /// The surface normal, as far as it lies in the plane, along the ray and across it.
    pub normal: [f64; 2],
    /// Curvature of the section as a plane curve.
    pub kappa: f64,
}

/// The curve that has the interpolated curvature, in the frame of tangent and normal at the entry.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Integrated {
    /// Of the tangent against that at the entry.
    pub angle: f64,
    pub x: f64,
    pub z: f64,
}

impl Integrated {
    /// Goes on over a chord of a curve whose curvature changes linearly: its direction is the mean of the tangent's.
    pub fn add(&mut self, chord: f64, from: f64, to: f64) {
        let (sin, cos) = (self.angle - (2.0 * from + to) / 6.0 * chord).sin_cos();
        self.x += chord * cos;
        self.z += chord * sin;
        self.angle -= 0.5 * (from + to) * chord;
    }
}

/// Length of a plane vector. The plain form: squares of lengths of a mesh neither overflow nor vanish, and `hypot` was a
/// twentieth of a picture's time.
pub(super) fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// A piece of the section between two lifted points, bent by their mean curvature.
pub(super) struct Curve {
    pub from: Planar,
    pub to: Planar,
    pub span: f64,
}

impl Curve {
    /// Half the second difference: how far the middle's tangent offset bends away, along ray and across it.
    fn bulge(&self) -> [f64; 2] {
        let bend = 0.25 * (self.from.kappa + self.to.kappa) * self.span * self.span;
        // Across the chord, which has the direction half way between the tangents at its ends.
        let normal = [0, 1].map(|k| self.from.normal[k] + self.to.normal[k]);
        let length = length(normal[0], normal[1]);
        if length > 0.0 { normal.map(|x| bend * x / length) } else { [0.0; 2] }
    }

    /// Distance along the ray and height above it at a share of the piece.
    pub fn at(&self, share: f64) -> [f64; 2] {
        let [bulge_t, bulge_above] = self.bulge();
        let bent = share * (1.0 - share);
        [
            self.from.t + share * (self.to.t - self.from.t) + bent * bulge_t,
            self.from.above + share * (self.to.above - self.from.above) + bent * bulge_above,
        ]
    }

    /// Share at which the section comes down to the ray, ahead of the entry. Only its two ends are looked at: what dips
    /// below the ray and back within one triangle is below the mesh's resolution.
    pub fn exit(&self) -> Option<f64> {
        let (h0, h1) = (self.from.above, self.to.above);
        if h1 > 0.0 || self.to.t <= 0.0 {
            return None;
        }
        // h0 + share (h1 - h0 + bulge) - share^2 bulge = 0 with a root in [0, 1], by the form without cancellation.
        let bulge = self.bulge()[1];
        let (a, b) = (-bulge, h1 - h0 + bulge);
        let q = -0.5 * (b + b.signum() * (b * b - 4.0 * a * h0).max(0.0).sqrt());
        let roots = [h0 / q, q / a];
        let inside = roots.into_iter().find(|root| (0.0..=1.0).contains(root));
        Some(inside.unwrap_or_else(|| if h0 > h1 { (h0 / (h0 - h1)).clamp(0.0, 1.0) } else { 1.0 }))
    }
}
