//! [`plan`]: which effects a scene calls for, why, and what each is expected to cost.

use std::fmt;

use glam::Vec3;
use osculate_geom::field::FilterKind;
use serde::Serialize;

use crate::counters::Counters;
use crate::demand::{Demand, Reason, demands};
use crate::effects::Effects;
use crate::lights::{Environment, Light};
use crate::scene::{Material, MeshInstance, Scene, SurfaceSource};

/// Whether an effect is simulated, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// Which effect.
    pub effect: &'static str,
    /// Whether it is simulated.
    pub needed: bool,
    /// Why or why not.
    pub reason: String,
    /// Expected share of the time to trace one camera ray, 0 if not needed. A forecast for comparing effects, from counts of
    /// rays and lookups; not a promise.
    pub relative_cost: f32,
}

/// What the material of one object with silhouettes is told.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectDecision {
    /// Number of the object in the scene, from 0.
    pub object: usize,
    /// Name of its material; may be empty.
    pub material: String,
    /// Whether the material is told the curvature along the ray; otherwise it is 0.
    pub curvature: bool,
    /// Why or why not.
    pub curvature_reason: String,
    /// Whether the material is asked for its opacity; otherwise front faces are opaque.
    pub opacity: bool,
    /// Why or why not.
    pub opacity_reason: String,
}

/// What is simulated in a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectPlan {
    /// One decision per effect.
    pub decisions: Vec<Decision>,
    /// One entry per object whose material has silhouettes.
    pub objects: Vec<ObjectDecision>,
    effects: Effects,
}

impl EffectPlan {
    /// The switches for the integrator.
    #[must_use]
    pub fn effects(&self) -> Effects {
        self.effects
    }

    /// Decisions that differ in more than the object's number, with how many objects have each.
    fn alike_objects(&self) -> Vec<(&ObjectDecision, usize)> {
        let mut found: Vec<(&ObjectDecision, usize)> = Vec::new();
        for o in &self.objects {
            let same = |known: &ObjectDecision| ObjectDecision { object: o.object, ..known.clone() } == *o;
            match found.iter_mut().find(|(known, _)| same(known)) {
                Some((_, count)) => *count += 1,
                None => found.push((o, 1)),
            }
        }
        found
    }

    /// What was done although the plan says that it is not called for: a defect, and worth reporting. Empty if the plan was kept.
    #[must_use]
    pub fn contradictions(&self, counters: &Counters) -> Vec<String> {
        let spent = |effect: &str| match effect {
            "environment" => counters.environment_samples,
            "area lights" => counters.area_light_samples,
            "directional lights" => counters.directional_samples,
            "interreflection" => counters.indirect_vertices,
            "textures" => counters.texture_lookups,
            "shadow pass-through" => counters.shadow_pass_throughs,
            "silhouettes" => counters.reflectance_queries,
            "silhouette opacity" => counters.opacity_queries,
            "parallax offset" => counters.offset_queries,
            "below-horizon light" => counters.below_horizon_lights,
            "depth of field" => counters.lens_samples,
            "curvature" => counters.curvature_evaluations,
            "curvature filter" => counters.filter_walks,
            _ => 0,
        };
        let broken = self.decisions.iter().filter(|d| !d.needed && spent(d.effect) > 0);
        broken
            .map(|d| format!("{}: not planned ({}), done {} times", d.effect, d.reason, spent(d.effect)))
            .collect()
    }

    /// The decision on an effect by its name.
    #[must_use]
    pub fn decision(&self, effect: &str) -> Option<&Decision> {
        self.decisions.iter().find(|d| d.effect == effect)
    }
}

impl fmt::Display for EffectPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for d in &self.decisions {
            let (mark, cost) =
                if d.needed { ("yes", format!("{:>5.2}", d.relative_cost)) } else { ("no", "    -".into()) };
            writeln!(f, "{:<20} {mark:<3} {cost}  {}", d.effect, d.reason)?;
        }
        for (o, count) in self.alike_objects() {
            let word = |yes: bool| if yes { "yes" } else { "no" };
            let name = match count {
                1 => format!("object {}", o.object),
                _ => format!("{count} objects"),
            };
            let name = if o.material.is_empty() { name } else { format!("{name}: {}", o.material) };
            writeln!(f, "{name:<20} {:<3}        curvature: {}", word(o.curvature), o.curvature_reason)?;
            writeln!(f, "{:<20} {:<3}        opacity: {}", "", word(o.opacity), o.opacity_reason)?;
        }
        Ok(())
    }
}

