//! Which cells are which tags', and what they say.

use std::collections::HashMap;

use busbar_plugin_sdk::{DoublePoint, Quality, Reason, Value, ValueKind};

use super::config::{CsvConfig, Form, TimeFormat, find_column};
use super::{Cells, Column, MISSING};
use crate::address::{Points, Source};
use crate::instant::{parse_millis, parse_rfc3339, parse_seconds};
use crate::oscillogram::double_point;
use crate::recording::Update;
use crate::remarks::Remarks;
use crate::settings::EmptyCells;

/// Names in long form that no tag has are not kept; those of tags are.
pub(super) struct Columns {
    config: CsvConfig,
    time: usize,
    /// Cells of a row.
    width: usize,
    kinds: Vec<ValueKind>,
    /// Time of the last row of each tag, nanoseconds from the first row.
    newest: Vec<i64>,
    wanted: Wanted,
}

enum Wanted {
    /// By tag.
    Wide(Vec<WideColumns>),
    Long {
        name: usize,
        value: usize,
        quality: Option<usize>,
        points: HashMap<String, Vec<usize>>,
        is_seen: Vec<bool>,
    },
}

struct WideColumns {
    values: Cell,
    quality: Option<usize>,
}

enum Cell {
    One(usize),
    Two { off: usize, on: usize },
}

/// A row whose time is known.
pub(super) struct Row {
    pub(super) line: u64,
    /// In the file's own count, nanoseconds.
    pub(super) time: i64,
}

/// A row that cannot be read.
pub(super) struct RowFault {
    pub(super) what: String,
    /// True where its cells can be told apart, so that its name can be trusted.
    pub(super) is_named: bool,
}

/// A column that is not there.
pub(super) enum Missing {
    Of(String),
    OfTags(Vec<String>),
}

impl Columns {
    pub(super) fn find(
        config: &CsvConfig,
        points: &Points,
        header: &Cells,
    ) -> Result<Self, Missing> {
        let names: Vec<&str> = (0..header.len()).map(|index| header.get(index)).collect();
        let find = |column: &Column| find_column(&names, column, "column");
        let found = |setting: &str, column: &Column| {
            find(column).map_err(|what| Missing::Of(format!("csv.{setting}: {what}")))
        };
        let time = found("time", &config.time)?;
        let quality = config.quality.as_ref().map(|column| found("quality", column)).transpose()?;
        let wanted = if config.form == Form::Long {
            let (name, value) = (found("name", &config.name)?, found("value", &config.value)?);
            Wanted::Long {
                name,
                value,
                quality,
                points: by_name(points),
                is_seen: vec![false; points.0.len()],
            }
        } else {
            let (mut columns, mut faults) = (Vec::new(), Vec::new());
            for point in &points.0 {
                let values = match &point.source {
                    Source::One(one) => find(one).map(Cell::One),
                    Source::Two(off, on) => {
                        find(off).and_then(|off| Ok(Cell::Two { off, on: find(on)? }))
                    }
                };
                let own = point.quality.as_ref().map(find).transpose();
                match values
                    .and_then(|values| Ok(WideColumns { values, quality: own?.or(quality) }))
                {
                    Ok(found) => columns.push(found),
                    Err(what) => faults.push(format!("tag '{}': {what}", point.id)),
                }
            }
            if !faults.is_empty() {
                return Err(Missing::OfTags(faults));
            }
            Wanted::Wide(columns)
        };
        let kinds = points.0.iter().map(|point| point.kind).collect();
        let newest = vec![i64::MIN; points.0.len()];
        Ok(Self { config: config.clone(), time, width: header.len(), kinds, newest, wanted })
    }

    /// The time of a row that has all cells.
    pub(super) fn row(&self, cells: &Cells, line: u64) -> Result<Row, RowFault> {
        let has_more = (self.width..cells.len()).any(|index| !cells.get(index).is_empty());
        if cells.len() < self.width || has_more {
            let what = format!(
                "{} cells instead of {}; no cell may have a line break",
                cells.len(),
                self.width
            );
            return Err(RowFault { what, is_named: false });
        }
        if let Wanted::Long { name, .. } = &self.wanted
            && cells.get(*name).contains(char::REPLACEMENT_CHARACTER)
        {
            let what = "its name is no text in UTF-8".to_owned();
            return Err(RowFault { what, is_named: false });
        }
        let text = cells.get(self.time);
        let (time, example) = match self.config.time_format {
            TimeFormat::Rfc3339 => (parse_rfc3339(text), "a time such as 2024-02-29T13:14:15Z"),
            TimeFormat::UnixSeconds | TimeFormat::Seconds => {
                (parse_seconds(&self.dotted(text)), "a number of seconds")
            }
            TimeFormat::UnixMillis => {
                (parse_millis(&self.dotted(text)), "a number of milliseconds")
            }
        };
        let time = time.ok_or_else(|| {
            let what = format!("'{}' is not {example}: is csv.time_format right?", shown(text));
            RowFault { what, is_named: true }
        })?;
        Ok(Row { line, time })
    }

