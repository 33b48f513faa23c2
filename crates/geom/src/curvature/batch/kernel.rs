//! Eight quadric fits side by side, one per lane: portable, and with AVX-512.
//!
//! What is computed is what the module [`quadric`](super::super::quadric) computes for one vertex; only the order of the sums
//! differs, and that the elimination has no square roots. Lanes never mix, so what a vertex gets does not depend on its
//! neighbours in the group.

use super::gather::Octet;
use super::sites::Site;

/// Offsets (`x`, `y`, `z`) and weights of the `k`-th neighbours of eight vertices.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Row([[f64; 8]; 4]);

impl Row {
    pub(super) const ZERO: Self = Self([[0.0; 8]; 4]);
}

/// What came of eight fits; the numbers count where the bit is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fits {
    /// Bit `i` is set where vertex `i` has a sound fit.
    pub(super) sound: u8,
    /// `kappa_max`, `kappa_min`, the two directions, and the error but for rounding.
    pub(super) numbers: [[f64; 8]; 9],
    /// Largest coordinate difference to any point of the fit.
    pub(super) length: [f64; 8],
}

/// Fits all vertices of a group. `rows` is scratch.
pub(super) fn fit(sites: &[Site], octet: &Octet, rows: &mut Vec<Row>) -> Fits {
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx512f") {
        #[allow(unsafe_code, reason = "calling a function compiled for AVX-512 requires it")]
        // SAFETY: the processor has AVX-512F, as was just checked.
        return unsafe { avx512::fit(sites, octet, rows) };
    }
    portable::fit(sites, octet, rows)
}

/// What any processor computes.
#[cfg(test)]
pub(super) fn fit_portable(sites: &[Site], octet: &Octet, rows: &mut Vec<Row>) -> Fits {
    portable::fit(sites, octet, rows)
}

