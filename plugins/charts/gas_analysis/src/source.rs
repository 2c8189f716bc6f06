//! Samples of a fleet from a CSV file, or from a query of an SQLite file.

use std::collections::HashMap;
use std::fs::File;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

use dga::Sample;
use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};

use crate::columns::Columns;
use crate::history::{MAX_EQUIPMENT, unix_nanos_of};
use crate::lines::{Line, Lines};
use crate::row::{self, Cells};
use crate::settings::FleetSettings;
use crate::table;

/// Samples of a fleet.
pub(crate) const MAX_SAMPLES: usize = 1_000_000;
/// Faults that are told one by one.
pub(crate) const MAX_FAULTS: usize = 100;
/// The longest that a database which somebody writes is waited for.
const MAX_LOCK_WAIT: Duration = Duration::from_millis(500);
/// Bytes of a value of a database.
const MAX_VALUE_BYTES: i32 = 1 << 16;
/// Instructions of a query between looks at its time, and the longest that it may take.
const PROGRESS_STEPS: i32 = 10_000;
const MAX_QUERY: Duration = Duration::from_secs(10);
/// Columns beside gases: temperature of the top oil, °C, and load, per unit.
pub(crate) const EXTRAS: [&str; 2] = ["top_oil", "load"];

/// A sample as it was read.
pub(crate) struct Reading {
    /// Index of the transformer's id.
    pub(crate) equipment: u32,
    /// Nanoseconds since 1970-01-01 UTC.
    pub(crate) unix_nanos: i64,
    pub(crate) sample: Sample,
    /// Quantities in the order of [`EXTRAS`]; NaN where the sample has none.
    pub(crate) extras: [f32; EXTRAS.len()],
}

/// All that was read, and what was wrong with some of it.
#[derive(Default)]
pub(crate) struct Readings {
    pub(crate) all: Vec<Reading>,
    /// Equipment ids of all transformers.
    pub(crate) equipment: Vec<String>,
    places: HashMap<String, u32>,
    /// In words, with their rows.
    pub(crate) faults: Vec<String>,
    /// Rows that were left out.
    pub(crate) left_out: usize,
}

impl Readings {
    pub(crate) fn fault(&mut self, row: u64, what: &str) {
        self.left_out += 1;
        if self.faults.len() < MAX_FAULTS {
            self.faults.push(format!("row {row}: {what}; it is left out"));
        }
    }

    fn add(
        &mut self,
        sample: Sample,
        cells: &Cells,
        [equipment, time]: [usize; 2],
        extras: [Option<usize>; EXTRAS.len()],
    ) -> Result<(), String> {
        let mut values = [f32::NAN; EXTRAS.len()];
        for ((value, place), name) in values.iter_mut().zip(extras).zip(EXTRAS) {
            let cell = place.map_or("", |place| cells.get(place));
            if !cell.is_empty() {
                let number: f32 = cell.parse().map_err(|_| format!("{name}: no number"))?;
                let finite = Some(number).filter(|number| number.is_finite());
                *value = finite.ok_or(format!("{name}: not finite"))?;
            }
        }
        let unix_nanos = unix_nanos_of(cells.get(time))?;
        let equipment = self.place_of(cells.get(equipment))?;
        self.all.push(Reading { equipment, unix_nanos, sample, extras: values });
        Ok(())
    }

    fn place_of(&mut self, id: &str) -> Result<u32, String> {
        if let Some(place) = self.places.get(id) {
            return Ok(*place);
        }
        if id.is_empty() {
            return Err("equipment: it is not named".into());
        }
        if self.equipment.len() >= MAX_EQUIPMENT {
            return Err(format!("more than {MAX_EQUIPMENT} transformers in one file"));
        }
        let place = self.equipment.len() as u32;
        self.equipment.push(id.to_owned());
        self.places.insert(id.to_owned(), place);
        Ok(place)
    }
}

