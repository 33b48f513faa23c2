//! Twisted yarn seen from outside, for the wools.

use std::f32::consts::TAU;

use crate::micro::pattern::ball;

/// How far the surface of a twisted yarn lies above its axis, in radii; `None` beside it.
///
/// `across`: position across the axis over the radius. `turns`: position along the axis in turns of one ply.
pub(super) fn twisted(across: f32, turns: f32, plies: f32) -> Option<f32> {
    if across.abs() >= 1.0 {
        return None;
    }
    // On a helix the angle round the axis grows with the way along it: plies run obliquely.
    let round = across.asin() / TAU * plies;
    let strand = 0.5 + 0.5 * (TAU * (turns + round)).cos();
    // The square root makes strands round with narrow valleys between, instead of a sine.
    Some(ball(across) * (0.6 + 0.4 * strand.sqrt()))
}
