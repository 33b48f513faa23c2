//! The body of a PLY file as a sequence of numbers, in text or in binary.

use super::PlyError;
use super::header::Scalar;

/// Where a value is, for messages.
#[derive(Clone, Copy)]
pub(super) struct Place<'a> {
    pub element: &'a str,
    pub row: usize,
    pub property: &'a str,
}

impl Place<'_> {
    fn truncated(self) -> PlyError {
        PlyError::Truncated { element: self.element.into(), row: self.row, property: self.property.into() }
    }
}

/// A sequence of numbers in one of the encodings.
pub(super) trait Source {
    fn remaining(&self) -> usize;
    /// Bytes that a number takes at least.
    fn least_bytes(scalar: Scalar) -> usize;
    fn number(&mut self, scalar: Scalar, place: Place<'_>) -> Result<f64, PlyError>;
    /// Passes over rows of a known size, if the encoding allows it.
    fn skip(&mut self, bytes: u64) -> bool;
    fn end_row(&mut self, element: &str, row: usize) -> Result<(), PlyError>;
}

/// Numbers in one of the binary encodings.
pub(super) struct Binary<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
}

impl<'a> Binary<'a> {
    pub(super) fn new(bytes: &'a [u8], little: bool) -> Self {
        Self { bytes, at: 0, little }
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes: [u8; N] = self.bytes.get(self.at..)?.get(..N)?.try_into().ok()?;
        self.at += N;
        if !self.little {
            bytes.reverse();
        }
        Some(bytes)
    }
}

impl Source for Binary<'_> {
    fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn least_bytes(scalar: Scalar) -> usize {
        scalar.bytes()
    }

    fn number(&mut self, scalar: Scalar, place: Place<'_>) -> Result<f64, PlyError> {
        let value = match scalar {
            Scalar::I8 => self.take().map(i8::from_le_bytes).map(f64::from),
            Scalar::U8 => self.take().map(u8::from_le_bytes).map(f64::from),
            Scalar::I16 => self.take().map(i16::from_le_bytes).map(f64::from),
            Scalar::U16 => self.take().map(u16::from_le_bytes).map(f64::from),
            Scalar::I32 => self.take().map(i32::from_le_bytes).map(f64::from),
            Scalar::U32 => self.take().map(u32::from_le_bytes).map(f64::from),
            Scalar::F32 => self.take().map(f32::from_le_bytes).map(f64::from),
            Scalar::F64 => self.take().map(f64::from_le_bytes),
        };
        value.ok_or_else(|| place.truncated())
    }

    fn skip(&mut self, bytes: u64) -> bool {
        match usize::try_from(bytes) {
            Ok(n) if n <= self.remaining() => {
                self.at += n;
                true
            }
            _ => false,
        }
    }

    fn end_row(&mut self, _element: &str, _row: usize) -> Result<(), PlyError> {
        Ok(())
    }
}

/// Numbers between white space. A row may run over several lines, as other readers allow, but a line may not go on after
/// the end of its row: that way a missing or extra value is noticed where it is.
pub(super) struct Ascii<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Ascii<'a> {
    /// `line` is the number of the first line, for messages.
    pub(super) fn new(bytes: &'a [u8], line: usize) -> Self {
        Self { bytes, at: 0, line }
    }

    fn skip_blanks(&mut self, also: impl Fn(u8) -> bool) {
        while let Some(&byte) = self.bytes.get(self.at) {
            if !(byte == b' ' || byte == b'\t' || byte == b'\r' || also(byte)) {
                return;
            }
            self.line += usize::from(byte == b'\n');
            self.at += 1;
        }
    }
}

impl Source for Ascii<'_> {
    fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    fn least_bytes(_scalar: Scalar) -> usize {
        2
    }

    fn number(&mut self, _scalar: Scalar, place: Place<'_>) -> Result<f64, PlyError> {
        self.skip_blanks(|b| b == b'\n');
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        if length == 0 && rest.is_empty() {
            return Err(place.truncated());
        }
        let word = &rest[..length];
        let value = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        self.at += length;
        value.ok_or_else(|| PlyError::NotANumber {
            line: self.line,
            element: place.element.into(),
            row: place.row,
            property: place.property.into(),
            found: String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned(),
        })
    }

    fn skip(&mut self, _bytes: u64) -> bool {
        false
    }

    fn end_row(&mut self, element: &str, row: usize) -> Result<(), PlyError> {
        self.skip_blanks(|_| false);
        match self.bytes.get(self.at) {
            None | Some(b'\n') => Ok(()),
            Some(_) => Err(PlyError::ExtraValues { line: self.line, element: element.into(), row }),
        }
    }
}
