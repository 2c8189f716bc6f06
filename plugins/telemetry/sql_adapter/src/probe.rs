//! Bytes of a database without one: for fuzzing.

use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Error, Sample, SampleSink, TagSpec};
use tokio_postgres::types::{FromSql, Type};

use crate::answer::Answer;
use crate::cell::{Cell, Row};
use crate::point_states::PointStates;
use crate::points;
use crate::postgres::check_stream;
use crate::settings::Settings;

/// A value as a database gives it.
#[derive(Clone, Copy, Debug)]
pub enum CellInput<'a> {
    /// SQL value NULL of any column.
    Null,
    /// Integer of SQLite (INTEGER).
    Integer(i64),
    /// Floating-point number of SQLite (REAL).
    Real(f64),
    /// Text of SQLite (TEXT).
    Text(&'a str),
    /// PostgreSQL's type, by its OID, and the value in binary form.
    Postgres(u32, &'a [u8]),
}

/// Publishes what a payload of a notification for the first query says.
///
/// # Errors
/// What the plugin would say of settings and addresses.
pub fn notify(
    settings: Settings,
    tags: &[TagSpec],
    payload: &str,
    sink: SampleSink,
) -> Result<(), Error> {
    let config = settings.parse()?;
    let names = config.queries.iter().map(|query| query.name.clone());
    let named = names.zip(points::parse(tags, &config)?);
    let mut point_states =
        PointStates::new(config.label(), named, config.times.clone(), sink, host());
    point_states.note_notification(0, payload);
    point_states.flush();
    Ok(())
}

/// The samples of an answer to the first query: names of columns, then rows.
///
/// # Errors
/// What the plugin would say of settings, addresses or the answer.
pub fn answer(
    settings: Settings,
    tags: &[TagSpec],
    columns: &[&str],
    rows: &[Vec<CellInput<'_>>],
) -> Result<Vec<Sample>, Error> {
    let config = settings.parse()?;
    let points = points::parse(tags, &config)?;
    let points = points.first().ok_or_else(|| Error::settings("there is no query"))?;
    let failed = |fault: crate::answer::QueryFault| Error::failed(fault.to_string());
    let mut answer = Answer::begin(points, columns, &config.times).map_err(failed)?;
    for row in rows {
        answer.take(&InputRow(row)).map_err(failed)?;
    }
    let samples = answer.finish().map_err(failed)?;
    Ok(samples.into_iter().map(|(sample, _)| sample).collect())
}

/// Reports whether the client may see a stream of a server that arrives in these pieces.
///
/// # Errors
/// What is in it that must not be, in words.
pub fn watch<'a>(
    pieces: impl IntoIterator<Item = &'a [u8]>,
    is_encrypted: bool,
) -> Result<(), String> {
    check_stream(pieces, is_encrypted).map_err(|excess| excess.to_string())
}

struct InputRow<'a>(&'a [CellInput<'a>]);

impl Row for InputRow<'_> {
    fn cell(&self, column: usize) -> Cell<'_> {
        match self.0.get(column) {
            None | Some(CellInput::Null) => Cell::Null,
            Some(CellInput::Integer(value)) => Cell::Int(*value),
            Some(CellInput::Real(value)) => Cell::Float(*value),
            Some(CellInput::Text(text)) => Cell::Text((*text).into()),
            Some(CellInput::Postgres(oid, bytes)) => {
                let of = Type::from_oid(*oid).unwrap_or(Type::UNKNOWN);
                let malformed = |_| Cell::Unusable("a malformed value".into());
                Cell::from_sql(&of, bytes).unwrap_or_else(malformed)
            }
        }
    }
}
