//! Reading reference files that `tools/reference/libigl_curvature.py` wrote.

use std::collections::BTreeMap;
use std::io::{Cursor, Read};
use std::path::Path;

use npyz::npz::NpzArchive;
use npyz::{Deserialize, NpyFile};
use thiserror::Error;

use super::{Expected, Matching, SkipReason};
use crate::Vec3;
use crate::curvature::Neighbourhood;

/// What libigl said about a mesh, under one or more neighbourhoods.
#[derive(Debug, Clone)]
pub struct ReferenceFile {
    /// Positions as libigl read them.
    pub positions: Vec<Vec3>,
    /// Triangles, all indices in range.
    pub triangles: Vec<[u32; 3]>,
    /// Results by setting: `r5` for 5 rings, `s5` for the sphere of 5 mean edge lengths.
    pub settings: BTreeMap<String, ReferenceSetting>,
    /// Versions, command and hashes as the script recorded them.
    pub meta: serde_json::Value,
}

/// One run of `igl::principal_curvature`. All arrays have one entry per row of [`ReferenceFile::positions`].
#[derive(Debug, Clone)]
pub struct ReferenceSetting {
    /// Larger curvature.
    pub kappa_max: Vec<f64>,
    /// Smaller curvature.
    pub kappa_min: Vec<f64>,
    /// Direction of `kappa_max`; zero where the curvature is.
    pub d1: Vec<Vec3>,
    /// Direction of `kappa_min`; zero where the curvature is.
    pub d2: Vec<Vec3>,
    /// Whether libigl lists the vertex as bad.
    pub bad: Vec<bool>,
    /// Condition number of each vertex's design matrix, where recorded: infinite if singular, NaN if not computed.
    pub condition: Option<Vec<f64>>,
}

/// Why a file is not a reference.
#[derive(Debug, Error)]
pub enum ReferenceError {
    /// Not readable, or no zip archive.
    #[error("{0}; expected an .npz that tools/reference/libigl_curvature.py wrote")]
    Archive(std::io::Error),
    /// An array is absent.
    #[error("array {0:?} is missing; record the reference again")]
    Missing(String),
    /// An array cannot be decoded.
    #[error("array {array:?}: {what}; record the reference again")]
    Array {
        /// Its name.
        array: String,
        /// What is wrong.
        what: String,
    },
    /// The arrays hold no setting.
    #[error("holds no setting (arrays such as \"r5_kmax\"); record the reference again")]
    NoSettings,
}

/// Largest array in bytes. Far above any mesh that libigl can process; it stops an archive of a few kilobytes from
/// unpacking to all of the memory.
const LARGEST_ARRAY: u64 = 1 << 30;

impl ReferenceFile {
    /// Reads a file.
    ///
    /// # Errors
    ///
    /// See [`ReferenceError`].
    pub fn read(path: &Path) -> Result<Self, ReferenceError> {
        Self::from_bytes(&std::fs::read(path).map_err(ReferenceError::Archive)?)
    }

    /// Reads the bytes of a file. What the file claims about sizes is not believed before the data is there.
    ///
    /// # Errors
    ///
    /// See [`ReferenceError`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReferenceError> {
        let mut arrays = Arrays(NpzArchive::new(Cursor::new(bytes)).map_err(ReferenceError::Archive)?);
        let positions: Vec<Vec3> = arrays.rows::<f64>("V", None)?.into_iter().map(Vec3::from).collect();
        let triangles = triangles(&arrays.rows::<i32>("F", None)?, positions.len())?;
        let meta = arrays.vector::<u8>("meta", None)?;
        let meta = serde_json::from_slice(&meta).map_err(|error| bad_array("meta", error))?;
        let mut names: Vec<String> = arrays
            .0
            .array_names()
            .filter_map(|name| name.strip_suffix("_kmax"))
            .map(ToOwned::to_owned)
            .collect();
        names.sort_unstable();
        let mut settings = BTreeMap::new();
        for name in names {
            let setting = setting(&mut arrays, &name, positions.len())?;
            settings.insert(name, setting);
        }
        if settings.is_empty() {
            return Err(ReferenceError::NoSettings);
        }
        Ok(Self { positions, triangles, settings, meta })
    }

    /// The neighbourhood that a setting's name stands for: `r5` is 5 rings, `s5` 5 mean edge lengths.
    #[must_use]
    pub fn neighbourhood(setting: &str) -> Option<Neighbourhood> {
        if let Some(rings) = setting.strip_prefix('r') {
            return rings.parse().ok().map(Neighbourhood::Rings);
        }
        setting.strip_prefix('s')?.parse().ok().map(Neighbourhood::MeanEdges)
    }
}

