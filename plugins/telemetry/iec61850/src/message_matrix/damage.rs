//! Damage to reports and answers on their way, and the visible signs of it.

use busbar_plugin_sdk::testing::{MessageFault, TruthMoment};
use iec61850_rs::ber::Tag;
use iec61850_rs::proto::data::Value;
use iec61850_rs::proto::mms::report::{Report, ReportEntry};
use iec61850_rs::proto::mms::{ConfirmedResponse, Mms, ServiceError};

use super::delivery::{encoded, information_report, members_of, moment_of};
use super::device::{BLOCKS, DOMAIN, Reply, TEMPORARILY_UNAVAILABLE, access_result};
use super::report_block::Outgoing;
use super::{Matrix, Message};

/// A service that there is not, without confirmation.
const UNKNOWN_SERVICE: [u8; 6] = [0xA3, 0x04, 0xA9, 0x02, 0x05, 0x00];
/// Reports in segments at once, more than are gathered.
const TOO_MANY_RUNS: u32 = 10;

impl Matrix {
    /// Sends a message, with a fault or without.
    pub(super) fn send(&mut self, message: Message, is_faulty: bool) {
        let fault = if is_faulty { self.random.next_fault() } else { None };
        let mut held = self.held.take();
        // An answer does not overtake what was reported before.
        if matches!((&held, &message), (Some(Message::Report { .. }), Message::Answer { .. }))
            && let Some(held) = held.take()
        {
            self.deliver(held);
        }
        match (message, fault) {
            (message, Some(MessageFault::Reordered)) if held.is_none() && may_wait(&message) => {
                if let Message::Report { outgoing, .. } = &message {
                    self.note_lost(outgoing.block, moment_of(outgoing));
                }
                self.held = Some(message);
            }
            (Message::Report { outgoing, is_later_segment, is_last }, Some(fault)) => {
                self.send_report(outgoing, is_later_segment, is_last, fault);
            }
            (Message::Answer { id, reply, asked, moment }, Some(fault)) => {
                self.send_answer(id, reply, asked, moment, fault);
            }
            (message, None) => self.deliver(message),
        }
        if let Some(held) = held {
            self.deliver(held);
        }
    }

    fn send_answer(
        &mut self,
        id: i64,
        mut reply: Reply,
        asked: u64,
        moment: TruthMoment,
        fault: MessageFault,
    ) {
        match fault {
            MessageFault::Lost => {}
            MessageFault::Cut => {
                self.random.cut(&mut reply.pdu);
                self.send_pdu(&reply.pdu);
            }
            MessageFault::Misassigned => {
                let service = ConfirmedResponse::Write(Vec::new());
                let pdu = Mms::ConfirmedResponse { invoke_id: id ^ 0x4000_0000, service };
                self.send_pdu(&pdu.to_vec().expect("it can be encoded"));
                self.deliver(Message::Answer { id, reply, asked, moment });
            }
            // More results than were asked for.
            MessageFault::Oversized => {
                let results = std::iter::repeat_n(&TEMPORARILY_UNAVAILABLE, 100);
                let results = results.map(|code| access_result(Err(code))).collect();
                let service = ConfirmedResponse::Read { access: None, results };
                let pdu = Mms::ConfirmedResponse { invoke_id: id, service };
                self.send_pdu(&pdu.to_vec().expect("it can be encoded"));
            }
            MessageFault::Unknown if reply.is_read => {
                let error = ServiceError::encode(Tag::context_constructed(2), 3, 0);
                let error = error.expect("it can be encoded");
                let error = iec61850_rs::ber::Cursor::new(&error).next_required();
                let error = error.expect("one element");
                let pdu =
                    Mms::ConfirmedError { invoke_id: id, modifier_position: None, error }.to_vec();
                self.send_pdu(&pdu.expect("it can be encoded"));
            }
            MessageFault::Duplicated => {
                let again = reply.pdu.clone();
                self.deliver(Message::Answer { id, reply, asked, moment });
                self.send_pdu(&again);
            }
            MessageFault::Unknown | MessageFault::Reordered => {
                self.deliver(Message::Answer { id, reply, asked, moment });
            }
        }
    }

