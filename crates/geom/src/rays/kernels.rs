//! Node and triangle-packet tests: portable ones, and SIMD ones that give the same bits.
//!
//! The one module of ray tracing that holds `unsafe`: loads from aligned arrays, and calls into functions compiled for
//! instructions that were detected at run time.

#![allow(unsafe_code, reason = "SIMD kernels; each has a portable twin that tests it")]

use super::build::WideTree;
use super::ray::PreparedRay;
use super::traverse::{Found, traverse_with};
use super::triangle::{UNCERTAIN, edges_in_double, exact_distance};

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
}

impl Packet {
    /// The corners of the triangle in a lane.
    pub(super) fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        self.corners.map(|corner| corner.map(|axis| axis[lane]))
    }
}

/// AVX2 for boxes, SSE2 for packets.
#[cfg(target_arch = "x86_64")]
pub(super) struct Avx2;

#[cfg(target_arch = "x86_64")]
impl Kernel for Avx2 {
    #[inline(always)]
    fn boxes(node: &Node, ray: &PreparedRay) -> BoxHits {
        use std::arch::x86_64::*;
        // SAFETY: only reached from functions compiled for AVX2, behind a run-time check; rows and hits are 32-byte aligned
        // arrays of eight floats, and `near_row` is below 6 by construction, `near_row ^ 1` too.
        unsafe {
            let row = |i: usize| _mm256_load_ps(node.rows.get_unchecked(i).as_ptr());
            let slab = |i: usize, axis: usize| {
                let origin = _mm256_set1_ps(ray.origin[axis]);
                _mm256_mul_ps(_mm256_sub_ps(row(i), origin), _mm256_set1_ps(ray.inverse_direction[axis]))
            };
            let [x, y, z] = ray.near_row;
            let near = _mm256_max_ps(slab(x, 0), _mm256_setzero_ps());
            let near = _mm256_max_ps(slab(y, 1), near);
            let near = _mm256_max_ps(slab(z, 2), near);
            let far = _mm256_min_ps(slab(x ^ 1, 0), _mm256_set1_ps(ray.t_max));
            let far = _mm256_min_ps(slab(y ^ 1, 1), far);
            let far = _mm256_min_ps(slab(z ^ 1, 2), far);
            let far = _mm256_mul_ps(far, _mm256_set1_ps(FAR_SLACK));
            let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far));
            let mut hits = BoxHits { near: [0.0; NODE_WIDTH], mask: mask.cast_unsigned() };
            _mm256_store_ps(hits.near.as_mut_ptr(), near);
            hits
        }
    }

    #[inline(always)]
    fn triangles(packet: &Packet, ray: &PreparedRay) -> PacketHits {
        use std::arch::x86_64::*;
        // SAFETY: SSE2 is part of x86-64; corner rows and hits are 16-byte aligned arrays of four floats, and the axes are a
        // permutation of 0, 1, 2 by construction.
        unsafe {
            let [x, y, z] = ray.axes;
            let sheared = |corner: usize| {
                let rows = packet.corners.get_unchecked(corner);
                let relative = |axis: usize| {
                    let origin = _mm_set1_ps(*ray.origin.get_unchecked(axis));
                    _mm_sub_ps(_mm_load_ps(rows.get_unchecked(axis).as_ptr()), origin)
                };
                let along = relative(z);
                let shear = |i: usize| _mm_mul_ps(_mm_set1_ps(ray.shear[i]), along);
                [_mm_sub_ps(relative(x), shear(0)), _mm_sub_ps(relative(y), shear(1)), along]
            };
            let (a, b, c) = (sheared(0), sheared(1), sheared(2));
            let edge =
                |p: __m128, q: __m128, r: __m128, s: __m128| _mm_sub_ps(_mm_mul_ps(p, q), _mm_mul_ps(r, s));
            let mut u = edge(c[0], b[1], c[1], b[0]);
            let mut v = edge(a[0], c[1], a[1], c[0]);
            let mut w = edge(b[0], a[1], b[1], a[0]);
            let zero = _mm_setzero_ps();
            let any_zero =
                _mm_or_ps(_mm_or_ps(_mm_cmpeq_ps(u, zero), _mm_cmpeq_ps(v, zero)), _mm_cmpeq_ps(w, zero));
            let redo = _mm_movemask_ps(any_zero);
            if redo != 0 {
                [u, v, w] = redo_in_double(redo.cast_unsigned(), [a, b, c], [u, v, w]);
            }
            let least = _mm_min_ps(_mm_min_ps(u, v), w);
            let most = _mm_max_ps(_mm_max_ps(u, v), w);
            let outside = _mm_and_ps(_mm_cmplt_ps(least, zero), _mm_cmpgt_ps(most, zero));
            let determinant = _mm_add_ps(_mm_add_ps(u, v), w);
            let scale = _mm_set1_ps(ray.shear[2]);
            let term =
                |weight: __m128, corner: &[__m128; 3]| _mm_mul_ps(weight, _mm_mul_ps(scale, corner[2]));
            let t = _mm_div_ps(_mm_add_ps(_mm_add_ps(term(u, &a), term(v, &b)), term(w, &c)), determinant);
            let in_range = _mm_cmple_ps(t, _mm_set1_ps(ray.t_max));
            let valid = _mm_and_ps(in_range, _mm_cmpneq_ps(determinant, zero));
            let valid = _mm_andnot_ps(outside, valid);
            let magnitude = |v: __m128| _mm_andnot_ps(_mm_set1_ps(-0.0), v);
            let distance = _mm_max_ps(_mm_max_ps(magnitude(a[2]), magnitude(b[2])), magnitude(c[2]));
            let uncertain = _mm_mul_ps(_mm_mul_ps(distance, magnitude(scale)), _mm_set1_ps(UNCERTAIN));
            let near = _mm_and_ps(valid, _mm_cmple_ps(magnitude(t), uncertain));
            let certain = _mm_andnot_ps(near, _mm_and_ps(valid, _mm_cmpgt_ps(t, zero)));
            let mask = _mm_movemask_ps(certain).cast_unsigned();
            let mut hits = PacketHits { t: [0.0; PACKET_WIDTH], mask };
            _mm_store_ps(hits.t.as_mut_ptr(), t);
            let near = _mm_movemask_ps(near).cast_unsigned();
            if near != 0 {
                settle_lanes(near, packet, ray, &mut hits);
            }
            hits
        }
    }
}

