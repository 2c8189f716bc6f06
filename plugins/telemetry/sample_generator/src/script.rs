//! Scripted samples, each at its time.
//!
//! What is due before the process that reads it began is left out: nobody sends the past.
//! Two tags tell how far it came, so that who watches knows what has arrived.

use std::collections::HashMap;
use std::path::Path;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::{
    DoublePoint, Error, Quality, Reason, Sample, SampleFlags, SampleSink, StopToken, TagSpec,
    Value, ValueKind, text_value,
};
use serde::Deserialize;

/// Bytes of a script, at most.
const MAX_SCRIPT_BYTES: u64 = 64 << 20;

/// Script: batches of samples in order of time.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Script {
    /// Begin of the batches' time, milliseconds since 1970-01-01 UTC.
    start_unix_millis: u64,
    /// Id of the counter tag for batches sent so far, those left out included; a whole number.
    sent: String,
    /// Id of the tag for the first batch that this process sent; a whole number.
    first: String,
    batches: Vec<Batch>,
}

/// Samples that are sent together.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Batch {
    at_millis: u64,
    samples: Vec<Line>,
}

/// Scripted sample of one tag.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    tag: String,
    value: Option<Worded>,
    quality: Worth,
    /// Age of the source time at the time of the batch, milliseconds; without it, the sample has
    /// none.
    age_millis: Option<i64>,
    /// Flags beside those that the plugin's origin gives all samples.
    #[serde(default)]
    flags: Vec<Flag>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Flag {
    Buffered,
    TimeUnusable,
    Substituted,
    Test,
    Historical,
}

impl Flag {
    fn bits(self) -> SampleFlags {
        match self {
            Self::Buffered => SampleFlags::BUFFERED,
            Self::TimeUnusable => SampleFlags::TIME_UNUSABLE,
            Self::Substituted => SampleFlags::SUBSTITUTED,
            Self::Test => SampleFlags::TEST,
            Self::Historical => SampleFlags::HISTORICAL,
        }
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Worth {
    Good,
    Uncertain,
    Bad,
}

/// Scripted value of a sample.
#[derive(Deserialize)]
#[serde(untagged)]
enum Worded {
    Whole(i64),
    Number(f64),
    /// A text, or for other tags a word: `nan`, `on` or `off`.
    Text(String),
}

impl Script {
    /// Reads a script for these tags.
    ///
    /// # Errors
    /// A file that cannot be read, or a value that does not fit its tag.
    pub(crate) fn read(path: &Path, tags: &[TagSpec]) -> Result<Self, Error> {
        let fault = |what: String| Error::settings(format!("script {}: {what}", path.display()));
        let size = std::fs::metadata(path).map_err(|error| fault(error.to_string()))?.len();
        if size > MAX_SCRIPT_BYTES {
            return Err(fault(format!("{size} bytes; {MAX_SCRIPT_BYTES} are allowed")));
        }
        let text = std::fs::read(path).map_err(|error| fault(error.to_string()))?;
        let script: Self =
            serde_json::from_slice(&text).map_err(|error| fault(error.to_string()))?;
        let kinds: HashMap<&str, ValueKind> =
            tags.iter().map(|tag| (tag.id.as_str(), tag.kind)).collect();
        for line in script.batches.iter().flat_map(|batch| &batch.samples) {
            let (Some(value), Some(kind)) = (&line.value, kinds.get(line.tag.as_str())) else {
                continue;
            };
            if value.to_value(*kind).is_none() {
                let (id, kind) = (&line.tag, kind.name());
                return Err(fault(format!(
                    "tag '{id}' has a value that does not fit its type, {kind}"
                )));
            }
        }
        Ok(script)
    }

    /// Sends all batches that are due from now on; leaves out tags that are not served.
    pub(crate) fn play(&self, tags: &[TagSpec], sink: &SampleSink, running: &StopToken) {
        let known = |id: &str| tags.iter().find(|tag| tag.id == id);
        let start = UNIX_EPOCH + Duration::from_millis(self.start_unix_millis);
        let mut first = None;
        for (number, batch) in self.batches.iter().enumerate() {
            let due = start + Duration::from_millis(batch.at_millis);
            match due.duration_since(SystemTime::now()) {
                Ok(left) if !running.wait(left) => return,
                Err(_) if first.is_none() => continue,
                _ => {}
            }
            let first = *first.get_or_insert(number);
            let lines = batch.samples.iter();
            let mut samples: Vec<Sample> =
                lines.filter_map(|line| Some(line.sample(known(&line.tag)?, due))).collect();
            let progress = [(&self.first, first), (&self.sent, number + 1)];
            samples.extend(progress.into_iter().filter_map(|(id, count)| {
                Some(Sample::good(known(id)?.tag, Value::I64(count as i64)))
            }));
            sink.publish(&samples);
        }
    }
}

impl Line {
    fn sample(&self, tag: &TagSpec, due: SystemTime) -> Sample {
        let quality = match self.quality {
            Worth::Good => Quality::Good,
            Worth::Uncertain => Quality::Uncertain(Reason::Unknown),
            Worth::Bad => Quality::Bad(Reason::Unknown),
        };
        let (value, own) = match self.value.as_ref().and_then(|value| value.to_value(tag.kind)) {
            Some((value, own)) => (Some(value), own),
            None => (None, Quality::Good),
        };
        let age = self.age_millis.map(|age| (age, Duration::from_millis(age.unsigned_abs())));
        Sample {
            tag: tag.tag,
            value,
            quality: quality.worst(own),
            source_time: age.map(|(age, by)| if age < 0 { due + by } else { due - by }),
            flags: self.flags.iter().fold(SampleFlags::LIVE, |flags, flag| flags | flag.bits()),
        }
    }
}

impl Worded {
    /// Makes the value of a tag, with the quality that it has of its own; `None` where it does not
    /// fit the kind.
    fn to_value(&self, kind: ValueKind) -> Option<(Value, Quality)> {
        if kind == ValueKind::Text {
            return match self {
                Self::Text(text) => Some(text_value(text)),
                Self::Whole(number) => Some(text_value(&number.to_string())),
                Self::Number(_) => None,
            };
        }
        let (number, position) = match self {
            Self::Whole(number) => (*number as f64, DoublePoint::BadState),
            Self::Number(number) => (*number, DoublePoint::BadState),
            Self::Text(word) => match word.as_str() {
                "nan" => (f64::NAN, DoublePoint::BadState),
                "on" => (1.0, DoublePoint::On),
                "off" => (0.0, DoublePoint::Off),
                _ => return None,
            },
        };
        let value = match (kind, self) {
            (ValueKind::F64, _) => Value::F64(number),
            (ValueKind::I64, Self::Whole(number)) => Value::I64(*number),
            (ValueKind::I64, _) => Value::I64(number as i64),
            (ValueKind::Bool, _) => Value::Bool(number != 0.0),
            (ValueKind::DoublePoint, _) => Value::DoublePoint(position),
            (ValueKind::Text, _) => return None,
        };
        Some((value, Quality::Good))
    }
}
