//! Which renderings the study makes.

use osculate_geom::field::FilterKind;
use serde::Serialize;

/// What stands for the microstructure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "form")]
pub enum Shown {
    /// The model, with the curvature that this filter finds; the chord's is asked by the chord query, others by the paper's.
    Neural {
        /// Which.
        filter: FilterKind,
    },
    /// Another model of the same microstructure, by the chord query.
    Network {
        /// Which of them.
        index: usize,
    },
    /// Exact answers to the chord query.
    Oracle {
        /// Paths per answer.
        samples: u32,
    },
    /// A march through the heights, by the chord query.
    March {
        /// Steps per ray.
        steps: u32,
    },
    /// Triangles.
    Displaced {
        /// Largest error of the heights, in depths.
        tolerance: f32,
    },
    /// The opaque mesh with colours and normals of the heights.
    Flat,
}

impl Shown {
    /// The form's name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Neural { .. } => "neural",
            Self::Network { .. } => "network",
            Self::Oracle { .. } => "oracle",
            Self::March { .. } => "march",
            Self::Displaced { .. } => "displaced",
            Self::Flat => "flat",
        }
    }

    /// The value of its knob, as labels say it; `networks` are the names of the other models.
    pub fn knob(self, networks: &[String]) -> String {
        match self {
            Self::Neural { filter } => filter.name().to_owned(),
            Self::Network { index } => networks[index].clone(),
            Self::Oracle { samples } => format!("{samples} paths"),
            Self::March { steps } => format!("{steps} steps"),
            Self::Displaced { tolerance } => format!("{tolerance} depths"),
            Self::Flat => String::new(),
        }
    }
}

/// One rendering.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Setting {
    /// What is rendered.
    #[serde(flatten)]
    pub shown: Shown,
    /// Samples per pixel.
    pub spp: u32,
}

/// The model by the chord query, its default.
pub const DEFAULT: Shown = Shown::Neural { filter: FilterKind::Chord };

/// How much is rendered.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Extent {
    /// The largest error of the reference's heights, in depths; displaced triangles whose samples vary have it too.
    pub finest: f32,
    /// Samples per pixel of the curves over samples.
    pub samples: &'static [u32],
    /// Samples per pixel of all forms whose knobs are turned.
    pub most: u32,
    /// Paths per answer of the oracle.
    pub oracle: Option<u32>,
    /// Steps per ray of the marches.
    pub steps: &'static [u32],
    /// Coarser tolerances.
    pub tolerances: &'static [f32],
}

/// The study. Its finest tolerance is the default of scenes.
pub const FULL: Extent = Extent {
    finest: 0.005,
    samples: &[1, 4, 16, 64, 256],
    most: 64,
    oracle: Some(4),
    steps: &[8, 16, 32, 64, 128],
    tolerances: &[0.5, 0.2, 0.05, 0.02],
};

/// A small part of it, to see what it shows; without the oracle, whose preparation alone takes longer than all of this.
pub const QUICK: Extent =
    Extent { finest: 0.1, samples: &[1, 4], most: 4, oracle: None, steps: &[8, 64], tolerances: &[0.5] };

impl Extent {
    /// The triangles of the reference.
    pub fn finest(&self) -> Shown {
        Shown::Displaced { tolerance: self.finest }
    }

    /// Everything: samples vary for the two forms that matter most, and knobs of all forms at one number of samples.
    pub fn settings(&self, networks: usize) -> Vec<Setting> {
        let curves = [DEFAULT, self.finest()].into_iter();
        let mut all: Vec<Setting> =
            curves.flat_map(|shown| self.samples.iter().map(move |&spp| Setting { shown, spp })).collect();
        let mut shown: Vec<Shown> = [FilterKind::Point, FilterKind::March, FilterKind::BakedChord]
            .map(|filter| Shown::Neural { filter })
            .into();
        shown.extend((0..networks).map(|index| Shown::Network { index }));
        shown.extend(self.oracle.map(|samples| Shown::Oracle { samples }));
        shown.push(Shown::Flat);
        shown.extend(self.steps.iter().map(|&steps| Shown::March { steps }));
        shown.extend(self.tolerances.iter().map(|&tolerance| Shown::Displaced { tolerance }));
        all.extend(shown.into_iter().map(|shown| Setting { shown, spp: self.most }));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_knob_is_turned_at_the_samples_that_the_curves_have_too() {
        for extent in [FULL, QUICK] {
            assert!(extent.samples.contains(&extent.most));
            let settings = extent.settings(2);
            let at_most = |shown: Shown| settings.contains(&Setting { shown, spp: extent.most });
            assert!(at_most(DEFAULT) && at_most(extent.finest()));
            assert!(at_most(Shown::Network { index: 1 }) && !at_most(Shown::Network { index: 2 }));
            for (i, setting) in settings.iter().enumerate() {
                assert!(!settings[..i].contains(setting), "{setting:?} twice");
            }
        }
    }
}
