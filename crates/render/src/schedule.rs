//! [`Schedule`]: which tiles the next pass samples, and how often.
//!
//! A render of so many samples takes as many in every pixel. One that has a goal (a noise, a time) does better: after a few
//! samples everywhere it knows the variance `u` of a sample and the work `w` that it takes, tile by tile. For a given sum of work the sum of the
//! pixels' errors is least where the number of samples goes with `sqrt(u / w)` (Neyman, "On the Two Different Aspects of the
//! Representative Method", Journal of the Royal Statistical Society 97(4), 1934, with costs). Every pass doubles the samples of the tiles
//! that have too few by that. Doubles, because powers of two are where Sobol points are spread best: with the exact shares a picture of a torus took a
//! third more rays to the same noise than with equal samples.
//!
//! Numbers of samples that depend on the samples bias a picture where they are chosen pixel by pixel: what is dark by chance would stay
//! so. Here a number is chosen for some hundred pixels together, their neighbours have a say, and no tile is left out for good.

use std::time::Duration;

use crate::counters::Counters;
use crate::film::Film;
use crate::render::StopRule;

/// Side of a tile in pixels: small enough to balance the load, large enough that the overhead does not show.
pub(crate) const TILE: u32 = 16;

/// Most samples per pixel in a pass over all tiles alike. Between passes stopping rules are checked.
const PASS: u32 = 16;

/// Samples per pixel before any tile gets more than another, and before noise is believed: a few can miss a light altogether.
const EVERYWHERE: u32 = 8;

/// Least variance of a tile, over the mean of all.
const FLOOR: f64 = 0.01;

/// Work of a query of a material with silhouettes, in rays: most of it is the walk for the curvature. Profiled on a torus.
const QUERY_WORK: u64 = 24;

/// Pixels that are sampled together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tile {
    /// Left column and top row.
    pub corner: [u32; 2],
    /// Columns and rows.
    pub size: [u32; 2],
}

impl Tile {
    /// Columns and rows of its pixels, row by row.
    pub(crate) fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        let Self { corner: [x0, y0], size: [width, height] } = self;
        (y0..y0 + height).flat_map(move |y| (x0..x0 + width).map(move |x| [x, y]))
    }
}

/// Samples `first..first + count` of every pixel of a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Order {
    /// Number of the tile.
    pub tile: usize,
    pub first: u32,
    pub count: u32,
}

/// What every tile has had.
#[derive(Debug)]
pub(crate) struct Schedule {
    stop: StopRule,
    columns: usize,
    tiles: Vec<Tile>,
    /// Samples per pixel.
    done: Vec<u32>,
    /// Work so far, in rays.
    work: Vec<f64>,
}

impl Schedule {
    pub(crate) fn new(width: u32, height: u32, stop: StopRule) -> Self {
        let columns = width.div_ceil(TILE);
        let tile = |index: u32| {
            let corner = [TILE * (index % columns), TILE * (index / columns)];
            Tile { corner, size: [TILE.min(width - corner[0]), TILE.min(height - corner[1])] }
        };
        let tiles: Vec<Tile> = (0..columns * height.div_ceil(TILE)).map(tile).collect();
        let (done, work) = (vec![0; tiles.len()], vec![0.0; tiles.len()]);
        Self { stop, columns: columns as usize, tiles, done, work }
    }

    pub(crate) fn tile(&self, index: usize) -> Tile {
        self.tiles[index]
    }

    /// Samples per pixel, in the mean.
    pub(crate) fn samples(&self) -> f64 {
        let pixels = |t: &Tile| f64::from(t.size[0] * t.size[1]);
        let sum: f64 = self.tiles.iter().zip(&self.done).map(|(t, &n)| pixels(t) * f64::from(n)).sum();
        sum / self.tiles.iter().map(pixels).sum::<f64>()
    }

    /// Least and most samples of a pixel.
    pub(crate) fn range(&self) -> [u32; 2] {
        [self.done.iter().min(), self.done.iter().max()].map(|n| n.copied().unwrap_or(0))
    }

    /// Notes that an order was carried out.
    pub(crate) fn note(&mut self, order: Order, counters: &Counters) {
        self.done[order.tile] += order.count;
        let work = counters.rays + counters.shadow_rays + QUERY_WORK * counters.opacity_queries;
        // Shares are divided by it.
        self.work[order.tile] += work.max(1) as f64;
    }

