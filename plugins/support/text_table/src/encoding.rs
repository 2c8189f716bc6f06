//! Character encodings by their names in the WHATWG Encoding standard, and byte order marks.

use std::borrow::Cow;

use encoding_rs::{Encoding, UTF_8, UTF_16BE, UTF_16LE, WINDOWS_1252};

/// Bytes of the longest byte order mark.
pub const MAX_MARK_BYTES: usize = 3;

/// Character encoding of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextEncoding(&'static Encoding);

impl Default for TextEncoding {
    fn default() -> Self {
        Self(UTF_8)
    }
}

impl TextEncoding {
    /// Finds an encoding by a name such as `utf-8`, `gb18030`, `windows-1252` or `cp1251`.
    ///
    /// # Errors
    /// The unknown name and examples of known ones.
    pub fn from_name(name: &str) -> Result<Self, String> {
        let plain = name.trim().to_ascii_lowercase();
        // Windows, Python and databases have these names, which the web has not.
        let label = match plain.as_str() {
            "cp936" | "ms936" | "windows-936" => "gbk",
            "cp932" | "ms932" | "windows-932" => "shift_jis",
            "cp949" | "ms949" | "windows-949" => "euc-kr",
            "cp950" | "windows-950" => "big5",
            "utf_16" | "utf16" | "utf16le" | "utf16-le" | "utf-16-le" => "utf-16le",
            "utf16be" | "utf16-be" | "utf-16-be" => "utf-16be",
            "utf-8-sig" | "utf8-sig" => "utf-8",
            "latin-1" => "latin1",
            other => other,
        };
        match Encoding::for_label(label.as_bytes()) {
            Some(encoding) if encoding.name() != "replacement" => Ok(Self(encoding)),
            _ => Err(format!(
                "'{}' is no known encoding: write utf-8, utf-16le, windows-1252, windows-1251 or \
                 gb18030",
                crate::shorten(name)
            )),
        }
    }

    /// Name by the WHATWG standard, for messages.
    pub fn name(self) -> &'static str {
        self.0.name()
    }

    /// Reports the encoding by the byte order mark at the start of a text, and the mark's length.
    pub fn from_mark(start: &[u8]) -> Option<(Self, usize)> {
        Encoding::for_bom(start).map(|(encoding, length)| (Self(encoding), length))
    }

    /// Bytes of a carriage return.
    pub(crate) fn carriage_return(self) -> &'static [u8] {
        match self.0 {
            encoding if encoding == UTF_16LE => b"\r\0",
            encoding if encoding == UTF_16BE => b"\0\r",
            _ => b"\r",
        }
    }

    /// Bytes of a line feed, of which UTF-16 has two.
    pub(crate) fn line_feed(self) -> &'static [u8] {
        match self.0 {
            encoding if encoding == UTF_16LE => b"\n\0",
            encoding if encoding == UTF_16BE => b"\0\n",
            _ => b"\n",
        }
    }

    /// Decodes bytes without a mark; what is malformed becomes U+FFFD.
    pub fn decode(self, bytes: &[u8]) -> Cow<'_, str> {
        self.0.decode_without_bom_handling(bytes).0
    }

    /// Decodes a whole text: by its mark, else by the encoding given, else as UTF-8, and where it
    /// is not UTF-8 as windows-1252. Returns whether the last was a guess.
    pub fn decode_text(given: Option<Self>, bytes: &[u8]) -> (Cow<'_, str>, bool) {
        if let Some((encoding, mark)) = Self::from_mark(bytes) {
            return (encoding.decode(bytes.get(mark..).unwrap_or_default()), false);
        }
        match (given, std::str::from_utf8(bytes)) {
            (Some(encoding), _) => (encoding.decode(bytes), false),
            (None, Ok(text)) => (Cow::Borrowed(text), false),
            (None, Err(_)) => (Self(WINDOWS_1252).decode(bytes), true),
        }
    }
}

#[cfg(test)]
#[path = "encoding_tests.rs"]
mod tests;
