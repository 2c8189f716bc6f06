//! Text tables (CSV, RFC 4180) as other programs export them: dialects, character encodings,
//! number formats, units in cells, and times with a pattern and a zone of the IANA data base.
//!
//! All plugins that read CSV read it by this crate. It knows no tags and no host.
//!
//! ```
//! use text_table::{NumberFormat, Separators};
//!
//! let german = NumberFormat::new(Separators { decimal: ',', thousands: Some('.') });
//! assert_eq!(german.parse_f64("1.234,5"), Ok(1234.5));
//! assert!(german.parse_f64("1.23").is_err());
//! ```

mod cells;
mod dialect;
mod encoding;
pub mod lines;
mod number;
mod rows;
mod state_words;
mod time_format;
mod words;
mod zone;

pub use cells::{Cells, MAX_COLUMNS};
pub use dialect::{Delimiter, Dialect};
pub use encoding::{MAX_MARK_BYTES, TextEncoding};
pub use number::{NumberFormat, Separators};
pub use rows::{NextRow, RowLimits, Rows};
pub use state_words::StateWords;
pub use time_format::{Instant, MAX_YEAR, TimeFormat, TimeReader};
pub use words::{NO_VALUE_WORDS, find_quality};
pub use zone::{Resolved, Zone};

/// Characters of a foreign text in a message.
const MAX_SHOWN_CHARS: usize = 40;

/// Shortens a foreign text for a message, and makes control characters visible.
pub fn shorten(text: &str) -> String {
    let visible = |c: char| if c.is_control() { '\u{fffd}' } else { c };
    let mut shown: String = text.chars().take(MAX_SHOWN_CHARS).map(visible).collect();
    if text.chars().nth(MAX_SHOWN_CHARS).is_some() {
        shown.push('…');
    }
    shown
}
