//! The elements of accessors, wherever they are.

use std::collections::HashMap;

use ::gltf::json::accessor::{Accessor, ComponentType, Type};
use ::gltf::json::buffer::View;
use ::gltf::json::validation::Checked;

use super::package::Package;
use super::value::{malformed, typed};
use crate::error::ReadFault;

/// An accessor, all of whose elements are known to be there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elements {
    pub component: ComponentType,
    pub kind: Type,
    pub normalized: bool,
    pub count: usize,
    /// Where the elements are in the buffer; without, all are zero.
    place: Option<Place>,
    /// Elements that are elsewhere.
    sparse: Option<Sparse>,
}

/// Where the first element is in the buffer, and how far the next is from it.
#[derive(Debug, Clone, Copy)]
struct Place {
    start: usize,
    stride: usize,
}

#[derive(Debug, Clone, Copy)]
struct Sparse {
    count: usize,
    /// Which elements are replaced: numbers of this type.
    index: ComponentType,
    indices: Place,
    values: Place,
}

/// The accessors of a document.
pub(super) struct Accessors<'a> {
    bin: &'a [u8],
    accessors: Vec<Accessor>,
    views: Vec<View>,
    checked: HashMap<usize, Elements>,
}

impl<'a> Accessors<'a> {
    /// Those of a document whose views are known to be within its buffer.
    pub fn of(package: &'a Package) -> Result<Self, ReadFault> {
        Ok(Self {
            bin: &package.bin,
            accessors: typed(&package.json, "accessors")?,
            views: typed(&package.json, "bufferViews")?,
            checked: HashMap::new(),
        })
    }

    pub fn count(&self) -> usize {
        self.accessors.len()
    }

    /// How many elements an accessor announces.
    pub fn announced(&self, index: usize) -> u64 {
        self.accessors[index].count.0
    }

    /// The elements of an accessor.
    pub fn elements(&mut self, index: usize) -> Result<Elements, ReadFault> {
        if let Some(elements) = self.checked.get(&index) {
            return Ok(*elements);
        }
        let elements = self
            .check(&self.accessors[index])
            .map_err(|problem| malformed(format!("accessor {index} {problem}")))?;
        self.checked.insert(index, elements);
        Ok(elements)
    }

    fn check(&self, accessor: &Accessor) -> Result<Elements, &'static str> {
        let Checked::Valid(component) = accessor.component_type else {
            return Err("is of an unknown component type");
        };
        let Checked::Valid(kind) = accessor.type_ else {
            return Err("is of an unknown type");
        };
        let count = usize::try_from(accessor.count.0).map_err(|_| TOO_FAR)?;
        let mut elements = Elements {
            component: component.0,
            kind,
            normalized: accessor.normalized,
            count,
            place: None,
            sparse: None,
        };
        if let Some(view) = accessor.buffer_view {
            let offset = accessor.byte_offset.map_or(0, |offset| offset.0);
            let view = self.view(view.value())?;
            let stride = view.byte_stride.map(|stride| stride.0).filter(|&s| s > 0);
            let stride = stride.unwrap_or(elements.tight_stride());
            elements.place = Some(within(view, offset, count, elements.size(), stride)?);
        }
        if let Some(sparse) = &accessor.sparse {
            let Checked::Valid(index) = sparse.indices.component_type else {
                return Err("has sparse indices of an unknown component type");
            };
            let (indices, values) = (&sparse.indices, &sparse.values);
            let replaced = sparse.count.0;
            if replaced > accessor.count.0 {
                return Err("replaces more elements than it has");
            }
            let replaced = replaced as usize;
            let size = index.0.size();
            let view = self.view(indices.buffer_view.value())?;
            let indices = within(view, indices.byte_offset.0, replaced, size, size)?;
            let (size, stride) = (elements.size(), elements.tight_stride());
            let view = self.view(values.buffer_view.value())?;
            let values = within(view, values.byte_offset.0, replaced, size, stride)?;
            let sparse = Sparse {
                count: replaced,
                index: index.0,
                indices,
                values,
            };
            if sparse.pairs(self.bin).any(|(index, _)| index >= count) {
                return Err("has a sparse index that is out of range");
            }
            elements.sparse = Some(sparse);
        }
        Ok(elements)
    }

    fn view(&self, index: usize) -> Result<&View, &'static str> {
        self.views
            .get(index)
            .ok_or("refers to a buffer view that does not exist")
    }
}

const TOO_FAR: &str = "reaches beyond its buffer view";

