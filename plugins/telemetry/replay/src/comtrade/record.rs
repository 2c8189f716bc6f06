//! One record of data (clause 8): a sample of all channels.

use std::ops::Range;

use thiserror::Error;

use super::cfg::{Cfg, DataType};
use super::fields::shorten;
use super::revision::Revision;

/// Sample number and time stamp, four bytes each (8.6).
const HEAD_BYTES: usize = 8;
/// Digital channels of one word.
const WORD_BITS: usize = 16;
/// A time stamp that says nothing, in binary files (8.6).
const NO_TIMESTAMP: u32 = u32::MAX;
/// A value that says nothing, in text (8.4).
const NO_VALUE: f64 = 99_999.0;
/// A value that says nothing, in files of 1991 (8.2).
const NO_VALUE_1991: f64 = -1.0;

/// Fault of a record's contents.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum RecordError {
    /// A line with more or fewer fields than the channels have.
    #[error("{found} fields instead of {wanted}: sample, time and one a channel")]
    Fields {
        /// Fields that the configuration says.
        wanted: usize,
        /// Fields that there are.
        found: usize,
    },
    /// A sample number that is none.
    #[error("'{0}' is no sample number")]
    Number(String),
    /// A time stamp that is none.
    #[error("'{0}' is no time stamp")]
    Timestamp(String),
    /// A value of a channel that is none.
    #[error("'{0}' is no value of a channel")]
    Value(String),
}

/// Layout of a record.
#[derive(Clone, Debug)]
pub struct RecordLayout {
    data: DataType,
    revision: Revision,
    digitals: usize,
    /// True where a raw value may be what else marks a missing one, by channel.
    has_mark_in_range: Vec<bool>,
}

/// A record; its values are read when they are asked for.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// Number of the sample, the first being 1.
    pub sample: u64,
    /// Time stamp, in units of [`Cfg::timestamp_nanos`], where there is one.
    pub timestamp: Option<f64>,
    layout: &'a RecordLayout,
    bytes: &'a [u8],
    /// Fields of a line; empty for binary data.
    fields: &'a [Range<usize>],
}

impl RecordLayout {
    /// The layout that a configuration says.
    pub fn new(cfg: &Cfg) -> Self {
        let mark = if cfg.data == DataType::Ascii { NO_VALUE } else { NO_VALUE_1991 };
        let has_mark = |channel: &super::Analog| {
            channel.range.as_ref().is_some_and(|range| range.contains(&mark))
        };
        Self {
            data: cfg.data,
            revision: cfg.revision,
            digitals: cfg.digitals.len(),
            has_mark_in_range: cfg.analogs.iter().map(has_mark).collect(),
        }
    }

    fn analogs(&self) -> usize {
        self.has_mark_in_range.len()
    }

    fn value_bytes(&self) -> usize {
        if self.data == DataType::Binary { 2 } else { 4 }
    }

    /// Bytes of a binary record; nothing for text.
    pub fn record_bytes(&self) -> Option<usize> {
        let words = self.digitals.div_ceil(WORD_BITS);
        let bytes = HEAD_BYTES + self.analogs() * self.value_bytes() + words * 2;
        (self.data != DataType::Ascii).then_some(bytes)
    }

    /// Reads a binary record of [`RecordLayout::record_bytes`] bytes.
    pub fn read_binary<'a>(&'a self, bytes: &'a [u8]) -> Record<'a> {
        let word = |at: usize| u32::from_le_bytes(four(bytes, at));
        let timestamp = Some(word(4)).filter(|time| *time != NO_TIMESTAMP).map(f64::from);
        Record { sample: word(0).into(), timestamp, layout: self, bytes, fields: &[] }
    }

