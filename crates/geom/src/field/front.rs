//! [`Front`]: a walk along a section, from triangle to triangle.
//!
//! It decides by the sides of the section plane that corners lie on, as [`section`](super::section) does, and works out nothing else: what
//! a walk wants to know of a vertex it takes along with it, once.

use super::section::{Beginning, Section, SideEnd, Stop};
use super::surface_field::CurvatureField;
use crate::Vec3;
use crate::mesh::index_u32;

/// Bound on the triangles of one walk. A section of a mesh of a million triangles has about two thousand.
pub const MAX_CROSSINGS: u32 = 1 << 14;

/// An end of the side that the section crosses.
#[derive(Debug, Clone, Copy)]
pub(super) struct FrontEnd<T> {
    /// Of the surface.
    pub vertex: u32,
    /// Above the section plane.
    pub height: f64,
    /// What the walk wants to know of it.
    pub known: T,
}

/// Where a walk leaves its triangle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Front<T> {
    pub triangle: u32,
    pub side: u32,
    /// The side's corners, in the triangle's order.
    pub ends: [FrontEnd<T>; 2],
    /// Where between them.
    pub share: f64,
    /// Triangles entered after the first.
    pub crossings: u32,
    /// Where the walk began.
    pub first: u32,
}

/// The sides of a triangle after each, in order.
const AFTER: [[u8; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

impl<T: Copy> Front<T> {
    /// Where the first piece leaves its triangle.
    pub fn new(start: &Beginning, known: impl Fn(&SideEnd) -> T) -> Self {
        let exit = &start.piece.exit;
        let end = |e: &SideEnd| FrontEnd { vertex: e.vertex, height: e.height, known: known(e) };
        let (triangle, side) = (index_u32(exit.point.triangle), index_u32(exit.side));
        let ends = [end(&start.ends[0]), end(&start.ends[1])];
        let first = index_u32(start.piece.from.triangle);
        Self { triangle, side, ends, share: start.ends[1].weight, crossings: 0, first }
    }

    /// Goes on over one triangle, of whose new vertex `known` is asked, or says why that cannot be.
    #[inline(always)]
    pub fn cross(
        &mut self,
        field: &CurvatureField<'_>,
        section: &Section,
        known: impl FnOnce(u32, &Vec3) -> T,
    ) -> Result<(), Stop> {
        let (triangle, side) = (self.triangle as usize, self.side as usize);
        if self.crossings > 0 && self.triangle == self.first {
            return Err(Stop::Closed);
        }
        let Some((next, entered)) = field.topology().across(triangle, side) else {
            let is_boundary = field.topology().is_boundary(triangle, side);
            return Err(if is_boundary { Stop::Boundary } else { Stop::NonManifold });
        };
        if self.crossings + 1 == MAX_CROSSINGS {
            return Err(Stop::Budget);
        }
        let vertices = &field.surface().triangles()[next];
        let [b, c] = AFTER[entered];
        let vertex = vertices[usize::from(c)];
        let position = &field.surface().positions()[vertex as usize];
        let opposite = FrontEnd { vertex, height: section.height(*position), known: known(vertex, position) };
        // The ends lie on different sides of the plane, the opposite corner with one of them, whose place it takes. Places are numbers
        // here, not branches: half of those would be foretold wrongly.
        let first = usize::from(self.ends[0].vertex != vertices[entered]);
        let with_first = usize::from((opposite.height >= 0.0) == (self.ends[first].height >= 0.0));
        self.ends[1 - with_first] = self.ends[first ^ with_first];
        self.ends[with_first] = opposite;
        let [from, to] = &self.ends;
        // The heights differ in sign, so the share is in [0, 1] and the division is safe.
        self.share = from.height / (from.height - to.height);
        #[allow(clippy::cast_possible_truncation, reason = "triangles have 32-bit numbers")]
        {
            self.triangle = next as u32;
        }
        self.side = u32::from([c, b][with_first]);
        self.crossings += 1;
        Ok(())
    }
}
