//! The rows of one answer -> samples of the tags that asked.

use std::borrow::Cow;
use std::collections::HashMap;
use std::time::SystemTime;

use busbar_plugin_sdk::{Quality, Reason, Sample};
use thiserror::Error;

use crate::cell::{Cell, Row};
use crate::convert::{Reading, TimeRules};
use crate::points::{Columns, Points, Shape};

/// Rows of one answer.
pub(crate) const MAX_ROWS: usize = 100_000;
/// Columns that a message names.
const MAX_COLUMNS_IN_MESSAGE: usize = 20;

/// Columns of an answer with rows of keys.
const KEY: &str = "key";
const VALUE: &str = "value";
const QUALITY: &str = "quality";
const TIME: &str = "time";
const UNIT: &str = "unit";

/// Fault of a query that gave nothing for any of its tags.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub(crate) enum QueryFault {
    #[error("{0}")]
    Refused(String),
    #[error("{0}")]
    Unavailable(String),
    #[error("it gave more than {MAX_ROWS} rows: narrow it, or use several queries")]
    TooManyRows,
    #[error("it gave several rows, but its tags name columns: select one row, as by LIMIT 1")]
    SeveralRows,
    #[error("it gave no row")]
    NoRow,
    #[error("its answer lacks the column '{name}', which rows of keys need; it has {found}")]
    NoColumn { name: &'static str, found: String },
}

impl QueryFault {
    /// Returns the reason for the query's tags.
    pub(crate) fn reason(&self) -> Reason {
        match self {
            Self::Unavailable(_) => Reason::Communication,
            Self::NoRow => Reason::Sensor,
            _ => Reason::Configuration,
        }
    }
}

/// Samples of one answer for the tags of its query.
pub(crate) struct Answer<'a> {
    points: &'a Points,
    rules: TimeRules,
    places: Places<'a>,
    columns: String,
    rows: usize,
    /// Fault of the key of a row that may be of any tag.
    unassigned: Option<String>,
    /// Samples found, by point.
    found: Vec<Option<FoundSample>>,
}

/// One for each tag, in order, and what is wrong with it.
pub(crate) type Samples = Vec<(Sample, Option<String>)>;

struct FoundSample {
    sample: Sample,
    remark: Option<String>,
    /// Reports whether rows of the same key contradict each other.
    is_ambiguous: bool,
}

/// Columns of the values in a row.
enum Places<'a> {
    Nowhere,
    Wide(Vec<Result<ColumnsOfTag, String>>),
    Long { by_key: &'a HashMap<String, Vec<usize>>, key: usize, columns: ColumnsOfTag },
}

#[derive(Clone, Copy)]
struct ColumnsOfTag {
    value: usize,
    quality: Option<usize>,
    time: Option<usize>,
    unit: Option<usize>,
}

impl ColumnsOfTag {
    fn read<'r>(&self, row: &'r dyn Row) -> Reading<'r> {
        Reading {
            value: row.cell(self.value),
            quality: self.quality.map(|column| row.cell(column)),
            time: self.time.map(|column| row.cell(column)),
            unit: self.unit.map(|column| row.cell(column)),
        }
    }
}

impl<'a> Answer<'a> {
    /// Before the first row; `names` are those of the columns.
    ///
    /// # Errors
    /// [`QueryFault::NoColumn`].
    pub(crate) fn begin(
        points: &'a Points,
        names: &[&str],
        rules: &TimeRules,
    ) -> Result<Self, QueryFault> {
        let columns = list(names);
        let places = match &points.shape {
            Shape::Unused => Places::Nowhere,
            Shape::Wide(of_tags) => {
                Places::Wide(of_tags.iter().map(|of_tag| find_all(of_tag, names)).collect())
            }
            Shape::Long(by_key) => {
                let find = |name| {
                    let found = columns.clone();
                    find(name, names).map_err(|_| QueryFault::NoColumn { name, found })
                };
                let optional = |name| names.contains(&name).then(|| find(name)).transpose();
                let (quality, time, unit) = (optional(QUALITY)?, optional(TIME)?, optional(UNIT)?);
                let columns = ColumnsOfTag { value: find(VALUE)?, quality, time, unit };
                Places::Long { by_key, key: find(KEY)?, columns }
            }
        };
        let found = points.all.iter().map(|_| None).collect();
        let rules = rules.clone();
        Ok(Self { points, rules, places, columns, rows: 0, unassigned: None, found })
    }