/// Where so many elements are in the buffer.
fn within(
    view: &View,
    offset: u64,
    count: usize,
    size: usize,
    stride: usize,
) -> Result<Place, &'static str> {
    if stride < size {
        return Err("has elements larger than their stride");
    }
    let length = match count {
        0 => Some(0),
        _ => (count - 1)
            .checked_mul(stride)
            .and_then(|l| l.checked_add(size)),
    };
    let end = length.and_then(|length| offset.checked_add(length as u64));
    if end.is_none_or(|end| end > view.byte_length.0) {
        return Err(TOO_FAR);
    }
    let start = view.byte_offset.map_or(0, |offset| offset.0) + offset;
    Ok(Place {
        start: start as usize,
        stride,
    })
}

impl Place {
    fn of(&self, index: usize) -> usize {
        self.start + index * self.stride
    }
}

impl Sparse {
    /// The replaced elements, and where their values are in the buffer.
    fn pairs<'a>(&'a self, bin: &'a [u8]) -> impl Iterator<Item = (usize, usize)> + 'a {
        (0..self.count).map(|k| {
            let index = unsigned(&bin[self.indices.of(k)..], self.index);
            (index as usize, self.values.of(k))
        })
    }
}

impl Elements {
    /// The bytes of one element, without the padding after the last column of a matrix.
    pub fn size(&self) -> usize {
        match (self.kind, self.component.size()) {
            (Type::Mat2, 1) => 6,
            (Type::Mat3, 1) => 11,
            (Type::Mat3, 2) => 22,
            (kind, size) => kind.multiplicity() * size,
        }
    }

    /// How far elements are apart if nothing else is said: columns of matrices start at
    /// multiples of four bytes.
    fn tight_stride(&self) -> usize {
        match self.kind {
            Type::Mat2 | Type::Mat3 => self.size().next_multiple_of(4),
            _ => self.size(),
        }
    }

    /// Whether all elements are zero since the accessor has no data.
    pub fn is_void(&self) -> bool {
        self.place.is_none() && self.sparse.is_none()
    }

    /// The bytes of all elements, without anything in between.
    pub fn bytes(&self, bin: &[u8]) -> Vec<u8> {
        let size = self.size();
        let mut bytes = match self.place {
            Some(place) => {
                let element = |k| &bin[place.of(k)..][..size];
                (0..self.count).flat_map(element).copied().collect()
            }
            None => vec![0; self.count * size],
        };
        for (index, at) in self.sparse.iter().flat_map(|sparse| sparse.pairs(bin)) {
            bytes[index * size..][..size].copy_from_slice(&bin[at..][..size]);
        }
        bytes
    }

    /// The elements as indices; the caller has checked that they are unsigned scalars.
    pub fn indices(&self, bin: &[u8]) -> Vec<u32> {
        let bytes = self.bytes(bin);
        let indices = bytes.chunks_exact(self.component.size());
        indices
            .map(|bytes| unsigned(bytes, self.component))
            .collect()
    }

    /// The first `N` components of each element; the caller has checked that there are as many.
    pub fn vectors<const N: usize>(&self, bin: &[u8]) -> Vec<[f64; N]> {
        let bytes = self.bytes(bin);
        let size = self.component.size();
        let vector = |element: &[u8]| {
            std::array::from_fn(|c| number(&element[c * size..], self.component, self.normalized))
        };
        bytes.chunks_exact(self.size()).map(vector).collect()
    }
}

/// The unsigned number at the start of `bytes`.
fn unsigned(bytes: &[u8], component: ComponentType) -> u32 {
    match component.size() {
        1 => bytes[0].into(),
        2 => u16::from_le_bytes([bytes[0], bytes[1]]).into(),
        _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
    }
}

