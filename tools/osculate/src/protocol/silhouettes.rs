//! Silhouettes: masks of all forms, and what they have in common with the truth.

use std::time::Instant;

use anyhow::Result;
use osculate_geom::field::FilterKind;
use osculate_render::scene::QueryForm;
use osculate_render::{Camera, Mask, coverage};
use osculate_sbtf::micro::HeightField;
use serde::Serialize;

use super::subject::{Entry, Form, Subject, Truth};

/// Counts of samples over one or several pictures.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Band {
    both: u64,
    either: u64,
    band_both: u64,
    band_either: u64,
}

impl Band {
    fn of(truth: &Mask, test: &Mask, band: &[bool]) -> Self {
        let mut counts = Self::default();
        for ((&a, &b), &inside) in truth.covered().iter().zip(test.covered()).zip(band) {
            let (both, either) = (u64::from(a && b), u64::from(a || b));
            counts.both += both;
            counts.either += either;
            counts.band_both += both * u64::from(inside);
            counts.band_either += either * u64::from(inside);
        }
        counts
    }

    fn plus(self, other: Self) -> Self {
        Self {
            both: self.both + other.both,
            either: self.either + other.either,
            band_both: self.band_both + other.band_both,
            band_either: self.band_either + other.band_either,
        }
    }

    /// Intersection over union; 1 where nothing is covered.
    pub fn iou(self) -> f64 {
        if self.either == 0 { 1.0 } else { self.both as f64 / self.either as f64 }
    }

    /// The same among the samples between the mesh and the lowest height.
    pub fn band_iou(self) -> f64 {
        if self.band_either == 0 { 1.0 } else { self.band_both as f64 / self.band_either as f64 }
    }
}

/// What one form does.
#[derive(Debug, Clone, Serialize)]
pub struct SilhouetteRow {
    /// `base`, `model` or `oracle`.
    pub form: &'static str,
    /// How it was asked; `None` for the base.
    pub query: Option<QueryForm>,
    /// By which filter; `None` for the base.
    pub filter: Option<FilterKind>,
    /// Whether it was told the exact curvature.
    pub exact_curvature: bool,
    /// Intersection over union with the truth, over all cameras together.
    pub iou: f64,
    /// The same in the band between the mesh and the lowest height.
    pub band_iou: f64,
    /// `(1 - IoU) / (1 - IoU of the base)`.
    pub left: f64,
    /// `left` for each camera.
    pub left_by_camera: Vec<f64>,
    /// Seconds for all masks, with the preparation of the scene.
    pub seconds: f64,
}

/// All masks of a material on a subject, for pictures of them, and what came of them.
pub struct MaskSet {
    /// Truth, a mask per camera.
    pub truth: Vec<Mask>,
    /// The model, asked by the default query.
    pub model: Vec<Mask>,
    /// What the mesh covers and truth does not, a plane per camera.
    pub rim: Vec<Vec<bool>>,
    /// One row per form, the base first.
    pub rows: Vec<SilhouetteRow>,
}

/// Casts the masks of `samples` by `samples` rays. `with_tables`: the model also with both filters from tables.
pub fn silhouettes(
    subject: &Subject,
    (truth, heights): (&Truth, &HeightField),
    model: &Entry,
    oracle: &Entry,
    (samples, with_tables): (u32, bool),
    tick: &mut dyn FnMut(),
) -> Result<MaskSet> {
    let cameras: Vec<Camera> = subject.cameras.iter().map(|c| c.1).collect();
    let mut cast = |form: &Form<'_>| -> Result<(Vec<Mask>, f64)> {
        let start = Instant::now();
        let masks = coverage(&subject.scene(form, samples)?.0, &cameras)?;
        tick();
        Ok((masks, start.elapsed().as_secs_f64()))
    };
    let (truth, _) = cast(&Form::Displaced(truth))?;
    let (base, base_seconds) = cast(&Form::Base)?;
    let (inner, _) = cast(&Form::Inner(heights))?;
    let band: Vec<Vec<bool>> = base
        .iter()
        .zip(&inner)
        .map(|(base, inner)| base.covered().iter().zip(inner.covered()).map(|(a, b)| *a && !b).collect())
        .collect();
    let judge = |masks: &[Mask]| -> Vec<Band> {
        truth.iter().zip(masks).zip(&band).map(|((t, m), b)| Band::of(t, m, b)).collect()
    };
    let base_bands = judge(&base);
    let row = |form, filter: Option<FilterKind>, exact_curvature, masks: &[Mask], seconds| {
        let bands = judge(masks);
        let total = sum(&bands);
        let left = |a: Band, b: Band| if a == b { 1.0 } else { (1.0 - a.iou()) / (1.0 - b.iou()) };
        SilhouetteRow {
            form,
            query: filter.map(QueryForm::of_filter),
            filter,
            exact_curvature,
            iou: total.iou(),
            band_iou: total.band_iou(),
            left: left(total, sum(&base_bands)),
            left_by_camera: bands.iter().zip(&base_bands).map(|(a, b)| left(*a, *b)).collect(),
            seconds,
        }
    };
    let mut rows = vec![row("base", None, false, &base, base_seconds)];
    let mut default_masks = Vec::new();
    for (form, entry, exact_curvature) in
        [("model", model, false), ("oracle", oracle, false), ("oracle", oracle, true)]
    {
        if exact_curvature && !subject.has_exact_curvature() {
            continue;
        }
        let tables = (with_tables && form == "model").then_some([FilterKind::Baked, FilterKind::BakedChord]);
        for filter in [FilterKind::March, FilterKind::Chord].into_iter().chain(tables.into_iter().flatten()) {
            let (masks, seconds) = cast(&Form::Asked { entry: entry.clone(), filter, exact_curvature })?;
            rows.push(row(form, Some(filter), exact_curvature, &masks, seconds));
            if form == "model" && filter == FilterKind::Chord {
                default_masks = masks;
            }
        }
    }
    let rim = |(truth, base): (&Mask, &Mask)| -> Vec<bool> {
        truth.covered().iter().zip(base.covered()).map(|(t, b)| *b && !t).collect()
    };
    let rim = truth.iter().zip(&base).map(rim).collect();
    Ok(MaskSet { truth, model: default_masks, rim, rows })
}

fn sum(bands: &[Band]) -> Band {
    bands.iter().fold(Band::default(), |sum, b| sum.plus(*b))
}
