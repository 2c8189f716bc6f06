//! A COMTRADE recording as the player sees it.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use busbar_plugin_sdk::{DoublePoint, Quality, Reason, Value, ValueKind};

use source_units::{TagUnit, UnitAgreement};
use text_table::TextEncoding;

use crate::address::{Point, Points, Source};
use crate::comtrade::{
    Analog, Cff, Cfg, Data, MAX_CFG_BYTES, Record, RecordLayout, SampleClock, Sampling,
};
use crate::recording::{Fault, Recording, Update, open_file};
use crate::remarks::Remarks;
use crate::settings::{Config, Times};
use crate::table::{Column, find_column};

/// First bytes of a single file of 2013.
const CFF_START: &[u8] = b"---";
const NANOS_PER_MINUTE: i64 = 60_000_000_000;

/// Open COMTRADE recording with its reader.
pub(crate) struct Oscillogram<R> {
    file: PathBuf,
    cfg: Cfg,
    data: Data<R>,
    wanted: Vec<ChannelSelection>,
    origin: Option<i64>,
    /// Time of the last record.
    last: i64,
    /// Time between the last two records.
    step: i64,
    /// Counter of samples, and what it was at the mark.
    clock: SampleClock,
    marked_clock: SampleClock,
    /// Count of the last record.
    last_sample: Option<u64>,
    /// Quality of good values: the recorder's clock may be in doubt.
    quality: Quality,
    /// A record after a gap: its time and updates, which come after those of the gap.
    after_gap: Option<(i64, Vec<Update>)>,
    mark: u64,
    /// Set once its length was compared with what it says.
    is_counted: bool,
}

/// A tag's channels, counted from 0.
enum ChannelSelection {
    Number { channel: usize, is_whole: bool, scale: Scale },
    Bool(usize),
    DoublePoint { off: usize, on: usize },
}

/// From raw values to those of a tag.
struct Scale {
    a: f64,
    b: f64,
    factor: f64,
    range: Option<RangeInclusive<f64>>,
    skew_nanos: i64,
}

impl Oscillogram<File> {
    /// Opens what the settings name.
    pub(crate) fn open(
        config: &Config,
        points: &Points,
        remarks: &mut Remarks,
    ) -> Result<Self, Fault> {
        let (cfg, parts) = read_cfg(&config.file, config.encoding)?;
        Self::new(config, cfg, parts, points, remarks)
    }
}

impl<R: Read + Seek> Oscillogram<R> {
    pub(crate) fn new(
        config: &Config,
        cfg: Cfg,
        parts: Parts<R>,
        points: &Points,
        remarks: &mut Remarks,
    ) -> Result<Self, Fault> {
        let Parts { path: file, file: bytes, offset, line, bytes: count } = parts;
        let data = Data::open(bytes, RecordLayout::new(&cfg), offset, line, count);
        let data = data.map_err(|error| Fault::new(&file, error))?;
        let wanted = find_channels(&config.file, &cfg, points, remarks)?;
        let (origin, is_ambiguous) = find_origin(config, &cfg, remarks);
        tell_oddities(&cfg, data.rest_bytes(), remarks);
        let quality = if cfg.clock.is_unreliable() {
            Quality::Uncertain(Reason::Unknown)
        } else if is_ambiguous && config.times == Times::Original {
            Quality::Uncertain(Reason::SourceTime)
        } else {
            Quality::Good
        };
        Ok(Self {
            file,
            cfg,
            data,
            wanted,
            origin,
            last: i64::MIN,
            step: 0,
            clock: SampleClock::default(),
            marked_clock: SampleClock::default(),
            last_sample: None,
            quality,
            after_gap: None,
            mark: 0,
            is_counted: false,
        })
    }
}

/// A file with the data, and where they are in it.
pub(crate) struct Parts<R> {
    pub(crate) path: PathBuf,
    pub(crate) file: R,
    pub(crate) offset: u64,
    pub(crate) line: u64,
    pub(crate) bytes: Option<u64>,
}