    /// Reads a line; `fields` is used again for every line.
    ///
    /// # Errors
    /// What is wrong with its fields, sample number or time stamp.
    pub fn read_line<'a>(
        &'a self,
        line: &'a [u8],
        fields: &'a mut Vec<Range<usize>>,
    ) -> Result<Record<'a>, RecordError> {
        let wanted = 2 + self.analogs() + self.digitals;
        cut(line, fields, wanted);
        // Commas at the end of a line are no fields.
        let rest = fields.get(wanted).and_then(|extra| line.get(extra.start..)).unwrap_or_default();
        if rest.iter().all(|byte| *byte == b',' || byte.is_ascii_whitespace()) {
            fields.truncate(wanted);
        }
        if fields.len() != wanted {
            let found = line.iter().filter(|&&byte| byte == b',').count() + 1;
            return Err(RecordError::Fields { wanted, found });
        }
        let [sample, time] = [0, 1].map(|index| text(line, fields, index));
        let number = sample.parse().map_err(|_| RecordError::Number(shorten(sample)))?;
        let timestamp = match time {
            "" => None,
            time => Some(number_of(time).ok_or_else(|| RecordError::Timestamp(shorten(time)))?),
        };
        Ok(Record { sample: number, timestamp, layout: self, bytes: line, fields })
    }
}

impl Record<'_> {
    /// The raw value of an analogue channel, counted from 0; nothing where it is
    /// marked as missing or is no finite number.
    ///
    /// # Errors
    /// A field that is no number.
    pub fn analog(&self, index: usize) -> Result<Option<f64>, RecordError> {
        let at = HEAD_BYTES + index * self.layout.value_bytes();
        let is_1991 = self.layout.revision == Revision::Of1991;
        let has_mark = self.layout.has_mark_in_range.get(index).copied().unwrap_or(false);
        Ok(match self.layout.data {
            DataType::Ascii => {
                let text = text(self.bytes, self.fields, 2 + index);
                if text.is_empty() {
                    return Ok(None);
                }
                let value = number_of(text).ok_or_else(|| RecordError::Value(shorten(text)))?;
                Some(value).filter(|value| *value != NO_VALUE || (is_1991 && has_mark))
            }
            DataType::Binary => {
                let value = i16::from_le_bytes(two(self.bytes, at));
                let is_mark = is_1991 && !has_mark && f64::from(value) == NO_VALUE_1991;
                Some(f64::from(value)).filter(|_| value != i16::MIN && !is_mark)
            }
            DataType::Binary32 => {
                let value = i32::from_le_bytes(four(self.bytes, at));
                Some(f64::from(value)).filter(|_| value != i32::MIN)
            }
            DataType::Float32 => {
                let value = f32::from_le_bytes(four(self.bytes, at));
                Some(f64::from(value)).filter(|_| value.is_finite() && value != f32::MIN)
            }
        })
    }

    /// The state of a digital channel, counted from 0; nothing where it is missing.
    ///
    /// # Errors
    /// A field that is neither 0 nor 1.
    pub fn digital(&self, index: usize) -> Result<Option<bool>, RecordError> {
        let analogs = self.layout.analogs();
        if self.layout.data == DataType::Ascii {
            return match text(self.bytes, self.fields, 2 + analogs + index) {
                "0" => Ok(Some(false)),
                "1" => Ok(Some(true)),
                "" => Ok(None),
                other => Err(RecordError::Value(shorten(other))),
            };
        }
        let words = HEAD_BYTES + analogs * self.layout.value_bytes();
        let word = u16::from_le_bytes(two(self.bytes, words + index / WORD_BITS * 2));
        Ok(Some(word >> (index % WORD_BITS) & 1 == 1))
    }
}

/// Cuts a line at its commas, into no more than one field over `most`.
fn cut(line: &[u8], fields: &mut Vec<Range<usize>>, most: usize) {
    fields.clear();
    let mut start = 0;
    for field in line.split(|&byte| byte == b',').take(most + 1) {
        fields.push(start..start + field.len());
        start += field.len() + 1;
    }
}

/// A field as text; what is no text is no number either.
fn text<'a>(line: &'a [u8], fields: &[Range<usize>], index: usize) -> &'a str {
    let bytes = fields.get(index).and_then(|range| line.get(range.clone())).unwrap_or_default();
    std::str::from_utf8(bytes).unwrap_or("\u{fffd}").trim()
}

fn number_of(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|number| number.is_finite())
}

fn two(bytes: &[u8], at: usize) -> [u8; 2] {
    bytes.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or_default()
}

fn four(bytes: &[u8], at: usize) -> [u8; 4] {
    bytes.get(at..).and_then(|rest| rest.first_chunk()).copied().unwrap_or_default()
}
