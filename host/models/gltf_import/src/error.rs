//! Import errors: fault, place in the file, and remedy.

use std::path::PathBuf;

use thiserror::Error;

/// Error of an import, with file and place.
#[derive(Debug, Error)]
#[error("{}: {fault}, at {place}: {}", self.file_name(), fault.remedy())]
pub struct ImportError {
    /// The file; empty for bytes without a name.
    pub file: PathBuf,
    /// JSON pointer of the faulty value, or the part of the file it is in.
    pub place: String,
    /// Fault found at the place.
    pub fault: ImportFault,
}

/// Fault of a file that cannot be imported.
#[derive(Debug, Error)]
pub enum ImportFault {
    /// A file cannot be opened or read.
    #[error("cannot read '{path}': {reason}")]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        reason: std::io::Error,
    },
    /// A folder, device, pipe or socket where a file should be.
    #[error("'{0}' is not a regular file")]
    NotAFile(PathBuf),
    /// More of something than the limits allow.
    #[error("{count} {what}, and the limit is {limit}")]
    TooMany {
        /// Kind of the items that are too many.
        what: &'static str,
        /// Number of items, or the number counted when it became too much.
        count: u64,
        /// Greatest number of items allowed.
        limit: u64,
    },
    /// The GLB container is damaged.
    #[error("damaged GLB: {0}")]
    Container(String),
    /// The JSON does not parse, or not as glTF.
    #[error("line {line}, column {column} of the JSON: {reason}")]
    Json {
        /// Line of the JSON, from 1.
        line: usize,
        /// Column of the line, from 1.
        column: usize,
        /// Message of the JSON parser.
        reason: String,
    },
    /// Version other than glTF 2.
    #[error("glTF version '{0}' is not supported")]
    Version(String),
    /// The file cannot be shown without an extension that Busbar lacks.
    #[error("the file requires the extension '{0}', which is not supported")]
    Extension(String),
    /// Index beyond the last item.
    #[error("{what} {index} is named, but there are {count}")]
    Index {
        /// Kind of the item that is named.
        what: &'static str,
        /// Index of the item.
        index: usize,
        /// Number of items there are.
        count: usize,
    },
    /// Data said to lie where no bytes are.
    #[error("{what} needs {needed} bytes, but there are {available}")]
    Beyond {
        /// Kind of the data that need the bytes.
        what: &'static str,
        /// Bytes needed from the start of the containing data; more than 2^64 saturates.
        needed: u64,
        /// Number of bytes there are.
        available: u64,
    },
    /// A buffer of glTF JSON that names no data (glTF 2.0, section 3.6.1.2).
    #[error("a buffer without URI and without GLB chunk")]
    NoContent,
    /// A URI that is refused.
    #[error("the URI '{uri}' is refused: {reason}")]
    Uri {
        /// Refused URI, shortened for the message.
        uri: String,
        /// Reason for the refusal.
        reason: &'static str,
    },
    /// The chosen scene is none of the file's.
    #[error("the file has no scene {choice}; its scenes are: {scenes}")]
    NoScene {
        /// Chosen name in quotes, or index.
        choice: String,
        /// Names of the file's scenes in quotes, or indices of those without a name.
        scenes: String,
    },
    /// A node that is its own ancestor.
    #[error("node {0} is its own ancestor")]
    Cycle(usize),
    /// A value that glTF does not allow here.
    #[error("{0}")]
    Invalid(String),
    /// An index beyond the vertices of its primitive.
    #[error("the indices name vertex {index}, but there are {count} vertices")]
    Vertex {
        /// Largest index of a vertex.
        index: u32,
        /// Vertices of the primitive.
        count: usize,
    },
    /// An image that cannot be used.
    #[error("the image cannot be used: {0}")]
    Image(String),
    /// A mesh that Draco cannot decompress.
    #[error("Draco cannot decompress the mesh: {0}")]
    Draco(String),
    /// A library failed in a way it should not.
    #[error("the importer failed: {0}")]
    Panicked(String),
}

impl ImportFault {
    /// Returns the remedy for the reader of the message.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Read { .. } | Self::NotAFile(_) => "check the path and its permissions",
            Self::TooMany { .. } => "make the model smaller or split it",
            Self::Version(_) => "export the model as glTF 2.0",
            Self::Extension(_) => "export the model again without this extension",
            Self::Uri { .. } => {
                "put the file beside the model or below, and name it by its relative path"
            }
            Self::NoScene { .. } => "choose one of these, or none for the default scene",
            Self::Cycle(_) => "give each node one parent; nodes may share a mesh instead",
            Self::Image(_) => "save the image as PNG or JPEG again",
            Self::Panicked(_) => "the file is damaged: export it again, and report this to Busbar",
            Self::Container(_)
            | Self::Json { .. }
            | Self::Index { .. }
            | Self::Beyond { .. }
            | Self::Invalid(_)
            | Self::NoContent
            | Self::Draco(_)
            | Self::Vertex { .. } => "the file is damaged or wrongly written: export it again",
        }
    }
}

impl ImportError {
    pub(crate) fn new(place: impl Into<String>, fault: ImportFault) -> Self {
        Self { file: PathBuf::new(), place: place.into(), fault }
    }

    fn file_name(&self) -> String {
        if self.file.as_os_str().is_empty() {
            return "glTF data".into();
        }
        self.file.display().to_string()
    }
}

impl ImportFault {
    /// Adds a place to the fault.
    pub(crate) fn at(self, place: impl Into<String>) -> ImportError {
        ImportError::new(place, self)
    }
}

/// Looks up an index that the file names.
pub(crate) fn item<'a, T>(
    items: &'a [T],
    index: usize,
    what: &'static str,
    place: impl FnOnce() -> String,
) -> Result<&'a T, ImportError> {
    let count = items.len();
    items.get(index).ok_or_else(|| ImportFault::Index { what, index, count }.at(place()))
}
