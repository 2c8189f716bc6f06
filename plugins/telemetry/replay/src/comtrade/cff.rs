//! The single file of 2013 (clause 6): sections of a recording one after another.

use std::io::{self, Read, Seek};

use text_table::lines::{Line, Lines};
use thiserror::Error;

use super::cfg::MAX_CFG_BYTES;
use super::fields::shorten;

/// Bytes before the data, headers and remarks included.
pub const MAX_CFF_HEAD_BYTES: u64 = 64 << 20;

/// A single file that cannot be used.
#[derive(Debug, Error)]
pub enum CffError {
    /// The file cannot be read.
    #[error("{0}")]
    Read(#[from] io::Error),
    /// A separator that is none.
    #[error("line {line}: '{text}' is no separator such as '--- file type: DAT BINARY: 3500 ---'")]
    Separator {
        /// Number of the line.
        line: u64,
        /// Text of the line.
        text: String,
    },
    /// A configuration that is too long.
    #[error("line {0}: the configuration is longer than {MAX_CFG_BYTES} bytes")]
    TooLong(u64),
    /// No data within reach.
    #[error(
        "there is no configuration followed by data in the first {MAX_CFF_HEAD_BYTES} bytes; is it a COMTRADE file (CFF)?"
    )]
    Incomplete,
}

/// Parts of a single file and their offsets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cff {
    /// Bytes of the configuration.
    pub cfg: Vec<u8>,
    /// Offset of the data, bytes from the start of the file.
    pub data_offset: u64,
    /// Number of the first line of the data.
    pub data_line: u64,
    /// Bytes of the data, where the file says them.
    pub data_bytes: Option<u64>,
}

/// Section after a separator.
enum Section {
    Cfg,
    /// Data, and how many bytes of them, if it says.
    Data(Option<u64>),
    Other,
}

impl Cff {
    /// Finds the parts of a file.
    ///
    /// # Errors
    /// What is missing or malformed, and where.
    pub fn find(file: impl Read + Seek) -> Result<Self, CffError> {
        let mut lines = Lines::from(file, 0, 1)?;
        let (mut line, mut cfg) = (Vec::new(), Vec::new());
        let (mut is_cfg, mut has_cfg) = (false, false);
        while lines.offset() < MAX_CFF_HEAD_BYTES {
            let number = lines.number();
            match lines.read(&mut line)? {
                Line::End => break,
                Line::TooLong if is_cfg => return Err(CffError::TooLong(number)),
                Line::TooLong => continue,
                Line::Whole => {}
            }
            if let Some(inner) = separator(&line, number == 1) {
                let fault = || CffError::Separator {
                    line: number,
                    text: shorten(&String::from_utf8_lossy(&line)),
                };
                match parse(inner).ok_or_else(fault)? {
                    Section::Data(data_bytes) if has_cfg => {
                        let (data_offset, data_line) = (lines.offset(), lines.number());
                        return Ok(Self { cfg, data_offset, data_line, data_bytes });
                    }
                    Section::Data(_) => return Err(CffError::Incomplete),
                    Section::Cfg => (is_cfg, has_cfg) = (true, true),
                    Section::Other => is_cfg = false,
                }
            } else if is_cfg {
                if cfg.len() + line.len() > MAX_CFG_BYTES {
                    return Err(CffError::TooLong(number));
                }
                cfg.extend_from_slice(&line);
                cfg.push(b'\n');
            }
        }
        Err(CffError::Incomplete)
    }
}

/// The text between the dashes, in lower case.
fn separator(line: &[u8], is_first: bool) -> Option<String> {
    let line = if is_first { line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(line) } else { line };
    let text = std::str::from_utf8(line).ok()?.trim();
    // The standard has three dashes; some recorders write two.
    let inner = text.strip_prefix("--")?.strip_suffix("--")?;
    let inner = inner.trim_matches('-').trim().to_ascii_lowercase();
    let kind = inner.strip_prefix("file type")?;
    // Some recorders leave the colon out.
    Some(kind.strip_prefix(':').unwrap_or(kind).trim().to_owned())
}

fn parse(inner: String) -> Option<Section> {
    let (kind, rest) = inner.split_once(' ').unwrap_or((&inner, ""));
    match kind {
        "cfg" => Some(Section::Cfg),
        "inf" | "hdr" => Some(Section::Other),
        "dat" => {
            let (_, bytes) = rest.split_once(':').unwrap_or((rest, ""));
            let bytes = bytes.trim();
            let is_said = !bytes.is_empty();
            Some(Section::Data(if is_said { Some(bytes.parse().ok()?) } else { None }))
        }
        _ => None,
    }
}

#[cfg(test)]
#[path = "cff_tests.rs"]
mod tests;
