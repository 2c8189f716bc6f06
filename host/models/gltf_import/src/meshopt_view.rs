//! Views compressed by EXT_meshopt_compression and its successor KHR_meshopt_compression: vertex
//! codec, index codecs and filters of meshoptimizer.

use meshopt::FilterComponent;

use crate::error::ImportFault;
use crate::schema::MeshoptView;

/// Most bytes that one compressed byte stands for: the vertex codec leaves out a byte of 256
/// vertices by two bits.
const MAX_COMPRESSION: u64 = 1024;

/// Bytes that every stream takes: header and tail.
const MIN_STREAM: u64 = 64;

/// Largest distance of elements that the vertex codec knows, bytes.
const MAX_STRIDE: usize = 256;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Codec {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
    Color,
}

/// Codec and size of a compressed view, checked against each other.
pub(crate) struct Layout {
    codec: Codec,
    filter: Filter,
    count: usize,
    stride: usize,
}

impl Layout {
    pub(crate) fn new(view: &MeshoptView<'_>) -> Result<Self, ImportFault> {
        let codec = match view.mode.as_deref() {
            Some("ATTRIBUTES") => Codec::Attributes,
            Some("TRIANGLES") => Codec::Triangles,
            Some("INDICES") => Codec::Indices,
            _ => return Err(invalid("unknown mode of compression")),
        };
        let filter = match view.filter.as_deref() {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some("COLOR") => Filter::Color,
            Some(_) => return Err(invalid("unknown filter of compression")),
        };
        let (count, stride) = (view.count.index(), view.byte_stride.index());
        let fits = match (codec, filter) {
            (Codec::Attributes, Filter::None | Filter::Exponential) => {
                stride.is_multiple_of(4) && (4..=MAX_STRIDE).contains(&stride)
            }
            (Codec::Attributes, Filter::Octahedral | Filter::Color) => stride == 4 || stride == 8,
            (Codec::Attributes, Filter::Quaternion) => stride == 8,
            (Codec::Triangles, Filter::None) => {
                count.is_multiple_of(3) && (stride == 2 || stride == 4)
            }
            (Codec::Indices, Filter::None) => stride == 2 || stride == 4,
            _ => false,
        };
        match fits {
            true => Ok(Self { codec, filter, count, stride }),
            false => Err(invalid("mode, filter, stride and count of compression do not fit")),
        }
    }

    /// Returns the size once decompressed, which the compressed bytes can stand for.
    pub(crate) fn bytes_for(&self, packed: &[u8]) -> Result<u64, ImportFault> {
        let bytes = self.count as u64 * self.stride as u64;
        let available = packed.len() as u64;
        let needed = (bytes / MAX_COMPRESSION).saturating_sub(MIN_STREAM);
        match needed > available {
            true => Err(ImportFault::Beyond { what: "a compressed view", needed, available }),
            false => Ok(bytes),
        }
    }

    /// Decompresses the bytes of the view.
    pub(crate) fn decode(&self, packed: &[u8]) -> Result<Vec<u8>, ImportFault> {
        let decoded = match (self.codec, self.stride) {
            (Codec::Triangles, 2) => bytes_of(meshopt::decode_index_buffer(packed, self.count)),
            (Codec::Triangles, _) => words_of(meshopt::decode_index_buffer(packed, self.count)),
            (Codec::Indices, 2) => bytes_of(meshopt::decode_index_sequence(packed, self.count)),
            (Codec::Indices, _) => words_of(meshopt::decode_index_sequence(packed, self.count)),
            (Codec::Attributes, _) => decode_vertices(packed, self.count, self.stride),
        };
        let mut bytes = decoded.ok_or_else(|| invalid("the compressed view is damaged"))?;
        match (self.filter, self.stride) {
            (Filter::None, _) => {}
            (Filter::Exponential, _) => {
                in_place(&mut bytes, u32::from_le_bytes, u32::to_le_bytes, |words| {
                    meshopt::decode_filter_exp(as_ones(words));
                });
            }
            (Filter::Quaternion, _) => {
                let (read, write) = (i16::from_le_bytes, i16::to_le_bytes);
                in_place(&mut bytes, read, write, |values| {
                    meshopt::decode_filter_quat(values.as_chunks_mut().0);
                });
            }
            (Filter::Octahedral, 4) => filter(&mut bytes, i8::from_le_bytes, i8::to_le_bytes, oct),
            (Filter::Octahedral, _) => {
                filter(&mut bytes, i16::from_le_bytes, i16::to_le_bytes, oct);
            }
            (Filter::Color, 4) => filter(&mut bytes, i8::from_le_bytes, i8::to_le_bytes, color),
            (Filter::Color, _) => filter(&mut bytes, i16::from_le_bytes, i16::to_le_bytes, color),
        }
        Ok(bytes)
    }
}

