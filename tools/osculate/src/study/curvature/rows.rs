//! What was measured: one row per program, setting and mesh, as CSV.

use anyhow::{Context, Result, bail};
use serde::Serialize;

/// One setting of one program on one mesh. `None` where it was not measured or has no meaning.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Row {
    /// Unique name of the mesh.
    pub mesh: String,
    /// The surface that it approximates.
    pub shape: String,
    /// `accuracy` or `scaling`.
    pub purpose: String,
    /// Its vertices.
    pub vertices: usize,
    /// Noise in mean edges.
    pub noise: f64,
    /// `osculate`, or a peer.
    pub program: String,
    /// Estimator.
    pub method: String,
    /// Its knobs.
    pub setting: String,
    /// Error of the worse curvature times the radius: median over the vertices.
    pub median: Option<f64>,
    /// 95 % of the vertices are below.
    pub p95: Option<f64>,
    /// Angle to the exact direction in degrees, median.
    pub direction_median_deg: Option<f64>,
    /// 95 %.
    pub direction_p95_deg: Option<f64>,
    /// Microseconds a vertex on one thread.
    pub us_per_vertex: Option<f64>,
    /// On all threads.
    pub us_per_vertex_all_threads: Option<f64>,
    /// Peak memory beyond the mesh.
    pub bytes_per_vertex: Option<f64>,
    /// Vertices without an answer.
    pub undetermined: usize,
    /// Share of the vertices whose true error is at most the stated one.
    pub covered: Option<f64>,
    /// Median of stated over true error.
    pub stated_over_true: Option<f64>,
    /// Why there are no numbers.
    pub note: String,
}

impl Row {
    /// Whether the row is ours.
    pub fn is_ours(&self) -> bool {
        self.program == "osculate"
    }

    /// Program and method, for people. Ours and that of the program which it repeats must not be mixed up.
    pub fn family(&self) -> String {
        let program = match self.program.as_str() {
            "osculate" => "Osculate",
            "cgal" => "CGAL",
            "ponca" => "Ponca",
            "pymeshlab" => "MeshLab",
            other => other,
        };
        joined(program, &self.method)
    }

    /// The family, and the degree if that is one of the method's two knobs: what a line of a plot goes through.
    pub fn curve(&self) -> String {
        let degree = self.setting.split_once(" on ").map_or("", |(degree, _)| degree);
        if self.is_ours() { joined(&self.family(), degree) } else { self.family() }
    }

    /// Program, method and setting.
    pub fn name(&self) -> String {
        joined(&self.family(), &self.setting)
    }

    /// Method and setting, where it is clear whose.
    pub fn short_name(&self) -> String {
        joined(&self.method, &self.setting)
    }
}

fn joined(a: &str, b: &str) -> String {
    if a.is_empty() || b.is_empty() { format!("{a}{b}") } else { format!("{a} {b}") }
}

/// The rows with a head line.
pub fn csv(rows: &[Row]) -> String {
    let mut out = String::from(
        "mesh,shape,purpose,vertices,noise,program,method,setting,median,p95,direction_median_deg,direction_p95_deg,us_per_vertex,us_per_vertex_all_threads,bytes_per_vertex,undetermined,covered,stated_over_true,note\n",
    );
    for r in rows {
        let cell = |x: Option<f64>| x.map_or_else(String::new, |x| format!("{x:.6e}"));
        let cells = [
            r.mesh.clone(),
            r.shape.clone(),
            r.purpose.clone(),
            r.vertices.to_string(),
            r.noise.to_string(),
            r.program.clone(),
            r.method.clone(),
            r.setting.clone(),
            cell(r.median),
            cell(r.p95),
            cell(r.direction_median_deg),
            cell(r.direction_p95_deg),
            cell(r.us_per_vertex),
            cell(r.us_per_vertex_all_threads),
            cell(r.bytes_per_vertex),
            r.undetermined.to_string(),
            cell(r.covered),
            cell(r.stated_over_true),
            r.note.clone(),
        ];
        out.push_str(&cells.map(|cell| quoted(&cell)).join(","));
        out.push('\n');
    }
    out
}

/// A cell as RFC 4180 has it: in quotes where it has a comma or quotes.
pub(super) fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