fn read_cfg(path: &Path, encoding: Option<TextEncoding>) -> Result<(Cfg, Parts<File>), Fault> {
    let mut file = open_file(path)?;
    let failed = |error: std::io::Error| Fault::new(path, error);
    let mut start = Vec::new();
    (&mut file).take(16).read_to_end(&mut start).map_err(failed)?;
    file.seek(SeekFrom::Start(0)).map_err(failed)?;
    let start = start.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&start);
    if start.starts_with(CFF_START) {
        let Cff { cfg, data_offset, data_line, data_bytes } =
            Cff::find(&mut file).map_err(|fault| Fault::new(path, fault))?;
        let cfg = Cfg::parse_encoded(&cfg, encoding)
            .map_err(|fault| Fault::new(path, format!("configuration, {fault}")))?;
        let parts = Parts {
            path: path.into(),
            file,
            offset: data_offset,
            line: data_line,
            bytes: data_bytes,
        };
        return Ok((cfg, parts));
    }
    let mut text = Vec::new();
    file.take(MAX_CFG_BYTES as u64 + 1).read_to_end(&mut text).map_err(failed)?;
    let cfg = Cfg::parse_encoded(&text, encoding).map_err(|fault| Fault::new(path, fault))?;
    let data = data_file(path);
    let file = open_file(&data)?;
    Ok((cfg, Parts { path: data, file, offset: 0, line: 1, bytes: None }))
}

/// The data beside a configuration: `.dat`, in the case that there is.
fn data_file(cfg: &Path) -> PathBuf {
    let is_upper = cfg.extension().and_then(OsStr::to_str).is_some_and(|e| e == e.to_uppercase());
    let order = if is_upper { ["DAT", "dat", "Dat"] } else { ["dat", "DAT", "Dat"] };
    let mut candidates = order.map(|extension| cfg.with_extension(extension)).into_iter();
    candidates.find(|path| path.is_file()).unwrap_or_else(|| cfg.with_extension(order[0]))
}

/// The start of a recording, nanoseconds from 1970-01-01T00:00:00Z, and whether the clock of its
/// zone showed it twice.
fn find_origin(config: &Config, cfg: &Cfg, remarks: &mut Remarks) -> (Option<i64>, bool) {
    let Some(start) = cfg.start.nanos else { return (None, false) };
    if let (None, Some(zone)) = (cfg.clock.utc_offset_minutes, &config.zone) {
        return match zone.resolve_nanos(start) {
            Ok(resolved) => {
                if resolved.is_ambiguous {
                    remarks.add(format!(
                        "the clock of {} showed its start twice: the first is taken",
                        zone.name()
                    ));
                }
                (Some(resolved.nanos), resolved.is_ambiguous)
            }
            Err(fault) => {
                remarks.add(format!("its start: {fault}"));
                (None, false)
            }
        };
    }
    let ahead = cfg.clock.utc_offset_minutes.unwrap_or(config.utc_offset_minutes);
    (start.checked_sub(i64::from(ahead) * NANOS_PER_MINUTE), false)
}

fn tell_oddities(cfg: &Cfg, rest_bytes: u64, remarks: &mut Remarks) {
    for remark in &cfg.remarks {
        remarks.add(remark.clone());
    }
    if cfg.clock.is_unreliable() {
        remarks.add("the recorder's clock had failed (time quality F): its values are uncertain");
    }
    if matches!(cfg.clock.leap_second, 1 | 2) {
        remarks.add("there is a leap second in it: times after it may be a second off");
    }
    if rest_bytes > 0 {
        remarks.add(format!(
            "{rest_bytes} bytes after the last whole record: was the file cut short?"
        ));
    }
}

