//! Installation of the layer into a program's environment.

use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result};
use serde_json::json;

/// Name of the layer in its manifest.
pub const LAYER_NAME: &str = "VK_LAYER_BUSBAR_faults";
/// Name of the validation layer, which sits above: it sees calls fail as the program does.
pub const VALIDATION_LAYER_NAME: &str = "VK_LAYER_KHRONOS_validation";

/// Makes a program's Vulkan go through the layer in this library, below the
/// validation layer. `folder` gets the manifest.
///
/// # Errors
/// When the manifest cannot be written.
pub fn install(command: &mut Command, library: &Path, folder: &Path) -> Result<()> {
    let manifest = json!({
        "file_format_version": "1.1.0",
        "layer": {
            "name": LAYER_NAME,
            "type": "GLOBAL",
            "library_path": library,
            "api_version": "1.3.0",
            "implementation_version": "1",
            "description": "Lets calls fail, for tests",
        },
    });
    let path = folder.join("busbar_faults.json");
    std::fs::write(&path, manifest.to_string())
        .with_context(|| format!("cannot write {}", path.display()))?;
    // The first is nearest to the program.
    command.env("VK_INSTANCE_LAYERS", format!("{VALIDATION_LAYER_NAME}:{LAYER_NAME}"));
    command.env("VK_ADD_LAYER_PATH", folder);
    Ok(())
}
