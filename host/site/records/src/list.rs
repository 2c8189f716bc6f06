//! The rows of a list, and whose they are.

use std::collections::HashMap;

use crate::{Kind, ListInfo, Record, RecordError};

/// Rows of a list.
pub const MAX_ROWS: usize = 200_000;
/// Bytes of all rows of all lists of a plugin, as [`Record::bytes`] counts them.
pub const MAX_BYTES: usize = 64 << 20;

/// A list with its rows, checked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct List {
    info: ListInfo,
    rows: Vec<Record>,
    of_equipment: HashMap<String, Vec<u32>>,
    bytes: usize,
}

impl List {
    /// Creates a list without rows.
    pub fn new(info: ListInfo) -> Self {
        Self { info, ..Self::default() }
    }

    /// Appends rows after validation.
    ///
    /// # Errors
    /// The rule that they break; those before the one that breaks it are there then.
    pub fn append(&mut self, rows: Vec<Record>) -> Result<(), RecordError> {
        for row in rows {
            row.check(self.info.columns.len())?;
            self.bytes += row.bytes();
            if self.rows.len() >= MAX_ROWS || self.bytes > MAX_BYTES {
                let title = &self.info.title;
                let limits = format!("{MAX_ROWS} rows or {MAX_BYTES} bytes");
                return Err(RecordError(format!("the list '{title}' has more than {limits}")));
            }
            let index = self.rows.len() as u32;
            match self.of_equipment.get_mut(&row.equipment) {
                Some(own) => own.push(index),
                None => drop(self.of_equipment.insert(row.equipment.clone(), vec![index])),
            }
            self.rows.push(row);
        }
        Ok(())
    }

    /// Returns the description of the list.
    pub fn info(&self) -> &ListInfo {
        &self.info
    }

    /// Returns the number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Reports whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Bytes of its rows.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// Iterates over the equipment names of the rows, each once, in no order.
    pub fn equipment(&self) -> impl Iterator<Item = &str> {
        self.of_equipment.keys().map(String::as_str)
    }

    /// Returns the rows of the equipment that has one of these ids, each with the index of its
    /// id. Events and tasks are ordered by urgency: open ones first, then the newest. Assets keep
    /// the order of their ids.
    pub fn rows_of<'a>(&'a self, ids: &[String]) -> Vec<(usize, &'a Record)> {
        let own = |(place, id): (usize, &String)| {
            let rows = self.of_equipment.get(id).map_or(&[][..], Vec::as_slice);
            rows.iter().map(move |&row| (place, row))
        };
        let found = ids.iter().enumerate().flat_map(own);
        let mut found: Vec<_> =
            found.map(|(place, row)| (place, &self.rows[row as usize])).collect();
        if self.info.kind == Kind::Business {
            found.sort_by_cached_key(|(_, row)| row.urgency());
        }
        found
    }
}
