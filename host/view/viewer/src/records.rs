//! Records of business and management systems, joined to the equipment of the scene by its ids
//! and aliases.

mod poller;

use std::sync::Arc;
use std::time::Duration;

use busbar_records::{ColumnType, Kind, List, Record};
use busbar_tags::SourceTime;
use busbar_ui::{RecordRow, RecordSection};
use jiff::Timestamp;
use jiff::tz::TimeZone;

use crate::ViewError;
use busbar_scene_loader::LoadedScene;
use poller::RecordPoller;

/// The longest that opening a view without a window waits for the first records.
const FIRST_READ_TIMEOUT: Duration = Duration::from_secs(20);
/// Rows of a list that a faceplate shows.
const MAX_ROWS: usize = 20;
/// Different ids of a list that are looked for in the scene, to say which it has not.
const MAX_CHECKED_IDS: usize = 2_000;
/// Bytes of a date, `2026-11-23`.
const DATE_BYTES: usize = 10;
const NANOS_PER_SECOND: i64 = 1_000_000_000;
const SECONDS_PER_DAY: i64 = 86_400;

/// The records of the plugins that are configured for that.
#[derive(Default)]
pub(crate) struct RecordStore {
    sources: Vec<RecordSource>,
    revision: u64,
}

/// Records of one plugin.
struct RecordSource {
    poller: RecordPoller,
    lists: Vec<List>,
    /// Fault that keeps the records from being read.
    fault: Option<String>,
}

impl RecordStore {
    /// Starts reading the records of all configured plugins.
    pub(crate) fn start(scene: &LoadedScene, settles: bool) -> Result<Self, ViewError> {
        let mut store = Self::default();
        let plugins = scene.config.records.iter();
        for plugin in plugins.filter_map(|records| scene.instances.get(&records.plugin)) {
            let poller = RecordPoller::start(plugin)?;
            store.sources.push(RecordSource { poller, lists: Vec::new(), fault: None });
        }
        if settles {
            store
                .sources
                .iter()
                .for_each(|source| source.poller.wait_for_first(FIRST_READ_TIMEOUT));
        }
        Ok(store)
    }

    /// Takes the lists that the pollers have read.
    pub(crate) fn step(&mut self, scene: &LoadedScene) {
        for source in &mut self.sources {
            let (is_new, fault) = (source.poller.take(&mut source.lists), source.poller.fault());
            self.revision += u64::from(is_new || fault != source.fault);
            source.fault = fault;
            if is_new {
                source.lists.iter().for_each(|list| warn_unknown_equipment(scene, list));
            }
        }
    }

    /// Returns the records of the equipment with these ids. `places` names the pole or part of each
    /// id.
    fn sections(
        &self,
        ids: &[String],
        places: &[Option<String>],
        now: SourceTime,
    ) -> Vec<RecordSection> {
        let lists = self.sources.iter().flat_map(|source| {
            source.lists.iter().map(move |list| (list, source.fault.as_deref()))
        });
        lists.map(|(list, fault)| section(list, fault, (ids, places), now)).collect()
    }
}

/// Warns of rows whose equipment is not in the scene.
fn warn_unknown_equipment(scene: &LoadedScene, list: &List) {
    let is_absent = |id: &&str| scene.equipment.find(&scene.graph, id).is_none();
    let mut absent = list.equipment().take(MAX_CHECKED_IDS).filter(is_absent);
    if let Some(first) = absent.next() {
        let (count, title) = (1 + absent.count(), &list.info().title);
        tracing::warn!(
            "'{title}' names {count} pieces of equipment that are not in the scene, such as \
             '{first}': mend the ids there, or add aliases to \"equipment\""
        );
    }
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
        let state = Some((store.revision, now.0 / (60 * NANOS_PER_SECOND)));
        if self.looked_up != state {
            self.looked_up = state;
            self.sections = store.sections(&self.ids, &self.places, now).into();
        }
    }

    pub(crate) fn sections(&self) -> Arc<[RecordSection]> {
        self.sections.clone()
    }
}
