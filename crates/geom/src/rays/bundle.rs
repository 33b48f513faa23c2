//! [`Bundle`]: rays that go much the same way, traced together.
//!
//! One walk down the hierarchy serves all of them: a box is tested once, against the bounds of all rays, and a triangle against all rays
//! side by side. Rounding is monotonic, so that no box is passed by that one of the rays would enter on its own, and the arithmetic at a triangle is
//! that of a single ray: every ray has the bits of [`Bvh::closest_hit`](super::Bvh::closest_hit).

use super::build::{Child, WideTree};
use super::kernels::{Kernel, Packet};
use super::ray::{Hit, PreparedRay, Ray, largest_component, magnitudes};
use super::traverse::{Entry, NO_ENTRY, SMALL_STACK, pop, push_children};
use super::triangle::intersect;

#[cfg(test)]
mod tests;

/// Rays in a bundle.
pub(super) const WIDTH: usize = 16;

/// Fewer rays are faster one by one.
pub(super) const FEWEST: usize = 4;

/// Most that a component of a direction may differ from that of the bundle's first, over the direction's largest: what some twenty pixels of a
/// picture of 1000 are apart.
const SPREAD: f32 = 1.0 / 64.0;

/// Packets of triangles after which a bundle is given up: its rays go different ways, or see triangles much smaller than what is between them.
const MOST_PACKETS: u32 = 48;

/// In place of a triangle: nothing was found. More than there can be.
pub(super) const NOTHING: u32 = i32::MAX.cast_unsigned();

/// One number of every ray.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(32))]
pub(super) struct Lanes<T>(pub [T; WIDTH]);

/// Bounds on all rays of a bundle, per axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds {
    /// Of each node's six rows the one that rays meet first.
    pub near_row: [usize; 3],
    /// The origins' coordinate that is nearest to boxes, and the one that is farthest.
    pub origin: [[f32; 3]; 2],
    /// Inverses of the directions: the least and the greatest, in either order.
    pub inverse_direction: [[f32; 3]; 2],
    pub t_max: f32,
}

/// Rays with the same signs and the same largest component of their directions, and what they found. Lanes without a ray have the first one.
pub(super) struct Bundle<'r> {
    rays: &'r [Ray],
    bounds: Bounds,
    /// Of all rays, see [`PreparedRay`].
    pub axes: [usize; 3],
    /// Along `axes`.
    pub origin: [Lanes<f32>; 3],
    pub shear: [Lanes<f32>; 3],
    pub t_max: Lanes<f32>,
    pub triangle: Lanes<u32>,
    /// Times their sum.
    pub weights: [Lanes<f32>; 3],
}

impl<'r> Bundle<'r> {
    /// Of as many of the rays as fit together, from the first on; `None` if they are too few. And how many they are, at least one.
    #[inline(always)]
    fn new(rays: &'r [Ray]) -> (Option<Self>, usize) {
        let count = alike(rays);
        if count < FEWEST { (None, count) } else { (Some(Self::of(&rays[..count])), count) }
    }

    #[inline(always)]
    fn of(rays: &'r [Ray]) -> Self {
        let PreparedRay { near_row, axes, .. } = PreparedRay::new(&rays[0]);
        let zeros = Lanes([0.0_f32; WIDTH]);
        let (mut origin, mut direction, mut t_max) = ([zeros; 3], [zeros; 3], zeros);
        for lane in 0..WIDTH {
            let ray = in_lane(rays, lane);
            for k in 0..3 {
                origin[k].0[lane] = ray.origin[axes[k]];
                direction[k].0[lane] = ray.direction[axes[k]];
            }
            t_max.0[lane] = ray.t_max;
        }
        let mut shear = [zeros; 3];
        for lane in 0..WIDTH {
            let along = direction[2].0[lane];
            shear[0].0[lane] = direction[0].0[lane] / along;
            shear[1].0[lane] = direction[1].0[lane] / along;
            shear[2].0[lane] = 1.0 / along;
        }
        let mut bounds = Bounds {
            near_row,
            origin: [[0.0; 3]; 2],
            inverse_direction: [[0.0; 3]; 2],
            t_max: t_max.range()[1],
        };
        // Of single rays, which are smallest where the largest component is.
        let mut least = direction[2];
        for lane in 0..WIDTH {
            least.0[lane] = least.0[lane].abs() * PreparedRay::LEAST_COMPONENT;
        }
        for k in 0..3 {
            let axis = axes[k];
            let [low, high] = origin[k].range();
            let rises = near_row[axis] == 2 * axis;
            [bounds.origin[0][axis], bounds.origin[1][axis]] = if rises { [high, low] } else { [low, high] };
            for lane in 0..WIDTH {
                let (d, least) = (direction[k].0[lane], least.0[lane]);
                direction[k].0[lane] = if d.abs() < least { least.copysign(d) } else { d };
            }
            // All are of one sign, so that the ends are those of the inverses too.
            let [low, high] = direction[k].range();
            [bounds.inverse_direction[0][axis], bounds.inverse_direction[1][axis]] = [1.0 / high, 1.0 / low];
        }
        let triangle = Lanes([NOTHING; WIDTH]);
        Self { rays, bounds, axes, origin, shear, t_max, triangle, weights: [zeros; 3] }
    }

    /// What the ray in a lane found.
    fn hit(&self, lane: usize) -> Option<Hit> {
        let triangle = self.triangle.0[lane];
        let [u, v, w] = &self.weights;
        let (u, v, w) = (u.0[lane], v.0[lane], w.0[lane]);
        let scale = 1.0 / (u + v + w);
        let hit = Hit { t: self.t_max.0[lane], triangle, barycentrics: [u * scale, v * scale, w * scale] };
        if triangle == NOTHING { None } else { Some(hit) }
    }