/// Examines a scene for paths of at most `max_depth` surfaces.
///
/// Every "no" is exact: the effect could not change a bit of the picture. With one exception, on objects that are flat: the
/// normals of their triangles are within 1e-6 radians of each other, and what curvature rounding makes of that counts as zero, as does what
/// it makes of the rate of their UV along a chord. The picture is colour; curvature is evaluated only when pictures of curvature are asked for, see [`crate::aov::aovs`].
#[must_use]
pub fn plan(scene: &Scene, max_depth: u32) -> EffectPlan {
    let materials = materials(scene);
    let rectangles =
        count(scene, |l| matches!(l, Light::Rectangle(r) if r.radiance != Vec3::ZERO && r.area() > 0.0));
    let suns = count(
        scene,
        |l| matches!(l, Light::Directional { direction, irradiance } if *irradiance != Vec3::ZERO && direction.length() > 0.0),
    );
    let environment = environment(scene);
    let textured = materials.iter().filter(|m| m.textured).count();
    let silhouettes = materials.iter().filter(|m| m.silhouettes).count();
    let see_through = materials.iter().filter(|m| m.opacity < 1.0).count();
    let passable = materials.iter().filter(|m| m.silhouettes || m.opacity < 1.0).count();
    let interreflection = interreflection(&materials, max_depth);
    let depth_of_field = scene.camera.has_depth_of_field();
    let effects = Effects {
        environment: environment.is_ok(),
        area_lights: rectangles > 0,
        directional_lights: suns > 0,
        interreflection: interreflection.is_ok(),
        textures: textured > 0,
        transparency: see_through > 0,
        silhouettes: silhouettes > 0,
        depth_of_field,
    };
    let demands = demands(scene);
    let (curvature, filter) = curvature(scene, &demands);
    let objects = object_decisions(scene, &demands);
    let asked = objects.iter().filter(|o| o.opacity).count();
    let opacity = match (objects.len(), asked) {
        (0, _) => Err("no surfaces have silhouettes".to_owned()),
        (all, 0) => Err(format!("all {all} surfaces with silhouettes are known to be opaque")),
        (all, asked) => Ok(format!("{asked} of {all} surfaces with silhouettes may let rays pass")),
    };
    let deep = demands.iter().flatten().filter(|demand| demand.offset).count();
    let offset = match (objects.len(), deep) {
        (0, _) => Err("no surfaces have silhouettes".to_owned()),
        (all, 0) => Err(format!("the materials of all {all} surfaces with silhouettes have no depth")),
        (_, deep) => Ok(format!("the materials of {deep} surfaces have a depth")),
    };
    let decisions = vec![
        decided("environment", environment, 0.5),
        counted("area lights", rectangles, "rectangle lights", 0.5),
        counted("directional lights", suns, "directional lights", 0.3),
        decided("interreflection", interreflection, 0.8 * (max_depth.min(4) as f32 - 1.0)),
        counted("textures", textured, "surfaces have a texture", 0.05),
        counted("transparency", see_through, "surfaces let light through", 0.5),
        counted("shadow pass-through", passable, "surfaces may let a ray to a light pass", 0.2),
        counted("silhouettes", silhouettes, "surfaces have silhouettes", 1.0),
        decided("silhouette opacity", opacity, 0.2),
        decided("parallax offset", offset, 0.1),
        counted("below-horizon light", silhouettes, "surfaces may reflect it", 0.05),
        Decision {
            effect: "depth of field",
            needed: depth_of_field,
            reason: if depth_of_field { "the lens has an aperture" } else { "the camera is a pinhole" }
                .into(),
            relative_cost: if depth_of_field { 0.02 } else { 0.0 },
        },
        decided("curvature", curvature, 0.1),
        decided("curvature filter", filter, filter_cost(scene)),
    ];
    EffectPlan { decisions, objects, effects }
}

/// The reasons for curvature and for its filter, or against them.
fn curvature(scene: &Scene, demands: &[Option<Demand>]) -> (Reason, Reason) {
    let asking: Vec<&Demand> = demands.iter().flatten().collect();
    let curved = |o: &&MeshInstance| o.curvature.is_some() || o.field.is_some();
    let baked = scene.objects.iter().filter(curved).count();
    let takes = asking.iter().filter(|demand| demand.takes_curvature).count();
    let told = asking.iter().filter(|demand| demand.curvature.is_ok()).count();
    if takes == 0 {
        let reason =
            format!("{baked} objects carry curvature, no material asks for it; evaluated for AOVs only");
        let by = by_filters(filters(&scene.objects));
        let by = if by.is_empty() { String::new() } else { format!(": by {by}") };
        return (Err(reason.clone()), Err(format!("{reason}{by}")));
    }
    if told == 0 {
        let reason = "no object whose material asks for curvature carries any but zero".to_owned();
        return (Err(reason.clone()), Err(reason));
    }
    let reason = format!("asked for by the materials of {takes} objects, {told} of which are bent");
    let is_told = |demand: &Option<Demand>| demand.as_ref().is_some_and(|demand| demand.curvature.is_ok());
    let told = std::iter::zip(&scene.objects, demands).filter(|(_, demand)| is_told(demand));
    let looking = filters(told.map(|(object, _)| object)).filter(|kind| *kind != FilterKind::Point);
    let by = by_filters(looking);
    let filter = if by.is_empty() { Err("curvature is taken at the point".into()) } else { Ok(by) };
    (Ok(reason), filter)
}