impl ReferenceSetting {
    /// What a file's vertices should have, by the rows that `matching` found.
    #[must_use]
    pub fn expected(&self, matching: &Matching) -> Vec<Expected> {
        matching
            .rows
            .iter()
            .map(|row| row.map_or(Expected::Skip(SkipReason::Unmatched), |r| self.row(r)))
            .collect()
    }

    fn row(&self, row: u32) -> Expected {
        let row = row as usize;
        let (kappa_max, kappa_min) = (self.kappa_max[row], self.kappa_min[row]);
        if self.bad[row] || !kappa_max.is_finite() || !kappa_min.is_finite() {
            return Expected::Skip(SkipReason::BadInReference);
        }
        let has_direction = self.d1[row].iter().all(|x| x.is_finite()) && self.d1[row] != Vec3::zeros();
        Expected::Known {
            kappa_max,
            kappa_min,
            d1: has_direction.then(|| self.d1[row]),
            condition: self.condition.as_ref().map(|c| c[row]).filter(|c| !c.is_nan()),
        }
    }
}

fn triangles(rows: &[[i32; 3]], vertices: usize) -> Result<Vec<[u32; 3]>, ReferenceError> {
    rows.iter()
        .enumerate()
        .map(|(triangle, row)| {
            let indices = row.map(|i| u32::try_from(i).ok().filter(|&i| (i as usize) < vertices));
            let [Some(a), Some(b), Some(c)] = indices else {
                return Err(bad_array("F", format!("triangle {triangle} is {row:?} of {vertices} vertices")));
            };
            Ok([a, b, c])
        })
        .collect()
}

fn setting<R: Read + std::io::Seek>(
    arrays: &mut Arrays<R>,
    name: &str,
    vertices: usize,
) -> Result<ReferenceSetting, ReferenceError> {
    let count = Some(vertices);
    let array = |key: &str| format!("{name}_{key}");
    let mut bad = vec![false; vertices];
    for index in arrays.vector::<i32>(&array("bad"), None)? {
        let flag = usize::try_from(index).ok().and_then(|index| bad.get_mut(index));
        *flag.ok_or_else(|| bad_array(&array("bad"), format!("names vertex {index} of {vertices}")))? = true;
    }
    let directions = |rows: Vec<[f64; 3]>| rows.into_iter().map(Vec3::from).collect();
    Ok(ReferenceSetting {
        kappa_max: arrays.vector(&array("kmax"), count)?,
        kappa_min: arrays.vector(&array("kmin"), count)?,
        d1: directions(arrays.rows(&array("d1"), count)?),
        d2: directions(arrays.rows(&array("d2"), count)?),
        bad,
        condition: match arrays.vector(&array("cond"), count) {
            Ok(condition) => Some(condition),
            Err(ReferenceError::Missing(_)) => None,
            Err(error) => return Err(error),
        },
    })
}

fn bad_array(array: &str, what: impl std::fmt::Display) -> ReferenceError {
    ReferenceError::Array { array: array.to_owned(), what: what.to_string() }
}

struct Arrays<R: Read + std::io::Seek>(NpzArchive<R>);

impl<R: Read + std::io::Seek> Arrays<R> {
    /// A one-dimensional array, of `count` entries where that is known.
    fn vector<T: Deserialize>(&mut self, name: &str, count: Option<usize>) -> Result<Vec<T>, ReferenceError> {
        let (values, shape) = self.values(name)?;
        match shape[..] {
            [n] if count.is_none_or(|count| n == count as u64) => Ok(values),
            _ => Err(bad_array(name, format!("has shape {shape:?}, expected {}", expected_shape(count, "")))),
        }
    }

    /// An array of shape `[n, 3]`, with `n` rows where that is known.
    fn rows<T: Deserialize + Copy>(
        &mut self,
        name: &str,
        count: Option<usize>,
    ) -> Result<Vec<[T; 3]>, ReferenceError> {
        let (values, shape) = self.values(name)?;
        match shape[..] {
            [n, 3] if count.is_none_or(|count| n == count as u64) => {
                Ok(values.chunks_exact(3).map(|row| [row[0], row[1], row[2]]).collect())
            }
            _ => Err(bad_array(
                name,
                format!("has shape {shape:?}, expected {}", expected_shape(count, ", 3")),
            )),
        }
    }