    fn send_report(&mut self, sent: Outgoing, is_later: bool, is_last: bool, fault: MessageFault) {
        let (block, report, moment) = (sent.block, sent.report.clone(), moment_of(&sent));
        let is_single = !is_later && is_last;
        let is_numbered = report.seq_num.is_some();
        match fault {
            MessageFault::Lost if is_numbered => self.lose(block, moment),
            MessageFault::Cut if self.random.one_in(4) => {
                let mut pdu = information_report(&members_of(&report));
                self.random.cut(&mut pdu);
                self.send_pdu(&pdu);
                self.lose(block, moment);
            }
            MessageFault::Cut => {
                let mut members = members_of(&report);
                let length = self.random.below(members.len());
                members.truncate(length);
                match length {
                    0 => self.sign_all("a report without members", moment),
                    _ => self.sign_by_id(block, "a report that ends early", moment),
                }
                self.send_members(&members);
                self.lose(block, moment);
            }
            MessageFault::Oversized if self.random.one_in(10) => {
                self.sign_all("too many reports in segments", moment);
                for number in 0..TOO_MANY_RUNS {
                    let rpt_id = format!("Flood{number}");
                    let opt_flds = report.opt_flds.with_segmentation(true);
                    let (sub_seq_num, more_segments_follow) = (Some(0), true);
                    let part = Report {
                        rpt_id,
                        opt_flds,
                        sub_seq_num,
                        more_segments_follow,
                        ..report.clone()
                    };
                    self.send_members(&members_of(&part));
                }
                self.lose(block, moment);
            }
            MessageFault::Oversized if is_single && !self.is_ambiguous(&report) => {
                let members: Vec<_> = report.entries.iter().map(|entry| entry.index).collect();
                let inclusion = Report::inclusion_for(report.data_set_len() + 8, &members);
                self.sign([block], "more members than the data set has", moment);
                self.send_members(&members_of(&Report { inclusion, ..report }));
                self.lose(block, moment);
            }
            MessageFault::Unknown => self.send_unknown(sent, is_later, is_last),
            MessageFault::Misassigned => self.send_misassigned(sent, is_later, is_last),
            MessageFault::Duplicated if is_numbered => {
                let again = sent.clone();
                self.deliver(report_message(sent, is_later, is_last));
                if is_single {
                    self.deliver(report_message(again, is_later, is_last));
                } else {
                    self.sign_by_id(block, "the same segment again", moment);
                    self.send_members(&members_of(&report));
                    if is_later && !is_last {
                        self.lose(block, moment);
                    }
                }
            }
            _ => self.deliver(report_message(sent, is_later, is_last)),
        }
    }

    fn send_unknown(&mut self, sent: Outgoing, is_later: bool, is_last: bool) {
        let (block, mut report, moment) = (sent.block, sent.report.clone(), moment_of(&sent));
        let mut members = members_of(&report);
        let is_single = !is_later && is_last;
        match self.random.below(6) {
            0 => {
                let first = members.len() - report.entries.len();
                let first = first
                    - if report.opt_flds.reason_for_inclusion() { report.entries.len() } else { 0 };
                members[first] = Err(TEMPORARILY_UNAVAILABLE);
                self.sign_by_id(block, "a member that cannot be read", moment);
            }
            1 => {
                self.sign_all("a service that there is not", moment);
                self.send_pdu(&UNKNOWN_SERVICE);
                return self.lose(block, moment);
            }
            2 if is_single => {
                report.rpt_id = "Nobody".into();
                match report.data_set {
                    Some(_) => self.sign([block], "a RptID that nobody has", moment),
                    None => self.sign_all("a RptID that nobody has, and no data set", moment),
                }
                members = members_of(&report);
            }
            3 if is_single && report.data_set.is_some() => {
                report.data_set = Some(format!("{DOMAIN}/LLN0$none"));
                self.sign_by_id(block, "a data set that nobody has", moment);
                members = members_of(&report);
            }
            4 if is_single && !self.is_ambiguous(&report) => {
                let entry = &mut report.entries[0];
                entry.value = Value::Structure(vec![Value::Boolean(true)]);
                let object = self.device.blocks[block].members[entry.index].0;
                if self.link.server.controls()[block].is_reporting() {
                    self.note_sign([object as u32], "a member of another type", moment);
                }
                // The others may be right.
                self.reports += 1;
                for (object, _) in &sent.told {
                    self.reported[*object] = self.reports;
                }
                self.arrivals[block].number = report.seq_num;
                members = members_of(&report);
                return self.send_members(&members);
            }
            5 => {
                members[1] = Ok(encoded(&Value::Boolean(true)));
                self.sign_by_id(block, "no options", moment);
            }
            _ => {
                return self.deliver(report_message(sent, is_later, is_last));
            }
        }
        self.send_members(&members);
        self.lose(block, moment);
    }

    fn send_misassigned(&mut self, sent: Outgoing, is_later: bool, is_last: bool) {
        let (block, mut report, moment) = (sent.block, sent.report.clone(), moment_of(&sent));
        let other = (block + 1 + self.random.below(BLOCKS - 1)) % BLOCKS;
        let is_single = !is_later && is_last;
        let can_tell = is_single && report.data_set.is_some() && !self.device.quirks.shares_id;
        match self.random.below(3) {
            0 if can_tell => report.rpt_id = format!("Events{other}"),
            1 if can_tell => {
                report.data_set = Some(format!("{DOMAIN}/{}", self.device.blocks[other].set))
            }
            2 if is_single && !self.is_ambiguous(&report) => {
                report.opt_flds = report.opt_flds.with_data_reference(true);
                let named = |entry: ReportEntry| {
                    let reference = Some(format!("{DOMAIN}/GGIO9$ST$Obj{}", entry.index));
                    ReportEntry { reference, ..entry }
                };
                report.entries = report.entries.into_iter().map(named).collect();
                self.sign([block], "members of another data set", moment);
                self.send_members(&members_of(&report));
                return self.lose(block, moment);
            }
            _ => {
                return self.deliver(report_message(sent, is_later, is_last));
            }
        }
        self.sign([block, other], "the RptID of one block, and the data set of another", moment);
        self.send_members(&members_of(&report));
        self.lose(block, moment);
    }
}

fn report_message(outgoing: Outgoing, is_later_segment: bool, is_last: bool) -> Message {
    Message::Report { outgoing, is_later_segment, is_last }
}

/// Tells whether a message may come later than others.
fn may_wait(message: &Message) -> bool {
    match message {
        Message::Report { outgoing, is_later_segment, is_last } => {
            !is_later_segment && *is_last && outgoing.report.seq_num.is_some()
        }
        Message::Answer { .. } => true,
    }
}
