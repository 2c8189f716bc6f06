//! Mapping of a source's columns to the cells of records.

use busbar_plugin_sdk::{MAX_RECORD_TEXT, Record, RecordColumnType};

use crate::{CellFormats, ColumnSettings, ListSettings, shown};

/// Columns of a source that a message names.
const MAX_NAMED: usize = 20;

/// Positions of the columns that a list needs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnLayout {
    equipment: usize,
    cells: Vec<usize>,
    time: Option<usize>,
    open: Option<usize>,
    severity: Option<usize>,
}

impl ColumnLayout {
    /// Finds the columns of a list by the names of a source's columns.
    ///
    /// # Errors
    /// A column that is not there, or is there twice, in words.
    pub fn find<S>(list: &ListSettings<S>, names: &[impl AsRef<str>]) -> Result<Self, String> {
        let find = |wanted: &String| {
            let mut found = (0..names.len()).filter(|&at| names[at].as_ref().trim() == wanted);
            match (found.next(), found.next()) {
                (Some(at), None) => Ok(at),
                (Some(_), Some(_)) => Err(format!("column '{wanted}' is there twice: rename one")),
                (None, _) => {
                    let named: Vec<_> = names.iter().take(MAX_NAMED).map(AsRef::as_ref).collect();
                    let has = shown(&named.join("', '"));
                    Err(format!("there is no column '{wanted}'; it has '{has}'"))
                }
            }
        };
        Ok(Self {
            equipment: find(&list.equipment)?,
            cells: list.columns.iter().map(|c| find(&c.column)).collect::<Result<_, _>>()?,
            time: list.time.as_ref().map(find).transpose()?,
            open: list.open.as_ref().map(|open| find(&open.column)).transpose()?,
            severity: list.severity.as_ref().map(|s| find(&s.column)).transpose()?,
        })
    }

    /// Converts a row to a record; `cell` returns its cells.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn record<'c, S>(
        &self,
        list: &ListSettings<S>,
        formats: &CellFormats,
        cell: impl Fn(usize) -> Result<&'c str, String>,
    ) -> Result<Record, String> {
        let cell = |at: usize| cell(at).map(str::trim);
        let optional = |at: Option<usize>| at.map_or(Ok(""), cell);
        let equipment = cell(self.equipment)?;
        if equipment.is_empty() {
            return Err("it names no equipment".into());
        }
        if equipment.len() > MAX_RECORD_TEXT || equipment.contains(char::is_control) {
            return Err("its equipment is too long, or not one line".into());
        }
        let mut cells = Vec::with_capacity(self.cells.len());
        for (at, column) in self.cells.iter().zip(&list.columns) {
            let text = cell(*at)?;
            cells.push(written(column, text, formats)?);
        }
        let (time, state) = (optional(self.time)?, optional(self.open)?);
        let unix_nanos = match time {
            "" => None,
            time => Some(formats.unix_nanos(time)?),
        };
        let severity = optional(self.severity)?;
        Ok(Record {
            equipment: equipment.to_owned(),
            cells,
            unix_nanos,
            severity: list.severity.as_ref().and_then(|settings| settings.severity_of(severity)),
            is_open: list.open.as_ref().is_some_and(|settings| settings.is_open(state)),
        })
    }
}

/// Converts a cell to the form of records: numbers with a decimal point, dates of ISO 8601.
fn written(column: &ColumnSettings, text: &str, formats: &CellFormats) -> Result<String, String> {
    let name = &column.column;
    if text.len() > MAX_RECORD_TEXT {
        return Err(format!("column '{name}' has more than {MAX_RECORD_TEXT} bytes"));
    }
    let at_column = |what: String| format!("column '{name}': {what}");
    match column.column_type {
        _ if text.is_empty() => Ok(String::new()),
        RecordColumnType::Text => Ok(text.to_owned()),
        RecordColumnType::Number => formats.number(text, &column.unit).map_err(at_column),
        RecordColumnType::Date => formats.date(text).map_err(at_column),
    }
}
