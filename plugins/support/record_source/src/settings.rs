//! Settings of a list of records.

use std::path::Path;

use busbar_plugin_sdk::{
    DefectSeverity, Error, MAX_RECORD_COLUMNS, MAX_RECORD_LISTS, RecordColumn, RecordColumnType,
    RecordKind, RecordList,
};

use crate::CellFormats;

const SECONDS_PER_DAY: u64 = 86_400;
/// Days for which lists count as current by default: an export that failed over a weekend
/// shows, and a register is checked once a year.
const BUSINESS_DAYS: u32 = 4;
const ASSET_DAYS: u32 = 400;

/// List of records from a source of any kind.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ListSettings<S> {
    /// Title of the list.
    #[schemars(length(min = 1, max = 100), extend("examples" = ["Work orders"]))]
    pub title: String,
    /// Subject of the list: `business` for past and planned work, `asset` for properties of
    /// equipment.
    pub kind: RecordKind,
    /// Source of the list.
    pub source: S,
    /// Column of the source with the equipment's id, or an alias of it.
    #[schemars(length(min = 1, max = 200), extend("examples" = ["EQUIPMENT"]))]
    pub equipment: String,
    /// Columns that are shown.
    #[schemars(length(min = 1, max = 32))]
    pub columns: Vec<ColumnSettings>,
    /// Column of the source with the time by which rows are ordered.
    #[serde(default)]
    pub time: Option<String>,
    /// Format of times and dates: `rfc3339` (ISO 8601, with or without a time of day),
    /// `unix_seconds`, `unix_millis`, `unix_micros`, `unix_nanos`, `excel` (serial days), or a
    /// pattern of strftime such as `%d.%m.%Y %H:%M`.
    #[serde(default)]
    #[schemars(length(min = 1, max = 100), extend("examples" = ["%d.%m.%Y %H:%M"]))]
    pub time_format: Option<String>,
    /// Zone of times that name none: `Europe/Berlin`, `UTC` or `+05:30`; UTC where missing.
    #[serde(default)]
    #[schemars(length(min = 1, max = 64), extend("examples" = ["Europe/Berlin"]))]
    pub zone: Option<String>,
    /// Rule for open rows. Without it none is open.
    #[serde(default)]
    pub open: Option<OpenSettings>,
    /// Rule for the severity of defects. Without it rows are no defects.
    #[serde(default)]
    pub severity: Option<SeveritySettings>,
    /// Days after which the list counts as old if its source does not change. Where missing, 4 for
    /// business, 400 for an asset register; 0 is never.
    #[serde(default)]
    #[schemars(range(max = 36_500))]
    pub valid_days: Option<u32>,
}

/// Column that is shown.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColumnSettings {
    /// Name of the column in the source.
    #[schemars(length(min = 1, max = 200), extend("examples" = ["WO_NO"]))]
    pub column: String,
    /// Display name of the column; where missing, that of the source.
    #[serde(default)]
    #[schemars(length(min = 1, max = 200), extend("examples" = ["Work order"]))]
    pub name: Option<String>,
    /// Type of the column's cells; a cell of another form makes the row wrong.
    #[serde(default, rename = "type")]
    pub column_type: RecordColumnType,
    /// Unit of the column's numbers.
    #[serde(default)]
    #[schemars(length(max = 50), extend("examples" = ["kV"]))]
    pub unit: String,
}

/// Rule for open rows.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpenSettings {
    /// Column of the source with the state of a row.
    #[schemars(length(min = 1, max = 200), extend("examples" = ["STATUS"]))]
    pub column: String,
    /// Texts that close a row, in upper or lower case. Without any, every text does, such as a date
    /// of completion.
    #[serde(default)]
    #[schemars(extend("examples" = [["closed", "done"]]))]
    pub closed: Vec<String>,
}

