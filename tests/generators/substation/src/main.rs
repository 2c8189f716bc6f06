//! `substation OUT_DIR` writes the station, its flattened form and its points.
#![allow(clippy::print_stdout, reason = "the summary is this program's output")]

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use substation::{Station, StationRecords};

/// Folder of the scenarios, beside the configuration.
const SCENARIO_FOLDER: &str = "scenarios";

/// Generator of the paper's 220 kV substation.
#[derive(Parser)]
struct Arguments {
    /// Folder to write to; made if it does not exist.
    out_dir: PathBuf,
    /// Decides how the equipment stands within erection tolerance.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> Result<()> {
    let Arguments { out_dir, seed } = Arguments::parse();
    let models_dir = out_dir.join("station");
    fs::create_dir_all(&models_dir).with_context(|| {
        format!("cannot make the folder {}: name one that you may write to", models_dir.display())
    })?;
    let station = Station::generate(seed)?;
    let files = station.catalogue.iter().count() as u64 + 5;
    // Hidden by itself where the output is not a terminal.
    let progress = ProgressBar::new(files);
    progress.set_style(ProgressStyle::with_template("{bar:30} {pos}/{len} {msg}")?);

    for (name, entry) in station.catalogue.iter() {
        let file = format!("{name}.glb");
        progress.set_message(file.clone());
        let bytes = busbar_gltf_export::write_glb(&entry.model)
            .with_context(|| format!("cannot encode {file}"))?;
        write(&models_dir.join(file), &bytes)?;
        progress.inc(1);
    }
    let json = serde_json::to_string_pretty(&station.configuration())?;
    write(&out_dir.join("station.json"), json.as_bytes())?;
    progress.inc(1);
    let mut live = station.live_configuration(|switch| switch.closed);
    let records = StationRecords::generate(&station, seed);
    // Plugins do not know where the configuration is.
    records.add_to(&mut live, &fs::canonicalize(&out_dir)?);
    records.write(&out_dir).context("cannot write the records")?;
    write(&out_dir.join("live.json"), serde_json::to_string_pretty(&live)?.as_bytes())?;
    progress.inc(1);
    fs::create_dir_all(out_dir.join(SCENARIO_FOLDER))?;
    for scenario in substation::scenarios() {
        let json = serde_json::to_string_pretty(&scenario.events)?;
        let file = format!("{SCENARIO_FOLDER}/{}.json", scenario.name);
        write(&out_dir.join(file), json.as_bytes())?;
    }
    let points = substation::points();
    write(&out_dir.join("points.csv"), substation::csv(&points).as_bytes())?;
    progress.inc(1);
    progress.set_message("paper.glb");
    let flat = station.flatten()?;
    write(&out_dir.join("paper_equipment.csv"), flat.equipment_csv().as_bytes())?;
    progress.inc(1);
    write(&out_dir.join("paper.glb"), &busbar_gltf_export::write_glb(&flat.model)?)?;
    progress.inc(1);
    progress.finish_and_clear();
    print_summary(&station, points.len())
}

fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

fn print_summary(station: &Station, points: usize) -> Result<()> {
    println!("{:<28} {:>9} {:>10} {:>6} {:>10}", "model", "vertices", "triangles", "uses", "shown");
    let uses = station.uses();
    let mut unique = 0;
    for (name, entry) in station.catalogue.iter() {
        let (counts, uses) = (entry.counts, uses.get(name).copied().unwrap_or(0));
        unique += counts.triangles;
        let shown = uses * counts.triangles;
        println!(
            "{name:<28} {:>9} {:>10} {uses:>6} {shown:>10}",
            counts.vertices, counts.triangles
        );
    }
    let total = station.counts()?;
    println!(
        "{} vertices, {} triangles, 2V - T = {}",
        total.vertices,
        total.triangles,
        2 * total.vertices - total.triangles
    );
    println!(
        "{} pieces of equipment, {unique} unique triangles, {points} points",
        station.placements.len()
    );
    Ok(())
}
