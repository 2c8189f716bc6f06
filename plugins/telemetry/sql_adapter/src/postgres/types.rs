//! PostgreSQL's values in their binary form -> cells.

use std::borrow::Cow;
use std::error::Error;
use std::fmt::Write;
use std::time::{Duration, UNIX_EPOCH};

use tokio_postgres::types::{FromSql, Kind, Type};

use crate::cell::{Cell, Row};

/// Unix time of PostgreSQL's epoch, the beginning of 2000, seconds.
const POSTGRES_EPOCH: i64 = 946_684_800;
const MICROS: i64 = 1_000_000;
const NANOS_PER_MICRO: i64 = 1000;
/// A digit of a numeric counts to this, and has so many decimal digits.
const NUMERIC_BASE: u16 = 10_000;
const NUMERIC_DIGITS: i32 = 4;
/// Signs of a numeric (numeric.c of PostgreSQL).
const NUMERIC_POSITIVE: u16 = 0x0000;
const NUMERIC_NEGATIVE: u16 = 0x4000;
const NUMERIC_NAN: u16 = 0xC000;
const NUMERIC_INFINITY: u16 = 0xD000;
const NUMERIC_NEGATIVE_INFINITY: u16 = 0xF000;
/// The digits of a numeric are those of f64 at most: more do not change its value much.
const MAX_NUMERIC_DIGITS: usize = 200;

impl Row for tokio_postgres::Row {
    fn cell(&self, column: usize) -> Cell<'_> {
        let malformed = |_| Cell::Unusable("a value that the server sent malformed".into());
        self.try_get(column).unwrap_or_else(malformed)
    }
}

impl<'a> FromSql<'a> for Cell<'a> {
    fn from_sql(of: &Type, bytes: &'a [u8]) -> Result<Self, Box<dyn Error + Sync + Send>> {
        if let Kind::Domain(inner) = of.kind() {
            return Self::from_sql(inner, bytes);
        }
        Ok(match *of {
            Type::BOOL => Self::Bool(bool::from_sql(of, bytes)?),
            Type::INT2 => Self::Int(i16::from_sql(of, bytes)?.into()),
            Type::INT4 => Self::Int(i32::from_sql(of, bytes)?.into()),
            Type::INT8 => Self::Int(i64::from_sql(of, bytes)?),
            Type::OID => Self::Int(u32::from_sql(of, bytes)?.into()),
            Type::FLOAT4 => Self::Float(f32::from_sql(of, bytes)?.into()),
            Type::FLOAT8 => Self::Float(f64::from_sql(of, bytes)?),
            Type::NUMERIC => numeric(bytes).ok_or("a malformed numeric")?,
            Type::TEXT | Type::VARCHAR | Type::BPCHAR | Type::NAME | Type::UNKNOWN => text(bytes),
            Type::TIMESTAMPTZ => time(i64::from_sql(of, bytes)?),
            Type::TIMESTAMP => local_time(i64::from_sql(of, bytes)?),
            _ if matches!(of.kind(), Kind::Enum(_)) => text(bytes),
            _ => Self::Unusable(
                format!("a value of type {of}, which no tag takes: cast it in the query").into(),
            ),
        })
    }

    fn from_sql_null(_: &Type) -> Result<Self, Box<dyn Error + Sync + Send>> {
        Ok(Self::Null)
    }

    fn accepts(_: &Type) -> bool {
        true
    }
}

/// Text of the server; one whose database has no encoding may hold any bytes.
fn text(bytes: &[u8]) -> Cell<'_> {
    str::from_utf8(bytes).map_or(Cell::NotUtf8(bytes), |text| Cell::Text(Cow::from(text)))
}

/// A timestamptz: microseconds since 2000; the ends of the range are infinity.
fn time(micros: i64) -> Cell<'static> {
    let unix = micros.checked_add(POSTGRES_EPOCH * MICROS);
    let since = unix.and_then(|micros| u64::try_from(micros).ok()).map(Duration::from_micros);
    let time = since.and_then(|since| UNIX_EPOCH.checked_add(since));
    match time {
        Some(time) if micros < i64::MAX => Cell::Time(time),
        _ => Cell::Unusable("a time that is infinite or before 1970".into()),
    }
}

/// A timestamp: microseconds since 2000 of a clock whose zone the server does not know.
fn local_time(micros: i64) -> Cell<'static> {
    let unix = micros.checked_add(POSTGRES_EPOCH * MICROS);
    match unix.and_then(|micros| micros.checked_mul(NANOS_PER_MICRO)) {
        Some(nanos) if micros < i64::MAX => Cell::LocalTime(nanos),
        _ => Cell::Unusable("a time that is infinite or out of reach".into()),
    }
}

/// A numeric: an exact integer where it is one of 64 bits, or else the nearest f64.
fn numeric(bytes: &[u8]) -> Option<Cell<'static>> {
    let word = |index: usize| {
        let bytes = bytes.get(2 * index..2 * index + 2)?;
        Some(u16::from_be_bytes([bytes[0], bytes[1]]))
    };
    let (count, weight, sign) = (usize::from(word(0)?), word(1)? as i16, word(2)?);
    match sign {
        NUMERIC_NAN => return Some(Cell::Float(f64::NAN)),
        NUMERIC_INFINITY => return Some(Cell::Float(f64::INFINITY)),
        NUMERIC_NEGATIVE_INFINITY => return Some(Cell::Float(f64::NEG_INFINITY)),
        NUMERIC_POSITIVE | NUMERIC_NEGATIVE => {}
        _ => return None,
    }
    let digits: Vec<u16> = (0..count).map(|index| word(4 + index)).collect::<Option<_>>()?;
    if digits.iter().any(|&digit| digit >= NUMERIC_BASE) {
        return None;
    }
    let kept = &digits[..digits.len().min(MAX_NUMERIC_DIGITS)];
    let mut text = String::from(if sign == NUMERIC_NEGATIVE { "-0" } else { "0" });
    for digit in kept {
        write!(text, "{digit:04}").ok()?;
    }
    // Of the last digit that is written.
    let exponent = (i32::from(weight) + 1 - kept.len() as i32) * NUMERIC_DIGITS;
    if kept.len() == digits.len()
        && let Some(integer) = exact_integer(&text, exponent)
    {
        return Some(Cell::Int(integer));
    }
    let value: f64 = format!("{text}e{exponent}").parse().ok()?;
    Some(if value.is_finite() {
        Cell::Float(value)
    } else {
        Cell::Unusable("a numeric beyond the range of a number of 64 bits".into())
    })
}

fn exact_integer(digits: &str, exponent: i32) -> Option<i64> {
    let cut = digits.len().checked_sub(usize::try_from(-exponent.min(0)).ok()?)?;
    let (whole, fraction) = digits.split_at_checked(cut)?;
    if fraction.bytes().any(|digit| digit != b'0') || whole.is_empty() || whole == "-" {
        return None;
    }
    let scale = 10_i64.checked_pow(u32::try_from(exponent.max(0)).ok()?)?;
    whole.parse::<i64>().ok()?.checked_mul(scale)
}

#[cfg(test)]
#[path = "types_tests.rs"]
mod tests;
