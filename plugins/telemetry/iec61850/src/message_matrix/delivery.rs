//! Arrival of messages: what a report or an answer says, what is missing before it, and its
//! bytes.

use busbar_plugin_sdk::testing::TruthMoment;
use iec61850_rs::proto::data::Value;
use iec61850_rs::proto::mms::report::Report;
use iec61850_rs::proto::mms::{Mms, ObjectName, Unconfirmed, VariableAccess};

use super::device::{BLOCKS, access_result};
use super::report_block::Outgoing;
use super::{Matrix, Message, tags_of};

/// Encoded members of a message; a code stands for one that cannot be read.
pub(super) type Members = Vec<Result<Vec<u8>, i64>>;

impl Matrix {
    /// Tells whether several blocks may have sent a report.
    pub(super) fn is_ambiguous(&self, report: &Report) -> bool {
        let senders = self.link.server.controls().iter().filter(|control| control.is_enabled());
        self.device.quirks.shares_id && report.data_set.is_none() && senders.count() > 1
    }

    /// A report of a block, or a segment of it, does not arrive as it is.
    pub(super) fn lose(&mut self, block: usize, moment: TruthMoment) {
        self.arrivals[block].is_run_whole = false;
        self.note_lost(block, moment);
    }

    pub(super) fn note_lost(&mut self, block: usize, moment: TruthMoment) {
        let lost = &mut self.arrivals[block].lost;
        *lost = (*lost).max(Some(moment));
    }

    /// Delivers a message as it is.
    pub(super) fn deliver(&mut self, message: Message) {
        match message {
            Message::Report { outgoing, is_later_segment, is_last } => {
                self.note_arrival(&outgoing, is_later_segment, is_last);
                self.send_members(&members_of(&outgoing.report));
            }
            Message::Answer { reply, asked, moment, .. } => {
                // What was reported meanwhile may be newer.
                let reported = self.reported;
                let is_certain = |object: usize| reported[object] <= asked;
                for (object, _) in reply.told.iter().filter(|(object, _)| is_certain(*object)) {
                    self.oracle.note_late_message(*object as u32, moment);
                }
                if let Some(object) = reply.failed.filter(|object| is_certain(*object)) {
                    self.oracle.note_late_sign([object as u32], "it cannot be read", moment);
                }
                self.send_pdu(&reply.pdu);
            }
        }
    }

    /// Notes what a report says that arrives, or what is missing before it.
    fn note_arrival(&mut self, outgoing: &Outgoing, is_later_segment: bool, is_last: bool) {
        let Outgoing { block, report, told, is_answer, .. } = outgoing;
        let (block, moment) = (*block, moment_of(outgoing));
        self.reports += 1;
        if self.is_ambiguous(report) {
            if is_last {
                self.sign_by_id(block, "a report of one block or another", moment);
            }
            return;
        }
        let arrivals = &mut self.arrivals[block];
        arrivals.is_run_whole |= !is_later_segment;
        if !arrivals.is_run_whole {
            return self.sign_by_id(block, "a segment is missing", moment);
        }
        if !is_last {
            return;
        }
        let last_number = self.device.quirks.last_number;
        let follows = |last: u32| if last == last_number { 0 } else { last + 1 };
        let expected = arrivals.number.map(follows);
        arrivals.number = report.seq_num;
        let is_gap = expected.is_some_and(|expected| report.seq_num != Some(expected));
        let lost = arrivals.lost.take().unwrap_or(moment);
        if is_gap {
            return self.sign([block], "a gap of numbers", lost);
        }
        for (object, _) in told {
            self.reported[*object] = self.reports;
        }
        // Values of the past count by their own times.
        let is_past = self.link.server.controls()[block].is_replaying() && !is_answer;
        if is_past || !self.link.server.controls()[block].is_reporting() {
            return;
        }
        if report.buf_ovfl == Some(true) {
            self.sign([block], "the buffer ran over", moment);
        }
        for (object, _) in told {
            self.oracle.note_late_message(*object as u32, moment);
        }
    }

    pub(super) fn sign_by_id(&mut self, block: usize, sign: &str, moment: TruthMoment) {
        match self.device.quirks.shares_id {
            true => self.sign_all(sign, moment),
            false => self.sign([block], sign, moment),
        }
    }

    pub(super) fn sign_all(&mut self, sign: &str, moment: TruthMoment) {
        self.sign(0..BLOCKS, sign, moment);
    }

    /// Notes that something of these blocks cannot be used; those that the client left alone
    /// are polled.
    pub(super) fn sign(
        &mut self,
        blocks: impl IntoIterator<Item = usize>,
        sign: &str,
        moment: TruthMoment,
    ) {
        let server = &self.link.server;
        let reporting: Vec<_> =
            blocks.into_iter().filter(|b| server.controls()[*b].is_reporting()).collect();
        self.note_sign(tags_of(reporting), sign, moment);
    }

    pub(super) fn note_sign(
        &mut self,
        tags: impl IntoIterator<Item = u32>,
        sign: &str,
        moment: TruthMoment,
    ) {
        self.reports += 1;
        let tags: Vec<_> = tags.into_iter().collect();
        for tag in &tags {
            self.reported[*tag as usize] = self.reports;
        }
        if !tags.is_empty() {
            self.oracle.note_late_sign(tags, sign, moment);
        }
    }

    pub(super) fn send_members(&mut self, members: &Members) {
        self.send_pdu(&information_report(members));
    }

    pub(super) fn send_pdu(&mut self, pdu: &[u8]) {
        if self.session.is_some() {
            self.peer.send_encoded(pdu).expect("the association is there");
            self.transmit();
        }
    }
}

pub(super) fn moment_of(outgoing: &Outgoing) -> TruthMoment {
    outgoing.moment.expect("it is dated when it is sent")
}

pub(super) fn encoded(value: &Value) -> Vec<u8> {
    Value::encode_all(std::slice::from_ref(value)).expect("it can be encoded")
}

pub(super) fn members_of(report: &Report) -> Members {
    let values = report.to_values().expect("a whole report");
    values.iter().map(|value| Ok(encoded(value))).collect()
}

pub(super) fn information_report(members: &Members) -> Vec<u8> {
    let results = members.iter().map(|member| access_result(member.as_ref())).collect();
    let access = VariableAccess::VariableListName(ObjectName::VmdSpecific("RPT"));
    let report = Mms::Unconfirmed(Unconfirmed::InformationReport { access, results });
    report.to_vec().expect("it can be encoded")
}
