//! Bytes of a point list -> text: byte order mark, UTF-8, or the encoding of the system that
//! a spreadsheet ran on.

use std::borrow::Cow;
use std::str::FromStr;

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

/// Names of encodings by Windows code pages that the WHATWG Encoding standard lacks.
const CODE_PAGES: [(&str, &str); 4] =
    [("cp932", "shift_jis"), ("cp936", "gbk"), ("cp949", "euc-kr"), ("cp950", "big5")];

/// Character encoding of a list, by its name in the WHATWG Encoding standard or its Windows code
/// page.
///
/// ```
/// use busbar_point_import::ListEncoding;
///
/// let encoding: ListEncoding = "cp1251".parse()?;
/// assert_eq!(encoding.name(), "windows-1251");
/// assert!("utf-9".parse::<ListEncoding>().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ListEncoding(&'static Encoding);

impl ListEncoding {
    /// Returns the name in the WHATWG Encoding standard.
    pub fn name(self) -> &'static str {
        self.0.name()
    }
}

impl FromStr for ListEncoding {
    type Err = String;

    /// # Errors
    /// The unknown name, beside examples of known ones.
    fn from_str(name: &str) -> Result<Self, String> {
        let plain = name.trim().to_ascii_lowercase();
        let code_page = CODE_PAGES.iter().find(|(code_page, _)| *code_page == plain);
        let label = code_page.map_or(plain.as_str(), |(_, label)| label);
        match Encoding::for_label(label.as_bytes()) {
            // The standard's decoder of encodings that nothing may be in.
            Some(encoding) if encoding.name() != "replacement" => Ok(Self(encoding)),
            _ => Err(format!(
                "no encoding has the name '{name}': write utf-8, utf-16le, windows-1252, \
                 windows-1251 or gb18030"
            )),
        }
    }
}

/// A list as text.
#[derive(Debug)]
pub(crate) struct ListText<'b> {
    pub(crate) text: Cow<'b, str>,
    /// The encoding that was guessed, as users should know.
    pub(crate) remark: Option<String>,
}

/// Decodes the text of a list, by the encoding that a person named, its byte order mark or a
/// guess.
///
/// # Errors
/// The first line that cannot be read: by the encoding named, or where neither a mark nor the
/// characters tell one. A mark of another encoding than the one named.
pub(crate) fn decode(bytes: &[u8], named: Option<ListEncoding>) -> Result<ListText<'_>, ListFault> {
    if let Some(encoding) = named {
        return decode_named(bytes, encoding);
    }
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

fn decode_named(bytes: &[u8], named: ListEncoding) -> Result<ListText<'_>, ListFault> {
    let remedy = "name another --encoding, or none, or save the list as CSV in UTF-8";
    let ListEncoding(encoding) = named;
    let mark_bytes = match Encoding::for_bom(bytes) {
        Some((marked, _)) if marked != encoding => {
            let (own, named) = (marked.name(), named.name());
            let cause = format!("its first bytes say that it is {own} text, not {named}");
            return Err(ListFault::new(1, "", cause, remedy));
        }
        marked => marked.map_or(0, |(_, length)| length),
    };
    let bytes = bytes.get(mark_bytes..).unwrap_or_default();
    let (text, is_malformed) = encoding.decode_without_bom_handling(bytes);
    if !is_malformed {
        return Ok(ListText { text, remark: None });
    }
    let before = text.split(char::REPLACEMENT_CHARACTER).next().unwrap_or_default();
    let cause = format!("it is not {} text", named.name());
    Err(ListFault::new(line_after(before.as_bytes()), "", cause, remedy))
}

fn fault_at(before: &[u8], cause: String) -> ListFault {
    ListFault::new(line_after(before), "", cause, "save the list as CSV in UTF-8")
}

/// Returns the number of the line that follows a text.
fn line_after(text: &[u8]) -> u64 {
    text.iter().filter(|byte| **byte == b'\n').count() as u64 + 1
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