    /// Tests the rays in these lanes, one by one, against a triangle of a packet.
    pub fn meet(&mut self, lanes: impl Iterator<Item = usize>, packet: &Packet, slot: usize) {
        let (corners, triangle) = (packet.triangle(slot), packet.ids[slot]);
        for lane in lanes {
            let t_max = self.t_max.0[lane];
            let ray = Ray { t_max, ..*in_lane(self.rays, lane) };
            let Some(hit) = intersect(&PreparedRay::new(&ray), &corners) else { continue };
            if hit.t < t_max || triangle < self.triangle.0[lane] {
                (self.t_max.0[lane], self.triangle.0[lane]) = (hit.t, triangle);
                for (weights, weight) in self.weights.iter_mut().zip(hit.weights) {
                    weights.0[lane] = weight;
                }
            }
        }
    }

    /// Walks down the hierarchy with all rays; whether that came to an end.
    #[inline(always)]
    fn walk<K: Kernel>(&mut self, tree: &WideTree, stack: &mut [Entry]) -> bool {
        let (mut size, mut reference, mut packets) = (0, 0, 0);
        loop {
            match Child::decode(reference) {
                Child::Node(index) => {
                    let node = &tree.nodes[index];
                    let hits = K::boxes_of_bundle(node, &self.bounds);
                    if let Some(next) = push_children(&node.children, &hits, stack, &mut size) {
                        reference = next;
                        continue;
                    }
                }
                Child::Packets(range) => {
                    for packet in &tree.packets[range] {
                        packets += 1;
                        if packets > MOST_PACKETS {
                            return false;
                        }
                        for slot in packet.slots() {
                            K::meet(packet, slot, self);
                        }
                    }
                    self.bounds.t_max = self.t_max.range()[1];
                }
            }
            match pop(stack, &mut size, self.bounds.t_max) {
                None => return true,
                Some(next) => reference = next,
            }
        }
    }
}

impl Lanes<f32> {
    /// Least and greatest.
    #[inline(always)]
    fn range(&self) -> [f32; 2] {
        let (mut low, mut high) = (self.0, self.0);
        let mut half = WIDTH / 2;
        while half > 0 {
            for k in 0..half {
                low[k] = if low[k + half] < low[k] { low[k + half] } else { low[k] };
                high[k] = if high[k + half] > high[k] { high[k + half] } else { high[k] };
            }
            half /= 2;
        }
        [low[0], high[0]]
    }
}

/// The ray that a bundle has in a lane.
#[inline(always)]
fn in_lane(rays: &[Ray], lane: usize) -> &Ray {
    &rays[if lane < rays.len() { lane } else { 0 }]
}

/// How many of the rays fit into one bundle, from the first on: at least one.
#[inline(always)]
pub(super) fn alike(rays: &[Ray]) -> usize {
    let lead = Lead::new(&rays[0]);
    let mut count = 0;
    while count < rays.len().min(WIDTH) && lead.is_followed_by(&rays[count]) {
        count += 1;
    }
    count.max(1)
}

/// The way that all rays of a bundle go.
struct Lead {
    direction: [f32; 3],
    /// Largest component.
    axis: usize,
}

impl Lead {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let direction = ray.direction.to_array();
        Self { direction, axis: largest_component(magnitudes(direction)) }
    }

    /// Whether a ray fits into a bundle with this one.
    #[inline(always)]
    fn is_followed_by(&self, ray: &Ray) -> bool {
        /// The largest component of shorter directions has shares whose inverse is infinite.
        const SHORTEST: f32 = 1e-19;
        let (mine, direction) = (self.direction, ray.direction.to_array());
        let magnitude = magnitudes(direction);
        let most = SPREAD * mine[self.axis].abs();
        let is_near = |axis: usize| (mine[axis] - direction[axis]).abs() <= most;
        let has_sign = |axis: usize| mine[axis].is_sign_negative() == direction[axis].is_sign_negative();
        let is_largest = largest_component(magnitude) == self.axis && magnitude[self.axis] >= SHORTEST;
        let is_known = ray.origin.is_finite() && !ray.t_max.is_nan();
        // Without branches: nearly all are true.
        is_near(0) & is_near(1) & is_near(2) & has_sign(0) & has_sign(1) & has_sign(2) & is_largest & is_known
    }
}

/// Asks about all rays, in bundles where they make some: `of_one` about a ray on its own, `of_hit` about one that was traced with others, from its
/// closest hit.
#[inline(always)]
pub(super) fn trace<K: Kernel, T>(
    tree: &WideTree,
    rays: &[Ray],
    answers: &mut [T],
    of_one: impl Fn(&Ray) -> T,
    of_hit: impl Fn(Option<Hit>) -> T,
) {
    let is_shallow = tree.stack_size <= SMALL_STACK && !tree.nodes.is_empty();
    let mut stack = [NO_ENTRY; SMALL_STACK];
    let mut first = 0;
    while first < rays.len() {
        let (bundle, count) = if is_shallow { Bundle::new(&rays[first..]) } else { (None, 1) };
        let (rays, answers) = (&rays[first..first + count], &mut answers[first..first + count]);
        first += count;
        if let Some(mut bundle) = bundle
            && bundle.walk::<K>(tree, &mut stack)
        {
            for (lane, answer) in answers.iter_mut().enumerate() {
                *answer = of_hit(bundle.hit(lane));
            }
        } else {
            for (ray, answer) in rays.iter().zip(answers) {
                *answer = of_one(ray);
            }
        }
    }
}