    /// What the next pass does; nothing at the end.
    pub(crate) fn next(&self, film: &Film, elapsed: Duration) -> Vec<Order> {
        let least = self.range()[0];
        // Starts small, so that there is something to look at, and that a short time is not overrun by much.
        let alike = least.clamp(2, PASS);
        let is_known = least >= EVERYWHERE;
        let useful =
            |most: u32| if is_known { self.by_variance(film, most) } else { self.alike(alike, most) };
        let counts = match self.stop {
            StopRule::Samples(total) => self.alike(alike, total),
            StopRule::Noise { target, .. }
                if is_known && film.noise().is_none_or(|noise| noise <= target) =>
            {
                return Vec::new();
            }
            StopRule::Noise { most, .. } => useful(most),
            StopRule::Time(_) if least == 0 => useful(u32::MAX),
            StopRule::Time(limit) => {
                self.within(limit.saturating_sub(elapsed), elapsed, film, &useful(u32::MAX))
            }
        };
        let order = |(tile, count): (usize, u32)| Order { tile, first: self.done[tile], count };
        counts.into_iter().enumerate().filter(|&(_, count)| count > 0).map(order).collect()
    }

    fn alike(&self, count: u32, most: u32) -> Vec<u32> {
        self.done.iter().map(|&done| count.min(most.saturating_sub(done))).collect()
    }

    /// Doubles the tiles that have too few for the best shares.
    fn by_variance(&self, film: &Film, most: u32) -> Vec<u32> {
        let best = self.best_samples(&self.smoothed(film));
        let room = |done: u32| done.min(most.saturating_sub(done));
        // How many times what it has a tile should have; at most doubled, it is nearer to that from the root of two on.
        let wanted = |k: usize| if room(self.done[k]) > 0 { best[k] / f64::from(self.done[k]) } else { 0.0 };
        let bound = (0..best.len()).map(wanted).fold(0.0, f64::max).min(std::f64::consts::SQRT_2);
        let count = |k: usize| if wanted(k) >= bound { room(self.done[k]) } else { 0 };
        (0..best.len()).map(count).collect()
    }

    /// Variances of the tiles' pixels, with a share of what their neighbours have and of all.
    fn smoothed(&self, film: &Film) -> Vec<f64> {
        let variances: Vec<f64> = self.tiles.iter().map(|&tile| film.variance_in(tile)).collect();
        let floor = FLOOR * variances.iter().sum::<f64>() / variances.len() as f64;
        let rows = self.tiles.len() / self.columns;
        let around = |index: usize| {
            let (row, column) = (index / self.columns, index % self.columns);
            let near = |at: usize, end: usize| at.saturating_sub(1)..(at + 2).min(end);
            let (mut sum, mut count) = (0.0, 0.0);
            for y in near(row, rows) {
                for x in near(column, self.columns) {
                    sum += variances[y * self.columns + x];
                    count += 1.0;
                }
            }
            sum / count
        };
        (0..variances.len()).map(|k| (0.5 * (variances[k] + around(k))).max(floor)).collect()
    }

    /// Samples per pixel that each tile would best have after the next pass, from the variances of the means so far.
    fn best_samples(&self, variances: &[f64]) -> Vec<f64> {
        let per_sample = |k: usize| self.work[k] / f64::from(self.done[k]);
        let next = 2.0 * self.work.iter().sum::<f64>();
        let weight = |k: usize| (variances[k] * f64::from(self.done[k]) / per_sample(k)).sqrt();
        let weights: Vec<f64> = (0..self.tiles.len()).map(weight).collect();
        let sum: f64 = weights.iter().enumerate().map(|(k, w)| w * per_sample(k)).sum();
        // Without any variance all is as good as done, and all are alike.
        let alike = |k: usize| 2.0 * f64::from(self.done[k]);
        (0..weights.len()).map(|k| if sum > 0.0 { next * weights[k] / sum } else { alike(k) }).collect()
    }

