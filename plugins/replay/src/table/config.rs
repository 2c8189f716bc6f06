//! What the settings say of a table.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::settings::EmptyCells;

/// Names that a message lists.
const MAX_LISTED: usize = 12;

/// A column or channel: by name, or by number from 1 on.
#[derive(Clone, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(untagged, expecting = "a name, or a number from 1 on")]
pub(crate) enum Column {
    /// Its number, the first being 1.
    Number(u32),
    /// Its name.
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

/// How times are written.
#[derive(Clone, Copy, Debug, Default, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub(crate) enum TimeFormat {
    /// RFC 3339, such as 2024-02-29T13:14:15.5+01:00.
    #[default]
    Rfc3339,
    /// Seconds since 1970, with a fraction.
    UnixSeconds,
    /// Milliseconds since 1970.
    UnixMillis,
    /// Seconds from any start.
    Seconds,
}

/// Columns of a table, checked.
#[derive(Clone, Debug)]
pub(crate) struct CsvConfig {
    pub(crate) form: Form,
    pub(crate) time: Column,
    pub(crate) time_format: TimeFormat,
    pub(crate) name: Column,
    pub(crate) value: Column,
    pub(crate) quality: Option<Column>,
    pub(crate) delimiter: u8,
    pub(crate) has_decimal_comma: bool,
    pub(crate) empty_cells: EmptyCells,
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
