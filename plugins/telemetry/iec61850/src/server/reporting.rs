//! Report control blocks of a server: which points they bring, and what their reports have.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use busbar_plugin_sdk::LogLevel;
use iec61850_rs::proto::mms::report::Report;

use super::Server;
use crate::control::{Control, MemberUse, Mismatch, Outcome};
use crate::convert::entry_time_of;
use crate::locate::Place;
use crate::point_states::Origin;
use crate::report_reader::Unusable;
use crate::service::{Answer, Name};

/// Reason for which a block is given up after several unusable reports in a row.
const REPEATED_FAULTS: &str = "its reports cannot be used again and again";

impl Server {
    /// Processes a report of the server.
    ///
    /// # Errors
    /// In words: the server is another than it was, so all of it has to be asked anew.
    pub(crate) fn take_report(&mut self, report: &Report, now: Instant) -> Result<(), String> {
        let owners = self.indices_of(|control| control.has_sent(report));
        let Some(index) = owners.iter().copied().find(|i| self.controls[*i].is_reporting()) else {
            // One that was given up goes on reporting, and its values are polled.
            if owners.is_empty() {
                self.note_stray(report, now);
            }
            return Ok(());
        };
        // One that was given up may still send.
        let is_sender = |index: &&usize| self.controls[**index].is_enabled();
        if report.data_set.is_none() && owners.iter().filter(is_sender).count() > 1 {
            let why = "several blocks have its RptID, and it names no data set: give each block a \
                       RptID of its own";
            let report_id = Some(report.rpt_id.clone());
            self.note_unusable(&Unusable { report_id, why: why.into() }, now);
            return Ok(());
        }
        self.point_states.begin_report();
        let control = &mut self.controls[index];
        control.note_report(now);
        match control.check(report) {
            Ok(()) => {}
            Err(Mismatch::Revision) => {
                let name = control.block.reference();
                return Err(format!("{name}: {}", Mismatch::Revision));
            }
            Err(mismatch @ Mismatch::Sequence { .. }) => {
                let is_left = control.note_fault();
                self.distrust(&[index], &mismatch.to_string(), now);
                if is_left {
                    self.leave(index, REPEATED_FAULTS);
                }
                return Ok(());
            }
            Err(mismatch @ (Mismatch::Members { .. } | Mismatch::Member(_))) => {
                self.distrust(&[index], &mismatch.to_string(), now);
                self.leave(index, &mismatch.to_string());
                return Ok(());
            }
        }
        let noted = control.note(report);
        if noted.is_lossy && !noted.is_replayed {
            // The last change of anything may be among what was lost.
            self.distrust(&[index], "its buffer ran over, so changes are missing", now);
        }
        let control = &self.controls[index];
        let mut misfits = BTreeSet::new();
        for entry in &report.entries {
            for MemberUse { point, share } in control.uses.get(entry.index).into_iter().flatten() {
                if !self.point_states.take(*point, share, &entry.value) {
                    misfits.insert(*point);
                }
                self.point_states.note_reported(*point);
            }
        }
        // Perhaps it fits where it is read; nobody else would find out.
        self.rereads.extend(self.variables_of(&misfits));
        let is_change = report.entries.iter().any(|entry| {
            entry.reason.is_none_or(|reason| {
                reason.data_change() || reason.quality_change() || reason.data_update()
            })
        });
        let entry_time = report.time_of_entry.and_then(entry_time_of);
        self.point_states.commit(Origin { is_change, is_replayed: noted.is_replayed, entry_time });
        if noted.is_lossy && noted.is_replayed {
            self.warn_of(index, "its buffer ran over, so changes are missing");
        }
        Ok(())
    }

    /// Something was reported that brings no values: whatever it may have brought is bad
    /// until it is read.
    pub(crate) fn note_unusable(&mut self, unusable: &Unusable, now: Instant) {
        let Unusable { report_id, why } = unusable;
        let has_id = |control: &Control| report_id.as_ref().is_some_and(|id| control.has_id(id));
        let of_id = self.indices_of(has_id);
        let why = match report_id {
            Some(id) => format!("a report '{id}' cannot be used: {why}"),
            None => format!("a report cannot be used: {why}"),
        };
        self.doubt_reporting(of_id, &why, now);
    }

    /// A report has a RptID and a data set that no block has together: it may be of either,
    /// or of any.
    fn note_stray(&mut self, report: &Report, now: Instant) {
        let Report { rpt_id, data_set, .. } = report;
        let data_set = data_set.as_deref();
        let is_related = |control: &Control| {
            control.has_id(rpt_id) || data_set.is_some_and(|set| control.has_data_set(set))
        };
        let related = self.indices_of(is_related);
        let data_set = data_set.unwrap_or("no data set");
        let why = format!(
            "a report '{rpt_id}' cannot be used: {data_set} is not the data set of a block of \
             that RptID that was enabled"
        );
        self.doubt_reporting(related, &why, now);
    }

    /// Holds the values of those of these blocks that report for bad; without any block, of
    /// all that report.
    fn doubt_reporting(&mut self, blocks: Vec<usize>, why: &str, now: Instant) {
        let mut doubted = match blocks.is_empty() {
            true => self.indices_of(|_| true),
            false => blocks,
        };
        doubted.retain(|index| self.controls[*index].is_reporting());
        self.point_states.begin_report();
        self.distrust(&doubted, why, now);
        for index in doubted {
            self.controls[index].note_report(now);
            if self.controls[index].note_fault() {
                self.leave(index, REPEATED_FAULTS);
            }
        }
    }

