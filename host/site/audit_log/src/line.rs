//! A line of the log: a record or the header of a file as text, and back.
//!
//! `XXH3 MARK JSON`: 16 hexadecimal digits, one character, an object. Lines of version 2
//! begin with their version and end with their chain value; those before have neither. All
//! versions to come keep checksum, mark and an object with `version` and `number`, so that
//! a reader tells lines of a newer release from damaged ones.

use busbar_alarms::AlarmRecord;
use serde::{Deserialize, Serialize};
use twox_hash::XxHash3_64;

use crate::anchor::Anchor;
use crate::chain::{ChainKey, Digest256};
use crate::file_header::FileHeader;
use crate::{MAX_HEADER_BYTES, MAX_LINE_BYTES};

/// Version of the lines that this release writes.
pub const VERSION: u32 = 2;

const HASH_DIGITS: usize = 16;
/// Mark of an event, between hash and JSON.
pub(crate) const NEWS: u8 = b' ';
pub(crate) const CARRIED: u8 = b'*';
pub(crate) const HEADER: u8 = b'#';
/// Mark of the one line of an anchor's file.
pub(crate) const ANCHOR: u8 = b'@';
/// Text before the chain value, which is the end of the object.
const CHAIN_KEY: &str = ",\"chain\":\"";
const CHAIN_END: &str = "\"}";
const CHAIN_DIGITS: usize = 64;
/// A number that no log reaches: what has it is damaged, and none can follow.
pub(crate) const MAX_NUMBER: u64 = u64::MAX / 2;

/// Content of a line.
#[derive(Debug, PartialEq)]
pub(crate) enum Line {
    /// First line of a file of version 2.
    Header(Box<FileHeader>),
    /// End of a log, in a file of its own.
    Anchor(Anchor),
    /// Event of an alarm.
    News(AlarmRecord),
    /// State of an alarm where a file began; an older file has the same record.
    Carried(AlarmRecord),
    /// A line whose checksum is right and whose content a newer release understands.
    Newer {
        /// Number of its record, as far as it is readable.
        number: Option<u64>,
    },
}

/// A line that was read.
#[derive(Debug, PartialEq)]
pub(crate) struct ReadLine<'a> {
    pub(crate) content: Line,
    pub(crate) link: Option<Link<'a>>,
}

/// Chain value of a line, with its inputs.
#[derive(Debug, PartialEq)]
pub(crate) struct Link<'a> {
    mark: u8,
    text: &'a [u8],
    pub(crate) value: Digest256,
}

impl Link<'_> {
    /// Checks the value against that of the line before.
    pub(crate) fn follows(&self, before: &Digest256, key: &ChainKey) -> bool {
        key.link(before, self.mark, self.text) == self.value
    }
}

/// Parts that lines of all versions have.
#[derive(Deserialize)]
struct Outline {
    #[serde(default)]
    version: Option<u64>,
    #[serde(default)]
    number: Option<serde_json::Value>,
}

/// Appends the line of a record or header, its end included; the chain value after it.
pub(crate) fn write(
    out: &mut Vec<u8>,
    mark: u8,
    content: &impl Serialize,
    before: &Digest256,
    key: &ChainKey,
) -> std::io::Result<Digest256> {
    let json = serde_json::to_string(content)?;
    // Of an object: its fields, without its braces.
    let fields = json.get(1..json.len().saturating_sub(1)).unwrap_or_default();
    let text = format!("{{\"version\":{VERSION},{fields}");
    let value = key.link(before, mark, text.as_bytes());
    let json = format!("{text}{CHAIN_KEY}{value}{CHAIN_END}");
    out.extend_from_slice(&signed(mark, json.as_bytes()));
    Ok(value)
}

/// A line with this text behind a checksum that is right.
pub(crate) fn signed(mark: u8, json: &[u8]) -> Vec<u8> {
    let hash = format!("{:016x}", XxHash3_64::oneshot(json));
    [hash.as_bytes(), &[mark], json, b"\n"].concat()
}

/// Reads a line without its end; none where it is damaged.
pub(crate) fn read(line: &[u8]) -> Option<ReadLine<'_>> {
    let mark = *line.get(HASH_DIGITS)?;
    let longest = if mark == HEADER { MAX_HEADER_BYTES } else { MAX_LINE_BYTES };
    if line.len() > longest {
        return None;
    }
    let (hash, json) = (&line[..HASH_DIGITS], &line[HASH_DIGITS + 1..]);
    // Each line has one text: digits are small ones.
    if format!("{:016x}", XxHash3_64::oneshot(json)).as_bytes() != hash {
        return None;
    }
    let Ok(outline) = serde_json::from_slice::<Outline>(json) else {
        return Some(ReadLine { content: Line::Newer { number: None }, link: None });
    };
    let number = outline.number.and_then(|number| number.as_u64());
    if number.is_some_and(|number| number > MAX_NUMBER) {
        return None;
    }
    let version = outline.version.unwrap_or(1);
    let link = (version == u64::from(VERSION)).then(|| link_of(mark, json)).flatten();
    let known = match (version, mark) {
        (1, NEWS) => serde_json::from_slice(json).ok().map(Line::News),
        (1, CARRIED) => serde_json::from_slice(json).ok().map(Line::Carried),
        // Each line of this version has its chain value.
        (2, _) if link.is_none() => None,
        (2, NEWS) => serde_json::from_slice(json).ok().map(Line::News),
        (2, CARRIED) => serde_json::from_slice(json).ok().map(Line::Carried),
        (2, HEADER) => serde_json::from_slice(json).ok().map(Line::Header),
        (2, ANCHOR) => serde_json::from_slice(json).ok().map(Line::Anchor),
        _ => None,
    };
    let content = known.unwrap_or(Line::Newer { number });
    if matches!(&content, Line::Header(header) if header.after > MAX_NUMBER) {
        return None;
    }
    Some(ReadLine { content, link })
}

fn link_of(mark: u8, json: &[u8]) -> Option<Link<'_>> {
    let end = json.len().checked_sub(CHAIN_KEY.len() + CHAIN_DIGITS + CHAIN_END.len())?;
    let (text, rest) = json.split_at(end);
    let rest = rest.strip_prefix(CHAIN_KEY.as_bytes())?.strip_suffix(CHAIN_END.as_bytes())?;
    let value = std::str::from_utf8(rest).ok()?.parse().ok()?;
    Some(Link { mark, text, value })
}