/// Decides the lanes whose distance is too small for its rounding.
#[cfg(target_arch = "x86_64")]
#[cold]
fn settle_lanes(lanes: u32, packet: &Packet, ray: &PreparedRay, hits: &mut PacketHits) {
    for lane in (0..PACKET_WIDTH).filter(|lane| lanes >> lane & 1 == 1) {
        if let Some(t) = exact_distance(ray, &packet.triangle(lane)) {
            hits.t[lane] = t;
            hits.mask |= 1 << lane;
        }
    }
}

/// Replaces the edge functions of the lanes in `lanes` by their values from double precision.
#[cfg(target_arch = "x86_64")]
#[cold]
fn redo_in_double(
    lanes: u32,
    corners: [[std::arch::x86_64::__m128; 3]; 3],
    edges: [std::arch::x86_64::__m128; 3],
) -> [std::arch::x86_64::__m128; 3] {
    type Lanes = [f32; PACKET_WIDTH];
    // SAFETY: `__m128` and `[f32; 4]` have the same size, and every bit pattern is valid for both.
    let lanes_of = |v: std::arch::x86_64::__m128| unsafe { std::mem::transmute::<_, Lanes>(v) };
    let (corners, mut edges) = (corners.map(|corner| corner.map(lanes_of)), edges.map(lanes_of));
    for lane in (0..PACKET_WIDTH).filter(|lane| lanes >> lane & 1 == 1) {
        let exact = edges_in_double(corners.map(|corner| corner.map(|axis| axis[lane])));
        for (edge, value) in edges.iter_mut().zip(exact) {
            edge[lane] = value;
        }
    }
    // SAFETY: as above.
    edges.map(|lanes| unsafe { std::mem::transmute::<Lanes, _>(lanes) })
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
