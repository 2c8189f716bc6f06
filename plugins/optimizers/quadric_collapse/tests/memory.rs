//! The memory that one large shell takes. Alone, so that nothing else counts.
#![allow(clippy::print_stdout, reason = "figures for whoever runs it by name")]

#[allow(dead_code, reason = "shared with the other tests")]
mod common;

use std::time::Instant;

use common::{optimize_within, sphere};
use peak_alloc::PeakAlloc;
use quadric_collapse::{Limits, Settings};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Bytes a triangle beyond the input.
const MAX_BYTES: usize = 200;
/// The same for shells that are worked on in parts.
const MAX_BYTES_IN_PARTS: usize = 150;

/// Peak bytes a triangle of a sphere of 12 n^2 triangles, beyond the input.
fn bytes_a_triangle(n: u32) -> usize {
    let mesh = sphere(n);
    let triangles = mesh.triangles.len();
    // What the call copies to hand the mesh over.
    let input = mesh.positions.len() * 12 + triangles * 12 + mesh.wedges.len() * 20;
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let start = Instant::now();
    let mut progress = busbar_plugin_sdk::Progress::detached();
    // Each thread has a part at hand.
    let limits = Limits { threads: 2, ..Limits::default() };
    let list = optimize_within(&limits, &mesh, Settings::default(), &mut progress)
        .expect("nothing stops it");
    let used = (MEMORY.peak_usage() - before - input) / triangles;
    assert_eq!(list.collapses.len(), mesh.positions.len() - 1);
    println!("{triangles} triangles: {used} bytes each, {:?}", start.elapsed());
    used
}

/// One test, so that nothing else allocates.
#[test]
fn memory_is_bounded() {
    let whole = bytes_a_triangle(70);
    assert!(whole <= MAX_BYTES, "{whole} bytes a triangle");
    let parts = bytes_a_triangle(200);
    assert!(parts <= MAX_BYTES_IN_PARTS, "{parts} bytes a triangle in parts");
}

/// By name: `cargo test --release -p quadric_collapse --test memory -- --ignored --nocapture`.
#[test]
#[ignore = "takes half a minute and 3 GB"]
fn ten_million_triangles_in_bounded_memory() {
    let used = bytes_a_triangle(920);
    assert!(used <= MAX_BYTES_IN_PARTS, "{used} bytes a triangle");
}