    fn values<T: Deserialize>(&mut self, name: &str) -> Result<(Vec<T>, Vec<u64>), ReferenceError> {
        let file_name = npyz::npz::file_name_from_array_name(name);
        let zip = self.0.zip_archive();
        if !zip.file_names().any(|found| found == file_name) {
            return Err(ReferenceError::Missing(name.to_owned()));
        }
        let entry = zip.by_name(&file_name).map_err(|error| bad_array(name, error))?;
        let mut bytes = Vec::new();
        // `take` leaves the entry's last bytes unread where it is too large, and the check below notices.
        entry.take(LARGEST_ARRAY).read_to_end(&mut bytes).map_err(|error| bad_array(name, error))?;
        check_header(&bytes).map_err(|what| bad_array(name, what))?;
        let npy = NpyFile::new(&bytes[..]).map_err(|error| bad_array(name, error))?;
        let (shape, order) = (npy.shape().to_vec(), npy.order());
        if order == npyz::Order::Fortran && shape.len() > 1 {
            return Err(bad_array(name, "is in Fortran order"));
        }
        let item = npy.dtype().num_bytes().unwrap_or(usize::MAX);
        let needed = usize::try_from(npy.len()).ok().and_then(|len| len.checked_mul(item));
        let data = npy.into_vec::<T>();
        let values = data.map_err(|error| bad_array(name, error))?;
        if needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(bad_array(name, format!("ends before its shape {shape:?} is filled")));
        }
        Ok((values, shape))
    }
}

fn expected_shape(count: Option<usize>, rest: &str) -> String {
    format!("[{}{rest}]", count.map_or_else(|| "n".to_owned(), |n| n.to_string()))
}

