//! What `inspect` says about a model.

use osculate_sbtf::file::{ModelFile, Provenance};
use osculate_sbtf::infer::{Precision, Texels};
use osculate_sbtf::model::Architecture;
use osculate_sbtf::sampling::{Grid, Lobe};
use serde::Serialize;

use crate::console::{Console, count, number};

/// A model in numbers.
#[derive(Serialize)]
pub struct ModelReport {
    architecture: Architecture,
    modules: Vec<ModuleReport>,
    bytes: usize,
    products: usize,
    sampler: Option<SamplerReport>,
    provenance: Provenance,
}

#[derive(Serialize)]
struct ModuleReport {
    name: &'static str,
    precision: Precision,
    /// Height, width, channels.
    texture: [usize; 3],
    texture_bytes: usize,
    /// Smallest and largest feature.
    features: [f32; 2],
    /// Inputs, hidden layers, outputs.
    layers: Vec<usize>,
    /// Smallest and largest weight or bias.
    weights: [f32; 2],
}

#[derive(Serialize)]
struct SamplerReport {
    lobes: Vec<Lobe>,
    bands: usize,
    view_edges: Vec<f32>,
    curvature_edges: Vec<f32>,
    cells: [usize; 2],
}

impl ModelReport {
    /// Measures a model.
    pub fn new(file: ModelFile) -> Self {
        let modules: Vec<ModuleReport> = file
            .model
            .modules()
            .map(|(name, module)| {
                let shape = module.texture.shape;
                let layers = &module.mlp.layers;
                let inputs = layers.first().map(|layer| layer.inputs);
                let numbers =
                    layers.iter().flat_map(|layer| layer.weights.iter().chain(&layer.biases).copied());
                ModuleReport {
                    name,
                    precision: module.texture.precision(),
                    texture: [shape.height, shape.width, shape.channels],
                    texture_bytes: module.texture.bytes(),
                    features: match &module.texture.texels {
                        Texels::F32(texels) => range(texels.iter().copied()),
                        Texels::F16(texels) => range(texels.iter().map(|x| x.to_f32())),
                        Texels::U8 { .. } => range(module.texture.features().texels.into_iter()),
                    },
                    layers: inputs.into_iter().chain(layers.iter().map(|layer| layer.outputs)).collect(),
                    weights: range(numbers),
                }
            })
            .collect();
        let products =
            |module: &ModuleReport| module.layers.windows(2).map(|pair| pair[0] * pair[1]).sum::<usize>();
        Self {
            bytes: file.model.bytes(),
            products: modules.iter().map(products).sum(),
            modules,
            sampler: file.sampler.map(|sampler| {
                let (lobes, bands) = (sampler.lobes().collect::<Vec<_>>(), sampler.grid().bands());
                let Grid { view_edges, curvature_edges, cells } = sampler.grid().clone();
                SamplerReport { lobes, bands, view_edges, curvature_edges, cells }
            }),
            architecture: file.model.architecture,
            provenance: file.provenance,
        }
    }

    /// Prints it.
    pub fn print(&self, console: &Console) {
        let form = &self.architecture;
        let [low, high] = form.kappa_range.map(|x| number(f64::from(x)));
        console.result(format_args!(
            "  model      {} kB, {} multiplications a query",
            self.bytes.div_ceil(1000),
            self.products
        ));
        console.result(format_args!(
            "  depth      {} UV units, curvature {low} to {high}",
            number(f64::from(form.depth))
        ));
        console.result(format_args!(
            "  form       opacity {:?} with {}, offset {:?} with {}, curvature {:?}",
            form.opacity,
            count(form.opacity_taps.len(), "tap"),
            form.offset,
            count(form.offset_taps.len(), "tap"),
            form.curvature
        ));
        for module in &self.modules {
            let [height, width, channels] = module.texture;
            let layers: Vec<String> = module.layers.iter().map(ToString::to_string).collect();
            let [low, high] = module.features.map(|x| number(f64::from(x)));
            let [least, most] = module.weights.map(|x| number(f64::from(x)));
            console.result(format_args!(
                "  {:<9}  {width}x{height}x{channels} {}, {low} to {high}; network {}, {least} to {most}",
                module.name,
                module.precision.name(),
                layers.join("-")
            ));
        }
        if let Some(sampler) = &self.sampler {
            let [u, v] = sampler.cells;
            let lobes = count(sampler.lobes.len(), "lobe");
            console.result(format_args!(
                "  sampler    {lobes}, {}, {}, {u}x{v} cells",
                count(sampler.bands, "band"),
                count(sampler.curvature_edges.len() + 1, "curvature range")
            ));
        }
        print_provenance(&self.provenance, console);
    }
}

fn print_provenance(provenance: &Provenance, console: &Console) {
    let tool = if provenance.tool.is_empty() { "an unnamed program" } else { &provenance.tool };
    console.result(format_args!("  made       by {tool}, seed {}", provenance.seed));
    if let Some(source) = &provenance.microstructure {
        console.result(format_args!(
            "  material   {}, depth {} (SHA-256 {})",
            source.name, source.depth, source.sha256
        ));
    }
    for (name, value) in [("training", &provenance.training), ("scores", &provenance.scores)] {
        if !value.is_null() {
            console.result(format_args!("  {name:<9}  {value}"));
        }
    }
}

fn range(values: impl Iterator<Item = f32>) -> [f32; 2] {
    values.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}
