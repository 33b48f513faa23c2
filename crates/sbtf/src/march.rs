//! [`HeightMarch`]: an explicit height field, marched in the bent local frame of a query, with no network.
//!
//! The baseline that a neural material has to beat on height fields: one query finds the first hit by a fixed number of
//! even steps and a bisection, and shades it with direct light, whose shadow is marched likewise. What a step jumps over is missed, and light
//! that is reflected more than once is not there. [`Oracle`](crate::oracle::Oracle) is the same without a limit on steps, and with all light.

use glam::{Vec2, Vec3};

use crate::micro::HeightField;
use crate::patch::{FieldTracer, Shading, Space, Transport, TransportOptions};
use crate::query::{Answer, Entry, Query, SilhouetteBtf};
use crate::random::Random;

/// Marches through a height field.
#[derive(Debug)]
pub struct HeightMarch {
    field: FieldTracer,
    transport: Transport,
    steps: u32,
}

impl HeightMarch {
    /// Prepares a height field; each ray takes that many steps.
    ///
    /// # Panics
    ///
    /// If there are no steps.
    #[must_use]
    pub fn new(field: &HeightField, steps: u32) -> Self {
        assert!(steps > 0, "at least one step");
        let transport = Transport::new(TransportOptions { bounces: 1, ..TransportOptions::default() });
        Self { field: FieldTracer::new(field, Shading::Smooth), transport, steps }
    }

    /// The radiance, or `None` where the march meets nothing.
    fn radiance(&self, query: &Query) -> Option<Vec3> {
        let Query { uv, wo, wi, kappa_hat } = *query;
        if wo.z <= 0.0 {
            return None;
        }
        let (space, ray) = self.field.bent(uv, kappa_hat, wo, wi);
        let space = space.with_steps(self.steps);
        let hit = space.closest(&ray)?;
        // One bounce draws no random number.
        Some(self.transport.radiance(&space, ray, hit, &mut Random::new(0, 0, 0)))
    }
}

impl SilhouetteBtf for HeightMarch {
    fn eval(&self, query: &Query) -> Answer {
        self.radiance(query).map_or(Answer::default(), |rgb| Answer { rgb, alpha: 1.0 })
    }

    fn alpha(&self, uv: Vec2, wo: Vec3, kappa_hat: f32) -> f32 {
        if wo.z <= 0.0 {
            return 0.0;
        }
        let (space, ray) = self.field.bent(uv, kappa_hat, wo, Vec3::Z);
        if space.with_steps(self.steps).closest(&ray).is_some() { 1.0 } else { 0.0 }
    }

    fn rgb(&self, entry: &Entry, wi: Vec3) -> Vec3 {
        let Entry { uv, wo, kappa_hat, .. } = *entry;
        self.radiance(&Query { uv, wo, wi, kappa_hat }).unwrap_or(Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::micro::{Geometry, Microstructure};
    use crate::oracle::{Oracle, OracleOptions};
    use crate::patch::test_fields::sinusoid;

    /// More steps, fewer answers that differ from the exact ones; with many, hardly any.
    #[test]
    fn marches_converge_to_direct_light_of_the_oracle() {
        let field = sinusoid(64, 0.15);
        let micro = Microstructure { name: "waves".into(), geometry: Geometry::HeightField(field.clone()) };
        let transport = TransportOptions { bounces: 1, ..Default::default() };
        let oracle = Oracle::new(&micro, OracleOptions { samples: 1, transport, ..Default::default() });
        let mut random = Random::new(5, 5, 5);
        let mut sphere = || {
            let (z, phi) = (1.0 - 2.0 * random.unit(), std::f32::consts::TAU * random.unit());
            ((1.0 - z * z).sqrt() * Vec2::from_angle(phi)).extend(z)
        };
        let queries: Vec<Query> = (0..3000)
            .map(|i| {
                let (wo, wi) = (sphere(), sphere());
                let uv = Vec2::new(wi.x, wo.y) * 3.7;
                Query {
                    uv,
                    wo: wo.with_z(0.5 * wo.z.abs()).normalize(),
                    wi,
                    kappa_hat: [1.5, 0.4, 0.0][i % 3],
                }
            })
            .collect();
        let wrong = |steps: u32| {
            let march = HeightMarch::new(&field, steps);
            let differs = |q: &&Query| {
                let (a, b) = (march.eval(q), oracle.eval(q));
                assert_eq!(march.alpha(q.uv, q.wo, q.kappa_hat), a.alpha);
                a.alpha != b.alpha || (a.rgb - b.rgb).length() > 0.02 * (0.1 + b.rgb.length())
            };
            queries.iter().filter(differs).count()
        };
        let counts = [wrong(4), wrong(32), wrong(512)];
        assert!(counts[0] > 2 * counts[1] && counts[1] > 2 * counts[2], "{counts:?}");
        assert!(counts[2] < 30, "{counts:?}: one in a hundred grazes what 512 steps jump over");
    }
}
