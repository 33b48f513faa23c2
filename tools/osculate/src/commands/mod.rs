//! One file per command.

pub mod bake;
pub mod demo;
pub mod eval;
pub mod eval_scenes;
pub mod inspect;
pub mod micro;
pub mod render;
pub mod study;
pub mod study_filter;
pub mod study_material;
pub mod study_render;
pub mod train;
pub mod verify;
