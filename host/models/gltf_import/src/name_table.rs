//! Property table strings: a column of feature names (EXT_structural_metadata).

use crate::buffers::Buffers;
use crate::document::pointer_step;
use crate::error::{ImportError, ImportFault};
use crate::extensions::{Class, Column, PropertyTable};
use crate::scalars::Whole;

/// Columns that are taken for names if a table has them, the best first;
/// without any, its first column of strings is.
const NAME_COLUMNS: [&str; 3] = ["equipment", "id", "name"];

/// The names of a table's rows, all checked.
pub(crate) struct NameTable<'a> {
    /// From the first name to the last one's end.
    text: &'a str,
    offsets: Offsets<'a>,
}

/// Offsets of the strings' beginnings, and the end of the last one.
#[derive(Clone, Copy)]
struct Offsets<'a> {
    bytes: &'a [u8],
    width: usize,
}

impl<'a> NameTable<'a> {
    /// Reads the names of a table's rows; `None` without a column of strings. `place` is the
    /// table's place. `charge` receives the number of bytes to be read before the time is spent.
    pub(crate) fn read(
        table: &PropertyTable,
        class: &Class,
        buffers: &'a Buffers<'_>,
        place: &str,
        charge: impl FnOnce(u64) -> Result<(), ImportError>,
    ) -> Result<Option<Self>, ImportError> {
        let wanted = NAME_COLUMNS.iter().find_map(|wanted| {
            table.strings(class).find(|(name, _)| name.eq_ignore_ascii_case(wanted))
        });
        let Some((name, column)) = wanted.or_else(|| table.strings(class).next()) else {
            return Ok(None);
        };
        let here = |field: &str| format!("{place}/properties/{}{field}", pointer_step(name));
        let view = |index: Whole, field: &str| buffers.view(index.index(), || here(field));
        let values = view(column.values, "/values")?.bytes;
        let Some(offsets) = column.string_offsets else {
            let fault = ImportFault::Invalid("a column of strings without stringOffsets".into());
            return Err(fault.at(here("")));
        };
        let bytes = view(offsets, "/stringOffsets")?.bytes;
        let offsets = Offsets::new(bytes, offset_width(column, &here)?, table.count.0.into())
            .map_err(|fault| fault.at(here("/stringOffsets")))?;
        charge((offsets.bytes.len() + values.len()) as u64)?;
        let names = Self::new(values, offsets).map_err(|fault| fault.at(here("")))?;
        Ok(Some(names))
    }

    fn new(values: &'a [u8], offsets: Offsets<'a>) -> Result<Self, ImportFault> {
        let (first, last) = (offsets.get(0), offsets.get(offsets.count() - 1));
        let text = usize::try_from(first)
            .ok()
            .zip(usize::try_from(last).ok())
            .and_then(|(first, last)| values.get(first..last));
        let Some(text) = text else {
            let (needed, available) = (last.max(first), values.len() as u64);
            return Err(ImportFault::Beyond { what: "the names", needed, available });
        };
        let text = std::str::from_utf8(text).map_err(|e| {
            ImportFault::Invalid(format!("byte {} of the names is not UTF-8", e.valid_up_to()))
        })?;
        let mut before = first;
        for row in 1..offsets.count() {
            let end = offsets.get(row);
            // Within the text: no end is before `first` or after `last`.
            if end < before || end > last || !text.is_char_boundary((end - first) as usize) {
                let what = format!("the name of row {} does not end at {end}", row - 1);
                return Err(ImportFault::Invalid(what));
            }
            before = end;
        }
        Ok(Self { text, offsets })
    }

    /// Returns the name of a row; `None` beyond the last.
    pub(crate) fn get(&self, row: u32) -> Option<&'a str> {
        let row = row as usize;
        if row + 1 >= self.offsets.count() {
            return None;
        }
        let at = |row| (self.offsets.get(row) - self.offsets.get(0)) as usize;
        self.text.get(at(row)..at(row + 1))
    }
}

impl<'a> Offsets<'a> {
    /// Checks the offsets of so many rows: one more than rows.
    fn new(bytes: &'a [u8], width: usize, rows: u64) -> Result<Self, ImportFault> {
        let needed = rows.saturating_add(1).saturating_mul(width as u64);
        let available = bytes.len() as u64;
        if needed > available {
            return Err(ImportFault::Beyond { what: "a list of offsets", needed, available });
        }
        // At most the length of a slice.
        Ok(Self { bytes: &bytes[..needed as usize], width })
    }

    fn count(&self) -> usize {
        self.bytes.len() / self.width
    }

    fn get(&self, index: usize) -> u64 {
        let bytes = &self.bytes[index * self.width..][..self.width];
        bytes.iter().rev().fold(0, |value, &byte| value << 8 | u64::from(byte))
    }
}

/// Returns the bytes of one offset.
fn offset_width(column: &Column, here: &impl Fn(&str) -> String) -> Result<usize, ImportError> {
    match column.string_offset_type.as_deref() {
        Some("UINT8") => Ok(1),
        Some("UINT16") => Ok(2),
        Some("UINT32") | None => Ok(4),
        Some("UINT64") => Ok(8),
        Some(_) => {
            let fault = ImportFault::Invalid("unknown type of offsets".into());
            Err(fault.at(here("/stringOffsetType")))
        }
    }
}
