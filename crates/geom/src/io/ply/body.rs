//! The numbers of a PLY file, as one column per property.
//!
//! Written here rather than taken from `ply-rs-bw`, which stores each row as a map from property names to values: columns
//! hold each number once, allow whole elements to be skipped, and tell the place of an error.

use super::PlyError;
use super::header::{ElementHeader, Encoding, Header, PropertyHeader, PropertyType, parse_header};
use super::source::{Ascii, Binary, Place, Source};
use crate::io::index_from_f64;

/// A parsed PLY file.
#[derive(Debug)]
pub(crate) struct Ply {
    /// Text of the `comment` and `obj_info` lines.
    pub comments: Vec<String>,
    elements: Vec<Element>,
}

/// One element, such as `vertex`, with the columns that were kept.
#[derive(Debug)]
pub(crate) struct Element {
    pub name: String,
    pub rows: usize,
    columns: Vec<(String, Column)>,
}

#[derive(Debug)]
enum Column {
    Skipped,
    Scalar(Vec<f64>),
    List(Lists),
}

/// The lists of one property, end to end.
#[derive(Debug, Default)]
pub(crate) struct Lists {
    entries: Vec<f64>,
    ends: Vec<usize>,
}

impl Ply {
    /// Parses the columns that `keep(element, property)` asks for; the others are passed over. Values of all types are
    /// exact in `f64`.
    pub fn parse(bytes: &[u8], keep: &dyn Fn(&str, &str) -> bool) -> Result<Self, PlyError> {
        let Header { encoding, elements: headers, comments, bytes: start, lines } = parse_header(bytes)?;
        let body = &bytes[start..];
        let mut elements = Vec::with_capacity(headers.len());
        match encoding {
            Encoding::Ascii => {
                let mut source = Ascii::new(body, lines + 1);
                for header in &headers {
                    elements.push(read_element(&mut source, header, keep)?);
                }
            }
            Encoding::LittleEndian | Encoding::BigEndian => {
                let mut source = Binary::new(body, encoding == Encoding::LittleEndian);
                for header in &headers {
                    elements.push(read_element(&mut source, header, keep)?);
                }
            }
        }
        Ok(Self { comments, elements })
    }

    /// The first element of this name.
    pub fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }
}

impl Element {
    /// The values of a kept scalar property, one per row.
    pub fn scalar(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find_map(|(n, column)| match column {
            Column::Scalar(values) if n == name => Some(&values[..]),
            _ => None,
        })
    }

    /// The lists of a kept list property, one per row.
    pub fn lists(&self, name: &str) -> Option<&Lists> {
        self.columns.iter().find_map(|(n, column)| match column {
            Column::List(lists) if n == name => Some(lists),
            _ => None,
        })
    }
}

impl Lists {
    /// In row order.
    pub fn iter(&self) -> impl Iterator<Item = &[f64]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| &self.entries[start..end])
    }

    /// The list of one row in range.
    pub fn row(&self, row: usize) -> &[f64] {
        let start = if row == 0 { 0 } else { self.ends[row - 1] };
        &self.entries[start..self.ends[row]]
    }
}

fn read_element<S: Source>(
    source: &mut S,
    header: &ElementHeader,
    keep: &dyn Fn(&str, &str) -> bool,
) -> Result<Element, PlyError> {
    let rows = check_rows::<S>(source, header)?;
    let mut columns: Vec<(String, Column)> = Vec::with_capacity(header.properties.len());
    for property in &header.properties {
        let column = match property.kind {
            _ if !keep(&header.name, &property.name) => Column::Skipped,
            PropertyType::Scalar(_) => Column::Scalar(Vec::with_capacity(rows)),
            PropertyType::List { .. } => Column::List(Lists::default()),
        };
        columns.push((property.name.clone(), column));
    }
    let all_skipped = columns.iter().all(|(_, c)| matches!(c, Column::Skipped));
    if header.properties.is_empty()
        || all_skipped && fixed_row_bytes(header).is_some_and(|row| source.skip(row * rows as u64))
    {
        return Ok(Element { name: header.name.clone(), rows, columns });
    }
    for row in 0..rows {
        for (property, (_, column)) in header.properties.iter().zip(&mut columns) {
            let place = Place { element: &header.name, row, property: &property.name };
            read_property(source, property.kind, column, place)?;
        }
        source.end_row(&header.name, row)?;
    }
    Ok(Element { name: header.name.clone(), rows, columns })
}

