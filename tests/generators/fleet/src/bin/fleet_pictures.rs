//! `fleet_pictures FLEET DENSE OUT_DIR` makes the pictures of the chart: `FLEET` and `DENSE` are
//! folders that `fleet` wrote, the second one with `--monitored`.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use busbar_chart::{Action, Brush, Layout};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{ChartCommand, Stats, Viewer, renderer_options};
use clap::Parser;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// Size of pictures, pixels, for files of at most half a megabyte.
const SIZE: [u32; 2] = [960, 540];
/// Size of pictures with panels, pixels.
const PANELS_SIZE: [u32; 2] = [1600, 900];
/// Longest time until a million samples are read, judged and counted.
const MAX_WAIT: Duration = Duration::from_secs(300);
/// Index of the axis of H2 among all; others follow.
const H2: usize = 0;
const C2H2: usize = 4;
/// Transformer with overheating and discharges, whose verdict is shown.
const EXPLAINED: &str = "=S12T8-TA1";

#[derive(Parser)]
struct Arguments {
    /// Folder with the fleet.
    fleet: PathBuf,
    /// Folder with the fleet and a million samples.
    dense: PathBuf,
    /// Output folder of the pictures.
    out_dir: PathBuf,
}

fn main() -> Result<()> {
    let Arguments { fleet, dense, out_dir } = Arguments::parse();
    let save = |view: &mut View, name: &str| view.save(&out_dir.join(format!("{name}.png")));
    let brush = |axis, low| {
        let brush = Brush::Ranges { axis, ranges: vec![[low, f32::MAX]], with_missing: false };
        Action::AddBrush { brush, alone: true }
    };
    let mut view = View::open(&fleet, SIZE)?;
    save(&mut view, "chart")?;
    view.act(brush(C2H2, 2.0))?;
    save(&mut view, "chart_brushed")?;
    view.act(Action::ClearBrushes)?;
    view.viewer.use_camera("chart_above")?;
    view.act(Action::SetLayout(Layout::Focus))?;
    save(&mut view, "chart_focus")?;
    view.viewer.use_camera("chart_aslant")?;
    view.act(Action::SetLayout(Layout::Time))?;
    view.viewer.select_equipment(EXPLAINED);
    view.frames(2)?;
    save(&mut view, "chart_time")?;

    let mut view = View::open(&fleet, PANELS_SIZE)?;
    view.viewer.set_panels_shown(true);
    view.viewer.select_equipment(EXPLAINED);
    view.frames(4)?;
    save(&mut view, "chart_verdict")?;

    let mut view = View::open(&dense, SIZE)?;
    save(&mut view, "chart_density")?;
    view.act(brush(H2, 200.0))?;
    save(&mut view, "chart_density_brushed")
}

struct View {
    viewer: Viewer,
    seconds: f64,
}

impl View {
    /// Opens a view once all records are there.
    fn open(folder: &Path, size: [u32; 2]) -> Result<Self> {
        let path = folder.join("dga.json");
        let scene = LoadedScene::load(&path, &|_, _, _| {})?;
        let options = renderer_options(&scene);
        let viewer = Viewer::new_headless(scene, options, size)?;
        let mut view = Self { viewer, seconds: 0.0 };
        let begun = Instant::now();
        let is_there = |stats: &Stats| {
            stats.chart.as_ref().is_some_and(|chart| chart.records > 0 && !chart.is_counting)
        };
        while !is_there(&view.viewer.stats()) {
            if begun.elapsed() > MAX_WAIT {
                bail!("the chart of {} has no records", path.display());
            }
            view.frames(1)?;
        }
        view.frames(2)?;
        Ok(view)
    }

    fn frames(&mut self, count: u32) -> Result<()> {
        for _ in 0..count {
            self.seconds += 0.1;
            let input = self.viewer.headless_input(self.seconds);
            self.viewer.frame(input)?;
        }
        Ok(())
    }

    fn act(&mut self, action: Action) -> Result<()> {
        self.viewer.apply_chart_command(&ChartCommand::Apply(action));
        self.frames(2)
    }

    fn save(&mut self, path: &Path) -> Result<()> {
        let picture = self.viewer.read_picture()?;
        let rgb: Vec<u8> = picture
            .rgba8
            .chunks_exact(4)
            .flat_map(|pixel| [pixel[0], pixel[1], pixel[2]])
            .collect();
        let file =
            File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
        let writer = BufWriter::new(file);
        let encoder =
            PngEncoder::new_with_quality(writer, CompressionType::Best, FilterType::Adaptive);
        encoder.write_image(&rgb, picture.width, picture.height, ExtendedColorType::Rgb8)?;
        Ok(())
    }
}
