//! A plot of points and lines as SVG that needs nothing else: readable on light and dark ground, alone or inside a page.

use std::fmt::Write as _;

use super::axis::{Axis, Range};

/// A plot: two axes, any number of series, a legend beside it.
#[derive(Debug, Clone)]
pub struct Plot {
    /// Said above the plot and to screen readers.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// Drawn in this order, the last on top.
    pub series: Vec<Series>,
}

/// Points that belong together.
#[derive(Debug, Clone)]
pub struct Series {
    /// In the legend.
    pub name: String,
    /// Which of the [`COLOURS`] it has (modulo their count).
    pub colour: usize,
    /// How points look.
    pub mark: Mark,
    /// Whether they are joined, in their order.
    pub line: Line,
    /// The points. Those that are not finite, or not positive on a logarithmic axis, are left out.
    pub points: Vec<Point>,
}

/// A point of a series.
#[derive(Debug, Clone, Default)]
pub struct Point {
    /// Along the horizontal axis.
    pub x: f64,
    /// Along the vertical axis.
    pub y: f64,
    /// Shown when the pointer rests on it.
    pub hint: String,
    /// Written beside the point, where there is room.
    pub label: Option<String>,
}

/// How a point looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// Filled disc: what the study is about.
    Disc,
    /// Hollow circle, square, diamond or triangle: what it is compared with.
    Circle,
    /// See [`Mark::Circle`].
    Square,
    /// See [`Mark::Circle`].
    Diamond,
    /// See [`Mark::Circle`].
    Triangle,
    /// Nothing but the line.
    None,
}

/// How points are joined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Line {
    /// Not at all.
    None,
    /// By a thin line.
    Thin,
    /// By a thick one.
    Thick,
    /// By a dashed one, for laws and bounds.
    Dashed,
}

/// Colours of series on light and on dark ground, told apart by colour-blind readers (after Okabe and Ito 2008).
pub const COLOURS: [(&str, &str); 8] = [
    ("#0064b1", "#5db4f5"),
    ("#c44e00", "#f59a50"),
    ("#00805c", "#35c99d"),
    ("#b0478a", "#e58fc4"),
    ("#806600", "#d9bd3c"),
    ("#5b52b8", "#a9a2f2"),
    ("#a11d33", "#f0808f"),
    ("#5a6570", "#a8b2bc"),
];

const WIDTH: f64 = 920.0;
const HEIGHT: f64 = 540.0;
/// Edges of the field that data are drawn in.
const LEFT: f64 = 78.0;
const RIGHT: f64 = 690.0;
const TOP: f64 = 44.0;
const BOTTOM: f64 = 480.0;
/// Width of a character at the size of labels, for placing them without measuring.
const CHARACTER: f64 = 6.3;

impl Plot {
    /// The plot as an `<svg>` element, to be written to a file or into a page.
    #[must_use]
    pub fn svg(&self) -> String {
        let frame = Frame::new(self);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"plot\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{0}\">\n<title>{0}</title>\n<style>{1}</style>\n<rect class=\"ground\" width=\"{WIDTH}\" height=\"{HEIGHT}\"/>\n<text class=\"head\" x=\"{LEFT}\" y=\"24\">{0}</text>\n",
            escape(&self.title),
            style(),
        );
        frame.draw_grid(self, &mut out);
        for series in &self.series {
            draw_line(series, &frame, &mut out);
        }
        for series in &self.series {
            draw_marks(series, &frame, &mut out);
        }
        draw_labels(&self.series, &frame, &mut out);
        draw_legend(&self.series, &mut out);
        out.push_str("</svg>\n");
        out
    }
}

/// The characters that XML gives a meaning, replaced.
#[must_use]
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

