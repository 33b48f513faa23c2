//! [`Instances`]: meshes that stand in many places, each with one hierarchy, under a hierarchy over the places.

mod crowd;

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Mat3, Vec3};

use super::bundle;
use super::bvh::Bvh;
use super::ray::{Hit, PreparedRay, Ray};

/// A similarity: `world = translation + scale * rotation * object`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// Orthonormal with determinant 1.
    pub rotation: Mat3,
    /// Positive.
    pub scale: f32,
    /// World units.
    pub translation: Vec3,
}

impl Similarity {
    /// Where a point of the object is in the world.
    #[must_use]
    pub fn world_from_object(&self, p: Vec3) -> Vec3 {
        self.translation + self.scale * (self.rotation * p)
    }

    /// The ray as the object sees it, with the same `t`.
    #[must_use]
    pub fn object_from_world(&self, ray: &Ray) -> Ray {
        let turn = |v: Vec3| (self.rotation.transpose() * v) / self.scale;
        Ray { origin: turn(ray.origin - self.translation), direction: turn(ray.direction), t_max: ray.t_max }
    }

    /// Bound on what the changes of space add to the rounding error of each coordinate of a world-space point of the object: of the
    /// corners that it is made of, and of the next ray that starts there.
    #[must_use]
    pub fn rounding(&self, position: Vec3) -> f32 {
        // Nine products and sums for a corner, ten for a ray, each of coordinates no larger than these in all.
        10.0 * f32::EPSILON * (position.length() + 2.0 * self.translation.length())
    }
}

/// A mesh at a place.
#[derive(Debug, Clone)]
struct Instance {
    mesh: Arc<Bvh>,
    place: Similarity,
}

/// A node of the hierarchy over the places: a box, and either two nodes or one instance.
#[derive(Debug, Clone, Copy)]
struct Node {
    lower: Vec3,
    upper: Vec3,
    child: Child,
}

#[derive(Debug, Clone, Copy)]
enum Child {
    /// The second of two nodes; the first follows its parent.
    Pair(u32),
    Instance(u32),
}

/// Meshes in places. Hits are those of the meshes in their own space, so `t` and weights are rounded there.
#[derive(Debug, Clone, Default)]
pub struct Instances {
    instances: Vec<Instance>,
    nodes: Vec<Node>,
}

/// Levels of a tree that is halved at every node: more than 2^32 instances would have.
const MOST_LEVELS: usize = 33;

impl Instances {
    /// Builds the hierarchy over the places. Those of meshes without triangles are never hit.
    ///
    /// # Panics
    ///
    /// If there are more than `u32::MAX / 2` instances, or a box is not finite.
    #[must_use]
    pub fn new(placed: Vec<(Arc<Bvh>, Similarity)>) -> Self {
        assert!(placed.len() < (u32::MAX / 2) as usize, "too many instances");
        let instances: Vec<Instance> =
            placed.into_iter().map(|(mesh, place)| Instance { mesh, place }).collect();
        // Of each mesh in its own space: it may have many triangles, and stand in many places.
        let mut boxes = HashMap::new();
        let boxed = |(index, instance): (u32, &Instance)| {
            let own = *boxes.entry(Arc::as_ptr(&instance.mesh)).or_insert_with(|| bounds(&instance.mesh));
            let (lower, upper) = instance.bounds(own?);
            assert!(lower.is_finite() && upper.is_finite(), "instance {index} is not finite");
            Some(Node { lower, upper, child: Child::Instance(index) })
        };
        let mut leaves: Vec<Node> = (0..).zip(&instances).filter_map(boxed).collect();
        let mut nodes = Vec::with_capacity(2 * leaves.len());
        if !leaves.is_empty() {
            build(&mut leaves, &mut nodes);
        }
        Self { instances, nodes }
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.instances.is_empty()
    }

