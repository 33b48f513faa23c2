//! Accessors decoded to rows of numbers: any component type, normalised or not, interleaved, sparse.

use std::fmt;

use ::gltf::json::Index;
use ::gltf::json::accessor::{Accessor, ComponentType, Type};

use super::GltfError;
use super::file::{GltfFile, valid};

/// Where the rows of an accessor are and what they hold.
struct Layout<'a> {
    accessor: usize,
    count: usize,
    components: usize,
    component: ComponentType,
    normalized: bool,
    stride: usize,
    /// From the first row; `None` for zeros.
    data: Option<&'a [u8]>,
}

impl GltfFile<'_> {
    /// The rows of an accessor of `N` components, exact in `f64`; normalised integers become [0, 1] or [-1, 1].
    pub fn rows_f64<const N: usize>(
        &self,
        accessor: Index<Accessor>,
        place: &dyn fmt::Display,
    ) -> Result<Vec<[f64; N]>, GltfError> {
        let layout = self.layout(accessor, place)?;
        if layout.components != N {
            return Err(layout.type_error(self, accessor, &format!("{N} components")));
        }
        let row = |bytes: &[u8]| {
            let size = layout.component.size();
            std::array::from_fn(|i| to_f64(layout.component, layout.normalized, &bytes[i * size..]))
        };
        self.collect(accessor, &layout, [0.0; N], row)
    }

    /// As [`rows_f64`](Self::rows_f64), rounded to `f32`: float accessors keep their bits.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "float components are f32, and integers round to nearest"
    )]
    pub fn rows_f32<const N: usize>(
        &self,
        accessor: Index<Accessor>,
        place: &dyn fmt::Display,
    ) -> Result<Vec<[f32; N]>, GltfError> {
        Ok(self.rows_f64::<N>(accessor, place)?.into_iter().map(|row| row.map(|x| x as f32)).collect())
    }

    /// The values of a scalar accessor of unsigned bytes.
    pub fn rows_u8(&self, accessor: Index<Accessor>, place: &dyn fmt::Display) -> Result<Vec<u8>, GltfError> {
        let layout = self.layout(accessor, place)?;
        if layout.components != 1 || !matches!(layout.component, ComponentType::U8) {
            return Err(layout.type_error(self, accessor, "SCALAR of U8"));
        }
        self.collect(accessor, &layout, 0, |bytes| bytes[0])
    }

    /// The values of a scalar accessor of unsigned bytes, shorts or integers.
    pub fn indices(
        &self,
        accessor: Index<Accessor>,
        place: &dyn fmt::Display,
    ) -> Result<Vec<u32>, GltfError> {
        let layout = self.layout(accessor, place)?;
        let unsigned =
            matches!(layout.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if layout.components != 1 || !unsigned {
            return Err(layout.type_error(self, accessor, "SCALAR of U8, U16 or U32"));
        }
        self.collect(accessor, &layout, 0, |bytes| to_u32(layout.component, bytes))
    }

    fn layout(&self, index: Index<Accessor>, place: &dyn fmt::Display) -> Result<Layout<'_>, GltfError> {
        let accessor = index.value();
        let json = self.accessor(index, place)?;
        let here = format!("accessors[{accessor}]");
        let component = valid(&json.component_type, "componentType", &here)?.0;
        let components = valid(&json.type_, "type", &here)?.multiplicity();
        let row = component.size() * components;
        let mut layout = Layout {
            accessor,
            count: 0,
            components,
            component,
            normalized: json.normalized,
            stride: row,
            data: None,
        };
        if let Some(view) = json.buffer_view {
            let span =
                Span { view, offset: json.byte_offset.unwrap_or_default().0, count: json.count.0, row };
            (layout.data, layout.stride, layout.count) = self.span(accessor, &span, &here)?;
            return Ok(layout);
        }
        if json.sparse.is_none() {
            return Err(GltfError::NoData { accessor, hint: self.compression_hint() });
        }
        // Zeros take no room in the file, so their number is bounded by that of what does.
        let bytes = self.source_bytes();
        let count = usize::try_from(json.count.0).ok().filter(|&n| n <= bytes.max(1 << 16));
        layout.count = count.ok_or(GltfError::TooManyZeros { accessor, count: json.count.0, bytes })?;
        Ok(layout)
    }

    fn compression_hint(&self) -> String {
        let compression =
            self.root.extensions_used.iter().find(|e| e.contains("draco") || e.contains("meshopt"));
        compression.map_or_else(String::new, |extension| {
            format!("; the file uses the extension {extension}, which cannot be read: save it without")
        })
    }

    /// The bytes from the first row on, the stride and the row count, all checked against the view.
    fn span(
        &self,
        accessor: usize,
        span: &Span,
        place: &dyn fmt::Display,
    ) -> Result<(Option<&[u8]>, usize, usize), GltfError> {
        let (bytes, stride) = self.view(span.view, place)?;
        let stride = if stride == 0 { span.row } else { stride };
        let bad = || GltfError::BadAccessor {
            accessor,
            count: span.count,
            row: span.row,
            stride,
            offset: span.offset,
            view: span.view.value(),
            bytes: bytes.len(),
        };
        let count = usize::try_from(span.count).map_err(|_| bad())?;
        let offset = usize::try_from(span.offset).map_err(|_| bad())?;
        let needed = match count {
            0 => 0,
            _ => stride.checked_mul(count - 1).and_then(|n| n.checked_add(span.row)).ok_or_else(bad)?,
        };
        let data =
            bytes.get(offset..).filter(|data| data.len() >= needed && stride >= span.row).ok_or_else(bad)?;
        Ok((Some(data), stride, count))
    }

    fn collect<T: Clone>(
        &self,
        index: Index<Accessor>,
        layout: &Layout<'_>,
        zero: T,
        row: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, GltfError> {
        let mut rows = match layout.data {
            None => vec![zero; layout.count],
            Some(data) => (0..layout.count).map(|i| row(&data[i * layout.stride..])).collect(),
        };
        self.apply_sparse(index, layout, &mut rows, row)?;
        Ok(rows)
    }

    fn apply_sparse<T>(
        &self,
        index: Index<Accessor>,
        layout: &Layout<'_>,
        rows: &mut [T],
        row: impl Fn(&[u8]) -> T,
    ) -> Result<(), GltfError> {
        let accessor = layout.accessor;
        let here = format!("accessors[{accessor}].sparse");
        let Some(sparse) = &self.accessor(index, &here)?.sparse else { return Ok(()) };
        let component = valid(&sparse.indices.component_type, "indices.componentType", &here)?.0;
        let place = &sparse.indices;
        let (offset, count) = (place.byte_offset.0, sparse.count.0);
        let span = Span { view: place.buffer_view, offset, count, row: component.size() };
        let (indices, index_stride, count) = self.span(accessor, &span, &here)?;
        let size = layout.component.size() * layout.components;
        let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset.0);
        let span = Span { view, offset, count: sparse.count.0, row: size };
        let (values, value_stride, _) = self.span(accessor, &span, &here)?;
        let (indices, values) = (indices.unwrap_or_default(), values.unwrap_or_default());
        for number in 0..count {
            let target = to_u32(component, &indices[number * index_stride..]);
            let count = rows.len();
            let Some(slot) = rows.get_mut(target as usize) else {
                return Err(GltfError::SparseIndex { accessor, number, row: u64::from(target), count });
            };
            *slot = row(&values[number * value_stride..]);
        }
        Ok(())
    }
}

