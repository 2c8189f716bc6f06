//! Model of a report control block, buffered or not (IEC 61850-7-2, 17.2).

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::testing::TruthMoment;
use iec61850_rs::common::{EntryTime, OptFlds, ReasonCode, TrgOps};
use iec61850_rs::proto::data::Value;
use iec61850_rs::proto::mms::report::{Report, ReportEntry};

use super::device::{
    DOMAIN, Device, OBJECTS, OBJECTS_A_BLOCK, Object, ServerQuirks, change_of, object_item,
};

/// Entries that a buffer holds.
const MAX_ENTRIES: usize = 8;

/// Part of an object that a member of a data set has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Whole,
    Value,
    Quality,
    Time,
}

/// Instant by the oracle and the calendar.
#[derive(Clone, Copy)]
pub(super) struct Instants {
    /// By the model's clock.
    pub(super) now: Duration,
    /// Time by the calendar.
    pub(super) wall: SystemTime,
    /// By the oracle, before the last change of an object.
    pub(super) before: TruthMoment,
}

/// An entry of a report: members, and why each is there.
#[derive(Clone)]
struct Entry {
    id: u64,
    at: SystemTime,
    members: Vec<(usize, Value, ReasonCode)>,
    /// Objects of which it says all, with the revisions of their values.
    told: Vec<(usize, u64)>,
    /// Marks an entry that follows lost entries.
    is_overflow: bool,
    /// Instant at which the entry was made; nothing until the oracle knows the change.
    moment: Option<TruthMoment>,
}

/// A report on its way.
#[derive(Clone)]
pub(super) struct Outgoing {
    pub(super) block: usize,
    pub(super) report: Report,
    pub(super) told: Vec<(usize, u64)>,
    /// Marks a report that may be taken for the answer to an interrogation.
    pub(super) is_answer: bool,
    /// Instant at which the report was made; nothing until the oracle knows the change.
    pub(super) moment: Option<TruthMoment>,
}

pub(super) struct ModelBlock {
    index: usize,
    item: String,
    id: String,
    /// Name of its data set.
    pub(super) set: String,
    pub(super) members: Vec<(usize, Part)>,
    pub(super) is_buffered: bool,
    pub(super) is_enabled: bool,
    pub(super) options: OptFlds,
    triggers: TrgOps,
    integrity: Duration,
    buffer_time: Duration,
    last_number: u32,
    sequence: u32,
    pub(super) revision: u32,
    /// Entries that were not sent, and some that were.
    entries: VecDeque<Entry>,
    next_entry: u64,
    /// The next entry to send.
    cursor: u64,
    is_overflown: bool,
    /// Changes that are gathered, by member, until an instant.
    pending: BTreeMap<usize, (Value, ReasonCode)>,
    pending_until: Duration,
    next_integrity: Duration,
}

impl ModelBlock {
    pub(super) fn new(index: usize, quirks: &ServerQuirks) -> Self {
        let first = index * OBJECTS_A_BLOCK;
        let objects = first..first + OBJECTS_A_BLOCK;
        let members = match index {
            // Parts as members of their own.
            1 => objects
                .flat_map(|object| [Part::Value, Part::Quality, Part::Time].map(|p| (object, p)))
                .collect(),
            _ => objects.map(|object| (object, Part::Whole)).collect(),
        };
        let is_buffered = index == 0;
        let (kind, letter) = if is_buffered { ("BR", 'b') } else { ("RP", 'u') };
        let id = if quirks.shares_id { "Events".into() } else { format!("Events{index}") };
        let options = OptFlds::NONE
            .with_sequence_number(quirks.has_numbers)
            .with_report_time_stamp(true)
            .with_reason_for_inclusion(quirks.has_reasons)
            .with_data_set_name(quirks.names_data_sets)
            .with_buffer_overflow(is_buffered)
            .with_entry_id(is_buffered)
            .with_conf_revision(true);
        Self {
            index,
            item: format!("LLN0${kind}${letter}{index}"),
            id,
            set: format!("LLN0$ds{index}"),
            members,
            is_buffered,
            is_enabled: false,
            options,
            triggers: TrgOps::EVENTS,
            integrity: quirks.integrity,
            buffer_time: quirks.buffer_time,
            last_number: quirks.last_number,
            sequence: 0,
            revision: 1,
            entries: VecDeque::new(),
            next_entry: 1,
            cursor: 1,
            is_overflown: false,
            pending: BTreeMap::new(),
            pending_until: Duration::ZERO,
            next_integrity: Duration::ZERO,
        }
    }

