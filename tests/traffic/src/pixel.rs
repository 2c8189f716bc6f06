//! From a change at its source to the picture that shows it.

use std::time::{Duration, Instant, SystemTime};

use anyhow::{Result, ensure};
use busbar_tags::{TagHandle, Value};
use document::Series;
use serde::Serialize;
use serde_json::json;

use crate::site::Site;

/// Between two changes; no multiple of a frame, so that they come at any time of one.
const PERIOD: Duration = Duration::from_millis(137);
const CHANGES: u64 = 200;
const MAX_WAIT: Duration = Duration::from_secs(120);

/// What was measured.
#[derive(Debug, Serialize)]
pub(crate) struct Latency {
    /// Milliseconds from the value's source time until a picture with it was read back.
    pub(crate) millis: Series,
    /// Milliseconds of a frame, reading it back among them.
    pub(crate) frame_millis: Series,
}

pub(crate) fn measure(site: &Site) -> Result<Latency> {
    let settings = json!({
        "updates_per_second": 1.0 / PERIOD.as_secs_f64(),
        "batch_millis": 1,
    });
    let (mut viewer, _) = site.view(&settings, 1, "f64", 1)?;
    let (mut latencies, mut frames) = (Vec::new(), Vec::new());
    let (mut before, mut shown) = (None, None::<bool>);
    let start = Instant::now();
    while (latencies.len() as u64) < CHANGES / site.divisor {
        ensure!(start.elapsed() < MAX_WAIT, "the picture does not follow the value");
        let began = Instant::now();
        let input = viewer.headless_input(start.elapsed().as_secs_f64());
        viewer.frame(input)?;
        let picture = viewer.read_picture()?;
        let seen = SystemTime::now();
        frames.push(began.elapsed().as_secs_f64() * 1e3);
        let state = viewer.tags().state(TagHandle(0));
        let is_high = state.and_then(|state| match state.value {
            Some(Value::F64(value)) => Some(value > 50.0),
            _ => None,
        });
        let looks = is_alarmed(&picture);
        let is_new = before.replace(looks) != Some(looks);
        // The table may be a frame ahead of the overlay: the picture decides.
        if is_new && is_high.is_some() && is_high != shown {
            shown = is_high;
            let source_time = state.and_then(|state| state.source_time?.to_system_time());
            let age = source_time.and_then(|time| seen.duration_since(time).ok());
            latencies.extend(age.map(|age| age.as_secs_f64() * 1e3));
        }
    }
    Ok(Latency { millis: Series::of(latencies), frame_millis: Series::of(frames) })
}

/// Whether the equipment has the colour of an alarm.
fn is_alarmed(picture: &busbar_viewer::Picture) -> bool {
    let is_red = |pixel: &&[u8]| pixel[0] > 90 && pixel[0] / 2 > pixel[1].max(pixel[2]);
    let red = picture.rgba8.chunks_exact(4).filter(is_red);
    red.count() > 200
}
