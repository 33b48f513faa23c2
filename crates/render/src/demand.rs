//! [`demands`]: what an object's material has to be told, and why.
//!
//! A material with silhouettes is asked for its opacity wherever a ray meets it, and needs the curvature there, which is the dearest part
//! of a picture. Three kinds of object can do without. Some materials make nothing of it, as the NeuMIP baseline. Where all triangles lie in one direction and their UV go on alike, curvature
//! is zero and the rate of the UV is everywhere the same. And where an object is nowhere convex, no ray that has entered a height
//! field leaves it again (`silhouette::largest_cosine` is zero), so that all of it is opaque.

use std::collections::HashMap;
use std::sync::Arc;

use osculate_geom::curvature::Status;
use osculate_geom::mesh::triangle_normal;
use osculate_geom::{Mesh, Vec3};
use osculate_sbtf::SeeThrough;

use crate::scene::{Material, MeshInstance, QueryForm, Scene, SilhouetteMaterial, SurfaceSource};

/// Whether something is needed: the reason for it, or against it.
pub(crate) type Reason = Result<String, String>;

/// What the material of one object with silhouettes has to be told.
#[derive(Debug, Clone)]
pub(crate) struct Demand {
    /// Whether the material makes anything of curvature.
    pub takes_curvature: bool,
    pub curvature: Reason,
    pub opacity: Reason,
    /// Whether what is seen lies below the surface, and so beside the point where the ray meets it.
    pub offset: bool,
    /// Least cosine at which a ray to a light is stopped whatever the curvature, where the curvature and the opacity would otherwise be asked for.
    pub opaque_from: Option<f32>,
}

/// How a mesh is bent, as far as it matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Bend {
    /// All triangles face one way, UV are an affine map of the plane.
    Flat,
    /// No vertex has a positive curvature, none lies on a crease or has no estimate.
    NowhereConvex,
    Any,
}

/// Cosine between the normals of triangles that lie in one plane: 1e-6 radians, what coordinates in single precision leave of a plane.
const PARALLEL: f64 = 1.0 - 0.5e-12;

/// Largest difference of UV gradients that are alike, relative to the largest gradient.
const ALIKE: f64 = 1e-5;

/// An entry per object; `None` for those without silhouettes. Meshes that are there several times are looked at once.
pub(crate) fn demands(scene: &Scene) -> Vec<Option<Demand>> {
    let mut known: HashMap<(*const Mesh, Option<*const ()>), Bend> = HashMap::new();
    let mut demand = |object: &MeshInstance| {
        let SurfaceSource::Material(Material { silhouette: Some(material), .. }) = &object.surface else {
            return None;
        };
        let curvature = object.curvature.as_ref().map(|c| c.as_ptr().cast());
        let key = (Arc::as_ptr(&object.mesh), curvature);
        let bend = *known.entry(key).or_insert_with(|| bend(object));
        Some(Demand::new(object, bend, material))
    };
    scene.objects.iter().map(&mut demand).collect()
}

impl Demand {
    fn new(object: &MeshInstance, bend: Bend, material: &SilhouetteMaterial) -> Self {
        let carries = object.curvature.is_some() || object.field.is_some();
        // The chord query also takes the rate of the UV along the ray, whatever the material makes of the curvature.
        let takes_curvature = material.btf.uses_curvature() || material.query == QueryForm::Chord;
        let curvature = match bend {
            _ if !takes_curvature => Err("of a material that makes nothing of it".to_owned()),
            _ if !carries => Err("carries no curvature: taken as flat".to_owned()),
            Bend::Flat => Err("flat, with UV that go on alike".to_owned()),
            Bend::NowhereConvex | Bend::Any => Ok("bent".to_owned()),
        };
        let opacity = match (material.btf.see_through(), bend) {
            (SeeThrough::Nowhere, _) => Err("of a material without holes or silhouettes".to_owned()),
            (SeeThrough::Anywhere, _) => Ok("of a material that rays may pass anywhere".to_owned()),
            (SeeThrough::WhereConvex, _) if curvature.is_err() => {
                Err("flat: what enters a height field ends in it".to_owned())
            }
            (SeeThrough::WhereConvex, Bend::NowhereConvex) => {
                Err("nowhere convex: what enters a height field ends in it".to_owned())
            }
            (SeeThrough::WhereConvex, _) => Ok("rays may pass where it is convex".to_owned()),
        };
        let opaque_from = (curvature.is_ok() && opacity.is_ok()).then(|| known_from(material)).flatten();
        let said = |from: f32| {
            format!("bent; not for rays to lights at cosines over {from:.3}: opaque whatever it is")
        };
        let curvature = opaque_from.map_or(curvature, |from| Ok(said(from)));
        Self { takes_curvature, curvature, opacity, offset: material.depth > 0.0, opaque_from }
    }
}

