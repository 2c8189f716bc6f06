//! Row reader for untrusted tables: rows of bounded size, each with its line.
//!
//! A cell in quotes may have lines of its own. Where a quote is not closed, what follows would
//! all be one cell: such a row ends with its first line.

use std::io::{self, Read, Seek, SeekFrom};

use crate::encoding::MAX_MARK_BYTES;
use crate::lines::{Line, Lines, MAX_LINE_BYTES};
use crate::{Cells, Delimiter, Dialect, TextEncoding};

/// Most lines of one row.
const MAX_ROW_LINES: u32 = 64;
/// Start of the line by which spreadsheets say their delimiter.
const SEPARATOR_LINE: &str = "sep=";

/// Limits of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowLimits {
    /// Bytes of all its lines.
    pub bytes: usize,
    /// Cells of a row.
    pub cells: usize,
}

/// Outcome of reading a row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NextRow {
    /// A row, whose cells are [`Rows::cells`].
    Row,
    /// A row with more bytes or cells than one may have, in words.
    TooLong(String),
    /// The end of the table.
    End,
}

/// Rows of a table in any encoding.
#[derive(Debug)]
pub struct Rows<R> {
    lines: Lines<R>,
    encoding: TextEncoding,
    limits: RowLimits,
    comment: Option<String>,
    delimiter: Delimiter,
    cells: Cells,
    raw: Vec<u8>,
    /// First line of the row.
    first: String,
    line: u64,
    /// Offset and number of the line after the first of the row.
    after_first: (u64, u64),
    has_more_lines: bool,
    has_open_quote: bool,
    is_malformed: bool,
}

