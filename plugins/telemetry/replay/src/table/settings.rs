//! Settings of a table as typed, and the configuration made from them.

use std::collections::BTreeMap;

use busbar_plugin_sdk::{Quality, QualityLevel, Reason};
use schemars::JsonSchema;
use serde::Deserialize;
use text_table::{
    Delimiter, Dialect, NO_VALUE_WORDS, NumberFormat, Separators, TimeFormat, TimeReader, Zone,
};

use super::config::{Column, CsvConfig, Form};
use crate::settings::{EmptyCells, SettingsFaults};

/// Longest name of a column.
const MAX_NAME_BYTES: usize = 1024;
/// Most words of a list of the settings.
const MAX_WORDS: usize = 256;

/// A table, and how its cells are written.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(crate) struct RawCsv {
    /// A column a signal, or a row a value.
    form: Form,
    /// Column of the time: its name, or its number from 1 on.
    time: Column,
    /// Column of the date, where date and time have two columns.
    date: Option<Column>,
    /// Format of times: `rfc3339`, `unix_seconds`, `unix_millis`, `unix_micros`, `unix_nanos`,
    /// `seconds` (from any start), `excel` (serial days), `wincc` (millionths of them), or a
    /// pattern of strftime such as `%d.%m.%Y %H:%M:%S`.
    #[schemars(length(min = 1, max = 100), example = &"%d.%m.%Y %H:%M:%S")]
    time_format: String,
    /// Zone of times that name none: `Europe/Berlin`, `UTC` or `+05:30`.
    #[schemars(length(min = 1, max = 64), example = &"Europe/Berlin")]
    zone: Option<String>,
    /// Long form: column of the signal's name.
    name: Column,
    /// Long form: column of the value.
    value: Column,
    /// Column of the quality.
    quality: Option<Column>,
    /// Qualities of words and codes, before those that are known: `good`, `uncertain`, `bad`.
    qualities: BTreeMap<String, QualityLevel>,
    /// Character between cells: `,` `;` tab or `|`, or its name. Without it that of a line `sep=;`,
    /// else `;` beside a decimal comma and `,` beside a decimal point.
    #[schemars(length(min = 1, max = 9))]
    delimiter: Option<String>,
    /// Character before the fraction of numbers, `.` or `,`.
    #[schemars(length(min = 1, max = 1))]
    decimal: String,
    /// Character between thousands: `.` `,` `'` or a space. Without it there is none.
    #[schemars(length(min = 1, max = 1), example = &".")]
    thousands: Option<String>,
    /// Character encoding, such as `windows-1252`, `windows-1251`, `gb18030`, `utf-16le`; a byte
    /// order mark goes before it.
    #[schemars(length(min = 1, max = 40), example = &"windows-1252")]
    encoding: Option<String>,
    /// Lines before the header, a line `sep=;` among them.
    #[schemars(range(max = 10_000))]
    skip_lines: u32,
    /// Start of lines that are comments.
    #[schemars(length(min = 1, max = 16), example = &"#")]
    comment: Option<String>,
    /// Presence of a first row that names the columns. Without it the row tells: columns by name
    /// need a header, and a first row with a time is data.
    header: Option<bool>,
    /// Presence of a row of units after the header. Without it the row tells.
    units_row: Option<bool>,
    /// Meaning of an empty cell.
    empty_cells: EmptyCells,
    /// Words that are no value, without regard to case, in place of those that are known, such
    /// as `unknown`, `unavailable`, `---` and `n/a`. Of text tags words given here alone are none.
    no_value: Option<Vec<String>>,
    /// Long form: names of rows by which the recorder says that it stopped, such as `$RT_OFF$` of
    /// WinCC; all tags are bad from there until their next row.
    stop_names: Vec<String>,
}

impl Default for RawCsv {
    fn default() -> Self {
        Self {
            form: Form::default(),
            time: Column::Name("time".into()),
            date: None,
            time_format: "rfc3339".into(),
            zone: None,
            name: Column::Name("name".into()),
            value: Column::Name("value".into()),
            quality: None,
            qualities: BTreeMap::new(),
            delimiter: None,
            decimal: ".".into(),
            thousands: None,
            encoding: None,
            skip_lines: 0,
            comment: None,
            header: None,
            units_row: None,
            empty_cells: EmptyCells::default(),
            no_value: None,
            stop_names: Vec::new(),
        }
    }
}

