//! Parts of queries in batches: opacity, entry, colour. For renderers, whose queries have something between their parts: a ray that
//! goes on or ends, a light that is drawn.

use glam::{Vec2, Vec3};

use super::ahead::Ahead;
use super::kernels::{BLOCK, Isa, Row, Task};
use super::material::Material;
use super::prepared::Prepared;
use super::work::Work;
use crate::query::{Entry, Incidence, Query};

/// Opacities of rays. Those that are known without a network go through none, the others in full blocks.
pub(super) struct AlphaBatch<'a, const INPUTS: usize, const WIDTH: usize> {
    pub material: &'a Material,
    pub rays: &'a [Incidence],
    pub alphas: &'a mut [f32],
}

impl<const INPUTS: usize, const WIDTH: usize> Task for AlphaBatch<'_, INPUTS, WIDTH> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        let Self { material, rays, alphas: answers } = self;
        let mut work = Work::<INPUTS, WIDTH>::new();
        let mut block = Prepared::new();
        let (mut waiting, mut count) = ([0; BLOCK], 0);
        for (index, ray) in rays.iter().enumerate() {
            match material.known_alpha(ray.wo.z, ray.kappa_hat) {
                Some(alpha) => answers[index] = alpha,
                None => {
                    waiting[count] = index;
                    count += 1;
                }
            }
            let is_last = index + 1 == rays.len();
            if count == BLOCK || (is_last && count > 0) {
                block.for_opacity(material, count, |k| unlit(&rays[waiting[k]]));
                let found = work.alphas(isa, material, &block, &mut Ahead::nothing());
                for k in 0..count {
                    answers[waiting[k]] = found[k];
                }
                count = 0;
            }
        }
    }
}

/// Where rays that hit meet the material.
pub(super) struct EnterBatch<'a, const INPUTS: usize, const WIDTH: usize> {
    pub material: &'a Material,
    pub rays: &'a [Incidence],
    pub entries: &'a mut [Entry],
}

impl<const INPUTS: usize, const WIDTH: usize> Task for EnterBatch<'_, INPUTS, WIDTH> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        let Self { material, rays, entries } = self;
        let mut work = Work::<INPUTS, WIDTH>::new();
        let mut block = Prepared::new();
        for (rays, entries) in rays.chunks(BLOCK).zip(entries.chunks_mut(BLOCK)) {
            block.for_offset(material, rays.len(), |k| unlit(&rays[k]));
            let [us, vs] = work.hit_uvs(isa, material, &block, &mut Ahead::nothing());
            for (k, (ray, entry)) in rays.iter().zip(entries).enumerate() {
                let Incidence { uv, wo, kappa_hat } = *ray;
                *entry = Entry { uv, wo, kappa_hat, hit_uv: Vec2::new(us[k], vs[k]) };
            }
        }
    }
}

/// Colours of rays that have entered, each under its own light.
pub(super) struct RgbBatch<'a, const INPUTS: usize, const WIDTH: usize> {
    pub material: &'a Material,
    pub entries: &'a [Entry],
    pub wi: &'a [Vec3],
    pub rgb: &'a mut [Vec3],
}

impl<const INPUTS: usize, const WIDTH: usize> Task for RgbBatch<'_, INPUTS, WIDTH> {
    type Output = ();

    #[inline(always)]
    fn run<I: Isa>(self, isa: I) {
        let Self { material, entries, wi, rgb } = self;
        let mut work = Work::<INPUTS, WIDTH>::new();
        let mut block = Prepared::new();
        let blocks = entries.chunks(BLOCK).zip(wi.chunks(BLOCK)).zip(rgb.chunks_mut(BLOCK));
        for ((entries, wi), rgb) in blocks {
            let query = |k: usize| {
                let Entry { uv, wo, kappa_hat, .. } = entries[k];
                Query { uv, wo, wi: wi[k], kappa_hat }
            };
            block.fill::<true>(material, entries.len(), query);
            let mut hit_uv: [Row; 2] = [[0.0; BLOCK]; 2];
            for (k, entry) in entries.iter().enumerate() {
                (hit_uv[0][k], hit_uv[1][k]) = (entry.hit_uv.x, entry.hit_uv.y);
            }
            let [red, green, blue] =
                work.colours(isa, material, &block.lanes, &hit_uv, &mut Ahead::nothing());
            for (k, rgb) in rgb.iter_mut().enumerate() {
                *rgb = Vec3::new(red[k], green[k], blue[k]);
            }
        }
    }
}

/// A query whose light does not matter.
#[inline(always)]
fn unlit(ray: &Incidence) -> Query {
    Query { uv: ray.uv, wo: ray.wo, wi: Vec3::ZERO, kappa_hat: ray.kappa_hat }
}
