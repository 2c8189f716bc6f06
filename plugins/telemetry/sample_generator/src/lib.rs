//! Generator of samples at a given rate, without a device: load for tests and benchmarks. It is
//! never shipped.
//!
//! Tags are updated one after the other, round after round. In round `n` a whole number
//! is `n`, a number 0 or 100 in turn, a single point off or on, a double-point open or
//! closed, a text `Text n`; the source time is that of publishing. Or a script words them
//! (`script.rs`).

mod script;

use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

use busbar_plugin_sdk::{
    DoublePoint, Error, Host, LinkState, Plugin, Quality, Sample, SampleFlags, SampleSink,
    StopToken, TagSpec, Telemetry, Text, Value, ValueKind, Worker, export_plugin,
};

use crate::script::Script;

/// Greatest number of updates published at once.
const MAX_BATCH: u64 = 1 << 17;
/// Longest time between two batches, seconds.
const MAX_BATCH_SECONDS: f64 = 10.0;
/// Shortest time between two batches, seconds.
const MIN_BATCH_SECONDS: f64 = 0.001;

/// Settings of the generator.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Updates a second, of all tags together.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub updates_per_second: f64,
    /// Seconds between two batches.
    #[schemars(range(min = MIN_BATCH_SECONDS, max = MAX_BATCH_SECONDS))]
    #[schemars(extend("x-busbar-formerly" = ["batch_millis"]))]
    pub batch_seconds: f64,
    /// Seconds before the first update.
    #[schemars(range(min = 0.0, max = MAX_BATCH_SECONDS))]
    #[schemars(extend("x-busbar-formerly" = ["delay_millis"]))]
    pub delay_seconds: f64,
    /// Number of updates in all; none for no end.
    pub updates: Option<u64>,
    /// Path of a script with the samples, instead of all the other settings.
    pub script: Option<PathBuf>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            updates_per_second: 1000.0,
            batch_seconds: MIN_BATCH_SECONDS,
            delay_seconds: 0.0,
            updates: None,
            script: None,
        }
    }
}

/// Telemetry plugin that generates samples.
pub struct SampleGenerator {
    settings: Settings,
    host: Host,
    worker: Option<Worker>,
}

impl Plugin for SampleGenerator {
    const ID: &'static str = "sample_generator";
    const NAME: &'static str = "Sample generator";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Samples at a given rate, for tests and benches.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        let is_rate = (0.0..=1e9).contains(&settings.updates_per_second);
        let is_period = (MIN_BATCH_SECONDS..=MAX_BATCH_SECONDS).contains(&settings.batch_seconds);
        let is_delay = (0.0..=MAX_BATCH_SECONDS).contains(&settings.delay_seconds);
        if !is_rate || !is_period || !is_delay {
            return Err(Error::settings(format!(
                "updates_per_second is from 0 to 10^9, batch_seconds from {MIN_BATCH_SECONDS} \
                 to {MAX_BATCH_SECONDS}, delay_seconds at most that"
            )));
        }
        Ok(Self { settings, host, worker: None })
    }
}

impl Telemetry for SampleGenerator {
    const ORIGIN: SampleFlags = SampleFlags::SIMULATED;

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        let settings = self.settings.clone();
        let script =
            settings.script.as_deref().map(|path| Script::read(path, &tags)).transpose()?;
        let worker = Worker::start(&self.host, "samples", move |running| {
            sink.report_link(LinkState::Up, "generating");
            if let Some(script) = script {
                return script.play(&tags, &sink, running);
            }
            if running.wait(Duration::from_secs_f64(settings.delay_seconds)) {
                publish(&settings, &tags, &sink, running);
            }
        })?;
        self.worker = Some(worker);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
    }
}

