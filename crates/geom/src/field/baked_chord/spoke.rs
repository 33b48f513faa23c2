//! [`Spoke`]: what chords add at a vertex in one direction.

use super::ground::Ground;
use super::{ELEVATIONS, Level, VALUES, cosine};
use crate::field::azimuths::Around;
use crate::field::chord::{PACE, Way, chord_from};
use crate::field::section::Beginning;
use crate::field::start::Start;
use crate::field::surface_field::CurvatureField;
use crate::field::walk_length::WalkLength;

/// What chords add at a vertex in one azimuth, per elevation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spoke {
    /// What a step of its curvatures is, times the field's [unit of length](CurvatureField::bend_scale), and one of its rates.
    steps: [f32; 2],
    /// Per elevation: curvature and both components of the UV rate, in steps.
    numbers: [[i16; VALUES]; ELEVATIONS],
}

impl Spoke {
    /// Follows the chords. Without a vertex to start from it has zeros.
    pub fn new(
        field: &CurvatureField<'_>,
        around: Option<&Around<'_>>,
        azimuth: f64,
        walk: WalkLength,
    ) -> Self {
        let start = around.and_then(|around| around.start(field, azimuth, 0.0));
        let additions = start.and_then(|start| additions(field, &start, walk));
        Self::in_steps(&additions.unwrap_or_default())
    }

    /// The numbers in 16 bits, with steps as large as curvatures and rates need them.
    fn in_steps(values: &[[f64; VALUES]; ELEVATIONS]) -> Self {
        let largest = |of: std::ops::Range<usize>| {
            values.iter().flat_map(|value| &value[of.clone()]).map(|x| x.abs()).fold(0.0, f64::max)
        };
        #[allow(clippy::cast_possible_truncation, reason = "a step is as coarse")]
        let [kappa, rate] =
            [largest(0..1), largest(1..VALUES)].map(|largest| (largest / f64::from(i16::MAX)) as f32);
        let narrow = |value: f64, step: f32| {
            #[allow(
                clippy::cast_possible_truncation,
                reason = "a cast saturates, and makes nothing of 0 / 0"
            )]
            let steps = (value / f64::from(step)).round() as i16;
            steps
        };
        let numbers = values
            .map(|[added, ahead, aside]| [narrow(added, kappa), narrow(ahead, rate), narrow(aside, rate)]);
        Self { steps: [kappa, rate], numbers }
    }

    /// Adds a share of what lies between two elevations: a curvature in the field's unit of length, and a way ahead and aside.
    #[inline]
    pub fn add(&self, sum: &mut [f32; VALUES], level: &Level, share: f32) {
        let [kappa, rate] = self.steps.map(|step| share * step);
        for (node, of_level) in level.nodes() {
            for ((sum, number), step) in sum.iter_mut().zip(self.numbers[node]).zip([kappa, rate, rate]) {
                *sum += of_level * step * f32::from(number);
            }
        }
    }
}

/// What chords of one azimuth add to the curvature of the section, and to the way along its first triangle. `None` without a section, and
/// where the surface ends at once.
fn additions(
    field: &CurvatureField<'_>,
    start: &Start,
    walk: WalkLength,
) -> Option<[[f64; VALUES]; ELEVATIONS]> {
    let at = start.section.as_ref()?;
    let begun =
        Beginning::new(field, at.plane, start.point, at.forward).filter(|begun| !begun.is_speck(field))?;
    let ground = Ground::new(field, begun.piece.from.triangle, &at.plane.normal, &at.forward);
    let mut way = Way::new(field, start, at, &begun);
    let mut additions = [[0.0; VALUES]; ELEVATIONS];
    // The steepest ray first: the way becomes longer from ray to ray.
    for (level, addition) in additions.iter_mut().enumerate().rev() {
        let found = chord_from(&mut way, &start.at_cosine(cosine(level)), at, walk, PACE);
        let axes = found.uv_rate.and_then(|rate| ground.as_ref()?.axes_of(rate));
        let [ahead, aside] = axes.map_or([0.0; 2], |[ahead, aside]| [ahead - 1.0, aside]);
        *addition = [(found.kappa - at.kappa) * field.bend_scale(), ahead, aside];
    }
    Some(additions)
}
