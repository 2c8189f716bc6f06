//! Any bytes are imported or refused: no panic, and what is imported can be
//! written again, which checks every index in it.
//!
//! Run on stable: `RUSTC_BOOTSTRAP=1 cargo fuzz run --fuzz-dir tests/fuzz gltf_import`.

#![no_main]

use busbar_gltf_export::write_glb;
use busbar_gltf_import::{Fault, ImportLimits, import_bytes};
use libfuzzer_sys::fuzz_target;

/// Small, so that the fuzzer's time goes into finding, not into building.
const MAX_TEXTURE_PIXELS: u64 = 1 << 16;
const MAX_TRIANGLES: u64 = 1 << 16;

fuzz_target!(|bytes: &[u8]| {
    let limits = ImportLimits {
        max_texture_pixels: MAX_TEXTURE_PIXELS,
        max_triangles: MAX_TRIANGLES,
        ..Default::default()
    };
    match import_bytes(bytes, None, &limits) {
        Ok(imported) => {
            let written = write_glb(&imported.model);
            assert!(
                written.is_ok(),
                "imported, but contradicts itself: {:?}",
                written.err()
            );
        }
        Err(error) => assert!(!matches!(error.fault, Fault::Panicked(_)), "{error}"),
    }
});
