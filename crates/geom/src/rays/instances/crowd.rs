//! [`Crowd`]: rays that go much the same way, on one walk through the places of instances.
//!
//! A box is tested against all of them side by side, each by the arithmetic of a single ray, and is walked into where one of them enters. A mesh
//! is asked for those that enter its box, together. What a ray finds does not depend on the order in which places are visited, so that it has the
//! bits of [`Instances::closest_hit`](super::Instances::closest_hit).

use super::{Child, FAR_SLACK, Instance, Instances, MOST_LEVELS, Node, is_before};
use crate::rays::bundle::WIDTH;
use crate::rays::ray::{Hit, PreparedRay, Ray};

/// One number of every ray.
type Lanes = [f32; WIDTH];

/// What each of them meets: the instance, and the hit in it.
type Hits = [Option<(usize, Hit)>; WIDTH];

/// Rays, a lane each. Lanes without one enter nothing.
pub(super) struct Crowd {
    origin: [Lanes; 3],
    inverse_direction: [Lanes; 3],
    t_max: Lanes,
}

/// Where rays enter a box.
struct Entries {
    /// A bit for each that does.
    mask: u32,
    /// The nearest of them.
    near: f32,
}

impl Crowd {
    /// Of at most [`WIDTH`] rays.
    fn new(rays: &[Ray]) -> Self {
        let nowhere = [0.0; WIDTH];
        let mut crowd = Self { origin: [nowhere; 3], inverse_direction: [nowhere; 3], t_max: [-1.0; WIDTH] };
        for (lane, ray) in rays.iter().enumerate() {
            let prepared = PreparedRay::new(ray);
            for axis in 0..3 {
                crowd.origin[axis][lane] = prepared.origin[axis];
                crowd.inverse_direction[axis][lane] = prepared.inverse_direction[axis];
            }
            crowd.t_max[lane] = ray.t_max;
        }
        crowd
    }

    /// As [`Node::entry`].
    fn entries(&self, node: &Node) -> Entries {
        let (mut near, mut far) = ([0.0; WIDTH], self.t_max);
        for axis in 0..3 {
            let (lower, upper) = (node.lower[axis], node.upper[axis]);
            for lane in 0..WIDTH {
                let (origin, inverse) = (self.origin[axis][lane], self.inverse_direction[axis][lane]);
                let (a, b) = ((lower - origin) * inverse, (upper - origin) * inverse);
                let (first, last) = if a < b { (a, b) } else { (b, a) };
                near[lane] = if first > near[lane] { first } else { near[lane] };
                far[lane] = if last < far[lane] { last } else { far[lane] };
            }
        }
        let mut entries = Entries { mask: 0, near: f32::INFINITY };
        for lane in 0..WIDTH {
            let enters = near[lane] <= far[lane] * FAR_SLACK;
            entries.mask |= u32::from(enters) << lane;
            let near = if enters { near[lane] } else { f32::INFINITY };
            entries.near = if near < entries.near { near } else { entries.near };
        }
        entries
    }

    /// The largest `t` that still matters to a ray.
    fn farthest(&self) -> f32 {
        self.t_max.iter().fold(0.0, |most, &t| if t > most { t } else { most })
    }
}

impl Instances {
    /// [`closest_hit`](Self::closest_hit) of at most [`WIDTH`] rays.
    pub(super) fn closest_of_crowd(&self, rays: &[Ray]) -> Hits {
        let mut hits = [None; WIDTH];
        let mut crowd = Crowd::new(rays);
        let mut stack = [(0_u32, 0.0_f32); MOST_LEVELS + 1];
        let mut size = usize::from(!self.nodes.is_empty());
        while size > 0 {
            size -= 1;
            let (index, near) = stack[size];
            if near > crowd.farthest() * FAR_SLACK {
                continue;
            }
            match self.nodes[index as usize].child {
                Child::Instance(instance) => {
                    let Entries { mask, .. } = crowd.entries(&self.nodes[index as usize]);
                    self.visit(instance as usize, mask, rays, &mut crowd, &mut hits);
                }
                Child::Pair(second) => {
                    let [a, b] = [index + 1, second].map(|child| {
                        let Entries { mask, near } = crowd.entries(&self.nodes[child as usize]);
                        (mask != 0).then_some((child, near))
                    });
                    let is_second_nearer = matches!((a, b), (Some(a), Some(b)) if b.1 < a.1);
                    let (near, far) = if is_second_nearer { (b, a) } else { (a, b) };
                    for child in [far, near].into_iter().flatten() {
                        stack[size] = child;
                        size += 1;
                    }
                }
            }
        }
        hits
    }

