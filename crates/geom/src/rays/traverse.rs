//! The walk down the hierarchy, once for all kernels.

use super::build::{Child, WideTree};
use super::kernels::{BoxHits, FAR_SLACK, Kernel};
use super::ray::PreparedRay;

/// Stack for trees of ordinary depth. A larger one costs time to clear at every ray; deeper trees take the heap.
pub(super) const SMALL_STACK: usize = 96;

/// The triangle that was found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found {
    pub triangle: u32,
}

/// A child that waits, and how near it is.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub reference: u32,
    pub near: f32,
}

pub(super) const NO_ENTRY: Entry = Entry { reference: 0, near: 0.0 };

#[inline(always)]
pub(super) fn traverse_with<K: Kernel, const ANY: bool>(tree: &WideTree, ray: PreparedRay) -> Option<Found> {
    if tree.nodes.is_empty() {
        return None;
    }
    if tree.stack_size <= SMALL_STACK {
        walk::<K, ANY>(tree, ray, &mut [NO_ENTRY; SMALL_STACK])
    } else {
        walk::<K, ANY>(tree, ray, &mut vec![NO_ENTRY; tree.stack_size])
    }
}

#[inline(always)]
fn walk<K: Kernel, const ANY: bool>(
    tree: &WideTree,
    mut ray: PreparedRay,
    stack: &mut [Entry],
) -> Option<Found> {
    let mut found: Option<Found> = None;
    let mut size = 0;
    let mut reference = 0_u32;
    loop {
        match Child::decode(reference) {
            Child::Node(index) => {
                let node = &tree.nodes[index];
                let hits = K::boxes(node, &ray);
                if let Some(next) = push_children(&node.children, &hits, stack, &mut size) {
                    reference = next;
                    continue;
                }
            }
            Child::Packets(range) => {
                for packet in &tree.packets[range] {
                    let hits = K::triangles(packet, &ray);
                    let mut mask = hits.mask;
                    while mask != 0 {
                        let lane = mask.trailing_zeros() as usize & 3;
                        mask &= mask - 1;
                        let (t, triangle) = (hits.t[lane], packet.ids[lane]);
                        // Ties go to the lowest index, whatever the order of traversal.
                        let tie_won = t == ray.t_max && found.is_none_or(|best| triangle < best.triangle);
                        if t < ray.t_max || tie_won {
                            ray.t_max = t;
                            found = Some(Found { triangle });
                        }
                    }
                }
                if ANY && found.is_some() {
                    return found;
                }
            }
        }
        match pop(stack, &mut size, ray.t_max) {
            None => return found,
            Some(next) => reference = next,
        }
    }
}

/// The next child that waits and is not behind what was found.
#[inline(always)]
pub(super) fn pop(stack: &[Entry], size: &mut usize, t_max: f32) -> Option<u32> {
    while *size > 0 {
        *size -= 1;
        // The slack is the one that boxes get: a box may not be dropped that could hold a tie.
        if stack[*size].near <= t_max * FAR_SLACK {
            return Some(stack[*size].reference);
        }
    }
    None
}

/// Pushes the children that were hit, the farthest first, and returns the nearest instead of pushing it.
#[inline(always)]
pub(super) fn push_children(
    children: &[u32; 8],
    hits: &BoxHits,
    stack: &mut [Entry],
    size: &mut usize,
) -> Option<u32> {
    let mut mask = hits.mask;
    let mut next = || {
        let lane = mask.trailing_zeros() as usize & 7;
        let entry = Entry { reference: children[lane], near: hits.near[lane] };
        let any = mask != 0;
        mask &= mask.wrapping_sub(1);
        any.then_some(entry)
    };
    let first = next()?;
    let Some(second) = next() else { return Some(first.reference) };
    let (mut nearest, farther) = if second.near < first.near { (second, first) } else { (first, second) };
    let bottom = *size;
    stack[*size] = farther;
    *size += 1;
    while let Some(mut entry) = next() {
        if entry.near < nearest.near {
            std::mem::swap(&mut entry, &mut nearest);
        }
        // Insertion sort: the nearest of the pushed ones ends on top.
        let mut at = *size;
        while at > bottom && stack[at - 1].near < entry.near {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = entry;
        *size += 1;
    }
    Some(nearest.reference)
}
