//! Text values of tags: mode names, meter numbers, last messages.

use alloc::sync::Arc;
use core::fmt;

/// Bytes of a [`Text`], at most.
pub const MAX_TEXT_BYTES: usize = 255;

/// Mark in the place of what cannot be shown or understood.
const REPLACEMENT: char = '\u{fffd}';

/// Mark at the end of a text that was cut.
const CUT: char = '…';

/// Text value of at most [`MAX_TEXT_BYTES`] bytes in UTF-8, on one line. Clones share their bytes.
///
/// Tabs and ends of lines are spaces. Other control characters, and those that turn the direction
/// of what stands beside them, are replaced by U+FFFD, so that the text of a device changes nothing
/// of a line but its own place. A text with U+FFFD, or one that was cut, is not whole: the host
/// takes it for uncertain, whatever its source says.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Text(Arc<str>);

impl Text {
    /// Creates a whole text; `None` for one that is too long or has characters that are replaced.
    ///
    /// ```
    /// use busbar_types::Text;
    ///
    /// assert_eq!(Text::new("AUTO\n").unwrap().as_str(), "AUTO ");
    /// assert_eq!(Text::new("AUTO\0"), None);
    /// assert_eq!(Text::new(&"x".repeat(256)), None);
    /// ```
    pub fn new(text: &str) -> Option<Self> {
        let text = Self::cut(text);
        text.is_whole().then_some(text)
    }

    /// Creates a text of another one, as far as it goes. What was cut ends with an ellipsis.
    pub fn cut(text: &str) -> Self {
        let is_plain =
            text.len() <= MAX_TEXT_BYTES && text.chars().all(|shown| shown == replaced(shown));
        if is_plain {
            return Self(text.into());
        }
        let mut bytes = [0; MAX_TEXT_BYTES];
        let (mut len, mut last_cut, mut is_whole) = (0, 0, true);
        for character in text.chars().map(replaced) {
            if len + CUT.len_utf8() <= MAX_TEXT_BYTES {
                last_cut = len;
            }
            if len + character.len_utf8() > MAX_TEXT_BYTES {
                is_whole = false;
                break;
            }
            len += character.encode_utf8(&mut bytes[len..]).len();
        }
        if !is_whole {
            len = last_cut + CUT.encode_utf8(&mut bytes[last_cut..]).len();
        }
        // Whole characters were written, so that nothing is lost here.
        Self(core::str::from_utf8(&bytes[..len]).unwrap_or_default().into())
    }

    /// Creates a text of bytes, as far as it goes. Bytes that are no UTF-8 are replaced by U+FFFD.
    pub fn from_utf8_lossy(bytes: &[u8]) -> Self {
        // As many bytes are looked at as can be needed, however many there are.
        Self::cut(&alloc::string::String::from_utf8_lossy(&bytes[..bytes.len().min(MAX_INPUT)]))
    }

    /// Reports whether the text is all that its source sent: nothing was cut or replaced. A text
    /// that looks as if it had been counts as such.
    pub fn is_whole(&self) -> bool {
        let looks_cut = self.0.len() >= MAX_TEXT_BYTES - CUT.len_utf8() && self.0.ends_with(CUT);
        !looks_cut && !self.0.contains(REPLACEMENT)
    }

    /// Returns the text as a string slice.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Bytes of input that can matter to a text that is cut.
const MAX_INPUT: usize = 2 * MAX_TEXT_BYTES;

/// Returns what is shown for a character: a space for what ends lines and for tabs; the mark for a
/// control character and for one that turns the direction of what follows (UAX #9, explicit
/// embeddings, overrides and isolates).
fn replaced(character: char) -> char {
    match character {
        '\t' | '\n' | '\r' | '\u{2028}' | '\u{2029}' => ' ',
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' => REPLACEMENT,
        character if character.is_control() => REPLACEMENT,
        character => character,
    }
}

impl fmt::Display for Text {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl AsRef<str> for Text {
    fn as_ref(&self) -> &str {
        &self.0
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for Text {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0)
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for Text {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = <alloc::borrow::Cow<'de, str> as serde::Deserialize>::deserialize(deserializer)?;
        match text.len() <= MAX_TEXT_BYTES {
            true => Ok(Self::cut(&text)),
            false => Err(serde::de::Error::custom("a text value has at most 255 bytes")),
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::string::{String, ToString};

    use super::*;

    #[test]
    fn texts_of_every_length_fit_and_say_what_they_lost() {
        for unit in ["x", "é", "電", "🔌", "\n", "a\u{202e}", "\0"] {
            for count in 0..300 {
                let whole = unit.repeat(count);
                let shown: String = whole.chars().map(replaced).collect();
                let text = Text::cut(&whole);
                assert!(text.as_str().len() <= MAX_TEXT_BYTES);
                let fits = shown.len() <= MAX_TEXT_BYTES;
                match fits {
                    true => assert_eq!(text.to_string(), shown),
                    false => {
                        let kept = text.as_str().strip_suffix(CUT);
                        assert!(kept.is_some_and(|kept| shown.starts_with(kept)), "{text}");
                    }
                }
                assert_eq!(text.is_whole(), fits && !shown.contains(REPLACEMENT), "{unit} {count}");
                assert_eq!(Text::new(&whole).is_some(), text.is_whole());
                assert_eq!(Text::from_utf8_lossy(whole.as_bytes()), text);
                // What was made of it once stays as it is.
                assert_eq!(Text::cut(text.as_str()), text);
            }
        }
    }

    #[test]
    fn bytes_that_are_no_text_are_told() {
        let text = Text::from_utf8_lossy(b"AUTO\xff");
        assert_eq!((text.as_str(), text.is_whole()), ("AUTO\u{fffd}", false));
        let text = Text::from_utf8_lossy(&[0xff; 1 << 16]);
        assert!(text.as_str().ends_with(CUT) && !text.is_whole());
    }
}
