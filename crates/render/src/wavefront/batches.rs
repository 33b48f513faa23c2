//! [`Batches`]: queries gathered, sorted by material, asked, and the answers brought back to where they came from.

use glam::{Vec2, Vec3};
use osculate_geom::rays::Hit;
use osculate_sbtf::{Entry, Incidence};

use super::Context;
use crate::counters::Counters;
use crate::integrator::plain_opacity;
use crate::silhouette::{Btf, Met, Purpose, SilhouettePoint, SilhouetteVertex};

/// Memory of batches, used again and again.
#[derive(Debug, Default)]
pub(super) struct Batches {
    rays: Vec<Incidence>,
    alphas: Vec<f32>,
    entries: Vec<Entry>,
    wi: Vec<Vec3>,
    rgb: Vec<Vec3>,
}

/// What a surface makes of a ray that hits it.
pub(super) struct Opacity {
    /// Share of light that is stopped.
    pub share: f32,
    /// Where among the points with silhouettes the hit is, if it is one.
    pub point: Option<usize>,
}

/// A colour that is wanted.
pub(super) struct ColourRequest<'a> {
    btf: &'a Btf,
    entry: Entry,
    /// In the material's metric.
    wi: Vec3,
    /// For whom.
    pub node: usize,
    /// Whether it is for the direction in which the path goes on, not for a light.
    pub is_direction: bool,
}

impl<'a> ColourRequest<'a> {
    /// For light from this world direction.
    pub fn new(point: &SilhouetteVertex<'a>, wi: Vec3, node: usize) -> Self {
        Self { btf: point.btf(), entry: *point.entry(), wi: point.query_wi(wi), node, is_direction: false }
    }

    pub fn of_direction(self) -> Self {
        Self { is_direction: true, ..self }
    }
}

impl Batches {
    /// Opacities of hits, with the directions of their rays. Adds the hits of materials with silhouettes to `points`.
    pub fn opacities<'a>(
        &mut self,
        cx: Context<'a>,
        hits: impl ExactSizeIterator<Item = (Hit, Vec3)>,
        purpose: Purpose,
        points: &mut Vec<SilhouettePoint<'a>>,
        counters: &mut Counters,
    ) -> Vec<Opacity> {
        let mut order: Vec<(&Btf, (usize, usize))> = Vec::with_capacity(hits.len());
        let mut found = Vec::with_capacity(hits.len());
        for (hit, direction) in hits {
            let opacity = match Met::new(cx.scene, &hit, -direction, purpose, counters) {
                None => Opacity { share: plain_opacity(cx.scene, &hit), point: None },
                Some(Met::Back) => Opacity { share: 0.0, point: None },
                Some(Met::Opaque) => Opacity { share: 1.0, point: None },
                Some(Met::Front(point)) => {
                    if point.asks_opacity() {
                        order.push((point.btf(), (found.len(), points.len())));
                    }
                    points.push(point);
                    Opacity { share: 1.0, point: Some(points.len() - 1) }
                }
            };
            found.push(opacity);
        }
        counters.opacity_queries += order.len() as u64;
        for group in by_material(&mut order) {
            self.rays.clear();
            self.rays.extend(group.iter().map(|&(_, (_, point))| points[point].incidence()));
            self.alphas.clear();
            self.alphas.resize(group.len(), 0.0);
            group[0].0.alpha_batch(&self.rays, &mut self.alphas);
            for (&(_, (k, _)), &alpha) in group.iter().zip(&self.alphas) {
                found[k].share = alpha;
            }
        }
        found
    }

    /// What the lights of points share that rays hit, in their order.
    pub fn entries(&mut self, points: &[&SilhouettePoint<'_>], counters: &mut Counters) -> Vec<Entry> {
        let mut answers: Vec<Entry> = points.iter().map(|point| point.unmoved()).collect();
        let asking = points.iter().enumerate().filter(|(_, point)| point.asks_offset());
        let mut order: Vec<(&Btf, usize)> = asking.map(|(k, point)| (point.btf(), k)).collect();
        counters.offset_queries += order.len() as u64;
        for group in by_material(&mut order) {
            self.rays.clear();
            self.rays.extend(group.iter().map(|&(_, k)| points[k].incidence()));
            self.entries.clear();
            self.entries.resize(group.len(), NOWHERE);
            group[0].0.enter_batch(&self.rays, &mut self.entries);
            for (&(_, k), &entry) in group.iter().zip(&self.entries) {
                answers[k] = entry;
            }
        }
        answers
    }

    /// The colours that are wanted, in their order.
    pub fn colours(&mut self, requests: &[ColourRequest<'_>]) -> Vec<Vec3> {
        let mut answers = vec![Vec3::ZERO; requests.len()];
        let mut order: Vec<(&Btf, usize)> = requests.iter().enumerate().map(|(k, r)| (r.btf, k)).collect();
        for group in by_material(&mut order) {
            self.entries.clear();
            self.entries.extend(group.iter().map(|&(_, k)| requests[k].entry));
            self.wi.clear();
            self.wi.extend(group.iter().map(|&(_, k)| requests[k].wi));
            self.rgb.clear();
            self.rgb.resize(group.len(), Vec3::ZERO);
            group[0].0.rgb_batch(&self.entries, &self.wi, &mut self.rgb);
            for (&(_, k), &rgb) in group.iter().zip(&self.rgb) {
                answers[k] = rgb;
            }
        }
        answers
    }
}

/// Before it is known.
const NOWHERE: Entry = Entry { uv: Vec2::ZERO, wo: Vec3::Z, kappa_hat: 0.0, hit_uv: Vec2::ZERO };

/// Sorts by what is asked and then by number; the groups that are asked the same thing.
fn by_material<'o, 'a, T: Copy + Ord>(
    order: &'o mut [(&'a Btf, T)],
) -> impl Iterator<Item = &'o [(&'a Btf, T)]> {
    let address = |btf: &Btf| std::ptr::from_ref(btf).cast::<()>().addr();
    let is_one = order.windows(2).all(|pair| address(pair[0].0) == address(pair[1].0));
    if !is_one {
        // Several materials may be in memory in any order: the answers do not depend on that of the groups.
        order.sort_unstable_by_key(|&(btf, index)| (address(btf), index));
    }
    order.chunk_by(move |a, b| address(a.0) == address(b.0))
}
