//! [`Counters`]: what a render did, to hold against what the plan said it would do.

use serde::Serialize;

/// How often each kind of work was done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Counters {
    /// Samples of pixels.
    pub samples: u64,
    /// Rays that look for the closest hit.
    pub rays: u64,
    /// Of these, rays that continue a path after its first hit.
    pub bounce_rays: u64,
    /// Points beyond a path's first where it gathered light.
    pub indirect_vertices: u64,
    /// Rays that look for any hit on the way to a light.
    pub shadow_rays: u64,
    /// Points drawn on area lights.
    pub area_light_samples: u64,
    /// Directional lights looked at.
    pub directional_samples: u64,
    /// Directions drawn from the environment.
    pub environment_samples: u64,
    /// Texture lookups.
    pub texture_lookups: u64,
    /// Surfaces passed because they let light through.
    pub pass_throughs: u64,
    /// Of these, by rays on the way to a light.
    pub shadow_pass_throughs: u64,
    /// Opacities asked of materials with silhouettes.
    pub opacity_queries: u64,
    /// Places below the surface asked of materials with silhouettes.
    pub offset_queries: u64,
    /// Reflectances asked of materials with silhouettes.
    pub reflectance_queries: u64,
    /// Lights drawn below the horizon of a material with silhouettes.
    pub below_horizon_lights: u64,
    /// Points drawn on the lens.
    pub lens_samples: u64,
    /// Evaluations of curvature.
    pub curvature_evaluations: u64,
    /// Walks over the surface for the curvature filter.
    pub filter_walks: u64,
    /// Curvatures that shadow rays did without, because they come so steeply that the material is opaque whatever it is.
    pub curvature_skips: u64,
    /// Samples that were not finite and were replaced by black. Anything but 0 is a defect worth reporting.
    pub discarded_samples: u64,
}

impl std::ops::AddAssign for Counters {
    fn add_assign(&mut self, o: Self) {
        self.samples += o.samples;
        self.rays += o.rays;
        self.bounce_rays += o.bounce_rays;
        self.indirect_vertices += o.indirect_vertices;
        self.shadow_rays += o.shadow_rays;
        self.area_light_samples += o.area_light_samples;
        self.directional_samples += o.directional_samples;
        self.environment_samples += o.environment_samples;
        self.texture_lookups += o.texture_lookups;
        self.pass_throughs += o.pass_throughs;
        self.shadow_pass_throughs += o.shadow_pass_throughs;
        self.opacity_queries += o.opacity_queries;
        self.offset_queries += o.offset_queries;
        self.reflectance_queries += o.reflectance_queries;
        self.below_horizon_lights += o.below_horizon_lights;
        self.lens_samples += o.lens_samples;
        self.curvature_evaluations += o.curvature_evaluations;
        self.filter_walks += o.filter_walks;
        self.curvature_skips += o.curvature_skips;
        self.discarded_samples += o.discarded_samples;
    }
}
