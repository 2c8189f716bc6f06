//! Devices of a serial line or behind a gateway that do not answer.

use std::collections::{BTreeMap, BTreeSet};

use busbar_link::{Backoff, ReconnectBounds};
use tokio::time::Instant;

use crate::address::Point;

/// Register of silent units and of when each is asked again: units that are off do not hold
/// up the line.
#[derive(Debug)]
pub(crate) struct Units {
    count: usize,
    delays: ReconnectBounds,
    silent: BTreeMap<u8, Silence>,
    /// Units that the gateway does not reach.
    unreachable: BTreeSet<u8>,
    /// Exceptions of each unit that say that it cannot answer now.
    exceptions: BTreeMap<u8, u64>,
}

#[derive(Debug)]
struct Silence {
    backoff: Backoff,
    retry_at: Instant,
}

impl Units {
    pub(crate) fn new(points: &[Point], delays: ReconnectBounds) -> Self {
        let all: BTreeSet<_> = points.iter().map(|point| point.unit).collect();
        Self {
            count: all.len(),
            delays,
            silent: BTreeMap::new(),
            unreachable: BTreeSet::new(),
            exceptions: BTreeMap::new(),
        }
    }

    /// Reports whether a unit is silent and not to be asked yet.
    pub(crate) fn is_left_alone(&self, unit: u8, now: Instant) -> bool {
        self.silent.get(&unit).is_some_and(|silence| now < silence.retry_at)
    }

    /// Notes that a unit did not answer, and leaves it alone for a while; true where it was not
    /// silent before.
    pub(crate) fn note_silence(&mut self, unit: u8, now: Instant) -> bool {
        let count = self.silent.len();
        let new = || Silence { backoff: Backoff::new(self.delays), retry_at: now };
        let silence = self.silent.entry(unit).or_insert_with(new);
        silence.retry_at = now + silence.backoff.next_delay();
        self.silent.len() > count
    }

    /// Notes that a unit answered; true where it had been silent or out of reach.
    pub(crate) fn note_answer(&mut self, unit: u8) -> bool {
        self.silent.remove(&unit).is_some() | self.unreachable.remove(&unit)
    }

    /// Notes that the gateway does not reach a unit; true where it did before.
    pub(crate) fn note_unreachable(&mut self, unit: u8) -> bool {
        self.silent.remove(&unit);
        self.unreachable.insert(unit)
    }

    /// Counts an exception by which a unit cannot answer now. Returns the count where it is to be
    /// logged: 1, 10, 100 and so on.
    pub(crate) fn count_exception(&mut self, unit: u8) -> Option<u64> {
        let count = self.exceptions.entry(unit).or_default();
        *count = count.saturating_add(1);
        Some(*count).filter(|count| *count == 10_u64.pow(count.ilog10()))
    }

    /// Reports whether all units are silent.
    pub(crate) fn are_all_silent(&self) -> bool {
        self.silent.len() >= self.count
    }

    /// Lists the silent and unreachable units, for operators; none if all answer.
    pub(crate) fn silent(&self) -> Option<String> {
        let silent = listed("no answer from", self.silent.keys());
        let unreachable = listed("the gateway does not reach", self.unreachable.iter());
        let texts: Vec<_> = silent.into_iter().chain(unreachable).collect();
        (!texts.is_empty()).then(|| texts.join("; "))
    }
}

fn listed<'a>(what: &str, units: impl Iterator<Item = &'a u8>) -> Option<String> {
    let units: Vec<_> = units.map(u8::to_string).collect();
    let plural = if units.len() > 1 { "s" } else { "" };
    (!units.is_empty()).then(|| format!("{what} unit{plural} {}", units.join(", ")))
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use busbar_plugin_sdk::testing::{host, tag_spec};
    use busbar_plugin_sdk::{Plugin, ValueKind};
    use serde_json::json;

    use super::*;
    use crate::{ModbusAdapter, address};

    #[test]
    fn silent_units_are_left_alone_longer_and_longer() {
        let settings = serde_json::from_value(json!({"serial": {"device": "/dev/ttyS0"}}));
        let adapter = ModbusAdapter::create(settings.unwrap(), host()).unwrap();
        let tags = [1, 7].map(|unit| {
            let address = json!({"table": "coil", "register": 0, "unit": unit});
            tag_spec(unit, "tag", ValueKind::Bool, address)
        });
        let points = address::parse(&tags, &adapter.config).unwrap();
        let mut units = Units::new(&points, adapter.config.reconnect);
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs(seconds);
        assert_eq!(units.silent(), None);
        assert!(units.note_silence(7, start));
        // Between one second and two, then two and four, at most thirty.
        assert!(units.is_left_alone(7, start) && !units.is_left_alone(7, after(2)));
        assert!(!units.note_silence(7, start));
        assert!(units.is_left_alone(7, after(1)) && !units.is_left_alone(7, after(4)));
        for _ in 0..10 {
            units.note_silence(7, start);
        }
        assert!(units.is_left_alone(7, after(14)) && !units.is_left_alone(7, after(30)));
        assert_eq!(units.silent().unwrap(), "no answer from unit 7");
        assert!(!units.are_all_silent() && !units.is_left_alone(1, start));
        units.note_silence(1, start);
        assert_eq!(units.silent().unwrap(), "no answer from units 1, 7");
        assert!(units.are_all_silent());
        assert!(units.note_answer(7) && !units.note_answer(7));
        assert!(!units.are_all_silent());
        assert!(units.note_unreachable(7) && !units.note_unreachable(7));
        let text = "no answer from unit 1; the gateway does not reach unit 7";
        assert_eq!(units.silent().unwrap(), text);
        assert!(units.note_answer(7) && !units.note_answer(7));
        let told: Vec<_> = (0..150).filter_map(|_| units.count_exception(7)).collect();
        assert_eq!(told, [1, 10, 100]);
    }
}