fn style() -> String {
    let mut css = String::from(
        ".plot{--ground:#fff;--ink:#1c2024;--soft:#5c666f;--rule:#d9dde1;--faint:#eef0f2;font:12px system-ui,sans-serif}\
         .plot .ground{fill:var(--ground)}.plot text{fill:var(--soft)}.plot .head{font-size:15px;font-weight:600;fill:var(--ink)}\
         .plot .axis{font-size:13px;fill:var(--ink)}.plot .name{fill:var(--ink)}.plot .rule{stroke:var(--rule)}.plot .faint{stroke:var(--faint)}\
         .plot .label{font-size:11px;fill:var(--ink);paint-order:stroke;stroke:var(--ground);stroke-width:3px}\
         .plot .line{fill:none;stroke-linejoin:round}.plot .hollow{fill:var(--ground);stroke-width:1.6}",
    );
    let dark: String = COLOURS.iter().enumerate().fold(String::new(), |mut all, (i, (light, dark))| {
        let _ = write!(css, ".plot{{--c{i}:{light}}}");
        let _ = write!(all, "--c{i}:{dark};");
        all
    });
    let _ = write!(
        css,
        "@media (prefers-color-scheme:dark){{.plot{{--ground:#15181b;--ink:#e6e9ec;--soft:#a3adb6;--rule:#3a4148;--faint:#23282d;{dark}}}}}"
    );
    css
}

/// Where numbers are on the picture.
struct Frame {
    x: Range,
    y: Range,
}

impl Frame {
    fn new(plot: &Plot) -> Self {
        let visible = |p: &&Point| plot.x.scale.shows(p.x) && plot.y.scale.shows(p.y);
        let points: Vec<&Point> = plot.series.iter().flat_map(|s| &s.points).filter(visible).collect();
        Self {
            x: Range::new(plot.x.scale, points.iter().map(|p| p.x)),
            y: Range::new(plot.y.scale, points.iter().map(|p| p.y)),
        }
    }

    /// Where a point is drawn, or `None` if it has no place.
    fn place(&self, point: &Point) -> Option<[f64; 2]> {
        let x = LEFT + self.x.share(point.x)? * (RIGHT - LEFT);
        let y = BOTTOM - self.y.share(point.y)? * (BOTTOM - TOP);
        Some([x, y])
    }

    fn draw_grid(&self, plot: &Plot, out: &mut String) {
        for tick in self.x.ticks() {
            let x = LEFT + tick.share * (RIGHT - LEFT);
            let class = if tick.text.is_some() { "rule" } else { "faint" };
            let _ = writeln!(out, "<path class=\"{class}\" d=\"M{x:.1} {TOP}V{BOTTOM}\"/>");
            if let Some(text) = tick.text {
                let y = BOTTOM + 18.0;
                let _ = writeln!(out, "<text x=\"{x:.1}\" y=\"{y}\" text-anchor=\"middle\">{text}</text>");
            }
        }
        for tick in self.y.ticks() {
            let y = BOTTOM - tick.share * (BOTTOM - TOP);
            let class = if tick.text.is_some() { "rule" } else { "faint" };
            let _ = writeln!(out, "<path class=\"{class}\" d=\"M{LEFT} {y:.1}H{RIGHT}\"/>");
            if let Some(text) = tick.text {
                let (x, y) = (LEFT - 8.0, y + 4.0);
                let _ = writeln!(out, "<text x=\"{x}\" y=\"{y:.1}\" text-anchor=\"end\">{text}</text>");
            }
        }
        let (middle_x, middle_y) = (0.5 * (LEFT + RIGHT), 0.5 * (TOP + BOTTOM));
        let _ = writeln!(
            out,
            "<text class=\"axis\" x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n<text class=\"axis\" transform=\"translate(20 {middle_y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            BOTTOM + 44.0,
            escape(&plot.x.label),
            escape(&plot.y.label),
        );
    }
}

fn colour(series: &Series) -> String {
    format!("var(--c{})", series.colour % COLOURS.len())
}

fn draw_line(series: &Series, frame: &Frame, out: &mut String) {
    let look = match series.line {
        Line::None => return,
        Line::Thin => "stroke-width=\"1.4\"",
        Line::Thick => "stroke-width=\"3\"",
        Line::Dashed => "stroke-width=\"1.4\" stroke-dasharray=\"6 5\"",
    };
    let places: Vec<String> =
        series.points.iter().filter_map(|p| frame.place(p)).map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    if !places.is_empty() {
        let path = places.join("L");
        let _ =
            writeln!(out, "<path class=\"line\" {look} style=\"stroke:{}\" d=\"M{path}\"/>", colour(series));
    }
}

