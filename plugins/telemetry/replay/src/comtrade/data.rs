//! The records of a file, one at a time, from any on.

use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;

use text_table::lines::{Line, Lines, MAX_LINE_BYTES};
use thiserror::Error;

use super::record::{Record, RecordError, RecordLayout};

/// Blocks of lines whose places are kept. Where a file has more, blocks grow.
pub const MAX_BLOCKS: usize = 4096;
/// Lines of a block at first.
const FIRST_BLOCK_LINES: u64 = 64;

/// Fault of a record that was not read.
#[derive(Debug, Error)]
pub enum DataFault {
    /// The file cannot be read any further.
    #[error("record {record}: {error}")]
    Read {
        /// Number of the record, the first being 1.
        record: u64,
        /// Error of the system.
        error: io::Error,
    },
    /// One record is malformed. Those after it may be well.
    #[error("line {line}: {fault}")]
    Line {
        /// Number of the line, the first being 1.
        line: u64,
        /// Fault of the line.
        fault: RecordError,
    },
    /// A line that nobody meant.
    #[error("line {0} has more than {MAX_LINE_BYTES} bytes")]
    TooLong(u64),
}

impl DataFault {
    /// Reports whether nothing can be read after the fault.
    pub fn is_final(&self) -> bool {
        matches!(self, Self::Read { .. })
    }
}

/// Records of a file. Memory does not depend on the file's length.
#[derive(Debug)]
pub struct Data<R> {
    layout: RecordLayout,
    source: Source<R>,
    /// Records before the next one.
    position: u64,
}

#[derive(Debug)]
enum Source<R> {
    Binary { reader: BufReader<R>, start: u64, records: u64, rest: u64, record: Vec<u8> },
    Text { lines: Lines<R>, blocks: Blocks, line: Vec<u8>, fields: Vec<Range<usize>> },
}

impl<R: Read + Seek> Data<R> {
    /// Records of a file from a place on, which line `line` is; of binary data at
    /// most `bytes`, where that is known.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn open(
        mut file: R,
        layout: RecordLayout,
        start: u64,
        line: u64,
        bytes: Option<u64>,
    ) -> io::Result<Self> {
        let source = if let Some(size) = layout.record_bytes() {
            let there = file.seek(SeekFrom::End(0))?.saturating_sub(start);
            let used = bytes.unwrap_or(there).min(there);
            let (records, rest) = (used / size as u64, used % size as u64);
            let mut reader = BufReader::new(file);
            reader.seek(SeekFrom::Start(start))?;
            Source::Binary { reader, start, records, rest, record: vec![0; size] }
        } else {
            let lines = Lines::from(file, start, line)?;
            let blocks = Blocks { lines: FIRST_BLOCK_LINES, places: Vec::new() };
            Source::Text { lines, blocks, line: Vec::new(), fields: Vec::new() }
        };
        Ok(Self { layout, source, position: 0 })
    }

    /// Records before the next one.
    pub fn position(&self) -> u64 {
        self.position
    }

    /// Whole records of binary data; nothing for text, where nobody knows.
    pub fn records(&self) -> Option<u64> {
        match self.source {
            Source::Binary { records, .. } => Some(records),
            Source::Text { .. } => None,
        }
    }

    /// Bytes after the last whole record of binary data.
    pub fn rest_bytes(&self) -> u64 {
        match self.source {
            Source::Binary { rest, .. } => rest,
            Source::Text { .. } => 0,
        }
    }

    /// The next record; nothing at the end.
    ///
    /// # Errors
    /// What is wrong with it. Unless [`DataFault::is_final`], the next call gives the
    /// one after it.
    pub fn read(&mut self) -> Result<Option<Record<'_>>, DataFault> {
        let number = self.position + 1;
        let failed = |error| DataFault::Read { record: number, error };
        match &mut self.source {
            Source::Binary { reader, records, record, .. } => {
                if self.position == *records {
                    return Ok(None);
                }
                reader.read_exact(record).map_err(|error| failed(in_words(error)))?;
                self.position = number;
                Ok(Some(self.layout.read_binary(record)))
            }
            Source::Text { lines, blocks, line, fields } => {
                loop {
                    let (offset, place) = (lines.offset(), lines.number());
                    let read = lines.read(line).map_err(failed)?;
                    if read == Line::End {
                        return Ok(None);
                    }
                    // Blank lines are no records.
                    if read == Line::Whole
                        && line.iter().all(|byte| byte.is_ascii_whitespace() || *byte == 0x1A)
                    {
                        continue;
                    }
                    blocks.note(self.position, offset, place);
                    self.position = number;
                    if read == Line::TooLong {
                        return Err(DataFault::TooLong(place));
                    }
                    let record = self.layout.read_line(line, fields);
                    return record
                        .map(Some)
                        .map_err(|fault| DataFault::Line { line: place, fault });
                }
            }
        }
    }

    /// Goes to another record, `position` records from the first; of text to one
    /// that has been read.
    ///
    /// # Errors
    /// I/O errors of the file.
    pub fn seek(&mut self, position: u64) -> Result<(), DataFault> {
        let failed = |error| DataFault::Read { record: position.saturating_add(1), error };
        match &mut self.source {
            Source::Binary { reader, start, records, record, .. } => {
                self.position = position.min(*records);
                let place = *start + self.position * record.len() as u64;
                reader.seek(SeekFrom::Start(place)).map_err(failed)?;
            }
            Source::Text { lines, blocks, .. } => {
                let Some(block) = blocks.before(position) else { return Ok(()) };
                lines.go_to(block.offset, block.line).map_err(failed)?;
                self.position = block.record;
            }
        }
        // Within a block of text.
        while self.position < position {
            match self.read() {
                Ok(None) => break,
                Err(fault) if fault.is_final() => return Err(fault),
                Ok(Some(_)) | Err(_) => {}
            }
        }
        Ok(())
    }
}

/// Offsets of blocks of lines, so that text can be sought backwards.
#[derive(Debug)]
struct Blocks {
    lines: u64,
    places: Vec<Block>,
}

#[derive(Clone, Copy, Debug)]
struct Block {
    record: u64,
    offset: u64,
    line: u64,
}

impl Blocks {
    fn note(&mut self, record: u64, offset: u64, line: u64) {
        if record != self.places.len() as u64 * self.lines {
            return;
        }
        self.places.push(Block { record, offset, line });
        if self.places.len() == MAX_BLOCKS {
            let mut index = 0;
            self.places.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.lines *= 2;
        }
    }

    fn before(&self, record: u64) -> Option<Block> {
        let after = self.places.partition_point(|block| block.record <= record);
        self.places.get(after.checked_sub(1)?).copied()
    }
}

fn in_words(error: io::Error) -> io::Error {
    if error.kind() == ErrorKind::UnexpectedEof {
        return io::Error::new(error.kind(), "the file ends within it: it was cut short meanwhile");
    }
    error
}

#[cfg(test)]
#[path = "data_tests.rs"]
mod tests;
