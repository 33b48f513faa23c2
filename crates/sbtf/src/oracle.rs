//! [`Oracle`]: the answer that a perfectly trained model would give, by tracing the bent patch at query time.
//!
//! A picture made with it shows what the model's form costs (one curvature per query, local coordinates), and its difference to
//! a trained model's picture what the fit costs.
//!
//! Everything is exact for the query's own curvature and direction. The opacity of a height field is that of [`Sweep`](crate::patch::Sweep); all else is
//! traced through the bent field or mesh.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use crate::micro::{Geometry, Microstructure};
use crate::patch::{FieldTracer, MeshTracer, TileOptions};
use crate::patch::{Transport, TransportOptions};
use crate::query::{Answer, Query, SeeThrough, SilhouetteBtf};
use crate::random::Random;

/// How much work an answer is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OracleOptions {
    /// Paths per answer. Default 16.
    pub samples: u32,
    /// Transport.
    pub transport: TransportOptions,
    /// Triangulation of tile meshes, and where shading normals come from.
    pub tile: TileOptions,
    /// Equal queries get equal answers; another seed gives other noise.
    pub seed: u64,
}

impl Default for OracleOptions {
    fn default() -> Self {
        Self { samples: 16, transport: TransportOptions::default(), tile: TileOptions::default(), seed: 0 }
    }
}

/// Traces a microstructure.
#[derive(Debug)]
pub struct Oracle {
    options: OracleOptions,
    transport: Transport,
    method: Method,
}

#[derive(Debug)]
enum Method {
    Field(Box<FieldTracer>),
    Mesh(Box<MeshTracer>),
}

impl Oracle {
    /// Prepares a microstructure.
    ///
    /// # Panics
    ///
    /// If the options ask for no samples or no bounces.
    #[must_use]
    pub fn new(micro: &Microstructure, options: OracleOptions) -> Self {
        assert!(options.samples > 0 && options.transport.bounces > 0, "at least one sample and one bounce");
        let method = match &micro.geometry {
            Geometry::HeightField(field) => {
                Method::Field(Box::new(FieldTracer::new(field, options.tile.shading)))
            }
            Geometry::TileMesh(mesh) => Method::Mesh(Box::new(MeshTracer::new(mesh, &options.tile))),
        };
        Self { options, transport: Transport::new(options.transport), method }
    }

    /// Texture coordinates of the first hit less those of the entry point; `None` where the ray passes.
    #[must_use]
    pub fn offset(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> Option<Vec2> {
        match &self.method {
            Method::Field(field) => field.offset(uv, wo, kappa_hat),
            Method::Mesh(mesh) => mesh.offset(uv, wo, kappa_hat),
        }
    }

    /// The mean of the samples; `None` where the ray passes.
    fn radiance(&self, query: &Query) -> Option<Vec3> {
        let mut random = self.random(query);
        let samples = self.options.samples;
        let sample = match &self.method {
            Method::Field(field) => field.sample(&self.transport, query, samples, &mut random),
            Method::Mesh(mesh) => mesh.sample(&self.transport, query, samples, &mut random),
        };
        sample.map(|sample| sample.rgb)
    }

    fn random(&self, query: &Query) -> Random {
        let pair = |a: f32, b: f32| u64::from(a.to_bits()) << 32 | u64::from(b.to_bits());
        let (uv, wo, wi) = (query.uv, query.wo, query.wi);
        let first = Random::new(self.options.seed, pair(uv.x, uv.y), pair(wo.x, wo.y)).bits();
        Random::new(first, pair(wi.x, wi.y), pair(wi.z, query.kappa_hat))
    }
}

impl SilhouetteBtf for Oracle {
    fn eval(&self, query: &Query) -> Answer {
        if query.wo.z <= 0.0 {
            return Answer::default();
        }
        self.radiance(query).map_or(Answer::default(), |rgb| Answer { rgb, alpha: 1.0 })
    }

    fn see_through(&self) -> SeeThrough {
        match self.method {
            Method::Field(_) => SeeThrough::WhereConvex,
            Method::Mesh(_) => SeeThrough::Anywhere,
        }
    }

