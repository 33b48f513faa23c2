//! The header of a PLY file: encoding, and the elements with their properties.

use super::PlyError;

/// How numbers are written after the header.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// In a binary file.
    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// A number, or a list of numbers behind its length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PropertyType {
    Scalar(Scalar),
    List { length: Scalar, entry: Scalar },
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PropertyHeader {
    pub name: String,
    pub kind: PropertyType,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct ElementHeader {
    pub name: String,
    pub rows: u64,
    pub properties: Vec<PropertyHeader>,
    /// Where it is declared.
    pub line: usize,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<ElementHeader>,
    pub comments: Vec<String>,
    /// Where the body starts: bytes from the start of the file, and lines before it.
    pub bytes: usize,
    pub lines: usize,
}

/// Reads everything up to and with the `end_header` line.
pub(super) fn parse_header(bytes: &[u8]) -> Result<Header, PlyError> {
    let mut encoding = None;
    let mut elements: Vec<ElementHeader> = Vec::new();
    let mut comments = Vec::new();
    let mut at = 0;
    for line in 1.. {
        let Some(length) = bytes[at..].iter().position(|&b| b == b'\n') else {
            return Err(if line == 1 {
                not_ply(bytes)
            } else {
                PlyError::UnfinishedHeader { missing: "end_header" }
            });
        };
        let raw = &bytes[at..at + length];
        at += length + 1;
        let text = String::from_utf8_lossy(raw);
        let text = text.trim();
        if line == 1 {
            if text == "ply" {
                continue;
            }
            return Err(not_ply(raw));
        }
        let bad = |expected| PlyError::Header { line, expected, found: text.chars().take(80).collect() };
        let words: Vec<&str> = text.split_whitespace().collect();
        match words[..] {
            [] => {}
            ["comment" | "obj_info", ..] => {
                comments.push(text.split_once(char::is_whitespace).map_or("", |(_, c)| c).trim().to_owned());
            }
            ["format", name, "1.0"] => encoding = Some(parse_encoding(name).ok_or_else(|| bad(FORMAT))?),
            ["format", ..] => return Err(bad(FORMAT)),
            ["element", name, rows] => {
                let rows = rows.parse().map_err(|_| bad(ELEMENT))?;
                elements.push(ElementHeader { name: name.to_owned(), rows, properties: Vec::new(), line });
            }
            ["element", ..] => return Err(bad(ELEMENT)),
            ["property", ..] => {
                let property = parse_property(&words[1..]).ok_or_else(|| bad(PROPERTY))?;
                let element = elements.last_mut().ok_or_else(|| bad("an element before its properties"))?;
                element.properties.push(property);
            }
            ["end_header"] => {
                let encoding = encoding.ok_or(PlyError::UnfinishedHeader { missing: "format" })?;
                return Ok(Header { encoding, elements, comments, bytes: at, lines: line });
            }
            _ => return Err(bad("a header statement (format, comment, element, property, end_header)")),
        }
    }
    Err(PlyError::UnfinishedHeader { missing: "end_header" })
}

const FORMAT: &str = "format ascii, binary_little_endian or binary_big_endian, and 1.0";
const ELEMENT: &str = "element <name> <count>";
const PROPERTY: &str =
    "property <type> <name> or property list <type> <type> <name>, with types such as float or uchar";

fn parse_encoding(name: &str) -> Option<Encoding> {
    match name {
        "ascii" => Some(Encoding::Ascii),
        "binary_little_endian" => Some(Encoding::LittleEndian),
        "binary_big_endian" => Some(Encoding::BigEndian),
        _ => None,
    }
}

fn parse_property(words: &[&str]) -> Option<PropertyHeader> {
    let (name, kind) = match *words {
        ["list", length, entry, name] => {
            let length = Scalar::parse(length).filter(|s| !matches!(s, Scalar::F32 | Scalar::F64))?;
            (name, PropertyType::List { length, entry: Scalar::parse(entry)? })
        }
        [scalar, name] => (name, PropertyType::Scalar(Scalar::parse(scalar)?)),
        _ => return None,
    };
    Some(PropertyHeader { name: name.to_owned(), kind })
}

fn not_ply(start: &[u8]) -> PlyError {
    PlyError::NotPly { found: String::from_utf8_lossy(&start[..start.len().min(20)]).into_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_what_writers_write() {
        let text = "ply\r\nformat binary_big_endian 1.0\r\ncomment made  by hand\nobj_info x\nelement vertex 3\nproperty float32 x\n\nelement face 1\nproperty list uchar int vertex_indices\nend_header\nBODY";
        let header = parse_header(text.as_bytes()).unwrap();
        assert_eq!(header.encoding, Encoding::BigEndian);
        assert_eq!(header.comments, ["made  by hand", "x"]);
        assert_eq!(&text[header.bytes..], "BODY");
        assert_eq!(header.lines, 10);
        assert_eq!(header.elements[0].properties[0].kind, PropertyType::Scalar(Scalar::F32));
        let list = PropertyType::List { length: Scalar::U8, entry: Scalar::I32 };
        assert_eq!((header.elements[1].rows, header.elements[1].properties[0].kind), (1, list));
    }

    #[test]
    fn names_the_line_that_makes_no_sense() {
        let message = |text: &str| parse_header(text.as_bytes()).unwrap_err().to_string();
        assert_eq!(message("plx\n"), "line 1: expected \"ply\", found \"plx\"");
        assert!(message("ply\nformat ascii 2.0\n").starts_with("line 2: expected format ascii"));
        assert!(
            message("ply\nformat ascii 1.0\nelement vertex -1\n").ends_with("found \"element vertex -1\"")
        );
        assert!(message("ply\nproperty float x\n").starts_with("line 2: expected an element before"));
        assert!(
            message("ply\nelement a 1\nproperty list float int x\n").starts_with("line 3: expected property")
        );
        assert_eq!(
            message("ply\nend_header\n"),
            "the header has no \"format\" line; the file may be cut off"
        );
        assert!(message("ply\nformat ascii 1.0\n").contains("no \"end_header\" line"));
    }
}