    /// Returns the attribute of the block that an item names.
    pub(super) fn attribute<'n>(&self, item: &'n str) -> Option<&'n str> {
        item.strip_prefix(self.item.as_str())?.strip_prefix('$')
    }

    pub(super) fn member_items(&self) -> Vec<String> {
        let item = |&(object, part): &(usize, Part)| match part {
            Part::Whole => object_item(object),
            Part::Value => format!("{}$stVal", object_item(object)),
            Part::Quality => format!("{}$q", object_item(object)),
            Part::Time => format!("{}$t", object_item(object)),
        };
        self.members.iter().map(item).collect()
    }

    pub(super) fn read(&self, attribute: &str) -> Option<Value> {
        Some(match attribute {
            "RptID" => Value::VisibleString(self.id.clone()),
            "RptEna" => Value::Boolean(self.is_enabled),
            "DatSet" => Value::VisibleString(format!("{DOMAIN}/{}", self.set)),
            "OptFlds" => self.options.to_value(),
            "TrgOps" => self.triggers.to_value(),
            "IntgPd" => Value::Unsigned(self.integrity.as_millis() as u64),
            "BufTm" => Value::Unsigned(self.buffer_time.as_millis() as u64),
            _ => return None,
        })
    }

    /// Takes what is written; whether it may be.
    pub(super) fn write(
        &mut self,
        attribute: &str,
        value: &Value,
        objects: &[Object; OBJECTS],
        at: Instants,
        reports: &mut Vec<Outgoing>,
    ) -> bool {
        match attribute {
            "Resv" => {}
            "OptFlds" => self.options = OptFlds::from_value(value).expect("options"),
            "TrgOps" => self.triggers = TrgOps::from_value(value).expect("triggers"),
            "EntryID" => {
                let Value::OctetString(id) = value else { return false };
                let id = id.as_slice().try_into().map_or(u64::MAX, u64::from_be_bytes);
                if !self.entries.iter().any(|entry| entry.id == id) {
                    return false;
                }
                self.cursor = id + 1;
            }
            "RptEna" => {
                self.is_enabled = true;
                (self.sequence, self.next_integrity) = (0, at.now + self.integrity);
                self.send(reports);
            }
            "GI" => {
                self.flush(objects, at, reports);
                self.tell_all(
                    ReasonCode::NONE.with_general_interrogation(true),
                    objects,
                    at,
                    reports,
                );
            }
            _ => return false,
        }
        true
    }

    /// Gives entries that were just made their instant.
    pub(super) fn date(&mut self, moment: TruthMoment) {
        for entry in &mut self.entries {
            entry.moment.get_or_insert(moment);
        }
    }

    pub(super) fn disable(&mut self) {
        self.is_enabled = false;
        if !self.is_buffered {
            self.pending.clear();
        }
    }

    /// Takes notice of a change of an object.
    pub(super) fn note_change(
        &mut self,
        objects: &[Object; OBJECTS],
        object: usize,
        parts: &[Part],
        at: Instants,
        reports: &mut Vec<Outgoing>,
    ) {
        if !self.is_enabled && !self.is_buffered {
            return;
        }
        let is_concerned = |&(of, part): &(usize, Part)| {
            of == object && (part == Part::Whole || part == Part::Time || parts.contains(&part))
        };
        let changed: Vec<_> =
            (0..self.members.len()).filter(|index| is_concerned(&self.members[*index])).collect();
        // What changes again while it is gathered is reported first.
        let is_gathered = |&(of, _): &(usize, Part)| of == object;
        if self.pending.keys().any(|index| is_gathered(&self.members[*index])) {
            // As it was before this change.
            self.flush_before(objects, object, at, reports);
        }
        if changed.is_empty() {
            return;
        }
        if self.pending.is_empty() {
            self.pending_until = at.now + self.buffer_time;
        }
        for index in changed {
            let (object, part) = self.members[index];
            let value = Device::value(objects, object, part);
            self.pending.insert(index, (value, change_of(parts)));
        }
        if self.buffer_time.is_zero() {
            self.flush(objects, at, reports);
        }
    }

    pub(super) fn tick(
        &mut self,
        objects: &[Object; OBJECTS],
        at: Instants,
        reports: &mut Vec<Outgoing>,
    ) {
        if self.pending_until <= at.now {
            self.flush(objects, at, reports);
        }
        let is_due = !self.integrity.is_zero() && self.next_integrity <= at.now;
        if self.is_enabled && is_due {
            self.next_integrity = at.now + self.integrity;
            self.flush(objects, at, reports);
            self.tell_all(ReasonCode::NONE.with_integrity(true), objects, at, reports);
        }
    }

    /// Makes an entry of what is gathered.
    fn flush(&mut self, objects: &[Object; OBJECTS], at: Instants, reports: &mut Vec<Outgoing>) {
        self.flush_before(objects, OBJECTS, at, reports);
    }

    /// The same, where an object has a newer value already.
    fn flush_before(
        &mut self,
        objects: &[Object; OBJECTS],
        newer: usize,
        at: Instants,
        reports: &mut Vec<Outgoing>,
    ) {
        let pending = std::mem::take(&mut self.pending);
        let mut told: Vec<_> = pending
            .keys()
            .map(|index| self.members[*index].0)
            .map(|object| (object, objects[object].revision - u64::from(object == newer)))
            .collect();
        told.dedup();
        let members = pending.into_iter().map(|(index, (value, reason))| (index, value, reason));
        let moment = (newer < OBJECTS).then_some(at.before);
        self.enter(members.collect(), told, moment, at, reports);
    }

    fn tell_all(
        &mut self,
        reason: ReasonCode,
        objects: &[Object; OBJECTS],
        at: Instants,
        reports: &mut Vec<Outgoing>,
    ) {
        let member = |(index, &(object, part)): (usize, &(usize, Part))| {
            (index, Device::value(objects, object, part), reason)
        };
        let members: Vec<_> = self.members.iter().enumerate().map(member).collect();
        let first = self.index * OBJECTS_A_BLOCK;
        let told = (first..first + OBJECTS_A_BLOCK).map(|o| (o, objects[o].revision)).collect();
        self.enter(members, told, None, at, reports);
    }

    fn enter(
        &mut self,
        members: Vec<(usize, Value, ReasonCode)>,
        told: Vec<(usize, u64)>,
        moment: Option<TruthMoment>,
        at: Instants,
        reports: &mut Vec<Outgoing>,
    ) {
        if members.is_empty() {
            return;
        }
        if self.entries.len() == MAX_ENTRIES
            && self.entries.pop_front().is_some_and(|gone| gone.id >= self.cursor)
        {
            self.is_overflown = true;
        }
        let is_overflow = false;
        let entry = Entry { id: self.next_entry, at: at.wall, members, told, is_overflow, moment };
        self.next_entry += 1;
        self.entries.push_back(entry);
        self.send(reports);
    }

    /// Sends the entries that were not sent, where it is enabled.
    fn send(&mut self, reports: &mut Vec<Outgoing>) {
        if !self.is_enabled {
            if !self.is_buffered {
                self.entries.clear();
            }
            return;
        }
        let unsent: Vec<_> =
            self.entries.iter().filter(|entry| entry.id >= self.cursor).cloned().collect();
        self.cursor = self.next_entry;
        for mut entry in unsent {
            entry.is_overflow = std::mem::take(&mut self.is_overflown);
            let report = self.report(&entry);
            let is_answer = entry.members.iter().any(|(.., reason)| reason.general_interrogation());
            let is_whole = entry.members.len() == self.members.len();
            let has_reasons = self.options.reason_for_inclusion();
            let is_answer = if has_reasons { is_answer } else { is_whole };
            let Entry { told, moment, .. } = entry;
            reports.push(Outgoing { block: self.index, report, told, is_answer, moment });
        }
    }

    /// Has entries lost that were not sent, as a buffer that ran over.
    pub(super) fn overflow(&mut self) {
        self.is_overflown = true;
        self.pending.clear();
    }

    fn report(&mut self, entry: &Entry) -> Report {
        let options = self.options;
        let since = entry.at.duration_since(UNIX_EPOCH).unwrap_or_default();
        let members: Vec<_> = entry.members.iter().map(|(index, ..)| *index).collect();
        let number = self.sequence;
        self.sequence = if number == self.last_number { 0 } else { number + 1 };
        let entry_of = |(index, value, reason): &(usize, Value, ReasonCode)| ReportEntry {
            index: *index,
            reference: None,
            value: value.clone(),
            reason: options.reason_for_inclusion().then_some(*reason),
        };
        Report {
            rpt_id: self.id.clone(),
            opt_flds: options,
            seq_num: options.sequence_number().then_some(number),
            time_of_entry: options
                .report_time_stamp()
                .then(|| EntryTime::from_unix_millis(since.as_millis() as u64)),
            data_set: options.data_set_name().then(|| format!("{DOMAIN}/{}", self.set)),
            buf_ovfl: options.buffer_overflow().then_some(entry.is_overflow),
            entry_id: options.entry_id().then(|| entry.id.to_be_bytes().to_vec()),
            conf_rev: options.conf_revision().then_some(self.revision),
            sub_seq_num: None,
            more_segments_follow: false,
            inclusion: Report::inclusion_for(self.members.len(), &members),
            entries: entry.members.iter().map(entry_of).collect(),
        }
    }
}

/// Splits a report into segments of one member, or two.
pub(super) fn segments(report: &Report) -> Vec<Report> {
    let parts: Vec<_> = report.entries.chunks(2).collect();
    let count = parts.len();
    let total = report.data_set_len();
    let segment = |(index, entries): (usize, &[ReportEntry])| {
        let members: Vec<_> = entries.iter().map(|entry| entry.index).collect();
        Report {
            opt_flds: report.opt_flds.with_segmentation(true),
            sub_seq_num: Some(index as u32),
            more_segments_follow: index + 1 < count,
            inclusion: Report::inclusion_for(total, &members),
            entries: entries.to_vec(),
            ..report.clone()
        }
    };
    parts.into_iter().enumerate().map(segment).collect()
}
