//! The configuration of a recording (clause 7): what its data mean.

use std::collections::BTreeMap;

use text_table::TextEncoding;

use super::cfg_error::CfgError;
use super::channel::{Analog, Digital};
use super::fields::{Fields, Lines, shorten};
use super::layout::Oddity;
use super::revision::Revision;
use super::sampling::Sampling;
use super::stamp::Stamp;

/// Largest configuration that is read.
pub const MAX_CFG_BYTES: usize = 16 << 20;
/// Channels of one recording, analogue and digital.
pub const MAX_CHANNELS: u64 = 65_536;
/// Largest factor of time stamps: a second is 10^6 microseconds.
const MAX_TIME_MULTIPLIER: f64 = 1e12;
/// No place is further from UTC (7.4.12).
const MAX_OFFSET_MINUTES: i32 = 14 * 60;

/// Format of the samples (7.4.10).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataType {
    /// Text, a line for each sample.
    Ascii,
    /// Integers of 16 bits.
    Binary,
    /// Integers of 32 bits.
    Binary32,
    /// 32-bit floating point (IEEE 754).
    Float32,
}

/// Properties of the recorder's clock in files of 2013 (7.4.12, 7.4.13).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    /// Minutes by which its times are ahead of UTC, where it says so.
    pub utc_offset_minutes: Option<i32>,
    /// Time quality, `tmq_code`, 0 locked to 15 failed.
    pub quality: Option<u8>,
    /// Leap second within the recording: 1 added, 2 left out.
    pub leap_second: u8,
}

impl Clock {
    /// True where the clock had failed, so that times are not reliable (7.4.13, code F).
    pub fn is_unreliable(&self) -> bool {
        self.quality == Some(15)
    }
}

/// A configuration that has been checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Cfg {
    /// Name of the station.
    pub station: String,
    /// Name of the recorder.
    pub device: String,
    /// Edition of the standard.
    pub revision: Revision,
    /// Analogue channels, in order of the data.
    pub analogs: Vec<Analog>,
    /// Digital channels, in order of the data.
    pub digitals: Vec<Digital>,
    /// Sampling rates or time stamps.
    pub sampling: Sampling,
    /// Samples that the file says it has.
    pub samples: u64,
    /// Time of the first sample.
    pub start: Stamp,
    /// Time of the event.
    pub trigger: Stamp,
    /// Format of the samples.
    pub data: DataType,
    /// Unit of the time stamps of records, nanoseconds.
    pub timestamp_nanos: f64,
    /// Clock of the recorder.
    pub clock: Clock,
    /// Remarks on harmless oddities.
    pub remarks: Vec<String>,
}

impl Cfg {
    /// Reads a configuration by its byte order mark, as UTF-8, or else as windows-1252.
    ///
    /// # Errors
    /// The line, its fault, and what should be there.
    pub fn parse(bytes: &[u8]) -> Result<Self, CfgError> {
        Self::parse_encoded(bytes, None)
    }

    /// Reads a configuration in an encoding; its byte order mark goes before it.
    ///
    /// # Errors
    /// The line, its fault, and what should be there.
    pub fn parse_encoded(bytes: &[u8], encoding: Option<TextEncoding>) -> Result<Self, CfgError> {
        if bytes.len() > MAX_CFG_BYTES {
            let what =
                format!("{} bytes; a configuration has {MAX_CFG_BYTES} at most", bytes.len());
            return Err(CfgError { line: 1, what });
        }
        let (text, is_guess) = TextEncoding::decode_text(encoding, bytes);
        let mut lines = Lines::new(text.trim_start_matches('\u{feff}'));
        let mut remarks = Vec::new();
        if is_guess {
            remarks.push(
                "its names are not UTF-8: read as windows-1252; `encoding` names another".into(),
            );
        }
        let head = lines.next("the station's name")?;
        if head.len() < 2 {
            return Err(
                head.fault("station and recorder are not there; is it a COMTRADE configuration?")
            );
        }
        let (station, device, year) = parse_head(&head, &mut remarks);
        let revision = parse_revision(year, &mut remarks);
        let [analogs, digitals] =
            parse_counts(&lines.next("the number of channels")?, &mut remarks)?;
        let mut oddities = Oddities::default();
        let analogs = (1..=analogs)
            .map(|n| {
                let what = format!("analogue channel {n}");
                let (channel, oddity) = Analog::parse(&lines.next(&what)?, n, revision);
                oddities.note(oddity, &what);
                Ok(channel)
            })
            .collect::<Result<_, CfgError>>()?;
        let digitals = (1..=digitals)
            .map(|n| {
                let what = format!("digital channel {n}");
                let (channel, oddity) = Digital::parse(&lines.next(&what)?, n, revision)?;
                oddities.note(oddity, &what);
                Ok(channel)
            })
            .collect::<Result<_, CfgError>>()?;
        oddities.tell(&mut remarks);
        // Played as recorded, whatever the line's frequency is.
        lines.next("the line frequency")?;
        let (sampling, samples) = Sampling::parse(&mut lines, &mut remarks)?;
        let mut stamp = |what: &str| {
            let fields = lines.next(what)?;
            let stamp = Stamp::parse(fields.get(0), fields.get(1), revision);
            let stamp = stamp.unwrap_or_else(|fault| {
                let fault = fields.fault(format!("{what}: {fault}"));
                remarks.push(format!("{fault}: taken as unknown"));
                Stamp::unknown()
            });
            if stamp.is_swapped {
                remarks.push(format!(
                    "{what}: month and day of '{}' are taken in the other order",
                    fields.get(0)
                ));
            }
            if stamp.is_iso {
                remarks.push(format!("{what}: '{}' has the year first", shorten(fields.get(0))));
            }
            Ok(stamp)
        };
        let (start, trigger) =
            (stamp("the time of the first sample")?, stamp("the time of the trigger")?);
        let data = parse_data_type(&lines.next("the type of the data file")?)?;
        let has_nanos = start.is_nano || trigger.is_nano;
        if has_nanos && revision != Revision::Of2013 {
            remarks.push(
                "its times have digits of nanoseconds, which its revision has not: time stamps of \
                 records are microseconds"
                    .into(),
            );
        }
        let unit = if has_nanos && revision == Revision::Of2013 { 1.0 } else { 1000.0 };
        let multiplier = parse_multiplier(&mut lines, revision, &mut remarks)?;
        let mut clock = if revision == Revision::Of2013 {
            parse_clock(&mut lines, &mut remarks)
        } else {
            Clock::default()
        };
        if start.is_utc && clock.utc_offset_minutes.is_none() {
            clock.utc_offset_minutes = Some(0);
        }
        let timestamp_nanos = unit * multiplier;
        let device = device.to_owned();
        Ok(Self {
            station,
            device,
            revision,
            analogs,
            digitals,
            sampling,
            samples,
            start,
            trigger,
            data,
            timestamp_nanos,
            clock,
            remarks,
        })
    }

