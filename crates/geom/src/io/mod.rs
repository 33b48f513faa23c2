//! Reading mesh files.

mod corners;
mod polygon;
mod warnings;
