//! What the documents claim to be tested is tested.

use std::fs;
use std::path::{Path, PathBuf};

use osculate_tests::hard_cases::{hard_cases, other_cases};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// All Rust sources below a folder, one after the other.
fn sources(folder: &Path, text: &mut String) {
    for entry in fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("its entry").path();
        if path.is_dir() {
            sources(&path, text);
        } else if path.extension().is_some_and(|e| e == "rs") {
            text.push_str(&fs::read_to_string(&path).expect("a source"));
        }
    }
}

/// What stands between backticks in the last cell of every row of a table.
fn named_tests(document: &str) -> Vec<(&str, Vec<&str>)> {
    let rows = document.lines().filter(|line| line.starts_with('|') && !line.starts_with("|---"));
    rows.filter(|row| !row.ends_with("shown by |"))
        .map(|row| {
            let last = row.trim_end_matches([' ', '|']).rsplit('|').next().expect("splitting gives a cell");
            (row, last.split('`').skip(1).step_by(2).collect())
        })
        .collect()
}

#[test]
fn documented_tests_exist() {
    let document = fs::read_to_string(root().join("docs/pitfalls.md")).unwrap();
    let mut text = String::new();
    for folder in ["crates", "tools", "tests"] {
        sources(&root().join(folder), &mut text);
    }
    let cases: Vec<&str> =
        hard_cases().iter().map(|c| c.name).chain(other_cases().iter().map(|c| c.name)).collect();
    let rows = named_tests(&document);
    assert!(rows.len() > 30, "only {} rows found", rows.len());
    for (row, names) in rows {
        assert!(!names.is_empty(), "a row without a test: {row}");
        for name in names {
            let function = text.contains(&format!("fn {name}("));
            assert!(function || cases.contains(&name), "no test is called {name}");
        }
    }
}
