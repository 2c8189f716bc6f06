//! `fleet OUT_DIR` writes the station with a fleet of transformers, their samples, and
//! `dga.json`, which opens both.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Parser;
use substation::Station;
use time::OffsetDateTime;

/// Makes a station with a fleet of transformers and seeded gas histories.
#[derive(Parser)]
struct Arguments {
    /// Folder to write to; made if it does not exist.
    out_dir: PathBuf,
    /// Decides how gases scatter.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Let the camera go to faults by itself.
    #[arg(long)]
    follow: bool,
}

fn main() -> Result<()> {
    let Arguments { out_dir, seed, follow } = Arguments::parse();
    let models_dir = out_dir.join("station");
    fs::create_dir_all(&models_dir).with_context(|| {
        format!("cannot make the folder {}: name one that you may write to", models_dir.display())
    })?;
    let station = Station::generate(1)?;
    for (name, entry) in station.catalogue.iter() {
        let bytes = busbar_gltf_export::write_glb(&entry.model)
            .with_context(|| format!("cannot encode {name}"))?;
        write(&models_dir.join(format!("{name}.glb")), &bytes)?;
    }
    let today = OffsetDateTime::now_utc().date();
    let samples = out_dir.canonicalize()?.join("samples.csv");
    write(&samples, fleet::csv(&fleet::histories(seed, today)).as_bytes())?;
    let config = fleet::configuration(&station, &samples, follow);
    write(&out_dir.join("dga.json"), serde_json::to_string_pretty(&config)?.as_bytes())
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}
