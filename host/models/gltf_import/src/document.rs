//! JSON bytes to the document, in the types of `gltf::json`.

use gltf::json::Root;
use serde_path_to_error::Segment;

use crate::ImportLimits;
use crate::error::{ImportError, ImportFault};
use crate::extensions::{MESH_FEATURES, STRUCTURAL_METADATA, TEXTURE_BASISU};
use crate::limits::MAX_JSON_BYTES;
use crate::report::Notes;
use crate::scan::{json_fault, pointer_step, scan};

/// Extensions that change how data is read, and are understood here.
const SUPPORTED_EXTENSIONS: &[&str] =
    &[MESH_FEATURES, STRUCTURAL_METADATA, TEXTURE_BASISU, "KHR_mesh_quantization"];

/// Parses the JSON of a file and checks version and extensions.
pub(crate) fn parse(
    json: &[u8],
    limits: &ImportLimits,
    notes: &mut Notes,
) -> Result<Root, ImportError> {
    let count = json.len() as u64;
    if count > MAX_JSON_BYTES {
        let limit = MAX_JSON_BYTES;
        return Err(
            ImportFault::TooMany { what: "bytes of JSON", count, limit }.at("the whole file")
        );
    }
    scan(json, limits)?;
    let parser = &mut serde_json::Deserializer::from_slice(json);
    let root: Root = serde_path_to_error::deserialize(parser)
        .map_err(|e| json_fault(e.inner()).at(pointer(e.path())))?;
    check_version(&root)?;
    check_extensions(&root, notes)?;
    note_skipped(&root, notes);
    Ok(root)
}

fn check_version(root: &Root) -> Result<(), ImportError> {
    let asset = &root.asset;
    let needed = asset.min_version.as_ref().unwrap_or(&asset.version);
    let supported = match &asset.min_version {
        Some(minimum) => minimum == "2.0",
        None => asset.version.starts_with("2."),
    };
    if supported {
        Ok(())
    } else {
        Err(ImportFault::Version(shortened(needed)).at("/asset/version"))
    }
}

fn check_extensions(root: &Root, notes: &mut Notes) -> Result<(), ImportError> {
    let supported = |name: &str| SUPPORTED_EXTENSIONS.contains(&name);
    for (index, name) in root.extensions_required.iter().enumerate() {
        if !supported(name) {
            let place = format!("/extensionsRequired/{index}");
            return Err(ImportFault::Extension(shortened(name)).at(place));
        }
    }
    for name in root.extensions_used.iter().filter(|n| !supported(n)) {
        notes.add(format!("extension '{}' ignored: it is not supported", shortened(name)));
    }
    Ok(())
}

fn note_skipped(root: &Root, notes: &mut Notes) {
    notes.add_many("animation skipped", root.animations.len());
    notes.add_many("camera skipped", root.cameras.len());
    notes.add_many("skin skipped: its mesh is shown as modelled", root.skins.len());
}

/// Shortens a text from the file for a message.
pub(crate) fn shortened(text: &str) -> String {
    let end = text.floor_char_boundary(crate::limits::MAX_NAME_BYTES);
    let dots = if end < text.len() { "..." } else { "" };
    format!("{}{dots}", &text[..end])
}

/// Returns the place where a parser stopped, as a JSON pointer.
pub(crate) fn pointer(path: &serde_path_to_error::Path) -> String {
    let steps = path.iter().filter_map(|segment| match segment {
        Segment::Seq { index } => Some(format!("/{index}")),
        Segment::Map { key } => Some(format!("/{}", pointer_step(key))),
        Segment::Enum { .. } | Segment::Unknown => None,
    });
    let pointer: String = steps.collect();
    if pointer.is_empty() { "the top of the JSON".into() } else { pointer }
}
