//! Business and asset records: capability `busbar.records/1-draft`.

use std::sync::Arc;

use busbar_plugin_abi as abi;
use busbar_records::{Description, Record, RecordError};
use busbar_types::DefectSeverity;
use serde::{Deserialize, Serialize};

use crate::json_output::ask_json;
use crate::{Instance, PluginError};

/// Rows of one page.
pub const MAX_PAGE_ROWS: u32 = 4096;
/// Bytes of the texts of one page: at least a row always fits.
const PAGE_TEXT_BYTES: usize = 1 << 20;
const _: () =
    assert!((1 + abi::BUSBAR_MAX_RECORD_COLUMNS) * abi::BUSBAR_MAX_RECORD_TEXT <= PAGE_TEXT_BYTES);

/// A plugin that has records.
#[derive(Clone)]
pub struct Records {
    instance: Arc<Instance>,
    table: &'static abi::BusbarRecords,
}

/// Some of the rows of a list.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordPage {
    /// Grows with every change of the description or of any list.
    pub revision: u64,
    /// Rows that the list has.
    pub total: u64,
    /// The rows wanted, as far as there are so many and they fit.
    pub rows: Vec<Record>,
}

impl RecordPage {
    /// Validates the page against the number of columns and the rows asked for.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn check(&self, columns: u32, count: u32) -> Result<(), RecordError> {
        self.rows.iter().try_for_each(|row| row.check(columns as usize))?;
        let what = if self.total > abi::BUSBAR_MAX_RECORD_ROWS as u64 {
            "a list claims more rows than one may have"
        } else if self.rows.len() > count as usize {
            "a list gives more rows than were asked for"
        } else {
            return Ok(());
        };
        Err(RecordError::new(what))
    }
}

impl Records {
    /// The records of an instance.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_instance(instance: Arc<Instance>) -> Result<Self, PluginError> {
        let table: &abi::BusbarRecords = instance.capability(abi::RECORDS_ID)?;
        if table.describe.is_none() || table.read.is_none() {
            return Err(instance.violation("`describe` or `read` of its records is null"));
        }
        Ok(Self { instance, table })
    }

    /// Describes the lists of records of the plugin.
    ///
    /// # Errors
    /// What the plugin says, or the rule that its answer breaks.
    pub fn describe(&self) -> Result<Description, PluginError> {
        let describe = self.table.describe.ok_or_else(|| self.null_function_error())?;
        let limit = abi::BUSBAR_MAX_RECORD_DESCRIPTION;
        let description: Description = ask_json(&self.instance, limit, |output, error| {
            // SAFETY: output and error live for the call.
            unsafe { describe(self.instance.as_ptr(), output, error) }
        })?;
        description.check().map_err(|fault| self.instance.violation(fault.to_string()))?;
        Ok(description)
    }

    /// Reads at most `count` rows from `first` on, of a list with so many columns. With `count` 0
    /// the page has the revision alone, of any list.
    ///
    /// # Errors
    /// What the plugin says, or the rule that its answer breaks.
    pub fn read(
        &self,
        list: u32,
        columns: u32,
        first: u64,
        count: u32,
    ) -> Result<RecordPage, PluginError> {
        let read = self.table.read.ok_or_else(|| self.null_function_error())?;
        let count = count.min(MAX_PAGE_ROWS);
        let columns = columns.min(abi::BUSBAR_MAX_RECORD_COLUMNS as u32);
        let mut buffer = PageBuffer::new(count, columns);
        let mut page = abi::BusbarRecordPage {
            struct_size: size_of::<abi::BusbarRecordPage>() as u32,
            list,
            column_count: columns,
            row_capacity: count,
            first,
            text_capacity: buffer.text.len() as u32,
            row_count: 0,
            total: 0,
            revision: 0,
            rows: buffer.rows.as_mut_ptr(),
            ends: buffer.ends.as_mut_ptr(),
            text: buffer.text.as_mut_ptr(),
        };
        let mut error = abi::BusbarError::empty();
        let serial = self.instance.serialize_calls();
        // SAFETY: page, its buffers and the error live for the call.
        let status = unsafe { read(self.instance.as_ptr(), &mut page, &mut error) };
        drop(serial);
        self.instance.outcome(status, &error)?;
        let (revision, total) = (page.revision, page.total);
        let rows = buffer.rows(page.row_count).map_err(|what| self.instance.violation(what))?;
        let page = RecordPage { revision, total, rows };
        page.check(columns, count).map_err(|fault| self.instance.violation(fault.to_string()))?;
        Ok(page)
    }

    fn null_function_error(&self) -> PluginError {
        self.instance.violation("a function of its records is null")
    }
}

/// Buffer that a plugin writes a page of rows into.
struct PageBuffer {
    rows: Vec<abi::BusbarRecordRow>,
    ends: Vec<u32>,
    text: Vec<u8>,
    texts_a_row: usize,
}

impl PageBuffer {
    fn new(count: u32, columns: u32) -> Self {
        let (count, texts_a_row) = (count as usize, 1 + columns as usize);
        Self {
            rows: vec![abi::BusbarRecordRow::default(); count],
            ends: vec![0; count * texts_a_row],
            text: vec![0; if count > 0 { PAGE_TEXT_BYTES } else { 0 }],
            texts_a_row,
        }
    }

    fn rows(&self, count: u32) -> Result<Vec<Record>, &'static str> {
        let rows = self.rows.get(..count as usize).ok_or("it claims more rows than fit")?;
        let mut start = 0;
        let mut next = |end: &u32| {
            let text = self.text.get(start..*end as usize);
            start = *end as usize;
            let text = text.ok_or("the ends of its texts are out of order or beyond them")?;
            std::str::from_utf8(text).map(str::to_owned).map_err(|_| "a cell is not UTF-8")
        };
        let record = |(raw, ends): (&abi::BusbarRecordRow, &[u32])| {
            let mut texts = ends.iter().map(&mut next);
            let equipment = texts.next().unwrap_or(Ok(String::new()))?;
            Ok(Record {
                equipment,
                cells: texts.collect::<Result<_, _>>()?,
                unix_nanos: Some(raw.time_unix_nanos)
                    .filter(|time| *time != abi::BUSBAR_RECORD_NO_TIME),
                severity: match raw.severity {
                    abi::BUSBAR_DEFECT_SEVERITY_NONE => None,
                    code => {
                        let known = DefectSeverity::from_code(code);
                        Some(known.ok_or("a row has an unknown severity")?)
                    }
                },
                is_open: match raw.flags {
                    0 => false,
                    abi::BUSBAR_RECORD_OPEN => true,
                    _ => return Err("a row has unknown flags"),
                },
            })
        };
        rows.iter().zip(self.ends.chunks_exact(self.texts_a_row)).map(record).collect()
    }
}
