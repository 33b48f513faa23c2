//! Tables over the azimuth around a vertex: evenly spaced from the direction of the larger principal curvature.

use super::section::fan;
use super::start::Start;
use super::surface_field::{CurvatureField, SurfacePoint};
use crate::Vec3;
use crate::curvature::Principal;
use crate::mesh::index_u32;

/// Between two neighbouring entries of a table around a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct Between {
    /// The entry before, and that after.
    pub entries: [usize; 2],
    /// Share of the one after, in `[0, 1]`.
    pub share: f64,
}

impl Between {
    /// Where a direction lies in a table of so many azimuths.
    pub fn new(principal: &Principal, forward: &Vec3, azimuths: usize) -> Self {
        let place = turn(forward.dot(&principal.d1), forward.dot(&principal.d2)) * azimuths as f64;
        // Rounding can make a whole turn: the place after the last is the first.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in [0, azimuths]")]
        let index = place as usize;
        Self { entries: [index % azimuths, (index + 1) % azimuths], share: place - index as f64 }
    }

    /// Linear between the values of both entries.
    pub fn mix(&self, value: impl Fn(usize) -> f64) -> f64 {
        let [before, after] = self.entries;
        (1.0 - self.share) * value(before) + self.share * value(after)
    }
}

/// The angle from the first axis to a vector with these coordinates, as a share of a whole turn, in `[0, 1]`; 0 for no vector.
///
/// Off by 1e-9 at most, continuous, and exact along the axes: far below what lies between two entries of a table, in half the time of the
/// library's.
fn turn(x: f64, y: f64) -> f64 {
    /// Of `atan(t) / (2 pi)` over odd powers of `t` in `[0, 1]`; the polynomial whose largest error is least.
    const ODD: [f64; 9] = [
        0.159_154_925_009_222_57,
        -0.053_050_475_832_439_66,
        0.031_808_558_554_989_97,
        -0.022_538_296_340_893_722,
        0.016_709_591_857_098_704,
        -0.011_514_633_414_883_317,
        0.006_331_378_583_478_554,
        -0.002_292_047_364_473_979,
        0.000_390_999_864_013_818_34,
    ];
    let (small, large) = if x.abs() < y.abs() { (x.abs(), y.abs()) } else { (y.abs(), x.abs()) };
    if large == 0.0 {
        return 0.0;
    }
    let t = small / large;
    let of_eighth = t * ODD.iter().rev().fold(0.0, |sum, c| sum * (t * t) + c);
    let of_quarter = if x.abs() < y.abs() { 0.25 - of_eighth } else { of_eighth };
    let of_half = if x < 0.0 { 0.5 - of_quarter } else { of_quarter };
    if y < 0.0 { 1.0 - of_half } else { of_half }
}

/// A vertex to start from, and the triangles around it.
pub(super) struct Around<'p> {
    vertex: u32,
    principal: &'p Principal,
    triangles: Vec<usize>,
}

/// A triangle of every vertex, where its fan begins.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FirstTriangles(Vec<u32>);

impl FirstTriangles {
    const NONE: u32 = u32::MAX;

    pub fn new(field: &CurvatureField<'_>) -> Self {
        let mut first = vec![Self::NONE; field.surface().positions().len()];
        for (triangle, corners) in field.surface().triangles().iter().enumerate().rev() {
            for &vertex in corners {
                first[vertex as usize] = index_u32(triangle);
            }
        }
        Self(first)
    }

    pub fn of(&self, vertex: usize) -> Option<usize> {
        Some(self.0[vertex]).filter(|first| *first != Self::NONE).map(|first| first as usize)
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.0)
    }
}

impl<'p> Around<'p> {
    /// `None` for a vertex without a triangle or an estimate.
    pub fn vertex(field: &'p CurvatureField<'_>, first: &FirstTriangles, vertex: usize) -> Option<Self> {
        let (triangle, vertex) = (first.of(vertex)?, index_u32(vertex));
        Some(Self { vertex, principal: field.principal(vertex)?, triangles: fan(field, triangle, vertex) })
    }

    /// The ray that comes from the azimuth's other side, with this cosine to the normal.
    pub fn start(&self, field: &CurvatureField<'_>, azimuth: f64, cosine: f64) -> Option<Start> {
        let forward = self.principal.d1 * azimuth.cos() + self.principal.d2 * azimuth.sin();
        let normal = self.principal.normal();
        let w = normal * cosine - forward * (1.0 - cosine * cosine).sqrt();
        Start::new(field, self.towards(field, &normal.cross(&forward), &forward), w)
    }

    /// The vertex as a corner of the triangle that lies in a direction, of any triangle if none does: walks that start in another one look
    /// for it.
    fn towards(&self, field: &CurvatureField<'_>, plane: &Vec3, forward: &Vec3) -> SurfacePoint {
        let surface = field.surface();
        let here = surface.positions()[self.vertex as usize];
        let is_ahead = |triangle: &&usize| {
            let mut others =
                surface.corners(**triangle).map(|p| p - here).into_iter().filter(|d| *d != Vec3::zeros());
            let (Some(a), Some(b)) = (others.next(), others.next()) else { return false };
            let [over, under] = [plane.dot(&a), plane.dot(&b)];
            // Where the plane cuts the side between them, times a positive number.
            let cut = (a * under - b * over) * (under - over).signum();
            (over < 0.0) != (under < 0.0) && forward.dot(&cut) > 0.0
        };
        let triangle = self.triangles.iter().find(is_ahead).or(self.triangles.first()).copied();
        let triangle = triangle.expect("the fan of a triangle has that triangle");
        let corner = surface.triangles()[triangle].iter().position(|&v| v == self.vertex);
        let barycentric = std::array::from_fn(|k| if Some(k) == corner { 1.0 } else { 0.0 });
        SurfacePoint { triangle, barycentric }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_are_those_of_the_library() {
        for step in -4000..=4000 {
            let angle = f64::from(step) * (std::f64::consts::PI / 4000.0);
            for length in [1e-200, 0.3, 1e200] {
                let (x, y) = (length * angle.cos(), length * angle.sin());
                let expected = (y.atan2(x) / std::f64::consts::TAU).rem_euclid(1.0);
                let apart = (turn(x, y) - expected).abs();
                // A turn is none.
                assert!(apart.min(1.0 - apart) < 1.1e-9, "{angle}: {} {expected}", turn(x, y));
            }
        }
        assert_eq!(
            [turn(1.0, 0.0), turn(0.0, 2.0), turn(-3.0, 0.0), turn(0.0, -4.0)],
            [0.0, 0.25, 0.5, 0.75]
        );
        assert_eq!(turn(0.0, 0.0), 0.0);
    }
}