fn publish(settings: &Settings, tags: &[TagSpec], sink: &SampleSink, running: &StopToken) {
    let last = if tags.is_empty() { 0 } else { settings.updates.unwrap_or(u64::MAX) };
    let (start, mut sent) = (Instant::now(), 0);
    let mut batch = Vec::new();
    while sent < last && running.wait(Duration::from_secs_f64(settings.batch_seconds)) {
        let due = (start.elapsed().as_secs_f64() * settings.updates_per_second) as u64;
        let due = due.min(last).min(sent + MAX_BATCH);
        let now = Some(SystemTime::now());
        batch.clear();
        batch.extend((sent..due).map(|number| {
            let tag = &tags[(number % tags.len() as u64) as usize];
            let value = value(tag.kind, number / tags.len() as u64);
            Sample {
                tag: tag.tag,
                value: Some(value),
                quality: Quality::Good,
                source_time: now,
                flags: SampleFlags::LIVE,
            }
        }));
        sink.publish(&batch);
        sent = due;
    }
    sink.report_link(LinkState::Up, "done");
}

fn value(kind: ValueKind, round: u64) -> Value {
    let odd = round % 2 == 1;
    match kind {
        ValueKind::F64 => Value::F64(if odd { 100.0 } else { 0.0 }),
        ValueKind::I64 => Value::I64(round as i64),
        ValueKind::Bool => Value::Bool(odd),
        ValueKind::DoublePoint => {
            Value::DoublePoint(if odd { DoublePoint::On } else { DoublePoint::Off })
        }
        ValueKind::Text => Value::Text(Text::cut(&format!("Text {round}"))),
    }
}

export_plugin!(SampleGenerator: telemetry);

#[cfg(test)]
mod tests {
    use busbar_plugin_sdk::Reason;
    use busbar_plugin_sdk::testing::{Recorder, TestClock, tag_spec};

    use super::*;

    #[test]
    fn as_many_updates_as_are_asked_for_tag_after_tag() {
        let (clock, recorder) = (TestClock::new(), Recorder::new());
        let settings =
            Settings { updates_per_second: 1e6, updates: Some(7), ..Settings::default() };
        let mut generator = SampleGenerator::create(settings, clock.host()).unwrap();
        let address = serde_json::json!({});
        let tags = [ValueKind::I64, ValueKind::Bool, ValueKind::Text];
        let tags =
            tags.into_iter().zip(0..).map(|(kind, tag)| tag_spec(tag, "t", kind, address.clone()));
        generator.start(tags.collect(), recorder.sink()).unwrap();
        let came =
            |count| move |seen: &busbar_plugin_sdk::testing::Recording| seen.samples.len() >= count;
        for _ in 0..100 {
            clock.advance(Duration::from_millis(1));
            if recorder.wait_until(Duration::from_millis(20), came(7)) {
                break;
            }
        }
        generator.stop();
        let samples = recorder.recording().samples;
        let values: Vec<_> = samples.into_iter().map(|sample| (sample.tag, sample.value)).collect();
        let (number, point) = (|n| Some(Value::I64(n)), |on| Some(Value::Bool(on)));
        let text = |text: &str| Some(Value::Text(Text::cut(text)));
        assert_eq!(
            values,
            [
                (0, number(0)),
                (1, point(false)),
                (2, text("Text 0")),
                (0, number(1)),
                (1, point(true)),
                (2, text("Text 1")),
                (0, number(2)),
            ]
        );
    }

