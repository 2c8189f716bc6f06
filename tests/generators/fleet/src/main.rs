//! `fleet OUT_DIR` writes the station with a fleet of transformers and their samples into the
//! folder `models`, and `dga.json`, which opens both, beside it.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Parser;
use substation::Station;
use time::OffsetDateTime;

/// Generator of a station with a fleet of transformers and seeded gas histories.
#[derive(Parser)]
struct Arguments {
    /// Folder to write to; made if it does not exist.
    out_dir: PathBuf,
    /// Seed of the gas histories.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Let the camera go to faults by itself.
    #[arg(long)]
    follow: bool,
    /// Give each transformer so many samples of a monitor instead of those of a laboratory.
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    monitored: Option<u32>,
}

fn main() -> Result<()> {
    let Arguments { out_dir, seed, follow, monitored } = Arguments::parse();
    let folder = out_dir.join(fleet::FOLDER);
    let models_dir = folder.join("station");
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
    let rows = match monitored {
        None => fleet::histories(seed, today),
        Some(count) => fleet::monitored(seed, count as usize, today),
    };
    write(&folder.join(fleet::SAMPLES), fleet::csv(&rows).as_bytes())?;
    write(&out_dir.join("dga.json"), fleet::text(&station, follow).as_bytes())
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}
