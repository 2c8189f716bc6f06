//! Section on frame rates, and the limits on them.

use crate::frames::{FrameTimes, pixel_share};
use crate::reference::{PrintedRow, TABLE_I};
use crate::run::{LARGE, SMALL};
use report_writer::Document;
use report_writer::chart::LineChart;
use report_writer::number_format::{factor, grouped, millis, percent, size, theta};
use report_writer::{Block, Chart};

use crate::Results;

pub(super) fn write(document: &mut Document, results: &Results) {
    document.heading("Frame rate");
    for times in &results.frames {
        document.table(
            &format!("{}, samples a pixel: {}", size(times.size), times.samples),
            &[
                "theta",
                "triangles",
                "frame p50, ms",
                "p99, ms",
                "FPS",
                "paper",
                "FPS / FPS(0)",
                "paper",
                "T(0) / T",
                "of the triangle ratio",
            ],
            times.rows.iter().map(|row| cells(results, times, row.theta)).collect(),
        );
    }
    document.text(format!(
        "Medians over {} frames once around the station, the same for every theta; a few steps \
         are drawn at each theta in turn. A frame counts from its beginning to the end of drawing. \
         The paper's absolute figures are those of a Quadro 1000M at an unknown resolution and do \
         not carry over; its ratios are compared.",
        results.frames.first().and_then(|f| f.rows.first()).map_or(0, |row| row.frame.count)
    ));
    document.table(
        "What bounds a frame",
        &[
            "size, samples",
            "ms without triangles",
            "ms a million triangles",
            "share without triangles, theta 0",
            "share of pixels, theta 0",
            "share of pixels, 85 %",
        ],
        results.frames.iter().map(|times| bounds(results, times)).collect(),
    );
    document.text(
        "The first two columns are a straight line through the five frame times over their \
         triangles; its constant is what no simplification saves. The share of pixels compares \
         the same frames at 1280 x 720 and at 320 x 180: what differs between them is pixels, and \
         small triangles that meet no sample at the smaller size, so that it is an upper bound.",
    );
    document.blocks.push(Block::Chart(ratios(results)));
}

fn cells(results: &Results, times: &FrameTimes, at: f64) -> Vec<String> {
    let Some(row) = times.at(at) else { return Vec::new() };
    let printed = PrintedRow::at(at);
    let (ratio, bound) = (times.fps_ratio(at), results.triangle_ratio(at));
    let share = ratio.zip(bound).map(|(ratio, bound)| ratio / bound);
    let dash = || "-".to_owned();
    vec![
        theta(at),
        grouped(row.triangles),
        millis(row.frame.p50_ms),
        millis(row.frame.p99_ms),
        format!("{:.1}", row.frame.fps()),
        printed.map_or_else(dash, |p| format!("{:.1}", p.fps)),
        factor(ratio),
        factor(printed.map(|p| p.fps_ratio())),
        factor(bound),
        factor(share),
    ]
}

fn bounds(results: &Results, times: &FrameTimes) -> Vec<String> {
    let fit = times.fit();
    let full = times.at(0.0).map_or(f64::NAN, |row| row.frame.p50_ms);
    let small = results.frames_of(SMALL, times.samples).filter(|_| times.size == LARGE);
    let pixels = |theta| {
        let share = small.and_then(|small| pixel_share(times, small, theta));
        share.map_or_else(|| "-".to_owned(), percent)
    };
    vec![
        format!("{}, {}", size(times.size), times.samples),
        millis(fit.fixed_ms),
        millis(fit.ms_per_million),
        percent((fit.fixed_ms / full).max(0.0)),
        pixels(0.0),
        pixels(0.85),
    ]
}

fn ratios(results: &Results) -> Chart {
    let at = |theta: f64, ratio: Option<f64>| Some([theta * 100.0, ratio?]);
    let mut lines = vec![
        ("paper, FPS".to_owned(), TABLE_I.map(|row| [row.theta * 100.0, row.fps_ratio()]).to_vec()),
        (
            "paper, triangles".to_owned(),
            TABLE_I.map(|row| [row.theta * 100.0, row.triangle_ratio()]).to_vec(),
        ),
    ];
    let thetas = || results.levels.iter().map(|level| level.theta).filter(|&theta| theta < 0.9);
    let ours = thetas().filter_map(|theta| at(theta, results.triangle_ratio(theta)));
    lines.push(("ours, triangles".to_owned(), ours.collect()));
    for times in results.frames.iter().filter(|times| times.samples == 1) {
        let points = thetas().filter_map(|theta| at(theta, times.fps_ratio(theta)));
        lines.push((format!("ours, {}", size(times.size)), points.collect()));
    }
    let chart = LineChart { x: "theta, %", y: "ratio to theta 0", log_y: false, lines };
    Chart {
        caption: "Frames per second over those at theta 0, and triangles at theta 0 over those at \
                  theta: what fewer triangles alone can give (1 sample a pixel)"
            .to_owned(),
        file: "ratios.svg".to_owned(),
        svg: chart.svg(),
    }
}