    /// Time of a sample, nanoseconds from the start of the recording: by the rates,
    /// or by the record's own time stamp.
    pub fn nanos(&self, sample: u64, timestamp: Option<f64>) -> Option<i64> {
        const MAX_NANOS: f64 = 3.2e18;
        if let Sampling::Rates(_) = self.sampling {
            return self.sampling.nanos(sample);
        }
        let nanos = (timestamp? * self.timestamp_nanos).round();
        (nanos.abs() < MAX_NANOS).then_some(nanos as i64)
    }
}

/// Differences of channel lines from the layout of their revision, each told once.
#[derive(Default)]
struct Oddities(BTreeMap<Oddity, (String, usize)>);

impl Oddities {
    fn note(&mut self, oddity: Option<Oddity>, channel: &str) {
        if let Some(oddity) = oddity {
            self.0.entry(oddity).or_insert_with(|| (channel.to_owned(), 0)).1 += 1;
        }
    }

    fn tell(self, remarks: &mut Vec<String>) {
        for (oddity, (channel, count)) in self.0 {
            let more = if count > 1 { format!(", and {} more", count - 1) } else { String::new() };
            remarks.push(format!("{channel} {}{more}", oddity.in_words()));
        }
    }
}

/// `station_name,rec_dev_id,rev_year` (7.4.2); the year at the end tells a name with commas.
fn parse_head<'a>(head: &Fields<'a>, remarks: &mut Vec<String>) -> (String, &'a str, &'a str) {
    let all = head.all();
    let blank = all.iter().rev().take_while(|field| field.is_empty()).count();
    let kept = all.get(..all.len() - blank).unwrap_or_default();
    let is_year = |text: &str| text.len() == 4 && text.bytes().all(|byte| byte.is_ascii_digit());
    match kept {
        [names @ .., device, year] if names.len() > 1 && is_year(year) => {
            remarks.push("the station's name has commas".into());
            (names.join(","), device, year)
        }
        _ => (head.get(0).to_owned(), head.get(1), head.get(2)),
    }
}

fn parse_revision(year: &str, remarks: &mut Vec<String>) -> Revision {
    match year {
        "" | "1991" => Revision::Of1991,
        "1999" | "2001" => Revision::Of1999,
        "2013" => Revision::Of2013,
        other => {
            let is_later = other.parse::<u32>().is_ok_and(|year| year > 2013);
            remarks.push(format!(
                "revision '{}' is not known: read as of {}",
                shorten(other),
                if is_later { 2013 } else { 1999 }
            ));
            if is_later { Revision::Of2013 } else { Revision::Of1999 }
        }
    }
}

