//! Results as Markdown and HTML for people, and as JSON.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use report_writer::number_format::grouped;
use report_writer::{Claim, Document, Verdict, machine};
use serde::Serialize;
use serde_json::json;

use crate::frames::LevelFrames;
use crate::many_stations::{BIRD, FILLING, MAX_ERROR_PX, ManyStations, SOME_STATIONS, STATIONS};
use crate::renderer_process::OURS;
use crate::screen_error::{PathResult, PictureSimilarity};
use crate::startup::{EMPTY_CACHE, F3D, FULL_CACHE, Startup};

/// Greatest ratio of Busbar's frame time to the best peer's at equal triangles.
const MAX_FRAME_RATIO: f64 = 0.9;
/// Lowest ratio of the frame rate with theta from the screen error to that of the best peer.
const MIN_SPEED_UP: f64 = 3.0;
const MIN_SSIM: f64 = 0.98;
const MAX_FLIP: f64 = 0.03;
/// Greatest ratio of a cached start to that of F3D.
const MAX_CACHED_START: f64 = 0.5;
/// Greatest ratio of a frame with a hundred stations to one with a single station.
const MAX_MANY_FRAME: f64 = 1.5;
const MAX_MANY_MEMORY: f64 = 1.2;
/// Greatest processor time of a frame of 10,000 instances, milliseconds.
const MAX_CPU_MILLIS: f64 = 1.0;

/// Results of all sections.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Results {
    pub(crate) frames: Vec<LevelFrames>,
    pub(crate) followed: Vec<PathResult>,
    pub(crate) starts: Vec<Startup>,
    pub(crate) many: Vec<ManyStations>,
}

/// Writes the report; returns its files.
pub(crate) fn write(results: &Results, folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = report_writer::write(&document(results), folder)?.to_vec();
    let path = folder.join("report.json");
    let bars: Vec<_> = bars(results)
        .iter()
        .map(|bar| json!({ "bar": bar.claim, "verdict": bar.verdict.word(), "figure": bar.figure }))
        .collect();
    let value = json!({ "machine": machine(), "results": results, "bars": bars });
    fs::write(&path, serde_json::to_vec_pretty(&value)?)
        .with_context(|| format!("cannot write {}", path.display()))?;
    files.push(path);
    Ok(files)
}

/// Judges the bars of this project.
pub(crate) fn bars(results: &Results) -> Vec<Claim> {
    let mut bars = frame_bars(&results.frames);
    bars.extend(results.followed.iter().flat_map(followed_bars));
    bars.extend(start_bars(&results.starts));
    bars.extend(many_bars(&results.many));
    bars
}

fn bar(claim: String, reached: bool, figure: String) -> Claim {
    Claim { claim, verdict: Verdict::of_bar(reached), figure }
}

/// Judges Busbar's frames beside those of the fastest peer at each level.
fn frame_bars(frames: &[LevelFrames]) -> Vec<Claim> {
    let ours = frames.iter().filter(|frames| frames.who == OURS);
    let judged = ours.filter_map(|ours| {
        let others = frames
            .iter()
            .filter(|f| f.who != OURS && (f.samples, f.share) == (ours.samples, ours.share));
        let best = others.min_by(|a, b| a.millis.p50.total_cmp(&b.millis.p50))?;
        let ratio = ours.millis.p50 / best.millis.p50;
        Some(bar(
            format!(
                "{:.0} % of the triangles, {}: a frame in at most {MAX_FRAME_RATIO} of the best peer's time",
                ours.share * 100.0,
                samples(ours.samples),
            ),
            ratio <= MAX_FRAME_RATIO,
            format!("{:.1} ms, {} {:.1} ms: {ratio:.2}", ours.millis.p50, best.who, best.millis.p50),
        ))
    });
    judged.collect()
}

fn followed_bars(followed: &PathResult) -> Vec<Claim> {
    let PathResult { path, likeness, millis, peer, .. } = followed;
    let speed = peer.map(|(who, peer)| {
        let times = peer.p50 / millis.p50;
        bar(
            format!("{path} path at {MAX_ERROR_PX} px: at least {MIN_SPEED_UP} times the frame rate of the best peer at full detail"),
            times >= MIN_SPEED_UP,
            format!("{:.1} ms, {who} {:.1} ms: {times:.1} times", millis.p50, peer.p50),
        )
    });
    let alike = likeness_bar(&format!("{path} path"), likeness);
    speed.into_iter().chain([alike]).collect()
}

fn likeness_bar(what: &str, likeness: &PictureSimilarity) -> Claim {
    let PictureSimilarity { least_ssim, greatest_flip } = *likeness;
    bar(
        format!("{what}: SSIM at least {MIN_SSIM} and FLIP at most {MAX_FLIP} to full detail"),
        least_ssim >= MIN_SSIM && greatest_flip <= MAX_FLIP,
        format!("SSIM {least_ssim:.4}, FLIP {greatest_flip:.4}, each of the worst picture"),
    )
}

fn start_bars(starts: &[Startup]) -> Vec<Claim> {
    let of = |who| starts.iter().find(|start| start.who == who);
    let (Some(empty), Some(full), Some(f3d)) = (of(EMPTY_CACHE), of(FULL_CACHE), of(F3D)) else {
        return Vec::new();
    };
    let seconds =
        |ours: &Startup| format!("{:.2} s, F3D {:.2} s", ours.seconds.p50, f3d.seconds.p50);
    let peak = empty.peak_bytes.max(full.peak_bytes);
    vec![
        bar(
            "first full picture, sequence built as well: at most F3D's time".into(),
            empty.seconds.p50 <= f3d.seconds.p50,
            seconds(empty),
        ),
        bar(
            format!("first full picture, with cache: at most {MAX_CACHED_START} of F3D's time"),
            full.seconds.p50 <= MAX_CACHED_START * f3d.seconds.p50,
            seconds(full),
        ),
        bar(
            "peak memory at most F3D's".into(),
            peak <= f3d.peak_bytes,
            format!("{}, F3D {}", megabytes(peak), megabytes(f3d.peak_bytes)),
        ),
    ]
}

