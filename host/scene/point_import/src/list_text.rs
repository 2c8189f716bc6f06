//! Bytes of a point list -> text: byte order mark, UTF-8, or the encoding of the system that
//! a spreadsheet ran on.

use std::borrow::Cow;

use chardetng::{EncodingDetector, Iso2022JpDetection, Utf8Detection};
use encoding_rs::{Encoding, UTF_16BE, UTF_16LE, WINDOWS_1252};

use crate::fault::ListFault;

/// Characters at the start of a list that tell whether it is UTF-16 without a mark.
const MAX_SAMPLE_CHARS: usize = 64;
/// Encodings that spreadsheets write, beside those whose names begin with `windows-`.
const SPREADSHEET_ENCODINGS: [&str; 5] = ["GBK", "gb18030", "Shift_JIS", "Big5", "EUC-KR"];
/// Signs that are the same in all Western encodings, and most in others.
const SIGNS: &str = "°²³µ±·×–—§\u{a0}";
/// Further signs of technical texts, in any encoding.
const MORE_SIGNS: &str = "‘’“”„‚«»…•€½¼¾™®©¹ºª‰£№¤¬¦÷†ΩωµμφΦ℃∆Δ、。，；：（）【】《》“”・￥·";
/// Letters that texts of Western Europe do not have, but other bytes become.
const RARE_LETTERS: &str = "ÿþðÞÐÝ¿¡";

/// A list as text.
#[derive(Debug)]
pub(crate) struct ListText<'b> {
    pub(crate) text: Cow<'b, str>,
    /// The encoding that was guessed, as users should know.
    pub(crate) remark: Option<String>,
}

/// Decodes the text of a list, by its byte order mark or by a guess.
///
/// # Errors
/// The first line that cannot be read, where neither a mark nor the characters tell the
/// encoding.
pub(crate) fn decode(bytes: &[u8]) -> Result<ListText<'_>, ListFault> {
    let marked = Encoding::for_bom(bytes).or_else(|| Some((utf16_without_mark(bytes)?, 0)));
    if let Some((encoding, mark_bytes)) = marked {
        let bytes = bytes.get(mark_bytes..).unwrap_or_default();
        let (text, is_malformed) = encoding.decode_without_bom_handling(bytes);
        if is_malformed {
            let before = text.split(char::REPLACEMENT_CHARACTER).next().unwrap_or_default();
            let cause = format!("it is not {} text, as its first bytes say", encoding.name());
            return Err(fault_at(before.as_bytes(), cause));
        }
        return Ok(ListText { text, remark: None });
    }
    match std::str::from_utf8(bytes) {
        Ok(text) => Ok(ListText { text: text.into(), remark: None }),
        Err(error) => guess(bytes).ok_or_else(|| {
            let before = bytes.get(..error.valid_up_to()).unwrap_or_default();
            let cause = "it is not UTF-8 text, and its characters do not tell its encoding";
            fault_at(before, cause.into())
        }),
    }
}

fn fault_at(before: &[u8], cause: String) -> ListFault {
    let line = before.iter().filter(|byte| **byte == b'\n').count() as u64 + 1;
    ListFault::new(line, "", cause, "save the list as CSV in UTF-8")
}

/// Recognizes UTF-16 by the zeros in its ASCII characters.
fn utf16_without_mark(bytes: &[u8]) -> Option<&'static Encoding> {
    let sample: Vec<&[u8]> = bytes.chunks_exact(2).take(MAX_SAMPLE_CHARS).collect();
    let count = |index: usize| {
        sample.iter().filter(|pair| pair[index] == 0 && pair[1 - index] != 0).count()
    };
    let is_most = |count: usize| count > 1 && 2 * count > sample.len();
    match (is_most(count(1)), is_most(count(0))) {
        (true, false) => Some(UTF_16LE),
        (false, true) => Some(UTF_16BE),
        _ => None,
    }
}

/// Guesses the encoding by its characters; nothing where they are none of a text.
fn guess(bytes: &[u8]) -> Option<ListText<'_>> {
    let western = decode_as(bytes, WINDOWS_1252);
    let has_signs_alone =
        western.as_ref().is_some_and(|text| non_ascii(text).all(|c| SIGNS.contains(c)));
    let encoding = if has_signs_alone {
        WINDOWS_1252
    } else {
        let mut detector = EncodingDetector::new(Iso2022JpDetection::Deny);
        detector.feed(bytes, true);
        detector.guess(None, Utf8Detection::Deny)
    };
    let is_of_spreadsheets =
        encoding.name().starts_with("windows-") || SPREADSHEET_ENCODINGS.contains(&encoding.name());
    let text =
        decode_as(bytes, encoding).filter(|text| is_of_spreadsheets && is_plausible(text))?;
    let remark = format!(
        "it is read as {}, by its characters; if names look wrong, save it as CSV in UTF-8",
        encoding.name()
    );
    Some(ListText { text, remark: Some(remark) })
}

fn decode_as<'b>(bytes: &'b [u8], encoding: &'static Encoding) -> Option<Cow<'b, str>> {
    encoding.decode_without_bom_handling_and_without_replacement(bytes)
}

fn non_ascii(text: &str) -> impl Iterator<Item = char> {
    text.chars().filter(|c| !c.is_ascii())
}

/// Reports whether characters are plausible text: letters of one script, and signs.
fn is_plausible(text: &str) -> bool {
    let mut script = None;
    non_ascii(text).all(|c| {
        if SIGNS.contains(c) || MORE_SIGNS.contains(c) {
            return true;
        }
        if !c.is_alphabetic() || RARE_LETTERS.contains(c) {
            return false;
        }
        let own = script_of(c);
        *script.get_or_insert(own) == own
    })
}

/// The block of 256 characters of a letter; those of East Asia and of Latin count as one.
fn script_of(c: char) -> u32 {
    match u32::from(c) {
        0x80..0x250 => 0,
        0x3000..0xA000 | 0xAC00..0xD7B0 | 0xF900..0xFB00 | 0xFF00..0xFFF0 | 0x20000.. => 0x30,
        code => code >> 8,
    }
}

#[cfg(test)]
#[path = "list_text_tests.rs"]
mod tests;
