//! Records of equipment from queries of SQLite files: work orders, inspections, an asset
//! register.
//!
//! A query is asked again when the file changed, or the journal that is written ahead of it.
//! A row that is wrong is told with its number and the reason, and the rest goes on.

mod query;

use std::path::PathBuf;

use busbar_plugin_sdk::{Error, Host, Plugin, RecordList, RecordSet, Records};
use record_source::{CellFormats, ListSettings, PolledRecords, Source};

use crate::query::Query;

/// Settings of the plugin.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Lists, each from a query.
    #[schemars(length(min = 1, max = 16))]
    lists: Vec<ListSettings<SqliteQuery>>,
}

/// Query of an SQLite file.
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SqliteQuery {
    /// Absolute path of the file.
    #[schemars(extend("examples" = ["/var/lib/site/assets.db"]))]
    file: PathBuf,
    /// Single SELECT statement, whose results are the source's columns.
    #[schemars(length(min = 1, max = 10_000), extend("examples" = ["SELECT * FROM assets"]))]
    query: String,
}

/// Records plugin for SQLite files.
pub struct SqliteRecords {
    polled: PolledRecords,
}

impl Plugin for SqliteRecords {
    const ID: &'static str = "sqlite_records";
    const NAME: &'static str = "SQLite records";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Work orders and asset registers from SQLite files.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        record_source::check(&settings.lists, |source| &source.file)?;
        let polled = |(index, list): (usize, ListSettings<SqliteQuery>)| {
            let formats = CellFormats::with_decimal_point(&list)
                .map_err(|fault| Error::settings(format!("lists[{index}].{fault}")))?;
            let file = &list.source.file;
            let name = file.file_name().unwrap_or(file.as_os_str()).to_string_lossy();
            let shown = list.list(&record_source::shown(&name));
            Ok((shown, Box::new(Query { list, formats }) as Box<dyn Source>))
        };
        let lists = settings.lists.into_iter().enumerate().map(polled);
        let lists: Vec<(RecordList, Box<dyn Source>)> = lists.collect::<Result<_, Error>>()?;
        Ok(Self { polled: PolledRecords::start(&host, lists)? })
    }
}

impl Records for SqliteRecords {
    fn records(&mut self) -> Result<RecordSet<'_>, Error> {
        Ok(self.polled.records())
    }
}

busbar_plugin_sdk::export_plugin!(SqliteRecords: records);

#[cfg(test)]
mod tests;
