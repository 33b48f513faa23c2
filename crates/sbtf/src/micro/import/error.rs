//! [`ImportError`]: why a file is no material.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::raster::{MAX_SIDE, MAX_TEXELS};

/// A file that does not fit, and why.
#[derive(Debug, Error)]
#[error("{}: {problem}", path.display())]
pub struct ImportError {
    /// The file, or the name that was asked for.
    pub path: PathBuf,
    /// What is wrong with it; part of the message, and so no source of its own.
    pub problem: Problem,
}

impl ImportError {
    /// Joins the two.
    #[must_use]
    pub fn new(path: &Path, problem: Problem) -> Self {
        Self { path: path.to_owned(), problem }
    }
}

/// What can be wrong with a material's file.
#[derive(Debug, Error)]
pub enum Problem {
    /// Neither a procedural material nor a path.
    #[error("is no procedural material; those are {0}. A file's name ends in .toml")]
    UnknownName(String),
    /// The file system says no.
    #[error("cannot be read: {0}")]
    Unreadable(std::io::Error),
    /// No TOML, an unknown key, or a value of the wrong kind.
    #[error("{0}")]
    Syntax(Box<toml::de::Error>),
    /// A key's value is out of range, missing or out of place.
    #[error("{key}: {message}")]
    Key {
        /// The key.
        key: &'static str,
        /// What is wrong with it, and what to do.
        message: String,
    },
    /// Not PNG, JPEG or EXR.
    #[error("is no PNG, JPEG or EXR image")]
    UnknownFormat,
    /// The image breaks its format.
    #[error("is damaged: {0}")]
    Damaged(String),
    /// More texels than are read.
    #[error(
        "has {width} x {height} texels; at most {MAX_SIDE} a side and {MAX_TEXELS} in all are read. Scale it down"
    )]
    TooLarge {
        /// Texels along u.
        width: usize,
        /// Texels along v.
        height: usize,
    },
    /// A channel that is needed is not there.
    #[error("{0}")]
    Channels(String),
    /// Fewer bits than a height needs.
    #[error("has {0} bits a channel; heights need 8 or 16, or an EXR")]
    BitDepth(u8),
    /// A texel that is no number, or out of range.
    #[error("texel ({column}, {row}) from the upper left is {value}; {what}")]
    Texel {
        /// From the left.
        column: usize,
        /// From the top.
        row: usize,
        /// Its value.
        value: f32,
        /// What it should be.
        what: &'static str,
    },
    /// All heights are equal.
    #[error("is {0} everywhere: there is no relief to speak of. Use a map with heights in it")]
    Constant(f32),
    /// Left and right, or bottom and top, do not meet.
    #[error(
        "does not tile along {axis}: the jump across the border is {ratio:.1} times that between neighbours inside (at most {limit} is \
         taken for tiling). Make the map tile, or set tiling = \"mirror\" or \"accept\""
    )]
    Seam {
        /// `u` or `v`.
        axis: &'static str,
        /// The jump across the border over that inside.
        ratio: f32,
        /// The limit.
        limit: f32,
    },
    /// A mesh that cannot be a tile.
    #[error("{0}")]
    Mesh(String),
}

impl Problem {
    /// A problem with the value of a key.
    pub(crate) fn key(key: &'static str, message: impl Into<String>) -> Self {
        Self::Key { key, message: message.into() }
    }
}
