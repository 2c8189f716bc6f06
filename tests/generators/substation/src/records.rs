//! Records of business and management systems about the station: work in a CSV file, an asset
//! register in an SQLite file. All of it is made up, by a seed.

mod templates;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use rusqlite::{Connection, params};
use serde_json::{Value, json};

use crate::Station;
use crate::seeded_random::SeededRandom;
use templates::{ASSETS, AssetTemplate, WORK, WorkTemplate};

/// Files of the records, beside the configuration.
const WORK_FILE: &str = "work.csv";
const REGISTER_FILE: &str = "register.db";
/// Number of the first row of work.
const FIRST_NUMBER: usize = 410_027;
/// Last day of the records, from which earlier days are counted.
const LAST_DAY: [u32; 3] = [2026, 11, 20];
/// Greatest number of rows of one device.
const MAX_ROWS: usize = 6;
/// Longest duration of work, days.
const MAX_WORK_DAYS: usize = 60;

/// Row of the work orders.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WorkRow {
    /// Kind of work: `Defect`, `Work order` or `Inspection`.
    pub kind: &'static str,
    /// Number of the order in its system.
    pub number: usize,
    /// Equipment by its number in dispatch where it has one, else by its id.
    pub equipment: String,
    /// Description of the defect or task.
    pub text: &'static str,
    /// Status of the work: `closed`, or the next step.
    pub status: &'static str,
    /// Day of the report, such as `2026-11-20`.
    pub reported: String,
    /// Priority of a defect, 1 (most urgent) to 3; else empty.
    pub priority: &'static str,
}

/// Row of the asset register.
#[derive(Clone, Debug, PartialEq)]
pub struct AssetRow {
    /// Id of the equipment.
    pub equipment: String,
    /// Maker and type designation.
    pub made: [String; 2],
    /// Serial number of the maker.
    pub serial: String,
    /// Year of manufacture, AD.
    pub year: u32,
    /// Rated voltage in kV.
    pub voltage: f64,
    /// Rated values of the plate.
    pub rating: String,
    /// Criticality from A (highest) to C.
    pub criticality: &'static str,
}

/// Work orders, assets and dispatch numbers of a station.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StationRecords {
    /// Work orders of the station.
    pub work: Vec<WorkRow>,
    /// Rows of the asset register.
    pub assets: Vec<AssetRow>,
    /// Dispatch numbers of breakers by equipment id.
    pub dispatch: BTreeMap<String, String>,
}

impl StationRecords {
    /// Generates the records of a station from a seed.
    pub fn generate(station: &Station, seed: u64) -> Self {
        let devices: BTreeSet<String> =
            station.placements.iter().map(crate::Placement::device_id).collect();
        let mut chance = SeededRandom::new(seed);
        let mut records = Self::default();
        for device in devices {
            let Some(asset) = ASSETS.iter().find(|asset| asset.matches_device(&device)) else {
                continue;
            };
            if asset.code == "QA" {
                let (level, count) = (level_of(&device), records.dispatch.len() + 1);
                records.dispatch.insert(device.clone(), format!("{level}{count:02}"));
            }
            records.assets.push(asset.row(&device, level_of(&device), &mut chance));
            records.add_work(&device, asset.code, &mut chance);
        }
        records
    }

    fn add_work(&mut self, device: &str, code: &str, chance: &mut SeededRandom) {
        let own: Vec<&WorkTemplate> = WORK.iter().filter(|work| work.code == code).collect();
        let equipment = self.dispatch.get(device).map_or(device, String::as_str).to_owned();
        // From the newest, each some months before the last.
        let mut days_ago = chance.below(MAX_WORK_DAYS);
        let first = chance.below(own.len());
        for nth in 0..chance.below(MAX_ROWS + 1) {
            let template = own[(first + nth) % own.len()];
            let is_open = nth == 0 && days_ago < MAX_WORK_DAYS / 2;
            self.work.push(WorkRow {
                kind: template.kind,
                number: FIRST_NUMBER + self.work.len(),
                equipment: equipment.clone(),
                text: template.text,
                status: if is_open { template.next } else { "closed" },
                reported: day(days_ago),
                priority: template.priority,
            });
            days_ago += 30 + chance.below(400);
        }
    }

