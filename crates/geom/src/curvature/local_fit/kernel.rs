//! Accumulation of the normal equations: points are streamed once, and nothing but the sums is kept.
//!
//! A polynomial of degree `d` has normal equations whose entries are all among the moments `sum w u^p v^q` with
//! `p + q <= 2 d`. Eight points at a time are turned into the frame, weighed and bent; then each point's `u^0 ... u^7` fill
//! one register, which is multiplied by `v` again and again, so that a register of sums holds all moments with one `q` and
//! nothing is summed across lanes.

use super::cloud::Cloud;
use crate::Vec3;
use crate::curvature::shape_operator::Frame;

/// Rows of moments for the highest degree, 4.
pub(super) const MOMENT_ROWS: usize = 9;
/// Rows of moments of the heights for that degree.
pub(super) const HEIGHT_ROWS: usize = 5;

/// Squared distance from the axis, in units of the neighbourhood, within which the direction of a chord fades out. Larger: spheres
/// are no longer quadrics to 1e-6. Smaller: the vertex's own direction, which is rounding, would count.
const ABOVE: f64 = 1e-6;

/// Moments of points `(u, v)` with heights `h`.
#[derive(Debug, Clone, Default)]
pub(super) struct Moments {
    /// `rows[q][p] = sum w u^p v^q`, complete for `p <= 7`; row 0 is moved by one: `rows[0][p] = sum w u^(p + 1)`.
    pub(super) rows: [[f64; 8]; MOMENT_ROWS],
    /// `heights[q][p] = sum w h u^p v^q`.
    pub(super) heights: [[f64; 8]; HEIGHT_ROWS],
    /// `sum w`.
    pub(super) weight: f64,
    /// `sum w h^2`.
    pub(super) squares: f64,
    /// How many points have a weight.
    pub(super) count: f64,
}

/// How points become `(u, v, h, w)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Axes of the fit; `n` is a unit vector.
    pub(super) frame: Frame,
    /// Where the fit's origin lies, as a world-space offset from the vertex.
    pub(super) origin: Vec3,
    /// Length that becomes 1.
    pub(super) length: f64,
    /// Third fundamental form `[uu, uv, vv]` of the surface that is bent into a paraboloid, in units of `length`; zero
    /// leaves heights as they are.
    pub(super) third: [f64; 3],
    /// What a squared distance on the cloud's scale is multiplied by to be 1 at the rim.
    pub(super) inverse_squared: f64,
}

/// Moments of the first `count` points for a fit of degree `DEGREE`; rows that it has no use for are zero.
pub(super) fn accumulate<const DEGREE: usize>(cloud: &Cloud, count: usize, view: &View) -> Moments {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        #[allow(unsafe_code, reason = "calling a function compiled for AVX-512 requires it")]
        // SAFETY: the processor has AVX-512F, as was just checked.
        return unsafe { avx512::accumulate::<DEGREE>(cloud, count, view) };
    }
    portable::accumulate::<DEGREE>(cloud, count, view)
}