/// The number at the start of `bytes`; normalized integers stand for those from −1 or 0 to 1.
fn number(bytes: &[u8], component: ComponentType, normalized: bool) -> f64 {
    let raw = unsigned(bytes, component);
    let (value, greatest) = match component {
        ComponentType::I8 => (f64::from(raw as i8), f64::from(i8::MAX)),
        ComponentType::U8 => (f64::from(raw), f64::from(u8::MAX)),
        ComponentType::I16 => (f64::from(raw as i16), f64::from(i16::MAX)),
        ComponentType::U16 => (f64::from(raw), f64::from(u16::MAX)),
        ComponentType::U32 => (f64::from(raw), f64::from(u32::MAX)),
        ComponentType::F32 => return f32::from_bits(raw).into(),
    };
    if normalized {
        (value / greatest).max(-1.0)
    } else {
        value
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn package(accessor: serde_json::Value) -> Package {
        Package {
            json: json!({
                "accessors": [accessor],
                "bufferViews": [
                    {"buffer": 0, "byteLength": 12},
                    {"buffer": 0, "byteOffset": 4, "byteLength": 8, "byteStride": 4},
                ],
            }),
            bin: vec![0x80, 0xff, 0x7f, 0, 1, 0, 2, 0, 3, 0, 4, 0],
        }
    }

    fn fault(accessor: serde_json::Value) -> String {
        let package = package(accessor);
        let checked = Accessors::of(&package).and_then(|mut accessors| accessors.elements(0));
        checked.unwrap_err().to_string()
    }

    fn elements(package: &Package) -> Elements {
        Accessors::of(package).unwrap().elements(0).unwrap()
    }

    #[test]
    fn normalized_integers_reach_from_minus_one_to_one() {
        let of = |component_type: u32, normalized: bool| {
            let package = package(json!({
                "bufferView": 0, "componentType": component_type, "type": "SCALAR",
                "count": 3, "normalized": normalized,
            }));
            let values = elements(&package).vectors::<1>(&package.bin);
            values.into_iter().flatten().collect::<Vec<_>>()
        };
        assert_eq!(of(5120, true), [-1.0, -1.0 / 127.0, 1.0]);
        assert_eq!(of(5120, false), [-128.0, -1.0, 127.0]);
        assert_eq!(of(5121, true), [128.0 / 255.0, 1.0, 127.0 / 255.0]);
        assert_eq!(of(5122, false), [-128.0, 127.0, 1.0]);
        assert_eq!(
            of(5123, true),
            [65408.0 / 65535.0, 127.0 / 65535.0, 1.0 / 65535.0]
        );
    }

    #[test]
    fn elements_are_strided_sparse_or_zero() {
        let bytes = |accessor| {
            let package = package(accessor);
            elements(&package).bytes(&package.bin)
        };
        let strided = json!({"bufferView": 1, "componentType": 5121, "type": "VEC2", "count": 2});
        assert_eq!(bytes(strided), [1, 0, 3, 0]);
        let sparse = json!({
            "componentType": 5123, "type": "SCALAR", "count": 4,
            "sparse": {
                "count": 2,
                "indices": {"bufferView": 1, "byteOffset": 2, "componentType": 5123},
                "values": {"bufferView": 0, "byteOffset": 4},
            },
        });
        assert_eq!(bytes(sparse), [0, 0, 0, 0, 1, 0, 2, 0]);
        assert_eq!(
            bytes(json!({"componentType": 5126, "type": "SCALAR", "count": 1})),
            [0; 4]
        );
        let columns = json!({"bufferView": 0, "componentType": 5121, "type": "MAT2", "count": 1});
        assert_eq!(bytes(columns), [0x80, 0xff, 0x7f, 0, 1, 0]);
    }

    #[test]
    fn accessors_stay_within_their_views() {
        let of = |view: u64, offset: u64, count: u64, component_type: u32| {
            fault(json!({
                "bufferView": view, "byteOffset": offset, "count": count,
                "componentType": component_type, "type": "SCALAR",
            }))
        };
        let beyond = "accessor 0 reaches beyond its buffer view";
        assert_eq!(of(0, 0, 4, 5126), beyond);
        assert_eq!(of(0, 1, 3, 5126), beyond);
        assert_eq!(of(1, 0, 3, 5121), beyond);
        assert_eq!(of(0, u64::MAX, 1, 5121), beyond);
        assert_eq!(of(0, 0, u64::MAX, 5126), beyond);
        assert_eq!(
            of(2, 0, 1, 5121),
            "accessor 0 refers to a buffer view that does not exist"
        );
        assert_eq!(
            of(0, 0, 1, 5124),
            "accessor 0 is of an unknown component type"
        );
        let wide = json!({"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": 1});
        assert_eq!(
            fault(wide),
            "accessor 0 has elements larger than their stride"
        );
        assert!(fault(json!({"count": 1})).starts_with("accessors[0]: missing field"));
    }

    #[test]
    fn sparse_elements_are_there() {
        let of = |count: u64, offset: u64, replaced: u64| {
            fault(json!({
                "componentType": 5121, "type": "SCALAR", "count": count,
                "sparse": {
                    "count": replaced,
                    "indices": {"bufferView": 0, "byteOffset": offset, "componentType": 5121},
                    "values": {"bufferView": 0},
                },
            }))
        };
        assert_eq!(
            of(100, 0, 2),
            "accessor 0 has a sparse index that is out of range"
        );
        assert_eq!(of(100, 4, 9), "accessor 0 reaches beyond its buffer view");
        assert_eq!(of(1, 4, 2), "accessor 0 replaces more elements than it has");
    }
}
