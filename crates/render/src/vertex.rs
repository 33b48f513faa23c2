//! [`Vertex`]: a path vertex, whatever the surface there is made of.

use glam::Vec3;

use osculate_sbtf::brdf::{Bsdf, EnergyTable};

use crate::lights::{Receiver, Sees};
use crate::present::BELOW_HORIZON;
use crate::shading::ShadingPoint;
use crate::silhouette::SilhouetteVertex;

/// An ordinary surface, seen from either side.
pub(crate) struct Surface<'a> {
    pub point: ShadingPoint<'a>,
    pub bsdf: Bsdf,
}

/// A point where light is reflected. Directions are in the world. What is large about it lies elsewhere.
#[derive(Clone, Copy)]
pub(crate) enum Vertex<'v> {
    Surface(&'v Surface<'v>),
    /// A bounding surface with a silhouette BTF under it.
    Silhouette(SilhouetteVertex<'v>),
}

/// A sampled direction.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scattered {
    pub wi: Vec3,
    /// Reflected radiance over incoming radiance and density.
    pub weight: Vec3,
    /// Density over solid angle.
    pub pdf: f32,
}

impl Scattered {
    /// A direction that was drawn with this density, and the reflected radiance; `None` where nothing is reflected.
    pub(crate) fn new(wi: Vec3, value: Vec3, pdf: f32) -> Option<Self> {
        (pdf > 0.0 && value != Vec3::ZERO).then(|| Self { wi, weight: value / pdf, pdf })
    }
}

impl Vertex<'_> {
    /// Whether asking for reflectance here asks a material with silhouettes.
    pub(crate) fn is_silhouette(&self) -> bool {
        matches!(self, Self::Silhouette(_))
    }

    pub(crate) fn receiver(&self) -> Receiver {
        match self {
            Self::Surface(Surface { point, .. }) => {
                Receiver { origin: point.origin, normal: point.frame.n, sees: Sees::Hemisphere }
            }
            Self::Silhouette(vertex) => Receiver {
                origin: vertex.origin_towards(vertex.normal()),
                normal: vertex.normal(),
                sees: if BELOW_HORIZON { Sees::Sphere } else { Sees::Hemisphere },
            },
        }
    }

    /// Where rays start that leave in this direction.
    pub(crate) fn origin_towards(&self, direction: Vec3) -> Vec3 {
        match self {
            Self::Surface(Surface { point, .. }) => point.origin,
            Self::Silhouette(point) => point.origin_towards(direction),
        }
    }

    /// Reflected radiance for light of unit irradiance across its direction, and the density with which [`Self::sample`]
    /// draws the direction.
    pub(crate) fn eval(&self, wi: Vec3, energy: &EnergyTable) -> (Vec3, f32) {
        match self {
            Self::Surface(Surface { point, bsdf }) => {
                let (value, pdf) = bsdf.eval(point.wo, point.frame.local_from_world(wi), energy);
                (if point.absorbs(wi) { Vec3::ZERO } else { value }, pdf)
            }
            Self::Silhouette(point) => point.eval(wi),
        }
    }

    /// Draws a direction, or `None` where nothing is reflected.
    pub(crate) fn sample(&self, pick: f32, u: [f32; 2], energy: &EnergyTable) -> Option<Scattered> {
        match self {
            Self::Surface(Surface { point, bsdf }) => {
                let sample = bsdf.sample(point.wo, pick, u, energy)?;
                let wi = point.frame.world_from_local(sample.wi);
                (!point.absorbs(wi)).then_some(Scattered { wi, weight: sample.weight, pdf: sample.pdf })
            }
            Self::Silhouette(point) => {
                let wi = point.draw(pick, u);
                let (value, pdf) = point.eval(wi);
                Scattered::new(wi, value, pdf)
            }
        }
    }
}
