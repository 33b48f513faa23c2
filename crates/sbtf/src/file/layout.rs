//! Names and shapes of tensors.

use crate::model::{Architecture, OpacityHead, TextureShape, Way};

/// Key of the metadata in the safetensors header.
pub(super) const KEY: &str = "osculate";

/// Value of `format` in the metadata.
pub(super) const FORMAT: &str = "osculate-sbtf";

/// The oldest version of the format that can say what an architecture is.
pub(super) fn version(form: &Architecture) -> u32 {
    if (form.opacity_way, form.offset_way) == (Way::Graze, Way::Descend) { 1 } else { 2 }
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
