//! stub
use std::path::Path;
use super::{BakedMesh, ReadError, WriteError};
/// p
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// 32
    #[default]
    F32,
    /// 64
    F64,
}
/// x
/// # Errors
pub fn write_ply(_path: &Path, _baked: &BakedMesh, _precision: Precision) -> Result<(), WriteError> { Err(WriteError::Empty) }
/// x
/// # Errors
pub fn read_baked_ply(_bytes: &[u8]) -> Result<BakedMesh, ReadError> { Err(ReadError::NotBaked) }
