//! Rows put together over shapes: means, fronts, recommendations.

use std::collections::BTreeSet;

use super::rows::Row;

/// A setting of a program at one noise level: geometric means over several shapes, which no single shape dominates.
#[derive(Debug, Clone, PartialEq)]
pub struct Mean {
    /// One of the rows, for its names.
    pub row: Row,
    /// Of the median errors.
    pub median: f64,
    /// Of the 95 % errors.
    pub p95: f64,
    /// Of the times on one thread, microseconds a vertex.
    pub us: f64,
    /// On all threads.
    pub us_all: Option<f64>,
}

impl Mean {
    /// What settings are ranked by: both quantiles alike.
    pub fn score(&self) -> f64 {
        (self.median * self.p95).sqrt()
    }
}

/// Noise levels among rows, ascending.
pub fn noises(rows: &[Row]) -> Vec<f64> {
    let mut all: Vec<f64> = rows.iter().map(|r| r.noise).collect();
    all.sort_unstable_by(f64::total_cmp);
    all.dedup();
    all
}

/// Names of the shapes among rows, in the order of their first row.
pub fn shapes(rows: &[Row]) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for row in rows {
        if !all.contains(&row.shape) {
            all.push(row.shape.clone());
        }
    }
    all
}

/// Means at one noise level over all shapes among the rows. A setting that failed on one of them has none.
pub fn means(rows: &[Row], noise: f64) -> Vec<Mean> {
    let rows: Vec<&Row> = rows.iter().filter(|r| r.noise.total_cmp(&noise).is_eq()).collect();
    let shapes: BTreeSet<&str> = rows.iter().map(|r| r.shape.as_str()).collect();
    let mut seen: BTreeSet<String> = BTreeSet::new();
    let mut means = Vec::new();
    for first in &rows {
        if !seen.insert(format!("{} {}", first.program, first.name())) {
            continue;
        }
        let same: Vec<&&Row> =
            rows.iter().filter(|r| r.program == first.program && r.name() == first.name()).collect();
        let mean = |value: &dyn Fn(&Row) -> Option<f64>| {
            let values: Vec<f64> = same.iter().filter_map(|r| value(r)).filter(|v| v.is_finite()).collect();
            (values.len() == shapes.len()).then(|| geometric_mean(&values))
        };
        let found = (mean(&|r| r.median), mean(&|r| r.p95), mean(&|r| r.us_per_vertex));
        if let (Some(median), Some(p95), Some(us)) = found {
            let us_all = mean(&|r| r.us_per_vertex_all_threads);
            means.push(Mean { row: (*first).clone(), median, p95, us, us_all });
        }
    }
    means
}

fn geometric_mean(values: &[f64]) -> f64 {
    // An error of exactly 0 (a plane) must not make everything 0.
    let logs: f64 = values.iter().map(|v| v.max(1e-300).ln()).sum();
    (logs / values.len() as f64).exp()
}

/// Which points nothing beats in both coordinates, in the order of the first coordinate.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut best = f64::INFINITY;
    order
        .into_iter()
        .filter(|&i| {
            let better = points[i].1 < best;
            best = best.min(points[i].1);
            better
        })
        .collect()
}

/// The most accurate of some means.
pub fn most_accurate<'a>(means: impl IntoIterator<Item = &'a Mean>) -> Option<&'a Mean> {
    means.into_iter().min_by(|a, b| a.score().total_cmp(&b.score()))
}

/// The fastest whose score is at most `slack` times the best.
pub fn fastest_within<'a>(means: &[&'a Mean], slack: f64) -> Option<&'a Mean> {
    let best = most_accurate(means.iter().copied())?.score();
    let good = means.iter().copied().filter(|m| m.score() <= slack * best);
    good.min_by(|a, b| a.us.total_cmp(&b.us))
}

/// The setting of ours whose score is least above the best of ours at the noise level where it does worst, with that factor.
pub fn most_robust(rows: &[Row]) -> Option<(Mean, f64)> {
    let ours: Vec<Row> = rows.iter().filter(|r| r.is_ours()).cloned().collect();
    let levels: Vec<Vec<Mean>> = noises(&ours).into_iter().map(|noise| means(&ours, noise)).collect();
    let best: Vec<f64> = levels.iter().map(|l| most_accurate(l).map(Mean::score)).collect::<Option<_>>()?;
    let candidates = levels.first()?.iter().filter_map(|candidate| {
        let worst = levels.iter().zip(&best).map(|(level, best)| {
            level.iter().find(|m| m.row.name() == candidate.row.name()).map(|m| m.score() / best)
        });
        let worst: Vec<f64> = worst.collect::<Option<_>>()?;
        Some((candidate.clone(), worst.into_iter().fold(0.0, f64::max)))
    });
    candidates.min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(shape: &str, setting: &str, noise: f64, error: f64, us: f64) -> Row {
        Row {
            shape: shape.into(),
            program: "osculate".into(),
            method: "m".into(),
            setting: setting.into(),
            noise,
            median: Some(error),
            p95: Some(4.0 * error),
            us_per_vertex: Some(us),
            ..Row::default()
        }
    }

    #[test]
    fn means_are_geometric_and_of_complete_settings_only() {
        let rows = [
            row("a", "fast", 0.0, 0.01, 1.0),
            row("b", "fast", 0.0, 0.04, 4.0),
            row("a", "half", 0.0, 0.01, 1.0),
            row("a", "fast", 0.5, 9.0, 9.0),
        ];
        let means = means(&rows, 0.0);
        assert_eq!(means.len(), 1);
        assert!((means[0].median - 0.02).abs() < 1e-15 && (means[0].us - 2.0).abs() < 1e-12, "{means:?}");
        assert!((means[0].score() - 0.04).abs() < 1e-15);
        assert_eq!((noises(&rows), shapes(&rows)), (vec![0.0, 0.5], vec!["a".into(), "b".into()]));
    }

    #[test]
    fn a_front_has_no_point_that_another_beats() {
        let points = [(1.0, 5.0), (2.0, 6.0), (3.0, 2.0), (3.0, 1.0), (4.0, 1.0), (5.0, 0.5)];
        assert_eq!(front(&points), [0, 3, 5]);
    }

    #[test]
    fn recommendations_weigh_what_they_say() {
        let rows = [
            row("a", "sharp", 0.0, 0.01, 3.0),
            row("a", "soft", 0.0, 0.02, 5.0),
            row("a", "quick", 0.0, 0.011, 1.0),
            row("a", "sharp", 0.1, 1.0, 3.0),
            row("a", "soft", 0.1, 0.1, 5.0),
            row("a", "quick", 0.1, 2.0, 1.0),
        ];
        let clean = means(&rows, 0.0);
        assert_eq!(most_accurate(&clean).unwrap().row.setting, "sharp");
        let all: Vec<&Mean> = clean.iter().collect();
        assert_eq!(fastest_within(&all, 1.2).unwrap().row.setting, "quick");
        assert_eq!(fastest_within(&all, 1.05).unwrap().row.setting, "sharp");
        let (robust, factor) = most_robust(&rows).unwrap();
        assert_eq!(robust.row.setting, "soft");
        assert!((factor - 2.0).abs() < 1e-12);
    }
}
