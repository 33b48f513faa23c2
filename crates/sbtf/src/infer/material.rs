//! [`Material`]: a model compiled for this processor.

use glam::{Vec2, Vec3};

use super::block::{Batch, Networks};
use super::kernels::{GROUP, Instructions, Simd};
use super::lane_math;
use super::one::{Alpha, Begin, ColourAt, ColourInputs, Colours, Offset, View, Whole};
use super::packed_mlp::PackedMlp;
use super::packed_texture::PackedTexture;
use super::rows::{AnswerRows, QueryRows, Sizes, Slices};
use super::stages::{AlphaBatch, EnterBatch, RgbBatch};
use super::stored::{StoredModel, StoredModule};
use crate::model::{Architecture, OpacityHead, Way, bounded};
use crate::query::{Answer, Entry, Incidence, Query, SeeThrough, SilhouetteBtf};
use crate::silhouette::{cosine_of_dip, largest_cosine};

/// Most inputs that a network may have.
pub const MOST_INPUTS: usize = 256;
/// Most neurons of a hidden layer.
pub const MOST_WIDTH: usize = 128;
/// Most features of a texel.
pub const MOST_CHANNELS: usize = 32;
/// Buffers of usual networks; zeroing the large ones costs more than a few queries.
const FEW_INPUTS: usize = 96;
const FEW_WIDTH: usize = 32;
/// Bytes of textures from which on a core's own caches do not hold them.
const LARGE: usize = 1 << 21;
/// Inputs of a colour network.
const COLOUR_INPUTS: usize = MOST_CHANNELS + GROUP;

/// Runs a task whose buffers have the sizes of this material's networks, which it sees as two constants.
macro_rules! sized {
    ($material:expr, |$inputs:ident, $width:ident| $task:expr) => {
        match $material.sizes {
            Sizes::Few => {
                #[allow(dead_code, reason = "colour networks have inputs of their own")]
                const $inputs: usize = FEW_INPUTS + GROUP;
                const $width: usize = FEW_WIDTH;
                $material.simd.run($task)
            }
            Sizes::Many => {
                #[allow(dead_code, reason = "colour networks have inputs of their own")]
                const $inputs: usize = MOST_INPUTS + GROUP;
                const $width: usize = MOST_WIDTH;
                $material.simd.run($task)
            }
        }
    };
}

/// A model compiled for this processor. Queries allocate nothing.
///
/// Curvatures outside the trained range are clamped to it, never extrapolated: [`covers`](Self::covers), [`BatchReport::clamped`] and
/// [`Hit::clamped`] tell. UV that are not finite count as 0, a curvature that is NaN as the low end of the range, and a `wo.z` that is NaN looks at the
/// back. All answers are finite.
#[derive(Debug)]
pub struct Material {
    pub(super) architecture: Architecture,
    pub(super) opacity: Option<PackedModule>,
    pub(super) offset: PackedModule,
    pub(super) colour: PackedModule,
    simd: Simd,
    sizes: Sizes,
    /// Whether its textures leave the caches of a core, so that it pays to look ahead.
    pub(super) is_large: bool,
}

/// A texture and a network, both packed.
#[derive(Debug)]
pub(super) struct PackedModule {
    pub texture: PackedTexture,
    pub mlp: PackedMlp,
}

impl PackedModule {
    fn new(module: &StoredModule) -> Self {
        Self { texture: PackedTexture::new(&module.texture), mlp: PackedMlp::new(&module.mlp) }
    }
}

/// What a batch took.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct BatchReport {
    /// Queries answered.
    pub queries: u64,
    /// Queries whose curvature is outside the trained range, or NaN.
    pub clamped: u64,
    /// Blocks of 32 that went through the opacity network.
    pub opacity_blocks: u64,
    /// Blocks of 32 that went through the offset and the colour network.
    pub shade_blocks: u64,
}

