//! Records of equipment from CSV files: work orders, inspections, an asset register.
//!
//! A file is read again when its time or size changed. A row that is wrong is told with its
//! line and the reason, and the rest goes on.

mod file;
pub mod probe;
mod table;

use std::path::PathBuf;

use busbar_plugin_sdk::{Error, Host, Plugin, RecordList, RecordSet, Records};
use record_source::{PolledRecords, Source};
use text_table::{Delimiter, Dialect, Separators};

pub use record_source::ListSettings;

use crate::table::Table;

/// Settings of the plugin.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Lists, each from a file of its own.
    #[schemars(length(min = 1, max = 16))]
    lists: Vec<ListSettings<CsvFile>>,
}

/// CSV file, whose first row names its columns.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CsvFile {
    /// Absolute path of the file.
    #[schemars(extend("examples" = ["/var/lib/site/work_orders.csv"]))]
    file: PathBuf,
    /// Character between cells: `comma`, `semicolon`, `tab` or `pipe`, or the character itself.
    /// Without it that of a line `sep=;`, else a semicolon beside a decimal comma and a comma
    /// beside a decimal point.
    #[serde(default)]
    #[schemars(length(min = 1, max = 9), extend("examples" = ["semicolon"]))]
    delimiter: Option<String>,
    /// Encoding of the file by its name on the web (WHATWG), such as `gb18030` or `windows-1252`;
    /// UTF-8 where missing. A byte order mark takes precedence.
    #[serde(default)]
    #[schemars(length(min = 1, max = 40), extend("examples" = ["gb18030"]))]
    encoding: Option<String>,
    /// Character before the fraction of numbers, `.` or `,`.
    #[serde(default = "default_decimal")]
    #[schemars(length(min = 1, max = 1))]
    decimal: String,
    /// Character between thousands: `.` `,` `'` or a space. Without it there is none.
    #[serde(default)]
    #[schemars(length(min = 1, max = 1), extend("examples" = ["."]))]
    thousands: Option<String>,
    /// Lines before the header, a line `sep=;` among them.
    #[serde(default)]
    #[schemars(range(max = 10_000))]
    skip_lines: u32,
    /// Start of lines that are comments.
    #[serde(default)]
    #[schemars(length(min = 1, max = 16), extend("examples" = ["#"]))]
    comment: Option<String>,
}

fn default_decimal() -> String {
    ".".into()
}

impl CsvFile {
    /// Returns the CSV dialect and the separators of numbers in the settings.
    ///
    /// # Errors
    /// Each setting at fault, with what is allowed.
    fn dialect(&self, encoding: Option<&str>) -> Result<(Dialect, Separators), String> {
        let (delimiter, comment) = (self.delimiter.as_deref(), self.comment.as_deref());
        let dialect = Dialect::parse(delimiter, encoding, self.skip_lines, comment);
        let separators = Separators::parse(&self.decimal, self.thousands.as_deref());
        match (dialect, separators) {
            (Ok(mut dialect), Ok(separators)) => {
                dialect.fallback = Delimiter::beside(separators.decimal);
                Ok((dialect, separators))
            }
            (dialect, separators) => {
                let mut faults = dialect.err().unwrap_or_default();
                faults.extend(separators.err());
                Err(faults.join("; "))
            }
        }
    }
}

/// Records plugin for CSV files.
pub struct CsvRecords {
    polled: PolledRecords,
}

impl Plugin for CsvRecords {
    const ID: &'static str = "csv_records";
    const NAME: &'static str = "CSV records";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Work orders and asset registers from CSV files.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        record_source::check(&settings.lists, |source| &source.file)?;
        let mut lists: Vec<(RecordList, Box<dyn Source>)> = Vec::new();
        for (index, list) in settings.lists.into_iter().enumerate() {
            let table = Table::new(list, None).map_err(|fault| {
                let faults = fault.replace("; ", &format!("; lists[{index}].source."));
                Error::settings(format!("lists[{index}].source.{faults}"))
            })?;
            let path = &table.list.source.file;
            let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
            let shown = table.list.list(&record_source::shown(&name));
            lists.push((shown, Box::new(table)));
        }
        Ok(Self { polled: PolledRecords::start(&host, lists)? })
    }
}

impl Records for CsvRecords {
    fn records(&mut self) -> Result<RecordSet<'_>, Error> {
        Ok(self.polled.records())
    }
}

busbar_plugin_sdk::export_plugin!(CsvRecords: records);

#[cfg(test)]
mod tests;
