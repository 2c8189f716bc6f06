//! Accessors (glTF 2.0, section 3.6.2) as checked, lazily read arrays.
//!
//! Making one is cheap and allocates nothing; once made, every element named
//! by an index below `count` can be read.

use busbar_geometry::NO_FEATURE;

use crate::buffers::{Buffers, View, range};
use crate::error::{ImportError, ImportFault};
use crate::scalars::Whole;
use crate::schema::{self, ComponentType, Shape};

/// Elements at equal distances, all within the bytes.
#[derive(Clone, Copy)]
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

/// Replaced elements, by increasing index.
#[derive(Clone, Copy)]
struct Sparse<'a> {
    indices: Elements<'a>,
    index_type: ComponentType,
    values: Elements<'a>,
}

/// Identity of an accessor's data: that of the file, or an attribute of the compressed mesh in a
/// view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum AccessorKey {
    File(usize),
    Draco { view: usize, attribute: Option<usize> },
}

/// Accessor whose ranges were checked.
#[derive(Clone, Copy)]
pub(crate) struct Accessor<'a> {
    pub(crate) index: usize,
    /// Identity of the data behind it.
    pub(crate) key: AccessorKey,
    pub(crate) count: usize,
    pub(crate) component_type: ComponentType,
    pub(crate) normalized: bool,
    pub(crate) shape: Shape,
    /// Zeros where there is none.
    base: Option<Elements<'a>>,
    sparse: Option<Sparse<'a>>,
}

impl<'a> Elements<'a> {
    fn new(
        view: View<'a>,
        offset: u64,
        count: u64,
        size: usize,
        place: impl Fn() -> String,
    ) -> Result<Self, ImportError> {
        let stride = view.stride.unwrap_or(size);
        if stride < size {
            let fault = format!("elements of {size} bytes overlap at a stride of {stride}");
            return Err(ImportFault::Invalid(fault).at(place()));
        }
        let length = match count.checked_sub(1) {
            None => 0,
            Some(last) => last.saturating_mul(stride as u64).saturating_add(size as u64),
        };
        let bytes = range(view.bytes, offset, length, "the data", place)?;
        // `count` is at most the bytes there are.
        Ok(Self { bytes, stride, size, count: count as usize })
    }

    fn get(&self, index: usize) -> &'a [u8] {
        let start = index * self.stride;
        &self.bytes[start..start + self.size]
    }

    fn iter(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let elements = *self;
        (0..elements.count).map(move |index| elements.get(index))
    }
}

impl<'a> Accessor<'a> {
    /// Checks that all bytes are there; `named_by` says who names the accessor.
    pub(crate) fn new(
        buffers: &'a Buffers<'_>,
        index: usize,
        named_by: impl FnOnce() -> String,
    ) -> Result<Self, ImportError> {
        let accessor: schema::Accessor<'_> = buffers.document().accessors.parse(index, named_by)?;
        let here = |field: &str| format!("/accessors/{index}{field}");
        let invalid =
            |field: &str, what: &str| ImportFault::Invalid(what.to_owned()).at(here(field));
        let component_type = ComponentType::from_code(accessor.component_type)
            .ok_or_else(|| invalid("/componentType", "unknown component type"))?;
        let shape = accessor.shape.as_deref().and_then(Shape::from_name);
        let shape = shape.ok_or_else(|| invalid("/type", "unknown accessor type"))?;
        let size = component_type.size() * shape.components();
        let count = accessor.count.0.into();
        let base = match accessor.buffer_view {
            None => None,
            Some(view) => {
                let view = buffers.view(view.index(), || here("/bufferView"))?;
                let offset = accessor.byte_offset.unwrap_or_default().0.into();
                Some(Elements::new(view, offset, count, size, || here(""))?)
            }
        };
        let sparse = match &accessor.sparse {
            None => None,
            Some(sparse) => Some(Sparse::new(buffers, sparse, count, size, here)?),
        };
        let (count, normalized) = (accessor.count.index(), accessor.normalized.0);
        let key = AccessorKey::File(index);
        Ok(Self { index, key, count, component_type, normalized, shape, base, sparse })
    }