    /// Those of these counts that there is time for, the most useful first.
    fn within(&self, left: Duration, elapsed: Duration, film: &Film, counts: &[u32]) -> Vec<u32> {
        let per_work = elapsed.as_secs_f64() / self.work.iter().sum::<f64>();
        let seconds = |k: usize| per_work * self.work[k] * f64::from(counts[k]) / f64::from(self.done[k]);
        let variances = self.smoothed(film);
        let mut order: Vec<usize> = (0..counts.len()).filter(|&k| counts[k] > 0).collect();
        // What doubling takes off a tile's variance goes with it.
        let gain = |k: usize| variances[k] / seconds(k);
        order.sort_by(|&a, &b| gain(b).total_cmp(&gain(a)));
        let (mut chosen, mut left) = (vec![0; counts.len()], left.as_secs_f64());
        for k in order {
            left -= seconds(k);
            if left < 0.0 {
                break;
            }
            chosen[k] = counts[k];
        }
        chosen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PixelSum;
    use glam::Vec3;

    /// Carries out orders on tiles of the given spread and work of a sample.
    fn run(schedule: &mut Schedule, film: &mut Film, orders: &[Order], spread: &[f32], work: &[u64]) {
        for &order in orders {
            let Tile { corner, size } = schedule.tile(order.tile);
            for y in corner[1]..corner[1] + size[1] {
                let row: Vec<PixelSum> = (corner[0]..corner[0] + size[0])
                    .map(|x| {
                        let mut sum = PixelSum::default();
                        for index in order.first..order.first + order.count {
                            // A hash that passes for noise.
                            let mut h = (u64::from(x) << 40) ^ (u64::from(y) << 20) ^ u64::from(index);
                            h = (h ^ (h >> 31)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
                            h = (h ^ (h >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
                            let uniform = ((h ^ (h >> 32)) >> 40) as f32 / (1_u32 << 24) as f32;
                            sum.add(index, Vec3::splat(1.0 + spread[order.tile] * (uniform - 0.5)));
                        }
                        sum
                    })
                    .collect();
                film.merge_row(corner[0], y, &row);
            }
            let rays = work[order.tile] * u64::from(order.count);
            schedule.note(order, &Counters { rays, ..Counters::default() });
        }
    }

    #[test]
    fn samples_go_with_the_root_of_variance_over_work() {
        // Four tiles far enough apart that neighbours have no say in every second: 7 columns, tiles 0, 2, 4, 6 count.
        let (spread, work) = ([1.0, 1.0, 1.0, 1.0, 4.0, 4.0, 4.0], [100, 100, 100, 400, 100, 100, 100]);
        let stop = StopRule::Noise { target: 0.0, most: u32::MAX };
        let mut schedule = Schedule::new(7 * TILE, TILE, stop);
        let mut film = Film::new(7 * TILE, TILE);
        while schedule.samples() < 400.0 {
            let orders = schedule.next(&film, Duration::ZERO);
            assert!(orders.iter().all(|o| o.first == schedule.done[o.tile]));
            run(&mut schedule, &mut film, &orders, &spread, &work);
        }
        let done = &schedule.done;
        assert!(done.iter().all(|n| n.is_power_of_two()), "{done:?}");
        // Four times the spread is four times the samples; tiles 1 and 5 have neighbours of their own kind only.
        assert_eq!(done[5], 4 * done[1], "{done:?}");
        // Four times the work is half the samples.
        assert_eq!(2 * done[3], done[1], "{done:?}");
    }

    /// Least and most samples of a picture of 43 x 29 pixels, six tiles alike.
    fn six_alike(stop: StopRule) -> [u32; 2] {
        let (width, height) = (3 * TILE - 5, 2 * TILE - 3);
        let (mut schedule, mut film) = (Schedule::new(width, height, stop), Film::new(width, height));
        loop {
            let orders = schedule.next(&film, Duration::ZERO);
            if orders.is_empty() {
                assert!((schedule.samples() - f64::from(schedule.range()[0])).abs() < 1e-12);
                return schedule.range();
            }
            run(&mut schedule, &mut film, &orders, &[1.0; 6], &[50; 6]);
        }
    }

    #[test]
    fn equal_tiles_get_equal_samples_and_ends_are_kept() {
        assert_eq!(six_alike(StopRule::Samples(21)), [21, 21]);
        assert_eq!(six_alike(StopRule::Noise { target: 0.0, most: 24 }), [24, 24]);
    }

    #[test]
    fn time_is_not_overrun() {
        let mut schedule = Schedule::new(32, 16, StopRule::Time(Duration::from_millis(100)));
        let mut film = Film::new(32, 16);
        // A microsecond a unit of work.
        let elapsed = |s: &Schedule| Duration::from_secs_f64(1e-6 * s.work.iter().sum::<f64>());
        loop {
            let orders = schedule.next(&film, elapsed(&schedule));
            if orders.is_empty() {
                break;
            }
            run(&mut schedule, &mut film, &orders, &[1.0, 2.0], &[300, 300]);
        }
        let spent = elapsed(&schedule).as_secs_f64();
        assert!((0.06..=0.1).contains(&spent), "{spent}");
    }
}
