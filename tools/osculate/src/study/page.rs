//! A study as one HTML page that needs nothing else: no script, no font, no picture from outside.

use std::fmt::Write as _;

use base64::Engine as _;

use super::plot::escape;

/// A page.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// Title of the document.
    pub title: String,
    /// The answer in a few sentences, before everything else.
    pub lead: Vec<String>,
    /// What follows, listed in the contents.
    pub sections: Vec<Section>,
}

/// A part of a page with a heading.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// Its heading.
    pub title: String,
    /// What is in it.
    pub blocks: Vec<Block>,
}

/// A piece of a section. In all texts, `` `x` `` becomes code.
#[derive(Debug, Clone)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A list of points.
    List(Vec<String>),
    /// Lines to copy, such as a command.
    Code(String),
    /// A table.
    Table(Table),
    /// An `<svg>` element, and what it shows.
    Plot {
        /// As [`Plot::svg`](super::plot::Plot::svg) returns it.
        svg: String,
        /// What to see in it.
        caption: String,
    },
    /// A picture, as the bytes of a PNG, and what it shows.
    Picture {
        /// The file.
        png: Vec<u8>,
        /// What to see in it.
        caption: String,
    },
    /// What only some want to read; closed until asked for.
    Details {
        /// The line that opens it.
        summary: String,
        /// What is in it.
        blocks: Vec<Block>,
    },
}

/// A table. The first column is text, the others are numbers, set flush right.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// What it shows.
    pub caption: String,
    /// Heads of the columns.
    pub head: Vec<String>,
    /// Rows of as many cells.
    pub rows: Vec<Vec<Cell>>,
}

/// A cell of a table.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Cell {
    /// What it says.
    pub text: String,
    /// How it stands out.
    pub tone: Tone,
}

/// How a cell stands out.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Tone {
    /// Not at all.
    #[default]
    Plain,
    /// It is the best, or it holds.
    Good,
    /// It is bad, or does not hold.
    Bad,
}

impl Cell {
    /// A cell that does not stand out.
    pub fn new(text: impl Into<String>) -> Self {
        Self { text: text.into(), tone: Tone::Plain }
    }

    /// A cell in a tone.
    pub fn toned(text: impl Into<String>, tone: Tone) -> Self {
        Self { text: text.into(), tone }
    }
}