/// Finds the channels of all tags.
fn find_channels(
    file: &Path,
    cfg: &Cfg,
    points: &Points,
    remarks: &mut Remarks,
) -> Result<Vec<ChannelSelection>, Fault> {
    let (mut wanted, mut faults) = (Vec::new(), Vec::new());
    for point in &points.0 {
        match find(cfg, point, remarks) {
            Ok(channels) => wanted.push(channels),
            Err(fault) => faults.push(format!("tag '{}': {fault}", point.id)),
        }
    }
    if faults.is_empty() { Ok(wanted) } else { Err(Fault::of_tags(file, &faults)) }
}

fn find(cfg: &Cfg, point: &Point, remarks: &mut Remarks) -> Result<ChannelSelection, String> {
    let digital = |column: &Column| {
        let ids: Vec<&str> = cfg.digitals.iter().map(|channel| channel.id.as_str()).collect();
        find_column(&ids, column, "digital channel")
    };
    Ok(match (&point.source, point.kind) {
        (Source::Two(off, on), _) => {
            ChannelSelection::DoublePoint { off: digital(off)?, on: digital(on)? }
        }
        (Source::One(one), ValueKind::Bool | ValueKind::DoublePoint) => {
            ChannelSelection::Bool(digital(one)?)
        }
        (Source::One(_), ValueKind::Text) => return Err("COMTRADE has no texts".into()),
        (Source::One(one), kind @ (ValueKind::F64 | ValueKind::I64)) => {
            let ids: Vec<&str> = cfg.analogs.iter().map(|channel| channel.id.as_str()).collect();
            let channel = find_column(&ids, one, "analogue channel")?;
            let Analog { a, b, range, skew_nanos, fault, .. } = cfg.analogs[channel].clone();
            if let Some(fault) = fault {
                return Err(fault);
            }
            let unit = cfg.analogs[channel].unit.as_str();
            let wanted = TagUnit::new(point.unit.as_deref().unwrap_or_default());
            match wanted.compare([unit]) {
                UnitAgreement::Agrees => {}
                UnitAgreement::Conflicts => {
                    return Err(format!(
                        "channel '{}' is in {unit}, and {} is wanted: correct the tag's unit, or \
                         give it a `scale`",
                        ids[channel],
                        point.unit.as_deref().unwrap_or_default()
                    ));
                }
                agreement => {
                    let remark = wanted.remark(agreement, unit).unwrap_or_default();
                    remarks.add(format!("tag '{}': {remark}", point.id));
                }
            }
            let factor = match point.values.side() {
                Some(side) => cfg.analogs[channel].factor_to(side).map_err(|what| {
                    format!("channel '{}': {what}: set values to as_recorded", ids[channel])
                })?,
                None => 1.0,
            };
            let scale = Scale { a, b, factor, range, skew_nanos };
            ChannelSelection::Number { channel, is_whole: kind == ValueKind::I64, scale }
        }
    })
}

impl<R: Read + Seek + Send> Recording for Oscillogram<R> {
    fn origin(&self) -> Option<i64> {
        self.origin
    }

