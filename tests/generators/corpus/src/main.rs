//! `corpus OUT_DIR` writes the meshes and prints a line about each.
#![allow(clippy::print_stdout, reason = "the summary is this program's output")]

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::Parser;

/// Generator of the meshes that optimisers are judged on.
#[derive(Parser)]
struct Arguments {
    /// Folder to write to; made if it does not exist.
    out_dir: PathBuf,
}

fn main() -> Result<()> {
    let Arguments { out_dir } = Arguments::parse();
    fs::create_dir_all(&out_dir).with_context(|| {
        format!("cannot make the folder {}: name one that you may write to", out_dir.display())
    })?;
    println!("{:<14} {:>9} {:>9} {:>10} {:>9}", "file", "positions", "wedges", "triangles", "KiB");
    for (file, model) in [("breaker.glb", corpus::breaker()?), ("scan.glb", corpus::scan()?)] {
        let bytes = busbar_gltf_export::write_glb(&model)
            .with_context(|| format!("cannot encode {file}"))?;
        let path = out_dir.join(file);
        fs::write(&path, &bytes).with_context(|| format!("cannot write {}", path.display()))?;
        for mesh in &model.meshes {
            println!(
                "{file:<14} {:>9} {:>9} {:>10} {:>9}",
                mesh.positions.len(),
                mesh.wedges.len(),
                mesh.triangles.len(),
                bytes.len().div_ceil(1024)
            );
        }
    }
    Ok(())
}
