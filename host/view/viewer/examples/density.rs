//! Benchmark of brushing, counting and drawing polylines on nine axes: on the device, and by a
//! plain loop on one core without drawing. Both results must be equal.
//!
//! `cargo run --release -p busbar_viewer --example density [RECORDS]`
#![allow(clippy::print_stdout, reason = "the table is this program's output")]

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use busbar_chart::{
    Axis, Brush, BrushOperator, Brushes, Description, Layout, Record, Records, State, bin_edges,
    bin_pairs,
};
use busbar_renderer::{
    BrushedAxis, CameraView, DensityInput, DensityPlane, Frame, Polylines, Renderer,
    RendererOptions,
};
use fastrand::Rng;
use glam::Vec3;

const AXES: usize = 9;
/// Records that are appended at once.
const PAGE: usize = 1 << 16;
const ROUNDS: usize = 5;
/// Size of the drawn picture, pixels.
const SIZE: [u32; 2] = [1280, 720];

fn main() -> Result<(), Box<dyn Error>> {
    let count = std::env::args().nth(1).map_or(Ok(1_000_000), |count| count.parse())?;
    let records = records(count)?;
    let views: Vec<_> =
        (0..AXES).map(|index| busbar_chart::AxisView::new(index, &axis())).collect();
    let pairs = Layout::Flat.pairs(AXES);
    let ranges = [[10.0, 100.0], [1000.0, f32::MAX]];
    let brush = |axis, ranges: &[[f32; 2]]| Brush::Ranges {
        axis,
        ranges: ranges.to_vec(),
        with_missing: false,
    };
    let brushes = Brushes {
        operator: BrushOperator::And,
        list: vec![brush(2, &ranges), brush(6, &ranges[..1])],
    };
    let brushed = [
        BrushedAxis { axis: 2, ranges: &ranges, with_missing: false },
        BrushedAxis { axis: 6, ranges: &ranges[..1], with_missing: false },
    ];
    let shown: Vec<_> = views.iter().map(|view| (view.axis, bin_edges(view))).collect();
    let options = RendererOptions { samples: 1, ..RendererOptions::default() };
    let mut renderer = Renderer::headless(options, SIZE)?;
    let mut input = DensityInput {
        revision: 1,
        arrangement: 1,
        axes: AXES,
        values: records.values(),
        binned_axes: &shown,
        flipped: &[false; AXES],
        pairs: &pairs,
        brushes: &[],
        any: false,
        record_filter: None,
        brush_filter: None,
    };
    let start = Instant::now();
    renderer.count_records(&input)?;
    let first = start.elapsed();
    input.brushes = &brushed;
    let mut device = Vec::new();
    let mut counted = None;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        counted = Some(renderer.count_records(&input)?);
        device.push(start.elapsed());
    }
    let mut drawn = Vec::new();
    for round in 0..ROUNDS {
        let start = Instant::now();
        draw(&mut renderer, round as u64)?;
        drawn.push(start.elapsed());
    }
    let mut plain = Vec::new();
    let mut twin = None;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        let meant = brushes.select(&records, &views);
        let all = bin_pairs(&records, &views, &pairs, |_| true);
        let of_meant = bin_pairs(&records, &views, &pairs, |record| meant[record]);
        plain.push(start.elapsed());
        twin = Some((meant, all, of_meant));
    }
    let (Some(counted), Some((meant, all, of_meant))) = (counted, twin) else { return Ok(()) };
    let bit = |record: usize| counted.mask[record / 32] >> (record % 32) & 1 == 1;
    assert!((0..count).all(|record| bit(record) == meant[record]), "other records are meant");
    assert!(counted.all == all && counted.brushed == of_meant, "counts differ");
    device.sort();
    plain.sort();
    drawn.sort();
    println!("{count} records on {AXES} axes, {}", renderer.device_name());
    println!(
        "brushed: {}, the same by both, and so are all counts",
        meant.iter().filter(|m| **m).count()
    );
    println!("upload and first count: {:8.1} ms", first.as_secs_f64() * 1e3);
    println!(
        "brush and count, device: {:7.1} ms (median of {ROUNDS})",
        device[ROUNDS / 2].as_secs_f64() * 1e3
    );
    println!(
        "draw, {} x {} pixels: {:6.1} ms (median of {ROUNDS})",
        SIZE[0],
        SIZE[1],
        drawn[ROUNDS / 2].as_secs_f64() * 1e3
    );
    println!(
        "brush and count, one core: {:5.1} ms (median of {ROUNDS})",
        plain[ROUNDS / 2].as_secs_f64() * 1e3
    );
    Ok(())
}

/// Draws the last density count across the whole view, and waits for the device.
fn draw(renderer: &mut Renderer, revision: u64) -> Result<(), Box<dyn Error>> {
    let place = |axis: usize| Vec3::new(axis as f32 / (AXES - 1) as f32 * 3.2 - 1.6, -0.9, 0.0);
    let plane = |pair: usize| DensityPlane {
        from: place(pair),
        to: place(pair + 1),
        height: 1.8,
        color: [72, 76, 82],
        brushed: Some([10, 12, 16]),
    };
    let planes: Vec<_> = (0..AXES - 1).map(plane).collect();
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let camera = CameraView::look_at(Vec3::Z * 2.2, Vec3::ZERO, Vec3::Y, 0.9, aspect, 0.1);
    let polylines = Polylines { revision, faces: &[], planes: &planes, strokes: &[] };
    let frame =
        Frame { background: [1.0; 3], polylines: Some(polylines), ..Frame::new(camera, &[]) };
    renderer.draw(&frame)?;
    Ok(renderer.finish()?)
}

fn axis() -> Axis {
    Axis {
        name: "gas".into(),
        unit: "ppm".into(),
        log: true,
        low: 0.1,
        high: 1e5,
        ..Axis::default()
    }
}

/// Seeded records over six decades, one value in twenty missing.
fn records(count: usize) -> Result<Records, Box<dyn Error>> {
    let description = Arc::new(Description {
        axes: vec![axis(); AXES],
        legend: vec![State::default()],
        equipment: vec!["=T1".into()],
        ..Description::default()
    });
    let mut random = Rng::with_seed(1);
    let mut records = Records::new(&description);
    for first in (0..count).step_by(PAGE) {
        let rows: Vec<_> = (first..(first + PAGE).min(count))
            .map(|record| Record { unix_nanos: record as i64, equipment: 0, state: 0 })
            .collect();
        let value = |_| match random.u8(..20) {
            0 => f32::NAN,
            _ => 10f32.powf(random.f32() * 6.0 - 1.0),
        };
        let values: Vec<f32> = (0..rows.len() * AXES).map(value).collect();
        records.append(&rows, &values, 1)?;
    }
    Ok(records)
}
