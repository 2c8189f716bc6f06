//! Columns of tags, and the updates that the rows of a table make.

use std::collections::HashMap;

use busbar_plugin_sdk::{Quality, Reason, Value, ValueKind};
use source_units::{TagUnit, UnitAgreement};
use text_table::{Cells, StateWords};

use super::cell_values::{CellValue, read_cell, read_quality};
use super::config::{Column, CsvConfig, Form, find_column};
use super::{MISSING, header};
use crate::address::{Points, Source};
use crate::oscillogram::double_point;
use crate::recording::Update;
use crate::remarks::Remarks;
use crate::settings::EmptyCells;

/// Remark on a text that is uncertain.
const TEXT_DOUBT: &str = "a text has more bytes than a tag's may have, 255, or no character of the \
                          file's encoding (csv.encoding); taken as uncertain";

/// Names in long form that no tag has are not kept; those of tags are.
pub(super) struct Columns {
    config: CsvConfig,
    time: usize,
    date: Option<usize>,
    /// Cells of a row.
    width: usize,
    kinds: Vec<ValueKind>,
    /// Words for states, by tag.
    states: Vec<StateWords<Value>>,
    /// Unit of each tag's cells, where the address, a row of units or a cell named it.
    units: Vec<Option<String>>,
    /// True once an ambiguous time was told.
    is_ambiguity_told: bool,
    /// Time of the last row of each tag, nanoseconds from the first row.
    newest: Vec<i64>,
    wanted: ColumnSelection,
}