/// The row count, if the rest of the file can hold so many: nothing is allocated for a claim.
fn check_rows<S: Source>(source: &S, header: &ElementHeader) -> Result<usize, PlyError> {
    let row_bytes = |p: &PropertyHeader| match p.kind {
        PropertyType::Scalar(scalar) => S::least_bytes(scalar),
        PropertyType::List { length, .. } => S::least_bytes(length),
    };
    let least_row: usize = header.properties.iter().map(row_bytes).sum();
    let least = least_row as u128 * u128::from(header.rows);
    let remaining = source.remaining();
    // The last number of an ASCII file may lack the white space that is counted with it.
    match usize::try_from(header.rows) {
        Ok(rows) if least <= remaining as u128 + 1 => Ok(rows),
        _ => Err(PlyError::TooManyRows {
            line: header.line,
            element: header.name.clone(),
            rows: header.rows,
            least,
            remaining,
        }),
    }
}

fn fixed_row_bytes(header: &ElementHeader) -> Option<u64> {
    header.properties.iter().try_fold(0, |sum, p| match p.kind {
        PropertyType::Scalar(scalar) => Some(sum + scalar.bytes() as u64),
        PropertyType::List { .. } => None,
    })
}

fn read_property<S: Source>(
    source: &mut S,
    kind: PropertyType,
    column: &mut Column,
    place: Place<'_>,
) -> Result<(), PlyError> {
    let (length, entry) = match kind {
        PropertyType::Scalar(scalar) => {
            let value = source.number(scalar, place)?;
            if let Column::Scalar(values) = column {
                values.push(value);
            }
            return Ok(());
        }
        PropertyType::List { length, entry } => (length, entry),
    };
    let claimed = source.number(length, place)?;
    let remaining = source.remaining();
    let length = index_from_f64(claimed)
        .map(|n| n as usize)
        .filter(|&n| n.saturating_mul(S::least_bytes(entry)) <= remaining.saturating_add(1));
    let Some(length) = length else {
        return Err(PlyError::BadListLength {
            element: place.element.into(),
            row: place.row,
            property: place.property.into(),
            length: claimed,
            remaining,
        });
    };
    for _ in 0..length {
        let value = source.number(entry, place)?;
        if let Column::List(lists) = column {
            lists.entries.push(value);
        }
    }
    if let Column::List(lists) = column {
        lists.ends.push(lists.entries.len());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: &dyn Fn(&str, &str) -> bool = &|_, _| true;

    #[test]
    fn all_types_in_all_encodings() {
        let types = ["char", "uchar", "short", "ushort", "int", "uint", "float", "double"];
        let values = [-5.0, 200.0, -300.0, 60000.0, -70000.0, 4e9, 0.5, 0.1];
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let mut bytes =
                format!("ply\nformat {format} 1.0\nelement skip 2\nproperty float q\nelement t 1\n")
                    .into_bytes();
            for (i, ty) in types.iter().enumerate() {
                bytes.extend(format!("property {ty} p{i}\n").into_bytes());
            }
            bytes.extend(b"property list uchar double l\nend_header\n");
            let number = |value: f64, ty: &str| -> Vec<u8> {
                if format == "ascii" {
                    return format!("{value} ").into_bytes();
                }
                // All values are exact in these, so parsing their digits is the conversion.
                let digits = value.to_string();
                let mut le = match ty {
                    "char" => digits.parse::<i8>().unwrap().to_le_bytes().to_vec(),
                    "uchar" => digits.parse::<u8>().unwrap().to_le_bytes().to_vec(),
                    "short" => digits.parse::<i16>().unwrap().to_le_bytes().to_vec(),
                    "ushort" => digits.parse::<u16>().unwrap().to_le_bytes().to_vec(),
                    "int" => digits.parse::<i32>().unwrap().to_le_bytes().to_vec(),
                    "uint" => digits.parse::<u32>().unwrap().to_le_bytes().to_vec(),
                    "float" => digits.parse::<f32>().unwrap().to_le_bytes().to_vec(),
                    _ => value.to_le_bytes().to_vec(),
                };
                if format == "binary_big_endian" {
                    le.reverse();
                }
                le
            };
            let newline: &[u8] = if format == "ascii" { b"\n" } else { b"" };
            for _ in 0..2 {
                bytes.extend(number(9.0, "float"));
                bytes.extend(newline);
            }
            for (value, ty) in values.iter().zip(types) {
                bytes.extend(number(*value, ty));
            }
            bytes.extend(number(2.0, "uchar"));
            bytes.extend(number(0.1, "double"));
            bytes.extend(number(-7.25, "double"));
            let ply = Ply::parse(&bytes, &|element, _| element == "t").unwrap();
            let element = ply.element("t").unwrap();
            for (i, value) in values.iter().enumerate() {
                assert_eq!(element.scalar(&format!("p{i}")).unwrap(), [*value], "{format} {}", types[i]);
            }
            assert_eq!(element.lists("l").unwrap().row(0), [0.1, -7.25]);
            assert!(ply.element("skip").unwrap().scalar("q").is_none());
            for cut in 1..20 {
                assert!(
                    Ply::parse(&bytes[..bytes.len() - cut], ALL).is_err() || format == "ascii",
                    "{format} {cut}"
                );
            }
        }
    }

    #[test]
    fn claims_are_checked_before_anything_is_allocated() {
        let text = "ply\nformat binary_little_endian 1.0\nelement vertex 18446744073709551615\nproperty double x\nend_header\n12345678";
        let error = Ply::parse(text.as_bytes(), ALL).unwrap_err().to_string();
        assert!(error.starts_with("line 3: element \"vertex\" claims 18446744073709551615 rows"), "{error}");
        let list = b"ply\nformat binary_little_endian 1.0\nelement f 1\nproperty list uint int i\nend_header\n\xff\xff\xff\xff";
        let error = Ply::parse(list, ALL).unwrap_err().to_string();
        assert_eq!(error, "f 0: list \"i\" claims 4294967295 entries; only 0 bytes follow");
        let empty = b"ply\nformat ascii 1.0\nelement e 18446744073709551615\nend_header\n";
        assert_eq!(Ply::parse(empty, ALL).unwrap().elements.len(), 1);
    }

    #[test]
    fn lines_that_do_not_fit_their_row_are_named() {
        let text = |body: &str| {
            format!("ply\nformat ascii 1.0\nelement v 2\nproperty int a\nproperty int b\nend_header\n{body}")
        };
        let message = |body: &str| Ply::parse(text(body).as_bytes(), ALL).unwrap_err().to_string();
        assert!(message("1 2 3\n4 5\n").starts_with("line 7: v 0: the line has more values"));
        assert!(message("1\n2 3\n4\n").starts_with("line 8: v 0: the line has more values"));
        assert_eq!(message("1 2\n3 x4\n"), "line 8: v 1: property \"b\" is \"x4\", which is not a number");
        assert_eq!(message("1 2\n31\n"), "v 1: the file ends before property \"b\"; it may be cut off");
        assert!(Ply::parse(text("1\n2\r\n\n 3\t4").as_bytes(), ALL).is_ok());
    }
}
