//! [`Avx2`]: the tests of traversal with AVX2 and SSE2.

use std::arch::x86_64::*;

use super::super::bundle::{Bounds, Bundle, Lanes, WIDTH};
use super::super::ray::PreparedRay;
use super::super::triangle::{UNCERTAIN, edges_in_double, exact_distance};
use super::{BoxHits, FAR_SLACK, Kernel, NODE_WIDTH, Node, PACKET_WIDTH, Packet, PacketHits};

/// AVX2 for boxes, SSE2 for packets.
pub(super) struct Avx2;

impl Kernel for Avx2 {
    #[inline(always)]
    fn boxes(node: &Node, ray: &PreparedRay) -> BoxHits {
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
            entered(near, far)
        }
    }

    #[inline(always)]
    fn triangles(packet: &Packet, ray: &PreparedRay) -> PacketHits {
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

    #[inline(always)]
    fn boxes_of_bundle(node: &Node, bounds: &Bounds) -> BoxHits {
        // SAFETY: as for a single ray; `near_row` is that of one.
        unsafe {
            let to = |row: usize, origin: f32| {
                let row = node.rows.get_unchecked(row);
                _mm256_sub_ps(_mm256_load_ps(row.as_ptr()), _mm256_set1_ps(origin))
            };
            let mut near = _mm256_setzero_ps();
            let mut far = _mm256_set1_ps(bounds.t_max);
            for axis in 0..3 {
                let row = bounds.near_row[axis];
                let low = _mm256_set1_ps(bounds.inverse_direction[0][axis]);
                let high = _mm256_set1_ps(bounds.inverse_direction[1][axis]);
                let (to_near, to_far) =
                    (to(row, bounds.origin[0][axis]), to(row ^ 1, bounds.origin[1][axis]));
                let enter = _mm256_min_ps(_mm256_mul_ps(to_near, low), _mm256_mul_ps(to_near, high));
                let leave = _mm256_max_ps(_mm256_mul_ps(to_far, low), _mm256_mul_ps(to_far, high));
                (near, far) = (_mm256_max_ps(enter, near), _mm256_min_ps(leave, far));
            }
            entered(near, far)
        }
    }

    #[inline(always)]
    fn meet(packet: &Packet, slot: usize, bundle: &mut Bundle<'_>) {
        const HALF: usize = 8;
        let [x, y, z] = bundle.axes;
        // SAFETY: lanes are 32-byte aligned arrays of sixteen numbers, the axes are a permutation of 0, 1, 2, and slots are those of the packet.
        unsafe {
            let corner = |corner: usize, axis: usize| {
                let axes = packet.corners.get_unchecked(corner);
                _mm256_broadcast_ss(axes.get_unchecked(axis).get_unchecked(slot))
            };
            // No `map`: a call of the standard library is not compiled for these instructions.
            let at = |k: usize| [corner(k, x), corner(k, y), corner(k, z)];
            let corners = [at(0), at(1), at(2)];
            let id = _mm256_set1_epi32(packet.ids.get_unchecked(slot).cast_signed());
            let zero = _mm256_setzero_ps();
            for first in (0..WIDTH).step_by(HALF) {
                let load = |lanes: &Lanes<f32>| _mm256_load_ps(lanes.0.as_ptr().add(first));
                let [ox, oy, oz] = &bundle.origin;
                let [sx, sy, scale] = &bundle.shear;
                let (ox, oy, oz) = (load(ox), load(oy), load(oz));
                let (sx, sy, scale) = (load(sx), load(sy), load(scale));
                let sheared = |[px, py, pz]: [__m256; 3]| {
                    let along = _mm256_sub_ps(pz, oz);
                    let across = |p: __m256, o: __m256, s: __m256| {
                        _mm256_sub_ps(_mm256_sub_ps(p, o), _mm256_mul_ps(s, along))
                    };
                    [across(px, ox, sx), across(py, oy, sy), along]
                };
                let (a, b, c) = (sheared(corners[0]), sheared(corners[1]), sheared(corners[2]));
                let edge = |p: [__m256; 3], q: [__m256; 3]| {
                    _mm256_sub_ps(_mm256_mul_ps(p[0], q[1]), _mm256_mul_ps(p[1], q[0]))
                };
                let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
                let is_zero = |x: __m256| _mm256_cmp_ps::<_CMP_EQ_OQ>(x, zero);
                let on_edge = _mm256_or_ps(_mm256_or_ps(is_zero(u), is_zero(v)), is_zero(w));
                let least = _mm256_min_ps(_mm256_min_ps(u, v), w);
                let most = _mm256_max_ps(_mm256_max_ps(u, v), w);
                let outside = _mm256_and_ps(
                    _mm256_cmp_ps::<_CMP_LT_OQ>(least, zero),
                    _mm256_cmp_ps::<_CMP_GT_OQ>(most, zero),
                );
                let passes = _mm256_andnot_ps(on_edge, outside);
                if _mm256_movemask_ps(passes) == 0xff {
                    continue;
                }
                let determinant = _mm256_add_ps(_mm256_add_ps(u, v), w);
                let term = |weight: __m256, corner: &[__m256; 3]| {
                    _mm256_mul_ps(weight, _mm256_mul_ps(scale, corner[2]))
                };
                let sum = _mm256_add_ps(_mm256_add_ps(term(u, &a), term(v, &b)), term(w, &c));
                let t = _mm256_div_ps(sum, determinant);
                let t_max = load(&bundle.t_max);
                let in_range = _mm256_cmp_ps::<_CMP_LE_OQ>(t, t_max);
                let valid = _mm256_and_ps(in_range, _mm256_cmp_ps::<_CMP_NEQ_UQ>(determinant, zero));
                let valid = _mm256_andnot_ps(outside, valid);
                let magnitude = |x: __m256| _mm256_andnot_ps(_mm256_set1_ps(-0.0), x);
                let farthest =
                    _mm256_max_ps(_mm256_max_ps(magnitude(a[2]), magnitude(b[2])), magnitude(c[2]));
                let least_certain =
                    _mm256_mul_ps(_mm256_mul_ps(farthest, magnitude(scale)), _mm256_set1_ps(UNCERTAIN));
                let near = _mm256_cmp_ps::<_CMP_LE_OQ>(magnitude(t), least_certain);
                let special = _mm256_or_ps(on_edge, _mm256_and_ps(valid, near));
                let best = _mm256_load_si256(bundle.triangle.0.as_ptr().add(first).cast());
                let is_lower = _mm256_castsi256_ps(_mm256_cmpgt_epi32(best, id));
                let is_tie = _mm256_and_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(t, t_max), is_lower);
                let is_nearer = _mm256_or_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(t, t_max), is_tie);
                let is_ahead = _mm256_cmp_ps::<_CMP_GT_OQ>(t, zero);
                let takes =
                    _mm256_andnot_ps(special, _mm256_and_ps(valid, _mm256_and_ps(is_nearer, is_ahead)));
                if _mm256_movemask_ps(takes) != 0 {
                    let put = |lanes: &mut Lanes<f32>, new: __m256| {
                        let at = lanes.0.as_mut_ptr().add(first);
                        _mm256_store_ps(at, _mm256_blendv_ps(_mm256_load_ps(at), new, takes));
                    };
                    put(&mut bundle.t_max, t);
                    let [wu, wv, ww] = &mut bundle.weights;
                    put(wu, u);
                    put(wv, v);
                    put(ww, w);
                    let at = bundle.triangle.0.as_mut_ptr().add(first).cast();
                    _mm256_store_si256(at, _mm256_blendv_epi8(best, id, _mm256_castps_si256(takes)));
                }
                let special = _mm256_movemask_ps(special).cast_unsigned();
                if special != 0 {
                    settle_rays(special, first, packet, slot, bundle);
                }
            }
        }
    }
}

