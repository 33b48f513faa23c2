//! `igl::principal_curvature`, reproduced with its deviations from the textbook.
//!
//! The method is that of Panozzo, Puppo and Rocca, "Efficient Multi-scale Curvature and Crease Estimation", 2010, as
//! libigl 2.6 computes it: an unweighted quadric through the vertex over the area-weighted normal, fitted to a k-ring or a
//! sphere, and a matrix whose upper right entry `GM - FN` is replaced by the lower left `EM - FL`. The trace, and with
//! it the mean curvature, is right; the determinant and the directions are off by the square of the fitted slope. It is
//! kept so that agreement with libigl can be checked number by number; [`Method::Quadric`](super::Method::Quadric) is
//! the one to use.

use nalgebra::{DMatrix, DVector};

use super::estimate::{Prepared, Scratch};
use super::moments::{Height, Moments, Points};
use super::shape_operator::{Frame, Symmetric};
use super::{Neighbourhood, Status, VertexCurvature};
use crate::Vec3;

/// libigl skips a vertex whose neighbourhood, itself included, is smaller.
const LEAST_MEMBERS: usize = 6;

/// Smallest pivot and range of lengths for which the scaled normal equations give libigl's SVD solution to 1e-12. Outside,
/// the SVD itself is run, because its cut-off for singular values decides the result.
const LEAST_PIVOT: f64 = 1e-3;
const SOUND_LENGTHS: std::ops::Range<f64> = 1e-4..1e4;