fn many_bars(many: &[ManyStations]) -> Vec<Claim> {
    let mut bars = Vec::new();
    for all in many.iter().filter(|many| many.stations == STATIONS) {
        let one_from = |view| many.iter().find(|one| (one.stations, one.view) == (1, view));
        let Some(one) = one_from(all.view) else { continue };
        let what = format!("{STATIONS} stations, {}", all.view);
        let frame_bar = |one, which| many_frame_bar(&what, [all, one], which);
        // From above all, one covers no pixel: it is compared where it fills the picture as they do.
        bars.extend(match all.view {
            BIRD => one_from(FILLING).map(|one| frame_bar(one, "one that fills it so")),
            _ => Some(frame_bar(one, "one from there")),
        });
        bars.extend(all.likeness.iter().map(|likeness| likeness_bar(&what, likeness)));
        let ratio = all.peak_bytes as f64 / one.peak_bytes as f64;
        bars.push(bar(
            format!("{what}: memory at most {MAX_MANY_MEMORY} times that of one"),
            ratio <= MAX_MANY_MEMORY,
            format!(
                "{}, {}: {ratio:.2} times",
                megabytes(all.peak_bytes),
                megabytes(one.peak_bytes)
            ),
        ));
    }
    for some in many.iter().filter(|many| many.stations == SOME_STATIONS) {
        bars.push(bar(
            format!(
                "10,380 instances, {}: processor time of a frame before the device at most {MAX_CPU_MILLIS} ms",
                some.view
            ),
            some.cpu_millis.p50 <= MAX_CPU_MILLIS,
            format!("{:.2} ms", some.cpu_millis.p50),
        ));
    }
    bars
}

fn many_frame_bar(what: &str, [all, one]: [&ManyStations; 2], which: &str) -> Claim {
    let ratio = all.millis.p50 / one.millis.p50;
    let covered = [all, one].map(|many| many.covered_share * 100.0);
    bar(
        format!("{what}: a frame in at most {MAX_MANY_FRAME} times that of {which}"),
        ratio <= MAX_MANY_FRAME,
        format!(
            "{:.1} ms on {:.1} % of the pixels, {:.1} ms on {:.1} %: {ratio:.2} times",
            all.millis.p50, covered[0], one.millis.p50, covered[1]
        ),
    )
}

fn document(results: &Results) -> Document {
    let mut document =
        Document { title: "Frames beside other viewers".into(), ..Default::default() };
    document.text(format!(
        "The paper's substation, {} pixels, everyone on one core of the same software rasteriser and \
         without antialiasing, one directional light, in alternating rounds; a frame counts until \
         its picture is finished. Measured on {}.",
        report_writer::number_format::size(crate::renderer_process::SIZE),
        machine(),
    ));
    document.heading("Bars");
    document.blocks.push(report_writer::Block::Claims(bars(results)));
    document.heading("Frames at equal triangles");
    let rows = results.frames.iter().map(|f| {
        vec![
            format!("{:.0} % {}", f.share * 100.0, f.who),
            grouped(f.triangles),
            format!("{:.1}", f.millis.p50),
            format!("{:.1}", f.millis.p99),
            megabytes(f.peak_bytes),
        ]
    });
    document.table(
        "Around the whole scene, ms",
        &["", "triangles", "median", "99th percentile", "peak memory"],
        rows.collect(),
    );
    document.heading("Theta by the error on the screen");
    let rows = results.followed.iter().map(|f| {
        vec![
            f.path.to_owned(),
            grouped(f.triangles),
            format!("{:.1}", f.millis.p50),
            format!("{:.1}", f.full_millis.p50),
            f.peer.map_or_else(|| "none".into(), |(who, peer)| format!("{:.1} ({who})", peer.p50)),
        ]
    });
    document.table(
        "ms a frame, medians; triangles of the last",
        &["path", "triangles", "followed", "full detail", "best peer, full detail"],
        rows.collect(),
    );
    document.heading("From start to first picture");
    let rows = results
        .starts
        .iter()
        .map(|s| vec![s.who.to_owned(), format!("{:.2}", s.seconds.p50), megabytes(s.peak_bytes)]);
    document.table(
        "Whole processes, to the written picture",
        &["", "s", "peak memory"],
        rows.collect(),
    );
    document.heading("Many stations");
    let rows = results.many.iter().map(|m| {
        vec![
            format!("{} from {}", m.stations, m.view),
            format!("{:.1} %", m.covered_share * 100.0),
            grouped(m.triangles),
            format!("{:.1}", m.millis.p50),
            format!("{:.2}", m.cpu_millis.p50),
            format!("{:.2}", m.hide_millis.p50),
            megabytes(m.peak_bytes),
        ]
    });
    document.table(
        "Each 865 pieces of equipment, 1,057,086 triangles; theta by the error on the screen; within leaps 20 m from frame to frame, walking 0.2 m",
        &["stations", "pixels covered", "triangles", "ms a frame", "of it before the device, ms", "for what is hidden, ms", "peak memory"],
        rows.collect(),
    );
    document
}

fn samples(samples: u32) -> String {
    if samples == 1 { "1 sample".into() } else { format!("{samples} samples") }
}

fn megabytes(bytes: u64) -> String {
    format!("{:.0} MB", bytes as f64 / 1e6)
}