/// The boxes that are left no sooner than they are entered.
///
/// # Safety
///
/// As for all of [`Avx2`]: within functions compiled for AVX2.
#[inline(always)]
unsafe fn entered(near: __m256, far: __m256) -> BoxHits {
    // SAFETY: forwarded from the caller; hits are a 32-byte aligned array of eight floats.
    unsafe {
        let far = _mm256_mul_ps(far, _mm256_set1_ps(FAR_SLACK));
        let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far));
        let mut hits = BoxHits { near: [0.0; NODE_WIDTH], mask: mask.cast_unsigned() };
        _mm256_store_ps(hits.near.as_mut_ptr(), near);
        hits
    }
}

/// Tests the rays again that single precision or eight lanes cannot decide.
#[cold]
fn settle_rays(rays: u32, first: usize, packet: &Packet, slot: usize, bundle: &mut Bundle<'_>) {
    let lanes = (0..8).filter(|lane| rays >> lane & 1 == 1).map(|lane| first + lane);
    bundle.meet(lanes, packet, slot);
}

/// Decides the lanes whose distance is too small for its rounding.
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
#[cold]
fn redo_in_double(lanes: u32, corners: [[__m128; 3]; 3], edges: [__m128; 3]) -> [__m128; 3] {
    type Four = [f32; PACKET_WIDTH];
    // SAFETY: `__m128` and `[f32; 4]` have the same size, and every bit pattern is valid for both.
    let lanes_of = |v: __m128| unsafe { std::mem::transmute::<_, Four>(v) };
    let (corners, mut edges) = (corners.map(|corner| corner.map(lanes_of)), edges.map(lanes_of));
    for lane in (0..PACKET_WIDTH).filter(|lane| lanes >> lane & 1 == 1) {
        let exact = edges_in_double(corners.map(|corner| corner.map(|axis| axis[lane])));
        for (edge, value) in edges.iter_mut().zip(exact) {
            edge[lane] = value;
        }
    }
    // SAFETY: as above.
    edges.map(|lanes| unsafe { std::mem::transmute::<Four, _>(lanes) })
}