    /// Makes an accessor of packed values; `json` gives shape and use.
    pub(crate) fn packed(
        json: (usize, &schema::Accessor<'_>),
        key: AccessorKey,
        component_type: ComponentType,
        components: usize,
        values: &'a [u8],
    ) -> Option<Self> {
        let (index, json) = json;
        let shape = json.shape.as_deref().and_then(Shape::from_name)?;
        let size = component_type.size() * components;
        if shape.components() != components || size == 0 {
            return None;
        }
        let count = values.len() / size;
        let base = Some(Elements { bytes: values, stride: size, size, count });
        let normalized = json.normalized.0;
        Some(Self { index, key, count, component_type, normalized, shape, base, sparse: None })
    }

    /// Reads integers as shares of their largest value, whatever the file says.
    pub(crate) fn into_normalized(self) -> Self {
        Self { normalized: true, ..self }
    }

    /// Reads integers as they are, whatever the file says.
    pub(crate) fn into_whole(self) -> Self {
        Self { normalized: false, ..self }
    }

    /// Makes an accessor of the corners of a compressed mesh.
    pub(crate) fn corners(view: usize, values: &'a [u8]) -> Self {
        let count = values.len() / size_of::<u32>();
        let size = size_of::<u32>();
        Self {
            index: 0,
            key: AccessorKey::Draco { view, attribute: None },
            count,
            component_type: ComponentType::U32,
            normalized: false,
            shape: Shape::Scalar,
            base: Some(Elements { bytes: values, stride: size, size, count }),
            sparse: None,
        }
    }

    /// Returns how many elements a pass over all stored bytes visits.
    pub(crate) fn stored_elements(&self) -> u64 {
        let base = self.base.map_or(0, |b| b.count as u64);
        base + self.sparse.map_or(0, |s| s.values.count as u64)
    }

    /// Checks that sparse indices increase and stay within the count.
    pub(crate) fn check_sparse(&self) -> Result<(), ImportError> {
        let Some(sparse) = &self.sparse else {
            return Ok(());
        };
        let mut next = 0;
        for bytes in sparse.indices.iter() {
            let index = read_index(bytes, sparse.index_type) as usize;
            if index < next || index >= self.count {
                let what = format!("sparse index {index} is out of order or beyond {}", self.count);
                let place = format!("/accessors/{}/sparse/indices", self.index);
                return Err(ImportFault::Invalid(what).at(place));
            }
            next = index + 1;
        }
        Ok(())
    }

    /// Returns the largest index stored, and the largest one beside `restart`; 0 where none is.
    pub(crate) fn largest_indices(&self, restart: u32) -> [u32; 2] {
        if let Some(base) = self.plain(ComponentType::U32) {
            return largest(base.iter().map(plain_index), restart);
        }
        let stored = self.base.iter().chain(self.sparse.iter().map(|s| &s.values));
        let indices = stored.flat_map(Elements::iter);
        largest(indices.map(|b| read_index(b, self.component_type)), restart)
    }

    /// Finds the first stored element that `accept` refuses, by its place in the data.
    pub(crate) fn find_refused<const N: usize>(
        &self,
        accept: impl Fn([f32; N]) -> bool,
    ) -> Option<usize> {
        if let Some(base) = self.plain(ComponentType::F32) {
            return base.iter().position(|bytes| !accept(plain_floats(bytes)));
        }
        let stored = self.base.iter().chain(self.sparse.iter().map(|s| &s.values));
        stored.flat_map(Elements::iter).position(|bytes| !accept(self.decode(bytes)))
    }

    /// Finds the first stored feature id that `accept` refuses, by its place in the data. Invalid
    /// ids are passed as `None`.
    pub(crate) fn find_refused_id(&self, accept: impl Fn(Option<u32>) -> bool) -> Option<usize> {
        let stored = self.base.iter().chain(self.sparse.iter().map(|s| &s.values));
        let mut ids = stored.flat_map(Elements::iter).map(|b| read_id(b, self.component_type));
        ids.position(|id| !accept(id))
    }

    /// Reads a feature id (`SCALAR`); `None` for an invalid one.
    pub(crate) fn id_at(&self, element: usize) -> Option<u32> {
        self.element(element).map_or(Some(0), |bytes| read_id(bytes, self.component_type))
    }

    /// Reads an index element (`SCALAR`, unsigned).
    pub(crate) fn index_at(&self, element: usize) -> u32 {
        self.element(element).map_or(0, |bytes| read_index(bytes, self.component_type))
    }

    /// Reads the index elements of triangles, by the places of their corners.
    pub(crate) fn triangles(&self, places: impl Iterator<Item = [usize; 3]>) -> Vec<[u32; 3]> {
        match self.plain(ComponentType::U32) {
            Some(base) => {
                places.map(|corners| corners.map(|place| plain_index(base.get(place)))).collect()
            }
            None => places.map(|corners| corners.map(|place| self.index_at(place))).collect(),
        }
    }

    /// Reads the first `N` components of elements, as floats.
    pub(crate) fn floats<const N: usize, T>(
        &self,
        elements: impl Iterator<Item = usize>,
        make: impl Fn([f32; N]) -> T,
    ) -> Vec<T> {
        // One way for what files mostly hold, without a question an element.
        match self.plain(ComponentType::F32) {
            Some(base) => elements.map(|e| make(plain_floats(base.get(e)))).collect(),
            None => elements.map(|e| make(self.floats_at(e))).collect(),
        }
    }

    pub(crate) fn floats_at<const N: usize>(&self, element: usize) -> [f32; N] {
        self.element(element).map_or([0.0; N], |bytes| self.decode(bytes))
    }

    /// Returns the elements, where they are of this type and none is replaced.
    fn plain(&self, component_type: ComponentType) -> Option<Elements<'a>> {
        self.base.filter(|_| self.sparse.is_none() && self.component_type == component_type)
    }

