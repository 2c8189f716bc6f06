//! The binary half of a file: streams of equal elements, and the container
//! (glTF 2.0, section 4.4).

use crate::ExportError;
use crate::document::{Buffer, BufferView, Document};

const GLB_MAGIC: u32 = 0x4654_6C67;
const GLB_VERSION: u32 = 2;
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BIN_CHUNK: u32 = 0x004E_4942;
const HEADER_BYTES: u64 = 12;
const CHUNK_HEADER_BYTES: u64 = 8;
/// Alignment of chunks, bytes (glTF 2.0, section 4.4.3.1).
const CHUNK_ALIGNMENT: u64 = 4;
/// Alignment of buffer views, bytes: columns of property tables need eight.
const VIEW_ALIGNMENT: u64 = 8;

/// Kind of a stream's elements. Each kind is one buffer view.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Stream {
    Positions,
    Normals,
    Uvs,
    /// Feature ids of two bytes, each on four.
    Features16,
    /// Feature ids as floats.
    Features32,
    Indices16,
    Indices32,
}

struct View {
    stream: Option<Stream>,
    bytes: Vec<u8>,
}

/// The views written so far, in order.
#[derive(Default)]
pub(crate) struct Binary {
    views: Vec<View>,
}

/// Location of appended elements.
pub(crate) struct Location {
    pub(crate) view: u32,
    pub(crate) byte_offset: u64,
}

impl Stream {
    fn stride_bytes(self) -> Option<u32> {
        match self {
            Self::Positions | Self::Normals => Some(12),
            Self::Uvs => Some(8),
            Self::Features16 | Self::Features32 => Some(4),
            Self::Indices16 | Self::Indices32 => None,
        }
    }

    fn target(self) -> u32 {
        match self {
            Self::Indices16 | Self::Indices32 => 34963, // ELEMENT_ARRAY_BUFFER
            _ => 34962,                                 // ARRAY_BUFFER
        }
    }
}

impl Binary {
    /// Appends whole elements to a stream.
    pub(crate) fn append(
        &mut self,
        stream: Stream,
        bytes: impl IntoIterator<Item = u8>,
    ) -> Location {
        let found = self.views.iter().position(|v| v.stream == Some(stream));
        let view = found.unwrap_or_else(|| {
            self.views.push(View { stream: Some(stream), bytes: Vec::new() });
            self.views.len() - 1
        });
        let into = &mut self.views[view].bytes;
        let byte_offset = into.len() as u64;
        into.extend(bytes);
        Location { view: view as u32, byte_offset }
    }

    /// Adds bytes that are no stream, such as an image, as a view of its own.
    pub(crate) fn embed(&mut self, bytes: Vec<u8>) -> u32 {
        self.views.push(View { stream: None, bytes });
        self.views.len() as u32 - 1
    }

    /// Puts document and streams into one container.
    pub(crate) fn finish(self, mut document: Document) -> Result<Vec<u8>, ExportError> {
        let mut bin_bytes = 0;
        for view in &self.views {
            document.buffer_views.push(BufferView {
                buffer: 0,
                byte_offset: bin_bytes,
                byte_length: view.bytes.len() as u64,
                byte_stride: view.stream.and_then(Stream::stride_bytes),
                target: view.stream.map(Stream::target),
            });
            bin_bytes = (bin_bytes + view.bytes.len() as u64).next_multiple_of(VIEW_ALIGNMENT);
        }
        if bin_bytes > 0 {
            document.buffers.push(Buffer { byte_length: bin_bytes });
        }
        let json = serde_json::to_vec(&document)?;
        assemble(&json, &self.views, bin_bytes)
    }
}

fn assemble(json: &[u8], views: &[View], bin_bytes: u64) -> Result<Vec<u8>, ExportError> {
    let json_bytes = (json.len() as u64).next_multiple_of(CHUNK_ALIGNMENT);
    let mut total = HEADER_BYTES + CHUNK_HEADER_BYTES + json_bytes;
    if bin_bytes > 0 {
        total += CHUNK_HEADER_BYTES + bin_bytes;
    }
    let Ok(total_u32) = u32::try_from(total) else {
        return Err(ExportError::TooLarge { bytes: total });
    };
    // Every length below is at most the total, which fits 32 bits.
    let mut glb = Vec::with_capacity(total as usize);
    for word in [GLB_MAGIC, GLB_VERSION, total_u32, json_bytes as u32, JSON_CHUNK] {
        glb.extend(word.to_le_bytes());
    }
    let json_start = glb.len();
    glb.extend(json);
    glb.resize(json_start + json_bytes as usize, b' ');
    if bin_bytes > 0 {
        glb.extend((bin_bytes as u32).to_le_bytes());
        glb.extend(BIN_CHUNK.to_le_bytes());
        let bin_start = glb.len();
        for view in views {
            glb.extend(&view.bytes);
            let end = (glb.len() - bin_start).next_multiple_of(VIEW_ALIGNMENT as usize);
            glb.resize(bin_start + end, 0);
        }
    }
    Ok(glb)
}
