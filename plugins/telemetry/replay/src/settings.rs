//! Settings as typed, and the valid configuration made from them.

use std::path::{Path, PathBuf};

use busbar_plugin_sdk::Error;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::comtrade::Side;
use crate::instant::{nanos_of_seconds, parse_rfc3339};
use crate::table::{CsvConfig, RawCsv};
use text_table::{TextEncoding, Zone};

/// Slowest and fastest pace.
const MIN_SPEED: f64 = 0.1;
const MAX_SPEED: f64 = 1000.0;
/// Updates of one tag in a second of viewing.
const MAX_UPDATES: f64 = 100_000.0;
/// Last offset from the start of a recording: a century, seconds.
const MAX_OFFSET_SECONDS: f64 = 3.2e9;
/// No place is further from UTC.
const MAX_UTC_OFFSET_MINUTES: i32 = 14 * 60;

/// A recording, and how it is played.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The recording, by an absolute path: .cfg, .cff or .csv.
    #[schemars(length(min = 1), example = "/var/recordings/fault.cfg")]
    file: PathBuf,
    /// Format of the file, where its name does not tell.
    #[serde(default)]
    format: Option<Format>,
    /// Seconds of the recording in a second, 0.1 to 1000, or `as_fast_as_possible`.
    #[serde(default)]
    speed: RawSpeed,
    /// Repeats the recording at its end.
    #[serde(default, rename = "loop")]
    is_loop: bool,
    /// Start of playing: seconds from the recording's start, or a time (RFC 3339).
    #[serde(default)]
    start: Option<RawMoment>,
    /// End of playing, in the same forms.
    #[serde(default)]
    end: Option<RawMoment>,
    /// Times that values have: those of playing, or those of the recording.
    #[serde(default)]
    times: Times,
    /// Most updates of a tag in a second of playing, the last value of each such
    /// part; 0 is all. Changes of digital tags are never left out.
    #[serde(default = "default_updates")]
    #[schemars(range(min = 0, max = 100_000))]
    max_updates_per_second: f64,
    /// COMTRADE: minutes by which times are ahead of UTC, where the file does not
    /// say it.
    #[serde(default)]
    #[schemars(range(min = -840, max = 840))]
    utc_offset_minutes: i32,
    /// Zone of times that name none, in place of `utc_offset_minutes`: `Europe/Berlin`, `UTC`
    /// or `+05:30`.
    #[serde(default)]
    #[schemars(length(min = 1, max = 64), example = &"Europe/Berlin")]
    zone: Option<String>,
    /// Character encoding of names, such as `windows-1251` or `gb18030`; a byte order mark goes
    /// before it. Without it UTF-8, or windows-1252 where COMTRADE is not UTF-8.
    #[serde(default)]
    #[schemars(length(min = 1, max = 40), example = &"gb18030")]
    encoding: Option<String>,
    /// COMTRADE: side of the instrument transformers that values are of.
    #[serde(default)]
    values: Values,
    /// Settings of CSV and its columns.
    #[serde(default)]
    csv: RawCsv,
}

/// Format of a recording.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Format {
    /// IEEE C37.111, IEC 60255-24.
    Comtrade,
    /// Comma-separated values (RFC 4180).
    Csv,
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number from 0.1 to 1000, or \"as_fast_as_possible\"")]
enum RawSpeed {
    /// Seconds of the recording in a second.
    Factor(f64),
    /// No pace at all.
    Word(SpeedWord),
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
enum SpeedWord {
    AsFastAsPossible,
}

impl Default for RawSpeed {
    fn default() -> Self {
        Self::Factor(1.0)
    }
}

#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "seconds from the start, or a time such as \"2024-02-29T13:14:15Z\"")]
enum RawMoment {
    /// Seconds from the start of the recording.
    Seconds(f64),
    /// A time by RFC 3339.
    Time(String),
}

/// Times that values have.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Times {
    /// Shifted, so that what is played now is of now.
    #[default]
    Now,
    /// Times of the recording: its values are as old as they are.
    Original,
}

/// Side of instrument transformers.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Values {
    /// Values as the file has them.
    #[default]
    AsRecorded,
    /// Values of the line (primary side).
    Primary,
    /// Values of the relay (secondary side).
    Secondary,
}

impl Values {
    pub(crate) fn side(self) -> Option<Side> {
        match self {
            Self::AsRecorded => None,
            Self::Primary => Some(Side::Primary),
            Self::Secondary => Some(Side::Secondary),
        }
    }
}

/// Meaning of an empty cell.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum EmptyCells {
    /// Missing value: the tag is bad.
    #[default]
    Missing,
    /// Nothing: the last value stays, and grows old.
    Unchanged,
}

fn default_updates() -> f64 {
    20.0
}

/// Instant in a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Moment {
    /// Nanoseconds from its first instant.
    Offset(i64),
    /// Nanoseconds since the epoch, 1970-01-01T00:00:00Z.
    Unix(i64),
}

