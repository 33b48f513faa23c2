//! [`AskedTwice`]: a model that takes twice as long to answer.

use std::hint::black_box;

use glam::{Vec2, Vec3};
use osculate_sbtf::infer::Material;
use osculate_sbtf::{Answer, Entry, Incidence, Query, SeeThrough, SilhouetteBtf};

/// Asks a model everything twice, first elsewhere on the material. What that adds to the time of a picture is what its questions cost in it.
#[derive(Debug)]
pub struct AskedTwice(pub Material);

/// To other texels.
const ELSEWHERE: Vec2 = Vec2::new(0.371, 0.619);

fn ray_elsewhere(ray: &Incidence) -> Incidence {
    Incidence { uv: ray.uv + ELSEWHERE, ..*ray }
}

fn entry_elsewhere(entry: &Entry) -> Entry {
    Entry { uv: entry.uv + ELSEWHERE, hit_uv: entry.hit_uv + ELSEWHERE, ..*entry }
}

impl SilhouetteBtf for AskedTwice {
    fn eval(&self, query: &Query) -> Answer {
        black_box(self.0.eval(&Query { uv: query.uv + ELSEWHERE, ..*query }));
        self.0.eval(query)
    }

    fn alpha(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> f32 {
        black_box(self.0.alpha(uv + ELSEWHERE, wo, kappa_hat));
        self.0.alpha(uv, wo, kappa_hat)
    }

    fn see_through(&self) -> SeeThrough {
        self.0.see_through()
    }

    fn uses_curvature(&self) -> bool {
        self.0.uses_curvature()
    }

    fn opaque_from(&self) -> f32 {
        self.0.opaque_from()
    }

    fn enter(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> Entry {
        black_box(self.0.enter(uv + ELSEWHERE, wo, kappa_hat));
        self.0.enter(uv, wo, kappa_hat)
    }

    fn rgb(&self, entry: &Entry, wi: Vec3) -> Vec3 {
        black_box(self.0.rgb(&entry_elsewhere(entry), wi));
        self.0.rgb(entry, wi)
    }

    fn alpha_batch(&self, rays: &[Incidence], alphas: &mut [f32]) {
        let elsewhere: Vec<_> = rays.iter().map(ray_elsewhere).collect();
        self.0.alpha_batch(&elsewhere, alphas);
        self.0.alpha_batch(rays, black_box(alphas));
    }

    fn enter_batch(&self, rays: &[Incidence], entries: &mut [Entry]) {
        let elsewhere: Vec<_> = rays.iter().map(ray_elsewhere).collect();
        self.0.enter_batch(&elsewhere, entries);
        self.0.enter_batch(rays, black_box(entries));
    }

    fn rgb_batch(&self, entries: &[Entry], wi: &[Vec3], rgb: &mut [Vec3]) {
        let elsewhere: Vec<_> = entries.iter().map(entry_elsewhere).collect();
        self.0.rgb_batch(&elsewhere, wi, rgb);
        self.0.rgb_batch(entries, wi, black_box(rgb));
    }
}
