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
    entries: [usize; 2],
    /// Share of the one after, in `[0, 1]`.
    share: f32,
}

impl Between {
    /// Where a direction lies in a table of so many azimuths. `turn` is its angle as a share of a whole turn, in `[0, 1]`.
    #[inline]
    pub fn new(turn: f32, azimuths: usize) -> Self {
        let place = turn * azimuths as f32;
        // Rounding can make a whole turn: the place after the last is the first.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "in [0, azimuths]")]
        let index = place as usize;
        let wrapped = |index: usize| if index >= azimuths { index - azimuths } else { index };
        Self { entries: [wrapped(index), wrapped(index + 1)], share: place - index as f32 }
    }

    /// Both entries and what each counts.
    #[inline]
    pub fn shares(&self) -> [(usize, f32); 2] {
        let [before, after] = self.entries;
        [(before, 1.0 - self.share), (after, self.share)]
    }
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
