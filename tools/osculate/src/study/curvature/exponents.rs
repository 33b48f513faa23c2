//! With which power of the number of vertices time, memory and error grow.

use serde::Serialize;

use super::rows::{Row, quoted};

/// How one setting of one program grows with the mesh: exponents `p` of the laws `c n^p` that fit best. `None` where fewer than two
/// meshes tell.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Exponents {
    /// `osculate`, or a peer.
    pub program: String,
    /// Estimator.
    pub method: String,
    /// Its knobs.
    pub setting: String,
    /// Meshes that the laws were fitted to.
    pub meshes: usize,
    /// Vertices of the smallest.
    pub least_vertices: usize,
    /// Vertices of the largest.
    pub most_vertices: usize,
    /// Of the seconds on one thread.
    pub seconds: Option<f64>,
    /// Of the seconds on all threads.
    pub seconds_all_threads: Option<f64>,
    /// Of the peak bytes beyond the mesh.
    pub bytes: Option<f64>,
    /// Of the median error.
    pub error: Option<f64>,
}

/// The exponents of every setting among the rows about growth, in the order of their first row.
pub fn exponents(rows: &[Row]) -> Vec<Exponents> {
    let rows: Vec<&Row> = rows.iter().filter(|r| r.purpose == "scaling").collect();
    let mut found: Vec<Exponents> = Vec::new();
    for first in &rows {
        let is_same = |r: &&&Row| r.program == first.program && r.name() == first.name();
        if found
            .iter()
            .any(|e| (&e.program, &e.method, &e.setting) == (&first.program, &first.method, &first.setting))
        {
            continue;
        }
        let own: Vec<&Row> = rows.iter().filter(is_same).copied().collect();
        let law = |value: &dyn Fn(&Row) -> Option<f64>| {
            let points: Vec<(f64, f64)> =
                own.iter().filter_map(|r| Some((r.vertices as f64, value(r)?))).collect();
            power(&points)
        };
        let total = |r: &Row, each: Option<f64>| each.map(|each| each * r.vertices as f64);
        let sizes = || own.iter().map(|r| r.vertices);
        found.push(Exponents {
            program: first.program.clone(),
            method: first.method.clone(),
            setting: first.setting.clone(),
            meshes: own.len(),
            least_vertices: sizes().min().unwrap_or(0),
            most_vertices: sizes().max().unwrap_or(0),
            seconds: law(&|r| total(r, r.us_per_vertex)),
            seconds_all_threads: law(&|r| total(r, r.us_per_vertex_all_threads)),
            bytes: law(&|r| total(r, r.bytes_per_vertex)),
            error: law(&|r| r.median),
        });
    }
    found
}

/// As CSV, with a head line.
pub fn csv(exponents: &[Exponents]) -> String {
    let mut out = String::from(
        "program,method,setting,meshes,least_vertices,most_vertices,seconds,seconds_all_threads,bytes,error\n",
    );
    for e in exponents {
        let cell = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.4}"));
        let cells = [
            e.program.clone(),
            e.method.clone(),
            e.setting.clone(),
            e.meshes.to_string(),
            e.least_vertices.to_string(),
            e.most_vertices.to_string(),
            cell(e.seconds),
            cell(e.seconds_all_threads),
            cell(e.bytes),
            cell(e.error),
        ];
        out.push_str(&cells.map(|cell| quoted(&cell)).join(","));
        out.push('\n');
    }
    out
}

/// Exponent `p` of the law `y = c x^p` that fits best (least squares of the logarithms); `None` for less than two points.
fn power(points: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .filter(|(x, y)| *x > 0.0 && *y > 0.0 && y.is_finite())
        .map(|(x, y)| (x.ln(), y.ln()))
        .collect();
    let n = logs.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| logs.iter().map(f).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (xx, xy) =
        logs.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - x) * (p.0 - x), b + (p.0 - x) * (p.1 - y)));
    (xx > 0.0).then(|| xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponents_are_those_of_power_laws() {
        let law = |p: f64| [1e3, 1e4, 2e6].map(|x: f64| (x, 3.0 * x.powf(p)));
        assert!((power(&law(1.0)).unwrap() - 1.0).abs() < 1e-12);
        assert!((power(&law(-0.5)).unwrap() + 0.5).abs() < 1e-12);
        assert_eq!(power(&law(1.0)[..1]), None);
        assert_eq!(power(&[(1.0, f64::INFINITY), (2.0, 1.0)]), None);
        // By hand: logarithms (0, 0), (1, 2), (2, 1) have the slope 1/2.
        let e = std::f64::consts::E;
        assert!((power(&[(1.0, 1.0), (e, e * e), (e * e, e)]).unwrap() - 0.5).abs() < 1e-12);
    }

    #[test]
    fn time_and_memory_are_those_of_the_whole_mesh() {
        let row = |method: &str, vertices: usize, purpose: &str| {
            let n = vertices as f64;
            Row {
                program: "osculate".into(),
                method: method.into(),
                purpose: purpose.into(),
                vertices,
                us_per_vertex: Some(2.0 * n.powf(0.1)),
                bytes_per_vertex: Some(150.0),
                median: Some(n.powf(-1.5)),
                ..Row::default()
            }
        };
        let sizes = [1_000, 16_000, 2_000_000];
        let mut rows: Vec<Row> = sizes.iter().map(|&n| row("a", n, "scaling")).collect();
        rows.push(row("a", 500, "accuracy"));
        rows.push(row("b", 1_000, "scaling"));
        let found = exponents(&rows);
        let near = |x: Option<f64>, y: f64| (x.unwrap() - y).abs() < 1e-12;
        assert_eq!((found.len(), found[0].meshes), (2, 3));
        assert_eq!((found[0].least_vertices, found[0].most_vertices), (1_000, 2_000_000));
        assert!(near(found[0].seconds, 1.1) && near(found[0].bytes, 1.0), "{found:?}");
        assert!(near(found[0].error, -1.5) && found[0].seconds_all_threads.is_none(), "{found:?}");
        assert_eq!((found[1].method.as_str(), found[1].seconds), ("b", None));
        let text = csv(&found);
        let columns: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
        assert_eq!(columns, [10; 3]);
        assert!(text.contains("osculate,a,,3,1000,2000000,1.1000,,1.0000,-1.5000"), "{text}");
    }
}
