//! Hostile files take no more time and memory than a second and 64 MB beyond
//! four times their size. One test: both are counted of the whole process.

#![allow(clippy::unwrap_used)]

mod common;

use std::time::Duration;

use busbar_gltf_import::{ImportError, ImportLimits, ImportedModel, import_file};
use peak_alloc::PeakAlloc;
use rustix::time::{ClockId, clock_gettime};

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

const MEMORY: usize = 64 << 20;
const TIME: Duration = Duration::from_secs(1);

/// Time that processors have worked for this process: however busy the machine
/// is with others, it stays the same.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec as u64, time.tv_nsec as u32)
}

/// Imports a file of `size` bytes, of which `before` are in memory already, and which
/// is refused or not. Gives what it took.
fn assert_cheap(
    (name, is_refused): (&str, bool),
    size: usize,
    before: usize,
    import: impl FnOnce() -> Result<ImportedModel, ImportError>,
) -> (usize, Duration) {
    ALLOCATOR.reset_peak_usage();
    let usage = ALLOCATOR.current_usage();
    let start = processor_time();
    let refused = import().is_err();
    let time = processor_time() - start;
    let taken = ALLOCATOR.peak_usage() - usage;
    assert_eq!(refused, is_refused, "{name}");
    let allowed = MEMORY + 4 * size - before;
    assert!(taken <= allowed, "{name}: {taken} bytes taken, {allowed} allowed");
    assert!(time <= TIME, "{name}: {time:?}");
    (taken, time)
}

#[test]
fn hostile_files_take_little_time_and_memory() {
    let mut costs = Vec::new();
    for case in common::hostile::cases() {
        let size = case.bytes.len();
        costs.push(assert_cheap((case.name, true), size, size, || common::import(&case.bytes)));
    }
    for case in common::hostile::broken_images() {
        let size = case.bytes.len();
        costs.push(assert_cheap((case.name, false), size, size, || common::import(&case.bytes)));
    }
    let folder = tempfile::tempdir().unwrap();
    let path = common::hostile::write_one_file_named_often(folder.path());
    let files = std::fs::read_dir(folder.path()).unwrap();
    let size: u64 = files.map(|file| file.unwrap().metadata().unwrap().len()).sum();
    costs.push(assert_cheap(("one file named often", true), size as usize, 0, || {
        import_file(&path, &ImportLimits::default())
    }));
    let (taken, times): (Vec<_>, Vec<_>) = costs.into_iter().unzip();
    println!("worst: {:?} bytes, {:?}", taken.iter().max(), times.iter().max());
}
