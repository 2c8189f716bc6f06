//! Why a model cannot be written.

use thiserror::Error;

/// Why a model cannot be written as GLB. All but [`ExportError::TooLarge`] are
/// faults of the code that built the model.
#[derive(Debug, Error)]
pub enum ExportError {
    /// An index names something that the model does not have.
    #[error("{place} names {what} {index}, but there are {count}; build the model anew")]
    Reference {
        /// Where in the model, such as `node 3`.
        place: String,
        /// What is named, such as `mesh`.
        what: &'static str,
        /// The index.
        index: u64,
        /// How many there are.
        count: usize,
    },
    /// A node's parent does not come before it.
    #[error("node {node} has parent {parent}, which is not an earlier node; sort the nodes")]
    ParentOrder {
        /// The child.
        node: usize,
        /// Its parent.
        parent: u32,
    },
    /// The arrays of a mesh's wedges differ in length.
    #[error("mesh {mesh}: wedge arrays differ in length; build the mesh by welding")]
    WedgeArrays {
        /// The mesh.
        mesh: usize,
    },
    /// A mesh has another number of features than of positions.
    #[error("mesh {mesh}: {found} features for {expected} positions; build the mesh by welding")]
    Features {
        /// The mesh.
        mesh: usize,
        /// Features it has.
        found: usize,
        /// Positions it has.
        expected: usize,
    },
    /// More features than a float tells apart.
    #[error("mesh {mesh} has {count} features, and glTF tells at most 2^24 apart: split the mesh")]
    TooManyFeatures {
        /// The mesh.
        mesh: usize,
        /// Features it has.
        count: usize,
    },
    /// A value that the file cannot hold.
    #[error("{place} is not finite; glTF has no NaN and no infinity: mend it before writing")]
    NotFinite {
        /// Where in the model.
        place: String,
    },
    /// A texture's pixels do not match its size.
    #[error("texture {texture} is {width} x {height}, but holds {bytes} bytes of RGBA")]
    TextureSize {
        /// The texture.
        texture: usize,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// Bytes it holds.
        bytes: usize,
    },
    /// A texture cannot be encoded as PNG.
    #[error("texture {texture} cannot be written as PNG: {reason}")]
    Png {
        /// The texture.
        texture: usize,
        /// What the encoder says.
        reason: image::ImageError,
    },
    /// The document cannot be written as JSON.
    #[error("the document cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    /// GLB holds its length in 32 bits.
    #[error("the file would have {bytes} bytes, and GLB holds at most 2^32 - 1: split the model")]
    TooLarge {
        /// Bytes needed.
        bytes: u64,
    },
}