    /// Appends the updates of a row of time `nanos`; the latest row so far is of `latest`.
    /// A tag that has a later value already is missing: nobody can tell which is the newer.
    pub(super) fn read(
        &mut self,
        cells: &Cells,
        row: &Row,
        [nanos, latest]: [i64; 2],
        updates: &mut Vec<Update>,
        remarks: &mut Remarks,
    ) {
        let (kinds, config, newest) = (&self.kinds, &self.config, &mut self.newest);
        let mut push = |point: usize, values: &Cell, quality: Option<usize>| {
            let quality = quality.map_or(Quality::Good, |index| quality_of(cells.get(index)));
            let read = read_value(cells, values, kinds[point], config);
            let update = match read {
                Ok(None) if config.empty_cells == EmptyCells::Unchanged => return,
                _ if nanos < newest[point] => Update::missing(point, latest, MISSING),
                Ok(Some(Value::F64(number))) if !number.is_finite() => {
                    Update::missing(point, nanos, Reason::NotFinite)
                }
                Ok(Some(value)) => Update { point, nanos, value: Some(value), quality },
                Ok(None) => Update::missing(point, nanos, MISSING),
                Err(what) => {
                    remarks.add(format!("line {}: {what}; taken as missing", row.line));
                    Update::missing(point, nanos, MISSING)
                }
            };
            newest[point] = newest[point].max(nanos);
            updates.push(update);
        };
        match &mut self.wanted {
            Wanted::Wide(columns) => {
                for (point, column) in columns.iter().enumerate() {
                    push(point, &column.values, column.quality);
                }
            }
            Wanted::Long { name, value, quality, points, is_seen } => {
                for &point in points.get(cells.get(*name)).into_iter().flatten() {
                    is_seen[point] = true;
                    push(point, &Cell::One(*value), *quality);
                }
            }
        }
    }

    /// Appends what a row that cannot be read makes of its tags: of all of them, unless it
    /// has a name that can be trusted.
    pub(super) fn read_unreadable(
        &self,
        cells: &Cells,
        is_named: bool,
        nanos: i64,
        updates: &mut Vec<Update>,
    ) {
        let missing = |point| Update::missing(point, nanos, MISSING);
        match &self.wanted {
            Wanted::Long { name, points, .. } if is_named => {
                let named = points.get(cells.get(*name)).into_iter().flatten();
                updates.extend(named.map(|&point| missing(point)));
            }
            _ => updates.extend((0..self.kinds.len()).map(missing)),
        }
    }

    /// Begins at the first row anew.
    pub(super) fn forget_times(&mut self) {
        self.newest.fill(i64::MIN);
    }

    /// At the end: the names that no row had.
    pub(super) fn tell_unseen(&self, remarks: &mut Remarks) {
        let Wanted::Long { points, is_seen, .. } = &self.wanted else { return };
        for (name, points) in points {
            if points.iter().all(|&point| !is_seen[point]) {
                remarks.add(format!("no row has the name '{name}': its tags had no value"));
            }
        }
    }

    fn dotted(&self, text: &str) -> String {
        dotted(text, self.config.has_decimal_comma)
    }
}

fn by_name(points: &Points) -> HashMap<String, Vec<usize>> {
    let mut by_name: HashMap<String, Vec<usize>> = HashMap::new();
    for (index, point) in points.0.iter().enumerate() {
        if let Source::One(Column::Name(name)) = &point.source {
            by_name.entry(name.trim().to_owned()).or_default().push(index);
        }
    }
    by_name
}

fn read_value(
    cells: &Cells,
    values: &Cell,
    kind: ValueKind,
    config: &CsvConfig,
) -> Result<Option<Value>, String> {
    match values {
        Cell::One(index) => parse(cells.get(*index), kind, config),
        Cell::Two { off, on } => {
            let contact = |index| parse(cells.get(index), ValueKind::Bool, config);
            match (contact(*off)?, contact(*on)?) {
                (Some(Value::Bool(off)), Some(Value::Bool(on))) => {
                    Ok(Some(Value::DoublePoint(double_point(off, on))))
                }
                _ => Ok(None),
            }
        }
    }
}

/// A value; nothing where the cell is empty.
fn parse(text: &str, kind: ValueKind, config: &CsvConfig) -> Result<Option<Value>, String> {
    if text.is_empty() {
        return Ok(None);
    }
    let lower = text.to_ascii_lowercase();
    let value = match (kind, lower.as_str()) {
        (ValueKind::Bool, "on" | "yes") => Some(Value::Bool(true)),
        (ValueKind::Bool, "off" | "no") => Some(Value::Bool(false)),
        (ValueKind::DoublePoint, "off" | "open") => Some(Value::DoublePoint(DoublePoint::Off)),
        (ValueKind::DoublePoint, "on" | "closed") => Some(Value::DoublePoint(DoublePoint::On)),
        (ValueKind::F64, _) => kind.parse(&dotted(text, config.has_decimal_comma)),
        _ => kind.parse(&lower),
    };
    let expected = match kind {
        ValueKind::F64 => "number",
        ValueKind::I64 => "whole number",
        ValueKind::Bool => "true, false, 1, 0, on or off",
        ValueKind::DoublePoint => "position 0 to 3, off, on, open or closed",
    };
    match value {
        None => Err(format!("'{}' is no {expected}", shown(text))),
        value => Ok(value),
    }
}

/// `good`, `uncertain`, `bad`, or a quality of OPC DA 3.0 (6.8), 192 being good. What
/// is none of them vouches for nothing.
fn quality_of(text: &str) -> Quality {
    const OPC_GOOD: u16 = 0xC0;
    const OPC_UNCERTAIN: u16 = 0x40;
    let lower = text.to_ascii_lowercase();
    match (lower.as_str(), lower.parse::<u16>()) {
        ("good", _) => Quality::Good,
        ("uncertain", _) => Quality::Uncertain(Reason::Unknown),
        (_, Ok(bits)) if bits & OPC_GOOD == OPC_GOOD => Quality::Good,
        (_, Ok(bits)) if bits & OPC_GOOD == OPC_UNCERTAIN => Quality::Uncertain(Reason::Unknown),
        _ => Quality::Bad(Reason::Unknown),
    }
}

fn dotted(text: &str, has_decimal_comma: bool) -> String {
    if has_decimal_comma { text.replace(',', ".") } else { text.to_owned() }
}

/// A cell as messages have it.
fn shown(text: &str) -> String {
    crate::comtrade::shorten(text)
}
