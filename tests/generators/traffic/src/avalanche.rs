//! Avalanche of changes: all switches of a large station change within a second.

use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use busbar_tags::{Event, MAX_EVENTS};
use report_writer::Series;
use serde::Serialize;
use serde_json::json;

use crate::scene::GeneratedScene;

/// Number of switches, and of changes a second.
pub(crate) const SWITCHES: u64 = 10_000;
/// Number of avalanches, each of which changes every switch once.
const AVALANCHES: u64 = 5;
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Results of the measurement.
#[derive(Debug, Serialize)]
pub(crate) struct Avalanche {
    /// Number of changes that were made.
    pub(crate) made: u64,
    /// Number of changes in the sequence of events.
    pub(crate) noted: u64,
    /// Flag for changes recorded in the order in which they were made.
    pub(crate) in_order: bool,
    /// Seconds that the source took for all changes.
    pub(crate) seconds: f64,
    /// Milliseconds from the end of a frame to that of the next.
    pub(crate) gap_millis: Series,
}

pub(crate) fn measure(site: &GeneratedScene) -> Result<Avalanche> {
    let switches = SWITCHES / site.divisor;
    let made = AVALANCHES * switches;
    ensure!(made as usize <= MAX_EVENTS, "more events than are kept");
    let settings = json!({
        "updates_per_second": switches, "updates": made, "batch_seconds": 0.001, "delay_seconds": 1.5,
    });
    let (mut viewer, _) = site.view(&settings, switches, "double_point", 14)?;
    let (start, mut last, mut gaps) = (Instant::now(), None::<Instant>, Vec::new());
    while viewer.events().count() < made && start.elapsed() < MAX_WAIT {
        let input = viewer.headless_input(start.elapsed().as_secs_f64());
        viewer.frame(input)?;
        let now = Instant::now();
        // Before the avalanche, the first frames make pipelines.
        if let Some(last) = last.replace(now)
            && viewer.events().count() > 0
        {
            gaps.push((now - last).as_secs_f64() * 1e3);
        }
    }
    let events: Vec<Event> = viewer.events().events().cloned().collect();
    let expected = (0..made).map(|number| (number, (number % switches) as u32));
    let in_order = events.iter().map(|event| (event.number, event.change.tag.0)).eq(expected);
    let at = |event: Option<&Event>| event.and_then(|event| event.change.source_time);
    let nanos = match (at(events.first()), at(events.last())) {
        (Some(first), Some(last)) => last.0 - first.0,
        _ => 0,
    };
    Ok(Avalanche {
        made,
        noted: viewer.events().count(),
        in_order,
        seconds: nanos as f64 / 1e9,
        gap_millis: Series::from_values(gaps),
    })
}