/// Rule for the severity of defects: texts of the source, in upper or lower case. Any other text is
/// no defect.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SeveritySettings {
    /// Column of the source with the severity.
    #[schemars(length(min = 1, max = 200), extend("examples" = ["PRIORITY"]))]
    pub column: String,
    /// Texts of defects to be mended at once.
    #[serde(default)]
    pub critical: Vec<String>,
    /// Texts of defects to be mended soon, and watched until then.
    #[serde(default)]
    pub serious: Vec<String>,
    /// Texts of defects to be mended when there is occasion.
    #[serde(default)]
    pub general: Vec<String>,
}

impl OpenSettings {
    pub(crate) fn is_open(&self, cell: &str) -> bool {
        match self.closed.is_empty() {
            true => cell.is_empty(),
            false => !has(&self.closed, cell),
        }
    }
}

impl SeveritySettings {
    pub(crate) fn severity_of(&self, cell: &str) -> Option<DefectSeverity> {
        let words = [
            (&self.critical, DefectSeverity::Critical),
            (&self.serious, DefectSeverity::Serious),
            (&self.general, DefectSeverity::General),
        ];
        words.into_iter().find(|(words, _)| has(words, cell)).map(|(_, severity)| severity)
    }
}

fn has(words: &[String], cell: &str) -> bool {
    let cell = cell.to_lowercase();
    words.iter().any(|word| word.to_lowercase() == cell)
}

impl<S> ListSettings<S> {
    /// Creates the list of the settings, without rows; `name` is the display name of its source.
    pub fn list(&self, name: &str) -> RecordList {
        let days = self.valid_days.unwrap_or(match self.kind {
            RecordKind::Business => BUSINESS_DAYS,
            RecordKind::Asset => ASSET_DAYS,
        });
        let column = |column: &ColumnSettings| RecordColumn {
            name: column.name.clone().unwrap_or_else(|| column.column.clone()),
            column_type: column.column_type,
            unit: column.unit.clone(),
        };
        RecordList {
            title: self.title.clone(),
            kind: self.kind,
            source: name.to_owned(),
            columns: self.columns.iter().map(column).collect(),
            valid_seconds: u64::from(days) * SECONDS_PER_DAY,
            ..RecordList::default()
        }
    }
}

/// Checks that lists can be read as they are set, each from a file.
///
/// # Errors
/// What must be changed.
pub fn check<'a, S: 'a>(
    lists: &'a [ListSettings<S>],
    file: impl Fn(&'a S) -> &'a Path,
) -> Result<(), Error> {
    if lists.is_empty() || lists.len() > MAX_RECORD_LISTS {
        return Err(Error::settings(format!("lists: give 1 to {MAX_RECORD_LISTS}")));
    }
    for (index, list) in lists.iter().enumerate() {
        let wrong = |what: String| Err(Error::settings(format!("lists[{index}]{what}")));
        if let Err(fault) = CellFormats::with_decimal_point(list) {
            return wrong(format!(".{fault}"));
        }
        let path = file(&list.source);
        if !path.is_absolute() {
            return wrong(format!(".source.file: '{}' is no absolute path", path.display()));
        }
        if list.columns.is_empty() || list.columns.len() > MAX_RECORD_COLUMNS {
            return wrong(format!(".columns: give 1 to {MAX_RECORD_COLUMNS}"));
        }
        let texts = [&list.title].into_iter();
        let names = list.columns.iter().map(|c| c.name.as_ref().unwrap_or(&c.column));
        let units = list.columns.iter().map(|column| &column.unit);
        let is_line = |text: &&String| text.len() <= 256 && !text.contains(char::is_control);
        if let Some(text) = texts.clone().chain(names.clone()).chain(units).find(|t| !is_line(t)) {
            return wrong(format!(": '{}' is not one short line", crate::shown(text)));
        }
        if texts.chain(names).any(|text| text.trim().is_empty()) {
            return wrong(": its title, or the name of a column, is empty".into());
        }
    }
    Ok(())
}
