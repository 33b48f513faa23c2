//! [`ShadingPoint`]: what the integrator knows about a hit.

use glam::Vec3;
use osculate_geom::rays::{Hit, SurfacePoint};
use osculate_sbtf::brdf::{Bsdf, BsdfParameters};
use osculate_sbtf::micro::Reflectance;

use crate::math::Frame;
use crate::prepared::{Facet, Prepared};
use crate::scene::{Material, MicroPoint};

/// A point on an object, seen from `wo`. Both sides of a triangle look alike.
pub(crate) struct ShadingPoint<'a> {
    /// Where rays start that leave the surface on the viewer's side.
    pub origin: Vec3,
    /// Frame around the shading normal, on the viewer's side.
    pub frame: Frame,
    /// Direction to the viewer in that frame.
    pub wo: Vec3,
    pub uv: [f32; 2],
    pub material: &'a Material,
    /// Of a microstructure's maps, in the place of the material's.
    reflectance: Option<Reflectance>,
    /// The surface's own normal on the viewer's side, if directions below its plane carry no light; see [`Self::absorbs`].
    horizon: Option<Vec3>,
}

impl<'a> ShadingPoint<'a> {
    /// `wo` is the unit direction to the viewer; the triangle must belong to an object.
    pub(crate) fn new(scene: &'a Prepared, hit: &Hit, wo: Vec3) -> Self {
        let facet @ Facet { corners, normals, .. } = scene.facet(hit.triangle);
        let material = scene.material_of(hit.triangle).expect("a triangle of an object");
        let point = scene.geometry.surface_point(hit);
        let uv = facet.uv_at(hit.barycentrics);
        let micro = material.micro.as_ref().and_then(|micro| {
            let (object, local) = scene.object_of(hit.triangle)?;
            micro.at(&scene.objects[object].placement, local, uv, point.position)
        });
        let geometric = if point.normal.dot(wo) < 0.0 { -point.normal } else { point.normal };
        if let Some(micro) = micro {
            return Self::on_micro(micro, &point, geometric, wo, uv, material);
        }
        let [u, v, w] = hit.barycentrics;
        let blended = u * normals[0] + v * normals[1] + w * normals[2];
        let side = if blended.dot(geometric) < 0.0 { -1.0 } else { 1.0 };
        let smooth = (side * blended).try_normalize().unwrap_or(geometric);
        let shading = facing_viewer(smooth, wo);
        let lifted = lifted(corners, normals.map(|n| side * n), hit.barycentrics, point.position);
        let frame = Frame::new(shading);
        Self {
            origin: point.offset_by(geometric, lifted),
            frame,
            wo: frame.local_from_world(wo),
            uv,
            material,
            reflectance: None,
            horizon: None,
        }
    }

    /// On the triangles of a microstructure, with its normal; `geometric` is on the viewer's side.
    fn on_micro(
        micro: MicroPoint,
        point: &SurfacePoint,
        geometric: Vec3,
        wo: Vec3,
        uv: [f32; 2],
        material: &'a Material,
    ) -> Self {
        let smooth = if micro.normal.dot(geometric) < 0.0 { -micro.normal } else { micro.normal };
        let frame = Frame::new(facing_viewer(smooth, wo));
        let origin = point.offset_by(geometric, micro.position);
        let facet = micro.facet.unwrap_or(geometric);
        let horizon = Some(if facet.dot(geometric) < 0.0 { -facet } else { facet });
        let reflectance = Some(micro.reflectance);
        Self { origin, frame, wo: frame.local_from_world(wo), uv, material, reflectance, horizon }
    }

    /// Whether light in this direction is lost: it is above the shading normal's horizon and goes into the surface.
    ///
    /// A microstructure's surface is what it is, and what goes into it is absorbed, as in other renderers. A Lambert surface whose two
    /// normals are at the angle `t` loses `(1 - cos t) / 2` of the light so. Displaced triangles count by the bilinear heights that they
    /// stand for: their own planes turn further from the shading normals, the more the larger they are. On ordinary meshes the triangles
    /// only stand for the smooth surface: rays start on that (see [`lifted`]), and such directions are free.
    pub(crate) fn absorbs(&self, wi: Vec3) -> bool {
        self.horizon.is_some_and(|normal| normal.dot(wi) < 0.0)
    }

    pub(crate) fn bsdf(&self, scene: &Prepared, base_color: Vec3) -> Bsdf {
        let m = self.material;
        let parameters = match self.reflectance {
            Some(r) => BsdfParameters {
                base_color: r.albedo,
                metallic: r.metalness,
                roughness: r.roughness,
                specular: m.specular,
            },
            None => BsdfParameters {
                base_color,
                metallic: m.metallic,
                roughness: m.roughness,
                specular: m.specular,
            },
        };
        Bsdf::new(&parameters, &scene.energy)
    }
}

/// Bends a shading normal that faces away from the viewer back to just facing it.
///
/// At silhouettes of smooth-shaded triangles the interpolated normal can point away; without this they show black rims.
fn facing_viewer(normal: Vec3, wo: Vec3) -> Vec3 {
    /// Cosine from which on normals are bent. Smaller ones leave dark rims, larger ones flatten visible shading.
    const LEAST: f32 = 0.02;
    let cosine = normal.dot(wo);
    if cosine >= LEAST { normal } else { (normal + (LEAST - cosine) * wo).normalize() }
}

/// The point on the smooth surface that the shading normals suggest, never below the triangle.
///
/// Hanika, "Hacking the Shadow Terminator", Ray Tracing Gems II, 2021. Rays that start there do not see the facets of the
/// triangle mesh, whose shadows would otherwise show along the terminator.
fn lifted(corners: [Vec3; 3], normals: [Vec3; 3], weights: [f32; 3], position: Vec3) -> Vec3 {
    let mut offset = Vec3::ZERO;
    for i in 0..3 {
        // Projected onto the tangent plane of each corner, where that lies above.
        let below = (position - corners[i]).dot(normals[i]).min(0.0);
        offset -= weights[i] * below * normals[i];
    }
    position + offset
}