/// As in [`Decision::relative_cost`], of the dearest filter.
fn filter_cost(scene: &Scene) -> f32 {
    let cost = |kind| match kind {
        FilterKind::Point => 0.0,
        FilterKind::Baked | FilterKind::BakedChord => 0.25,
        FilterKind::March => 0.5,
        FilterKind::Chord => 0.9,
    };
    filters(&scene.objects).map(cost).fold(0.0, f32::max)
}

/// What the objects' curvature is filtered by.
fn filters<'a>(objects: impl IntoIterator<Item = &'a MeshInstance>) -> impl Iterator<Item = FilterKind> {
    objects.into_iter().filter_map(|object| object.field.as_ref()).map(|field| field.filter())
}

/// Filters by name, with how many objects each is for.
fn by_filters(filters: impl Iterator<Item = FilterKind>) -> String {
    let filters: Vec<_> = filters.collect();
    let counts = FilterKind::ALL.map(|kind| (kind.name(), filters.iter().filter(|by| **by == kind).count()));
    let used = counts.iter().filter(|(_, count)| *count > 0);
    used.map(|(name, count)| format!("`{name}` for {count} objects")).collect::<Vec<_>>().join(", ")
}

fn object_decisions(scene: &Scene, demands: &[Option<Demand>]) -> Vec<ObjectDecision> {
    let decision = |(object, (instance, demand)): (usize, (&MeshInstance, &Option<Demand>))| {
        let Demand { curvature, opacity, .. } = demand.clone()?;
        let material = match &instance.surface {
            SurfaceSource::Material(material) => material.name.clone(),
            SurfaceSource::Mesh => String::new(),
        };
        let split = |reason: Reason| (reason.is_ok(), reason.unwrap_or_else(|reason| reason));
        let ((curvature, curvature_reason), (opacity, opacity_reason)) = (split(curvature), split(opacity));
        Some(ObjectDecision { object, material, curvature, curvature_reason, opacity, opacity_reason })
    };
    std::iter::zip(&scene.objects, demands).enumerate().filter_map(decision).collect()
}

struct Traits {
    opacity: f32,
    textured: bool,
    reflects: bool,
    silhouettes: bool,
}

impl Traits {
    fn of(m: &Material) -> Self {
        Self {
            opacity: m.opacity,
            textured: m.base_color_texture.is_some(),
            silhouettes: m.silhouette.is_some(),
            reflects: m.silhouette.is_some()
                || m.base_color != Vec3::ZERO
                || m.specular > 0.0
                || m.metallic > 0.0,
        }
    }
}

/// What matters of the materials in use. Textures of mesh files are not decoded for this.
fn materials(scene: &Scene) -> Vec<Traits> {
    let mut found = Vec::new();
    for object in &scene.objects {
        match &object.surface {
            SurfaceSource::Material(m) => found.push(Traits::of(m)),
            SurfaceSource::Mesh => found.extend(object.mesh.parts().iter().map(|part| {
                let textured =
                    part.material.is_some_and(|m| object.mesh.materials()[m].base_color_texture.is_some());
                Traits { opacity: 1.0, textured, reflects: true, silhouettes: false }
            })),
        }
    }
    found
}

fn count(scene: &Scene, matches: impl Fn(&Light) -> bool) -> usize {
    scene.lights.iter().filter(|l| matches(l)).count()
}

/// The reason for the environment, or against it.
fn environment(scene: &Scene) -> Result<String, String> {
    match &scene.environment {
        Environment::Black => Err("the environment is black".into()),
        Environment::Constant(c) if *c == Vec3::ZERO => Err("the environment is black".into()),
        Environment::Constant(_) => Ok("a constant environment".into()),
        Environment::Image { intensity, .. } if *intensity <= 0.0 => {
            Err("the environment's intensity is 0".into())
        }
        Environment::Image { image, .. } => {
            let (width, height) = image.size();
            Ok(format!("a picture of {width} x {height} pixels"))
        }
    }
}

fn interreflection(materials: &[Traits], max_depth: u32) -> Result<String, String> {
    let reflecting = materials.iter().filter(|m| m.reflects).count();
    if max_depth <= 1 {
        Err(format!("paths have at most {max_depth} surface"))
    } else if reflecting == 0 {
        Err("no surface reflects light".into())
    } else {
        Ok(format!("{reflecting} materials reflect, paths have up to {max_depth} surfaces"))
    }
}

fn decided(effect: &'static str, reason: Result<String, String>, cost: f32) -> Decision {
    let needed = reason.is_ok();
    let (Ok(reason) | Err(reason)) = reason;
    Decision { effect, needed, reason, relative_cost: if needed { cost } else { 0.0 } }
}

fn counted(effect: &'static str, count: usize, what: &str, cost: f32) -> Decision {
    let reason = if count == 0 { format!("no {what}") } else { format!("{count} {what}") };
    decided(effect, if count > 0 { Ok(reason) } else { Err(reason) }, cost)
}
