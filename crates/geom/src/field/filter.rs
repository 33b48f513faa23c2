//! [`Filter`]: one interface to everything that turns a ray at a surface point into the curvature a material is asked with.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::baked::BakedMinimum;
use super::baked_chord::BakedChord;
use super::chord::{PACE, chord};
use super::corners::Corners;
use super::direction::{kappa_along, unit};
use super::glance::Glance;
use super::march::minimum_past;
use super::section::Stop;
use super::skip::SkipBounds;
use super::start::Start;
use super::surface_field::{CurvatureField, SurfacePoint};
use super::walk_length::WalkLength;
use crate::Vec3;

/// A ray that meets the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterQuery {
    /// Where.
    pub point: SurfacePoint,
    /// From the point to the viewer; any length but zero.
    pub w: Vec3,
    /// How far to look past the point. A table has its own rule and does not look at this.
    pub length: WalkLength,
}

/// What a filter makes of a ray. No number in it is NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilterAnswer {
    /// The curvature to ask the material with, 1/length.
    pub kappa: f64,
    /// The curvature at the point in the direction across the ray's plane, 1/length, which no filter changes. At normal incidence, where there is no
    /// such plane, the mean curvature.
    pub across: f64,
    /// Arc length walked, world units.
    pub length: f64,
    /// Triangles entered after the first.
    pub crossings: u32,
    /// Why the walk ended.
    pub stop: Stop,
    /// [`Filter::Chord`] only: distance along the ray from entry to exit, where it comes out within reach.
    pub t_exit: Option<f64>,
    /// [`Filter::Chord`] and its table only: mean UV displacement per world unit on the way, where the field has UVs.
    pub uv_rate: Option<[f64; 2]>,
}

impl FilterAnswer {
    fn without_walk(kappa: f64, across: f64, stop: Stop) -> Self {
        Self { kappa, across, length: 0.0, crossings: 0, stop, t_exit: None, uv_rate: None }
    }
}

/// Names of the filters, for files and arguments.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FilterKind {
    /// [`Filter::Point`].
    Point,
    /// [`Filter::March`].
    #[default]
    March,
    /// [`Filter::Baked`].
    Baked,
    /// [`Filter::Chord`].
    Chord,
    /// [`Filter::BakedChord`].
    BakedChord,
}

impl FilterKind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Point, Self::March, Self::Baked, Self::Chord, Self::BakedChord];

    /// As it is written in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::March => "march",
            Self::Baked => "baked",
            Self::Chord => "chord",
            Self::BakedChord => "baked_chord",
        }
    }
}

/// How the curvature along a ray is made of the field.
#[derive(Debug, Clone)]
pub enum Filter {
    /// The curvature along the ray at the point (Kuznetsov et al. 2022, Sec. 4.2).
    Point,
    /// The minimum on the section past the point (ibid., Fig. 2 b), by an exact walk.
    March,
    /// As [`March`](Self::March), without the walk wherever a bound says that it changes the result by at most `tolerance`.
    MarchWithin {
        /// Where.
        bounds: Arc<SkipBounds>,
        /// Largest error, 1/length; the result is never below the exact one.
        tolerance: f64,
    },
    /// The minimum from a table.
    Baked(Arc<BakedMinimum>),
    /// The circle that shares entry angle and exit distance with the ray, see [`Chord`](super::Chord).
    Chord,
    /// The same from a table.
    BakedChord(Arc<BakedChord>),
}

impl Filter {
    /// Which one it is.
    #[must_use]
    pub fn kind(&self) -> FilterKind {
        match self {
            Self::Point => FilterKind::Point,
            Self::March | Self::MarchWithin { .. } => FilterKind::March,
            Self::Baked(_) => FilterKind::Baked,
            Self::Chord => FilterKind::Chord,
            Self::BakedChord(_) => FilterKind::BakedChord,
        }
    }

    /// The filter of this kind that needs nothing but the field; `None` for those that need a table.
    #[must_use]
    pub fn of_kind(kind: FilterKind) -> Option<Self> {
        match kind {
            FilterKind::Point => Some(Self::Point),
            FilterKind::March => Some(Self::March),
            FilterKind::Baked | FilterKind::BakedChord => None,
            FilterKind::Chord => Some(Self::Chord),
        }
    }

    /// Bytes of the table that it reads, if it reads one.
    #[must_use]
    pub fn table_bytes(&self) -> usize {
        match self {
            Self::Point | Self::March | Self::MarchWithin { .. } | Self::Chord => 0,
            Self::Baked(table) => table.bytes(),
            Self::BakedChord(table) => table.bytes(),
        }
    }

    /// Asks for the curvature of a ray. `None` where no corner of the triangle has an estimate, and for a `w` without
    /// direction.
    ///
    /// At exactly normal incidence there is no section and every filter returns the mean curvature at the point. From the
    /// horizon and below it (`w . n <= 0`) the ray is taken to graze: on a convex surface it leaves at once. Every walk ends
    /// after at most [`MAX_CROSSINGS`](super::MAX_CROSSINGS) triangles.
    ///
    /// # Panics
    ///
    /// If the triangle is out of range, or a table or bounds belong to another surface.
    #[must_use]
    pub fn ask(&self, field: &CurvatureField<'_>, query: &FilterQuery) -> Option<FilterAnswer> {
        if let Self::Point = self {
            let w = unit(&query.w)?;
            let corners = Corners::of(field, query.point)?;
            let kappa = corners.mean(|principal| kappa_along(principal, &w));
            let across = corners.mean(|principal| principal.kappa_max + principal.kappa_min) - kappa;
            return Some(FilterAnswer::without_walk(kappa, across, Stop::NoWalk));
        }
        if let Self::Baked(table) = self {
            let glance = Glance::new(field, query.point, &query.w)?;
            let kappa = table.kappa(field, &glance);
            return Some(FilterAnswer::without_walk(kappa, glance.across(), Stop::NoWalk));
        }
        if let Self::BakedChord(table) = self {
            let glance = Glance::new(field, query.point, &query.w)?;
            let (kappa, uv_rate) = table.answer(field, &glance);
            let still = FilterAnswer::without_walk(kappa, glance.across(), Stop::NoWalk);
            return Some(FilterAnswer { uv_rate, ..still });
        }
        let start = Start::new(field, query.point, query.w)?;
        let across = start.across();
        let still = |kappa, stop| FilterAnswer::without_walk(kappa, across, stop);
        if let Self::Chord = self {
            let found = chord(field, &start, query.length, PACE);
            return Some(FilterAnswer {
                kappa: found.kappa,
                across,
                length: found.length,
                crossings: found.crossings,
                stop: found.stop,
                t_exit: found.t_exit,
                uv_rate: found.uv_rate,
            });
        }
        let length = query.length.resolve(start.along(field), start.cosine, field.diagonal());
        if let Self::MarchWithin { bounds, tolerance } = self
            && bounds.allows_skip(query.point.triangle, length, *tolerance)
        {
            return Some(still(start.kappa(field), Stop::Skipped));
        }
        let march = minimum_past(field, &start, length);
        Some(FilterAnswer {
            kappa: march.kappa,
            across,
            length: march.length,
            crossings: march.crossings,
            stop: march.stop,
            t_exit: None,
            uv_rate: None,
        })
    }
}