    fn read(
        &mut self,
        updates: &mut Vec<Update>,
        remarks: &mut Remarks,
    ) -> Result<Option<i64>, Fault> {
        if let Some((time, mut after)) = self.after_gap.take() {
            updates.append(&mut after);
            return Ok(Some(time));
        }
        let record = match self.data.read() {
            Ok(Some(record)) => record,
            Ok(None) => {
                self.compare_count(remarks);
                return Ok(None);
            }
            Err(fault) if fault.is_final() => return Err(Fault::new(&self.file, fault)),
            Err(fault) => {
                return Ok(Some(self.note_unreadable(&fault.to_string(), updates, remarks)));
            }
        };
        let (number, stamp) = (record.sample, record.timestamp);
        let place = match self.clock.count(&self.cfg, number, stamp) {
            Ok(place) if place.nanos >= self.last => place,
            Ok(_) => {
                let what = format!("sample {number} is earlier than the one before it");
                return Ok(Some(self.note_unreadable(&what, updates, remarks)));
            }
            Err(what) => return Ok(Some(self.note_unreadable(&what, updates, remarks))),
        };
        if let Some(remark) = place.remark {
            remarks.add(remark);
        }
        let (sample, nanos, quality) = (place.count, place.nanos, self.quality);
        let mut read = Vec::with_capacity(self.wanted.len());
        for (point, wanted) in self.wanted.iter().enumerate() {
            let update = wanted.read(&record, nanos, quality).unwrap_or_else(|fault| {
                remarks.add(format!("sample {sample}: {fault}; taken as missing"));
                Update::missing(0, nanos, Reason::Sensor)
            });
            read.push(Update { point, ..update });
        }
        let gap = self.find_gap(sample, nanos);
        if self.last > i64::MIN {
            self.step = nanos.saturating_sub(self.last);
        }
        (self.last, self.last_sample) = (nanos, Some(sample));
        let Some((first, time)) = gap else {
            updates.append(&mut read);
            return Ok(Some(nanos));
        };
        remarks.add(format!("samples {first} to {} are missing; tags are bad there", sample - 1));
        self.read_missing(time, updates);
        self.after_gap = Some((nanos, read));
        Ok(Some(time))
    }

    fn skip_to(&mut self, nanos: i64) -> Result<(), Fault> {
        let Some(records) = self.data.records() else { return Ok(()) };
        if !self.is_regular(records)? {
            // Numbers that begin again are counted from the first record on.
            return self.data.seek(0).map_err(|fault| Fault::new(&self.file, fault));
        }
        // Every record is whole, so that none before matters.
        let (mut low, mut high) = (0, records);
        while low < high {
            let middle = low + (high - low) / 2;
            self.data.seek(middle).map_err(|fault| Fault::new(&self.file, fault))?;
            let record = self.data.read().map_err(|fault| Fault::new(&self.file, fault))?;
            let time = record.and_then(|record| {
                self.cfg.nanos(self.clock.shifted(record.sample)?, record.timestamp)
            });
            if time.is_some_and(|time| time >= nanos) { high = middle } else { low = middle + 1 }
        }
        self.data.seek(low).map_err(|fault| Fault::new(&self.file, fault))
    }

    fn rewind(&mut self) -> Result<(), Fault> {
        (self.last, self.step) = (i64::MIN, 0);
        (self.last_sample, self.after_gap) = (None, None);
        self.clock = self.marked_clock;
        self.clock.forget_last();
        self.data.seek(self.mark).map_err(|fault| Fault::new(&self.file, fault))
    }

    fn mark(&mut self) {
        self.mark = self.data.position() - u64::from(self.after_gap.is_some());
        self.marked_clock = self.clock;
    }
}

impl<R: Read + Seek> Oscillogram<R> {
    /// Reports binary data whose records have one number after another and whose time stamps, where
    /// times are those, go forward; the clock is then that of the first record.
    fn is_regular(&mut self, records: u64) -> Result<bool, Fault> {
        let mut ends = Vec::new();
        for position in [0, records.saturating_sub(1)] {
            self.data.seek(position).map_err(|fault| Fault::new(&self.file, fault))?;
            let record = self.data.read().map_err(|fault| Fault::new(&self.file, fault))?;
            ends.extend(record.map(|record| (record.sample, record.timestamp)));
        }
        let [(first, first_stamp), (last, last_stamp)] = ends[..] else { return Ok(false) };
        let mut clock = SampleClock::default();
        if clock.count(&self.cfg, first, first_stamp).is_err() {
            return Ok(false);
        }
        clock.forget_last();
        let is_counted = last.checked_sub(first) == Some(records - 1);
        let is_forward = match self.cfg.sampling {
            Sampling::Rates(_) => true,
            Sampling::Timestamps => first_stamp.zip(last_stamp).is_some_and(|(a, b)| a <= b),
        };
        if is_counted && is_forward {
            self.clock = clock;
        }
        Ok(is_counted && is_forward)
    }

