//! Records of equipment from CSV files: work orders, inspections, an asset register.
//!
//! A file is read again when its time or size changed. A row that is wrong is told with its
//! line and the reason, and the rest goes on.

mod file;
pub mod probe;
mod rows;
mod table;

use std::path::PathBuf;

use busbar_plugin_sdk::{Error, Host, Plugin, RecordList, RecordSet, Records};
use encoding_rs::Encoding;
use record_source::{Source, Watched};

pub use record_source::ListSettings;

use crate::table::Table;

/// Settings.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// The lists, each from a file of its own.
    #[schemars(length(min = 1, max = 16))]
    lists: Vec<ListSettings<CsvFile>>,
}

/// A CSV file, whose first line names its columns.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CsvFile {
    /// Its absolute path.
    #[schemars(extend("examples" = ["/var/lib/site/work_orders.csv"]))]
    file: PathBuf,
    /// What is between cells.
    #[serde(default)]
    delimiter: Delimiter,
    /// Its encoding by a name of the web (WHATWG), such as `gb18030` or `windows-1252`; UTF-8
    /// where missing. A byte order mark goes before it.
    #[serde(default)]
    #[schemars(length(min = 1, max = 40), extend("examples" = ["gb18030"]))]
    encoding: Option<String>,
}

// Without documentation of their own, variants are one `enum` in the schema.
#[derive(Clone, Copy, Debug, Default, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
enum Delimiter {
    #[default]
    Comma,
    Semicolon,
    Tab,
}

impl Delimiter {
    /// None of these is part of a longer character in any encoding that is read.
    fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
        }
    }
}

impl CsvFile {
    fn encoding(&self) -> Option<&'static Encoding> {
        match &self.encoding {
            None => Some(encoding_rs::UTF_8),
            Some(name) => Encoding::for_label(name.as_bytes()),
        }
    }
}

/// The plugin.
pub struct CsvRecords {
    watched: Watched,
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
            let file = &list.source;
            let encoding = file.encoding().ok_or_else(|| {
                let name = record_source::shown(file.encoding.as_deref().unwrap_or_default());
                let text = "is no encoding that is known here; write utf-8, gb18030, windows-1252";
                Error::settings(format!("lists[{index}].source.encoding: '{name}' {text}"))
            })?;
            let name = file.file.file_name().unwrap_or(file.file.as_os_str()).to_string_lossy();
            lists.push((
                list.list(&record_source::shown(&name)),
                Box::new(Table { list, encoding }),
            ));
        }
        Ok(Self { watched: Watched::start(&host, lists)? })
    }
}

impl Records for CsvRecords {
    fn records(&mut self) -> Result<RecordSet<'_>, Error> {
        Ok(self.watched.records())
    }
}

busbar_plugin_sdk::export_plugin!(CsvRecords: records);

#[cfg(test)]
mod tests;
