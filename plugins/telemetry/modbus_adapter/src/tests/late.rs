//! Serial devices that answer too late, or for others.

use super::line::Line;
use super::peer::{Libmodbus, Place};
use super::*;

/// Rounds of late answers.
const ROUNDS: u64 = 10;
/// Delays that leave no pause for late answers to come in.
const AT_ONCE: ReconnectBounds =
    ReconnectBounds { min: Duration::from_millis(1), max: Duration::from_millis(4) };

#[test]
fn a_late_answer_lands_on_no_tag() {
    let (Some(libmodbus), Some(line)) = (Libmodbus::compile(), Line::lay()) else { return };
    let mut peer = libmodbus.start(&Place::Serial(line.theirs()));
    peer.command("stamp");
    let mut settings = line.settings();
    settings["timeout_seconds"] = json!(0.1);
    let running = start_with(settings, AT_ONCE, stamps::tags());
    let mut random = fastrand::Rng::with_seed(8);
    for round in 0..ROUNDS {
        let good = |seen: &Recording| {
            stamps::TAGS
                .iter()
                .all(|tag| seen.latest(*tag).is_some_and(|sample| sample.quality.is_good()))
        };
        assert!(running.recorder.wait_until(PATIENCE, good), "round {round}");
        // Within the wait for silence, after it, and in the middle of others.
        let (millis, count) = (random.u32(110..700), random.u32(1..4));
        peer.command(&format!("late {millis} {count}"));
        let bad = |seen: &Recording| {
            stamps::TAGS.iter().any(|tag| seen.latest(*tag).is_some_and(|s| !s.quality.is_good()))
        };
        assert!(running.recorder.wait_until(PATIENCE, bad), "round {round}");
    }
    let counts = stamps::check(&running.recorder.recording());
    assert!(counts.iter().all(|count| *count as u64 >= ROUNDS), "{counts:?}");
}
