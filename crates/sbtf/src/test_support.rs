//! Statistics that tests share.

/// Pearson's test at a false alarm rate of 1e-4, cells with fewer than 5 expected samples pooled.
pub(crate) fn assert_chi_square(observed: &[f64], expected: &[f64], case: &str) {
    let (mut statistic, mut cells, mut pool) = (0.0, 0_u32, (0.0, 0.0));
    let mut add = |o: f64, e: f64| {
        statistic += (o - e) * (o - e) / e;
        cells += 1;
    };
    for (&o, &e) in observed.iter().zip(expected) {
        if e >= 5.0 {
            add(o, e);
        } else {
            pool = (pool.0 + o, pool.1 + e);
        }
    }
    if pool.1 >= 5.0 {
        add(pool.0, pool.1);
    } else {
        assert!(pool.0 <= 25.0, "{case}: {} samples where {} are expected", pool.0, pool.1);
    }
    // Wilson and Hilferty: the cube root of chi-square is nearly normal. 3.72 is the quantile of 1e-4.
    let freedom = f64::from(cells - 1);
    let third = 2.0 / (9.0 * freedom);
    let bound = freedom * (1.0 - third + 3.72 * third.sqrt()).powi(3);
    assert!(statistic < bound, "{case}: chi-square {statistic:.1} of {cells} cells, bound {bound:.1}");
}
