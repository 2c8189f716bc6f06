//! `demo_model OUT_DIR` writes the demo models and prints a line about each.
#![allow(clippy::print_stdout, reason = "the summary is this program's output")]

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result};
use busbar_scene::Model;
use clap::Parser;

/// Generator of the demo models.
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
    println!(
        "{:<20} {:>6} {:>6} {:>9} {:>10} {:>9}",
        "file", "nodes", "meshes", "vertices", "triangles", "KiB"
    );
    for (file, model) in [
        ("transformer.glb", demo_model::power_transformer()?),
        ("breaker.glb", demo_model::breaker_pole()?),
        ("disconnector.glb", demo_model::disconnector_pole()?),
        ("yard.glb", demo_model::yard()?),
    ] {
        let bytes = busbar_gltf_export::write_glb(&model)
            .with_context(|| format!("cannot encode {file}"))?;
        let path = out_dir.join(file);
        fs::write(&path, &bytes).with_context(|| format!("cannot write {}", path.display()))?;
        let (vertices, triangles) = shown(&model);
        println!(
            "{file:<20} {:>6} {:>6} {vertices:>9} {triangles:>10} {:>9}",
            model.nodes.len(),
            model.meshes.len(),
            bytes.len().div_ceil(1024)
        );
    }
    Ok(())
}

/// Counts welded vertices and triangles as shown: every instance counts.
fn shown(model: &Model) -> (usize, usize) {
    let meshes = model.nodes.iter().filter_map(|node| model.meshes.get(node.mesh? as usize));
    meshes.fold((0, 0), |(v, t), mesh| (v + mesh.positions.len(), t + mesh.triangles.len()))
}