impl Material {
    /// Compiles a model for the best instructions there are.
    ///
    /// # Panics
    ///
    /// If the model breaks its own architecture, or one of [`MOST_INPUTS`], [`MOST_WIDTH`] and [`MOST_CHANNELS`]. Models from files were checked.
    #[must_use]
    pub fn new(model: &StoredModel) -> Self {
        Self::with_simd(model, Simd::detect())
    }

    /// Compiles a model for these instructions; `None` where the processor lacks them.
    #[must_use]
    pub fn with_instructions(model: &StoredModel, instructions: Instructions) -> Option<Self> {
        Some(Self::with_simd(model, Simd::new(instructions)?))
    }

    fn with_simd(model: &StoredModel, simd: Simd) -> Self {
        let architecture = model.architecture.clone();
        let opacity = model.opacity.as_ref().map(PackedModule::new);
        assert_eq!(opacity.is_some(), architecture.opacity != OpacityHead::Opaque, "an opacity module");
        let (offset, colour) = (PackedModule::new(&model.offset), PackedModule::new(&model.colour));
        let modules = || opacity.iter().chain([&offset, &colour]);
        let most = |size: fn(&PackedModule) -> usize| modules().map(size).max().unwrap_or(0);
        // Fetches write whole groups, up to one beyond the features.
        let inputs = most(|module| module.mlp.layers[0].inputs) + GROUP;
        let width = most(|module| module.mlp.widest());
        let channels = most(|module| module.texture.channels);
        assert!(inputs <= MOST_INPUTS + GROUP && width <= MOST_WIDTH && channels <= MOST_CHANNELS, "size");
        let expected = [
            (opacity.as_ref(), architecture.opacity_inputs(), 1),
            (Some(&offset), architecture.offset_inputs(), architecture.offset_outputs()),
            (Some(&colour), architecture.colour_inputs(), 3),
        ];
        for (module, inputs, outputs) in expected {
            let layers = module.map_or(&[][..], |module| &module.mlp.layers);
            let ends = layers.first().zip(layers.last());
            assert!(ends.is_none_or(|(a, b)| (a.inputs, b.outputs) == (inputs, outputs)), "layer sizes");
        }
        let few = inputs <= FEW_INPUTS + GROUP && width <= FEW_WIDTH;
        let sizes = if few { Sizes::Few } else { Sizes::Many };
        let is_large = modules().map(|module| module.texture.bytes()).sum::<usize>() > LARGE;
        Self { architecture, opacity, offset, colour, simd, sizes, is_large }
    }

    /// Its form.
    #[must_use]
    pub fn architecture(&self) -> &Architecture {
        &self.architecture
    }

    /// What it was compiled for.
    #[must_use]
    pub fn instructions(&self) -> Instructions {
        self.simd.instructions()
    }

    /// Multiplications in the networks of one query that hits.
    #[must_use]
    pub fn products(&self) -> usize {
        let opacity = self.opacity.as_ref().map_or(0, |module| module.mlp.products());
        opacity + self.offset.mlp.products() + self.colour.mlp.products()
    }

    /// Runs all networks on blocks of 32 queries without any queries, for benchmarks of the networks alone; returns a number that
    /// depends on all of it.
    #[doc(hidden)]
    #[must_use]
    pub fn run_networks(&self, blocks: usize) -> f32 {
        let material = self;
        sized!(self, |INPUTS, WIDTH| Networks::<INPUTS, WIDTH> { material, blocks })
    }

    /// Bytes of its textures in memory.
    #[must_use]
    pub fn texture_bytes(&self) -> usize {
        let modules = self.opacity.iter().chain([&self.offset, &self.colour]);
        modules.map(|module| module.texture.bytes()).sum()
    }

    /// Whether a curvature is inside the trained range.
    #[inline]
    #[must_use]
    pub fn covers(&self, kappa_hat: f32) -> bool {
        let [low, high] = self.architecture.kappa_range;
        (low..=high).contains(&kappa_hat)
    }