/// Parses the numbers of channels, `TT,##A,##D` (7.4.3).
fn parse_counts(fields: &Fields<'_>, remarks: &mut Vec<String>) -> Result<[usize; 2], CfgError> {
    let count = |index: usize, letter: char| {
        let text = fields.get(index);
        let digits = text.strip_suffix([letter, letter.to_ascii_lowercase()]);
        digits.and_then(|digits| digits.trim().parse::<u64>().ok())
    };
    let (Some(analogs), Some(digitals)) = (count(1, 'A'), count(2, 'D')) else {
        return Err(fields.fault(format!(
            "'{}' is no number of channels such as 3,2A,1D",
            shorten(&fields.joined())
        )));
    };
    let said = fields.get(0);
    let total = analogs.saturating_add(digitals);
    if said.parse() != Ok(total) {
        let said = shorten(said);
        let fault = format!("{analogs} analogue and {digitals} digital channels are not {said}");
        remarks.push(fields.fault(fault).to_string());
    }
    if total > MAX_CHANNELS || total == 0 {
        return Err(fields.fault(format!("{total} channels; 1 to {MAX_CHANNELS} are read")));
    }
    // Within the limit just checked.
    Ok([analogs as usize, digitals as usize])
}

fn parse_data_type(fields: &Fields<'_>) -> Result<DataType, CfgError> {
    match fields.get(0).to_ascii_uppercase().as_str() {
        "ASCII" => Ok(DataType::Ascii),
        "BINARY" => Ok(DataType::Binary),
        "BINARY32" => Ok(DataType::Binary32),
        "FLOAT32" => Ok(DataType::Float32),
        other => Err(fields.fault(format!(
            "'{}' is no type of data: ASCII, BINARY, BINARY32 or FLOAT32",
            shorten(other)
        ))),
    }
}

/// The factor of time stamps (7.4.11), which files of 1991 do not have.
fn parse_multiplier(
    lines: &mut Lines<'_>,
    revision: Revision,
    remarks: &mut Vec<String>,
) -> Result<f64, CfgError> {
    let fields = match lines.next_if_any() {
        Some(fields) if !fields.is_blank() => fields,
        _ => {
            if revision != Revision::Of1991 {
                remarks.push("the factor of time stamps is missing: taken as 1".into());
            }
            return Ok(1.0);
        }
    };
    let multiplier = fields.number(0, "factor of time stamps")?.unwrap_or(1.0);
    if multiplier == 0.0 {
        remarks.push("the factor of time stamps is 0: taken as 1".into());
        return Ok(1.0);
    }
    if multiplier <= 0.0 || multiplier > MAX_TIME_MULTIPLIER {
        return Err(fields.fault(format!(
            "a factor of time stamps of {multiplier} is not within 0 to {MAX_TIME_MULTIPLIER}"
        )));
    }
    Ok(multiplier)
}

/// Parses `time_code,local_code` and `tmq_code,leapsec`.
fn parse_clock(lines: &mut Lines<'_>, remarks: &mut Vec<String>) -> Clock {
    let Some(zone) = lines.next_if_any().filter(|fields| !fields.is_blank()) else {
        remarks.push("time code and time quality are missing".into());
        return Clock::default();
    };
    let utc_offset_minutes = parse_time_code(zone.get(0)).unwrap_or_else(|()| {
        remarks.push(format!(
            "'{}' is no time code such as 0, -5h30, +9 or x: taken as unknown",
            shorten(zone.get(0))
        ));
        None
    });
    let Some(fields) = lines.next_if_any().filter(|fields| !fields.is_blank()) else {
        remarks.push("time quality is missing".into());
        return Clock { utc_offset_minutes, ..Clock::default() };
    };
    let quality = match fields.get(0) {
        "" => None,
        code => {
            let quality = u8::from_str_radix(code, 16).ok().filter(|code| *code < 16);
            if quality.is_none() {
                remarks.push(format!("'{}' is no time quality: 0 to F", shorten(code)));
            }
            quality
        }
    };
    let leap_second = match fields.get(1).parse() {
        Ok(code @ 0..=3) => code,
        _ if fields.get(1).is_empty() => 0,
        _ => {
            let code = shorten(fields.get(1));
            remarks.push(format!("leap second '{code}' is not within 0 to 3"));
            0
        }
    };
    Clock { utc_offset_minutes, quality, leap_second }
}

/// `-5h30`, `+9`, `0`; `x` where it does not apply.
fn parse_time_code(text: &str) -> Result<Option<i32>, ()> {
    if text.is_empty() || text.eq_ignore_ascii_case("x") {
        return Ok(None);
    }
    let (sign, digits) = match text.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, text.strip_prefix('+').unwrap_or(text)),
    };
    let (hours, minutes) = digits.split_once(['h', 'H']).unwrap_or((digits, ""));
    let number = |text: &str| -> Result<i32, ()> {
        let is_number = text.len() <= 2 && text.bytes().all(|byte| byte.is_ascii_digit());
        if text.is_empty() {
            Ok(0)
        } else if is_number {
            text.parse().map_err(|_| ())
        } else {
            Err(())
        }
    };
    if hours.is_empty() {
        return Err(());
    }
    let (hours, minutes) = (number(hours)?, number(minutes)?);
    let total = hours * 60 + minutes;
    if minutes > 59 || total > MAX_OFFSET_MINUTES { Err(()) } else { Ok(Some(sign * total)) }
}

#[cfg(test)]
#[path = "cfg_tests.rs"]
mod tests;
