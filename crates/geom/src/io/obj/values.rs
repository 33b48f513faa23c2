//! The numbers of an OBJ file: `v`, `vt` and `vn` lines.

use super::ObjError;
use super::lines::{logical_lines, number, shown, split_keyword, words};
use crate::Vec3;

/// All of them in file order, checked to be finite.
#[derive(Debug, Default)]
pub(super) struct Values {
    pub positions: Vec<Vec3>,
    pub uvs: Vec<[f64; 2]>,
    pub normals: Vec<Vec3>,
}

impl Values {
    /// Further numbers on a line (weights, colours, a third texture coordinate) are passed over. A texture coordinate
    /// without `v` has `v = 0`, as the format defines.
    pub fn read(bytes: &[u8]) -> Result<Self, ObjError> {
        let mut values = Self::default();
        for (line, text) in logical_lines(bytes) {
            let (keyword, rest) = split_keyword(&text);
            match keyword {
                b"v" => {
                    let number = values.positions.len() + 1;
                    values.positions.push(Place { line, what: "vertex", number }.read(rest, 3)?.into());
                }
                b"vt" => {
                    let number = values.uvs.len() + 1;
                    let [u, v, _] = Place { line, what: "texture coordinate", number }.read(rest, 1)?;
                    values.uvs.push([u, v]);
                }
                b"vn" => {
                    let number = values.normals.len() + 1;
                    values.normals.push(Place { line, what: "normal", number }.read(rest, 3)?.into());
                }
                _ => {}
            }
        }
        let counts = [values.positions.len(), values.uvs.len(), values.normals.len()];
        for (what, count) in ["vertex", "texture coordinate", "normal"].into_iter().zip(counts) {
            // One number is spare: the stream for tobj marks "none" with it.
            if count >= u32::MAX as usize {
                return Err(ObjError::TooMany { what, count });
            }
        }
        Ok(values)
    }
}

#[derive(Clone, Copy)]
struct Place {
    line: usize,
    what: &'static str,
    number: usize,
}

impl Place {
    /// Up to three numbers, missing ones zero, at least `needed`.
    fn read(self, rest: &[u8], needed: usize) -> Result<[f64; 3], ObjError> {
        let Self { line, what, number: place } = self;
        let mut value = [0.0_f64; 3];
        let mut found = 0;
        for (slot, word) in value.iter_mut().zip(words(rest)) {
            *slot = number(word).ok_or_else(|| ObjError::NotANumber {
                line,
                what,
                number: place,
                found: shown(word),
            })?;
            found += 1;
        }
        if found < needed {
            return Err(ObjError::FewCoordinates { line, what, number: place, found, needed });
        }
        if !value.iter().all(|x| x.is_finite()) {
            return Err(ObjError::NotFinite { line, what, number: place, value: value[..found].to_vec() });
        }
        Ok(value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extra_numbers_are_passed_over_and_bad_ones_named() {
        let values =
            Values::read(b"v 1 2 3 0.5 0.5 0.5\nv 1e-3\t-.5 +2. # c\nvt 0.5\nvt 1 2 3\nvn 0 0 1\n").unwrap();
        assert_eq!(values.positions, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(1e-3, -0.5, 2.0)]);
        assert_eq!(values.uvs, [[0.5, 0.0], [1.0, 2.0]]);
        let message = |text: &[u8]| Values::read(text).unwrap_err().to_string();
        assert_eq!(message(b"\nv 1 2\n"), "line 2: vertex 1 has 2 coordinates; it needs 3");
        assert_eq!(
            message(b"vn 0 0 1,5"),
            "line 1: normal 1 has the coordinate \"1,5\", which is not a number"
        );
        assert_eq!(message(b"v 0 0 0\nv 0 nan 0"), "line 2: vertex 2 is not finite: [0.0, NaN, 0.0]");
        assert!(message(b"v \xff 0 0").contains("which is not a number"));
    }
}
