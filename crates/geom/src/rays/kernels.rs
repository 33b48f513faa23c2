//! Node and triangle-packet tests: portable ones, and SIMD ones that give the same bits.
//!
//! The one module of ray tracing that holds `unsafe`: loads from aligned arrays, and calls into functions compiled for
//! instructions that were detected at run time.

#![allow(unsafe_code, reason = "SIMD kernels; each has a portable twin that tests it")]

#[cfg(target_arch = "x86_64")]
mod avx2;

use super::build::WideTree;
use super::bundle::{self, Bounds, Bundle, WIDTH};
use super::ray::{Hit, PreparedRay, Ray};
use super::traverse::{Found, traverse_with};

#[cfg(target_arch = "x86_64")]
use avx2::Avx2;

/// Children of a node.
pub(super) const NODE_WIDTH: usize = 8;

/// Triangles in a packet.
pub(super) const PACKET_WIDTH: usize = 4;

/// How much farther a box reaches than computed, relative to the distance: 2^-20 = 16 roundings.
///
/// The slab distances carry 3 roundings each, and the sheared triangle test sees corners displaced by 4; fewer than 10 in
/// all would let rays through at edges, many more would only visit more boxes.
pub(super) const FAR_SLACK: f32 = 1.0 + 1.0 / 1_048_576.0;

/// Eight child boxes and what is in them.
#[derive(Debug, Clone)]
#[repr(C, align(64))]
pub(super) struct Node {
    /// Lower x, upper x, lower y, upper y, lower z, upper z of the children.
    pub rows: [[f32; NODE_WIDTH]; 6],
    /// Encoded [`Child`](super::build::Child) references.
    pub children: [u32; NODE_WIDTH],
}

/// Four triangles.
#[derive(Debug, Clone)]
#[repr(C, align(16))]
pub(super) struct Packet {
    /// Corner, axis, lane.
    pub corners: [[[f32; PACKET_WIDTH]; 3]; 3],
    pub ids: [u32; PACKET_WIDTH],
}

/// Distances at which the ray enters the children, valid where the mask has a bit.
#[repr(C, align(32))]
pub(super) struct BoxHits {
    pub near: [f32; NODE_WIDTH],
    pub mask: u32,
}

/// Distances at which the ray meets the triangles, valid where the mask has a bit.
#[repr(C, align(16))]
pub(super) struct PacketHits {
    pub t: [f32; PACKET_WIDTH],
    pub mask: u32,
}

/// The two tests that traversal is made of.
pub(super) trait Kernel {
    /// Tests the ray, up to its `t_max`, against the children's boxes.
    fn boxes(node: &Node, ray: &PreparedRay) -> BoxHits;

    /// Tests the ray, up to its `t_max`, against the packet's triangles.
    fn triangles(packet: &Packet, ray: &PreparedRay) -> PacketHits;

    /// Tests all rays of a bundle at once: finds every box that one of them enters, and maybe others.
    fn boxes_of_bundle(node: &Node, bounds: &Bounds) -> BoxHits;

    /// Tests all rays of a bundle against a triangle, and notes what is nearer than what they found before.
    fn meet(packet: &Packet, slot: usize, bundle: &mut Bundle<'_>);
}

/// Works everywhere.
pub(super) struct Portable;

impl Kernel for Portable {
    #[inline(always)]
    fn boxes(node: &Node, ray: &PreparedRay) -> BoxHits {
        let mut hits = BoxHits { near: [0.0; NODE_WIDTH], mask: 0 };
        for lane in 0..NODE_WIDTH {
            let mut near = 0.0_f32;
            let mut far = ray.t_max;
            for axis in 0..3 {
                let row = ray.near_row[axis];
                let enter = (node.rows[row][lane] - ray.origin[axis]) * ray.inverse_direction[axis];
                let leave = (node.rows[row ^ 1][lane] - ray.origin[axis]) * ray.inverse_direction[axis];
                // As the x86 instructions: the second operand where either is NaN.
                near = if enter > near { enter } else { near };
                far = if leave < far { leave } else { far };
            }
            hits.near[lane] = near;
            hits.mask |= u32::from(near <= far * FAR_SLACK) << lane;
        }
        hits
    }

