//! Latency from a value that the program sets to the pixel that shows it.
//!
//! `BUSBAR_EMBED_VALUES` says how often that is measured.

mod common;

use std::time::{Duration, Instant};

use busbar::abi::*;
use common::*;

/// Default number of values.
const VALUES: usize = 20;
/// Longest latency on a busy machine that draws in software. The figure that counts is printed
/// beside the frame time.
const MAX_LATENCY: Duration = Duration::from_secs(2);

#[test]
#[allow(clippy::print_stderr)]
fn a_value_is_seen_soon() {
    let told = std::env::var("BUSBAR_EMBED_VALUES").ok();
    let values = told.map_or(VALUES, |told| told.parse().expect("a number"));
    let scene = scene();
    let mut host = Host::open(&scene);
    host.look_around();
    let mut latencies = Vec::new();
    for number in 0..values {
        let before = host.wait_for_calm();
        let set = Instant::now();
        host.set_tag(TOP_OIL, if number % 2 == 0 { 31.5 } else { 28.0 });
        host.wait_for_frame("that shows it", |frame| frame.pixels != before.pixels);
        latencies.push(set.elapsed());
    }
    let mut frames = frame_times(&mut host);
    let ms = |times: &mut [Duration], share| percentile(times, share).as_secs_f64() * 1e3;
    let (p50, p99) = (ms(&mut latencies, 0.5), ms(&mut latencies, 0.99));
    let (frame, frame_99) = (ms(&mut frames, 0.5), ms(&mut frames, 0.99));
    eprintln!(
        "{values} values: seen after {p50:.0} ms (p50), {p99:.0} ms (p99); a frame takes \
         {frame:.0} ms (p50), {frame_99:.0} ms (p99); at 640 x 360"
    );
    assert!(latencies.iter().all(|latency| *latency < MAX_LATENCY), "{latencies:?}");
}

/// Times from picture to picture while each differs from the one before.
fn frame_times(host: &mut Host) -> Vec<Duration> {
    let (mut times, mut last) = (Vec::new(), Instant::now());
    let mut sequence = host.frame().expect("there is one").sequence;
    for number in 1_u8..40 {
        let eye = [40.0, 25.0 + f64::from(number) * 0.05, 30.0];
        // SAFETY: an open view and three numbers each.
        let look = |view| unsafe {
            busbar::commands::busbar_view_look(view, eye.as_ptr(), [0.0, 3.0, 0.0].as_ptr())
        };
        assert_eq!(host.call(look), BusbarStatus::Ok);
        let next = host.wait_for_frame("after it", |frame| frame.sequence != sequence);
        sequence = next.sequence;
        times.push(last.elapsed());
        last = Instant::now();
    }
    // The first one waited for what came before.
    times.split_off(1)
}
