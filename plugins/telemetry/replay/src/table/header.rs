//! Rows before the data: the header that names columns, and the row of units.

use source_units::find_unit;
use text_table::Cells;

use super::config::{Column, CsvConfig, Form};
use crate::address::{Points, Source};

/// Decision on the first row of a table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum FirstRow {
    /// First row that names the columns.
    Header,
    /// First row with data; columns have numbers alone.
    Data,
}

/// Decides what the first row is, with a remark where the settings leave it open or differ.
///
/// # Errors
/// Columns by name in a table that has no header.
pub(super) fn judge_first_row(
    config: &CsvConfig,
    points: &Points,
    cells: &Cells,
    line: u64,
) -> Result<(FirstRow, Option<String>), String> {
    let time = time_of(config, cells);
    match (config.header, time) {
        (Some(true), None) => Ok((FirstRow::Header, None)),
        (Some(true), Some(time)) => Ok((
            FirstRow::Header,
            Some(format!(
                "line {line} is the header by csv.header, but has the time '{time}': where it is \
                 data, set csv.header to false"
            )),
        )),
        (Some(false), _) => match named_column(config, points) {
            None => Ok((FirstRow::Data, None)),
            Some(name) => Err(format!(
                "there is no header (csv.header is false), but '{name}' is a column by name: give \
                 its number"
            )),
        },
        (None, time) if named_column(config, points).is_some() => {
            let remark =
                time.map(|time| format!("line {line} is the header, but has the time '{time}'"));
            Ok((FirstRow::Header, remark))
        }
        (None, Some(time)) => Ok((
            FirstRow::Data,
            Some(format!(
                "line {line} has the time '{time}': taken as data, the file has no header; \
                 csv.header says otherwise"
            )),
        )),
        (None, None) => Ok((
            FirstRow::Header,
            Some(format!(
                "line {line} has no time: taken as the header; csv.header says otherwise"
            )),
        )),
    }
}

/// The time of a row whose time column has a number, where its text is a time.
fn time_of(config: &CsvConfig, cells: &Cells) -> Option<String> {
    let cell = |column: &Column| match column {
        Column::Number(number) => Some(cells.get((*number as usize).checked_sub(1)?)),
        // A name is that of a time column where its header would be.
        Column::Name(_) => None,
    };
    let date = config.date.as_ref().map(cell);
    let text = match &config.time {
        Column::Number(_) => cell(&config.time)?,
        Column::Name(_) => {
            let is_time = |text: &&str| config.times.read(None, text, None).is_ok();
            return cells.iter().find(is_time).map(text_table::shorten);
        }
    };
    let date = date.map_or(Some(None), |date| date.map(Some))?;
    config.times.read(date, text, None).ok().map(|_| text_table::shorten(text))
}

/// A column that is used by its name.
fn named_column(config: &CsvConfig, points: &Points) -> Option<String> {
    let mut used: Vec<&Column> = vec![&config.time];
    used.extend(&config.date);
    used.extend(&config.quality);
    if config.form == Form::Long {
        used.extend([&config.name, &config.value]);
    } else {
        for point in &points.0 {
            match &point.source {
                Source::One(one) => used.push(one),
                Source::Two(off, on) => used.extend([off, on]),
            }
            used.extend(&point.quality);
        }
    }
    used.into_iter().find_map(|column| match column {
        Column::Name(name) => Some(name.clone()),
        Column::Number(_) => None,
    })
}

/// Reports a row of units: no time, no number, and a known unit.
pub(super) fn is_units_row(
    config: &CsvConfig,
    cells: &Cells,
    [time, date]: [Option<usize>; 2],
) -> bool {
    match config.units_row {
        Some(is_set) => is_set,
        None => {
            let is_number = |text: &str| config.numbers.parse_f64(text).is_ok();
            let [time, date] = [time, date].map(|column| column.map(|column| cells.get(column)));
            config.times.read(date, time.unwrap_or_default(), None).is_err()
                && !cells.iter().any(is_number)
                && cells.iter().any(|cell| find_unit(unit_of(cell)).is_some())
        }
    }
}

/// The unit of a cell of such a row, without brackets.
pub(super) fn unit_of(cell: &str) -> &str {
    cell.trim_matches(['[', ']', '(', ')', ' '])
}
