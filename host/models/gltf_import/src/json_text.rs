//! Text of the JSON in UTF-8, and the slips of exporters that are no strict JSON: comments,
//! trailing commas, `NaN` and `Infinity` (RFC 8259 has none of them).

use std::borrow::Cow;

use crate::report::Notes;

const UTF8_BOM: &[u8] = b"\xEF\xBB\xBF";
const UTF16_LE_BOM: &[u8] = b"\xFF\xFE";
const UTF16_BE_BOM: &[u8] = b"\xFE\xFF";

/// Converts the bytes of the JSON to text: without byte order mark and zeros at the end.
pub(crate) fn decode<'a>(bytes: &'a [u8], notes: &mut Notes) -> Cow<'a, str> {
    let pair = |order: fn([u8; 2]) -> u16, bytes: &[u8]| {
        let units: Vec<u16> = bytes.as_chunks().0.iter().map(|&unit| order(unit)).collect();
        String::from_utf16_lossy(&units).into()
    };
    let text: Cow<'a, str> = if let Some(rest) = bytes.strip_prefix(UTF16_LE_BOM) {
        notes.add("JSON in UTF-16 read: glTF is UTF-8");
        pair(u16::from_le_bytes, rest)
    } else if let Some(rest) = bytes.strip_prefix(UTF16_BE_BOM) {
        notes.add("JSON in UTF-16 read: glTF is UTF-8");
        pair(u16::from_be_bytes, rest)
    } else {
        let text = String::from_utf8_lossy(bytes.strip_prefix(UTF8_BOM).unwrap_or(bytes));
        if matches!(text, Cow::Owned(_)) {
            notes.add("JSON with bytes that are not UTF-8: they are shown as '\u{FFFD}'");
        }
        text
    };
    let padding = |c: char| c == '\0' || c.is_ascii_whitespace();
    match text {
        Cow::Borrowed(text) => Cow::Borrowed(text.trim_end_matches(padding)),
        Cow::Owned(mut text) => {
            text.truncate(text.trim_end_matches(padding).len());
            Cow::Owned(text)
        }
    }
}

/// Blanks comments and trailing commas, and writes `null` for numbers that are none. Returns
/// `None` where there is no such thing.
pub(crate) fn relaxed(text: &str) -> Option<String> {
    let mut strict = Vec::with_capacity(text.len() + 64);
    let mut changed = false;
    // Place of the last comma, while nothing but blanks has followed it.
    let mut comma = None;
    let mut rest = text.as_bytes();
    while let Some(&first) = rest.first() {
        let mut length = 1;
        if let Some(comment) = comment_length(rest) {
            // Its line ends stay, so that lines keep their numbers.
            let blank = |byte: &u8| if *byte == b'\n' { b'\n' } else { b' ' };
            strict.extend(rest[..comment].iter().map(blank));
            changed = true;
            rest = &rest[comment..];
            continue;
        }
        match first {
            b',' => comma = Some(strict.len()),
            b']' | b'}' => {
                if let Some(comma) = comma.take() {
                    strict[comma] = b' ';
                    changed = true;
                }
            }
            b'"' => {
                comma = None;
                length = string_length(rest);
            }
            _ if first.is_ascii_whitespace() => {}
            _ => {
                comma = None;
                if let Some(name) = NOT_NUMBERS.iter().find(|name| rest.starts_with(name)) {
                    strict.extend(b"null");
                    changed = true;
                    rest = &rest[name.len()..];
                    continue;
                }
            }
        }
        strict.extend(&rest[..length]);
        rest = &rest[length..];
    }
    changed.then(|| String::from_utf8(strict).ok()).flatten()
}

/// Numbers of programming languages that JSON lacks.
const NOT_NUMBERS: [&[u8]; 8] =
    [b"-Infinity", b"Infinity", b"-NaN", b"NaN", b"-inf", b"inf", b"-nan", b"nan"];

/// Returns the length of a comment at the start of a text.
fn comment_length(text: &[u8]) -> Option<usize> {
    if text.starts_with(b"//") {
        return Some(text.iter().position(|&byte| byte == b'\n').unwrap_or(text.len()));
    }
    if !text.starts_with(b"/*") {
        return None;
    }
    let end = text[2..].windows(2).position(|pair| pair == b"*/");
    Some(end.map_or(text.len(), |end| end + 4))
}

/// Returns the length of a string at the start of a text, quotes included.
fn string_length(text: &[u8]) -> usize {
    let mut at = 1;
    while at < text.len() {
        match text[at] {
            b'\\' => at += 2,
            b'"' => return at + 1,
            _ => at += 1,
        }
    }
    text.len()
}