/// Rows that an accessor claims to be in a view.
struct Span {
    view: Index<::gltf::json::buffer::View>,
    offset: u64,
    count: u64,
    /// Bytes of a row.
    row: usize,
}

impl Layout<'_> {
    fn type_error(&self, file: &GltfFile<'_>, index: Index<Accessor>, expected: &str) -> GltfError {
        let type_ = file.accessor(index, &"").and_then(|a| valid(&a.type_, "type", &""));
        let type_ = match type_ {
            Ok(Type::Scalar) => "SCALAR",
            Ok(Type::Vec2) => "VEC2",
            Ok(Type::Vec3) => "VEC3",
            Ok(Type::Vec4) => "VEC4",
            Ok(Type::Mat2 | Type::Mat3 | Type::Mat4) | Err(_) => "MAT",
        };
        let found = format!("{type_} of {:?}", self.component);
        GltfError::AccessorType { accessor: self.accessor, found, expected: expected.into() }
    }
}

fn bytes<const N: usize>(data: &[u8]) -> [u8; N] {
    data[..N].try_into().expect("a slice of N bytes is an array of N bytes")
}

/// glTF 2.0 section 3.6.2.2 and `KHR_mesh_quantization`: signed values clamp, so that both -128 and -127 are -1.
fn to_f64(component: ComponentType, normalized: bool, data: &[u8]) -> f64 {
    let (value, largest) = match component {
        ComponentType::I8 => (f64::from(i8::from_le_bytes(bytes(data))), f64::from(i8::MAX)),
        ComponentType::U8 => (f64::from(data[0]), f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(i16::from_le_bytes(bytes(data))), f64::from(i16::MAX)),
        ComponentType::U16 => (f64::from(u16::from_le_bytes(bytes(data))), f64::from(u16::MAX)),
        ComponentType::U32 => (f64::from(u32::from_le_bytes(bytes(data))), f64::from(u32::MAX)),
        ComponentType::F32 => return f64::from(f32::from_le_bytes(bytes(data))),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

fn to_u32(component: ComponentType, data: &[u8]) -> u32 {
    match component.size() {
        1 => u32::from(data[0]),
        2 => u32::from(u16::from_le_bytes(bytes(data))),
        _ => u32::from_le_bytes(bytes(data)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::no_files;

    /// A file with one 40-byte buffer of counting bytes, two views and the given accessors.
    fn file(accessors: &str) -> GltfFile<'static> {
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":40,"uri":"data:,{}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":40}},{{"buffer":0,"byteOffset":4,"byteLength":36,"byteStride":8}}],
            "accessors":[{accessors}]}}"#,
            (0..40).map(|i| format!("%{i:02x}")).collect::<String>()
        );
        GltfFile::parse(json.leak().as_bytes(), &no_files).unwrap()
    }

    fn first<const N: usize>(accessor: &str) -> Result<Vec<[f64; N]>, GltfError> {
        file(accessor).rows_f64(Index::new(0), &"here")
    }

    #[test]
    fn strides_offsets_and_normalisation() {
        let strided = r#"{"bufferView":1,"byteOffset":1,"componentType":5121,"count":4,"type":"VEC2"}"#;
        assert_eq!(first::<2>(strided).unwrap(), [[5.0, 6.0], [13.0, 14.0], [21.0, 22.0], [29.0, 30.0]]);
        let unit = r#"{"bufferView":0,"componentType":5121,"normalized":true,"count":2,"type":"VEC3"}"#;
        assert_eq!(first::<3>(unit).unwrap()[1], [3.0 / 255.0, 4.0 / 255.0, 5.0 / 255.0]);
        let short = r#"{"bufferView":0,"componentType":5122,"count":1,"type":"SCALAR"}"#;
        assert_eq!(first::<1>(short).unwrap(), [[256.0]]);
        assert_eq!(to_f64(ComponentType::I8, true, &[0x80]), -1.0);
        assert_eq!(to_f64(ComponentType::I16, true, &[0xff, 0x7f]), 1.0);
        assert_eq!(to_f64(ComponentType::I16, false, &[0xfe, 0xff]), -2.0);
    }

    #[test]
    fn sparse_values_replace_rows_or_zeros() {
        let zeros = r#"{"componentType":5121,"count":5,"type":"SCALAR","sparse":{"count":2,
            "indices":{"bufferView":0,"byteOffset":1,"componentType":5121},"values":{"bufferView":0,"byteOffset":30}}}"#;
        assert_eq!(file(zeros).rows_u8(Index::new(0), &"").unwrap(), [0, 30, 31, 0, 0]);
        let based = zeros.replace(
            "{\"componentType\":5121,\"count\":5",
            "{\"bufferView\":0,\"componentType\":5121,\"count\":5",
        );
        assert_eq!(file(&based).rows_u8(Index::new(0), &"").unwrap(), [0, 30, 31, 3, 4]);
        let beyond = zeros.replace("\"byteOffset\":1,", "\"byteOffset\":4,");
        let error = file(&beyond).rows_u8(Index::new(0), &"").unwrap_err().to_string();
        assert_eq!(error, "accessor 0: sparse value 1 is for row 5 of 5");
        let huge = zeros.replace("\"count\":5", "\"count\":9000000000000");
        let error = file(&huge).rows_u8(Index::new(0), &"").unwrap_err().to_string();
        assert!(error.contains("9000000000000 rows that are stored nowhere"), "{error}");
    }

    #[test]
    fn what_does_not_fit_is_named() {
        let message = |accessor: &str| first::<3>(accessor).unwrap_err().to_string();
        let long = r#"{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}"#;
        assert_eq!(
            message(long),
            "accessor 0 takes 4 rows of 12 bytes, one every 12, from byte 0 of buffer view 0, which has 40"
        );
        assert!(message(&long.replace(":4", ":18446744073709551615")).contains("18446744073709551615 rows"));
        assert!(message(&long.replace("5126", "5127")).contains("accessors[0] has no valid componentType"));
        assert_eq!(
            message(&long.replace("VEC3", "VEC2")),
            "accessor 0 is VEC2 of F32; expected 3 components"
        );
        assert!(message(&long.replace("w\":0", "w\":2")).contains("accessors[0] names buffer view 2 of 2"));
        let narrow = r#"{"bufferView":1,"componentType":5126,"count":1,"type":"VEC3"}"#;
        assert!(message(narrow).contains("one every 8"));
        assert_eq!(message(r#"{"componentType":5126,"count":1,"type":"VEC3"}"#), "accessor 0 has no data");
        let none = file("").rows_u8(Index::new(0), &"mesh 0").unwrap_err().to_string();
        assert_eq!(none, "mesh 0 names accessor 0 of 0");
    }
}
