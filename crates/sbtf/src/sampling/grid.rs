//! [`Grid`]: which mixture of a sampler goes with which query.

use crate::model::inside_tile;
use crate::query::Incidence;

/// Divides queries by `cos_o`, by curvature and by texture coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Where bands of `cos_o` meet: ascending, between 0 and 1. None: one band.
    pub view_edges: Vec<f32>,
    /// Where ranges of `kappa_hat` meet: ascending. None: one range.
    pub curvature_edges: Vec<f32>,
    /// Cells along u and v, at least 1.
    pub cells: [usize; 2],
}

impl Default for Grid {
    /// All queries alike.
    fn default() -> Self {
        Self { view_edges: Vec::new(), curvature_edges: Vec::new(), cells: [1, 1] }
    }
}

/// Most bands, ranges of curvature, and cells along an axis.
pub(super) const MOST: usize = 64;

impl Grid {
    /// Number of bands of views.
    #[must_use]
    pub fn bands(&self) -> usize {
        self.view_edges.len() + 1
    }

    /// Number of ranges of curvature.
    #[must_use]
    pub fn curvatures(&self) -> usize {
        self.curvature_edges.len() + 1
    }

    /// Number of mixtures.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells[0] * self.cells[1] * self.curvatures() * self.bands()
    }

    /// Whether there are no mixtures, which no sampler accepts.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Place of a query's mixture in `[cells v, cells u, curvatures, bands]`. What is no number counts as the lowest.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturating, then clamped")]
    pub(super) fn index(&self, query: &Incidence) -> usize {
        let cell =
            |x: f32, n: usize| if n == 1 { 0 } else { ((inside_tile(x) * n as f32) as usize).min(n - 1) };
        let within = |edges: &[f32], x: f32| edges.partition_point(|&edge| edge <= x);
        let [u, v] = [cell(query.uv.x, self.cells[0]), cell(query.uv.y, self.cells[1])];
        let curvature = within(&self.curvature_edges, query.kappa_hat);
        let place = (v * self.cells[0] + u) * self.curvatures() + curvature;
        place * self.bands() + within(&self.view_edges, query.wo.z)
    }

    /// Whether edges ascend and lie where they mean something, and numbers are not too large.
    pub(super) fn is_valid(&self) -> bool {
        let ascend = |edges: &[f32]| {
            edges.iter().all(|edge| edge.is_finite()) && edges.windows(2).all(|pair| pair[0] < pair[1])
        };
        let sizes = [self.bands(), self.curvatures(), self.cells[0], self.cells[1]];
        ascend(&self.view_edges)
            && ascend(&self.curvature_edges)
            && self.view_edges.iter().all(|&edge| edge > 0.0 && edge < 1.0)
            && sizes.iter().all(|size| (1..=MOST).contains(size))
    }
}

/// Where so many bands of the same width meet.
pub(super) fn equal_edges(bands: usize) -> Vec<f32> {
    (1..bands.min(MOST + 1)).map(|k| k as f32 / bands as f32).collect()
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    #[test]
    fn every_mixture_has_its_queries() {
        let grid = Grid { view_edges: vec![0.1, 0.5], curvature_edges: vec![0.0], cells: [2, 3] };
        assert_eq!((grid.len(), grid.is_valid()), (36, true));
        let mut seen = vec![0; grid.len()];
        for (i, u) in [0.2, 0.7].into_iter().enumerate() {
            for (j, v) in [0.1, 0.5, -0.2].into_iter().enumerate() {
                for (k, kappa_hat) in [-1.0, 0.0].into_iter().enumerate() {
                    for (l, z) in [0.09, 0.1, 1.0].into_iter().enumerate() {
                        let wo = Vec3::new((1.0_f32 - z * z).sqrt(), 0.0, z);
                        let place = grid.index(&Incidence { uv: Vec2::new(u, v), wo, kappa_hat });
                        assert_eq!(place, ((j * 2 + i) * 2 + k) * 3 + l);
                        seen[place] += 1;
                    }
                }
            }
        }
        assert_eq!(seen, vec![1; 36]);
    }

    #[test]
    fn edges_that_divide_nothing_are_refused() {
        let views = |edges: &[f32]| Grid { view_edges: edges.to_vec(), ..Grid::default() }.is_valid();
        assert!(views(&[]) && views(&equal_edges(4)) && views(&[0.1, 0.2]));
        assert!(!views(&[0.2, 0.1]) && !views(&[0.2, 0.2]) && !views(&[0.0]) && !views(&[1.0]));
        assert!(!views(&[f32::NAN]) && !views(&equal_edges(MOST + 1)));
        let curvatures =
            |edges: &[f32]| Grid { curvature_edges: edges.to_vec(), ..Grid::default() }.is_valid();
        assert!(curvatures(&[-3.0, 0.0]) && !curvatures(&[f32::INFINITY]) && !curvatures(&[0.0, -3.0]));
        assert!(!Grid { cells: [0, 1], ..Grid::default() }.is_valid());
    }
}