impl<R: Read + Seek> Rows<R> {
    /// Opens a table before its header row: reads its byte order mark, its `sep=` line, and skips
    /// the lines that the dialect says. Returns remarks on contradictions as well.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn open(
        mut file: R,
        dialect: &Dialect,
        limits: RowLimits,
    ) -> io::Result<(Self, Vec<String>)> {
        let mut remarks = Vec::new();
        let mut start = Vec::new();
        file.seek(SeekFrom::Start(0))?;
        (&mut file).take(MAX_MARK_BYTES as u64).read_to_end(&mut start)?;
        let (encoding, mark) = match TextEncoding::from_mark(&start) {
            Some((marked, mark)) => {
                if let Some(given) = dialect.encoding.filter(|given| *given != marked) {
                    remarks.push(format!(
                        "its byte order mark says {}, the settings {}: read by its mark",
                        marked.name(),
                        given.name()
                    ));
                }
                (marked, mark)
            }
            None => (dialect.encoding.unwrap_or_default(), 0),
        };
        let mut lines = Lines::of_encoding(file, encoding, mark as u64, 1)?;
        lines.find_line_end()?;
        let delimiter = dialect.delimiter.unwrap_or(dialect.fallback);
        let mut rows = Self {
            lines,
            encoding,
            limits,
            comment: dialect.comment.clone(),
            delimiter,
            cells: Cells::new(delimiter, limits.cells),
            raw: Vec::new(),
            first: String::new(),
            line: 1,
            after_first: (mark as u64, 1),
            has_more_lines: false,
            has_open_quote: false,
            is_malformed: false,
        };
        rows.skip_preamble(dialect, &mut remarks)?;
        Ok((rows, remarks))
    }

    fn skip_preamble(&mut self, dialect: &Dialect, remarks: &mut Vec<String>) -> io::Result<()> {
        for number in 0..=dialect.skip_lines {
            let position = self.position();
            if self.lines.read(&mut self.raw)? == Line::End {
                break;
            }
            let text = self.encoding.decode(&self.raw).into_owned();
            let separator = separator_of(&text);
            if let Some(found) = separator.filter(|_| number == 0) {
                match (found, dialect.delimiter) {
                    (Ok(said), Some(set)) if said != set => remarks.push(format!(
                        "line 1: sep= says '{}', the settings '{}': read by the settings",
                        said.name(),
                        set.name()
                    )),
                    (Ok(said), _) => {
                        self.delimiter = said;
                        self.cells = Cells::new(said, self.limits.cells);
                    }
                    (Err(fault), _) => remarks.push(format!("line 1: sep= says {fault}")),
                }
            } else if number == dialect.skip_lines {
                self.go_to(position)?;
            }
        }
        Ok(())
    }

    /// Goes to the next row that is neither blank nor a comment.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn read(&mut self) -> io::Result<NextRow> {
        loop {
            self.line = self.lines.number();
            (self.has_more_lines, self.has_open_quote, self.is_malformed) = (false, false, false);
            match self.lines.read(&mut self.raw)? {
                Line::End => return Ok(NextRow::End),
                Line::TooLong => {
                    self.after_first = self.position();
                    return Ok(NextRow::TooLong(format!("more than {MAX_LINE_BYTES} bytes")));
                }
                Line::Whole => {}
            }
            self.after_first = self.position();
            self.first.clear();
            let text = self.encoding.decode(&self.raw);
            self.first.push_str(text.trim_end_matches('\r'));
            let is_comment = self.comment.as_deref().is_some_and(|comment| {
                let text = self.first.trim_start();
                text.strip_prefix('"').unwrap_or(text).starts_with(comment)
            });
            // The mark at the end of files of DOS is no row.
            let is_blank = matches!(self.first.trim(), "" | "\u{1a}");
            if is_comment || is_blank {
                continue;
            }
            return self.read_row();
        }
    }

    fn read_row(&mut self) -> io::Result<NextRow> {
        let mut bytes = self.first.len();
        self.is_malformed = is_malformed(&self.first);
        let mut ends = self.cells.begin(&self.first);
        for _ in 1..MAX_ROW_LINES {
            if ends != Ok(false) || bytes > self.limits.bytes {
                break;
            }
            self.has_more_lines = true;
            if self.lines.read(&mut self.raw)? != Line::Whole {
                break;
            }
            let text = self.encoding.decode(&self.raw);
            let text = text.trim_end_matches('\r');
            bytes += text.len() + 1;
            self.is_malformed |= is_malformed(text);
            ends = self.cells.go_on(text);
        }
        if ends == Ok(false) {
            self.has_open_quote = true;
            self.back_to_first_line()?;
            bytes = self.first.len();
            ends = self.cells.cut(&self.first).map(|()| true);
        }
        Ok(match ends {
            _ if bytes > self.limits.bytes => {
                self.back_to_first_line()?;
                NextRow::TooLong(format!("more than {} bytes", self.limits.bytes))
            }
            Ok(_) => NextRow::Row,
            Err(fault) => {
                self.back_to_first_line()?;
                NextRow::TooLong(fault)
            }
        })
    }

    /// Ends the row with its first line, as where a quote is not closed, and cuts that again;
    /// returns whether the row had more lines.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn end_with_first_line(&mut self) -> io::Result<bool> {
        if !self.has_more_lines {
            return Ok(false);
        }
        self.has_open_quote = true;
        self.back_to_first_line()?;
        // A line that was cut before has no more cells than it had.
        let _ = self.cells.cut(&self.first);
        Ok(true)
    }

    fn back_to_first_line(&mut self) -> io::Result<()> {
        self.go_to(self.after_first)?;
        self.has_more_lines = false;
        self.is_malformed = is_malformed(&self.first);
        Ok(())
    }

    /// Cells of the row.
    pub fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Number of the row's first line; that of the file is 1.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// First line of the row as text.
    pub fn first_line(&self) -> &str {
        &self.first
    }

    /// Reports a row that ends with its first line, since a quote of it is not closed.
    pub fn has_open_quote(&self) -> bool {
        self.has_open_quote
    }

    /// Reports a row with bytes that are not of the encoding.
    pub fn is_malformed(&self) -> bool {
        self.is_malformed
    }

    /// Encoding of the table.
    pub fn encoding(&self) -> TextEncoding {
        self.encoding
    }

    /// Delimiter of the table.
    pub fn delimiter(&self) -> Delimiter {
        self.delimiter
    }

    /// Place of the next row, for [`Self::go_to`].
    pub fn position(&self) -> (u64, u64) {
        (self.lines.offset(), self.lines.number())
    }

    /// Goes to a place that [`Self::position`] gave.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn go_to(&mut self, (offset, number): (u64, u64)) -> io::Result<()> {
        self.lines.go_to(offset, number)
    }
}

/// The delimiter of a line such as `sep=;`.
fn separator_of(line: &str) -> Option<Result<Delimiter, String>> {
    let line = line.trim_end_matches(['\r', '\n']).trim_matches('"');
    let start = line.get(..SEPARATOR_LINE.len())?;
    let rest = line.get(SEPARATOR_LINE.len()..)?;
    start.eq_ignore_ascii_case(SEPARATOR_LINE).then(|| Delimiter::parse(rest))
}

fn is_malformed(text: &str) -> bool {
    text.contains(['\u{fffd}', '\0'])
}

#[cfg(test)]
#[path = "rows_tests.rs"]
mod tests;
