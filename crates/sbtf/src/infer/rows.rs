//! Queries and answers as structures of arrays.

use glam::{Vec2, Vec3};

use super::block::{Sink, Source};
use crate::query::{Answer, Query};

/// Queries, one array per number; see [`Query`].
#[derive(Debug, Clone, Copy)]
pub struct QueryRows<'a> {
    /// Texture coordinates.
    pub uv: [&'a [f32]; 2],
    /// Unit directions to the viewer.
    pub wo: [&'a [f32]; 3],
    /// Unit directions to the light.
    pub wi: [&'a [f32]; 3],
    /// Curvatures.
    pub kappa_hat: &'a [f32],
}

/// Answers, one array per number; see [`Answer`].
#[derive(Debug)]
pub struct AnswerRows<'a> {
    /// Colours.
    pub rgb: [&'a mut [f32]; 3],
    /// Opacities.
    pub alpha: &'a mut [f32],
}

impl QueryRows<'_> {
    pub(super) fn check(&self) {
        let mut rows = self.uv.iter().chain(&self.wo).chain(&self.wi);
        assert!(rows.all(|row| row.len() == self.kappa_hat.len()), "rows of one length");
    }
}

impl AnswerRows<'_> {
    pub(super) fn check(&self, count: usize) {
        let mut rows = self.rgb.iter().map(|row| row.len()).chain([self.alpha.len()]);
        assert!(rows.all(|len| len == count), "an answer for every query");
    }
}

impl Source for QueryRows<'_> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.kappa_hat.len()
    }

    #[inline(always)]
    fn query(&self, index: usize) -> Query {
        Query {
            uv: Vec2::new(self.uv[0][index], self.uv[1][index]),
            wo: Vec3::new(self.wo[0][index], self.wo[1][index], self.wo[2][index]),
            wi: Vec3::new(self.wi[0][index], self.wi[1][index], self.wi[2][index]),
            kappa_hat: self.kappa_hat[index],
        }
    }
}

impl Sink for AnswerRows<'_> {
    #[inline(always)]
    fn put(&mut self, index: usize, answer: Answer) {
        for (row, value) in self.rgb.iter_mut().zip(answer.rgb.to_array()) {
            row[index] = value;
        }
        self.alpha[index] = answer.alpha;
    }
}

/// Queries or answers one after the other.
pub(super) struct Slices<T>(pub T);

impl Source for Slices<&[Query]> {
    #[inline(always)]
    fn len(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn query(&self, index: usize) -> Query {
        self.0[index]
    }
}

impl Sink for Slices<&mut [Answer]> {
    #[inline(always)]
    fn put(&mut self, index: usize, answer: Answer) {
        self.0[index] = answer;
    }
}

/// Which buffers a material's networks fit into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sizes {
    Few,
    Many,
}