    #[inline(always)]
    fn triangles(packet: &Packet, ray: &PreparedRay) -> PacketHits {
        let mut hits = PacketHits { t: [0.0; PACKET_WIDTH], mask: 0 };
        for lane in 0..PACKET_WIDTH {
            if let Some(hit) = super::triangle::intersect(ray, &packet.triangle(lane)) {
                hits.t[lane] = hit.t;
                hits.mask |= 1 << lane;
            }
        }
        hits
    }

    #[inline(always)]
    fn boxes_of_bundle(node: &Node, bounds: &Bounds) -> BoxHits {
        let mut hits = BoxHits { near: [0.0; NODE_WIDTH], mask: 0 };
        for lane in 0..NODE_WIDTH {
            let mut near = 0.0_f32;
            let mut far = bounds.t_max;
            for axis in 0..3 {
                let row = bounds.near_row[axis];
                let [low, high] = [0, 1].map(|k: usize| bounds.inverse_direction[k][axis]);
                let to_near = node.rows[row][lane] - bounds.origin[0][axis];
                let to_far = node.rows[row ^ 1][lane] - bounds.origin[1][axis];
                near = near.max((to_near * low).min(to_near * high));
                far = far.min((to_far * low).max(to_far * high));
            }
            hits.near[lane] = near;
            hits.mask |= u32::from(near <= far * FAR_SLACK) << lane;
        }
        hits
    }

    #[inline(always)]
    fn meet(packet: &Packet, slot: usize, bundle: &mut Bundle<'_>) {
        bundle.meet(0..WIDTH, packet, slot);
    }
}

impl Packet {
    /// The lanes that hold triangles: free ones repeat the first.
    pub(super) fn slots(&self) -> impl Iterator<Item = usize> {
        (0..PACKET_WIDTH).filter(|&lane| lane == 0 || self.ids[lane] != self.ids[0])
    }

    /// The corners of the triangle in a lane.
    pub(super) fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        self.corners.map(|corner| corner.map(|axis| axis[lane]))
    }
}

/// Which kernel a tree is traversed with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Simd {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Simd {
    /// The fastest that this machine runs.
    pub(super) fn detect() -> Self {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2")
            && std::arch::is_x86_feature_detected!("bmi1")
            && std::arch::is_x86_feature_detected!("bmi2")
            && std::arch::is_x86_feature_detected!("lzcnt")
            && std::arch::is_x86_feature_detected!("popcnt")
        {
            return Self::Avx2;
        }
        Self::Portable
    }
}

/// Finds the closest hit, or any hit if `ANY`. `Simd::Avx2` must come from [`Simd::detect`].
pub(super) fn traverse<const ANY: bool>(simd: Simd, tree: &WideTree, ray: PreparedRay) -> Option<Found> {
    match simd {
        Simd::Portable => traverse_with::<Portable, ANY>(tree, ray),
        // SAFETY: `detect` returns this only where AVX2 was detected.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2 => unsafe { traverse_avx2::<ANY>(tree, ray) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn traverse_avx2<const ANY: bool>(tree: &WideTree, ray: PreparedRay) -> Option<Found> {
    traverse_with::<Avx2, ANY>(tree, ray)
}

/// Asks about all rays, those that go much the same way together. `Simd::Avx2` must come from [`Simd::detect`].
pub(super) fn trace_all<T>(
    simd: Simd,
    tree: &WideTree,
    rays: &[Ray],
    answers: &mut [T],
    of_one: impl Fn(&Ray) -> T,
    of_hit: impl Fn(Option<Hit>) -> T,
) {
    match simd {
        Simd::Portable => bundle::trace::<Portable, T>(tree, rays, answers, of_one, of_hit),
        // SAFETY: as for a single ray.
        #[cfg(target_arch = "x86_64")]
        Simd::Avx2 => unsafe { trace_all_avx2(tree, rays, answers, of_one, of_hit) },
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
fn trace_all_avx2<T>(
    tree: &WideTree,
    rays: &[Ray],
    answers: &mut [T],
    of_one: impl Fn(&Ray) -> T,
    of_hit: impl Fn(Option<Hit>) -> T,
) {
    bundle::trace::<Avx2, T>(tree, rays, answers, of_one, of_hit);
}
