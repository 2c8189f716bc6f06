//! Untrusted glTF bytes to meshes, materials and nodes.
//!
//! Invariant: nothing is allocated from a number in the file before that
//! number is checked against the bytes that are there, and nothing outside the
//! model's folder is opened.
//!
//! The document is kept as text, and its elements are parsed when they are used: every index,
//! range and element is checked here.

mod accessor;
mod bounded;
mod buffers;
mod container;
mod document;
mod draco;
mod error;
mod extensions;
mod features;
mod files;
mod images;
mod instances;
mod json_text;
mod ktx2_image;
mod limits;
mod materials;
mod mesh_cache;
mod meshes;
mod meshopt_view;
mod name_table;
mod names;
mod nodes;
mod primitives;
mod report;
mod required_extensions;
mod scalars;
mod scene_choice;
mod schema;
mod shapes;
mod skins;
mod transforms;
mod tubes;
mod uri;
mod vertex_colors;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use busbar_scene::{Model, ModelNode};

use crate::buffers::Buffers;
use crate::document::Document;
use crate::extensions::StructuralMetadata;
use crate::files::Files;
use crate::meshes::{Builder, CachedContent, Checker, Source};
use crate::report::Notes;
use crate::shapes::MeshShape;
use crate::vertex_colors::ColorMaterials;

pub use crate::error::{ImportError, ImportFault};
pub use crate::limits::{
    ImportLimits, MAX_COORDINATE, MAX_DECODED_BYTES, MAX_DEPTH, MAX_EXTERNAL_FILES, MAX_FEATURES,
    MAX_FILE_BYTES, MAX_JSON_BYTES, MAX_JSON_MEMORY, MAX_METADATA_ITEMS, MAX_NAME_BYTES, MAX_NODES,
    MAX_NOTES, MAX_TEXTURE_PIXELS, MAX_TEXTURE_SIDE, MAX_TRIANGLES,
};
pub use crate::mesh_cache::{CachedMesh, MIN_CACHED_TRIANGLES, MeshCache};
pub use crate::report::ImportReport;
pub use crate::scene_choice::SceneChoice;

/// Imported model, with a report of skipped content.
#[derive(Clone, Debug)]
pub struct ImportedModel {
    /// Model of the file.
    pub model: Model,
    /// Report of the import.
    pub report: ImportReport,
}

/// Imports a `.gltf` or `.glb` file. Files that it names are looked for in its
/// folder and below, nowhere else.
///
/// Supported: glTF 2.0 with triangles, and with lines and points as slender tubes; morph targets
/// at the weights of the node, or else of the mesh; skins as their joints stand in the file, a mesh
/// for each node with weights or a skin of its own; positions, normals and
/// texture coordinates in any component type (KHR_mesh_quantization
/// included), transformed as KHR_texture_transform says; sparse accessors; compression by
/// KHR_draco_mesh_compression and EXT_meshopt_compression; instances
/// (EXT_mesh_gpu_instancing), each a node called `name[index]`; vertex colours; features of vertices
/// with their names (EXT_mesh_features by attribute, EXT_structural_metadata);
/// metallic-roughness and specular-glossiness materials with PNG, JPEG, WebP and KTX2 textures
/// (RGB8, RGBA8, BC1 to BC5, BC7 and Basis Universal; plain or Zstandard; also by
/// KHR_texture_basisu).
///
/// Elements are parsed once something shown names them, so content that nobody sees is never at
/// fault. An image that cannot be had is shown as a checker, a larger one than the limits scaled
/// down, a triangle without coordinates left out; each with a remark. Content that only refines the
/// look is skipped with a remark; a required extension that decides shapes and is not known is
/// refused.
/// Node names become unique within the model, feature names within their
/// mesh, and both lose their '/'.
///
/// # Errors
/// [`ImportError`]: file, what, where and remedy, for files that cannot be
/// read, contradict themselves or exceed the limits.
pub fn import_file(path: &Path, limits: &ImportLimits) -> Result<ImportedModel, ImportError> {
    import_file_with(path, ImportOptions { limits: Some(limits), ..ImportOptions::default() })
}

/// Options of an import: limits, the scene that is imported, and a cache.
#[derive(Clone, Copy, Default)]
pub struct ImportOptions<'a> {
    /// Limits; those of this crate where missing.
    pub limits: Option<&'a ImportLimits>,
    /// Scene to import; the default scene of the file where missing.
    pub scene: Option<&'a SceneChoice>,
    /// Cache that keeps large meshes between imports.
    pub cache: Option<&'a dyn MeshCache>,
}

/// Imports like [`import_file`], with options.
///
/// # Errors
/// Returns the errors of [`import_file`], and an error for a scene that the file does not have.
pub fn import_file_with(
    path: &Path,
    options: ImportOptions<'_>,
) -> Result<ImportedModel, ImportError> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let named = |error: ImportError| ImportError { file: path.to_owned(), ..error };
    let max_bytes = options.limits.map_or(MAX_FILE_BYTES, |limits| limits.max_file_bytes);
    let bytes =
        files::read_regular(path, max_bytes).map_err(|fault| named(fault.at("the whole file")))?;
    import_guarded(&bytes, Some(folder), options).map_err(named)
}

