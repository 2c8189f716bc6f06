//! Report control blocks of a server: which points they bring, and what their reports have.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use busbar_plugin_sdk::LogLevel;
use iec61850_rs::proto::mms::report::Report;

use super::Server;
use crate::board::Origin;
use crate::control::{Mismatch, Outcome, Use};
use crate::convert::entry_time_of;
use crate::locate::Place;
use crate::service::{Answer, Name};

impl Server {
    /// Takes a report.
    ///
    /// # Errors
    /// In words: the server is another than it was, so all of it has to be asked anew.
    pub(crate) fn take_report(&mut self, report: &Report) -> Result<(), String> {
        let found = self.controls.iter().position(|control| control.has_sent(report));
        let Some(index) = found else { return Ok(()) };
        let control = &mut self.controls[index];
        match control.check(report) {
            Ok(()) => {}
            Err(Mismatch::Revision) => {
                let name = control.block.reference();
                return Err(format!("the data set of {name} has changed (ConfRev)"));
            }
            Err(Mismatch::Members { told, sent }) => {
                control.give_up(None);
                let what = format!("it reports {sent} members, and its data set has {told}");
                self.warn_of(index, &format!("{what}; its values are polled"));
                return Ok(());
            }
        }
        let noted = control.note(report);
        for entry in &report.entries {
            for Use { point, share } in control.uses.get(entry.index).into_iter().flatten() {
                self.board.take(*point, share, &entry.value);
            }
        }
        let is_change = report.entries.iter().any(|entry| {
            entry.reason.is_none_or(|reason| {
                reason.data_change() || reason.quality_change() || reason.data_update()
            })
        });
        let entry_time = report.time_of_entry.and_then(entry_time_of);
        self.board.commit(Origin { is_change, is_replayed: noted.is_replayed, entry_time });
        if noted.is_lossy {
            self.warn_of(index, "its buffer ran over, so changes are missing");
        }
        Ok(())
    }

    pub(super) fn take_step(&mut self, index: usize, answer: Answer, now: Instant) {
        let outcome = self.controls[index].heed(answer, now);
        let is_taken = self.controls[index].identity().is_some_and(|identity| {
            self.controls[..index].iter().any(|other| other.identity() == Some(identity))
        });
        if is_taken {
            self.controls[index].give_up(None);
            let what = "it has the RptID and data set of another block: give it a RptID of its own";
            return self.warn_of(index, &format!("{what}; its values are polled"));
        }
        match outcome {
            Outcome::Going => {}
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
            Outcome::Lacking(what) => self.tell_of(index, LogLevel::Info, &what),
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
        if control.is_news(what) {
            self.board.log(level, &format!("{}: {what}", control.block.reference()));
        }
    }

    fn read_all_of(&mut self, index: usize) {
        let uses = self.controls[index].uses.iter().flatten();
        let points: BTreeSet<_> = uses.map(|used| used.point).collect();
        let is_of_it = |&index: &usize| {
            self.variables[index].points.iter().any(|(point, _)| points.contains(point))
        };
        let variables: Vec<_> = (0..self.variables.len()).filter(is_of_it).collect();
        self.queue_reads(&variables);
    }

    /// What a member of a data set is to the points.
    fn uses_of(&self, member: Option<&Name>) -> Vec<Use> {
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
                Some(Use { point, share })
            })
            .collect()
    }

    /// By point: whether reports bring its value, and its quality if it has one.
    pub(super) fn reported(&self) -> Vec<bool> {
        let mut reported = vec![false; self.places.len()];
        for control in self.controls.iter().filter(|control| control.is_running()) {
            let mut found: BTreeMap<usize, [bool; 2]> = BTreeMap::new();
            for Use { point, share } in control.uses.iter().flatten() {
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