/// Returns the time of change and the length of a file, by which a change is noticed.
pub(crate) fn version(file: &Path) -> Option<(SystemTime, u64)> {
    let metadata = std::fs::metadata(file).ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

/// Reads all samples, until it is to end. Rows that are none are left out and told.
///
/// # Errors
/// Why there can be none, in words with a remedy.
pub(crate) fn read(settings: &FleetSettings, ends: &AtomicBool) -> Result<Readings, String> {
    let is_csv = settings.file.extension().is_some_and(|end| end.eq_ignore_ascii_case("csv"));
    match is_csv {
        true => read_csv(&settings.file, ends),
        false => read_sqlite(&settings.file, &settings.query, ends),
    }
}

fn read_csv(path: &Path, ends: &AtomicBool) -> Result<Readings, String> {
    let at = |fault: std::io::Error| format!("{}: {fault}", path.display());
    let mut lines = Lines::open(File::open(path).map_err(at)?).map_err(at)?;
    let mut cells = Cells::new();
    let header = table::header(&mut lines, &mut cells).map_err(at)?;
    let columns = header.map_err(|(line, fault)| {
        format!("{}:{}: {fault}", path.display(), line.unwrap_or_default())
    })?;
    let places = places(&columns).ok_or_else(|| no_identity(path))?;
    let extras = EXTRAS
        .map(|name| (0..cells.len()).find(|&index| cells.get(index).eq_ignore_ascii_case(name)));
    let mut readings = Readings::default();
    loop {
        let read = lines.read().map_err(at)?;
        if read == Line::End {
            return Ok(readings);
        }
        if read == Line::Whole && lines.text.trim_ascii().is_empty() {
            continue;
        }
        may_go_on(path, &readings, ends)?;
        let sample = table::sample(read, &lines.text, &columns, &mut cells);
        let added = sample.and_then(|sample| readings.add(sample, &cells, places, extras));
        if let Err(fault) = added {
            readings.fault(lines.number, &fault);
        }
    }
}

fn places(columns: &Columns) -> Option<[usize; 2]> {
    table::identity(columns)
}

fn no_identity(path: &Path) -> String {
    format!("{}: a fleet needs the columns equipment and time", path.display())
}

/// Checks that one more sample may be read.
fn may_go_on(path: &Path, readings: &Readings, ends: &AtomicBool) -> Result<(), String> {
    if ends.load(Ordering::Relaxed) {
        return Err("it was to end".into());
    }
    if readings.all.len() >= MAX_SAMPLES {
        let path = path.display();
        return Err(format!(
            "{path}: more than {MAX_SAMPLES} samples; take fewer years, or fewer transformers"
        ));
    }
    Ok(())
}

fn read_sqlite(path: &Path, query: &str, ends: &AtomicBool) -> Result<Readings, String> {
    let at = |fault: rusqlite::Error| format!("{}: {fault}", path.display());
    if !path.is_file() {
        return Err(format!("{}: there is no such file", path.display()));
    }
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let mut connection = Connection::open_with_flags(path, flags).map_err(at)?;
    connection.busy_timeout(MAX_LOCK_WAIT).map_err(at)?;
    connection.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_VALUE_BYTES).map_err(at)?;
    connection.set_limit(Limit::SQLITE_LIMIT_ATTACHED, 0).map_err(at)?;
    connection.execute_batch("PRAGMA query_only = ON; PRAGMA trusted_schema = OFF;").map_err(at)?;
    let begun = std::time::Instant::now();
    let is_late = move || begun.elapsed() > MAX_QUERY;
    connection.progress_handler(PROGRESS_STEPS, Some(is_late)).map_err(at)?;
    let mut statement = connection.prepare(query).map_err(at)?;
    let names = statement.column_names().collect::<Vec<_>>().join(",");
    let mut cells = Cells::new();
    cells.cut(names.as_bytes())?;
    let columns =
        Columns::from_cells(&cells).map_err(|fault| format!("{}: {fault}", path.display()))?;
    let places = places(&columns).ok_or_else(|| no_identity(path))?;
    let find = |name: &str| (0..cells.len()).find(|&i| cells.get(i).eq_ignore_ascii_case(name));
    let extras = EXTRAS.map(find);
    let count = cells.len();
    let mut readings = Readings::default();
    let mut rows = statement.query([]).map_err(at)?;
    let mut number = 0;
    while let Some(row) = rows.next().map_err(at)? {
        number += 1;
        may_go_on(path, &readings, ends)?;
        let line: Result<Vec<String>, String> =
            (0..count).map(|at| text(row.get_ref(at))).collect();
        let added = line.and_then(|line| {
            cells.cut(line.join(",").as_bytes())?;
            let mut sample = Sample::new();
            for &(gas, index) in &columns.gases {
                let added = row::add(sample, gas, cells.get(index));
                sample = added.map_err(|fault| format!("{}: {fault}", gas.formula()))?;
            }
            readings.add(sample, &cells, places, extras)
        });
        if let Err(fault) = added {
            readings.fault(number, &fault);
        }
    }
    Ok(readings)
}

/// A value as a cell of CSV.
fn text(value: Result<ValueRef<'_>, rusqlite::Error>) -> Result<String, String> {
    Ok(match value.map_err(|error| error.to_string())? {
        ValueRef::Null => String::new(),
        ValueRef::Integer(number) => number.to_string(),
        ValueRef::Real(number) => number.to_string(),
        ValueRef::Text(text) => {
            let text = std::str::from_utf8(text).map_err(|_| "a text is not UTF-8")?;
            if text.contains(['\r', '\n']) {
                return Err("a text has more than one line".into());
            }
            format!("\"{}\"", text.replace('"', "\"\""))
        }
        ValueRef::Blob(_) => return Err("a value is binary".into()),
    })
}