/// Looks at what `npyz` takes on trust: it allocates the header's stated length, multiplies the dimensions without a
/// look at overflow, and recurses into nested brackets. What numpy writes passes.
fn check_header(bytes: &[u8]) -> Result<(), String> {
    let length = match bytes.get(..8) {
        Some([0x93, b'N', b'U', b'M', b'P', b'Y', 1, _]) => {
            bytes.get(8..10).map(|b| (10, usize::from(u16::from_le_bytes([b[0], b[1]]))))
        }
        Some([0x93, b'N', b'U', b'M', b'P', b'Y', 2 | 3, _]) => {
            let length = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
            length.map(|length| (12, length as usize))
        }
        _ => return Err("does not start as an .npy file does".to_owned()),
    };
    let header = length.and_then(|(start, length)| bytes.get(start..)?.get(..length));
    let header = header.and_then(|h| std::str::from_utf8(h).ok()).ok_or("has a damaged header")?;
    let (_, shape) = header.split_once("'shape': (").ok_or("has a header without a shape")?;
    let (shape, _) = shape.split_once(')').ok_or("has a header without a shape")?;
    let nested = header.matches(['(', '[', '{']).count() != 2 || header.matches("shape").count() != 1;
    let mut size = 1u64;
    for dimension in shape.split(',').map(str::trim).filter(|d| !d.is_empty()) {
        let dimension: u64 = dimension.parse().map_err(|_| format!("has the shape ({shape})"))?;
        // Dimensions before a zero must not overflow either, so the zero counts as one.
        let product = size.checked_mul(dimension.max(1)).filter(|&size| size <= LARGEST_ARRAY);
        size = product.ok_or_else(|| format!("has the shape ({shape}), which no memory holds"))?;
    }
    if nested { Err("has a header that numpy does not write".to_owned()) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    use npyz::WriterBuilder;

    /// A tetrahedron with made-up curvature; `edit` may drop or replace arrays.
    fn archive(edit: impl Fn(&str, Vec<u8>) -> Option<Vec<u8>>) -> Vec<u8> {
        fn npy<T: npyz::Serialize + npyz::AutoSerialize + Clone>(shape: &[u64], data: &[T]) -> Vec<u8> {
            let mut bytes = Vec::new();
            let options = npyz::WriteOptions::new().default_dtype().shape(shape);
            let mut writer = options.writer(&mut bytes).begin_nd().unwrap();
            writer.extend(data.iter().cloned()).unwrap();
            writer.finish().unwrap();
            bytes
        }
        let points = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., 0., 1.];
        let arrays = [
            ("V", npy(&[4, 3], &points)),
            ("F", npy(&[2, 3], &[0, 2, 1, 0, 1, 3])),
            ("r5_kmax", npy(&[4], &[4., 3., 2., 1.])),
            ("r5_kmin", npy(&[4], &[1., 0., -1., f64::NAN])),
            ("r5_d1", npy(&[4, 3], &points)),
            ("r5_d2", npy(&[4, 3], &points)),
            ("r5_bad", npy(&[1], &[2])),
            ("meta", npy(&[13], br#"{"format": 1}"#)),
        ];
        let mut buffer = Cursor::new(Vec::new());
        let mut writer = npyz::npz::NpzWriter::new(&mut buffer);
        for (name, bytes) in arrays {
            if let Some(bytes) = edit(name, bytes) {
                let zip = writer.zip_writer();
                zip.start_file(format!("{name}.npy"), Default::default()).unwrap();
                zip.write_all(&bytes).unwrap();
            }
        }
        drop(writer);
        buffer.into_inner()
    }

    #[test]
    fn reads_what_was_recorded() {
        let file = ReferenceFile::from_bytes(&archive(|_, bytes| Some(bytes))).unwrap();
        assert_eq!(file.triangles, [[0, 2, 1], [0, 1, 3]]);
        assert_eq!(file.meta["format"], 1);
        let setting = &file.settings["r5"];
        assert_eq!(setting.bad, [false, false, true, false]);
        assert!(setting.condition.is_none());
        let rows: Vec<_> = (0..4).map(|row| setting.row(row)).collect();
        assert!(matches!(rows[0], Expected::Known { kappa_max: 4.0, d1: None, .. }), "no direction recorded");
        assert!(matches!(rows[1], Expected::Known { d1: Some(_), .. }));
        assert!(matches!(rows[2], Expected::Skip(SkipReason::BadInReference)));
        assert!(matches!(rows[3], Expected::Skip(SkipReason::BadInReference)), "NaN in libigl");
    }

    #[test]
    fn names_what_is_wrong() {
        let broken = |array: &'static str, header: &'static [u8]| {
            let edit =
                move |name: &str, bytes: Vec<u8>| Some(if name == array { header.to_vec() } else { bytes });
            ReferenceFile::from_bytes(&archive(edit)).unwrap_err().to_string()
        };
        let missing = ReferenceFile::from_bytes(&archive(|name, b| (name != "F").then_some(b))).unwrap_err();
        assert!(missing.to_string().contains("array \"F\" is missing"), "{missing}");
        let none =
            ReferenceFile::from_bytes(&archive(|name, b| (name != "r5_kmax").then_some(b))).unwrap_err();
        assert!(matches!(none, ReferenceError::NoSettings), "{none}");
        assert!(broken("V", b"junk").contains("array \"V\""));
        let huge_header = broken("V", b"\x93NUMPY\x02\x00\xff\xff\xff\xff{}");
        assert!(huge_header.contains("damaged header"), "{huge_header}");
        assert!(ReferenceFile::from_bytes(b"PK\x03\x04").is_err());
    }

    #[test]
    fn claimed_sizes_are_not_believed() {
        for shape in ["(1000000000000, 3)", "(4294967296, 4294967296, 3)", "(900000000,)", "(((((((1)))))))"]
        {
            let header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}\n");
            let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
            bytes.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
            bytes.extend(header.bytes());
            let edit = |name: &str, b: Vec<u8>| Some(if name == "r5_kmax" { bytes.clone() } else { b });
            assert!(ReferenceFile::from_bytes(&archive(edit)).is_err(), "{shape}");
        }
    }

    #[test]
    fn damaged_archives_do_not_panic() {
        let whole = archive(|_, bytes| Some(bytes));
        for at in 0..whole.len() {
            let _ = ReferenceFile::from_bytes(&whole[..at]);
            let mut bytes = whole.clone();
            bytes[at] ^= 0x55;
            let _ = ReferenceFile::from_bytes(&bytes);
        }
    }

    #[test]
    fn setting_names_are_neighbourhoods() {
        assert_eq!(ReferenceFile::neighbourhood("r5"), Some(Neighbourhood::Rings(5)));
        assert_eq!(ReferenceFile::neighbourhood("s5"), Some(Neighbourhood::MeanEdges(5.0)));
        assert_eq!(ReferenceFile::neighbourhood("x"), None);
    }
}
