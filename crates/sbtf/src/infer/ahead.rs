//! [`Ahead`]: texels that a later block fetches, brought near while the networks of another one run.
//!
//! Networks keep the multipliers busy and leave the memory idle, fetches do the opposite. Where textures are larger than the caches that a
//! core has for itself, fetches that wait for their texels take longer than the networks.

use super::packed_texture::{PackedTexture, TexelRows};

/// Texels that are asked for with every input of a layer: so few that requests do not queue up, so many that all are made in time.
const AT_ONCE: usize = 2;

/// Texels of one texture that are not asked for yet.
#[derive(Debug)]
pub(super) struct Ahead<'a> {
    texels: *const u8,
    /// From the first byte of two neighbours to the last.
    span: usize,
    left: &'a [[u32; AT_ONCE]],
}

/// Some of them, for the inputs of a layer in turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Portion<'a> {
    texels: *const u8,
    span: usize,
    groups: &'a [[u32; AT_ONCE]],
}

impl<'a> Ahead<'a> {
    /// Nothing.
    #[inline(always)]
    pub fn nothing() -> Self {
        Self { texels: std::ptr::null(), span: 0, left: &[] }
    }

    /// The first group of channels at these places.
    #[inline(always)]
    pub fn new(texture: &PackedTexture, rows: &'a [TexelRows]) -> Self {
        let (left, _) = rows.as_flattened().as_flattened().as_chunks();
        Self { texels: texture.texels.start(), span: texture.pair_bytes() - 1, left }
    }

    /// Takes what goes with so many inputs.
    #[inline(always)]
    pub fn take(&mut self, inputs: usize) -> Portion<'a> {
        let (groups, left) = self.left.split_at(inputs.min(self.left.len()));
        self.left = left;
        Portion { texels: self.texels, span: self.span, groups }
    }
}

impl Portion<'_> {
    /// Calls `ask` with addresses in all cache lines that go with an input.
    #[inline(always)]
    pub fn each(self, input: usize, ask: impl Fn(*const u8)) {
        if let Some(group) = self.groups.get(input) {
            for &place in group {
                let from = self.texels.wrapping_add(place as usize);
                ask(from);
                ask(from.wrapping_add(self.span));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use crate::infer::{Precision, StoredModel};
    use crate::model::{Architecture, Model};

    /// Whatever the sizes of layers: both ends of every pair of texels once.
    #[test]
    fn every_texel_is_asked_for_once() {
        let model = StoredModel::new(&Model::untrained(Architecture::paper(0.1), 1), Precision::F16);
        let texture = PackedTexture::new(&model.offset.texture);
        // Texels of eight halves are 16 bytes, pairs 32: pair after pair.
        let mut rows: Vec<TexelRows> = vec![[[0; 32]; 2]; 5];
        for (place, k) in rows.as_flattened_mut().as_flattened_mut().iter_mut().zip(0..) {
            *place = 32 * k;
        }
        let mut ahead = Ahead::new(&texture, &rows);
        let start = texture.texels.start().addr();
        let asked = RefCell::new(Vec::new());
        for inputs in [83, 24, 1, 24, 0, 59, 83] {
            let portion = ahead.take(inputs);
            for input in 0..inputs {
                portion.each(input, |address| asked.borrow_mut().push(address.addr() - start));
            }
        }
        let mut asked = asked.into_inner();
        asked.sort_unstable();
        assert_eq!(asked, (0..320).flat_map(|k| [32 * k, 32 * k + 31]).collect::<Vec<_>>());
    }
}
