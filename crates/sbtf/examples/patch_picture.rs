//! A cylinder of a material under a light, traced in its bent patch: a picture to look at.
//!
//! ```text
//! cargo run --release -p osculate-sbtf --example patch_picture -- OUT.png [MATERIAL] [DEPTH] [KAPPA] [SAMPLES]
//! ```
//!
//! The viewer is far away and looks across the cylinder's axis, which lies along the picture's rows. What misses is blue.

mod support;

use std::sync::Arc;

use glam::{Vec2, Vec3};
use osculate_sbtf::patch::{Patch, TileOptions, TileSurface, Transport, TransportOptions};
use osculate_sbtf::random::Random;
use rayon::prelude::*;

const SIZE: u32 = 512;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |i: usize, default: f32| arguments.get(i).map_or(Ok(default), |text| text.parse());
    let path =
        arguments.first().ok_or("usage: patch_picture OUT.png [MATERIAL] [DEPTH] [KAPPA] [SAMPLES]")?;
    let name = arguments.get(1).map_or("stones", String::as_str);
    let (depth, kappa) = (number(2, 0.1)?, number(3, 1.0)?);
    let samples: u32 = arguments.get(4).map_or(Ok(16), |text| text.parse())?;
    let micro = support::material(name, depth).ok_or("no such material")?;
    let rotation = 0.5;
    let tile = TileSurface::new(&micro, &TileOptions { largest_curvature: kappa, ..TileOptions::default() });
    let patch = Patch::new(Arc::new(tile), kappa, rotation);
    let transport = Transport::new(TransportOptions::default());
    let light = Vec3::new(-0.35, 0.3, 0.6).normalize();
    let pixels: Vec<u8> = (0..SIZE * SIZE)
        .into_par_iter()
        .flat_map_iter(|pixel| {
            let mut random = Random::new(1, 1, u64::from(pixel));
            let (mut sum, mut shown) = (Vec3::ZERO, 0.0);
            for _ in 0..samples {
                let x = ((pixel % SIZE) as f32 + random.unit()) / SIZE as f32 * 2.2 - 1.1;
                let y = (1.1 - ((pixel / SIZE) as f32 + random.unit()) / SIZE as f32 * 2.2)
                    / kappa.abs().max(0.4);
                let Some(view) = View::new(kappa, rotation, y, x / kappa.abs().max(0.4)) else { continue };
                let wi = view.in_entry_frame(light);
                if let Some(sample) =
                    patch.sample(&transport, view.uv, view.in_entry_frame(Vec3::Z), wi, &mut random)
                {
                    sum += sample.rgb;
                    shown += 1.0;
                }
            }
            let background = Vec3::new(0.25, 0.4, 0.8) * (samples as f32 - shown);
            tone((3.0 * sum + background) / samples as f32)
        })
        .collect();
    image::save_buffer(path, &pixels, SIZE, SIZE, image::ColorType::Rgb8)?;
    Ok(())
}

/// Where a ray of the picture enters the bounding surface.
struct View {
    uv: Vec2,
    rotation: f32,
    angle: f32,
}

impl View {
    /// `x` is the distance from the picture's middle across the axis, `r` the one along it.
    fn new(kappa: f32, rotation: f32, x: f32, r: f32) -> Option<Self> {
        let sine = kappa * x;
        if sine.abs() >= 1.0 {
            return None;
        }
        let angle = sine.asin();
        let s = if kappa == 0.0 { x } else { angle / kappa };
        Some(Self { uv: Vec2::from_angle(rotation).rotate(Vec2::new(s, r)), rotation, angle })
    }

    /// A direction with x across the axis, y along it and z to the viewer.
    fn in_entry_frame(&self, v: Vec3) -> Vec3 {
        let (sin, cos) = self.angle.sin_cos();
        let local = Vec3::new(v.x * cos - v.z * sin, v.y, v.x * sin + v.z * cos);
        Vec2::from_angle(self.rotation).rotate(local.truncate()).extend(local.z)
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bytes of a picture")]
fn tone(colour: Vec3) -> [u8; 3] {
    colour.to_array().map(|x| (255.0 * x.clamp(0.0, 1.0).powf(1.0 / 2.2) + 0.5) as u8)
}
