//! The records of a chart, checked.

use serde::{Deserialize, Serialize};

use crate::{ChartError, Description};

/// Records of a chart.
pub const MAX_RECORDS: usize = 10_000_000;

/// Properties of a record besides its values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Record {
    /// Time of the record, nanoseconds since 1970-01-01 UTC.
    pub unix_nanos: i64,
    /// Index of the equipment described.
    pub equipment: u32,
    /// Index of the legend's entry.
    pub state: u32,
}

/// Records and their values, those of each piece of equipment in the order of time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Records {
    axes: usize,
    records: Vec<Record>,
    /// A value an axis for each record, record by record; NaN where there is none.
    values: Vec<f32>,
    /// Records of each piece of equipment.
    of_equipment: Vec<Vec<u32>>,
    /// The first and the last time.
    span: Option<[i64; 2]>,
}

impl Records {
    /// Creates an empty set of records for a chart.
    pub fn new(description: &Description) -> Self {
        Self {
            axes: description.axes.len(),
            records: Vec::new(),
            values: Vec::new(),
            of_equipment: vec![Vec::new(); description.equipment.len()],
            span: None,
        }
    }

    /// Appends records. Values too small for a normal number become 0, so that every device
    /// compares them alike.
    ///
    /// # Errors
    /// The rule that they break; nothing of these records is there then.
    pub fn append(
        &mut self,
        records: &[Record],
        values: &[f32],
        states: usize,
    ) -> Result<(), ChartError> {
        if self.records.len() + records.len() > MAX_RECORDS {
            return Err(ChartError::new(format!("it has more than {MAX_RECORDS} records")));
        }
        if values.len() != records.len() * self.axes {
            return Err(ChartError::new("its records have more or fewer values than axes"));
        }
        if values.iter().any(|value| value.is_infinite()) {
            return Err(ChartError::new("a value is infinite; use NaN where there is none"));
        }
        let names_nothing = |record: &&Record| {
            record.equipment as usize >= self.of_equipment.len() || record.state as usize >= states
        };
        if records.iter().any(|record| names_nothing(&record)) {
            return Err(ChartError::new("a record names equipment or a state not described"));
        }
        let before = self.records.len();
        for (record, index) in records.iter().zip(before as u32..) {
            let own = &mut self.of_equipment[record.equipment as usize];
            let last = own.last().map(|&last| match (last as usize).checked_sub(before) {
                Some(new) => records[new].unix_nanos,
                None => self.records[last as usize].unix_nanos,
            });
            if last.is_some_and(|last| last > record.unix_nanos) {
                let new = |index: &u32| (*index as usize) < before;
                self.of_equipment.iter_mut().for_each(|own| own.retain(new));
                return Err(ChartError::new("records of one piece are not in the order of time"));
            }
            own.push(index);
        }
        for record in records {
            let at = record.unix_nanos;
            let [first, last] = self.span.unwrap_or([at; 2]);
            self.span = Some([first.min(at), last.max(at)]);
        }
        self.records.extend_from_slice(records);
        let flushed = |value: &f32| if value.is_subnormal() { 0.0 } else { *value };
        self.values.extend(values.iter().map(flushed));
        Ok(())
    }

    /// Returns the number of records.
    pub fn len(&self) -> usize {
        self.records.len()
    }

    /// Reports whether there are no records.
    pub fn is_empty(&self) -> bool {
        self.records.is_empty()
    }

    /// Returns all records, without their values.
    pub fn all(&self) -> &[Record] {
        &self.records
    }

    /// Returns the values of all records, record by record.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// Returns the number of values a record.
    pub fn axes(&self) -> usize {
        self.axes
    }

    /// The values of one.
    pub fn row(&self, record: usize) -> &[f32] {
        &self.values[record * self.axes..][..self.axes]
    }

    /// Returns the records of a piece of equipment, the oldest first.
    pub fn of_equipment(&self, equipment: usize) -> &[u32] {
        self.of_equipment.get(equipment).map_or(&[], Vec::as_slice)
    }

    /// Returns the number of pieces of equipment.
    pub fn equipment_count(&self) -> usize {
        self.of_equipment.len()
    }

    /// The last record of a piece of equipment that is not after an instant; without
    /// one, its last.
    pub fn latest(&self, equipment: usize, at: Option<i64>) -> Option<usize> {
        let own = self.of_equipment(equipment);
        let known = at.map_or(own.len(), |at| {
            own.partition_point(|&index| self.records[index as usize].unix_nanos <= at)
        });
        known.checked_sub(1).map(|last| own[last] as usize)
    }

    /// The first and the last time.
    pub fn span(&self) -> Option<[i64; 2]> {
        self.span
    }
}