    #[test]
    fn a_script_is_played_from_now_on() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("script.json");
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
        let good = |value: serde_json::Value, age: Option<i64>| {
            serde_json::json!([{ "tag": "t", "value": value, "quality": "good",
                "age_millis": age }])
        };
        let script = serde_json::json!({
            // What is due in the first seconds is past.
            "start_unix_millis": now.as_millis() as u64 - 2_000,
            "sent": "sent", "first": "first",
            "batches": [
                { "at_millis": 0, "samples": good(1.into(), None) },
                { "at_millis": 2_200, "samples": good("nan".into(), Some(500)) },
                { "at_millis": 2_210, "samples": good(2.into(), None) },
            ],
        });
        std::fs::write(&path, script.to_string()).unwrap();
        let settings = Settings { script: Some(path.clone()), ..Settings::default() };
        let clock = TestClock::new();
        let mut generator = SampleGenerator::create(settings.clone(), clock.host()).unwrap();
        let kinds = [("t", ValueKind::F64), ("sent", ValueKind::I64), ("first", ValueKind::I64)];
        let tags = kinds.into_iter().zip(0..);
        let tags: Vec<_> =
            tags.map(|((id, kind), tag)| tag_spec(tag, id, kind, serde_json::json!({}))).collect();
        let recorder = Recorder::new();
        generator.start(tags.clone(), recorder.sink()).unwrap();
        for _ in 0..100 {
            clock.advance(Duration::from_secs(1));
            if recorder.wait_until(Duration::from_millis(20), |seen| seen.samples.len() >= 6) {
                break;
            }
        }
        generator.stop();
        let samples = recorder.recording().samples;
        assert!(matches!(samples[0].value, Some(Value::F64(value)) if value.is_nan()));
        assert!(samples[0].source_time.is_some() && samples[3].source_time.is_none());
        let counts = [1, 2, 4, 5].map(|index: usize| samples[index].value.clone());
        assert_eq!(counts, [1, 2, 1, 3].map(|count| Some(Value::I64(count))));
        std::fs::write(&path, "{").unwrap();
        let mut broken = SampleGenerator::create(settings, clock.host()).unwrap();
        assert!(broken.start(tags, recorder.sink()).is_err());
    }

    #[test]
    fn a_script_has_texts_for_text_tags_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("script.json");
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
        let start = now.as_millis() as u64 + 20_000;
        let tags = [("mode", ValueKind::Text), ("load", ValueKind::F64), ("n", ValueKind::I64)];
        let tags: Vec<_> = (0..)
            .zip(tags)
            .map(|(tag, (id, kind))| tag_spec(tag, id, kind, serde_json::json!({})))
            .collect();
        let play = |tag: &str, values: &[serde_json::Value]| {
            let sample = |value| serde_json::json!({"tag": tag, "value": value, "quality": "good"});
            let samples: Vec<_> = values.iter().map(sample).collect();
            let script = serde_json::json!({
                "start_unix_millis": start, "sent": "sent", "first": "first",
                "batches": [{ "at_millis": 0, "samples": samples }],
            });
            std::fs::write(&path, script.to_string()).unwrap();
            let settings = Settings { script: Some(path.clone()), ..Settings::default() };
            let (clock, recorder) = (TestClock::new(), Recorder::new());
            let mut generator = SampleGenerator::create(settings, clock.host()).unwrap();
            generator.start(tags.clone(), recorder.sink())?;
            for _ in 0..100 {
                clock.advance(Duration::from_secs(1));
                if recorder.wait_until(Duration::from_millis(20), |seen| !seen.samples.is_empty()) {
                    break;
                }
            }
            generator.stop();
            Ok(recorder.recording().samples.into_iter().map(|s| (s.value, s.quality)).collect())
        };
        let text = |text: &str| Some(Value::Text(Text::cut(text)));
        let long = "x".repeat(256);
        let values = ["on".into(), "Hand ⚡".into(), "".into(), 42.into(), long.into()];
        let played: Result<Vec<_>, Error> = play("mode", &values);
        let good = |value| (text(value), Quality::Good);
        let cut = text(&format!("{}…", "x".repeat(252)));
        assert_eq!(
            played.unwrap(),
            [
                good("on"),
                good("Hand ⚡"),
                good(""),
                good("42"),
                (cut, Quality::Uncertain(Reason::Configuration))
            ]
        );
        for (tag, value) in [("mode", 1.5.into()), ("load", "AUTO".into()), ("n", "".into())] {
            let fault = play(tag, &[value]).unwrap_err();
            assert!(fault.message().contains(&format!("tag '{tag}'")), "{fault}");
        }
    }

    #[test]
    fn impossible_rates_are_refused() {
        for (rate, period) in [(-1.0, 1.0), (f64::NAN, 1.0), (1.0, 0.0)] {
            let settings =
                Settings { updates_per_second: rate, batch_seconds: period, ..Settings::default() };
            assert!(SampleGenerator::create(settings, TestClock::new().host()).is_err());
        }
    }
}
