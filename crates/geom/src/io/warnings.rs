//! Warnings that a reader returns beside the mesh.

/// Collects warnings, one line per kind: the first of a kind in full, then how many more there were, so that a million
/// bad faces give one line.
#[derive(Debug, Default)]
pub(crate) struct Warnings {
    kinds: Vec<(&'static str, String, usize)>,
}

impl Warnings {
    /// Records one occurrence of `kind`. `message` is only asked for the first.
    pub fn add(&mut self, kind: &'static str, message: impl FnOnce() -> String) {
        match self.kinds.iter_mut().find(|(k, ..)| *k == kind) {
            Some((.., more)) => *more += 1,
            None => self.kinds.push((kind, message(), 0)),
        }
    }

    /// Adds those of another collector after these.
    pub fn append(&mut self, other: Self) {
        self.kinds.extend(other.kinds);
    }

    /// The lines, in the order of their first occurrence.
    pub fn into_lines(self) -> Vec<String> {
        let line = |(_, first, more): (&str, String, usize)| match more {
            0 => first,
            _ => format!("{first} (and {more} more like it)"),
        };
        self.kinds.into_iter().map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_are_counted_not_listed() {
        let mut warnings = Warnings::default();
        for face in [3, 5, 9] {
            warnings.add("fan", || format!("face {face} crosses itself"));
        }
        warnings.add("lines", || "lines are left out".into());
        assert_eq!(
            warnings.into_lines(),
            ["face 3 crosses itself (and 2 more like it)", "lines are left out"]
        );
    }
}
