//! Building blocks of records plugins: settings of lists, conversion of rows, and polling of
//! sources for changes.
//!
//! A [`Source`] is read on a thread of its own ([`PolledRecords`]), so that one that does not
//! answer holds nobody up. Rows that are wrong are left out and told, and the rest goes on.

mod cell_formats;
mod column_layout;
mod polling;
mod row_batch;
mod settings;

pub use cell_formats::CellFormats;
pub use column_layout::ColumnLayout;
pub use polling::{PolledRecords, Source, SourceVersion, file_version};
pub use row_batch::{ReadDeadline, RowBatch};
pub use settings::{ColumnSettings, ListSettings, OpenSettings, SeveritySettings, check};

/// Bytes of a source's text in a message, at most.
const MAX_SHOWN: usize = 80;
/// Bytes of a message, at most.
const MAX_MESSAGE: usize = 400;

/// Shortens a text of a source for a message.
pub fn shown(text: &str) -> String {
    one_line(text, MAX_SHOWN)
}

/// Makes a text one line: cuts a long one, replaces control characters.
fn one_line(text: &str, max_bytes: usize) -> String {
    let end = text.floor_char_boundary(max_bytes);
    let more = if end < text.len() { "…" } else { "" };
    let visible = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    text[..end].chars().map(visible).chain(more.chars()).collect()
}
