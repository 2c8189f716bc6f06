//! Cell of a database's result: one column of one row, independent of the database.

use std::borrow::Cow;
use std::time::SystemTime;

/// One value of a result.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Cell<'a> {
    Null,
    Bool(bool),
    Int(i64),
    /// A number that is no integer, or none of 64 bits.
    Float(f64),
    Text(Cow<'a, str>),
    /// Bytes of a text that are no UTF-8.
    NotUtf8(&'a [u8]),
    Time(SystemTime),
    /// A time without a zone, nanoseconds from 1970-01-01T00:00:00 of its clock.
    LocalTime(i64),
    /// Value that no tag can take, in words, with a remedy.
    Unusable(Cow<'static, str>),
}

/// One row of a result.
pub(crate) trait Row {
    /// The value in a column, counted from 0.
    fn cell(&self, column: usize) -> Cell<'_>;
}

impl Cell<'_> {
    /// Description of the value for messages, with what was seen of it.
    pub(crate) fn name(&self) -> Cow<'static, str> {
        match self {
            Self::Null => "NULL".into(),
            Self::Bool(value) => format!("the boolean {value}").into(),
            Self::Int(value) => format!("the integer {value}").into(),
            Self::Float(value) => format!("the number {value}").into(),
            Self::Text(text) => format!("the text '{}'", text_table::shorten(text)).into(),
            Self::NotUtf8(_) => "a text that is not UTF-8".into(),
            Self::Time(_) => "a time".into(),
            Self::LocalTime(_) => "a timestamp without time zone".into(),
            Self::Unusable(what) => what.clone(),
        }
    }
}
