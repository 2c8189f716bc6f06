//! Fuzzing of the glTF import: any bytes are imported or refused without a panic. An imported model
//! can be written again, which checks every index in it.

use busbar_gltf_export::write_glb;
use busbar_gltf_import::{ImportFault, ImportLimits, import_bytes};

/// Limits of the import, small so that the time goes into parsing.
const MAX_TEXTURE_PIXELS: u64 = 1 << 16;
const MAX_TRIANGLES: u64 = 1 << 16;

/// Runs one input; reports whether the model is accepted.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let limits = ImportLimits {
        max_texture_pixels: MAX_TEXTURE_PIXELS,
        max_triangles: MAX_TRIANGLES,
        ..Default::default()
    };
    match import_bytes(bytes, None, &limits) {
        Ok(imported) => {
            let written = write_glb(&imported.model);
            assert!(written.is_ok(), "imported, but contradicts itself: {:?}", written.err());
            true
        }
        Err(error) => {
            assert!(!matches!(error.fault, ImportFault::Panicked(_)), "{error}");
            false
        }
    }
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("gltf_import", fuzz_one);
}