/// Imports the bytes of a `.gltf` or `.glb` file. Relative URIs resolve in
/// `base` and stay below it, links followed; `None` refuses all files.
///
/// # Errors
/// Returns the errors of [`import_file`].
pub fn import_bytes(
    bytes: &[u8],
    base: Option<&Path>,
    limits: &ImportLimits,
) -> Result<ImportedModel, ImportError> {
    import_guarded(bytes, base, ImportOptions { limits: Some(limits), ..ImportOptions::default() })
}

fn import_guarded(
    bytes: &[u8],
    base: Option<&Path>,
    options: ImportOptions<'_>,
) -> Result<ImportedModel, ImportError> {
    // The closure only reads, and what it builds is dropped when it unwinds.
    let imported = catch_unwind(AssertUnwindSafe(|| import(bytes, base, options)));
    imported.unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("without a message");
        Err(ImportFault::Panicked(text.to_owned()).at("the whole file"))
    })
}

fn import(
    bytes: &[u8],
    base: Option<&Path>,
    options: ImportOptions<'_>,
) -> Result<ImportedModel, ImportError> {
    let default_limits = ImportLimits::default();
    let ImportOptions { limits, scene, cache } = options;
    let limits = limits.unwrap_or(&default_limits);
    let (count, limit) = (bytes.len() as u64, limits.max_file_bytes);
    if count > limit {
        return Err(ImportFault::TooMany { what: "bytes", count, limit }.at("the whole file"));
    }
    let mut notes = Notes::default();
    let container = container::open(bytes, &mut notes)?;
    let text = document::text(container.json, &mut notes)?;
    let document = document::parse(&text, limits, &mut notes)?;
    let buffers = Buffers::new(&document, container.bin, Files::new(base, limit - count));
    let (mut nodes, shapes) = nodes::build(&buffers, scene, limits, &mut notes)?;
    let named = named_shapes(&document, (&mut nodes, shapes), &mut notes);
    let used = meshes::used_materials(&document, &named)?;
    let mut materials = materials::convert(&document, &used, &mut notes)?;

    let metadata = StructuralMetadata::parse(&document)?;
    let source =
        Source::new(&buffers, metadata, std::mem::take(&mut materials.uv_mappings), limits);
    let mut checker = Checker::new(&source, limits);
    let mut shown = Vec::new();
    for (index, shape) in named.iter().enumerate() {
        if checker.check(shape, &mut notes)? > 0 {
            shown.push(index);
        } else {
            notes.add("mesh without triangles skipped");
        }
    }
    let mut decoded = images::load(&materials.images, &buffers, limits, &mut notes);
    materials.drop_roughness_textures(&decoded.placeholders);
    let mut report = ImportReport::default();
    let cached = cache.map(|cache| CachedContent::new(cache, &buffers));
    let mut builder = Builder::new(checker, cached);
    let (mut meshes, mut features) = (Vec::new(), Vec::new());
    let mut model_mesh = vec![None; named.len()];
    let mut colors = ColorMaterials::new(&mut materials.materials, &mut decoded.textures);
    for index in shown {
        let (built, names, welded) = builder.build(&named[index], &mut colors, &mut notes)?;
        model_mesh[index] = Some(meshes.len() as u32);
        meshes.push(built);
        features.push(names);
        report.meshes.push(welded);
    }
    for node in &mut nodes {
        node.mesh = node.mesh.and_then(|mesh| model_mesh[mesh as usize]);
    }
    report.notes = notes.into_sentences();
    let materials = materials.materials;
    let model = Model { meshes, features, materials, textures: decoded.textures, nodes };
    Ok(ImportedModel { model, report })
}

/// Returns the shapes that nodes name, in the order of their meshes in the file, and gives nodes
/// their places in that order.
fn named_shapes(
    document: &Document<'_>,
    (nodes, shapes): (&mut [ModelNode], Vec<MeshShape>),
    notes: &mut Notes,
) -> Vec<MeshShape> {
    let mut is_named = vec![false; shapes.len()];
    for shape in nodes.iter().filter_map(|node| node.mesh) {
        is_named[shape as usize] = true;
    }
    let mut order: Vec<usize> = (0..shapes.len()).filter(|&shape| is_named[shape]).collect();
    order.sort_by_key(|&shape| shapes[shape].mesh);
    let mut place_of = vec![0; shapes.len()];
    for (place, &shape) in order.iter().enumerate() {
        place_of[shape] = place as u32;
    }
    for mesh in nodes.iter_mut().filter_map(|node| node.mesh.as_mut()) {
        *mesh = place_of[*mesh as usize];
    }
    let named: Vec<MeshShape> = order.into_iter().map(|shape| shapes[shape].clone()).collect();
    let meshes = named.chunk_by(|a, b| a.mesh == b.mesh).count();
    notes.add_many("mesh skipped: no node shows it", document.meshes.len() - meshes);
    named
}