    fn element(&self, element: usize) -> Option<&'a [u8]> {
        if let Some(sparse) = &self.sparse
            && let Some(replaced) = sparse.find(element)
        {
            return Some(replaced);
        }
        self.base.map(|base| base.get(element))
    }

    fn decode<const N: usize>(&self, bytes: &[u8]) -> [f32; N] {
        let size = self.component_type.size();
        std::array::from_fn(|i| match bytes.get(i * size..(i + 1) * size) {
            Some(component) => read_float(component, self.component_type, self.normalized),
            None => 0.0,
        })
    }
}

impl<'a> Sparse<'a> {
    fn new(
        buffers: &'a Buffers<'_>,
        sparse: &schema::Sparse,
        count: u64,
        size: usize,
        accessor: impl Fn(&str) -> String,
    ) -> Result<Self, ImportError> {
        let here = |field: &str| accessor(&format!("/sparse{field}"));
        let index_type = ComponentType::from_code(sparse.indices.component_type);
        let unsigned = |of: &ComponentType| {
            matches!(of, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
        };
        let Some(index_type) = index_type.filter(unsigned) else {
            let fault = ImportFault::Invalid("unknown component type".into());
            return Err(fault.at(here("/indices/componentType")));
        };
        let replaced = sparse.count.0.into();
        if replaced > count {
            let what = format!("{replaced} of {count} elements replaced");
            return Err(ImportFault::Invalid(what).at(here("/count")));
        }
        let elements = |view: Whole, offset: Option<Whole>, size, field: &'static str| {
            let view = buffers.view(view.index(), || here(&format!("{field}/bufferView")))?;
            let view = View { stride: None, ..view };
            let offset = offset.unwrap_or_default().0.into();
            Elements::new(view, offset, replaced, size, || here(field))
        };
        let (indices, values) = (&sparse.indices, &sparse.values);
        Ok(Self {
            indices: elements(
                indices.buffer_view,
                indices.byte_offset,
                index_type.size(),
                "/indices",
            )?,
            index_type,
            values: elements(values.buffer_view, values.byte_offset, size, "/values")?,
        })
    }

    fn find(&self, element: usize) -> Option<&'a [u8]> {
        let (mut low, mut high) = (0, self.indices.count);
        while low < high {
            let middle = (low + high) / 2;
            let index = read_index(self.indices.get(middle), self.index_type) as usize;
            match index.cmp(&element) {
                std::cmp::Ordering::Equal => return Some(self.values.get(middle)),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        None
    }
}

/// Returns the largest index, and the largest one beside `restart`.
fn largest(indices: impl Iterator<Item = u32>, restart: u32) -> [u32; 2] {
    indices.fold([0, 0], |[all, usual], index| {
        let other = if index == restart { 0 } else { index };
        [all.max(index), usual.max(other)]
    })
}

fn plain_index(bytes: &[u8]) -> u32 {
    bytes.first_chunk().map_or(u32::MAX, |&bytes| u32::from_le_bytes(bytes))
}

fn plain_floats<const N: usize>(bytes: &[u8]) -> [f32; N] {
    let (components, _) = bytes.as_chunks::<4>();
    std::array::from_fn(|i| components.get(i).map_or(0.0, |&bytes| f32::from_le_bytes(bytes)))
}

fn read_index(bytes: &[u8], component_type: ComponentType) -> u32 {
    match (component_type, bytes) {
        (ComponentType::U8, &[a, ..]) => a.into(),
        (ComponentType::U16, &[a, b, ..]) => u16::from_le_bytes([a, b]).into(),
        (ComponentType::U32, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]),
        _ => u32::MAX,
    }
}

/// Reads a whole number that a feature may have: floats represent those up to 2^24 exactly.
fn read_id(bytes: &[u8], component_type: ComponentType) -> Option<u32> {
    const LARGEST_FLOAT: f32 = 16_777_216.0;
    if component_type != ComponentType::F32 {
        return Some(read_index(bytes, component_type)).filter(|&id| id != NO_FEATURE);
    }
    let id = read_float(bytes, component_type, false);
    (id.fract() == 0.0 && (0.0..=LARGEST_FLOAT).contains(&id)).then_some(id as u32)
}

/// Reads one component as a float (glTF 2.0, section 3.6.2.2 for normalised ones).
fn read_float(bytes: &[u8], component_type: ComponentType, normalized: bool) -> f32 {
    let (value, largest) = match (component_type, bytes) {
        (ComponentType::I8, &[a]) => (f32::from(a as i8), 127.0),
        (ComponentType::U8, &[a]) => (f32::from(a), 255.0),
        (ComponentType::I16, &[a, b]) => (f32::from(i16::from_le_bytes([a, b])), 32_767.0),
        (ComponentType::U16, &[a, b]) => (f32::from(u16::from_le_bytes([a, b])), 65_535.0),
        (ComponentType::F32, &[a, b, c, d]) => return f32::from_le_bytes([a, b, c, d]),
        (ComponentType::U32, &[a, b, c, d]) => {
            (u32::from_le_bytes([a, b, c, d]) as f32, u32::MAX as f32)
        }
        _ => return f32::NAN,
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}
