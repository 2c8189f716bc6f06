//! Buffers and buffer views as byte slices, loaded when somebody reads them, with every range
//! checked.

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::HashSet;
use std::rc::Rc;

use crate::document::Document;
use crate::draco::DracoMesh;
use crate::error::{ImportError, ImportFault};
use crate::files::Files;
use crate::limits::MAX_DECODED_BYTES;
use crate::meshopt_view;
use crate::schema::{Buffer, BufferView, MeshoptView};

/// The bytes of each buffer.
pub(crate) struct Buffers<'a> {
    document: &'a Document<'a>,
    bin: Option<&'a [u8]>,
    files: RefCell<Files<'a>>,
    /// Content and stated length of the buffers that were read.
    loaded: Vec<OnceCell<(Content<'a>, Option<usize>)>>,
    total_bytes: Cell<u64>,
    /// Addresses of the contents that are counted.
    counted: RefCell<HashSet<usize>>,
    /// Decompressed content by view, with room once there is any.
    views: OnceCell<Vec<OnceCell<Vec<u8>>>>,
    meshes: OnceCell<Vec<OnceCell<Box<DracoMesh>>>>,
    decoded_bytes: Cell<u64>,
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
        Self {
            document,
            bin,
            files: RefCell::new(files),
            loaded,
            total_bytes,
            counted,
            views: OnceCell::new(),
            meshes: OnceCell::new(),
            decoded_bytes: Cell::new(0),
        }
    }

    /// Returns the document whose buffers these are.
    pub(crate) fn document(&self) -> &'a Document<'a> {
        self.document
    }

    /// Returns all content that decides meshes: the document, then the buffers that were read.
    pub(crate) fn content(&self) -> Vec<&[u8]> {
        let loaded = self.loaded.iter().filter_map(OnceCell::get);
        let buffers = loaded.map(|(content, _)| content.bytes());
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
        let view: BufferView<'_> = self.document.buffer_views.parse(index, named_by)?;
        let stride = view.byte_stride.map(|s| s.index()).filter(|&s| s > 0);
        let extensions = view.extensions.as_ref();
        let compressed = extensions
            .and_then(|of_view| of_view.meshopt.as_ref().or(of_view.khronos_meshopt.as_ref()));
        if let Some(compressed) = compressed {
            let bytes = self.decompressed(index, compressed)?;
            let stride = stride.or(Some(compressed.byte_stride.index()).filter(|&s| s > 0));
            return Ok(View { bytes, stride });
        }
        let here = |field: &str| format!("/bufferViews/{index}{field}");
        let buffer = self.buffer(view.buffer.index(), || here("/buffer"))?;
        let offset = view.byte_offset.unwrap_or_default().0.into();
        let bytes = range(buffer, offset, view.byte_length.0.into(), "the view", || here(""))?;
        Ok(View { bytes, stride })
    }

    /// Decompresses a view (EXT_meshopt_compression), once.
    fn decompressed(&self, index: usize, view: &MeshoptView<'_>) -> Result<&[u8], ImportError> {
        let cell = &self.rooms(&self.views)[index];
        if let Some(bytes) = cell.get() {
            return Ok(bytes);
        }
        let here =
            |field: &str| format!("/bufferViews/{index}/extensions/EXT_meshopt_compression{field}");
        let buffer = self.buffer(view.buffer.index(), || here("/buffer")).map_err(|error| {
            // The uncompressed buffer may lack content, the compressed one must have it.
            let ImportError { fault, place, .. } = error;
            match fault {
                ImportFault::NoContent => ImportFault::Invalid(fault.to_string()).at(place),
                fault => fault.at(place),
            }
        })?;
        let offset = view.byte_offset.unwrap_or_default().0.into();
        let length = view.byte_length.0.into();
        let packed = range(buffer, offset, length, "the compressed view", || here(""))?;
        let layout = meshopt_view::Layout::new(view).map_err(|fault| fault.at(here("")))?;
        let bytes = layout.bytes_for(packed).map_err(|fault| fault.at(here("/count")))?;
        self.charge_decoded(bytes).map_err(|fault| fault.at(here("")))?;
        let bytes = layout.decode(packed).map_err(|fault| fault.at(here("")))?;
        Ok(cell.get_or_init(|| bytes))
    }

    /// Decompresses the mesh of a view (KHR_draco_mesh_compression), once; `place` names it.
    pub(crate) fn draco(
        &self,
        index: usize,
        max_triangles: u64,
        place: impl Fn() -> String,
    ) -> Result<&DracoMesh, ImportError> {
        let packed = self.view(index, || place() + "/bufferView")?.bytes;
        let cell = &self.rooms(&self.meshes)[index];
        if let Some(mesh) = cell.get() {
            return Ok(mesh);
        }
        let left = MAX_DECODED_BYTES - self.decoded_bytes.get();
        let mesh = DracoMesh::decode(packed, max_triangles, left).map_err(|f| f.at(place()))?;
        self.charge_decoded(mesh.bytes()).map_err(|fault| fault.at(place()))?;
        Ok(cell.get_or_init(|| Box::new(mesh)))
    }

    /// Returns the rooms for decompressed content, one a view.
    fn rooms<'b, T>(&self, rooms: &'b OnceCell<Vec<OnceCell<T>>>) -> &'b [OnceCell<T>] {
        let count = self.document.buffer_views.len();
        rooms.get_or_init(|| (0..count).map(|_| OnceCell::new()).collect())
    }

    /// Counts decompressed bytes, which stand for as many of the file.
    fn charge_decoded(&self, bytes: u64) -> Result<(), ImportFault> {
        let count = self.decoded_bytes.get() + bytes;
        if count > MAX_DECODED_BYTES {
            let limit = MAX_DECODED_BYTES;
            return Err(ImportFault::TooMany { what: "decompressed bytes", count, limit });
        }
        self.decoded_bytes.set(count);
        self.total_bytes.set(self.total_bytes.get() + bytes);
        Ok(())
    }

    /// Returns the bytes of a buffer: as many as it says, or fewer where there are fewer.
    fn buffer(
        &self,
        index: usize,
        named_by: impl FnOnce() -> String,
    ) -> Result<&[u8], ImportError> {
        self.document.buffers.require(index, named_by)?;
        let cell = &self.loaded[index];
        let (content, length) = match cell.get() {
            Some(loaded) => loaded,
            None => {
                // Once: its URI may be most of the document.
                let buffer: Buffer<'_> = self.document.buffers.parse(index, String::new)?;
                let content = self.load(index, &buffer)?;
                let bytes = content.bytes();
                if self.counted.borrow_mut().insert(bytes.as_ptr().addr()) {
                    self.total_bytes.set(self.total_bytes.get() + bytes.len() as u64);
                }
                let length = buffer.byte_length.map(|length| length.index());
                cell.get_or_init(|| (content, length))
            }
        };
        let bytes = content.bytes();
        Ok(&bytes[..length.unwrap_or(bytes.len()).min(bytes.len())])
    }

    fn load(&self, index: usize, buffer: &Buffer<'_>) -> Result<Content<'a>, ImportError> {
        if let Some(uri) = buffer.uri.as_deref() {
            return Ok(Content::File(self.load_file(uri, &format!("/buffers/{index}/uri"))?));
        }
        match self.bin {
            Some(bin) if index == 0 => Ok(Content::Chunk(bin)),
            _ => Err(ImportFault::NoContent.at(format!("/buffers/{index}"))),
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