pub(crate) fn estimate_vertex(
    prepared: &Prepared<'_>,
    vertex: u32,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> VertexCurvature {
    gather(vertex, neighbourhood, scratch);
    if scratch.walker.members().len() < LEAST_MEMBERS {
        return VertexCurvature::undetermined(Status::FewNeighbours);
    }
    let Some(frame) = frame(prepared, vertex) else {
        return VertexCurvature::undetermined(Status::RankDeficient);
    };
    project(prepared, vertex, &frame, scratch);
    let Some(length) = scratch.points.extent() else {
        return VertexCurvature::undetermined(Status::RankDeficient);
    };
    let (height, residual) = fit(&scratch.points, &frame, length);
    let Height { a, b, c, d, e } = height;
    let (ee, ff, gg) = (1.0 + d * d, d * e, 1.0 + e * e);
    let inverse_norm = 1.0 / (1.0 + d * d + e * e).sqrt();
    let [l, m, n] = [2.0 * a, b, 2.0 * c].map(|second| second * inverse_norm / length);
    let determinant = ee * gg - ff * ff;
    let xx = (l * gg - m * ff) / determinant;
    let xy = (m * ee - l * ff) / determinant;
    let yy = (n * ee - m * ff) / determinant;
    let principal = Symmetric { xx: -xx, xy: -xy, yy: -yy }.lift(frame.t, frame.s);
    if !(principal.kappa_max.is_finite() && principal.kappa_min.is_finite()) {
        return VertexCurvature::undetermined(Status::RankDeficient);
    }
    // A plain residual measure: libigl has no error estimate to follow. Unknown where it is over the range of numbers.
    let error = Some(residual / length).filter(|error| !error.is_nan()).unwrap_or(f64::INFINITY);
    VertexCurvature { principal: Some(principal), error, status: Status::Ok }
}

fn gather(vertex: u32, neighbourhood: Neighbourhood, scratch: &mut Scratch<'_>) {
    let walker = &mut scratch.walker;
    match neighbourhood {
        // libigl raises a number of rings below 2 to 2.
        Neighbourhood::Rings(rings) => walker.rings(vertex, rings.max(2)),
        Neighbourhood::Radius(radius) | Neighbourhood::MeanEdges(radius) => {
            walker.within_at_least(vertex, radius, LEAST_MEMBERS)
        }
        Neighbourhood::Nearest(count) => walker.within_at_least(vertex, 0.0, count as usize + 1),
    };
}

/// Heights along the vertex normal, the first axis towards the neighbour with the lowest number. `None` where the
/// normal vanishes or that neighbour lies straight above: libigl's axes are zero there, and so are its curvatures.
fn frame(prepared: &Prepared<'_>, vertex: u32) -> Option<Frame> {
    let n = prepared.normal(vertex);
    let &first = prepared.ring.row(vertex).first()?;
    let edge = prepared.positions()[first as usize] - prepared.positions()[vertex as usize];
    let t = unit(&(edge - n * n.dot(&edge)))?;
    let s = unit(&n.cross(&t))?;
    Some(Frame { t, s, n })
}

/// A unit vector, also where the squares of the coordinates would overflow or lose digits.
fn unit(v: &Vec3) -> Option<Vec3> {
    let largest = v.amax();
    if SOUND_LENGTHS.contains(&largest) { v.try_normalize(0.0) } else { (v / largest).try_normalize(0.0) }
}

/// The members as points, of weight one where the projection-plane rule keeps them and zero where it does not.
fn project(prepared: &Prepared<'_>, vertex: u32, frame: &Frame, scratch: &mut Scratch<'_>) {
    let Scratch { walker, points, .. } = scratch;
    let origin = prepared.positions()[vertex as usize];
    let mut facing = 0;
    points.clear(walker.members().len());
    for &member in walker.members() {
        let faces = dot(&prepared.normal(member), &frame.n) > 0.0;
        facing += usize::from(faces);
        points.push(&(prepared.positions()[member as usize] - origin), f64::from(u8::from(faces)));
    }
    if facing < LEAST_MEMBERS {
        points.weights_mut().fill(1.0);
    }
}

/// Summed in coordinate order, as in [`libigl_normals`](super::libigl_normals).
fn dot(a: &Vec3, b: &Vec3) -> f64 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

/// The fit, and the root mean square height that it leaves, in units of `length`.
fn fit(points: &Points, frame: &Frame, length: f64) -> (Height, f64) {
    let sound = SOUND_LENGTHS.contains(&length);
    let fast = if sound {
        Moments::accumulate(points, 0..points.len(), frame, length).solve(LEAST_PIVOT)
    } else {
        None
    };
    if let Some(solution) = fast {
        return (solution.height, (solution.squares_left / points.len() as f64).sqrt());
    }
    let height = minimum_norm(points, frame, length);
    (height, residual(points, frame, &height, length))
}

/// The minimum-norm solution in world units, singular values up to `5 eps` of the largest dropped (Eigen's `JacobiSVD`,
/// which also takes the largest entry out first). Not a number where entries overflow or the SVD does not converge.
fn minimum_norm(points: &Points, frame: &Frame, length: f64) -> Height {
    const MOST_ITERATIONS: usize = 10_000;
    let rows = points.len();
    // A row of weight zero is a row of zeros, which changes nothing.
    let entry = |row: usize, column: usize| points.weight(row) * monomials(points, frame, row, 1.0)[column];
    let matrix = DMatrix::from_fn(rows, 5, entry);
    let heights = DVector::from_fn(rows, |row, _| points.weight(row) * points.offset(row).dot(&frame.n));
    let solve = || {
        // An iteration on infinities would never end.
        let [scale, height_scale] = [power_of_two(matrix.as_slice())?, power_of_two(heights.as_slice())?];
        let svd = (matrix / scale).try_svd(true, true, 5.0 * f64::EPSILON, MOST_ITERATIONS)?;
        let cut = 5.0 * f64::EPSILON * svd.singular_values.max();
        let solution = svd.solve(&(heights / height_scale), cut).ok()?;
        Some(solution * height_scale / scale)
    };
    let x = solve().unwrap_or_else(|| DVector::repeat(5, f64::NAN));
    Height { a: x[0] * length, b: x[1] * length, c: x[2] * length, d: x[3], e: x[4] }
}

/// A power of two near the largest magnitude, so that division by it rounds nothing; `None` where a value is not finite.
fn power_of_two(values: &[f64]) -> Option<f64> {
    let largest = values.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let finite = values.iter().all(|x| x.is_finite());
    finite.then(|| if largest > 0.0 { largest.log2().floor().exp2() } else { 1.0 })
}

/// `u^2, u v, v^2, u, v` of a point in units of `length`.
fn monomials(points: &Points, frame: &Frame, index: usize, length: f64) -> [f64; 5] {
    let offset = points.offset(index) / length;
    let (u, v) = (offset.dot(&frame.t), offset.dot(&frame.s));
    [u * u, u * v, v * v, u, v]
}

/// Root mean square height that a fit leaves.
fn residual(points: &Points, frame: &Frame, height: &Height, length: f64) -> f64 {
    let x = [height.a, height.b, height.c, height.d, height.e];
    let left = |i: usize| {
        let fitted: f64 = std::iter::zip(x, monomials(points, frame, i, length)).map(|(x, m)| x * m).sum();
        points.offset(i).dot(&frame.n) / length - fitted
    };
    let squares: f64 = (0..points.len()).map(|i| points.weight(i) * left(i).powi(2)).sum();
    (squares / points.len() as f64).sqrt()
}