impl Table {
    /// A table of cells that do not stand out.
    pub fn of_texts(caption: &str, head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Self {
        Self {
            caption: caption.to_owned(),
            head: head.iter().map(|&h| h.to_owned()).collect(),
            rows: rows.into_iter().map(|row| row.into_iter().map(Cell::new).collect()).collect(),
        }
    }
}

impl Page {
    /// The page as an HTML document.
    #[must_use]
    pub fn html(&self) -> String {
        let title = escape(&self.title);
        let mut out = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        );
        for text in &self.lead {
            let _ = writeln!(out, "<p class=\"lead\">{}</p>", inline(text));
        }
        out.push_str("<nav><ol>\n");
        for (i, section) in self.sections.iter().enumerate() {
            let _ = writeln!(out, "<li><a href=\"#s{i}\">{}</a></li>", inline(&section.title));
        }
        out.push_str("</ol></nav>\n");
        for (i, section) in self.sections.iter().enumerate() {
            let _ = writeln!(out, "<section id=\"s{i}\">\n<h2>{}</h2>", inline(&section.title));
            section.blocks.iter().for_each(|block| write_block(block, &mut out));
            out.push_str("</section>\n");
        }
        out.push_str("</body>\n</html>\n");
        out
    }
}

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#1c2024;--soft:#5c666f;--rule:#d9dde1;--wash:#f4f6f7;--good:#00734f;--bad:#a1261d;--link:#0064b1;--ground:#fff}\
@media (prefers-color-scheme:dark){:root{--ink:#e6e9ec;--soft:#a3adb6;--rule:#3a4148;--wash:#20252a;--good:#4fd0a2;--bad:#f28b82;--link:#5db4f5;--ground:#15181b}}\
body{max-width:74rem;margin:2rem auto;padding:0 1rem;font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--ground)}\
h1{line-height:1.2;margin-bottom:.6rem}h2{margin-top:2.6rem;padding-top:.6rem;border-top:1px solid var(--rule)}a{color:var(--link)}\
.lead{font-size:1.08rem}nav{columns:2;font-size:.95rem;background:var(--wash);padding:.4rem .8rem;border-radius:6px}\
code,pre{font:.9em ui-monospace,monospace;background:var(--wash);border-radius:4px}code{padding:.1em .25em}pre{padding:.8rem;overflow-x:auto}\
.wide{overflow-x:auto;margin:1rem 0}table{border-collapse:collapse;font-size:.88rem;font-variant-numeric:tabular-nums}\
caption{text-align:left;min-width:34rem;color:var(--soft);padding-bottom:.3rem;max-width:60rem}th,td{padding:.22rem .6rem;border-bottom:1px solid var(--rule);text-align:right;white-space:nowrap}\
th{font-weight:600;vertical-align:bottom}th:first-child,td:first-child{text-align:left}figure{max-width:60rem}p,ul{max-width:60rem}tbody tr:hover{background:var(--wash)}\
.good{color:var(--good);font-weight:600}.bad{color:var(--bad)}figure{margin:1.2rem 0}figure svg{width:100%;height:auto;border:1px solid var(--rule);border-radius:6px}\
figcaption{color:var(--soft);font-size:.92rem}details{margin:1rem 0}summary{cursor:pointer;color:var(--link)}";

fn write_block(block: &Block, out: &mut String) {
    // Writing to a string cannot fail.
    let _ = match block {
        Block::Text(text) => writeln!(out, "<p>{}</p>", inline(text)),
        Block::List(points) => {
            let items: String = points.iter().map(|p| format!("<li>{}</li>\n", inline(p))).collect();
            writeln!(out, "<ul>\n{items}</ul>")
        }
        Block::Code(text) => writeln!(out, "<pre>{}</pre>", escape(text)),
        Block::Table(table) => {
            write_table(table, out);
            Ok(())
        }
        Block::Plot { svg, caption } => {
            writeln!(out, "<figure>\n{svg}<figcaption>{}</figcaption>\n</figure>", inline(caption))
        }
        Block::Picture { png, caption } => {
            let data = base64::engine::general_purpose::STANDARD.encode(png);
            let caption = inline(caption);
            // Not scaled, so that pixels can be looked at.
            writeln!(
                out,
                "<figure class=\"wide\">\n<img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">\n<figcaption>{caption}</figcaption>\n</figure>"
            )
        }
        Block::Details { summary, blocks } => {
            let _ = writeln!(out, "<details>\n<summary>{}</summary>", inline(summary));
            blocks.iter().for_each(|block| write_block(block, out));
            writeln!(out, "</details>")
        }
    };
}

fn write_table(table: &Table, out: &mut String) {
    let _ = writeln!(out, "<div class=\"wide\"><table>\n<caption>{}</caption>", inline(&table.caption));
    let head: String = table.head.iter().map(|h| format!("<th scope=\"col\">{}</th>", inline(h))).collect();
    let _ = writeln!(out, "<thead><tr>{head}</tr></thead>\n<tbody>");
    for row in &table.rows {
        let cells: String = row.iter().map(cell).collect();
        let _ = writeln!(out, "<tr>{cells}</tr>");
    }
    out.push_str("</tbody>\n</table></div>\n");
}

fn cell(cell: &Cell) -> String {
    let class = match cell.tone {
        Tone::Plain => "",
        Tone::Good => " class=\"good\"",
        Tone::Bad => " class=\"bad\"",
    };
    format!("<td{class}>{}</td>", inline(&cell.text))
}

/// Escaped text with code between backticks. An odd backtick stays one.
fn inline(text: &str) -> String {
    let parts: Vec<String> = text.split('`').map(escape).collect();
    let mut out = String::with_capacity(text.len());
    for (i, part) in parts.iter().enumerate() {
        let is_code = i % 2 == 1;
        match (is_code, i + 1 == parts.len()) {
            (false, _) => out.push_str(part),
            (true, false) => {
                let _ = write!(out, "<code>{part}</code>");
            }
            (true, true) => {
                let _ = write!(out, "`{part}");
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_in_the_page_and_escaped() {
        let table = Table {
            caption: "c < d".into(),
            head: vec!["a".into(), "b".into()],
            rows: vec![vec![Cell::new("<script>"), Cell::toned("1.0", Tone::Good)]],
        };
        let details = Block::Details { summary: "more".into(), blocks: vec![Block::Code("x && y".into())] };
        let section = Section {
            title: "Speed & error".into(),
            blocks: vec![Block::Text("take `--rings 2`".into()), Block::Table(table), details],
        };
        let page = Page { title: "T".into(), lead: vec!["L".into()], sections: vec![section] };
        let html = page.html();
        for part in [
            "<code>--rings 2</code>",
            "&lt;script&gt;",
            "c &lt; d",
            "<td class=\"good\">1.0</td>",
            "x &amp;&amp; y",
            "<a href=\"#s0\">Speed &amp; error</a>",
            "<section id=\"s0\">",
        ] {
            assert!(html.contains(part), "{part} is not in {html}");
        }
        assert!(!html.contains("<script>"));
        for outside in ["src=", "http://", "https://", "@import", "url("] {
            assert!(!html.contains(outside), "{outside}: the page must stand alone");
        }
    }

    #[test]
    fn backticks_pair_up() {
        assert_eq!(inline("a `b` c"), "a <code>b</code> c");
        assert_eq!(inline("a ` b"), "a ` b");
        assert_eq!(inline("`<`"), "<code>&lt;</code>");
    }
}