/// The least cosine at which a material is opaque whatever the curvature. In the chord query the cosine is one of the ray in the material's
/// metric, which is not known before the ray has been followed.
fn known_from(material: &SilhouetteMaterial) -> Option<f32> {
    let from = material.btf.opaque_from();
    (material.query == QueryForm::Paper && from < 1.0).then_some(from)
}

fn bend(object: &MeshInstance) -> Bend {
    if is_flat(&object.mesh) {
        return Bend::Flat;
    }
    // A field without estimates at vertices can be anything.
    let Some(curvature) = &object.curvature else { return Bend::Any };
    let regular = |status| matches!(status, Status::Ok | Status::Boundary | Status::OverTolerance);
    let is_hollow = |v: &osculate_geom::curvature::VertexCurvature| {
        regular(v.status) && v.principal.is_some_and(|p| p.kappa_max <= 0.0)
    };
    if curvature.iter().all(is_hollow) { Bend::NowhereConvex } else { Bend::Any }
}

/// Whether all triangles with an area face one way and their UV have one gradient.
fn is_flat(mesh: &Mesh) -> bool {
    let uvs = mesh.uv_sets().first();
    let mut first: Option<(Vec3, [Vec3; 2])> = None;
    for (index, triangle) in mesh.triangles().iter().enumerate() {
        let corners = mesh.corners(index);
        let Some(normal) = triangle_normal(corners) else { continue };
        let gradients = uvs.map_or([Vec3::zeros(); 2], |uvs| {
            uv_gradients(corners, &normal, triangle.map(|v| uvs[v as usize]))
        });
        let Some((known, alike)) = &first else {
            first = Some((normal, gradients));
            continue;
        };
        let scale = alike[0].amax().max(alike[1].amax());
        let same = |k: usize| (gradients[k] - alike[k]).amax() <= ALIKE * scale;
        if known.dot(&normal) < PARALLEL || !same(0) || !same(1) {
            return false;
        }
    }
    true
}

/// Gradients of u and v in the plane of a triangle with an area.
fn uv_gradients([a, b, c]: [Vec3; 3], normal: &Vec3, uvs: [[f64; 2]; 3]) -> [Vec3; 2] {
    let double_area = normal.dot(&(b - a).cross(&(c - a)));
    // The gradient of a corner's weight is the opposite side turned by a quarter.
    let opposite = [c - b, a - c, b - a].map(|side| normal.cross(&side) / double_area);
    [0, 1].map(|axis: usize| (0..3).map(|k| opposite[k] * uvs[k][axis]).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use osculate_geom::shapes;

    fn with_uv(mesh: &Mesh, uv: impl Fn(&Vec3) -> [f64; 2]) -> Mesh {
        let bare = Mesh::new(mesh.positions().to_vec(), mesh.triangles().to_vec()).unwrap();
        bare.with_uv_set(mesh.positions().iter().map(uv).collect()).unwrap()
    }

    #[test]
    fn gradients_of_an_affine_map() {
        let corners = [Vec3::new(1.0, 2.0, 0.5), Vec3::new(2.0, 2.5, 0.5), Vec3::new(0.5, 4.0, 0.5)];
        let uvs = corners.map(|p| [2.0 * p.x - p.y + 3.0, 0.5 * p.y]);
        let [u, v] = uv_gradients(corners, &Vec3::z(), uvs);
        assert!(
            (u - Vec3::new(2.0, -1.0, 0.0)).norm() < 1e-14 && (v - Vec3::new(0.0, 0.5, 0.0)).norm() < 1e-14
        );
    }

    #[test]
    fn flat_means_one_direction_and_one_map() {
        let plane = shapes::plane(6, 5);
        assert!(is_flat(&plane));
        assert!(is_flat(&with_uv(&plane, |p| [3.0 * p.x + p.y, p.y - 1.0])));
        assert!(!is_flat(&with_uv(&plane, |p| [p.x * p.x, p.y])));
        assert!(!is_flat(&shapes::torus(1.0, 0.4, 12, 8)));
        // A step of 1e-4 in height over one edge.
        let mut positions = plane.positions().to_vec();
        positions[17].z += 1e-4;
        assert!(!is_flat(&Mesh::new(positions, plane.triangles().to_vec()).unwrap()));
    }
}
