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
            Self::Oracle { .. } => "oracle",
            Self::March { .. } => "march",
            Self::Displaced { .. } => "displaced",
            Self::Flat => "flat",
        }
    }

    /// The value of its knob, as labels say it.
    pub fn knob(self) -> String {
        match self {
            Self::Neural { filter } => filter.name().to_owned(),
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

/// The tolerance of the reference, and of displaced triangles where the samples vary: the default of scenes.
pub const FINE: f32 = 0.005;

/// The triangles of the reference.
pub const FINEST: Shown = Shown::Displaced { tolerance: FINE };

/// Everything: samples vary for the two forms that matter most, knobs of all forms at the largest number of samples.
pub fn settings(quick: bool) -> Vec<Setting> {
    let samples: &[u32] = if quick { &[1, 4] } else { &[1, 4, 16, 64, 256] };
    let most = if quick { 4 } else { 64 };
    let neural = Shown::Neural { filter: FilterKind::Chord };
    let mut shown = vec![
        Shown::Neural { filter: FilterKind::Point },
        Shown::Neural { filter: FilterKind::March },
        Shown::Oracle { samples: 4 },
        Shown::Flat,
    ];
    let steps: &[u32] = if quick { &[8, 64] } else { &[8, 16, 32, 64, 128] };
    shown.extend(steps.iter().map(|&steps| Shown::March { steps }));
    let tolerances: &[f32] = if quick { &[0.5] } else { &[0.5, 0.2, 0.05, 0.02] };
    shown.extend(tolerances.iter().map(|&tolerance| Shown::Displaced { tolerance }));
    let mut all: Vec<Setting> = samples.iter().map(|&spp| Setting { shown: neural, spp }).collect();
    all.extend(samples.iter().map(|&spp| Setting { shown: FINEST, spp }));
    all.extend(shown.into_iter().map(|shown| Setting { shown, spp: most }));
    all
}
