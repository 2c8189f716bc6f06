//! Dialect of a table: what its settings say of characters, cells and rows before the data.

use crate::TextEncoding;

/// Most lines that may be skipped before the header.
const MAX_SKIPPED_LINES: u32 = 10_000;
/// Bytes of the longest start of a comment.
const MAX_COMMENT_BYTES: usize = 16;

/// Delimiter: the character between cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Delimiter(u8);

impl Default for Delimiter {
    fn default() -> Self {
        Self(b',')
    }
}

impl Delimiter {
    /// Parses a delimiter: the character, or its name.
    ///
    /// # Errors
    /// What is allowed.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "," | "comma" => Ok(Self(b',')),
            ";" | "semicolon" => Ok(Self(b';')),
            "\t" | "\\t" | "tab" => Ok(Self(b'\t')),
            "|" | "pipe" => Ok(Self(b'|')),
            other => {
                let shown = crate::shorten(other);
                Err(format!(r#"'{shown}' is none of ",;\t|", nor comma, semicolon, tab, pipe"#))
            }
        }
    }

    /// The delimiter that spreadsheets write beside a decimal sign: a semicolon beside a comma.
    pub fn beside(decimal: char) -> Self {
        Self(if decimal == ',' { b';' } else { b',' })
    }

    /// The character as a byte of ASCII.
    pub fn byte(self) -> u8 {
        self.0
    }

    /// The character for messages.
    pub fn name(self) -> &'static str {
        match self.0 {
            b';' => ";",
            b'\t' => "tab",
            b'|' => "|",
            _ => ",",
        }
    }
}

/// Dialect of a table, checked.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Dialect {
    /// Character between cells, where the settings say it.
    pub delimiter: Option<Delimiter>,
    /// Character between cells where neither settings nor a `sep=` line say it.
    pub fallback: Delimiter,
    /// Character encoding, where the settings say it; a byte order mark goes before it.
    pub encoding: Option<TextEncoding>,
    /// Lines before the header.
    pub skip_lines: u32,
    /// Start of lines that are comments.
    pub comment: Option<String>,
}

impl Dialect {
    /// Checks the settings of a dialect.
    ///
    /// # Errors
    /// Each setting at fault, with what is allowed.
    pub fn parse(
        delimiter: Option<&str>,
        encoding: Option<&str>,
        skip_lines: u32,
        comment: Option<&str>,
    ) -> Result<Self, Vec<String>> {
        let mut faults = Vec::new();
        let mut keep = |name: &str, fault: String| faults.push(format!("{name}: {fault}"));
        let delimiter = delimiter.map(Delimiter::parse).transpose();
        let delimiter = delimiter.unwrap_or_else(|fault| {
            keep("delimiter", fault);
            None
        });
        let encoding = encoding.map(TextEncoding::from_name).transpose();
        let encoding = encoding.unwrap_or_else(|fault| {
            keep("encoding", fault);
            None
        });
        if skip_lines > MAX_SKIPPED_LINES {
            let most = MAX_SKIPPED_LINES;
            keep("skip_lines", format!("{skip_lines} is not within 0 to {most}"));
        }
        if comment.is_some_and(|text| text.trim().is_empty() || text.len() > MAX_COMMENT_BYTES) {
            let most = MAX_COMMENT_BYTES;
            keep("comment", format!("give 1 to {most} bytes, such as \"#\""));
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        let comment = comment.map(|text| text.trim().to_owned());
        Ok(Self { delimiter, fallback: Delimiter::default(), encoding, skip_lines, comment })
    }
}