    /// The hit of one ray, to be asked for the colour under any number of lights; `None` where the ray misses.
    #[must_use]
    pub fn begin(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> Option<Hit<'_>> {
        let material = self;
        let begun = sized!(self, |INPUTS, WIDTH| Begin::<INPUTS, WIDTH, COLOUR_INPUTS> {
            material,
            uv,
            wo,
            kappa_hat
        });
        let (alpha, uv, inputs) = begun?;
        Some(Hit { material, alpha, uv, clamped: !self.covers(kappa_hat), inputs })
    }

    /// Where a ray hits, and what the colour network sees there.
    fn offset(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> (Vec2, ColourInputs<COLOUR_INPUTS>) {
        let (material, view) = (self, View::new(self, uv, wo, kappa_hat));
        sized!(self, |INPUTS, WIDTH| Offset::<INPUTS, WIDTH, COLOUR_INPUTS> { material, view })
    }

    /// The answers to queries in arrays.
    ///
    /// # Panics
    ///
    /// If the arrays differ in length.
    pub fn eval_rows(&self, queries: &QueryRows<'_>, answers: &mut AnswerRows<'_>) -> BatchReport {
        queries.check();
        answers.check(queries.kappa_hat.len());
        self.batch(queries, answers)
    }

    /// The answers to many queries, and what they took.
    ///
    /// # Panics
    ///
    /// If there are not as many answers as queries.
    pub fn eval_reported(&self, queries: &[Query], answers: &mut [Answer]) -> BatchReport {
        assert_eq!(queries.len(), answers.len(), "an answer for every query");
        self.batch(&Slices(queries), &mut Slices(answers))
    }

    fn batch<S: super::block::Source, A: super::block::Sink>(&self, source: &S, sink: &mut A) -> BatchReport {
        let material = self;
        sized!(self, |INPUTS, WIDTH| Batch::<_, _, INPUTS, WIDTH> { material, source, sink })
    }

    /// The opacity, where it takes no network to know it.
    #[inline(always)]
    pub(super) fn known_alpha(&self, cos_o: f32, kappa_hat: f32) -> Option<f32> {
        // NaN too.
        if cos_o.is_nan() || cos_o <= 0.0 {
            return Some(0.0);
        }
        let kappa = self.architecture.clamp_curvature(kappa_hat);
        let opaque = match self.architecture.opacity {
            // No dip is deeper than the material.
            OpacityHead::Silhouette => cos_o >= largest_cosine(kappa, self.architecture.depth),
            OpacityHead::Direct => false,
            OpacityHead::Opaque => true,
        };
        opaque.then_some(1.0)
    }

    /// The opacity from the network's output.
    #[inline(always)]
    pub(super) fn alpha_of_output(&self, output: f32, cos_o: f32, kappa: f32) -> f32 {
        let output = bounded(output, 0.0, 1.0);
        match self.architecture.opacity {
            OpacityHead::Silhouette => {
                let cosine = cosine_of_dip(output, kappa, self.architecture.depth);
                if cos_o >= cosine { 1.0 } else { 0.0 }
            }
            OpacityHead::Direct | OpacityHead::Opaque => output,
        }
    }

    /// [`Architecture::way_length`].
    #[inline(always)]
    pub(super) fn way_length(&self, way: Way, wo: [f32; 3], kappa: f32) -> f32 {
        let depth = self.architecture.depth;
        match way {
            Way::Graze => lane_math::graze(kappa, depth),
            Way::Descend => lane_math::descend(wo, kappa, depth),
            Way::Through => lane_math::through(wo, kappa, depth),
        }
    }
}

impl SilhouetteBtf for Material {
    fn eval(&self, query: &Query) -> Answer {
        let material = self;
        sized!(self, |INPUTS, WIDTH| Whole::<INPUTS, WIDTH, COLOUR_INPUTS> { material, query })
    }

