//! [`Simulated`]: the effects of a render, as far as this build has them; and which it has.
//!
//! A build has every effect, unless it was made to measure what one costs scenes that do without it:
//!
//! ```text
//! OSCULATE_WITHOUT="area lights,curvature filter" cargo build --release -p osculate-render --example effect_pairs
//! ```
//!
//! leaves out these, by the names of [`EFFECTS`]. Their switches are then false when the program is compiled, so that their code is not
//! in it, and a scene that calls for one of them is refused. `tools/reference/effect_pairs.py` does that for one after the other.
//!
//! It is a variable of the build and no Cargo feature: features add up over a workspace, and `--all-features` has to mean everything.

use crate::effects::Effects;
use crate::plan::EffectPlan;
use crate::prepared::SceneError;

/// Names of all effects that a plan decides on, in its order.
pub const EFFECTS: [&str; 14] = [
    "environment",
    "area lights",
    "directional lights",
    "interreflection",
    "textures",
    "transparency",
    "shadow pass-through",
    "silhouettes",
    "silhouette opacity",
    "parallax offset",
    "below-horizon light",
    "depth of field",
    "curvature",
    "curvature filter",
];

/// Names of the effects that this build lacks, separated by commas.
const LACKING: &str = match option_env!("OSCULATE_WITHOUT") {
    Some(names) => names,
    None => "",
};

const _: () = assert!(
    LACKING.is_empty() || known(LACKING) == commas(LACKING) + 1,
    "OSCULATE_WITHOUT takes the names of effects that `--explain` prints, separated by commas without blanks"
);

/// Whether this build has an effect.
const fn has(effect: &str) -> bool {
    !lists(LACKING, effect)
}

/// Whether materials are asked for their opacity.
pub(crate) const OPACITY: bool = has("silhouette opacity");

/// Whether materials are told curvature.
pub(crate) const CURVATURE: bool = has("curvature");

/// Whether rays go on to where they hit below the surface.
pub(crate) const OFFSET: bool = has("parallax offset");

/// Whether curvature goes through the fields' filters.
pub(crate) const FILTER: bool = has("curvature filter");

/// Whether materials with silhouettes are lit from below their horizon.
pub(crate) const BELOW_HORIZON: bool = has("below-horizon light");

/// Whether a name is one of those in a list.
const fn lists(list: &str, name: &str) -> bool {
    let (list, name) = (list.as_bytes(), name.as_bytes());
    let mut start = 0;
    while start < list.len() {
        let mut end = start;
        let mut same = true;
        while end < list.len() && list[end] != b',' {
            same = same && end - start < name.len() && list[end] == name[end - start];
            end += 1;
        }
        if same && end - start == name.len() {
            return true;
        }
        start = end + 1;
    }
    false
}

/// How many effects a list names.
const fn known(list: &str) -> usize {
    let (mut count, mut index) = (0, 0);
    while index < EFFECTS.len() {
        count += lists(list, EFFECTS[index]) as usize;
        index += 1;
    }
    count
}

const fn commas(list: &str) -> usize {
    let (mut count, mut index) = (0, 0);
    while index < list.len() {
        count += (list.as_bytes()[index] == b',') as usize;
        index += 1;
    }
    count
}

/// Refuses scenes that call for what this build lacks.
pub(crate) fn check(plan: &EffectPlan) -> Result<(), SceneError> {
    let missing = plan.decisions.iter().find(|d| d.needed && !has(d.effect));
    missing.map_or(Ok(()), |d| Err(SceneError::Lacking { effect: d.effect, reason: d.reason.clone() }))
}

/// Refuses to force effects, which asks for all that objects may be asked, in a build that lacks any.
pub(crate) fn check_forced() -> Result<(), SceneError> {
    let missing = EFFECTS.into_iter().find(|effect| !has(effect));
    missing.map_or(Ok(()), |effect| Err(SceneError::Lacking { effect, reason: "effects are forced".into() }))
}

/// The effects of a render. What the build lacks is known to be off when it is compiled.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Simulated(Effects);

macro_rules! switches {
    ($($effect:ident $name:literal)*) => {
        $(
            #[inline(always)]
            pub(crate) const fn $effect(self) -> bool {
                self.0.$effect && const { has($name) }
            }
        )*
    };
}

impl Simulated {
    pub(crate) const fn new(effects: Effects) -> Self {
        Self(effects)
    }

    switches! {
        environment "environment"
        area_lights "area lights"
        directional_lights "directional lights"
        interreflection "interreflection"
        textures "textures"
        transparency "transparency"
        silhouettes "silhouettes"
        depth_of_field "depth of field"
    }

    /// Whether rays may pass through surfaces.
    #[inline(always)]
    pub(crate) const fn pass_through(self) -> bool {
        self.transparency() || self.silhouettes()
    }

    /// Whether rays to lights may.
    #[inline(always)]
    pub(crate) const fn shadow_pass_through(self) -> bool {
        self.pass_through() && const { has("shadow pass-through") }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_name_whole_effects() {
        let list = "curvature filter,area lights";
        assert!(lists(list, "curvature filter") && lists(list, "area lights"));
        // Neither the beginning of one, nor one that goes on, nor its end.
        for other in ["curvature", "area lights and more", "filter", "lights", ""] {
            assert!(!lists(list, other), "{other}");
        }
        assert!(!lists("", "curvature"));
        assert_eq!((known(list), commas(list)), (2, 1));
        assert_eq!(known("curvature,curvatures"), 1);
        let all = EFFECTS.join(",");
        assert_eq!((known(&all), commas(&all) + 1), (EFFECTS.len(), EFFECTS.len()));
    }
}
