//! [`AskedOften`]: a model that takes several times as long to answer.

use std::hint::black_box;

use glam::{Vec2, Vec3};
use osculate_sbtf::infer::Material;
use osculate_sbtf::{Answer, Entry, Incidence, Query, SeeThrough, SilhouetteBtf};

/// Asks a model everything some times more, each time elsewhere on the material. What that adds to the time of a picture, over the number of times, is
/// what its questions cost in it.
#[derive(Debug)]
pub struct AskedOften {
    pub material: Material,
    /// How many times more.
    pub more: u8,
}

impl AskedOften {
    /// To other texels.
    fn elsewhere(&self) -> impl Iterator<Item = Vec2> {
        (1..=self.more).map(|k| f32::from(k) * Vec2::new(0.371, 0.619))
    }
}

fn moved_ray(ray: &Incidence, by: Vec2) -> Incidence {
    Incidence { uv: ray.uv + by, ..*ray }
}

fn moved_entry(entry: &Entry, by: Vec2) -> Entry {
    Entry { uv: entry.uv + by, hit_uv: entry.hit_uv + by, ..*entry }
}

impl SilhouetteBtf for AskedOften {
    fn eval(&self, query: &Query) -> Answer {
        for by in self.elsewhere() {
            black_box(self.material.eval(&Query { uv: query.uv + by, ..*query }));
        }
        self.material.eval(query)
    }

    fn alpha(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> f32 {
        for by in self.elsewhere() {
            black_box(self.material.alpha(uv + by, wo, kappa_hat));
        }
        self.material.alpha(uv, wo, kappa_hat)
    }

    fn see_through(&self) -> SeeThrough {
        self.material.see_through()
    }

    fn uses_curvature(&self) -> bool {
        self.material.uses_curvature()
    }

    fn opaque_from(&self) -> f32 {
        self.material.opaque_from()
    }

    fn enter(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> Entry {
        for by in self.elsewhere() {
            black_box(self.material.enter(uv + by, wo, kappa_hat));
        }
        self.material.enter(uv, wo, kappa_hat)
    }

    fn rgb(&self, entry: &Entry, wi: Vec3) -> Vec3 {
        for by in self.elsewhere() {
            black_box(self.material.rgb(&moved_entry(entry, by), wi));
        }
        self.material.rgb(entry, wi)
    }

    fn alpha_batch(&self, rays: &[Incidence], alphas: &mut [f32]) {
        for by in self.elsewhere() {
            let moved: Vec<_> = rays.iter().map(|ray| moved_ray(ray, by)).collect();
            self.material.alpha_batch(&moved, black_box(alphas));
        }
        self.material.alpha_batch(rays, black_box(alphas));
    }

    fn enter_batch(&self, rays: &[Incidence], entries: &mut [Entry]) {
        for by in self.elsewhere() {
            let moved: Vec<_> = rays.iter().map(|ray| moved_ray(ray, by)).collect();
            self.material.enter_batch(&moved, black_box(entries));
        }
        self.material.enter_batch(rays, black_box(entries));
    }

    fn rgb_batch(&self, entries: &[Entry], wi: &[Vec3], rgb: &mut [Vec3]) {
        for by in self.elsewhere() {
            let moved: Vec<_> = entries.iter().map(|entry| moved_entry(entry, by)).collect();
            self.material.rgb_batch(&moved, wi, black_box(rgb));
        }
        self.material.rgb_batch(entries, wi, black_box(rgb));
    }
}
