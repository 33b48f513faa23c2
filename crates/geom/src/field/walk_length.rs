//! [`WalkLength`]: how far past a point a filter looks.

use serde::{Deserialize, Serialize};

/// How far past the point a filter looks, as arc length on the surface.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WalkLength {
    /// As far as the ray can matter: until it has left the shell of the material, or is below it. World units.
    ///
    /// The material lies between the surface and `depth` below it. The ray enters with the cosine `c` between it and the
    /// normal, on a circle of the local curvature `kappa`. After the distance `t` it is at the distance
    /// `sqrt(t^2 - 2 R c t + R^2)` from the centre, `R = 1 / kappa`, so it is out again at `2 c / kappa`, and below the
    /// material from the smaller root of `kappa t^2 - 2 c t + depth (2 - kappa depth) = 0`. What comes first counts, and no
    /// straight way within a mesh is longer than its bounding box's diagonal. The walk is the arc to the foot of that point.
    Shell {
        /// Depth of the material, world units, not negative.
        depth: f64,
    },
    /// As [`Shell`](Self::Shell), for rays of one elevation: what a table that knows azimuths only can be made for.
    ShellAt {
        /// Depth of the material, world units, not negative.
        depth: f64,
        /// Cosine between ray and normal, in `(0, 1]`.
        cosine: f64,
    },
    /// The same for all rays, world units, not negative.
    Fixed(f64),
}

impl WalkLength {
    /// Share of a mesh's bounding box diagonal that is taken as the depth where no material says it: about what a coarse
    /// microstructure has.
    pub const DEFAULT_DEPTH_SHARE: f64 = 0.02;

    /// Cosine that tables are made for: 78 degrees from the normal, grazing enough for silhouettes to form. Closer to the
    /// horizon the walk on a flat surface grows without bound.
    pub const TABLE_COSINE: f64 = 0.2;

    /// The default for a mesh with this bounding box diagonal: [`Shell`](Self::Shell) with a depth of 2 % of it.
    #[must_use]
    pub fn of_mesh(diagonal: f64) -> Self {
        Self::Shell { depth: Self::DEFAULT_DEPTH_SHARE * diagonal }
    }

    /// Whether its lengths are finite and not negative, and its cosine is in `(0, 1]`.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let is_length = |x: f64| x.is_finite() && x >= 0.0;
        match *self {
            Self::Shell { depth } => is_length(depth),
            Self::ShellAt { depth, cosine } => is_length(depth) && cosine > 0.0 && cosine <= 1.0,
            Self::Fixed(length) => is_length(length),
        }
    }

    /// The rule that stands in for this one in a table of azimuths.
    #[must_use]
    pub fn for_table(self) -> Self {
        match self {
            Self::Shell { depth } => Self::ShellAt { depth, cosine: Self::TABLE_COSINE },
            other => other,
        }
    }

    /// Whether both are the same rule, with numbers that differ by no more than a thousandth.
    #[must_use]
    pub fn is_about(&self, other: &Self) -> bool {
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-3 * a.abs().max(b.abs());
        match (*self, *other) {
            (Self::Fixed(a), Self::Fixed(b)) => close(a, b),
            (Self::Shell { depth: a }, Self::Shell { depth: b }) => close(a, b),
            (Self::ShellAt { depth: a, cosine }, Self::ShellAt { depth: b, cosine: other }) => {
                close(a, b) && close(cosine, other)
            }
            _ => false,
        }
    }

    /// Arc length for a ray that enters with this cosine where the surface has the curvature `kappa`; `diagonal` is that of
    /// the bounding box. Never negative; at most `diagonal` times pi / 2 but for [`Fixed`](Self::Fixed).
    #[must_use]
    pub fn resolve(&self, kappa: f64, cosine: f64, diagonal: f64) -> f64 {
        match *self {
            Self::Fixed(length) => length,
            Self::Shell { depth } => arc(kappa, cosine, travel(kappa, cosine, depth).min(diagonal)),
            Self::ShellAt { depth, cosine } => arc(kappa, cosine, travel(kappa, cosine, depth).min(diagonal)),
        }
    }

    /// The walk on a flat surface at the cosine of tables: what [`SkipBounds`](super::SkipBounds) are made for. Most walks are
    /// shorter, some on convex rises are longer.
    #[must_use]
    pub fn nominal(&self, diagonal: f64) -> f64 {
        self.for_table().resolve(0.0, Self::TABLE_COSINE, diagonal)
    }

    /// No walk is longer, whatever the curvature.
    ///
    /// At the cosine `c` a ray is out of a convex circle before `t = 4 depth / c`: it comes out at `2 c / kappa` only where
    /// `c^2 < kappa depth (2 - kappa depth) < 2 kappa depth`, and is below the material after `2 depth / c` otherwise. The arc of
    /// a chord is `asin(c) / c` times as long. On flat and concave surfaces it is below the material sooner.
    #[must_use]
    pub fn longest(&self, diagonal: f64) -> f64 {
        let most = std::f64::consts::FRAC_PI_2 * diagonal;
        match *self {
            Self::Fixed(length) => length,
            Self::Shell { .. } => most,
            Self::ShellAt { depth, cosine } => (4.0 * depth / cosine * (cosine.asin() / cosine)).min(most),
        }
    }
}

/// How far a ray travels below a circle before it is out again or below `depth`; infinite if it never is.
fn travel(kappa: f64, cosine: f64, depth: f64) -> f64 {
    // Below the centre of a convex circle there is nothing more.
    let depth = if kappa * depth > 1.0 { 1.0 / kappa } else { depth };
    let reach = depth * (2.0 - kappa * depth);
    let discriminant = cosine * cosine - kappa * reach;
    if discriminant < 0.0 {
        return 2.0 * cosine / kappa;
    }
    let denominator = cosine + discriminant.sqrt();
    if denominator > 0.0 { reach / denominator } else { f64::INFINITY }
}