    /// Adds the plugins that read the records, and the dispatch numbers of breakers, to a
    /// configuration. The files are in `folder`, an absolute path.
    pub fn add_to(&self, configuration: &mut Value, folder: &Path) {
        configuration["plugins"]["work"] = json!({
            "plugin": "csv_records",
            "settings": { "lists": [{
                "title": "Work",
                "kind": "business",
                "source": { "file": folder.join(WORK_FILE) },
                "equipment": "EQUIPMENT",
                "columns": [
                    { "column": "REPORTED", "name": "Reported", "type": "date" },
                    { "column": "TYPE", "name": "Type" },
                    { "column": "NUMBER", "name": "Number", "type": "number" },
                    { "column": "TEXT", "name": "Description" },
                    { "column": "STATUS", "name": "Status" },
                ],
                "time": "REPORTED",
                "open": { "column": "STATUS", "closed": ["closed"] },
                "severity": {
                    "column": "PRIORITY", "critical": ["1"], "serious": ["2"], "general": ["3"],
                },
            }] },
        });
        configuration["plugins"]["register"] = json!({
            "plugin": "sqlite_records",
            "settings": { "lists": [{
                "title": "Asset register",
                "kind": "asset",
                "source": { "file": folder.join(REGISTER_FILE), "query": "SELECT * FROM assets" },
                "equipment": "equipment",
                "columns": [
                    { "column": "maker", "name": "Maker" },
                    { "column": "model", "name": "Model" },
                    { "column": "serial", "name": "Serial number" },
                    { "column": "year", "name": "Year", "type": "number" },
                    { "column": "voltage", "name": "Rated voltage", "type": "number", "unit": "kV" },
                    { "column": "rating", "name": "Rating" },
                    { "column": "criticality", "name": "Criticality" },
                ],
            }] },
        });
        configuration["records"] = json!(["work", "register"]);
        for (equipment, number) in &self.dispatch {
            configuration["equipment"][equipment] = json!({ "aliases": [number] });
        }
    }

    /// Writes both files into a folder.
    ///
    /// # Errors
    /// The first that cannot be written.
    pub fn write(&self, folder: &Path) -> anyhow::Result<()> {
        let mut file = csv::Writer::from_path(folder.join(WORK_FILE))?;
        file.write_record([
            "TYPE",
            "NUMBER",
            "EQUIPMENT",
            "TEXT",
            "STATUS",
            "REPORTED",
            "PRIORITY",
        ])?;
        for row in &self.work {
            let WorkRow { kind, number, equipment, text, status, reported, priority } = row;
            let number = number.to_string();
            file.write_record([*kind, &number, equipment, text, status, reported, priority])?;
        }
        file.flush()?;
        self.write_register(&folder.join(REGISTER_FILE))
    }

    fn write_register(&self, path: &Path) -> anyhow::Result<()> {
        if path.exists() {
            fs::remove_file(path)?;
        }
        let mut database = Connection::open(path)?;
        database.execute_batch(
            "CREATE TABLE assets (equipment TEXT PRIMARY KEY, maker TEXT, model TEXT, serial TEXT,
             year INTEGER, voltage REAL, rating TEXT, criticality TEXT)",
        )?;
        let all = database.transaction()?;
        for row in &self.assets {
            let AssetRow { equipment, made: [maker, model], serial, year, .. } = row;
            all.execute(
                "INSERT INTO assets VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)",
                params![
                    equipment,
                    maker,
                    model,
                    serial,
                    year,
                    row.voltage,
                    row.rating,
                    row.criticality
                ],
            )?;
        }
        all.commit()?;
        Ok(())
    }
}

impl AssetTemplate {
    /// Reports whether a device, such as `=S12D1Q1-QA1`, is of this template's class.
    fn matches_device(&self, device: &str) -> bool {
        device.rsplit('-').next().is_some_and(|own| own.starts_with(self.code))
    }

    fn row(&self, device: &str, level: u32, chance: &mut SeededRandom) -> AssetRow {
        let (maker, model) = self.made[chance.below(self.made.len())];
        let year = 1994 + chance.below(30) as u32;
        AssetRow {
            equipment: device.to_owned(),
            made: [maker.to_owned(), model.to_owned()],
            serial: format!("{}{:02}-{:05}", self.code, year % 100, chance.below(100_000)),
            year,
            voltage: if level == 22 { 252.0 } else { 126.0 },
            rating: self.rating.to_owned(),
            criticality: self.criticality,
        }
    }
}

/// Returns the first part of dispatch numbers: the yard's voltage in tens of kilovolts.
fn level_of(device: &str) -> u32 {
    if device.starts_with("=S12D") || device.starts_with("=S12T") { 22 } else { 11 }
}

/// Returns a day so many days before the last, in a calendar of 28 days a month; every such day is
/// also in the Gregorian one.
fn day(days_ago: usize) -> String {
    let [year, month, day] = LAST_DAY;
    let last = (year * 12 + month - 1) * 28 + day - 1;
    let at = last.saturating_sub(days_ago as u32);
    let (months, day) = (at / 28, at % 28 + 1);
    format!("{}-{:02}-{day:02}", months / 12, months % 12 + 1)
}
