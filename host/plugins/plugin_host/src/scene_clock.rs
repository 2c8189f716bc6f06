//! Scene clock: the time that the values of a frame are of.

use std::time::SystemTime;

use busbar_tags::{SourceTime, TagState};
use busbar_types::Origin;

/// Clocks of one frame, from which each overlay gets the one of its own values.
#[derive(Clone, Copy, Debug)]
pub struct SceneClock {
    /// Time of the wall clock.
    pub wall: SystemTime,
    /// Time that recorded values are of, as the plugin that replays them reports it.
    pub recorded: Option<SourceTime>,
}

impl SceneClock {
    /// The time of values that are all live.
    pub fn live(wall: SystemTime) -> Self {
        Self { wall, recorded: None }
    }

    /// The time that these values are of: the recording's as soon as one of them is
    /// recorded, else the wall clock's. A recording that reports none is as far as its
    /// newest source time.
    pub fn time_of_values<'a>(&self, states: impl Iterator<Item = &'a TagState>) -> SystemTime {
        let mut newest = None;
        let mut has_recorded = false;
        for state in states {
            if state.origin.contains(Origin::RECORDED) {
                has_recorded = true;
                newest = newest.max(state.source_time);
            }
        }
        if !has_recorded {
            return self.wall;
        }
        self.recorded.or(newest).and_then(SourceTime::to_system_time).unwrap_or(self.wall)
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use busbar_types::{Quality, Value};

    use super::*;

    fn state(origin: Origin, source_seconds: Option<i64>) -> TagState {
        TagState {
            value: Some(Value::F64(1.0)),
            quality: Quality::Good,
            report_quality: Quality::Good,
            age: None,
            source_time: source_seconds.map(|seconds| SourceTime(seconds * 1_000_000_000)),
            origin,
        }
    }

    #[test]
    fn recorded_values_have_the_time_of_their_recording() {
        let at = |seconds| UNIX_EPOCH + Duration::from_secs(seconds);
        let live = state(Origin::LIVE, Some(7));
        let recorded = state(Origin::RECORDED, Some(9));
        let without_time = state(Origin::RECORDED, None);
        let reported = SceneClock { wall: at(100), recorded: Some(SourceTime(50_000_000_000)) };
        let unreported = SceneClock::live(at(100));
        let time = |clock: &SceneClock, states: &[TagState]| clock.time_of_values(states.iter());
        let both = [live.clone(), recorded];
        assert_eq!(
            time(&reported, std::slice::from_ref(&live)),
            at(100),
            "no value of it is recorded"
        );
        assert_eq!(time(&reported, &both), at(50));
        assert_eq!(time(&unreported, &both), at(9));
        assert_eq!(time(&unreported, &[without_time]), at(100));
    }
}
