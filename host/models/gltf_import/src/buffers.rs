//! Buffers and buffer views as byte slices, with every range checked.

use std::collections::HashMap;

use gltf::json::Root;

use crate::error::{ImportError, ImportFault, item};
use crate::files::Files;

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Source {
    Glb,
    File(usize),
}

/// The bytes of each buffer.
pub(crate) struct Buffers<'a> {
    root: &'a Root,
    buffers: Vec<&'a [u8]>,
    total_bytes: u64,
}

/// The bytes of a view, and the distance of its elements if it says one.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) stride: Option<usize>,
}

/// Sources of the buffers' bytes.
pub(crate) struct LoadedBuffers(Vec<Source>);

/// Loads the files and data URIs that buffers name.
pub(crate) fn load(
    root: &Root,
    bin: Option<&[u8]>,
    files: &mut Files<'_>,
) -> Result<LoadedBuffers, ImportError> {
    let mut sources = Vec::with_capacity(root.buffers.len());
    for (index, buffer) in root.buffers.iter().enumerate() {
        let source = match &buffer.uri {
            Some(uri) => Source::File(files.load(uri, &format!("/buffers/{index}/uri"))?),
            None if index == 0 && bin.is_some() => Source::Glb,
            None => {
                let fault =
                    ImportFault::Invalid("a buffer without URI and without GLB chunk".into());
                return Err(fault.at(format!("/buffers/{index}")));
            }
        };
        sources.push(source);
    }
    Ok(LoadedBuffers(sources))
}

impl<'a> Buffers<'a> {
    /// Checks that each buffer has the bytes that it claims.
    pub(crate) fn new(
        root: &'a Root,
        loaded: &LoadedBuffers,
        bin: Option<&'a [u8]>,
        files: &'a Files<'_>,
    ) -> Result<Self, ImportError> {
        let mut buffers = Vec::with_capacity(loaded.0.len());
        for (index, (source, buffer)) in loaded.0.iter().zip(&root.buffers).enumerate() {
            let bytes = match source {
                Source::Glb => bin.unwrap_or_default(),
                Source::File(file) => files.get(*file),
            };
            let end = buffer.byte_length.0;
            let place = || format!("/buffers/{index}/byteLength");
            buffers.push(range(bytes, 0, end, "the buffer", place)?);
        }
        let total_bytes = count_bytes(&loaded.0, &buffers);
        Ok(Self { root, buffers, total_bytes })
    }

    /// Returns all content that decides meshes: the document, then the buffers.
    pub(crate) fn content(&self, json: &'a [u8]) -> Vec<&'a [u8]> {
        std::iter::once(json).chain(self.buffers.iter().copied()).collect()
    }

    /// Counts the bytes of all buffers together; shared ones count once.
    pub(crate) fn total_bytes(&self) -> u64 {
        self.total_bytes
    }

    /// Returns a view by its index; `place` is the place that names it.
    pub(crate) fn view(
        &self,
        index: usize,
        place: impl FnOnce() -> String,
    ) -> Result<View<'a>, ImportError> {
        let view = item(&self.root.buffer_views, index, "buffer view", place)?;
        let here = |field: &str| format!("/bufferViews/{index}{field}");
        let buffer = item(&self.buffers, view.buffer.value(), "buffer", || here("/buffer"))?;
        let offset = view.byte_offset.map_or(0, |o| o.0);
        let bytes = range(buffer, offset, view.byte_length.0, "the view", || here(""))?;
        Ok(View { bytes, stride: view.byte_stride.map(|s| s.0).filter(|&s| s > 0) })
    }
}

/// Buffers of one source are one run of bytes, as long as the longest of them:
/// naming it again makes no more of it.
fn count_bytes(sources: &[Source], buffers: &[&[u8]]) -> u64 {
    let mut longest: HashMap<Source, u64> = HashMap::new();
    for (source, bytes) in sources.iter().zip(buffers) {
        let length = longest.entry(*source).or_default();
        *length = (*length).max(bytes.len() as u64);
    }
    longest.values().sum()
}

/// Returns `bytes[offset..offset + length]`, if it exists.
pub(crate) fn range<'a>(
    bytes: &'a [u8],
    offset: u64,
    length: u64,
    what: &'static str,
    place: impl FnOnce() -> String,
) -> Result<&'a [u8], ImportError> {
    let needed = offset.saturating_add(length);
    let available = bytes.len() as u64;
    if needed > available {
        return Err(ImportFault::Beyond { what, needed, available }.at(place()));
    }
    // Both are at most the length of a slice.
    Ok(&bytes[offset as usize..needed as usize])
}