    fn alpha(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> f32 {
        let hit = match &self.method {
            Method::Field(field) => field.sweep.hits(uv, wo, kappa_hat),
            Method::Mesh(mesh) => mesh.hits(uv, wo, kappa_hat),
        };
        f32::from(u8::from(hit))
    }

    fn eval_batch(&self, queries: &[Query], answers: &mut [Answer]) {
        queries
            .par_iter()
            .zip(answers)
            .with_min_len(64)
            .for_each(|(query, answer)| *answer = self.eval(query));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::patch::test_fields::{bumps, sinusoid};
    use crate::patch::{Patch, TileSurface};

    fn oracle(field: crate::micro::HeightField, samples: u32) -> Oracle {
        let micro = Microstructure { name: "field".into(), geometry: Geometry::HeightField(field) };
        Oracle::new(&micro, OracleOptions { samples, ..OracleOptions::default() })
    }

    fn query(random: &mut Random, kappa_hat: f32) -> Query {
        let mut sphere = || {
            let (z, phi) = (1.0 - 2.0 * random.unit(), std::f32::consts::TAU * random.unit());
            ((1.0 - z * z).sqrt() * Vec2::from_angle(phi)).extend(z)
        };
        let (wi, wo) = (sphere(), sphere());
        Query { uv: Vec2::new(random.unit(), random.unit()), wo: wo.with_z(wo.z.abs()), wi, kappa_hat }
    }

    /// The march through the field against rays in the triangles of a patch: two methods that share only the bend and the BRDF.
    #[test]
    fn agrees_with_patches() {
        let mut random = Random::new(1, 1, 1);
        for (field, kappa) in [(sinusoid(64, 0.15), 1.2), (bumps(64, 0.15), 0.0), (sinusoid(64, 0.15), -2.0)]
        {
            let tile = Arc::new(TileSurface::from_field(
                &field,
                &TileOptions { tolerance: 0.001, ..TileOptions::default() },
            ));
            let oracle = oracle(field, 1);
            let (mut far, mut hits, mut sums, mut squares) = (0, 0, [0.0_f64; 2], 0.0_f64);
            for axis in 0..12_u8 {
                let rotation = 0.5 * f32::from(axis);
                let patch = Patch::new(tile.clone(), kappa, rotation);
                for _ in 0..300 {
                    let mut q = query(&mut random, kappa);
                    q.wo = (q.wo.truncate().length() * -Vec2::from_angle(rotation)).extend(q.wo.z);
                    let Some(offset) = oracle.offset(q.uv, q.wo, kappa) else { continue };
                    let Some(sample) = patch.sample(&oracle.transport, q.uv, q.wo, q.wi, &mut random) else {
                        continue;
                    };
                    hits += 1;
                    // A hundredth of a tile: grazing rays slide on the tolerance.
                    far += u32::from((sample.offset - offset).length() > 0.01);
                    let pair = [sample.rgb, oracle.eval(&q).rgb].map(|rgb| f64::from(rgb.y));
                    sums = [sums[0] + pair[0], sums[1] + pair[1]];
                    squares += (pair[0] - pair[1]).powi(2);
                }
            }
            assert!(far * 50 < hits && hits > 2000, "{kappa}: {far} of {hits} hits are elsewhere");
            let deviation = squares.sqrt();
            assert!(
                (sums[0] - sums[1]).abs() < 4.0 * deviation + 0.002 * sums[0],
                "{kappa}: {sums:?} +- {deviation}"
            );
        }
    }

    #[test]
    fn batches_are_the_single_answers_and_all_is_finite() {
        let mut random = Random::new(2, 2, 2);
        let weave = crate::patch::test_fields::strip(0.1);
        let mesh = Microstructure { name: "strip".into(), geometry: Geometry::TileMesh(weave) };
        let options = OracleOptions { samples: 1, ..OracleOptions::default() };
        for (oracle, count) in [(oracle(bumps(48, 0.1), 1), 300), (Oracle::new(&mesh, options), 200)] {
            let mut queries: Vec<Query> =
                (0..count).map(|i| query(&mut random, [-1.0, 0.0, 1e-9, 0.5, 9.99][i % 5])).collect();
            queries[0].wo = Vec3::new(1.0, 0.0, 1e-6);
            queries[1].wo = Vec3::Z;
            queries[2].uv = Vec2::splat(1e6);
            queries[3].wo = Vec3::NEG_Z;
            let mut answers = vec![Answer::default(); count];
            oracle.eval_batch(&queries, &mut answers);
            for (q, answer) in queries.iter().zip(&answers) {
                assert_eq!(*answer, oracle.eval(q));
                assert_eq!(answer.alpha, oracle.alpha(q.uv, q.wo, q.kappa_hat), "{q:?}");
                assert!(answer.rgb.is_finite() && answer.rgb.min_element() >= 0.0, "{q:?}");
                assert!(answer.alpha == 1.0 || answer.rgb == Vec3::ZERO);
            }
            assert_eq!(answers[3], Answer::default());
            assert!(answers.iter().any(|a| a.alpha == 0.0) && answers.iter().any(|a| a.rgb.x > 0.0));
        }
    }
}
