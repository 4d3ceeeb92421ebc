//! The elements of accessors, wherever they are.

use std::collections::HashMap;

use ::gltf::json::accessor::{Accessor, ComponentType, Type};
use ::gltf::json::buffer::View;
use ::gltf::json::validation::Checked;

use super::Package;
use super::value::{malformed, typed};
use crate::ReadFault;

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
