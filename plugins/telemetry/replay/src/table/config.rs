//! Configuration of a table: its columns, dialect and formats.

use std::collections::{BTreeMap, HashSet};

use busbar_plugin_sdk::Quality;
use schemars::JsonSchema;
use serde::Deserialize;
use text_table::{Dialect, NumberFormat, TimeReader};

use crate::settings::EmptyCells;

/// Names that a message lists.
const MAX_LISTED: usize = 12;

/// A column or channel: by name, or by number from 1 on.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(untagged, expecting = "a name, or a number from 1 on")]
pub(crate) enum Column {
    /// Number of the column, the first being 1.
    Number(u32),
    /// Name of the column.
    Name(String),
}

/// Shape of a table.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Form {
    /// A column a signal.
    #[default]
    Wide,
    /// A row a value: time, name, value.
    Long,
}

/// Configuration of a table, checked.
#[derive(Clone, Debug)]
pub(crate) struct CsvConfig {
    pub(crate) form: Form,
    pub(crate) time: Column,
    /// Column of the date, where it is not in that of the time.
    pub(crate) date: Option<Column>,
    pub(crate) times: TimeReader,
    pub(crate) name: Column,
    pub(crate) value: Column,
    pub(crate) quality: Option<Column>,
    /// Qualities by words in lower case.
    pub(crate) qualities: BTreeMap<String, Quality>,
    pub(crate) dialect: Dialect,
    pub(crate) numbers: NumberFormat,
    /// Presence of a header, where the settings say it.
    pub(crate) header: Option<bool>,
    /// Presence of a row of units, where the settings say it.
    pub(crate) units_row: Option<bool>,
    pub(crate) empty_cells: EmptyCells,
    /// Words that are no value, in lower case.
    pub(crate) no_value: HashSet<String>,
    /// True where the settings name the words that are no value.
    pub(crate) has_own_no_value: bool,
    /// Names of rows by which the recorder says that it stopped.
    pub(crate) stop_names: HashSet<String>,
}

/// Finds a column or channel among names, counted from 0.
///
/// # Errors
/// None or several of the name, and what there is.
pub(crate) fn find_column(names: &[&str], column: &Column, what: &str) -> Result<usize, String> {
    match column {
        Column::Number(number) => {
            let index = (*number as usize).checked_sub(1).filter(|index| *index < names.len());
            index.ok_or_else(|| format!("there is no {what} {number}: there are {}", names.len()))
        }
        Column::Name(wanted) => {
            let is_wanted = |name: &str| name == wanted.trim();
            let found: Vec<usize> =
                (0..names.len()).filter(|&index| is_wanted(names[index])).collect();
            match found[..] {
                [index] => Ok(index),
                [] => Err(format!("there is no {what} '{wanted}'; there are {}", list(names))),
                [..] => {
                    let numbers: Vec<_> =
                        found.iter().take(MAX_LISTED).map(|i| (i + 1).to_string()).collect();
                    Err(format!(
                        "{} are {what}s '{wanted}': give the number, not the name",
                        numbers.join(", ")
                    ))
                }
            }
        }
    }
}

fn list(names: &[&str]) -> String {
    if names.is_empty() {
        return "none".into();
    }
    let mut listed: Vec<_> =
        names.iter().take(MAX_LISTED).map(|name| format!("'{name}'")).collect();
    if names.len() > MAX_LISTED {
        listed.push(format!("and {} more", names.len() - MAX_LISTED));
    }
    listed.join(", ")
}