fn draw_marks(series: &Series, frame: &Frame, out: &mut String) {
    for point in &series.points {
        let Some(place) = frame.place(point) else { continue };
        let hint = if point.hint.is_empty() {
            String::new()
        } else {
            format!("<title>{}</title>", escape(&point.hint))
        };
        draw_mark(series, place, &hint, out);
    }
}

fn draw_mark(series: &Series, [x, y]: [f64; 2], hint: &str, out: &mut String) {
    let path = match series.mark {
        Mark::None => return,
        Mark::Disc => {
            let _ = writeln!(
                out,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" style=\"fill:{}\">{hint}</circle>",
                colour(series)
            );
            return;
        }
        Mark::Circle => format!("M{} {y:.1}a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z", round(x - 4.0)),
        Mark::Square => format!("M{} {}h7v7h-7z", round(x - 3.5), round(y - 3.5)),
        Mark::Diamond => format!("M{x:.1} {}l5 5l-5 5l-5 -5z", round(y - 5.0)),
        Mark::Triangle => format!("M{x:.1} {}l4.8 8.5h-9.6z", round(y - 5.5)),
    };
    let _ = writeln!(
        out,
        "<path class=\"hollow\" style=\"stroke:{}\" d=\"{path}\">{hint}</path>",
        colour(series)
    );
}

fn round(x: f64) -> f64 {
    (x * 10.0).round() / 10.0
}

/// Writes labels where they cover no other label and no labelled point; those that find no room stay hints.
fn draw_labels(series: &[Series], frame: &Frame, out: &mut String) {
    let mut taken: Vec<[f64; 4]> = series
        .iter()
        .flat_map(|s| &s.points)
        .filter_map(|p| frame.place(p))
        .map(|[x, y]| [x - 4.0, y - 4.0, x + 4.0, y + 4.0])
        .collect();
    for point in series.iter().flat_map(|s| &s.points) {
        let (Some(label), Some([x, y])) = (&point.label, frame.place(point)) else { continue };
        let width = label.chars().count() as f64 * CHARACTER;
        let spots = [
            (x + 9.0, y + 4.0),
            (x - 9.0 - width, y + 4.0),
            (x - 0.5 * width, y - 10.0),
            (x - 0.5 * width, y + 19.0),
            (x + 7.0, y - 9.0),
            (x - 7.0 - width, y - 9.0),
            (x + 7.0, y + 17.0),
            (x - 7.0 - width, y + 17.0),
        ];
        let boxes = spots.map(|(left, base)| [left, base - 10.0, left + width, base + 3.0]);
        let inside = |b: &[f64; 4]| b[0] > LEFT && b[2] < RIGHT && b[1] > TOP && b[3] < BOTTOM;
        let free =
            |b: &[f64; 4]| taken.iter().all(|t| b[2] < t[0] || b[0] > t[2] || b[3] < t[1] || b[1] > t[3]);
        let Some(chosen) = boxes.into_iter().find(|b| inside(b) && free(b)) else { continue };
        let _ = writeln!(
            out,
            "<text class=\"label\" x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            chosen[0],
            chosen[1] + 10.0,
            escape(label)
        );
        taken.push(chosen);
    }
}

fn draw_legend(series: &[Series], out: &mut String) {
    let mut y = TOP + 10.0;
    for series in series.iter().filter(|s| !s.name.is_empty()) {
        let x = RIGHT + 22.0;
        if series.line != Line::None {
            let dash = if series.line == Line::Dashed { " stroke-dasharray=\"6 5\"" } else { "" };
            let width = if series.line == Line::Thick { 3.0 } else { 1.4 };
            let _ = writeln!(
                out,
                "<path class=\"line\" stroke-width=\"{width}\"{dash} style=\"stroke:{}\" d=\"M{} {y:.1}h22\"/>",
                colour(series),
                x - 11.0
            );
        }
        draw_mark(series, [x, y], "", out);
        let _ = writeln!(
            out,
            "<text class=\"name\" x=\"{}\" y=\"{:.1}\">{}</text>",
            x + 18.0,
            y + 4.0,
            escape(&series.name)
        );
        y += 21.0;
    }
}

