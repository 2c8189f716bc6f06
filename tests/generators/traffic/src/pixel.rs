//! Latency from a change at its source to the picture that shows it.

use std::time::{Duration, Instant, SystemTime};

use anyhow::{Result, ensure};
use busbar_tags::TagHandle;
use busbar_types::Value;
use report_writer::Series;
use serde::Serialize;
use serde_json::json;

use crate::scene::GeneratedScene;

/// Time between two changes; no multiple of a frame, so that they come at any phase of one.
const PERIOD: Duration = Duration::from_millis(137);
const CHANGES: u64 = 200;
/// Least change in the warmth of the whole picture, of 255.
const CHANGE: f64 = 0.5;
const MAX_WAIT: Duration = Duration::from_secs(120);

/// Results of the measurement.
#[derive(Debug, Serialize)]
pub(crate) struct Latency {
    /// Milliseconds from the value's source time until a picture with it was read back.
    pub(crate) millis: Series,
    /// Milliseconds of a frame, including the read-back.
    pub(crate) frame_millis: Series,
}

pub(crate) fn measure(site: &GeneratedScene) -> Result<Latency> {
    let settings = json!({
        "updates_per_second": 1.0 / PERIOD.as_secs_f64(),
        "batch_seconds": 0.001,
    });
    let (mut viewer, _) = site.view(&settings, 1, "f64", 1)?;
    let (mut latencies, mut frames) = (Vec::new(), Vec::new());
    let (mut before, mut shown) = (None::<f64>, None::<bool>);
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
        let is_high = state.as_ref().and_then(|state| match state.value {
            Some(Value::F64(value)) => Some(value > 50.0),
            _ => None,
        });
        let warmth = warmth(&picture);
        let is_new = before.is_some_and(|before: f64| (warmth - before).abs() > CHANGE);
        before = Some(warmth);
        // The table may be a frame ahead of the overlay: the picture decides.
        if is_new && is_high.is_some() && is_high != shown {
            shown = is_high;
            let source_time = state.and_then(|state| state.source_time?.to_system_time());
            let age = source_time.and_then(|time| seen.duration_since(time).ok());
            latencies.extend(age.map(|age| age.as_secs_f64() * 1e3));
        }
    }
    Ok(Latency {
        millis: Series::from_values(latencies),
        frame_millis: Series::from_values(frames),
    })
}

/// Returns the excess of red over blue in the picture; values outside their limits are drawn in a
/// warm colour.
fn warmth(picture: &busbar_viewer::Picture) -> f64 {
    let pixels = picture.rgba8.as_chunks::<4>().0;
    let warmth = pixels.iter().map(|[red, _, blue, _]| f64::from(*red) - f64::from(*blue));
    warmth.sum::<f64>() / pixels.len().max(1) as f64
}
