//! Silence in the host: every overlay plugin in one site, with values, faults, gaps, hidden layers,
//! reloads, killed processes and a replayed recording.
//!
//! A seeded walk changes inputs and whatever is around them. An oracle that shares nothing with the
//! plugins enumerates the completions of what is missing: a piece is never normal where its inputs
//! admit the abnormal, and not unknown where all completions agree. The alarm of each piece is
//! active exactly if the last known verdict was abnormal.

mod oracle;
mod recording;
mod station;
mod walk;

use walk::Walk;

/// Environment variable with the number of steps of the walk.
const STEPS_VARIABLE: &str = "BUSBAR_HOST_SILENCE_STEPS";
/// Steps without that variable: a sample for every run of the tests.
const DEFAULT_STEPS: u64 = 40;
/// Steps after which a walk begins anew, with another seed and another site.
const STEPS_A_WALK: u64 = 200;

#[test]
fn no_piece_is_normal_or_unknown_without_cause_whatever_happens_around_it() {
    let set = std::env::var(STEPS_VARIABLE).ok();
    let steps = set.and_then(|text| text.parse().ok()).unwrap_or(DEFAULT_STEPS);
    let (mut left, mut seed) = (steps, 39);
    while left > 0 {
        let steps = left.min(STEPS_A_WALK);
        let counts = Walk::begin(seed).run(steps);
        // A walk that judges nothing would find nothing.
        assert!(counts.normal > steps && counts.abnormal > steps, "seed {seed}: {counts:?}");
        assert!(counts.unknown > steps, "seed {seed}: {counts:?}");
        (left, seed) = (left - steps, seed + 1);
    }
}

#[test]
fn a_replayed_recording_is_judged_by_its_own_time() {
    recording::replay();
}
