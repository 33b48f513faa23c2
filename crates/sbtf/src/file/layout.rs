//! Names and shapes of tensors.

use crate::model::{Architecture, OpacityHead, TextureShape, Way};
use crate::sampling::Sampler;

/// Key of the metadata in the safetensors header.
pub(super) const KEY: &str = "osculate";

/// Value of `format` in the metadata.
pub(super) const FORMAT: &str = "osculate-sbtf";

/// The oldest version of the format that can say what an architecture and a sampler are.
pub(super) fn version(form: &Architecture, sampler: Option<&Sampler>) -> u32 {
    if !sampler.is_none_or(Sampler::is_of_version_2) {
        3
    } else if (form.opacity_way, form.offset_way) == (Way::Graze, Way::Descend) {
        1
    } else {
        2
    }
}

/// What a module consists of by the architecture.
pub(super) struct ModuleLayout {
    /// Prefix of its tensors.
    pub name: &'static str,
    pub texture: TextureShape,
    /// Inputs, hidden layers, outputs.
    pub layers: Vec<usize>,
}

/// The modules in the order opacity (if any), offset, colour.
pub(super) fn modules(form: &Architecture) -> Vec<ModuleLayout> {
    let module = |name, texture, inputs, outputs| ModuleLayout {
        name,
        texture,
        layers: form.layer_sizes(inputs, outputs),
    };
    let mut modules = Vec::new();
    if form.opacity != OpacityHead::Opaque {
        modules.push(module("opacity", form.opacity_texture, form.opacity_inputs(), 1));
    }
    modules.push(module("offset", form.offset_texture, form.offset_inputs(), form.offset_outputs()));
    modules.push(module("colour", form.colour_texture, form.colour_inputs(), 3));
    modules
}

pub(super) fn texture(module: &str) -> String {
    format!("{module}.texture")
}

/// Only with codes: feature per step of the code.
pub(super) fn scale(module: &str) -> String {
    format!("{module}.texture.scale")
}

/// Only with codes: feature of code 0.
pub(super) fn offset(module: &str) -> String {
    format!("{module}.texture.offset")
}

pub(super) fn weights(module: &str, layer: usize) -> String {
    format!("{module}.layers.{layer}.weight")
}

pub(super) fn biases(module: &str, layer: usize) -> String {
    format!("{module}.layers.{layer}.bias")
}
