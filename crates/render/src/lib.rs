//! A CPU path tracer for curvature-baked meshes, driven by an effect plan.
//!
//! # Conventions
//!
//! Right-handed, +Y up; lengths are world units, angles radians, colours linear RGB with Rec. 709 primaries, curvature
//! 1/length and positive where the surface is convex. Everything is `f32`. `wo` points to the viewer, `wi` to the light.
//!
//! # Module map
//!
//! | module | what it holds |
//! |---|---|
//! | [`scene`] | [`Scene`], [`MeshInstance`], [`Material`], scene files, the preview's studio |
//! | [`aov`] | depth, normal, UV and curvature at pixel centres |
//! | [`false_colour`] | pictures of curvature, or of any number per vertex, with a colour bar |
//! | [`metrics`] | PSNR, SSIM and FLIP between pictures |
//! | [`output`] | PNG and EXR |
//!
//! [`plan`] says which effects a scene calls for; [`render`] traces it with exactly these compiled in.
//!
//! # Example
//!
//! ```
//! use std::ops::ControlFlow;
//! use std::sync::Arc;
//! use osculate_geom::{Mesh, Vec3};
//! use osculate_render::scene::PreviewOptions;
//! use osculate_render::{MeshInstance, RenderOptions, Scene, StopRule, picture, render};
//!
//! let triangle = Mesh::new(vec![Vec3::zeros(), Vec3::x(), Vec3::y()], vec![[0, 1, 2]])?;
//! let preview = PreviewOptions { size: [32, 24], ..PreviewOptions::default() };
//! let scene = Scene::preview(vec![MeshInstance::new(Arc::new(triangle))], &preview);
//! let options = RenderOptions { stop: StopRule::Samples(4), ..RenderOptions::default() };
//! let rendering = render(&scene, &options, &mut |_| ControlFlow::Continue(()))?;
//! let image = picture(32, 24, &rendering.film.radiance(), scene.exposure);
//! assert_eq!(image.rgb.len(), 3 * 32 * 24);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Out of scope
//!
//! Participating media, refraction, spectral rendering, motion blur, GPU.

pub mod aov;
mod bend;
mod camera;
mod canvas;
mod counters;
mod curvature;
mod demand;
mod distribution;
mod effects;
pub mod false_colour;
mod film;
mod geometry;
mod integrator;
mod lighting;
mod lights;
mod masks;
mod math;
pub mod metrics;
pub mod output;
mod plan;
mod prepared;
mod present;
mod render;
mod sampler;
pub mod scene;
mod schedule;
mod shading;
pub mod sheet;
mod silhouette;
mod texture;
mod told;
mod tone;
mod vertex;
mod wavefront;

pub use camera::Camera;
pub use counters::Counters;
pub use effects::Effects;
pub use film::Film;
pub use lighting::Strategy;
pub use lights::{Environment, EnvironmentImage, Light, RectangleLight};
pub use masks::{Mask, coverage};
pub use plan::{Decision, EffectPlan, ObjectDecision, plan};
pub use prepared::{FARTHEST, SMALLEST, SceneError};
pub use present::EFFECTS;
pub use render::{Frame, Progress, Queries, RenderOptions, Rendering, StopRule, render, render_frames};
pub use sampler::SamplerKind;
pub use scene::{Material, MeshInstance, Scene};
pub use texture::{Texture, TextureError};
pub use tone::{Picture, picture};
