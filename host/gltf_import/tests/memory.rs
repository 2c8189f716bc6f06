//! Hostile files take no more time and memory than a second and 64 MB beyond
//! four times their size. One test: the count is of the whole process.

#![allow(clippy::unwrap_used)]

mod common;

use std::time::{Duration, Instant};

use peak_alloc::PeakAlloc;

#[global_allocator]
static ALLOCATOR: PeakAlloc = PeakAlloc;

const MEMORY: usize = 64 << 20;
const TIME: Duration = Duration::from_secs(1);

#[test]
fn hostile_files_take_little_time_and_memory() {
    let mut worst_bytes = 0;
    let mut worst_time = Duration::ZERO;
    for case in common::hostile::cases() {
        ALLOCATOR.reset_peak_usage();
        let before = ALLOCATOR.current_usage();
        let start = Instant::now();
        let refused = common::import(&case.bytes).is_err();
        let time = start.elapsed();
        let taken = ALLOCATOR.peak_usage() - before;
        assert!(refused, "{} was accepted", case.name);
        // The file itself was there before: three times its size is left.
        let allowed = MEMORY + 3 * case.bytes.len();
        assert!(taken <= allowed, "{}: {taken} bytes taken, {allowed} allowed", case.name);
        assert!(time <= TIME, "{}: {time:?}", case.name);
        if time > Duration::from_millis(100) || taken > 8 << 20 {
            println!("{}: {} bytes, {taken} taken, {time:?}", case.name, case.bytes.len());
        }
        worst_bytes = worst_bytes.max(taken);
        worst_time = worst_time.max(time);
    }
    println!("worst: {worst_bytes} bytes, {worst_time:?}");
}