enum ColumnSelection {
    /// Columns of each tag, in wide form.
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
    /// True where the clock showed the time twice.
    pub(super) is_ambiguous: bool,
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
        names: &[&str],
    ) -> Result<Self, Missing> {
        let find = |column: &Column| find_column(names, column, "column");
        let found = |setting: &str, column: &Column| {
            find(column).map_err(|what| Missing::Of(format!("csv.{setting}: {what}")))
        };
        let time = found("time", &config.time)?;
        let date = config.date.as_ref().map(|column| found("date", column)).transpose()?;
        let quality = config.quality.as_ref().map(|column| found("quality", column)).transpose()?;
        let wanted = if config.form == Form::Long {
            let (name, value) = (found("name", &config.name)?, found("value", &config.value)?);
            ColumnSelection::Long {
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
            ColumnSelection::Wide(columns)
        };
        let kinds = points.0.iter().map(|point| point.kind).collect();
        let newest = vec![i64::MIN; points.0.len()];
        Ok(Self {
            config: config.clone(),
            time,
            date,
            width: names.len(),
            kinds,
            states: points.0.iter().map(|point| point.states.clone()).collect(),
            units: points.0.iter().map(|point| point.unit.clone()).collect(),
            is_ambiguity_told: false,
            newest,
            wanted,
        })
    }

    /// Column of the time, counted from 0.
    pub(super) fn time_column(&self) -> usize {
        self.time
    }

    /// Columns of time and date, counted from 0; `None` where there is no date.
    pub(super) fn time_columns(&self) -> [Option<usize>; 2] {
        [Some(self.time), self.date]
    }

    /// Takes the units of a row of units.
    ///
    /// # Errors
    /// Tags that want another unit.
    pub(super) fn take_units(
        &mut self,
        cells: &Cells,
        points: &Points,
        remarks: &mut Remarks,
    ) -> Result<(), Vec<String>> {
        let ColumnSelection::Wide(columns) = &self.wanted else { return Ok(()) };
        let mut faults = Vec::new();
        for ((column, unit), point) in columns.iter().zip(&mut self.units).zip(&points.0) {
            let Cell::One(index) = column.values else { continue };
            let found = header::unit_of(cells.get(index));
            let Some(wanted) = unit else {
                *unit = Some(found.to_owned()).filter(|found| !found.is_empty());
                continue;
            };
            let compared = TagUnit::new(wanted);
            match compared.compare([found]) {
                UnitAgreement::Agrees => {}
                UnitAgreement::Conflicts => faults.push(format!(
                    "tag '{}': its column is in {found}, and {wanted} is wanted: correct the tag's \
                     unit, or give it a `scale`",
                    point.id
                )),
                agreement => {
                    let remark = compared.remark(agreement, found).unwrap_or_default();
                    remarks.add(format!("tag '{}': {remark}", point.id));
                }
            }
        }
        if faults.is_empty() { Ok(()) } else { Err(faults) }
    }

    /// Reports a number of cells that a row of this table cannot have.
    pub(super) fn is_other_width(&self, cells: &Cells) -> bool {
        let has_more = (self.width..cells.len()).any(|index| !cells.get(index).is_empty());
        cells.len() < self.width || has_more
    }

    /// The time of a row that has all cells; `last` is that of the row before.
    pub(super) fn row(&self, cells: &Cells, line: u64, last: Option<i64>) -> Result<Row, RowFault> {
        if self.is_other_width(cells) {
            let what =
                format!("{} cells instead of {}; is a quote not closed?", cells.len(), self.width);
            return Err(RowFault { what, is_named: false });
        }
        if let ColumnSelection::Long { name, .. } = &self.wanted
            && cells.get(*name).contains(char::REPLACEMENT_CHARACTER)
        {
            let encoding = self.config.dialect.encoding.unwrap_or_default().name();
            let what = format!("its name is no text in {encoding}: set csv.encoding");
            return Err(RowFault { what, is_named: false });
        }
        let date = self.date.map(|date| cells.get(date));
        let read = self.config.times.read(date, cells.get(self.time), last);
        let instant = read.map_err(|what| RowFault {
            what: format!("{what}: is csv.time_format right?"),
            is_named: true,
        })?;
        Ok(Row { line, time: instant.nanos, is_ambiguous: instant.is_ambiguous })
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
        if row.is_ambiguous && !std::mem::replace(&mut self.is_ambiguity_told, true) {
            let zone = self.config.times.zone.as_ref().map_or("UTC", |zone| zone.name());
            remarks.add(format!(
                "line {}: the clock of {zone} showed its time twice: values are uncertain until \
                 times are unique again",
                row.line
            ));
        }
        let Self { kinds, config, newest, states, units, .. } = self;
        let mut push = |point: usize, values: &Cell, quality: Option<usize>| {
            let mut quality = match quality {
                None => Quality::Good,
                Some(index) => {
                    let (quality, remark) = read_quality(cells.get(index), config);
                    if let Some(remark) = remark {
                        remarks.add(remark);
                    }
                    quality
                }
            };
            if row.is_ambiguous && quality == Quality::Good {
                quality = Quality::Uncertain(Reason::SourceTime);
            }
            let read = read_value(
                cells,
                values,
                |text, kind| read_cell(text, kind, &states[point], &mut units[point], config),
                kinds[point],
            );
            let update = match read {
                Ok(CellValue::Empty) if config.empty_cells == EmptyCells::Unchanged => return,
                _ if nanos < newest[point] => Update::missing(point, latest, MISSING),
                Ok(CellValue::Value(Value::F64(number))) if !number.is_finite() => {
                    Update::missing(point, nanos, Reason::NotFinite)
                }
                Ok(CellValue::Value(value)) => Update { point, nanos, value: Some(value), quality },
                Ok(CellValue::Text(value, own)) => {
                    if !own.is_good() {
                        remarks.add(format!("line {}: {TEXT_DOUBT}", row.line));
                    }
                    Update { point, nanos, value: Some(value), quality: quality.worst(own) }
                }
                Ok(CellValue::Empty | CellValue::NoValue) => Update::missing(point, nanos, MISSING),
                Err(what) => {
                    remarks.add(format!("line {}: {what}; taken as missing", row.line));
                    Update::missing(point, nanos, MISSING)
                }
            };
            newest[point] = newest[point].max(nanos);
            updates.push(update);
        };
        match &mut self.wanted {
            ColumnSelection::Wide(columns) => {
                for (point, column) in columns.iter().enumerate() {
                    push(point, &column.values, column.quality);
                }
            }
            ColumnSelection::Long { name, .. } if config.stop_names.contains(cells.get(*name)) => {
                remarks.add(format!(
                    "line {}: the recorder stopped ('{}'): tags are bad until their next row",
                    row.line,
                    text_table::shorten(cells.get(*name))
                ));
                let all = 0..kinds.len();
                updates.extend(all.map(|point| Update::missing(point, latest, MISSING)));
            }
            ColumnSelection::Long { name, value, quality, points, is_seen } => {
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
            ColumnSelection::Long { name, points, .. } if is_named => {
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
        let ColumnSelection::Long { points, is_seen, .. } = &self.wanted else { return };
        for (name, points) in points {
            if points.iter().all(|&point| !is_seen[point]) {
                remarks.add(format!("no row has the name '{name}': its tags had no value"));
            }
        }
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

/// Reads the value of a tag from its cell, or from those of its two contacts.
fn read_value(
    cells: &Cells,
    values: &Cell,
    mut read: impl FnMut(&str, ValueKind) -> Result<CellValue, String>,
    kind: ValueKind,
) -> Result<CellValue, String> {
    match values {
        Cell::One(index) => read(cells.get(*index), kind),
        Cell::Two { off, on } => {
            let mut contact = |index: usize| read(cells.get(index), ValueKind::Bool);
            match (contact(*off)?, contact(*on)?) {
                (CellValue::Value(Value::Bool(off)), CellValue::Value(Value::Bool(on))) => {
                    Ok(CellValue::Value(Value::DoublePoint(double_point(off, on))))
                }
                (CellValue::Empty, CellValue::Empty) => Ok(CellValue::Empty),
                _ => Ok(CellValue::NoValue),
            }
        }
    }
}
