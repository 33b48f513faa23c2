//! Which neighbours a fit sees, as a cloud that starts near the vertex and can be cut short anywhere.

use super::estimate::{Prepared, Scratch};
use super::local_fit::Cloud;
use super::walker::Walker;
use super::{Neighbourhood, Principal, Status, VertexCurvature};
use crate::Vec3;

/// A part of the cloud: its first `count` points, the farthest at the squared distance `farthest`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Reach {
    pub(super) count: usize,
    pub(super) farthest: f64,
}

/// Points around a vertex that its first normal is taken from: the vertex and one ring of a regular mesh.
pub(super) const NEAREST: usize = 7;

/// How many times a neighbourhood that does not determine a fit is enlarged. A two-row strip needs one; a long ribbon of the
/// width of a triangle would go on to its end.
const ENLARGEMENTS: u32 = 6;

/// Least part of a fitted surface's unit normal along the vertex's own. Points that do not lie on one sheet may stand on edge or
/// turn a fit over; nearer to zero than this, rounding decides which side is outside. Meshes that are anything stay over 1e-3.
pub(super) const LEAST_FACING: f64 = 1e-7;

/// What came of fitting one neighbourhood.
#[derive(Debug, Clone, Copy)]
pub(super) enum Attempt {
    /// There are fewer neighbours than the fit needs.
    TooFew,
    /// They do not determine it.
    Undetermined,
    /// A curvature, its error (1/length) but for rounding, and the radius of the neighbourhood.
    Fitted { principal: Principal, error: f64, length: f64 },
}

/// Tries ever larger neighbourhoods until one determines a fit that faces outward. `attempt` returns how many vertices it
/// gathered, and what came of it.
pub(super) fn enlarging(
    prepared: &Prepared<'_>,
    vertex: u32,
    neighbourhood: Neighbourhood,
    mut attempt: impl FnMut(Neighbourhood) -> (usize, Attempt),
) -> VertexCurvature {
    let outward = prepared.normal(vertex);
    let mut status = Status::FewNeighbours;
    let mut previous = 0;
    for step in 0..=ENLARGEMENTS {
        let (gathered, attempt) = attempt(neighbourhood.enlarged(step));
        if gathered == previous {
            break; // The component is exhausted.
        }
        previous = gathered;
        match attempt {
            Attempt::TooFew => {}
            Attempt::Fitted { principal, error, length }
                if principal.normal().dot(&outward) > LEAST_FACING =>
            {
                let error = error + prepared.rounding_error(vertex, length);
                return VertexCurvature { principal: Some(principal), error, status: Status::Ok };
            }
            _ => status = Status::RankDeficient,
        }
    }
    VertexCurvature::undetermined(status)
}

/// [`enlarging`] for a fit to the cloud of the neighbourhood, which needs at least so many points; `fit` returns `None` where they do
/// not determine it.
pub(super) fn enlarging_cloud(
    prepared: &Prepared<'_>,
    vertex: u32,
    neighbourhood: Neighbourhood,
    least_points: usize,
    scratch: &mut Scratch<'_>,
    fit: impl Fn(&mut Scratch<'_>, Reach) -> Option<Attempt>,
) -> VertexCurvature {
    enlarging(prepared, vertex, neighbourhood, |neighbourhood| {
        let whole = gather(prepared, vertex, neighbourhood, scratch);
        let enough = whole.count >= least_points;
        let attempt =
            if enough { fit(scratch, whole).unwrap_or(Attempt::Undetermined) } else { Attempt::TooFew };
        (whole.count, attempt)
    })
}

/// Gathers `rings` rings; how far that reaches. Squared distances are squared ring numbers: on a stretched mesh, weights
/// that follow the rings follow the stretch, as the fit itself does.
pub(super) fn gather_rings(
    prepared: &Prepared<'_>,
    vertex: u32,
    rings: u32,
    scratch: &mut Scratch<'_>,
) -> Reach {
    scratch.walker.rings(vertex, 0);
    scratch.cloud.clear();
    grow_rings(prepared, vertex, rings, scratch)
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
    let members = walker.members();
    cloud.reserve(members.len());
    let origin = prepared.positions()[vertex as usize];
    for (ring, &end) in walker.ring_ends().iter().enumerate() {
        // Empty for rings that are in the cloud already.
        for &member in &members[cloud.len().min(end)..end] {
            let offset = prepared.positions()[member as usize] - origin;
            cloud.push(&offset, &prepared.normal(member), (ring * ring) as f64);
        }
    }
    reach_of_ring(walker, rings)
}

/// The part of the gathered cloud within `rings` rings.
pub(super) fn reach_of_ring(walker: &Walker<'_>, rings: u32) -> Reach {
    let ends = walker.ring_ends();
    let ring = (rings as usize).min(ends.len() - 1);
    Reach { count: ends[ring], farthest: ((ring.max(1)) * ring.max(1)) as f64 }
}

/// Gathers a neighbourhood of any kind. In one by distance, points are sorted by it.
pub(super) fn gather(
    prepared: &Prepared<'_>,
    vertex: u32,
    neighbourhood: Neighbourhood,
    scratch: &mut Scratch<'_>,
) -> Reach {
    if let Neighbourhood::Rings(rings) = neighbourhood {
        return gather_rings(prepared, vertex, rings, scratch);
    }
    scratch.walker.gather(vertex, neighbourhood);
    let Scratch { walker, cloud, order, .. } = scratch;
    let origin = prepared.positions()[vertex as usize];
    let offset = |member: u32| prepared.positions()[member as usize] - origin;
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
        cloud.push(&offset(member), &prepared.normal(member), squared);
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
/// first points that face the vertex's way. The vertex's own where those cancel.
pub(super) fn reference_normal(cloud: &Cloud, count: usize) -> Vec3 {
    let own = cloud.normal(0);
    let facing = (0..count).map(|i| cloud.normal(i)).filter(|n| n.dot(&own) > 0.0);
    let mean: Vec3 = facing.fold(Vec3::zeros(), |sum, n| sum + n);
    mean.try_normalize(0.0).unwrap_or(own)
}
