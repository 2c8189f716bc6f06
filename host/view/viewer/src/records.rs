//! Records of business and management systems, joined to the equipment of the scene by its ids
//! and aliases.

use std::sync::Arc;

use busbar_records::{ColumnType, Kind, List, Record};
use busbar_site::RecordStore;
use busbar_tags::SourceTime;
use busbar_ui::{RecordRow, RecordSection};
use jiff::Timestamp;
use jiff::tz::TimeZone;

/// Rows of a list that a faceplate shows.
const MAX_ROWS: usize = 20;
/// Bytes of a date, `2026-11-23`.
const DATE_BYTES: usize = 10;
const NANOS_PER_SECOND: i64 = 1_000_000_000;
const SECONDS_PER_DAY: i64 = 86_400;

/// Returns the records of the equipment with these ids. `places` names the pole or part of each id.
fn sections(
    store: &RecordStore,
    ids: &[String],
    places: &[Option<String>],
    now: SourceTime,
) -> Vec<RecordSection> {
    store.lists().map(|(list, fault)| section(list, fault, (ids, places), now)).collect()
}

fn section(
    list: &List,
    fault: Option<&str>,
    (ids, places): (&[String], &[Option<String>]),
    now: SourceTime,
) -> RecordSection {
    let info = list.info();
    let found = list.rows_of(ids);
    let left_out = info.faults.first().map_or_else(String::new, |fault| {
        format!("{}, row {}: {}", info.source, fault.row, fault.reason)
    });
    RecordSection {
        title: info.title.clone(),
        kind: info.kind,
        source: info.source.clone(),
        as_of: info.as_of_unix_nanos.map_or_else(String::new, local_minute),
        uncertainty: list_uncertainty(list, fault, now),
        left_out: (info.left_out, left_out),
        open: found.iter().filter(|(_, row)| row.is_open).count(),
        more: found.len().saturating_sub(MAX_ROWS),
        rows: found
            .iter()
            .take(MAX_ROWS)
            .map(|(id, record)| row(list, record, places.get(*id).cloned().flatten()))
            .collect(),
    }
}

/// Returns the reason why a list may be outdated.
fn list_uncertainty(list: &List, fault: Option<&str>, now: SourceTime) -> Option<String> {
    let info = list.info();
    if let Some(fault) = fault.or(info.fault.as_deref()) {
        return Some(fault.to_owned());
    }
    let Some(as_of) = info.as_of_unix_nanos else { return Some("not read yet".into()) };
    let seconds = now.0.saturating_sub(as_of) / NANOS_PER_SECOND;
    let is_old = info.valid_seconds > 0 && seconds > info.valid_seconds as i64;
    is_old.then(|| format!("old, nothing came for {} days", seconds / SECONDS_PER_DAY))
}

fn row(list: &List, record: &Record, place: Option<String>) -> RecordRow {
    let columns = &list.info().columns;
    let is_work = list.info().kind == Kind::Business;
    let dated = columns.iter().position(|column| column.column_type == ColumnType::Date);
    // It stands in the row's head.
    let head = dated.filter(|_| is_work);
    let when = match head.map(|at| record.cells[at].as_str()) {
        Some(date) => date.get(..DATE_BYTES).unwrap_or(date).to_owned(),
        None => record.unix_nanos.map_or_else(String::new, local_day),
    };
    let cells = columns.iter().zip(&record.cells).enumerate();
    let cells = cells.filter(|(at, (_, text))| Some(*at) != head && !text.is_empty());
    let cells = cells.map(|(_, (column, text))| {
        let text = format!("{text} {}", column.unit);
        (column.name.clone(), text.trim_end().to_owned())
    });
    let (severity, is_open) = (record.severity, record.is_open);
    RecordRow { place, severity, is_open, when, cells: cells.collect() }
}

fn local_minute(unix_nanos: i64) -> String {
    local(unix_nanos, "%Y-%m-%d %H:%M")
}

fn local_day(unix_nanos: i64) -> String {
    local(unix_nanos, "%Y-%m-%d")
}

fn local(unix_nanos: i64, format: &str) -> String {
    let at = Timestamp::from_nanosecond(i128::from(unix_nanos)).unwrap_or_default();
    at.to_zoned(TimeZone::system()).strftime(format).to_string()
}

/// Records of one piece of equipment, cached between frames.
#[derive(Debug, Default)]
pub(crate) struct EquipmentRecords {
    ids: Vec<String>,
    places: Vec<Option<String>>,
    /// Store revision and minute of the last lookup; lists age without changing.
    looked_up: Option<(u64, i64)>,
    sections: Arc<[RecordSection]>,
}

impl EquipmentRecords {
    /// Adds a node that the equipment is, or that is a part of it, with all that it is called.
    pub(crate) fn add(&mut self, ids: impl IntoIterator<Item = String>, place: Option<&str>) {
        self.ids.extend(ids);
        self.places.resize(self.ids.len(), place.map(str::to_owned));
    }

    /// Looks them up again where anything may be new.
    pub(crate) fn look_up(&mut self, store: &RecordStore, now: SourceTime) {
        let state = Some((store.revision(), now.0 / (60 * NANOS_PER_SECOND)));
        if self.looked_up != state {
            self.looked_up = state;
            self.sections = sections(store, &self.ids, &self.places, now).into();
        }
    }

    pub(crate) fn sections(&self) -> Arc<[RecordSection]> {
        self.sections.clone()
    }
}
