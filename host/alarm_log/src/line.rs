//! A record as a line, and back.

use busbar_alarms::Record;
use twox_hash::XxHash3_64;

use crate::MAX_LINE_BYTES;

const HASH_DIGITS: usize = 16;
/// What stands between hash and JSON.
const NEWS: u8 = b' ';
const CARRIED: u8 = b'*';
/// A number that no log reaches: what has it is damaged, and none can follow.
const MAX_NUMBER: u64 = u64::MAX / 2;

/// What a line tells.
#[derive(Debug, PartialEq)]
pub(crate) enum Line {
    /// Something that happened.
    News(Record),
    /// How an alarm stood where a file began; an older file has the same record.
    Carried(Record),
}

/// The line of something that happened, its end included.
pub(crate) fn write(record: &Record) -> std::io::Result<String> {
    write_as(NEWS, record)
}

/// The line of a record of an older file.
pub(crate) fn write_carried(record: &Record) -> std::io::Result<String> {
    write_as(CARRIED, record)
}

fn write_as(mark: u8, record: &Record) -> std::io::Result<String> {
    let json = serde_json::to_string(record)?;
    let hash = XxHash3_64::oneshot(json.as_bytes());
    Ok(format!("{hash:016x}{}{json}\n", char::from(mark)))
}

/// What a line tells, without its end; none where it is damaged.
pub(crate) fn read(line: &[u8]) -> Option<Line> {
    let mark = *line.get(HASH_DIGITS).filter(|_| line.len() <= MAX_LINE_BYTES)?;
    let (hash, json) = (&line[..HASH_DIGITS], &line[HASH_DIGITS + 1..]);
    let hash = u64::from_str_radix(std::str::from_utf8(hash).ok()?, 16).ok()?;
    if XxHash3_64::oneshot(json) != hash {
        return None;
    }
    let record: Record = serde_json::from_slice(json).ok()?;
    if record.number > MAX_NUMBER {
        return None;
    }
    match mark {
        NEWS => Some(Line::News(record)),
        CARRIED => Some(Line::Carried(record)),
        _ => None,
    }
}
