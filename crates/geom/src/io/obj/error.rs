//! [`ObjError`].

use thiserror::Error;

/// What is wrong with an OBJ file. Lines, faces and vertices are counted from 1, as OBJ does.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ObjError {
    /// Not the start of a statement.
    #[error(
        "line {line}: expected a statement such as \"v\" or \"f\", found {found:?}, which is not text; is this an OBJ file?"
    )]
    NotText {
        /// Number of the line.
        line: usize,
        /// Its start.
        found: String,
    },
    /// Too few coordinates.
    #[error("line {line}: {what} {number} has {found} coordinates; it needs {needed}")]
    FewCoordinates {
        /// Number of the line.
        line: usize,
        /// `vertex`, `texture coordinate` or `normal`.
        what: &'static str,
        /// Its number.
        number: usize,
        /// How many it has.
        found: usize,
        /// How many it needs.
        needed: usize,
    },
    /// A coordinate is no number.
    #[error("line {line}: {what} {number} has the coordinate {found:?}, which is not a number")]
    NotANumber {
        /// Number of the line.
        line: usize,
        /// `vertex`, `texture coordinate` or `normal`.
        what: &'static str,
        /// Its number.
        number: usize,
        /// What is there.
        found: String,
    },
    /// A coordinate is NaN or infinite.
    #[error("line {line}: {what} {number} is not finite: {value:?}")]
    NotFinite {
        /// Number of the line.
        line: usize,
        /// `vertex`, `texture coordinate` or `normal`.
        what: &'static str,
        /// Its number.
        number: usize,
        /// Its coordinates.
        value: Vec<f64>,
    },
    /// A corner of a face is not of the form `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    #[error(
        "face {face} has the corner {found:?}; expected v, v/vt, v//vn or v/vt/vn with whole numbers (line {line})"
    )]
    BadCorner {
        /// Number of the face.
        face: usize,
        /// What is there.
        found: String,
        /// Number of the line.
        line: usize,
    },
    /// A face names something that does not exist.
    #[error("face {face} uses {what} {index} of {count}{hint} (line {line})")]
    BadIndex {
        /// Number of the face.
        face: usize,
        /// `vertex`, `texture coordinate` or `normal`.
        what: &'static str,
        /// As the file has it; negative ones count back.
        index: i64,
        /// How many there are, for negative ones before this face.
        count: usize,
        /// How to count.
        hint: &'static str,
        /// Number of the line.
        line: usize,
    },
    /// More than 32-bit indices can name.
    #[error("has {count} {what}s, more than the {} that 32-bit indices can name", u32::MAX)]
    TooMany {
        /// `vertex`, `texture coordinate` or `normal`.
        what: &'static str,
        /// How many.
        count: usize,
    },
    /// `tobj` refuses what has been prepared for it.
    #[error("cannot be parsed: {0}")]
    Tobj(tobj::LoadError),
}