/// The rows that `tools/reference/peers.py` writes.
///
/// # Errors
///
/// A missing column, a line of another length, a number that is none; the message names line and value.
pub fn read_peers(text: &str) -> Result<Vec<Row>> {
    let mut lines = text.lines();
    let head: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let column = |name: &str| {
        head.iter()
            .position(|h| *h == name)
            .with_context(|| format!("line 1: no column {name:?}; write it with tools/reference/peers.py"))
    };
    let [mesh, shape, vertices, noise, peer, setting] =
        ["mesh", "shape", "vertices", "noise", "peer", "setting"].map(column);
    let texts = [mesh?, shape?, vertices?, noise?, peer?, setting?, column("note")?];
    let numbers =
        ["median", "p95", "direction_median_deg", "direction_p95_deg", "us_per_vertex", "bytes_per_vertex"]
            .map(column);
    let numbers: Vec<usize> = numbers.into_iter().collect::<Result<_>>()?;
    let undetermined = column("undetermined")?;
    let rows = lines.enumerate().map(|(i, line)| {
        let at = i + 2;
        let cells: Vec<&str> = line.split(',').collect();
        if cells.len() != head.len() {
            bail!("line {at}: {} cells for {} columns", cells.len(), head.len());
        }
        let number = |column: usize| match cells[column] {
            "" => Ok(None),
            text => text.parse().map(Some).ok().with_context(|| format!("line {at}: {text:?} is no number")),
        };
        let [mesh, shape, vertices, noise, peer, setting, note] = texts.map(|c| cells[c]);
        let (method, knob) = split_setting(peer, setting);
        let whole = |text: &str| {
            text.parse::<usize>().ok().with_context(|| format!("line {at}: {text:?} is no count"))
        };
        Ok(Row {
            mesh: mesh.to_owned(),
            purpose: if mesh.ends_with("_scaling") { "scaling" } else { "accuracy" }.to_owned(),
            shape: shape.to_owned(),
            vertices: whole(vertices)?,
            noise: noise.parse().ok().with_context(|| format!("line {at}: {noise:?} is no number"))?,
            program: peer.to_owned(),
            method,
            setting: knob,
            median: number(numbers[0])?,
            p95: number(numbers[1])?,
            direction_median_deg: number(numbers[2])?,
            direction_p95_deg: number(numbers[3])?,
            us_per_vertex: number(numbers[4])?,
            bytes_per_vertex: number(numbers[5])?,
            undetermined: if cells[undetermined].is_empty() { 0 } else { whole(cells[undetermined])? },
            note: note.to_owned(),
            ..Row::default()
        })
    });
    rows.collect()
}

/// A peer's setting in words: estimator and knob.
fn split_setting(peer: &str, setting: &str) -> (String, String) {
    let words = |method: &str, knob: String| (method.to_owned(), knob);
    let digits = setting.find(|c: char| c.is_ascii_digit()).unwrap_or(setting.len());
    let (stem, number) = setting.split_at(digits);
    match (peer, stem) {
        ("libigl", "r") => words("", format!("{number} rings")),
        ("cgal", "jet") => {
            let (degree, rings) = number.split_once('r').unwrap_or((number, "?"));
            words("jets", format!("degree {degree}, {rings} rings"))
        }
        ("cgal", "icc") if number.is_empty() => words("corrected", "1 ring".into()),
        ("cgal", "icc") => words("corrected", format!("{number} mean edges")),
        ("pymeshlab", "scaled") => words("scale dependent", format!("{number} mean edges")),
        ("ponca", _) => words(&stem.to_uppercase(), format!("{number} mean edges")),
        ("trimesh2", _) => words("", String::new()),
        _ => words(stem, number.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_rows_are_read_or_refused() {
        let head = "mesh,shape,vertices,noise,peer,setting,median,p95,direction_median_deg,direction_p95_deg,us_per_vertex,bytes_per_vertex,undetermined,note\n";
        let good = format!(
            "{head}torus_9_0,torus,9,0,cgal,jet4r3,0.5,inf,,,12,100,1,\nm,s,9,0,ponca,aso5,,,,,,,,no answer in 3 s\n"
        );
        let rows = read_peers(&good).unwrap();
        assert_eq!(rows[0].name(), "CGAL jets degree 4, 3 rings");
        assert_eq!(
            (rows[0].median, rows[0].p95, rows[0].direction_median_deg),
            (Some(0.5), Some(f64::INFINITY), None)
        );
        assert_eq!(rows[0].undetermined, 1);
        assert_eq!((rows[1].name().as_str(), rows[1].median), ("Ponca ASO 5 mean edges", None));
        for (text, part) in
            [("a,b\n", "mesh"), (&format!("{head}x,y\n"), "line 2"), (&good.replace("0.5", "half"), "half")]
        {
            let error = format!("{:#}", read_peers(text).unwrap_err());
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn csv_has_as_many_cells_as_columns() {
        let text = csv(&[Row::default(), Row { median: Some(0.25), ..Row::default() }]);
        let columns: Vec<usize> = text.lines().map(|l| l.split(',').count()).collect();
        assert_eq!(columns, [19, 19, 19]);
        assert!(text.contains(",2.500000e-1,"));
        let setting = "degree 2, \"2 rings\"".to_owned();
        let text = csv(&[Row { setting, ..Row::default() }]);
        assert!(text.contains(",\"degree 2, \"\"2 rings\"\"\","), "{text}");
    }
}
