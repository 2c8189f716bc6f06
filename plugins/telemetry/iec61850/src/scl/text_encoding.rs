//! Character encoding of an SCL file: byte order mark, XML declaration, decoding
//! (XML 1.0, 4.3.3 and appendix F).

use encoding_rs::{Encoding, GBK, REPLACEMENT, UTF_8, UTF_16BE, UTF_16LE};

/// Bytes in which the XML declaration ends, at most.
const MAX_DECLARATION_BYTES: usize = 1024;
/// Longest name of an encoding that is looked at.
const MAX_LABEL_CHARS: usize = 40;
/// Names of encodings that tools write and the WHATWG's table has not.
const ALIASES: [(&str, &Encoding); 5] = [
    ("cp936", GBK),
    ("ms936", GBK),
    ("windows-936", GBK),
    ("latin-1", encoding_rs::WINDOWS_1252),
    ("utf_8", UTF_8),
];
/// Stands for bytes that are no characters.
pub(super) const NO_CHARACTER: char = char::REPLACEMENT_CHARACTER;

/// A file as text.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct DecodedFile {
    pub(super) text: String,
    /// Remark for the user on the decoding.
    pub(super) remark: Option<String>,
}

/// Decodes a file by its mark, its first characters or its declaration, in this order.
///
/// # Errors
/// In words: it declares an encoding that is not known.
pub(super) fn decode(bytes: &[u8]) -> Result<DecodedFile, String> {
    let (encoding, mark_bytes) = match Encoding::for_bom(bytes) {
        Some(found) => found,
        None => (by_first_bytes(bytes).map_or_else(|| declared(bytes), Ok)?, 0),
    };
    let bytes = bytes.get(mark_bytes..).unwrap_or_default();
    let (text, is_malformed) = encoding.decode_without_bom_handling(bytes);
    let remark = is_malformed.then(|| malformed(&text, encoding));
    Ok(DecodedFile { text: text.into_owned(), remark })
}

/// Recognizes UTF-16 without a mark by its first character, `<`.
fn by_first_bytes(bytes: &[u8]) -> Option<&'static Encoding> {
    match bytes {
        [b'<', 0, second, 0, ..] if *second != 0 => Some(UTF_16LE),
        [0, b'<', 0, second, ..] if *second != 0 => Some(UTF_16BE),
        _ => None,
    }
}

/// The encoding that the XML declaration names; UTF-8 where it names none.
fn declared(bytes: &[u8]) -> Result<&'static Encoding, String> {
    let Some(label) = declared_label(bytes) else { return Ok(UTF_8) };
    let plain = label.trim().to_ascii_lowercase();
    let alias = ALIASES.iter().find(|(name, _)| *name == plain).map(|(_, encoding)| *encoding);
    match alias.or_else(|| Encoding::for_label(plain.as_bytes())) {
        // Its declaration was just read byte by byte, so it is none of these.
        Some(encoding) if encoding == UTF_16LE || encoding == UTF_16BE => Ok(UTF_8),
        Some(encoding) if encoding != REPLACEMENT => Ok(encoding),
        _ => Err(format!(
            "line 1: the file declares the encoding '{label}', which is not known: save it as \
             UTF-8, or declare what it is in, such as windows-1252, windows-1251 or GB18030"
        )),
    }
}

/// The value of `encoding` in `<?xml version="1.0" encoding="GB18030"?>`.
fn declared_label(bytes: &[u8]) -> Option<String> {
    let start: Vec<u8> =
        bytes.trim_ascii_start().iter().copied().take(MAX_DECLARATION_BYTES).collect();
    let start = String::from_utf8_lossy(&start);
    let (declaration, _) = start.strip_prefix("<?xml")?.split_once("?>")?;
    let (_, rest) = declaration.split_once("encoding")?;
    let rest = rest.trim_start().strip_prefix('=')?.trim_start();
    let quote = rest.chars().next().filter(|c| "\"'".contains(*c))?;
    let (label, _) = rest.get(1..)?.split_once(quote)?;
    Some(label.chars().take(MAX_LABEL_CHARS).collect())
}

fn malformed(text: &str, encoding: &'static Encoding) -> String {
    let before = text.split(NO_CHARACTER).next().unwrap_or_default();
    let line = before.matches('\n').count() + 1;
    let name = encoding.name();
    format!(
        "line {line}: it has bytes that are no {name}, as which it is read; they are shown as \
         '{NO_CHARACTER}': declare what it is in by its first line, such as <?xml \
         version=\"1.0\" encoding=\"windows-1252\"?>, or save it as UTF-8"
    )
}

#[cfg(test)]
#[path = "text_encoding_tests.rs"]
mod tests;