    /// Takes the next row.
    ///
    /// # Errors
    /// [`QueryFault`] when there are too many: the answer is then worth nothing.
    pub(crate) fn take(&mut self, row: &dyn Row) -> Result<(), QueryFault> {
        self.rows += 1;
        if self.rows > MAX_ROWS {
            return Err(QueryFault::TooManyRows);
        }
        match &self.places {
            Places::Nowhere => {}
            Places::Wide(_) if self.rows > 1 => return Err(QueryFault::SeveralRows),
            Places::Wide(columns) => {
                for (index, columns) in columns.iter().enumerate() {
                    let (sample, remark) = match columns {
                        Ok(columns) => {
                            columns.read(row).sample(&self.points.all[index], &self.rules)
                        }
                        Err(what) => (
                            Sample::bad(self.points.all[index].tag, Reason::Configuration),
                            Some(format!("{what}; the query has {}", self.columns)),
                        ),
                    };
                    self.found[index] = Some(FoundSample { sample, remark, is_ambiguous: false });
                }
            }
            Places::Long { by_key, key, columns } => {
                let key = match row.cell(*key) {
                    Cell::Text(text) => text,
                    Cell::Int(number) => Cow::from(number.to_string()),
                    unusable @ (Cell::Unusable(_) | Cell::NotUtf8(_)) => {
                        self.unassigned.get_or_insert_with(|| {
                            format!("the key of a row is {}", unusable.name())
                        });
                        return Ok(());
                    }
                    // No tag can have asked for it.
                    _ => return Ok(()),
                };
                for &index in by_key.get(&*key).into_iter().flatten() {
                    let (sample, remark) =
                        columns.read(row).sample(&self.points.all[index], &self.rules);
                    merge(&mut self.found[index], sample, remark);
                }
            }
        }
        Ok(())
    }

    /// After the last row.
    ///
    /// # Errors
    /// [`QueryFault::NoRow`].
    pub(crate) fn finish(self) -> Result<Samples, QueryFault> {
        if self.rows == 0 && matches!(self.places, Places::Wide(_)) {
            return Err(QueryFault::NoRow);
        }
        let outcome = |(point, found): (_, Option<FoundSample>)| {
            let point: &crate::points::Point = point;
            match found {
                None => {
                    let remark = "no row has its key".to_owned();
                    (Sample::bad(point.tag, Reason::Sensor), Some(remark))
                }
                Some(FoundSample { is_ambiguous: true, .. }) => {
                    let remark = "several rows have its key, and their times do not tell which \
                                  is the newest: select one row a key, or give `time`";
                    (Sample::bad(point.tag, Reason::Configuration), Some(remark.to_owned()))
                }
                Some(FoundSample { sample, remark, .. }) => match &self.unassigned {
                    // The row may be one of this tag, and newer.
                    Some(what) if sample.quality.is_good() => {
                        let quality = Quality::Uncertain(Reason::Configuration);
                        (Sample { quality, ..sample }, Some(what.clone()))
                    }
                    _ => (sample, remark),
                },
            }
        };
        Ok(self.points.all.iter().zip(self.found).map(outcome).collect())
    }
}

/// Merges two rows of one key: the newer one counts.
fn merge(found: &mut Option<FoundSample>, sample: Sample, remark: Option<String>) {
    let new = FoundSample { sample, remark, is_ambiguous: false };
    let time = |found: &FoundSample| -> Option<SystemTime> { found.sample.source_time };
    match found {
        None => *found = Some(new),
        Some(old) => match (time(old), time(&new)) {
            (Some(before), Some(after)) if after > before => *old = new,
            (Some(before), Some(after)) if after < before => {}
            _ => old.is_ambiguous = true,
        },
    }
}

fn find_all(columns: &Columns, names: &[&str]) -> Result<ColumnsOfTag, String> {
    let optional = |name: &Option<String>| name.as_deref().map(|n| find(n, names)).transpose();
    Ok(ColumnsOfTag {
        value: find(&columns.value, names)?,
        quality: optional(&columns.quality)?,
        time: optional(&columns.time)?,
        unit: optional(&columns.unit)?,
    })
}

fn find(name: &str, names: &[&str]) -> Result<usize, String> {
    let mut places = names.iter().enumerate().filter(|(_, other)| **other == name);
    match (places.next(), places.next()) {
        (Some((index, _)), None) => Ok(index),
        (None, _) => Err(format!("there is no column '{name}'")),
        (Some(_), Some(_)) => Err(format!("there are several columns '{name}'")),
    }
}

fn list(names: &[&str]) -> String {
    let named = &names[..names.len().min(MAX_COLUMNS_IN_MESSAGE)];
    let more = names.len() - named.len();
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("'{}'{rest}", named.join("', '"))
}

#[cfg(test)]
#[path = "answer_tests.rs"]
mod tests;