    /// Bytes of the places and of the hierarchy over them, without the meshes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        size_of_val::<[Instance]>(&self.instances) + size_of_val::<[Node]>(&self.nodes)
    }

    /// The instance with the smallest `t` and the hit in it; of several the lowest instance, and its lowest triangle.
    #[must_use]
    pub fn closest_hit(&self, ray: &Ray) -> Option<(usize, Hit)> {
        let mut best: Option<(usize, Hit)> = None;
        self.walk(ray, |index, t_max| {
            let Instance { mesh, place } = &self.instances[index];
            let hit = mesh.closest_hit(&Ray { t_max, ..place.object_from_world(ray) })?;
            is_before((index, hit), best).then(|| best = Some((index, hit)))?;
            Some(hit.t)
        });
        best
    }

    /// [`Self::closest_hit`] of every ray. Rays that follow each other and go much the same way are traced together, which is faster.
    ///
    /// # Panics
    ///
    /// If there are not as many answers as rays.
    pub fn closest_hits(&self, rays: &[Ray], hits: &mut [Option<(usize, Hit)>]) {
        assert_eq!(rays.len(), hits.len(), "an answer for every ray");
        self.trace_all(rays, hits, |ray| self.closest_hit(ray), |hit| hit);
    }

    /// [`Self::any_hit`] of every ray; traced together as by [`Self::closest_hits`].
    ///
    /// # Panics
    ///
    /// If there are not as many answers as rays.
    pub fn any_hits(&self, rays: &[Ray], any: &mut [bool]) {
        assert_eq!(rays.len(), any.len(), "an answer for every ray");
        self.trace_all(rays, any, |ray| self.any_hit(ray), |hit| hit.is_some());
    }

    /// Asks for rays on their own, or makes answers of the closest hits of those that are traced together.
    fn trace_all<T>(
        &self,
        mut rays: &[Ray],
        mut answers: &mut [T],
        of_one: impl Fn(&Ray) -> T,
        of_hit: impl Fn(Option<(usize, Hit)>) -> T,
    ) {
        while !rays.is_empty() {
            let (these, others) = rays.split_at(bundle::alike(rays));
            let (answered, open) = answers.split_at_mut(these.len());
            if these.len() < bundle::FEWEST {
                these.iter().zip(answered).for_each(|(ray, answer)| *answer = of_one(ray));
            } else {
                let hits = self.closest_of_crowd(these);
                answered.iter_mut().zip(hits).for_each(|(answer, hit)| *answer = of_hit(hit));
            }
            (rays, answers) = (others, open);
        }
    }

    /// Whether the ray meets any instance at `0 < t <= t_max`.
    #[must_use]
    pub fn any_hit(&self, ray: &Ray) -> bool {
        let mut any = false;
        self.walk(ray, |index, t_max| {
            let Instance { mesh, place } = &self.instances[index];
            any = any || mesh.any_hit(&Ray { t_max, ..place.object_from_world(ray) });
            // Nothing is nearer than that.
            any.then_some(0.0)
        });
        any
    }

    /// Calls `visit` with the instances whose boxes the ray meets, the nearer child first; what it returns shortens the ray.
    fn walk(&self, ray: &Ray, mut visit: impl FnMut(usize, f32) -> Option<f32>) {
        let inverse = Vec3::from(PreparedRay::new(ray).inverse_direction);
        let mut t_max = ray.t_max;
        let mut stack = [(0_u32, 0.0_f32); MOST_LEVELS + 1];
        let Some(near) = self.nodes.first().and_then(|node| node.entry(ray.origin, inverse, t_max)) else {
            return;
        };
        let mut size = 1;
        stack[0] = (0, near);
        while size > 0 {
            size -= 1;
            let (index, near) = stack[size];
            if near > t_max * FAR_SLACK {
                continue;
            }
            match self.nodes[index as usize].child {
                Child::Instance(instance) => {
                    if let Some(t) = visit(instance as usize, t_max) {
                        t_max = t;
                    }
                }
                Child::Pair(second) => {
                    let entry = |child: u32| {
                        Some((child, self.nodes[child as usize].entry(ray.origin, inverse, t_max)?))
                    };
                    let (near, far) = match (entry(index + 1), entry(second)) {
                        (Some(a), Some(b)) if b.1 < a.1 => (Some(b), Some(a)),
                        pair => pair,
                    };
                    for child in [far, near].into_iter().flatten() {
                        stack[size] = child;
                        size += 1;
                    }
                }
            }
        }
    }
}