/// Arc from the entry to the foot of the point at distance `t` on the ray: `atan2(kappa s t, 1 - kappa c t) / kappa`.
fn arc(kappa: f64, cosine: f64, t: f64) -> f64 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (across, towards) = (sine * t, 1.0 - kappa * cosine * t);
    let angle = kappa * across;
    // Below 1e-4 the next term of the series, angle^4 / 5, is under the rounding of 1.
    if towards > 0.0 && (angle / towards).abs() < 1e-4 {
        let x = angle / towards;
        return across / towards * (1.0 - x * x / 3.0);
    }
    angle.atan2(towards) / kappa
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distance of a point of the ray below the circle, from its definition; positive inside of the material.
    fn below(kappa: f64, cosine: f64, t: f64) -> f64 {
        let (x, z) = ((1.0 - cosine * cosine).sqrt() * t, -cosine * t);
        let radius = 1.0 / kappa;
        radius - radius.signum() * x.hypot(z + radius)
    }

    #[test]
    fn rules_are_about_the_same_up_to_a_thousandth() {
        let shell = |depth| WalkLength::Shell { depth };
        assert!(shell(0.1).is_about(&shell(f64::from(0.1_f32))));
        assert!(!shell(0.1).is_about(&shell(0.1002)) && !shell(0.1).is_about(&WalkLength::Fixed(0.1)));
        assert!(shell(0.1).for_table().is_about(&shell(0.10001).for_table()));
        assert!(!shell(0.1).for_table().is_about(&WalkLength::ShellAt { depth: 0.1, cosine: 0.3 }));
    }

    #[test]
    fn travel_ends_where_the_ray_is_out_or_below() {
        for kappa in [-3.0, -0.5, 0.01, 0.5, 3.0] {
            for cosine in [1e-8, 0.01, 0.2, 0.7, 1.0] {
                for depth in [0.01, 0.1, 0.3] {
                    let t = travel(kappa, cosine, depth);
                    let end = below(kappa, cosine, t);
                    // Roots of a quadratic in f64; heights are differences of numbers of the radius' size.
                    let tolerance = 1e-12 * (1.0 + 1.0 / kappa.abs());
                    assert!(
                        end.abs() < tolerance || (end - depth).abs() < tolerance,
                        "{kappa} {cosine} {depth}: {end} below after {t}"
                    );
                    // And nowhere before.
                    for step in 1..100 {
                        let on_the_way = below(kappa, cosine, t * f64::from(step) / 100.0);
                        assert!((-tolerance..depth + tolerance).contains(&on_the_way));
                    }
                }
            }
        }
    }

    #[test]
    fn flat_is_the_limit_of_both_signs() {
        let rule = WalkLength::Shell { depth: 0.1 };
        for cosine in [0.05_f64, 0.3, 0.9] {
            let flat = rule.resolve(0.0, cosine, 1e9);
            let sine = (1.0 - cosine * cosine).sqrt();
            assert!((flat - 0.1 * sine / cosine).abs() < 1e-15, "{flat}");
            for kappa in [1e-14, -1e-14, 1e-9, -1e-9, 1e-5, -1e-5] {
                let near = rule.resolve(kappa, cosine, 1e9);
                // The next order is kappa times the length squared over the cosine.
                assert!(
                    (near - flat).abs() <= 10.0 * f64::abs(kappa) * flat * flat / cosine + 1e-15,
                    "{near} {flat}"
                );
            }
        }
    }

    #[test]
    fn arcs_on_the_circle() {
        for radius in [0.5, -2.0] {
            for angle in [1e-6, 1e-3, 0.3, 1.2_f64] {
                // The chord over `angle` has the elevation angle / 2.
                let (cosine, chord) = ((angle / 2.0).sin(), 2.0 * f64::abs(radius) * (angle / 2.0).sin());
                let found = if radius > 0.0 {
                    arc(1.0 / radius, cosine, chord)
                } else {
                    // Beyond a concave circle the foot is nearer than the point.
                    arc(1.0 / radius, 0.0, f64::abs(radius) * angle.tan())
                };
                assert!((found - f64::abs(radius) * angle).abs() < 1e-12 * angle, "{radius} {angle} {found}");
            }
        }
    }

    #[test]
    fn none_is_longer_than_the_longest() {
        let rule = WalkLength::ShellAt { depth: 0.02, cosine: 0.2 };
        let mut most = 0.0_f64;
        for step in -4000..4000 {
            let kappa = f64::from(step) * 0.005;
            most = most.max(rule.resolve(kappa, 0.9, 1e9));
        }
        let longest = rule.longest(1e9);
        assert!(most <= longest && most > 0.95 * longest, "{most} {longest}");
    }

    #[test]
    fn never_negative_nan_or_beyond_the_box() {
        for kappa in [-1e300, -1e9, -1.0, -1e-300, 0.0, 1e-300, 1.0, 1e9, 1e300] {
            for cosine in [0.0, 1e-300, 1e-8, 0.5, 1.0] {
                for depth in [0.0, 1e-9, 1.0, 1e9] {
                    let length = WalkLength::Shell { depth }.resolve(kappa, cosine, 2.0);
                    assert!((0.0..=2.0 * 1.6).contains(&length), "{kappa} {cosine} {depth}: {length}");
                }
            }
        }
    }
}