/// The fits for one set of lanes.
macro_rules! kernel {
    ($name:ident $(, $feature:literal)?) => {
        mod $name {
            use super::super::equations::$name::{Equations, solve};
            use super::{Fits, Octet, Row, Site};
            use crate::curvature::kernel::moments;
            use crate::curvature::lanes::$name::{
                Lane, abs, add, and, bits, columns, div, dot, less, load, max, mul, select, splat, sqrt, store, sub,
            };
            use crate::curvature::moments::SUMS;
            use crate::curvature::quadric::{CONFIDENCE, INNER, LEAST_INNER, LEAST_NEIGHBOURS, LEAST_PIVOT, ring_weight};
            use crate::curvature::support::LEAST_FACING;

            $(#[target_feature(enable = $feature)])?
            pub(super) fn fit(sites: &[Site], octet: &Octet, rows: &mut Vec<Row>) -> Fits {
                let normal = columns(octet.seeds.map(|seed| sites[seed as usize].normal()));
                let frame = Frame::around(normal);
                let gathered = gather(sites, octet, &normal, rows);
                let length = gathered.extent;
                let inverse = div(splat(1.0), length);
                let scaled = Frame { t: scale(&frame.t, inverse), s: scale(&frame.s, inverse), n: scale(&frame.n, inverse) };
                let mut sums = [splat(0.0); SUMS];
                accumulate(&rows[..gathered.inner], &scaled, &mut sums);
                let near = sums;
                accumulate(&rows[gathered.inner..], &scaled, &mut sums);

                let all = solve(&sums, splat(LEAST_PIVOT));
                let inner = solve(&near, splat(LEAST_PIVOT));
                let shape = Shape::new(&all.height);
                let (kappa_max, kappa_min) = shape.curvatures();
                let (near_max, near_min) = Shape::new(&inner.height).curvatures();
                let noise = mul(splat(CONFIDENCE), all.standard_error(&sums, gathered.count));
                let change = max(abs(sub(kappa_max, near_max)), abs(sub(kappa_min, near_min)));
                let (reach, near_reach) = (Equations::reach_squared(&sums), Equations::reach_squared(&near));
                let bias = div(mul(change, reach), sub(reach, near_reach));
                let determined = and(inner.sound, less(splat(LEAST_INNER as f64 - 0.5), gathered.inner_count));
                let bias = select(and(determined, less(near_reach, reach)), bias, splat(0.0));
                let error = sqrt(add(mul(noise, noise), mul(bias, bias)));

                let finite = less(add(abs(kappa_max), abs(kappa_min)), splat(f64::INFINITY));
                let faces = less(mul(shape.stretch, splat(LEAST_FACING)), splat(1.0));
                let enough = less(splat(LEAST_NEIGHBOURS as f64 - 0.5), gathered.count);
                // Where lengths could overflow in the sums or their inverse, the scalar path takes care.
                let modest = and(less(splat(1e-150), length), less(length, splat(1e150)));
                let known = less(error, splat(f64::INFINITY));
                let sound = and(and(all.sound, and(finite, known)), and(faces, and(enough, modest)));
                let [d1, d2] = shape.directions(&frame);
                let per_length = |x: Lane| mul(x, inverse);
                let numbers = [
                    per_length(kappa_max), per_length(kappa_min), d1[0], d1[1], d1[2], d2[0], d2[1], d2[2],
                    per_length(error),
                ];
                let mut fits = Fits { sound: bits(sound), numbers: [[0.0; 8]; 9], length: [0.0; 8] };
                for i in 0..9 {
                    store(numbers[i], &mut fits.numbers[i]);
                }
                store(length, &mut fits.length);
                fits
            }

            /// What [`gather`] found.
            struct Gathered {
                /// Number of points with a weight.
                count: Lane,
                /// Of these, inner ones.
                inner_count: Lane,
                extent: Lane,
                /// Rows that hold the inner points.
                inner: usize,
            }

            /// Fills `rows` with the weighted neighbours, see [`quadric`](crate::curvature::quadric) for the weights.
            #[inline]
            $(#[target_feature(enable = $feature)])?
            fn gather(sites: &[Site], octet: &Octet, normal: &[Lane; 3], rows: &mut Vec<Row>) -> Gathered {
                let origin = columns(octet.seeds.map(|seed| sites[seed as usize].position()));
                let total = octet.rings.iter().map(|ring| ring.rows).sum();
                if rows.len() < total {
                    rows.resize(total, Row::ZERO);
                }
                rows.truncate(total);
                let (mut count, mut inner_count, mut extent) = (splat(0.0), splat(0.0), splat(0.0));
                let (mut inner, mut next) = (0, 0);
                for (index, ring) in octet.rings.iter().enumerate() {
                    let (squared, weight) = ring_weight(index + 1, octet.rings.len());
                    let (sizes, weight) = (load(&ring.sizes), splat(weight));
                    let members = octet.members(index);
                    for (k, row) in rows[next..next + ring.rows].iter_mut().enumerate() {
                        let neighbours = [
                            &sites[members[0][k] as usize],
                            &sites[members[1][k] as usize],
                            &sites[members[2][k] as usize],
                            &sites[members[3][k] as usize],
                            &sites[members[4][k] as usize],
                            &sites[members[5][k] as usize],
                            &sites[members[6][k] as usize],
                            &sites[members[7][k] as usize],
                        ];
                        let p = columns(neighbours.map(Site::position));
                        let n = columns(neighbours.map(Site::normal));
                        let facing = dot(normal, &n);
                        let counts = and(less(splat(k as f64), sizes), less(splat(0.0), facing));
                        let offset = [sub(p[0], origin[0]), sub(p[1], origin[1]), sub(p[2], origin[2])];
                        let reach = max(max(abs(offset[0]), abs(offset[1])), abs(offset[2]));
                        extent = max(extent, select(counts, reach, splat(0.0)));
                        count = add(count, select(counts, splat(1.0), splat(0.0)));
                        let Row([x, y, z, w]) = row;
                        // What does not count may be a vertex far away, whose powers overflow.
                        store(select(counts, offset[0], splat(0.0)), x);
                        store(select(counts, offset[1], splat(0.0)), y);
                        store(select(counts, offset[2], splat(0.0)), z);
                        store(select(counts, mul(facing, weight), splat(0.0)), w);
                    }
                    next += ring.rows;
                    if squared < INNER {
                        (inner, inner_count) = (next, count);
                    }
                }
                Gathered { count, inner_count, extent, inner }
            }

            /// Adds the moments of points in a frame that is scaled to the unit of the fit.
            #[inline]
            $(#[target_feature(enable = $feature)])?
            fn accumulate(rows: &[Row], frame: &Frame, to: &mut [Lane; SUMS]) {
                let mut sums = *to;
                for Row([x, y, z, w]) in rows {
                    let offset = [load(x), load(y), load(z)];
                    let (u, v, h) = (dot(&offset, &frame.t), dot(&offset, &frame.s), dot(&offset, &frame.n));
                    let terms = moments(u, v, h, load(w), |a, b| mul(a, b));
                    for i in 0..SUMS {
                        sums[i] = add(sums[i], terms[i]);
                    }
                }
                *to = sums;
            }

            /// Orthonormal frames, see [`Frame`](crate::curvature::shape_operator::Frame).
            struct Frame {
                t: [Lane; 3],
                s: [Lane; 3],
                n: [Lane; 3],
            }

            impl Frame {
                #[inline]
                $(#[target_feature(enable = $feature)])?
                fn around(n: [Lane; 3]) -> Self {
                    let (zero, one) = (splat(0.0), splat(1.0));
                    let sign = select(less(n[2], zero), splat(-1.0), one);
                    let a = div(splat(-1.0), add(sign, n[2]));
                    let (xa, ya) = (mul(n[0], a), mul(n[1], a));
                    let b = mul(n[0], ya);
                    let t = [add(one, mul(sign, mul(n[0], xa))), mul(sign, b), sub(zero, mul(sign, n[0]))];
                    let s = [b, add(sign, mul(n[1], ya)), sub(zero, n[1])];
                    Self { t, s, n }
                }
            }

            #[inline]
            $(#[target_feature(enable = $feature)])?
            fn scale(v: &[Lane; 3], by: Lane) -> [Lane; 3] {
                [mul(v[0], by), mul(v[1], by), mul(v[2], by)]
            }

            #[inline]
            $(#[target_feature(enable = $feature)])?
            fn unit(v: &[Lane; 3]) -> [Lane; 3] {
                scale(v, div(splat(1.0), sqrt(dot(v, v))))
            }

            /// The shape operator on the basis (up the gradient, along the level line), see
            /// [`shape_operator`](crate::curvature::shape_operator).
            struct Shape {
                cos: Lane,
                sin: Lane,
                slope: Lane,
                /// Length of the tangent along the gradient.
                stretch: Lane,
                half_trace: Lane,
                half_difference: Lane,
                mixed: Lane,
                /// Half the difference of the curvatures.
                radius: Lane,
            }

            impl Shape {
                #[inline]
                $(#[target_feature(enable = $feature)])?
                fn new([a, b, c, d, e]: &[Lane; 5]) -> Self {
                    let (zero, one, half) = (splat(0.0), splat(1.0), splat(0.5));
                    let squared = add(mul(*d, *d), mul(*e, *e));
                    let slope = sqrt(squared);
                    let tilted = less(zero, slope);
                    let per_slope = div(one, slope);
                    let cos = select(tilted, mul(*d, per_slope), one);
                    let sin = select(tilted, mul(*e, per_slope), zero);
                    let stretch = sqrt(add(one, squared));
                    let inverse = div(one, stretch);
                    let (cc, cs, ss) = (mul(cos, cos), mul(cos, sin), mul(sin, sin));
                    let bent = mul(*b, cs);
                    let along = add(add(mul(*a, cc), bent), mul(*c, ss));
                    let across = add(sub(mul(*a, ss), bent), mul(*c, cc));
                    let mixed = add(mul(mul(splat(2.0), sub(*c, *a)), cs), mul(*b, sub(cc, ss)));
                    let factor = mul(splat(-2.0), inverse);
                    let xx = mul(mul(along, mul(inverse, inverse)), factor);
                    let yy = mul(across, factor);
                    let xy = mul(mul(mixed, inverse), mul(half, factor));
                    let (half_trace, half_difference) = (mul(half, add(xx, yy)), mul(half, sub(xx, yy)));
                    // The larger term is taken out, so that squares neither overflow nor vanish.
                    let (p, q) = (abs(half_difference), abs(xy));
                    let large = max(p, q);
                    let small = select(less(p, q), p, q);
                    let ratio = select(less(zero, large), div(small, large), zero);
                    let radius = mul(large, sqrt(add(one, mul(ratio, ratio))));
                    Self { cos, sin, slope, stretch, half_trace, half_difference, mixed: xy, radius }
                }

                /// Of a neighbourhood of length 1: `(kappa_max, kappa_min)`.
                #[inline]
                $(#[target_feature(enable = $feature)])?
                fn curvatures(&self) -> (Lane, Lane) {
                    (add(self.half_trace, self.radius), sub(self.half_trace, self.radius))
                }

                /// The two principal directions, see
                /// [`Symmetric::lift`](crate::curvature::shape_operator::Symmetric::lift).
                #[inline]
                $(#[target_feature(enable = $feature)])?
                fn directions(&self, frame: &Frame) -> [[Lane; 3]; 2] {
                    let (zero, one, half) = (splat(0.0), splat(1.0), splat(0.5));
                    let split = less(zero, self.radius);
                    let per_radius = div(one, self.radius);
                    let cos2 = select(split, mul(self.half_difference, per_radius), one);
                    let sin2 = select(split, mul(self.mixed, per_radius), zero);
                    let large = sqrt(mul(half, add(one, abs(cos2))));
                    let small = div(mul(half, sin2), large);
                    let swapped = less(cos2, zero);
                    let (cos, sin) = (select(swapped, small, large), select(swapped, large, small));
                    let per_stretch = div(one, self.stretch);
                    let mut directions = [[zero; 3]; 2];
                    for i in 0..3 {
                        let up = add(mul(frame.t[i], self.cos), mul(frame.s[i], self.sin));
                        let x = mul(add(up, mul(frame.n[i], self.slope)), per_stretch);
                        let y = sub(mul(frame.s[i], self.cos), mul(frame.t[i], self.sin));
                        directions[0][i] = add(mul(x, cos), mul(y, sin));
                        directions[1][i] = sub(mul(y, cos), mul(x, sin));
                    }
                    [unit(&directions[0]), unit(&directions[1])]
                }
            }
        }
    };
}

kernel!(portable);
#[cfg(target_arch = "x86_64")]
kernel!(avx512, "avx512f");