/// Whether a hit that is not farther than the one before it takes its place: of two at the same distance that of the lower instance does.
fn is_before((index, hit): (usize, Hit), best: Option<(usize, Hit)>) -> bool {
    best.is_none_or(|(other, old)| hit.t != old.t || index < other)
}

/// Three roundings in the product and difference of a slab test, twice over.
const FAR_SLACK: f32 = 1.0 + 8.0 * f32::EPSILON;

impl Instance {
    /// Corners of a box around it in the world, given those of its mesh.
    fn bounds(&self, (lower, upper): (Vec3, Vec3)) -> (Vec3, Vec3) {
        let corner = |k: usize| {
            let pick = |axis: usize| if k >> axis & 1 == 0 { lower[axis] } else { upper[axis] };
            self.place.world_from_object(Vec3::new(pick(0), pick(1), pick(2)))
        };
        let first = corner(0);
        let (lower, upper) = (1..8).map(corner).fold((first, first), |(l, u), p| (l.min(p), u.max(p)));
        let farthest = lower.abs().max(upper.abs());
        // The mesh's own boxes have a margin of their extent for the triangle test; here that of both spaces.
        let margin = self.place.rounding(farthest) + (upper - lower).max_element() * (1.0 / 262_144.0);
        (lower - margin, upper + margin)
    }
}

