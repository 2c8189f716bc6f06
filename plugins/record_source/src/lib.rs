//! What plugins with records share: what settings say of a list, rows from cells, and
//! sources that are read again when they changed.
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

/// Bytes of a text of a source in a message.
const MAX_SHOWN: usize = 80;
/// Bytes of a message.
const MAX_MESSAGE: usize = 400;

/// A text of a source as it may stand in a message.
pub fn shown(text: &str) -> String {
    one_line(text, MAX_SHOWN)
}

/// One line: what is long is cut, what cannot be seen is made visible.
fn one_line(text: &str, max_bytes: usize) -> String {
    let end = text.floor_char_boundary(max_bytes);
    let more = if end < text.len() { "…" } else { "" };
    let visible = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    text[..end].chars().map(visible).chain(more.chars()).collect()
}