    /// Asks an instance for the rays whose bit is set.
    fn visit(&self, index: usize, mask: u32, rays: &[Ray], crowd: &mut Crowd, hits: &mut Hits) {
        let Instance { mesh, place } = &self.instances[index];
        let lanes = || (0..rays.len()).filter(|lane| mask >> lane & 1 == 1);
        let (mut asked, mut found) = ([Ray::new(glam::Vec3::ZERO, glam::Vec3::X); WIDTH], [None; WIDTH]);
        let mut count = 0;
        for lane in lanes() {
            asked[count] = Ray { t_max: crowd.t_max[lane], ..place.object_from_world(&rays[lane]) };
            count += 1;
        }
        mesh.closest_hits(&asked[..count], &mut found[..count]);
        for (lane, hit) in lanes().zip(found) {
            if let Some(hit) = hit
                && is_before((index, hit), hits[lane])
            {
                hits[lane] = Some((index, hit));
                crowd.t_max[lane] = hit.t;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::super::tests::{crowd, ray, unit};
    use super::*;

    /// Rays around one, more and less apart, of all lengths.
    fn fan(k: u32, spread: f32) -> Vec<Ray> {
        let around = ray(k);
        let jitter =
            |i: u32, s: f32| Vec3::new(unit(i, 0.37 + s), unit(i, 0.61 + s), unit(i, 0.83 + s)) - 0.5;
        let one = |i: u32| {
            let t_max = if i.is_multiple_of(3) { 40.0 * unit(i, 0.71) } else { f32::INFINITY };
            let (origin, direction) = (jitter(i + k, 0.0), jitter(i + k, 0.007));
            Ray::segment(around.origin + 8.0 * spread * origin, around.direction + spread * direction, t_max)
        };
        (0..1 + k % 40).map(one).collect()
    }

    fn check(instances: &Instances, rays: &[Ray]) -> usize {
        // Of another question.
        let stale = Some((7, Hit { t: 1.0, triangle: 0, barycentrics: [1.0, 0.0, 0.0] }));
        let mut hits = vec![stale; rays.len()];
        instances.closest_hits(rays, &mut hits);
        for (ray, hit) in rays.iter().zip(&hits) {
            assert_eq!(*hit, instances.closest_hit(ray), "{ray:?}");
        }
        let mut any = vec![true; rays.len()];
        instances.any_hits(rays, &mut any);
        assert_eq!(any, hits.iter().map(Option::is_some).collect::<Vec<_>>(), "{rays:?}");
        hits.iter().flatten().count()
    }

    #[test]
    fn rays_together_find_what_each_finds() {
        for count in [0, 1, 2, 7, 300] {
            // Every place twice: of two hits at the same distance the lower instance's counts.
            let twice = crowd(count).into_iter().chain(crowd(count)).collect();
            let instances = Instances::new(twice);
            let mut found = 0;
            for spread in [0.0, 1e-4, 0.01, 0.1, 1.0] {
                found += (0..400).map(|k| check(&instances, &fan(k, spread))).sum::<usize>();
            }
            assert!(count < 7 || found > 500, "{found} hits of {count} instances test little");
        }
    }

    #[test]
    fn rays_that_are_none_find_what_each_finds() {
        let instances = Instances::new(crowd(60));
        let mut rays = fan(39, 0.01);
        rays[1].t_max = 0.0;
        rays[2].t_max = f32::NAN;
        rays[5].origin = Vec3::NAN;
        rays[9].direction = Vec3::ZERO;
        rays[12].origin.x = f32::INFINITY;
        check(&instances, &rays);
        // Along an axis, beside boxes' sides.
        let along = |k: u32| Ray::new(Vec3::new(unit(k, 0.618), unit(k, 0.755), -2.0) * 10.0, Vec3::Z);
        assert!(check(&instances, &(0..200).map(along).collect::<Vec<_>>()) > 10);
    }
}