/// Corners of a mesh's box, `None` without triangles.
fn bounds(mesh: &Bvh) -> Option<(Vec3, Vec3)> {
    let corners = mesh.triangles().iter().flatten();
    corners.map(|&p| (p, p)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

impl Node {
    /// Where the ray enters the box, if it does within `t_max`.
    fn entry(&self, origin: Vec3, inverse: Vec3, t_max: f32) -> Option<f32> {
        let (a, b) = ((self.lower - origin) * inverse, (self.upper - origin) * inverse);
        let (mut near, mut far) = (0.0_f32, t_max);
        for axis in 0..3 {
            near = near.max(a[axis].min(b[axis]));
            far = far.min(a[axis].max(b[axis]));
        }
        (near <= far * FAR_SLACK).then_some(near)
    }
}

/// Emits the hierarchy of these leaves, at least one: halves along the longest axis of their centres.
fn build(leaves: &mut [Node], nodes: &mut Vec<Node>) {
    let bounds = |(l, u): (Vec3, Vec3), n: &Node| (l.min(n.lower), u.max(n.upper));
    let (lower, upper) = leaves.iter().fold((leaves[0].lower, leaves[0].upper), bounds);
    let [leaf] = leaves else {
        let center = |n: &Node| 0.5 * (n.lower + n.upper);
        let first = center(&leaves[0]);
        let (l, u) = leaves.iter().map(center).fold((first, first), |(l, u), c| (l.min(c), u.max(c)));
        let axis = (u - l).max_position();
        let middle = leaves.len() / 2;
        leaves.select_nth_unstable_by(middle, |a, b| center(a)[axis].total_cmp(&center(b)[axis]));
        let at = nodes.len();
        nodes.push(Node { lower, upper, child: Child::Pair(0) });
        let (one, two) = leaves.split_at_mut(middle);
        build(one, nodes);
        let second = u32::try_from(nodes.len()).expect("fewer than 2^32 nodes");
        nodes[at].child = Child::Pair(second);
        build(two, nodes);
        return;
    };
    nodes.push(*leaf);
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A tetrahedron.
    pub(super) fn body() -> Arc<Bvh> {
        let p = [
            Vec3::new(1.0, 1.0, 1.0),
            Vec3::new(1.0, -1.0, -1.0),
            Vec3::new(-1.0, 1.0, -1.0),
            Vec3::new(-1.0, -1.0, 1.0),
        ];
        Arc::new(Bvh::new(vec![
            [p[0], p[1], p[2]],
            [p[0], p[3], p[1]],
            [p[0], p[2], p[3]],
            [p[1], p[3], p[2]],
        ]))
    }

    pub(super) fn unit(k: u32, step: f32) -> f32 {
        (k as f32 * step).fract()
    }

    pub(super) fn crowd(count: u32) -> Vec<(Arc<Bvh>, Similarity)> {
        let body = body();
        let place = |k: u32| {
            let at = Vec3::new(unit(k, 0.618_034), unit(k, 0.754_878), unit(k, 0.569_84)) * 20.0 - 10.0;
            let rotation =
                Mat3::from_euler(glam::EulerRot::ZYX, unit(k, 0.31) * 6.0, unit(k, 0.77) * 6.0, k as f32);
            (body.clone(), Similarity { rotation, scale: 0.2 + unit(k, 0.43), translation: at })
        };
        (0..count).map(place).collect()
    }

    pub(super) fn ray(k: u32) -> Ray {
        let at = |s: f32| Vec3::new(unit(k, 0.17 + s), unit(k, 0.29 + s), unit(k, 0.37 + s)) - 0.5;
        Ray::new(40.0 * at(0.003), 2.0 * at(0.211))
    }

    /// Asking every instance in turn is the definition.
    #[test]
    fn the_hierarchy_finds_what_asking_every_instance_finds() {
        for count in [0, 1, 2, 3, 7, 300] {
            let all = crowd(count);
            let instances = Instances::new(all.clone());
            let mut hits = 0;
            for ray in (0..3000).map(ray) {
                let mut wanted: Option<(usize, Hit)> = None;
                for (k, (mesh, place)) in all.iter().enumerate() {
                    let Some(hit) = mesh.closest_hit(&place.object_from_world(&ray)) else { continue };
                    if wanted.is_none_or(|(_, best)| hit.t < best.t) {
                        wanted = Some((k, hit));
                    }
                }
                assert_eq!(instances.closest_hit(&ray), wanted, "{ray:?}");
                assert_eq!(instances.any_hit(&ray), wanted.is_some());
                if let Some((_, hit)) = wanted {
                    hits += 1;
                    let short = Ray { t_max: 0.99 * hit.t, ..ray };
                    assert_eq!(instances.closest_hit(&short), None);
                    assert!(!instances.any_hit(&short));
                }
            }
            assert!(count < 7 || hits > 50, "{hits} hits of {count} instances test little");
        }
    }

    /// The same place twice: the lower number wins, as with triangles.
    #[test]
    fn ties_go_to_the_first_instance() {
        let mut all = crowd(5);
        all.extend(crowd(5));
        let instances = Instances::new(all);
        let found: Vec<usize> = (0..3000).filter_map(|k| Some(instances.closest_hit(&ray(k))?.0)).collect();
        assert!(found.len() > 20 && found.iter().all(|&k| k < 5), "{found:?}");
    }

    /// Rays that leave an instance from its surface never meet it again, at any scale, place and distance from the origin.
    #[test]
    fn leaving_an_instance_does_not_hit_it_again() {
        let body = body();
        for (scale, far) in [(1.0, 0.0), (1e-3, 1.0), (1.0, 1e3), (1e3, 1e3), (0.1, 1e4)] {
            for k in 0..500 {
                let rotation =
                    Mat3::from_euler(glam::EulerRot::ZYX, unit(k, 0.31) * 6.0, unit(k, 0.77) * 6.0, 1.0);
                let place =
                    Similarity { rotation, scale, translation: Vec3::new(far, -0.7 * far, 0.3 * far) };
                let instances = Instances::new(vec![(body.clone(), place)]);
                let inside = ray(k);
                let target = place.world_from_object(0.2 * inside.direction);
                let origin = target + 5.0 * scale * inside.direction.normalize();
                let Some((_, hit)) = instances.closest_hit(&Ray::new(origin, target - origin)) else {
                    continue;
                };
                let corners = body.triangles()[hit.triangle as usize].map(|p| place.world_from_object(p));
                let mut point = super::super::SurfacePoint::new(corners, hit.barycentrics);
                point.error += place.rounding(point.position);
                for out in [point.normal, point.normal + 20.0 * point.normal.any_orthogonal_vector()] {
                    let escape = Ray::new(point.origin_towards(out), out);
                    assert_eq!(instances.closest_hit(&escape), None, "scale {scale}, at {far}, {k}");
                }
            }
        }
    }
}