#[cfg(test)]
mod tests {
    use super::super::axis::Scale;
    use super::*;

    fn series(points: &[(f64, f64)]) -> Series {
        let points = points
            .iter()
            .map(|&(x, y)| Point { x, y, label: Some("a<b".into()), ..Point::default() })
            .collect();
        Series { name: "one & only".into(), colour: 9, mark: Mark::Disc, line: Line::Thin, points }
    }

    fn plot(scale: Scale, points: &[(f64, f64)]) -> Plot {
        let axis = |label: &str| Axis { label: label.into(), scale };
        Plot { title: "T".into(), x: axis("time"), y: axis("error"), series: vec![series(points)] }
    }

    fn centres(svg: &str) -> Vec<[f64; 2]> {
        let number = |text: &str, key: &str| {
            let rest = &text[text.find(key).unwrap() + key.len()..];
            rest[..rest.find('"').unwrap()].parse().unwrap()
        };
        let discs = svg.lines().filter(|l| l.starts_with("<circle"));
        discs.map(|l| [number(l, "cx=\""), number(l, "cy=\"")]).collect()
    }

    #[test]
    fn equal_ratios_are_equally_far_apart_and_up_is_more() {
        let svg = plot(Scale::Log, &[(1.0, 0.001), (10.0, 0.01), (100.0, 0.1)]).svg();
        let c = centres(&svg);
        // The last disc is the legend's. Coordinates are written with one digit.
        assert_eq!(c.len(), 4);
        assert!((c[1][0] - c[0][0] - (c[2][0] - c[1][0])).abs() < 0.21, "{c:?}");
        assert!(c[2][1] < c[1][1] && c[1][1] < c[0][1], "{c:?}");
        let c = centres(&plot(Scale::Linear, &[(0.0, 0.0), (1.0, 5.0), (2.0, 10.0)]).svg());
        assert!(
            (c[0][0] - LEFT).abs() < 0.1 && (c[0][1] - BOTTOM).abs() < 0.1,
            "zero is in the corner: {c:?}"
        );
        assert!((c[1][0] - c[0][0] - (c[2][0] - c[1][0])).abs() < 0.21, "{c:?}");
    }

    #[test]
    fn what_has_no_place_is_left_out() {
        let points = [(1.0, 0.0), (-1.0, 1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY), (2.0, 3.0)];
        let svg = plot(Scale::Log, &points).svg();
        assert_eq!(centres(&svg).len(), 2, "one point and the legend");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        let empty = plot(Scale::Log, &[]).svg();
        assert!(empty.contains("error") && !empty.contains("NaN"));
    }

    #[test]
    fn text_is_escaped_and_labels_do_not_overlap() {
        let svg = plot(Scale::Log, &[(1.0, 1.0), (1.0001, 1.0001), (10.0, 10.0)]).svg();
        assert!(svg.contains("one &amp; only") && svg.contains("a&lt;b") && !svg.contains("a<b"));
        let at = |line: &str, key: &str| -> f64 {
            let rest = &line[line.find(key).unwrap() + key.len()..];
            rest[..rest.find('"').unwrap()].parse().unwrap()
        };
        let labels: Vec<[f64; 2]> = svg
            .lines()
            .filter(|l| l.contains("class=\"label\""))
            .map(|l| [at(l, " x=\""), at(l, " y=\"")])
            .collect();
        assert_eq!(labels.len(), 3);
        let (width, height) = (3.0 * CHARACTER, 13.0);
        for (i, a) in labels.iter().enumerate() {
            for b in &labels[..i] {
                assert!((a[0] - b[0]).abs() >= width || (a[1] - b[1]).abs() >= height, "{labels:?}");
            }
        }
    }
}