    /// The report control blocks, in the order of the settings.
    #[cfg(test)]
    pub(crate) fn controls(&self) -> &[Control] {
        &self.controls
    }

    fn indices_of(&self, is_wanted: impl Fn(&Control) -> bool) -> Vec<usize> {
        (0..self.controls.len()).filter(|index| is_wanted(&self.controls[*index])).collect()
    }

    /// Holds all values of blocks for bad, and has them read.
    fn distrust(&mut self, blocks: &[usize], why: &str, now: Instant) {
        for &index in blocks {
            let points = self.points_of(index);
            for point in &points {
                self.point_states.distrust(*point);
            }
            self.rereads.extend(self.variables_of(&points));
        }
        let named = match *blocks {
            [index] => format!("{}: {why}", self.controls[index].block.reference()),
            _ => why.to_owned(),
        };
        self.notices.note(named);
        self.tell_due(now);
    }

    /// Leaves a block alone for the rest of the connection; its values are polled.
    fn leave(&mut self, index: usize, why: &str) {
        self.controls[index].abandon(None);
        self.warn_of(index, &format!("{why}; its values are polled"));
    }

    pub(super) fn take_step(&mut self, index: usize, answer: Answer, now: Instant) {
        let outcome = self.controls[index].handle_answer(answer, now);
        let is_taken = self.controls[index].identity().is_some_and(|identity| {
            self.controls[..index].iter().any(|other| other.identity() == Some(identity))
        });
        if is_taken {
            self.controls[index].abandon(None);
            let what = "it has the RptID and data set of another block: give it a RptID of its own";
            return self.warn_of(index, &format!("{what}; its values are polled"));
        }
        match outcome {
            Outcome::InProgress => {}
            Outcome::Members(members) => {
                let uses = members.iter().map(|member| self.uses_of(member.as_ref())).collect();
                self.controls[index].uses = uses;
            }
            Outcome::NotInterrogated(what) => {
                self.tell_of(index, LogLevel::Info, &format!("{what}; its values are read"));
                self.read_all_of(index);
            }
            Outcome::Failed(what) => {
                self.warn_of(
                    index,
                    &format!("{what}; its values are polled, and it is tried again"),
                );
            }
            Outcome::Degraded(what) => self.tell_of(index, LogLevel::Info, &what),
        }
    }

    pub(super) fn make_up_for_late(&mut self, now: Instant) {
        for index in 0..self.controls.len() {
            if self.controls[index].take_late(now) {
                let what = "no report answers the general interrogation; its values are read";
                self.tell_of(index, LogLevel::Info, what);
                self.read_all_of(index);
            }
        }
    }

    fn warn_of(&mut self, index: usize, what: &str) {
        self.tell_of(index, LogLevel::Warning, what);
    }

    /// Tells of a block what was not told of it just before.
    fn tell_of(&mut self, index: usize, level: LogLevel, what: &str) {
        let control = &mut self.controls[index];
        if control.has_changed(what) {
            self.point_states.log(level, &format!("{}: {what}", control.block.reference()));
        }
    }

    fn read_all_of(&mut self, index: usize) {
        let variables = self.variables_of(&self.points_of(index));
        self.queue_reads(&variables);
    }

    /// Points that a block brings.
    fn points_of(&self, index: usize) -> BTreeSet<usize> {
        self.controls[index].uses.iter().flatten().map(|used| used.point).collect()
    }

    /// Variables that have one of these points.
    fn variables_of(&self, points: &BTreeSet<usize>) -> Vec<usize> {
        let is_of_them = |&index: &usize| {
            self.variables[index].points.iter().any(|(point, _)| points.contains(point))
        };
        (0..self.variables.len()).filter(is_of_them).collect()
    }

    /// Returns the uses of a data set member by the points.
    fn uses_of(&self, member: Option<&Name>) -> Vec<MemberUse> {
        let Some(member) = member else { return Vec::new() };
        let parts: Vec<_> = member.item.split('$').collect();
        // A whole logical node has no type here: its values are polled.
        let Some((object, below)) = parts.split_at_checked(3) else { return Vec::new() };
        let object = Name { domain: member.domain.clone(), item: object.join("$") };
        let found = self.objects.binary_search_by(|(name, _)| name.cmp(&object));
        let Ok(found) = found else { return Vec::new() };
        let points = self.objects[found].1.clone();
        points
            .filter_map(|point| {
                let share = self.places[point].as_ref()?.share(below)?;
                Some(MemberUse { point, share })
            })
            .collect()
    }

    /// By point: whether reports bring its value, and its quality if it has one.
    pub(super) fn reported(&self) -> Vec<bool> {
        let mut reported = vec![false; self.places.len()];
        for control in self.controls.iter().filter(|control| control.is_running()) {
            let mut found: BTreeMap<usize, [bool; 2]> = BTreeMap::new();
            for MemberUse { point, share } in control.uses.iter().flatten() {
                let [value, quality] = found.entry(*point).or_default();
                *value |= share.value.is_some();
                *quality |= share.quality.is_some();
            }
            for (point, [value, quality]) in found {
                let has_quality = self.places[point].as_ref().is_some_and(Place::has_quality);
                reported[point] |= value && (quality || !has_quality);
            }
        }
        reported
    }
}

#[cfg(test)]
#[path = "reporting_tests.rs"]
mod tests;
