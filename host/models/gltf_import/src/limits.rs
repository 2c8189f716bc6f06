//! Import limits. Files are not trusted: every loop and every buffer of this crate ends at one of
//! these.

/// Bytes of a model file and all files it names, together.
pub const MAX_FILE_BYTES: u64 = 1 << 30;
/// Nodes of one file.
pub const MAX_NODES: u32 = 1_000_000;
/// Levels of nodes below a root.
pub const MAX_DEPTH: u32 = 512;
/// Triangles of all meshes together.
pub const MAX_TRIANGLES: u64 = 10_000_000;
/// Pixels of all textures together; each takes four bytes.
pub const MAX_TEXTURE_PIXELS: u64 = 64 << 20;

/// Width or height of a texture, pixels.
pub const MAX_TEXTURE_SIDE: u32 = 8192;
/// Bytes of the JSON part, embedded data URIs included.
pub const MAX_JSON_BYTES: u64 = 256 << 20;
/// Memory that the places of the JSON's elements may take, beyond twice its own length.
pub const MAX_JSON_MEMORY: u64 = 40 << 20;
/// Bytes of all compressed meshes and views of one model, once decompressed.
pub const MAX_DECODED_BYTES: u64 = 1 << 30;
/// Files that one model may name.
pub const MAX_EXTERNAL_FILES: usize = 1024;
/// Features of all meshes together, each with a name of its own. Features without a triangle do not
/// count.
pub const MAX_FEATURES: u32 = 100_000;
/// Items of one list or object of EXT_structural_metadata, and vertex
/// attributes, morph targets or feature id sets of one primitive.
pub const MAX_METADATA_ITEMS: usize = 256;
/// Bytes of JSON of meshes in shapes of their own, however short the document is.
pub(crate) const MIN_SHAPE_BYTES: u64 = 16 << 20;
/// Corners of triangles that all shapes of their own may have together, each counted once for
/// every four joints of its vertices; what is beyond is shown as modelled.
pub(crate) const MAX_SHAPE_CORNERS: u64 = 8_000_000;
/// Corners that a shape counts for at least.
pub(crate) const MIN_SHAPE_CORNERS: u64 = 256;
/// Sets of joints and weights of a vertex that are read: 16 joints.
pub(crate) const MAX_JOINT_SETS: usize = 4;
/// Remarks on skins that name their places.
pub(crate) const MAX_SKIN_REMARKS: usize = 8;
/// Joints of one skin: vertices name them by 16 bits.
pub(crate) const MAX_JOINTS: usize = 1 << 16;
/// Joints of the skins of all nodes together, however short the JSON is.
pub(crate) const MIN_POSED_JOINTS: usize = 1 << 18;
/// Joints of the skins of all nodes together; up to this, one for each byte of JSON.
pub(crate) const MAX_POSED_JOINTS: usize = 1 << 21;
/// Children of one node, or nodes of one scene.
pub(crate) const MAX_CHILDREN: usize = MAX_NODES as usize;
/// Primitives of one mesh.
pub(crate) const MAX_PRIMITIVES: usize = 1 << 18;
/// Triangles, and elements gone through, that are allowed however few bytes there are: they are
/// built sooner than counted twice.
pub(crate) const MIN_ALLOWANCE: u64 = 1 << 16;
/// Times that the bytes of a file may be used over: meshes share accessors.
pub(crate) const MAX_SHARING: u64 = 16;
/// Bytes of a node's, a feature's or a material's name; longer ones are cut.
pub const MAX_NAME_BYTES: usize = 128;
/// Different remarks in a report.
pub const MAX_NOTES: usize = 100;
/// Largest coordinate, metres: squares of it still are finite.
pub const MAX_COORDINATE: f32 = 1e12;

/// Limits of an import. The default is the constants of this crate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportLimits {
    /// Limit of bytes; see [`MAX_FILE_BYTES`].
    pub max_file_bytes: u64,
    /// Limit of nodes; see [`MAX_NODES`].
    pub max_nodes: u32,
    /// Limit of depth; see [`MAX_DEPTH`].
    pub max_depth: u32,
    /// Limit of triangles; see [`MAX_TRIANGLES`].
    pub max_triangles: u64,
    /// Limit of features; see [`MAX_FEATURES`].
    pub max_features: u32,
    /// Limit of pixels; see [`MAX_TEXTURE_PIXELS`].
    pub max_texture_pixels: u64,
}

impl Default for ImportLimits {
    fn default() -> Self {
        Self {
            max_file_bytes: MAX_FILE_BYTES,
            max_nodes: MAX_NODES,
            max_depth: MAX_DEPTH,
            max_triangles: MAX_TRIANGLES,
            max_features: MAX_FEATURES,
            max_texture_pixels: MAX_TEXTURE_PIXELS,
        }
    }
}
