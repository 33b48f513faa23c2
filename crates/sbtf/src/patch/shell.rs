//! [`Shell`]: the space between two cylinders that holds all triangles of a bent patch.

use glam::DVec3;

use super::Bend;

/// Heights between which the triangles lie, and the curvature.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shell {
    pub bend: Bend,
    pub low: f64,
    pub high: f64,
}

impl Shell {
    /// The first stretch of a line, from `t >= 0` on, that is inside; `None` if the line does not enter. The end is infinite where the
    /// shell is flat and the line parallel.
    ///
    /// A line that leaves the shell is not followed further, also where it would come back: through the upper side it has left
    /// the bounding surface, through the lower one the material.
    pub fn span(&self, origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
        let top = self.crossing(origin, direction, self.high);
        let start = if top.c <= 0.0 { 0.0 } else { top.first(0.0, Way::Falling)? };
        let up = top.first(start, Way::Rising).unwrap_or(f64::INFINITY);
        let down =
            self.crossing(origin, direction, self.low).first(start, Way::Falling).unwrap_or(f64::INFINITY);
        let end = up.min(down);
        (end > start).then_some([start, end])
    }

    /// The parameter at which a line that starts below the upper side rises through it.
    pub fn exit(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        self.crossing(origin, direction, self.high).first(0.0, Way::Rising)
    }

    /// A quadratic in the line's parameter with the sign of the point's height over `z`: `k (X^2 + Z^2) + 2 Z - 2 z - k z^2`, which is
    /// twice that height for `k = 0`.
    fn crossing(&self, o: DVec3, d: DVec3, z: f64) -> Quadratic {
        let k = self.bend.kappa;
        let z = self.bend.height(z);
        Quadratic {
            a: k * (d.x * d.x + d.z * d.z),
            half_b: k * (o.x * d.x + o.z * d.z) + d.z,
            c: k * (o.x * o.x + o.z * o.z) + 2.0 * (o.z - z) - k * z * z,
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Way {
    Rising,
    Falling,
}

/// `a t^2 + 2 half_b t + c`.
struct Quadratic {
    a: f64,
    half_b: f64,
    c: f64,
}

impl Quadratic {
    /// The root after `from` at which the value rises or falls; there is at most one of each.
    fn first(&self, from: f64, way: Way) -> Option<f64> {
        let discriminant = self.half_b * self.half_b - self.a * self.c;
        if discriminant < 0.0 {
            return None;
        }
        let root = discriminant.sqrt();
        // The slope at the rising root is +2 root, at the falling one -2 root; each is written without cancellation.
        let t = match way {
            Way::Rising if self.half_b > 0.0 => -self.c / (self.half_b + root),
            Way::Rising => (root - self.half_b) / self.a,
            Way::Falling if self.half_b < 0.0 => self.c / (root - self.half_b),
            Way::Falling => (-root - self.half_b) / self.a,
        };
        (t.is_finite() && t > from).then_some(t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spans against stepping along the line.
    #[test]
    fn spans_are_where_the_height_is() {
        let directions =
            [(1.0, -0.3), (1.0, 0.0), (1.0, 0.2), (0.01, -1.0), (-1.0, 1e-3), (-1.0, -0.05), (0.0, 1.0)];
        for kappa in [-1.5, -1e-9, 0.0, 1e-9, 1.5] {
            let shell = Shell { bend: Bend { kappa }, low: -0.2, high: -0.05 };
            for (x, z) in [(0.1, 0.0), (0.0, -0.1), (-0.2, -0.06), (0.3, -0.19)] {
                for (dx, dz) in directions {
                    let (o, d) = (shell.bend.point(DVec3::new(x, 0.0, z)), DVec3::new(dx, 0.3, dz));
                    let step = 1e-4;
                    let inside = |i: u32| {
                        let height = shell.bend.unbend(o + step * f64::from(i) * d).z;
                        (shell.low..=shell.high).contains(&height)
                    };
                    let first = (0..15_000).find(|&i| inside(i));
                    let last = first.and_then(|f| (f..15_000).find(|&i| !inside(i)));
                    let Some([start, end]) = shell.span(o, d) else {
                        assert!(first.is_none(), "{kappa} {o} {d}: inside at {first:?}");
                        continue;
                    };
                    let near = |t: f64, i: Option<u32>| match i {
                        Some(i) => (t - step * f64::from(i)).abs() < 2.0 * step,
                        None => t > 1.4,
                    };
                    assert!(
                        near(start, first) && near(end, last),
                        "{kappa} {o} {d}: {start} {end}, {first:?} {last:?}"
                    );
                }
            }
        }
    }
}