    /// A record that cannot be read never leaves the values before it as they were: all
    /// tags are missing from the last time on, which it returns, until the next record.
    fn note_unreadable(&self, what: &str, updates: &mut Vec<Update>, remarks: &mut Remarks) -> i64 {
        remarks.add(format!("{what}; left out, its tags are bad until the next"));
        let time = self.last.max(0);
        self.read_missing(time, updates);
        time
    }

    fn read_missing(&self, nanos: i64, updates: &mut Vec<Update>) {
        let points = 0..self.wanted.len();
        updates.extend(points.map(|point| Update::missing(point, nanos, Reason::Sensor)));
    }

    /// The first sample that is missing before this one, and its time.
    fn find_gap(&self, sample: u64, nanos: i64) -> Option<(u64, i64)> {
        let first = self.last_sample?.saturating_add(1);
        if sample <= first {
            return None;
        }
        let time = match self.cfg.nanos(first, None) {
            Some(time) => time,
            None => self.last.saturating_add(self.step),
        };
        Some((first, time.clamp(self.last, nanos)))
    }

    /// At the end: whether there were as many records as the configuration says.
    fn compare_count(&mut self, remarks: &mut Remarks) {
        let (found, said) = (self.data.position(), self.cfg.samples);
        if !std::mem::replace(&mut self.is_counted, true) && found != said {
            remarks.add(format!("{found} records, where the configuration says {said}"));
        }
    }
}

impl ChannelSelection {
    fn read(&self, record: &Record<'_>, nanos: i64, quality: Quality) -> Result<Update, String> {
        let in_words = |channel: usize, fault| format!("channel {}: {fault}", channel + 1);
        let digital = |channel| record.digital(channel).map_err(|fault| in_words(channel, fault));
        let update = |value: Option<Value>| match value {
            Some(_) => Update { point: 0, nanos, value, quality },
            None => Update::missing(0, nanos, Reason::Sensor),
        };
        match self {
            Self::Bool(channel) => Ok(update(digital(*channel)?.map(Value::Bool))),
            Self::DoublePoint { off, on } => {
                let both = digital(*off)?.zip(digital(*on)?);
                Ok(update(both.map(|(off, on)| Value::DoublePoint(double_point(off, on)))))
            }
            Self::Number { channel, is_whole, scale } => {
                let raw = record.analog(*channel).map_err(|fault| in_words(*channel, fault))?;
                let nanos = nanos.saturating_add(scale.skew_nanos);
                let Some(raw) = raw else { return Ok(Update::missing(0, nanos, Reason::Sensor)) };
                Ok(scale.apply(raw, nanos, *is_whole, quality))
            }
        }
    }
}

impl Scale {
    fn apply(&self, raw: f64, nanos: i64, is_whole: bool, quality: Quality) -> Update {
        let value = (self.a * raw + self.b) * self.factor;
        let quality = match &self.range {
            Some(range) if !range.contains(&raw) => Quality::Uncertain(Reason::OutOfRange),
            _ => quality,
        };
        if !value.is_finite() {
            return Update::missing(0, nanos, Reason::NotFinite);
        }
        let value = if is_whole {
            match whole(value) {
                Some(whole) => Value::I64(whole),
                None => return Update::missing(0, nanos, Reason::OutOfRange),
            }
        } else {
            Value::F64(value)
        };
        Update { point: 0, nanos, value: Some(value), quality }
    }
}

/// The nearest whole number, where there is one of 64 bits.
fn whole(value: f64) -> Option<i64> {
    const END: f64 = 9_223_372_036_854_775_808.0;
    let rounded = value.round();
    (-END..END).contains(&rounded).then_some(rounded as i64)
}

/// A switch position from its two contacts.
pub(crate) fn double_point(off: bool, on: bool) -> DoublePoint {
    DoublePoint::from_bits(u64::from(off) | u64::from(on) << 1)
}