    fn see_through(&self) -> SeeThrough {
        self.architecture.opacity.see_through()
    }

    fn uses_curvature(&self) -> bool {
        self.architecture.uses_curvature()
    }

    fn opaque_from(&self) -> f32 {
        self.architecture.opaque_from()
    }

    fn alpha(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> f32 {
        if let Some(alpha) = self.known_alpha(wo.z, kappa_hat) {
            return alpha;
        }
        let (material, view) = (self, View::new(self, uv, wo, kappa_hat));
        sized!(self, |INPUTS, WIDTH| Alpha::<INPUTS, WIDTH> { material, view })
    }

    fn enter(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> Entry {
        Entry { uv, wo, kappa_hat, hit_uv: self.offset(uv, wo, kappa_hat).0 }
    }

    fn rgb(&self, entry: &Entry, wi: Vec3) -> Vec3 {
        let view = View::new(self, entry.uv, entry.wo, entry.kappa_hat);
        let (material, uv) = (self, entry.hit_uv);
        sized!(self, |INPUTS, WIDTH| ColourAt::<COLOUR_INPUTS, WIDTH> { material, view, uv, wi })
    }

    fn alpha_batch(&self, rays: &[Incidence], alphas: &mut [f32]) {
        assert_eq!(rays.len(), alphas.len(), "an opacity for every ray");
        let material = self;
        sized!(self, |INPUTS, WIDTH| AlphaBatch::<INPUTS, WIDTH> { material, rays, alphas });
    }

    fn enter_batch(&self, rays: &[Incidence], entries: &mut [Entry]) {
        assert_eq!(rays.len(), entries.len(), "an entry for every ray");
        let material = self;
        sized!(self, |INPUTS, WIDTH| EnterBatch::<INPUTS, WIDTH> { material, rays, entries });
    }

    fn rgb_batch(&self, entries: &[Entry], wi: &[Vec3], rgb: &mut [Vec3]) {
        assert!(entries.len() == wi.len() && wi.len() == rgb.len(), "a light and a colour for every entry");
        let material = self;
        sized!(self, |INPUTS, WIDTH| RgbBatch::<INPUTS, WIDTH> { material, entries, wi, rgb });
    }

    fn eval_batch(&self, queries: &[Query], answers: &mut [Answer]) {
        self.eval_reported(queries, answers);
    }
}

/// Where a ray hits a material: what does not depend on the light is done.
#[derive(Debug, Clone)]
pub struct Hit<'a> {
    material: &'a Material,
    alpha: f32,
    uv: Vec2,
    clamped: bool,
    inputs: ColourInputs<COLOUR_INPUTS>,
}

impl Hit<'_> {
    /// Opacity, in `(0, 1]`.
    #[must_use]
    pub fn alpha(&self) -> f32 {
        self.alpha
    }

    /// Texture coordinates of the hit, from those of the entry point inside its tile.
    #[must_use]
    pub fn uv(&self) -> Vec2 {
        self.uv
    }

    /// Whether the curvature is outside the trained range, and its nearest end was taken.
    #[must_use]
    pub fn clamped(&self) -> bool {
        self.clamped
    }

    /// [`Answer::rgb`] under light from `wi`.
    #[must_use]
    pub fn rgb(&self, wi: Vec3) -> Vec3 {
        let mut rgb = [Vec3::ZERO];
        self.rgb_of(&[wi], &mut rgb);
        rgb[0]
    }

    /// The same for several lights.
    ///
    /// # Panics
    ///
    /// If there are not as many colours as lights.
    pub fn rgb_of(&self, wi: &[Vec3], rgb: &mut [Vec3]) {
        assert_eq!(wi.len(), rgb.len(), "a colour for every light");
        let (material, inputs) = (self.material, &self.inputs);
        sized!(material, |INPUTS, WIDTH| Colours::<COLOUR_INPUTS, WIDTH> { material, inputs, wi, rgb });
    }
}
