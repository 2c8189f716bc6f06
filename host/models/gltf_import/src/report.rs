//! Import report: welding counts and skipped content, for the log.

use std::borrow::Cow;
use std::collections::BTreeMap;

use busbar_geometry::WeldReport;

use crate::limits::MAX_NOTES;

/// Report of an import, with everything that was left out.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ImportReport {
    /// One per mesh of the model, in order.
    pub meshes: Vec<WeldReport>,
    /// Notes about skipped content, as plain sentences.
    pub notes: Vec<String>,
}

/// Remarks, counted by their text.
#[derive(Default)]
pub(crate) struct Notes {
    counts: BTreeMap<Cow<'static, str>, u64>,
}

impl Notes {
    /// Adds a remark, which completes "n x ...".
    pub(crate) fn add(&mut self, remark: impl Into<Cow<'static, str>>) {
        self.add_many(remark, 1);
    }

    pub(crate) fn add_many(&mut self, remark: impl Into<Cow<'static, str>>, count: usize) {
        let remark = remark.into();
        if count > 0 && (self.counts.len() < MAX_NOTES || self.counts.contains_key(&remark)) {
            *self.counts.entry(remark).or_default() += count as u64;
        }
    }

    pub(crate) fn into_sentences(self) -> Vec<String> {
        self.counts.into_iter().map(|(remark, count)| format!("{count} x {remark}")).collect()
    }
}