/// Settings that have been checked.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub(crate) file: PathBuf,
    pub(crate) format: Format,
    /// Seconds of the recording in a second; nothing is as fast as possible.
    pub(crate) speed: Option<f64>,
    pub(crate) is_loop: bool,
    pub(crate) start: Option<Moment>,
    pub(crate) end: Option<Moment>,
    pub(crate) times: Times,
    /// Greatest number of updates a second; none for all.
    pub(crate) max_updates_per_second: Option<f64>,
    pub(crate) utc_offset_minutes: i32,
    /// Zone of times that name none.
    pub(crate) zone: Option<Zone>,
    /// Character encoding of names, where the settings say it.
    pub(crate) encoding: Option<TextEncoding>,
    pub(crate) values: Values,
    pub(crate) csv: CsvConfig,
}

impl Settings {
    /// Checks all of it.
    ///
    /// # Errors
    /// [`Error::settings`] with each fault and what is allowed.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = SettingsFaults(Vec::new());
        if !self.file.is_absolute() {
            faults.add(format!("file: '{}' is no absolute path", self.file.display()));
        }
        let format = self.format.or_else(|| format_of(&self.file)).unwrap_or_else(|| {
            faults.add(
                "format: the file's name ends in none of .cfg, .cff, .csv: set comtrade or csv",
            );
            Format::Csv
        });
        let speed = match self.speed {
            RawSpeed::Word(SpeedWord::AsFastAsPossible) => None,
            RawSpeed::Factor(speed) => Some(faults.check("speed", speed, MIN_SPEED..=MAX_SPEED)),
        };
        if self.is_loop && speed.is_none() {
            faults.add("loop: goes with a speed alone, not with as_fast_as_possible");
        }
        if self.is_loop && self.times == Times::Original {
            faults.add("loop: not with times original, which would go back; set times to now");
        }
        let updates =
            faults.check("max_updates_per_second", self.max_updates_per_second, 0.0..=MAX_UPDATES);
        let zone = self.zone.as_deref().map(Zone::parse).transpose().unwrap_or_else(|fault| {
            faults.add(format!("zone: {fault}"));
            None
        });
        if zone.is_some() && self.utc_offset_minutes != 0 {
            faults.add("utc_offset_minutes: zone says it already: remove one of them");
        }
        let encoding = self.encoding.as_deref().map(TextEncoding::from_name).transpose();
        let encoding = encoding.unwrap_or_else(|fault| {
            faults.add(format!("encoding: {fault}"));
            None
        });
        // What is wrong with these is told once.
        let shared_encoding = self.encoding.as_deref().filter(|_| encoding.is_some());
        let shared_zone = self.zone.as_deref().filter(|_| zone.is_some());
        let csv = self.csv.parse(shared_encoding, shared_zone, &mut faults);
        let offsets = -MAX_UTC_OFFSET_MINUTES..=MAX_UTC_OFFSET_MINUTES;
        let config = Config {
            start: self.start.and_then(|moment| moment.parse("start", &mut faults)),
            end: self.end.and_then(|moment| moment.parse("end", &mut faults)),
            utc_offset_minutes: faults.check(
                "utc_offset_minutes",
                self.utc_offset_minutes,
                offsets,
            ),
            zone,
            encoding,
            csv,
            file: self.file,
            format,
            speed,
            is_loop: self.is_loop,
            times: self.times,
            max_updates_per_second: Some(updates).filter(|updates| *updates > 0.0),
            values: self.values,
        };
        let (start, end) = (config.start, config.end);
        match (start, end) {
            (Some(Moment::Offset(start)), Some(Moment::Offset(end)))
            | (Some(Moment::Unix(start)), Some(Moment::Unix(end)))
                if start >= end =>
            {
                faults.add("end: must be after start");
            }
            _ => {}
        }
        match &faults.0[..] {
            [] => Ok(config),
            faults => Err(Error::settings(format!("settings: {}", faults.join("; ")))),
        }
    }
}

fn format_of(file: &Path) -> Option<Format> {
    match file.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "cfg" | "cff" => Some(Format::Comtrade),
        "csv" => Some(Format::Csv),
        _ => None,
    }
}

impl RawMoment {
    fn parse(self, name: &str, faults: &mut SettingsFaults) -> Option<Moment> {
        match self {
            Self::Seconds(seconds) => {
                let seconds = faults.check(name, seconds, 0.0..=MAX_OFFSET_SECONDS);
                Some(Moment::Offset(nanos_of_seconds(seconds)))
            }
            Self::Time(text) => {
                let unix = parse_rfc3339(&text);
                if unix.is_none() {
                    faults.add(format!("{name}: '{text}' is no time such as 2024-02-29T13:14:15Z"));
                }
                unix.map(Moment::Unix)
            }
        }
    }
}

/// All that is wrong, so that it can be told at once.
pub(crate) struct SettingsFaults(Vec<String>);

impl SettingsFaults {
    pub(crate) fn add(&mut self, fault: impl Into<String>) {
        self.0.push(fault.into());
    }

    fn check<T: Copy + PartialOrd + std::fmt::Display>(
        &mut self,
        name: &str,
        value: T,
        allowed: std::ops::RangeInclusive<T>,
    ) -> T {
        if !allowed.contains(&value) {
            let (min, max) = (allowed.start(), allowed.end());
            self.add(format!("{name}: {value} is not within {min} to {max}"));
        }
        value
    }
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
