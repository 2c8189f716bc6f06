//! Buffers and buffer views as byte slices, loaded when somebody reads them, with every range
//! checked.

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::HashSet;
use std::rc::Rc;

use crate::document::Document;
use crate::error::{ImportError, ImportFault};
use crate::files::Files;
use crate::schema::{Buffer, BufferView};

/// The bytes of each buffer.
pub(crate) struct Buffers<'a> {
    document: &'a Document<'a>,
    bin: Option<&'a [u8]>,
    files: RefCell<Files<'a>>,
    loaded: Vec<OnceCell<Content<'a>>>,
    total_bytes: Cell<u64>,
    /// Addresses of the contents that are counted.
    counted: RefCell<HashSet<usize>>,
}

/// The content of a buffer: the chunk of a GLB, or a file that several buffers may name.
enum Content<'a> {
    Chunk(&'a [u8]),
    File(Rc<Vec<u8>>),
}

impl Content<'_> {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Chunk(bytes) => bytes,
            Self::File(bytes) => bytes,
        }
    }
}

/// The bytes of a view, and the distance of its elements if it says one.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) bytes: &'a [u8],
    pub(crate) stride: Option<usize>,
}

impl<'a> Buffers<'a> {
    pub(crate) fn new(document: &'a Document<'a>, bin: Option<&'a [u8]>, files: Files<'a>) -> Self {
        let loaded = (0..document.buffers.len()).map(|_| OnceCell::new()).collect();
        let (total_bytes, counted) = (Cell::new(0), RefCell::default());
        Self { document, bin, files: RefCell::new(files), loaded, total_bytes, counted }
    }

    /// Returns the document whose buffers these are.
    pub(crate) fn document(&self) -> &'a Document<'a> {
        self.document
    }

    /// Returns all content that decides meshes: the document, then the buffers that were read.
    pub(crate) fn content(&self) -> Vec<&[u8]> {
        let buffers = self.loaded.iter().filter_map(OnceCell::get).map(Content::bytes);
        std::iter::once(self.document.text().as_bytes()).chain(buffers).collect()
    }

    /// Counts the bytes of all buffers read so far; shared ones count once.
    pub(crate) fn total_bytes(&self) -> u64 {
        self.total_bytes.get()
    }

    /// Loads a file or a data URI beside the buffers, within the same limits.
    pub(crate) fn load_file(&self, uri: &str, place: &str) -> Result<Rc<Vec<u8>>, ImportError> {
        self.files.borrow_mut().load(uri, place)
    }

    /// Returns a view by its index; `named_by` is the place that names it.
    pub(crate) fn view(
        &self,
        index: usize,
        named_by: impl FnOnce() -> String,
    ) -> Result<View<'_>, ImportError> {
        let view: BufferView = self.document.buffer_views.parse(index, named_by)?;
        let here = |field: &str| format!("/bufferViews/{index}{field}");
        let buffer = self.buffer(view.buffer.index(), || here("/buffer"))?;
        let offset = view.byte_offset.unwrap_or_default().0.into();
        let bytes = range(buffer, offset, view.byte_length.0.into(), "the view", || here(""))?;
        Ok(View { bytes, stride: view.byte_stride.map(|s| s.index()).filter(|&s| s > 0) })
    }

    /// Returns the bytes of a buffer: as many as it says, or fewer where there are fewer.
    fn buffer(
        &self,
        index: usize,
        named_by: impl FnOnce() -> String,
    ) -> Result<&[u8], ImportError> {
        let buffer: Buffer<'_> = self.document.buffers.parse(index, named_by)?;
        let cell = &self.loaded[index];
        let content = match cell.get() {
            Some(content) => content,
            None => {
                let content = self.load(index, &buffer)?;
                let bytes = content.bytes();
                if self.counted.borrow_mut().insert(bytes.as_ptr().addr()) {
                    self.total_bytes.set(self.total_bytes.get() + bytes.len() as u64);
                }
                cell.get_or_init(|| content)
            }
        };
        let bytes = content.bytes();
        let length = buffer.byte_length.map_or(bytes.len(), |length| length.index());
        Ok(&bytes[..length.min(bytes.len())])
    }

    fn load(&self, index: usize, buffer: &Buffer<'_>) -> Result<Content<'a>, ImportError> {
        if let Some(uri) = buffer.uri.as_deref() {
            return Ok(Content::File(self.load_file(uri, &format!("/buffers/{index}/uri"))?));
        }
        match self.bin {
            Some(bin) if index == 0 => Ok(Content::Chunk(bin)),
            _ => {
                let what = "a buffer without URI and without GLB chunk".into();
                Err(ImportFault::Invalid(what).at(format!("/buffers/{index}")))
            }
        }
    }
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