fn oct<C: FilterComponent>(values: &mut [[C; 4]]) {
    meshopt::decode_filter_oct(values);
}

fn color<C: FilterComponent>(values: &mut [[C; 4]]) {
    meshopt::decode_filter_color(values);
}

/// Applies a filter to elements of four components.
fn filter<C: Copy, const N: usize>(
    bytes: &mut [u8],
    read: fn([u8; N]) -> C,
    write: fn(C) -> [u8; N],
    apply: fn(&mut [[C; 4]]),
) {
    in_place(bytes, read, write, |values| apply(values.as_chunks_mut().0));
}

/// Changes bytes as numbers.
fn in_place<C: Copy, const N: usize>(
    bytes: &mut [u8],
    read: fn([u8; N]) -> C,
    write: fn(C) -> [u8; N],
    change: impl FnOnce(&mut [C]),
) {
    let mut values: Vec<C> = bytes.as_chunks().0.iter().map(|&bytes| read(bytes)).collect();
    change(&mut values);
    for (bytes, value) in bytes.as_chunks_mut().0.iter_mut().zip(values) {
        *bytes = write(value);
    }
}

fn as_ones(words: &mut [u32]) -> &mut [[u32; 1]] {
    words.as_chunks_mut().0
}

fn bytes_of(decoded: meshopt::Result<Vec<u16>>) -> Option<Vec<u8>> {
    Some(decoded.ok()?.into_iter().flat_map(u16::to_le_bytes).collect())
}

fn words_of(decoded: meshopt::Result<Vec<u32>>) -> Option<Vec<u8>> {
    Some(decoded.ok()?.into_iter().flat_map(u32::to_le_bytes).collect())
}

/// A vertex of `N` bytes.
#[derive(Clone, Copy)]
#[repr(transparent)]
struct Vertex<const N: usize>([u8; N]);

impl<const N: usize> Default for Vertex<N> {
    fn default() -> Self {
        Self([0; N])
    }
}

fn decode_vertices_of<const N: usize>(packed: &[u8], count: usize) -> Option<Vec<u8>> {
    let vertices = meshopt::decode_vertex_buffer::<Vertex<N>>(packed, count).ok()?;
    Some(vertices.into_iter().flat_map(|vertex| vertex.0).collect())
}

/// Calls the decoder for a stride: it knows the stride by the type.
macro_rules! by_stride {
    ($packed:expr, $count:expr, $stride:expr, $($bytes:literal)*) => {
        match $stride {
            $($bytes => decode_vertices_of::<$bytes>($packed, $count),)*
            _ => None,
        }
    };
}

fn decode_vertices(packed: &[u8], count: usize, stride: usize) -> Option<Vec<u8>> {
    by_stride!(packed, count, stride,
        4 8 12 16 20 24 28 32 36 40 44 48 52 56 60 64 68 72 76 80 84 88 92 96 100 104 108 112 116
        120 124 128 132 136 140 144 148 152 156 160 164 168 172 176 180 184 188 192 196 200 204
        208 212 216 220 224 228 232 236 240 244 248 252 256)
}

fn invalid(what: &str) -> ImportFault {
    ImportFault::Invalid(what.to_owned())
}