impl RawCsv {
    /// Checks the settings; `encoding` and `zone` are those of all kinds of recordings.
    pub(crate) fn parse(
        self,
        encoding: Option<&str>,
        zone: Option<&str>,
        faults: &mut SettingsFaults,
    ) -> CsvConfig {
        self.check_columns(faults);
        let encoding = self.encoding.as_deref().or(encoding);
        let (delimiter, comment) = (self.delimiter.as_deref(), self.comment.as_deref());
        let dialect = Dialect::parse(delimiter, encoding, self.skip_lines, comment);
        let mut dialect = dialect.unwrap_or_else(|found| {
            found.into_iter().for_each(|fault| faults.add(format!("csv.{fault}")));
            Dialect::default()
        });
        let separators = Separators::parse(&self.decimal, self.thousands.as_deref());
        let separators = separators.unwrap_or_else(|fault| {
            faults.add(format!("csv.{fault}"));
            Separators { decimal: '.', thousands: None }
        });
        dialect.fallback = Delimiter::beside(separators.decimal);
        let format = TimeFormat::parse(&self.time_format).unwrap_or_else(|fault| {
            faults.add(format!("csv.time_format: {fault}"));
            TimeFormat::Iso
        });
        let zone = self.zone.as_deref().or(zone).map(Zone::parse).transpose();
        let zone = zone.unwrap_or_else(|fault| {
            faults.add(format!("csv.zone: {fault}"));
            None
        });
        if format.is_relative() && self.date.is_some() {
            faults.add("csv.date: seconds from any start have no date: remove it");
        }
        for (name, count) in [
            ("qualities", self.qualities.len()),
            ("no_value", self.no_value.as_ref().map_or(0, Vec::len)),
            ("stop_names", self.stop_names.len()),
        ] {
            if count > MAX_WORDS {
                faults.add(format!("csv.{name}: {count} words; at most {MAX_WORDS} are allowed"));
            }
        }
        let numbers = NumberFormat::new(separators);
        let lower = |word: &str| word.trim().to_lowercase();
        let words: Vec<String> = match &self.no_value {
            Some(words) => words.iter().map(|word| lower(word)).collect(),
            None => NO_VALUE_WORDS.iter().map(|word| lower(word)).collect(),
        };
        CsvConfig {
            form: self.form,
            time: self.time,
            date: self.date,
            times: TimeReader { format, zone, numbers },
            name: self.name,
            value: self.value,
            quality: self.quality,
            qualities: self
                .qualities
                .iter()
                .map(|(word, quality)| (lower(word), Quality::new(*quality, Reason::Unknown)))
                .collect(),
            dialect,
            numbers,
            header: self.header,
            units_row: self.units_row,
            empty_cells: self.empty_cells,
            no_value: words.into_iter().collect(),
            has_own_no_value: self.no_value.is_some(),
            stop_names: self.stop_names.iter().map(|name| name.trim().to_owned()).collect(),
        }
    }

    fn check_columns(&self, faults: &mut SettingsFaults) {
        for (name, column) in [
            ("time", Some(&self.time)),
            ("date", self.date.as_ref()),
            ("name", Some(&self.name)),
            ("value", Some(&self.value)),
            ("quality", self.quality.as_ref()),
        ] {
            match column {
                Some(Column::Number(0)) => {
                    faults.add(format!("csv.{name}: columns are counted from 1"));
                }
                Some(Column::Name(text)) if text.is_empty() || text.len() > MAX_NAME_BYTES => {
                    faults.add(format!("csv.{name}: a name has 1 to {MAX_NAME_BYTES} bytes"));
                }
                Some(Column::Name(_)) if self.header == Some(false) && self.is_used(name) => {
                    faults.add(format!(
                        "csv.{name}: without a header (csv.header is false) columns have numbers \
                         alone, from 1 on"
                    ));
                }
                _ => {}
            }
        }
    }

    fn is_used(&self, name: &str) -> bool {
        self.form == Form::Long || !matches!(name, "name" | "value")
    }
}
