//! The memory that one large shell takes. Alone, so that nothing else counts.

#[allow(dead_code, reason = "shared with the other tests")]
mod common;

use common::{optimize_with, sphere};
use peak_alloc::PeakAlloc;
use quadric_collapse::Settings;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Bytes a triangle beyond the input.
const MAX_BYTES: usize = 200;

#[test]
fn memory_is_bounded() {
    let mesh = sphere(90);
    let triangles = mesh.triangles.len();
    // What the call copies to hand the mesh over.
    let input = mesh.positions.len() * 12 + triangles * 12 + mesh.wedges.len() * 20;
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let mut progress = busbar_plugin_sdk::Progress::unwatched();
    let list = optimize_with(&mesh, Settings::default(), &mut progress).unwrap();
    let used = (MEMORY.peak_usage() - before - input) / triangles;
    assert!(list.collapses.len() > 10_000);
    println!("{used} bytes a triangle");
    assert!(used <= MAX_BYTES, "{used} bytes a triangle");
}
