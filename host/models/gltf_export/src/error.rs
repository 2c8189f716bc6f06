//! Export errors: contradictions in a model, or a file beyond the format.

use thiserror::Error;

/// Reasons why a model cannot be written as GLB. All but [`ExportError::TooLarge`] are faults of
/// the code that built the model.
#[derive(Debug, Error)]
pub enum ExportError {
    /// An index names something that the model does not have.
    #[error("{place} names {what} {index}, but there are {count}; build the model anew")]
    Reference {
        /// Place in the model, such as `node 3`.
        place: String,
        /// Kind of the item named, such as `mesh`.
        what: &'static str,
        /// Index of the item.
        index: u64,
        /// Number of items there are.
        count: usize,
    },
    /// A node's parent does not come before it.
    #[error("node {node} has parent {parent}, which is not an earlier node; sort the nodes")]
    ParentOrder {
        /// Index of the child node.
        node: usize,
        /// Index of its parent.
        parent: u32,
    },
    /// The arrays of a mesh's wedges differ in length.
    #[error("mesh {mesh}: wedge arrays differ in length; build the mesh by welding")]
    WedgeArrays {
        /// Index of the mesh.
        mesh: usize,
    },
    /// A mesh has another number of features than of positions.
    #[error("mesh {mesh}: {found} features for {expected} positions; build the mesh by welding")]
    Features {
        /// Index of the mesh.
        mesh: usize,
        /// Number of features it has.
        found: usize,
        /// Number of positions it has.
        expected: usize,
    },
    /// Number of features beyond the exact range of floats.
    #[error("mesh {mesh} has {count} features, and glTF tells at most 2^24 apart: split the mesh")]
    TooManyFeatures {
        /// Index of the mesh.
        mesh: usize,
        /// Number of features it has.
        count: usize,
    },
    /// A value that the file cannot hold.
    #[error("{place} is not finite; glTF has no NaN and no infinity: mend it before writing")]
    NotFinite {
        /// Place in the model, such as `node 3`.
        place: String,
    },
    /// A texture's pixels do not match its size.
    #[error("texture {texture} is {width} x {height}, but holds {bytes} bytes of RGBA")]
    TextureSize {
        /// Index of the texture.
        texture: usize,
        /// Width of the texture in pixels.
        width: u32,
        /// Height of the texture in pixels.
        height: u32,
        /// Number of bytes it holds.
        bytes: usize,
    },
    /// A texture cannot be encoded as PNG.
    #[error("texture {texture} cannot be written as PNG: {reason}")]
    Png {
        /// Index of the texture.
        texture: usize,
        /// Error of the encoder.
        reason: image::ImageError,
    },
    /// The document cannot be written as JSON.
    #[error("the document cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// GLB holds its length in 32 bits.
    #[error("the file would have {bytes} bytes, and GLB holds at most 2^32 - 1: split the model")]
    TooLarge {
        /// Number of bytes needed.
        bytes: u64,
    },
}
