//! Which neighbours a fit sees, as a cloud that starts near the vertex and can be cut short anywhere.

use super::Neighbourhood;
use super::estimate::{Prepared, Scratch};
use super::local_fit::Cloud;
use super::walker::Walker;
use crate::Vec3;

/// A part of the cloud: its first `count` points, the farthest at the squared distance `farthest`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reach {
    pub(super) count: usize,
    pub(super) farthest: f64,
}

/// Gathers `rings` rings; how far that reaches. Squared distances are squared ring numbers: on a stretched mesh, weights
/// that follow the rings follow the stretch, as the fit itself does.
pub(super) fn gather_rings(
    prepared: &Prepared<'_>,
    vertex: u32,
    rings: u32,
    scratch: &mut Scratch<'_>,
) -> Reach {
    let Scratch { walker, cloud, .. } = scratch;
    walker.rings(vertex, rings);
    cloud.clear();
    push_new_rings(prepared, vertex, walker, cloud);
    reach_of_ring(walker, rings)
}

/// Goes on to `rings` rings after [`gather_rings`]; how far that reaches.
pub(super) fn grow_rings(
    prepared: &Prepared<'_>,
    vertex: u32,
    rings: u32,
    scratch: &mut Scratch<'_>,
) -> Reach {
    let Scratch { walker, cloud, .. } = scratch;
    walker.grow_rings(rings);
    push_new_rings(prepared, vertex, walker, cloud);
    reach_of_ring(walker, rings)
}

/// The part of the gathered cloud within `rings` rings.
pub(super) fn reach_of_ring(walker: &Walker<'_>, rings: u32) -> Reach {
    let ends = walker.ring_ends();
    let ring = (rings as usize).min(ends.len() - 1);
    Reach { count: ends[ring], farthest: ((ring.max(1)) * ring.max(1)) as f64 }
}

fn push_new_rings(prepared: &Prepared<'_>, vertex: u32, walker: &Walker<'_>, cloud: &mut Cloud) {
    let members = walker.members();
    cloud.reserve(members.len());
    let origin = prepared.positions[vertex as usize];
    let mut start = 0;
    for (ring, &end) in walker.ring_ends().iter().enumerate() {
        for &member in &members[start.max(cloud.len())..end.max(cloud.len())] {
            let offset = prepared.positions[member as usize] - origin;
            cloud.push(&offset, &prepared.normals[member as usize], (ring * ring) as f64);
        }
        start = end;
    }
}

/// Gathers a neighbourhood of any kind. In one by distance, points are sorted by it.
pub(super) fn gather(
    prepared: &Prepared<'_>,
    vertex: u32,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> Reach {
    match neighbourhood {
        Neighbourhood::Rings(rings) => return gather_rings(prepared, vertex, rings, scratch),
        Neighbourhood::Radius(radius) | Neighbourhood::MeanEdges(radius) => {
            scratch.walker.within(vertex, radius);
        }
        Neighbourhood::Nearest(count) => {
            scratch.walker.within_at_least(vertex, 0.0, count as usize + 1);
        }
    }
    let Scratch { walker, cloud, order, .. } = scratch;
    let origin = prepared.positions[vertex as usize];
    let offset = |member: u32| prepared.positions[member as usize] - origin;
    let members = walker.members();
    // Relative to the largest difference, so that squares neither overflow nor vanish.
    let largest = members.iter().map(|&m| offset(m).amax()).fold(f64::MIN_POSITIVE, f64::max);
    order.clear();
    order.extend(members.iter().map(|&m| ((offset(m) / largest).norm_squared(), m)));
    // The vertex itself stays first, also among others at the same place.
    order[1..].sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    cloud.clear();
    cloud.reserve(order.len());
    for &(squared, member) in order.iter() {
        cloud.push(&offset(member), &prepared.normals[member as usize], squared);
    }
    Reach { count: order.len(), farthest: order.last().map_or(1.0, |last| last.0.max(f64::MIN_POSITIVE)) }
}

/// The part of a gathered cloud that holds about `count` points; of one by rings, whole rings.
pub(super) fn shorten(scratch: &Scratch<'_>, whole: Reach, count: usize) -> Reach {
    if whole.count <= count {
        return whole;
    }
    if let Some(ring) = scratch.walker.ring_ends().iter().position(|&end| end >= count) {
        return reach_of_ring(&scratch.walker, u32::try_from(ring).unwrap_or(u32::MAX));
    }
    Reach { count, farthest: scratch.cloud.squared(count - 1).max(f64::MIN_POSITIVE) }
}

/// A unit normal of the surface around the vertex that one bad triangle does not turn: the mean of the normals of the
/// first points. The vertex's own where those cancel; `None` where it has none.
pub(super) fn reference_normal(cloud: &Cloud, count: usize) -> Option<Vec3> {
    let own = cloud.normal(0);
    if own == Vec3::zeros() {
        return None;
    }
    let facing = (0..count).map(|i| cloud.normal(i)).filter(|n| n.dot(&own) > 0.0);
    let mean: Vec3 = facing.fold(Vec3::zeros(), |sum, n| sum + n);
    Some(mean.try_normalize(0.0).unwrap_or(own))
}
