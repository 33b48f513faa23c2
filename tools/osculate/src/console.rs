//! What a person sees.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::time::Duration;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Prints an error on one line of standard error: `osculate: file: element: value; what to do`.
pub fn error(error: &anyhow::Error) {
    let text = one_line(&format!("{error:#}"));
    // Nothing is left to do when standard error is gone.
    let _ = writeln!(io::stderr(), "osculate: {text}");
}

/// Where lines go: results to standard output, warnings and progress to standard error.
#[derive(Debug)]
pub struct Console {
    results: Show,
    details: Show,
    notes: Show,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Show {
    Yes,
    No,
}

impl Console {
    /// `json_on_stdout`: standard output belongs to the JSON report, so results are not printed.
    pub fn new(quiet: bool, verbose: bool, json_on_stdout: bool) -> Self {
        let show = |yes: bool| if yes { Show::Yes } else { Show::No };
        Self { results: show(!quiet && !json_on_stdout), details: show(verbose), notes: show(!quiet) }
    }

    /// A line of the result.
    pub fn result(&self, line: impl Display) {
        if self.results == Show::Yes {
            // A closed pipe (`| head`) is the reader's choice, not an error.
            let _ = writeln!(io::stdout(), "{line}");
        }
    }

    /// A warning about an input.
    pub fn warn(&self, line: impl Display) {
        if self.notes == Show::Yes {
            let _ = writeln!(io::stderr(), "osculate: warning: {}", one_line(&line.to_string()));
        }
    }

    /// What is being done, with `-v`.
    pub fn detail(&self, line: impl Display) {
        if self.details == Show::Yes {
            let _ = writeln!(io::stderr(), "osculate: {line}");
        }
    }

    /// A spinner for a step of unknown length; none where standard error is no terminal. Ends when dropped.
    pub fn step(&self, message: &str) -> Step {
        self.detail(message);
        let bar = ProgressBar::with_draw_target(None, self.target());
        bar.set_style(style("{spinner} {msg} [{elapsed}]"));
        bar.set_message(message.to_owned());
        // That takes a thread, which nobody would see.
        if !bar.is_hidden() {
            bar.enable_steady_tick(Duration::from_millis(100));
        }
        Step(bar)
    }

    /// A bar for a step of known length, with an ETA; none where standard error is no terminal. Ends when dropped.
    pub fn steps(&self, message: &str, length: u64) -> Step {
        self.detail(message);
        let bar = ProgressBar::with_draw_target(Some(length), self.target());
        bar.set_style(style("{msg} {wide_bar} {percent:>3} % [{elapsed} + {eta}]"));
        bar.set_message(message.to_owned());
        Step(bar)
    }

    fn target(&self) -> ProgressDrawTarget {
        if self.notes == Show::Yes && io::stderr().is_terminal() {
            ProgressDrawTarget::stderr()
        } else {
            ProgressDrawTarget::hidden()
        }
    }
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Progress of a step that is running.
#[derive(Debug)]
pub struct Step(ProgressBar);

impl Step {
    /// Changes what the bar says.
    pub fn say(&self, message: &str) {
        self.0.set_message(message.to_owned());
    }

    /// Moves the bar to this share of its length, in `[0, 1]`.
    pub fn set_share(&self, share: f64) {
        let length = self.0.length().unwrap_or_default() as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and a u64")]
        self.0.set_position((share.clamp(0.0, 1.0) * length) as u64);
    }
}

impl Drop for Step {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn one_line(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// Six significant digits, in scientific form where a plain number would be hard to read.
pub fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 || (1e-3..1e6).contains(&magnitude) {
        // At most six digits after the point, and as many fewer as there are before it.
        let before = [1.0, 10.0, 1e2, 1e3, 1e4, 1e5].iter().filter(|&&p| magnitude >= p).count();
        let text = format!("{x:.*}", 6 - before);
        let trimmed =
            if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        trimmed.to_owned()
    } else {
        format!("{x:.3e}")
    }
}

/// A count with its noun: `1 edge`, `2 edges`.
pub fn count(n: usize, noun: &str) -> String {
    if n == 1 {
        return format!("1 {noun}");
    }
    let plural = match noun.strip_suffix("ex") {
        Some(stem) => format!("{stem}ices"),
        None => format!("{noun}s"),
    };
    format!("{n} {plural}")
}

/// Bytes as people write them.
pub fn bytes(n: u64) -> String {
    match n {
        0..1_000 => format!("{n} B"),
        1_000..1_000_000 => format!("{} kB", n / 1_000),
        _ => format!("{}.{} MB", n / 1_000_000, n / 100_000 % 10),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_honest() {
        for (x, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (-12.34, "-12.34"),
            (1.0 / 3.0, "0.333333"),
            (1e-9, "1.000e-9"),
            (1e7, "1.000e7"),
        ] {
            assert_eq!(number(x), text);
        }
        assert_eq!(number(123_456.7), "123457");
        assert_eq!(number(f64::NAN), "NaN");
        assert_eq!(
            (count(1, "vertex"), count(2, "vertex"), count(0, "edge")),
            ("1 vertex".into(), "2 vertices".into(), "0 edges".into())
        );
        assert_eq!(
            (bytes(999), bytes(1_999), bytes(2_560_000)),
            ("999 B".into(), "1 kB".into(), "2.5 MB".into())
        );
    }
}
