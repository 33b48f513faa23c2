//! The procedural materials: one recipe per file.
//!
//! Eleven recipes are a function from a point to a [`Texel`], which [`height_field`] evaluates over a tile; two build a
//! [`TileMesh`](super::TileMesh). The names are those of Kuznetsov et al. (2022), table 1 and figure 10; the recipes are this project's own, in
//! their character.

mod basket_weave;
mod cave;
mod foam;
mod leather;
mod oyster;
mod perforated_leather;
mod shell;
mod stone_1;
mod stone_2;
mod swept;
mod terracotta;
mod wall;
mod wool_1;
mod wool_2;
mod yarn;

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::{Geometry, Grid, HeightField, Maps, Microstructure};

/// Texels along each side of a built-in height field, unless another number is asked for.
pub const DEFAULT_RESOLUTION: usize = 512;

/// What a recipe says of one point.
#[derive(Debug, Clone, Copy)]
struct Texel {
    /// Any scale: the tile's lowest height becomes 0, its highest 1.
    height: f32,
    /// Linear RGB.
    albedo: Vec3,
    roughness: f32,
    metalness: f32,
}

/// A procedural material.
#[derive(Debug, Clone, Copy)]
pub struct Builtin {
    /// Its name, in small letters with hyphens.
    pub name: &'static str,
    /// One line on what it looks like.
    pub about: &'static str,
    recipe: Recipe,
}

#[derive(Debug, Clone, Copy)]
enum Recipe {
    Field { depth: f32, texel: fn(Vec2) -> Texel },
    Mesh(fn() -> super::TileMesh),
}

/// All procedural materials.
pub const BUILTINS: [Builtin; 13] = [
    field("cave", "karst rock eaten away into deep irregular holes and ledges", cave::texel),
    field("foam", "closed round bubbles of many sizes", foam::texel),
    field("leather", "wrinkled pebble grain", leather::texel),
    field("oyster", "wavy plates that overlap in layers", oyster::texel),
    field("shell", "regular ribs crossed by scalloped growth rings", shell::texel),
    field("stone-1", "rounded cobbles in sand", stone_1::texel),
    field("stone-2", "angular flagstones, split rough", stone_2::texel),
    field("terracotta", "barrel roof tiles of fired clay", terracotta::texel),
    field("wall", "worn bricks in mortar", wall::texel),
    field("wool-1", "knitted stockinette, two-ply yarn", wool_1::texel),
    field("wool-2", "thick twisted yarn, woven", wool_2::texel),
    mesh("basket-weave", "red and grey wicker, over and under, with gaps between", basket_weave::build),
    mesh("perforated-leather", "a sheet of leather with round holes", perforated_leather::build),
];

const fn field(name: &'static str, about: &'static str, texel: fn(Vec2) -> Texel) -> Builtin {
    Builtin { name, about, recipe: Recipe::Field { depth: 0.1, texel } }
}

const fn mesh(name: &'static str, about: &'static str, build: fn() -> super::TileMesh) -> Builtin {
    Builtin { name, about, recipe: Recipe::Mesh(build) }
}

impl Builtin {
    /// The procedural material of a name; case, blanks, hyphens and underscores do not matter.
    #[must_use]
    pub fn find(name: &str) -> Option<&'static Self> {
        let bare = |s: &str| s.chars().filter(|c| !" -_".contains(*c)).collect::<String>().to_lowercase();
        BUILTINS.iter().find(|builtin| bare(builtin.name) == bare(name))
    }

    /// Makes it. `resolution`: texels along each side of a height field; tile meshes have their own fineness.
    ///
    /// # Panics
    ///
    /// If the resolution is 0.
    #[must_use]
    pub fn build(&self, resolution: usize) -> Microstructure {
        let geometry = match self.recipe {
            Recipe::Field { depth, texel } => Geometry::HeightField(height_field(resolution, depth, texel)),
            Recipe::Mesh(build) => Geometry::TileMesh(build()),
        };
        Microstructure { name: self.name.to_owned(), geometry }
    }
}

/// Evaluates a recipe at two points of every texel and takes their mean, so that edges do not alias; then stretches the heights to
/// `[0, 1]`.
fn height_field(resolution: usize, depth: f32, texel: fn(Vec2) -> Texel) -> HeightField {
    let texels: Vec<Texel> =
        (0..resolution * resolution).into_par_iter().map(|i| texel_mean(i, resolution, texel)).collect();
    let lowest = texels.iter().map(|t| t.height).fold(f32::MAX, f32::min);
    let highest = texels.iter().map(|t| t.height).fold(f32::MIN, f32::max);
    // A single texel is flat: it lies on the bounding surface.
    let range = if highest > lowest { highest - lowest } else { 1.0 };
    let stretch = |h: f32| if highest > lowest { ((h - lowest) / range).clamp(0.0, 1.0) } else { 1.0 };
    let heights = texels.iter().map(|t| stretch(t.height)).collect();
    let scalar = |of: fn(&Texel) -> f32| {
        let values = texels.iter().map(|t| of(t).clamp(0.0, 1.0)).collect();
        Grid::new(resolution, resolution, values)
    };
    let albedo = texels.iter().map(|t| t.albedo.clamp(Vec3::ZERO, Vec3::ONE)).collect();
    let maps = Maps {
        albedo: Grid::new(resolution, resolution, albedo),
        roughness: scalar(|t| t.roughness),
        metalness: scalar(|t| t.metalness),
        normal: None,
    };
    HeightField::new(Grid::new(resolution, resolution, heights), depth, maps)
}

fn texel_mean(index: usize, resolution: usize, texel: fn(Vec2) -> Texel) -> Texel {
    let corner = Vec2::new((index % resolution) as f32, (index / resolution) as f32);
    let mut mean = Texel { height: 0.0, albedo: Vec3::ZERO, roughness: 0.0, metalness: 0.0 };
    for shift in [(0.25, 0.25), (0.75, 0.75)] {
        let Texel { height, albedo, roughness, metalness } =
            texel((corner + Vec2::from(shift)) / resolution as f32);
        mean.height += 0.5 * height;
        mean.albedo += 0.5 * albedo;
        mean.roughness += 0.5 * roughness;
        mean.metalness += 0.5 * metalness;
    }
    mean
}

#[cfg(test)]
mod tests;