/// The accumulation for one set of lanes.
macro_rules! kernel {
    ($name:ident $(, $feature:literal)?) => {
        mod $name {
            use crate::curvature::lanes::$name::{Lane, add, div, dot, load, max, mul, powers, splat, store, sub};
            use super::{ABOVE, Cloud, Frame, HEIGHT_ROWS, MOMENT_ROWS, Moments, Vec3, View};

            $(#[target_feature(enable = $feature)])?
            pub(super) fn accumulate<const DEGREE: usize>(cloud: &Cloud, count: usize, view: &View) -> Moments {
                let mut rows = [splat(0.0); MOMENT_ROWS];
                let mut heights = [splat(0.0); HEIGHT_ROWS];
                let (mut weight, mut squares, mut weighted) = (0.0, 0.0, 0.0);
                let constants = Constants::new(view);
                let mut group = [[0.0; 8]; 4];
                for start in (0..count).step_by(8) {
                    project(&constants, cloud, start, &mut group);
                    let [us, vs, hs, ws] = &group;
                    for i in 0..(count - start).min(8) {
                        let (u, v, h, w) = (us[i], vs[i], hs[i], ws[i]);
                        if w <= 0.0 {
                            continue;
                        }
                        let (lane_v, lane_h) = (splat(v), splat(h));
                        let mut power = mul(powers(u), splat(w));
                        rows[0] = add(rows[0], mul(power, splat(u)));
                        heights[0] = add(heights[0], mul(power, lane_h));
                        for q in 1..=2 * DEGREE {
                            power = mul(power, lane_v);
                            rows[q] = add(rows[q], power);
                            if q <= DEGREE {
                                heights[q] = add(heights[q], mul(power, lane_h));
                            }
                        }
                        weight += w;
                        squares += w * h * h;
                        weighted += 1.0;
                    }
                }
                let mut moments = Moments { weight, squares, count: weighted, ..Moments::default() };
                for (lane, row) in rows.into_iter().zip(&mut moments.rows) {
                    store(lane, row);
                }
                for (lane, row) in heights.into_iter().zip(&mut moments.heights) {
                    store(lane, row);
                }
                moments
            }

            /// The constants of a [`View`] in registers.
            struct Constants {
                origin: [Lane; 3],
                axes: [[Lane; 3]; 3],
                normal: [Lane; 3],
                third: [Lane; 3],
                inverse_squared: Lane,
            }

            impl Constants {
                #[inline]
                $(#[target_feature(enable = $feature)])?
                fn new(view: &View) -> Self {
                    let inverse = 1.0 / view.length;
                    let Frame { t, s, n } = &view.frame;
                    let [uu, uv, vv] = view.third;
                    Self {
                        origin: splat_vector(&view.origin),
                        axes: [
                            splat_vector(&(t * inverse)),
                            splat_vector(&(s * inverse)),
                            splat_vector(&(n * inverse)),
                        ],
                        normal: splat_vector(n),
                        third: [splat(uu), splat(uv), splat(vv)],
                        inverse_squared: splat(view.inverse_squared),
                    }
                }
            }

            #[inline]
            $(#[target_feature(enable = $feature)])?
            fn splat_vector(v: &Vec3) -> [Lane; 3] {
                [splat(v.x), splat(v.y), splat(v.z)]
            }

            /// Writes `u`, `v`, bent `h` and weights of eight points.
            #[inline]
            $(#[target_feature(enable = $feature)])?
            fn project(constants: &Constants, cloud: &Cloud, start: usize, to: &mut [[f64; 8]; 4]) {
                let Constants { origin, axes, normal, third, inverse_squared } = constants;
                let offset = [
                    sub(load(cloud.group(0, start)), origin[0]),
                    sub(load(cloud.group(1, start)), origin[1]),
                    sub(load(cloud.group(2, start)), origin[2]),
                ];
                let (u, v, h) = (dot(&axes[0], &offset), dot(&axes[1], &offset), dot(&axes[2], &offset));
                // Bending, see the module `local_fit`: h (1 - III(p, p) / 4), along the chord.
                let (u2, v2, h2) = (mul(u, u), mul(v, v), mul(h, h));
                // Straight above the origin the chord has no tangential direction, and nothing is to be bent.
                let flat = add(add(u2, v2), splat(ABOVE));
                let form = add(add(mul(third[0], u2), mul(third[1], mul(u, v))), mul(third[2], v2));
                let chord = add(form, div(mul(form, h2), flat));
                let bent = mul(h, sub(splat(1.0), mul(chord, splat(0.25))));
                // Near neighbours count more; those that face away do not count.
                let normals = [
                    load(cloud.group(3, start)),
                    load(cloud.group(4, start)),
                    load(cloud.group(5, start)),
                ];
                let facing = max(dot(normal, &normals), splat(0.0));
                let fall = mul(mul(splat(0.9), load(cloud.group(6, start))), *inverse_squared);
                let weight = mul(facing, sub(splat(1.0), fall));
                store(u, &mut to[0]);
                store(v, &mut to[1]);
                store(bent, &mut to[2]);
                store(weight, &mut to[3]);
            }
        }
    };
}

kernel!(portable);
#[cfg(target_arch = "x86_64")]
kernel!(avx512, "avx512f");

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(count: usize) -> Cloud {
        let mut cloud = Cloud::default();
        cloud.reserve(count);
        for i in 0..count {
            let t = i as f64;
            let offset = Vec3::new(t.sin(), (1.7 * t).cos(), 0.2 * (0.3 * t).sin());
            let normal = Vec3::new(0.1 * t.cos(), 0.2 * t.sin(), 1.0).normalize();
            cloud.push(&offset, &normal, offset.norm_squared());
        }
        cloud
    }

    fn view() -> View {
        View {
            frame: Frame::around(Vec3::new(0.1, -0.2, 0.9).normalize()),
            origin: Vec3::new(0.01, 0.02, -0.03),
            length: 1.3,
            third: [0.1, -0.05, 0.2],
            inverse_squared: 0.4,
        }
    }

    fn bits(m: &Moments) -> Vec<u64> {
        let scalars = [m.weight, m.squares, m.count];
        let all = m.rows.iter().chain(&m.heights).flatten().chain(&scalars);
        all.map(|x| x.to_bits()).collect()
    }

    #[test]
    fn instruction_sets_give_the_same_bits() {
        for count in [0, 1, 7, 8, 9, 37] {
            let cloud = cloud(count.max(1));
            let fast = accumulate::<4>(&cloud, count, &view());
            let plain = portable::accumulate::<4>(&cloud, count, &view());
            assert_eq!(bits(&fast), bits(&plain), "{count}");
        }
    }

    #[test]
    fn points_that_face_away_do_not_count() {
        let mut cloud = cloud(20);
        cloud.reserve(21);
        cloud.push(&Vec3::new(0.3, 0.2, 5.0), &-Vec3::z(), 1.0);
        let [with, without] = [21, 20].map(|count| accumulate::<4>(&cloud, count, &view()));
        assert_eq!(bits(&with), bits(&without));
        assert!((without.count - 20.0).abs() < 0.5);
    }

    #[test]
    fn equals_plain_sums() {
        let (cloud, view) = (cloud(37), view());
        let moments = accumulate::<4>(&cloud, 37, &view);
        for (p, q) in [(1_usize, 0_usize), (8, 0), (3, 1), (2, 2), (0, 8), (4, 4), (7, 1)] {
            let sum: f64 = (0..37)
                .map(|i| {
                    let x = (cloud.offset(i) - view.origin) / view.length;
                    let (u, v) = (x.dot(&view.frame.t), x.dot(&view.frame.s));
                    let w = view.frame.n.dot(&cloud.normal(i)).max(0.0)
                        * (1.0 - 0.9 * cloud.squared(i) * view.inverse_squared);
                    if w > 0.0 { w * u.powf(p as f64) * v.powf(q as f64) } else { 0.0 }
                })
                .sum();
            let found = moments.rows[q][p - usize::from(q == 0)];
            assert!((found - sum).abs() < 1e-13 * moments.weight, "u^{p} v^{q}: {found} {sum}");
        }
    }
}
