//! [`Row`]: what chords add around one vertex.

use super::ground::Ground;
use super::{ELEVATIONS, Level, VALUES, WIDTH, cosine};
use crate::field::azimuths::{Around, Between};
use crate::field::chord::{PACE, Way, chord_from};
use crate::field::section::Beginning;
use crate::field::start::Start;
use crate::field::surface_field::CurvatureField;
use crate::field::walk_length::WalkLength;

/// What chords add around one vertex, per azimuth and elevation.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    /// What a step of its curvatures is, 1/length, and one of its rates.
    steps: [f32; 2],
    /// Per azimuth and elevation: curvature and both UV rates, in steps.
    numbers: Box<[i16]>,
}

impl Row {
    /// Follows chords in all directions. Without a vertex to start from it has zeros.
    pub fn new(
        field: &CurvatureField<'_>,
        around: Option<&Around<'_>>,
        azimuths: usize,
        walk: WalkLength,
    ) -> Self {
        let mut values = vec![0.0; azimuths * WIDTH];
        for (k, values) in values.chunks_exact_mut(WIDTH).enumerate() {
            let azimuth = std::f64::consts::TAU * k as f64 / azimuths as f64;
            let start = around.and_then(|around| around.start(field, azimuth, 0.0));
            if let Some(additions) = start.and_then(|start| additions(field, &start, walk)) {
                values.copy_from_slice(additions.as_flattened());
            }
        }
        in_steps(&values)
    }

    pub fn bytes(&self) -> usize {
        size_of_val(&*self.numbers) + size_of::<Self>()
    }

    /// Between two azimuths and two elevations: a curvature, and a way ahead and aside.
    pub fn at(&self, between: &Between, level: &Level) -> [f64; VALUES] {
        let [before, after] = between.entries.map(|azimuth| self.entry(azimuth));
        let mut values = [0.0; VALUES];
        for (node, share) in level.nodes() {
            for (k, value) in values.iter_mut().enumerate() {
                let [one, two] = [before, after].map(|entry| f64::from(entry[node * VALUES + k]));
                *value += share * (one + between.share * (two - one));
            }
        }
        let [step, rate_step] = self.steps.map(f64::from);
        let [kappa, ahead, aside] = values;
        [kappa * step, ahead * rate_step, aside * rate_step]
    }

    fn entry(&self, azimuth: usize) -> &[i16; WIDTH] {
        self.numbers[azimuth * WIDTH..].first_chunk().expect("numbers for every azimuth")
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
    let ground = Ground::new(field, begun.piece.from.triangle, at);
    let mut way = Way::new(field, start, at, &begun);
    Some(std::array::from_fn(|level| {
        let found = chord_from(&mut way, &start.at_cosine(cosine(level)), at, walk, PACE);
        let axes = found.uv_rate.and_then(|rate| ground.as_ref()?.axes_of(rate));
        let [ahead, aside] = axes.map_or([0.0; 2], |[ahead, aside]| [ahead - 1.0, aside]);
        [found.kappa - at.kappa, ahead, aside]
    }))
}

/// The numbers in 16 bits, with steps as large as curvatures and rates need them.
fn in_steps(values: &[f64]) -> Row {
    let is_kappa = |k: usize| k.is_multiple_of(VALUES);
    let step = |of_kappa: bool| {
        let largest = values.iter().enumerate().filter(|(k, _)| is_kappa(*k) == of_kappa);
        #[allow(clippy::cast_possible_truncation, reason = "a step is as coarse")]
        let step = (largest.map(|(_, x)| x.abs()).fold(0.0, f64::max) / f64::from(i16::MAX)) as f32;
        step
    };
    let [kappa, rate] = [true, false].map(step);
    let narrow = |(k, value): (usize, &f64)| {
        let step = f64::from(if is_kappa(k) { kappa } else { rate });
        #[allow(clippy::cast_possible_truncation, reason = "a cast saturates, and makes nothing of 0 / 0")]
        let steps = (value / step).round() as i16;
        steps
    };
    Row { steps: [kappa, rate], numbers: values.iter().enumerate().map(narrow).collect() }
}
