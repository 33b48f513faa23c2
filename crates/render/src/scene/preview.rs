//! The default look: a studio that fits any mesh.

use std::collections::HashMap;
use std::sync::Arc;

use glam::Vec3;
use osculate_geom::{Mesh, Vec3 as Vec3d};

use super::{Material, MeshInstance, Placement, Role, Scene, SurfaceSource};
use crate::camera::Camera;
use crate::lights::{Environment, EnvironmentImage, Light, RectangleLight};
use crate::prepared::FARTHEST;

/// How a mesh without a scene is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PreviewOptions {
    /// Width and height of the image in pixels. Default: 960 x 720.
    pub size: [u32; 2],
    /// From the subject towards the viewer. Default: from the front, right of it and a little above.
    pub towards_viewer: Vec3,
    /// Full vertical field of view in radians. Default: 30 degrees, a long lens.
    pub fov_y: f32,
}

impl Default for PreviewOptions {
    fn default() -> Self {
        Self { size: [960, 720], towards_viewer: Vec3::new(0.62, 0.36, 1.0), fov_y: 30_f32.to_radians() }
    }
}

impl Scene {
    /// Objects in a photographer's studio: a large soft key light from the upper left, a weaker one from behind on the right,
    /// a soft gradient around, and a backdrop that rises from the floor without an edge. The camera sees all of them.
    ///
    /// Objects stand on the floor as they are; +Y is up. Works for any size and for no objects at all.
    #[must_use]
    pub fn preview(mut objects: Vec<MeshInstance>, options: &PreviewOptions) -> Self {
        let [width, height] = options.size;
        let points = outline(&objects);
        let bounds = points.iter().map(|&p| (p, p));
        let (lower, upper) = bounds
            .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
            .unwrap_or((Vec3::splat(-0.5), Vec3::splat(0.5)));
        let towards = options.towards_viewer;
        let camera = Camera::framing(&points, towards, options.fov_y, width as f32 / height.max(1) as f32);
        let center = 0.5 * (lower + upper);
        let radius = match 0.5 * (upper - lower).length() {
            r if r > 0.0 => r,
            _ => 1.0,
        };
        let back = Vec3::new(towards.x, 0.0, towards.z).try_normalize().unwrap_or(Vec3::Z);
        let right = Vec3::Y.cross(back);
        let floor = Vec3::new(center.x, lower.y, center.z);
        objects.push(backdrop(floor, back, right, radius));
        let at = |x: f32, y: f32, z: f32| center + radius * (x * right + y * Vec3::Y + z * back);
        let rectangle = |position: Vec3, size: f32, radiance: Vec3| {
            Light::Rectangle(RectangleLight::facing(position, center, size * radius, size * radius, radiance))
        };
        let lights = vec![
            rectangle(at(-3.2, 3.9, 2.0), 2.4, Vec3::new(14.0, 13.3, 12.4)),
            rectangle(at(3.4, 2.4, -2.4), 1.8, Vec3::new(9.5, 10.4, 12.0)),
        ];
        let image = EnvironmentImage::from_fn(64, 32, |w| studio_gradient(w, back));
        let environment = Environment::Image { image: Arc::new(image), intensity: 1.0, rotation: 0.0 };
        Self { camera, width, height, objects, lights, environment, exposure: 0.0 }
    }
}

/// Points that the objects lie between: their vertices; of meshes that several objects share the corners of their boxes.
fn outline(objects: &[MeshInstance]) -> Vec<Vec3> {
    let mut uses: HashMap<*const Mesh, usize> = HashMap::new();
    for object in objects {
        *uses.entry(Arc::as_ptr(&object.mesh)).or_default() += 1;
    }
    let mut boxes: HashMap<*const Mesh, Vec<Vec3>> = HashMap::new();
    let mut points = Vec::new();
    for object in objects {
        let mesh = Arc::as_ptr(&object.mesh);
        if uses[&mesh] == 1 {
            points.extend(object.world_positions());
        } else {
            let corners = boxes.entry(mesh).or_insert_with(|| box_corners(object));
            points.extend(corners.iter().map(|&p| object.placement.world_from_object(p)));
        }
    }
    // What is further away will be refused; until then numbers stay finite.
    let most = Vec3::splat(FARTHEST);
    points.iter_mut().for_each(|p| *p = if p.is_finite() { p.clamp(-most, most) } else { most });
    points
}

/// Corners of the mesh's box in its own space; none without vertices.
fn box_corners(object: &MeshInstance) -> Vec<Vec3> {
    let here = MeshInstance { placement: Placement::default(), ..object.clone() };
    let Some((lower, upper)) = here.bounds() else { return Vec::new() };
    let pick = |k: usize, axis: usize| if k >> axis & 1 == 0 { lower[axis] } else { upper[axis] };
    (0..8).map(|k| Vec3::new(pick(k, 0), pick(k, 1), pick(k, 2))).collect()
}

/// Soft light from above and from the viewer's side, little from behind and below.
fn studio_gradient(w: Vec3, towards_viewer: Vec3) -> Vec3 {
    let up = 0.5 + 0.5 * w.y;
    let front = 0.5 + 0.5 * w.dot(towards_viewer);
    (0.03 + 0.16 * up * up + 0.06 * front) * Vec3::new(0.95, 0.99, 1.06)
}

/// A floor that bends up into a wall behind the subject, wide enough to fill the view.
fn backdrop(floor: Vec3, back: Vec3, right: Vec3, radius: f32) -> MeshInstance {
    // Profile from the viewer's side to the top of the wall, in units of the radius: distance behind the subject, height.
    const BEND: f32 = 5.0;
    const BEND_START: f32 = 4.0;
    const STEPS: u8 = 32;
    let mut profile = vec![(-40.0, 0.0, 0.0_f32)];
    for i in 0..=STEPS {
        let angle = std::f32::consts::FRAC_PI_2 * f32::from(i) / f32::from(STEPS);
        profile.push((BEND_START + BEND * angle.sin(), BEND * (1.0 - angle.cos()), angle));
    }
    profile.push((BEND_START + BEND, 40.0, std::f32::consts::FRAC_PI_2));
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for &(away, height, angle) in &profile {
        for side in [-60.0, 60.0] {
            positions.push(to_f64(floor + radius * (side * right + height * Vec3::Y - away * back)));
            normals.push(to_f64(angle.cos() * Vec3::Y + angle.sin() * back));
        }
    }
    let quads = 0..u32::try_from(profile.len() - 1).expect("a short profile");
    let triangles =
        quads.flat_map(|i| [[2 * i, 2 * i + 1, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 2]]).collect();
    let mesh =
        Mesh::new(positions, triangles).and_then(|m| m.with_normals(normals)).expect("a finite backdrop");
    let material = Material { name: "backdrop".into(), ..Material::lambert(Vec3::new(0.50, 0.51, 0.53)) };
    MeshInstance {
        surface: SurfaceSource::Material(material),
        role: Role::Backdrop,
        ..MeshInstance::new(Arc::new(mesh))
    }
}

fn to_f64(v: Vec3) -> Vec3d {
    Vec3d::new(v.x.into(), v.y.into(), v.z.into())
}
