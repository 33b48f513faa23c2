//! Pearson's chi-square test, for samplers and their densities.

use std::f64::consts::TAU;

/// Fewest samples expected in a cell that stands alone; the statistic is no chi-square below it.
const FEWEST: f64 = 5.0;

/// Chance of counts at least as far from the expected ones as these, were the expectation right; in `[0, 1]`.
///
/// Cells in which fewer than five samples are expected are pooled. If less than five are expected in all of them together they do not
/// count, unless more than 25 were observed, which gives 0. Good to a percent of the chance for hundreds of cells (Wilson and
/// Hilferty, "The distribution of chi-square", PNAS 1931).
///
/// # Panics
///
/// If there are not as many expected as observed counts, or fewer than two cells count.
#[must_use]
pub fn p_value(observed: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(observed.len(), expected.len(), "an expectation for every cell");
    let (mut statistic, mut cells, mut pool) = (0.0, 0_u32, (0.0, 0.0));
    let mut add = |o: f64, e: f64| {
        statistic += (o - e) * (o - e) / e;
        cells += 1;
    };
    for (&o, &e) in observed.iter().zip(expected) {
        if e >= FEWEST {
            add(o, e);
        } else {
            pool = (pool.0 + o, pool.1 + e);
        }
    }
    if pool.1 >= FEWEST {
        add(pool.0, pool.1);
    } else if pool.0 > 25.0 {
        return 0.0;
    }
    assert!(cells >= 2, "at least two cells that count");
    tail(statistic, f64::from(cells - 1))
}

/// Chance of more than `x` with so many degrees of freedom.
fn tail(x: f64, degrees: f64) -> f64 {
    let variance = 2.0 / (9.0 * degrees);
    let normal = ((x / degrees).cbrt() - (1.0 - variance)) / variance.sqrt();
    // The normal tail by Simpson's rule.
    let density = |t: f64| (-t * t / 2.0).exp() / TAU.sqrt();
    let (low, steps) = (normal.clamp(-12.0, 12.0), 2000);
    let width = (13.0 - low) / f64::from(steps);
    let weight = |k: i32| match k {
        0 => 1.0,
        k if k == steps => 1.0,
        k if k % 2 == 1 => 4.0,
        _ => 2.0,
    };
    (0..=steps).map(|k| weight(k) * density(low + width * f64::from(k))).sum::<f64>() * width / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_agree_with_tables() {
        // 5 % points for 100 and 500 degrees of freedom.
        assert!((tail(124.342, 100.0) - 0.05).abs() < 3e-4);
        assert!((tail(553.127, 500.0) - 0.05).abs() < 3e-4);
        assert!((tail(500.0, 500.0) - 0.4916).abs() < 1e-3);
    }

    #[test]
    fn rare_cells_are_pooled_and_impossible_ones_are_noticed() {
        let even = [100.0; 50];
        assert!(p_value(&even, &even) > 0.999);
        let mut off = even;
        off[7] = 200.0;
        // A chi-square of 100 with 49 degrees of freedom.
        assert!((p_value(&off, &even) - 2.3e-5).abs() < 5e-6, "{}", p_value(&off, &even));
        off[7] = 160.0;
        // Ten cells of one expected sample are one of ten.
        let (mut observed, mut expected) = (off.to_vec(), even.to_vec());
        observed.extend([0.0; 10]);
        expected.extend([1.0; 10]);
        assert!(p_value(&observed, &expected) < p_value(&off, &even) - 0.1);
        // Where next to nothing is expected there is much.
        observed.push(30.0);
        expected.truncate(50);
        observed.drain(50..60);
        expected.push(1e-6);
        assert_eq!(p_value(&observed, &expected), 0.0);
    }
}
