//! The station behind its connections: data units in, samples and requests out.

use std::collections::BTreeSet;
use std::time::{Instant, SystemTime};

use busbar_link::{Notice, Notices};
use busbar_plugin_sdk::{
    Host, LinkState, LogLevel, Quality, Reason, Sample, SampleFlags, SampleSink, TagSpec,
};

use crate::codec::{
    Asdu, Body, Header, Object, Objects, Request, cause, common_address_of, is_without_values,
};
use crate::convert::{name_of, origin_of, quality_of_value, value_of};
use crate::points::{Point, Points};
use crate::request_schedule::{Outcome, RequestKind, RequestSchedule, ScheduledRequest};
use crate::settings::Config;
use crate::validity::{ALL_STATIONS, EventOrder, Evidence, NO_STATION, Validity};

/// Tags that one log line names.
const MAX_TAGS_IN_MESSAGE: usize = 5;
/// Samples that are published at once.
const MAX_BATCH: usize = 4096;
/// Lines about tags whose objects are of another type.
const MAX_MISFITS_TOLD: usize = 20;

pub(crate) struct Station {
    config: Config,
    points: Points,
    sink: SampleSink,
    host: Host,
    requests: RequestSchedule,
    validity: Validity,
    /// Data units that could not be understood.
    notices: Notices,
    /// Common addresses that the station says it does not know.
    unknown_addresses: BTreeSet<u16>,
    /// By point: whether it was told that its object is of another type.
    is_misfit_told: Vec<bool>,
    misfits_told: usize,
    is_silence_told: bool,
    /// Samples of the bytes that are being read.
    batch: Vec<Sample>,
    ignored: Ignored,
}

/// Counts of what came since data transfer started and brought no value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Ignored {
    /// Objects that no tag names.
    unknown_objects: u64,
    /// Data units of types that carry no values.
    without_values: u64,
    /// Data units that could not be understood.
    not_understood: u64,
}

impl Station {
    pub(crate) fn new(config: Config, points: Points, sink: SampleSink, host: Host) -> Self {
        let requests = RequestSchedule::new(&config, points.common_addresses());
        let validity = Validity::new(&points);
        let count = points.all().len();
        Self {
            config,
            points,
            sink,
            host,
            requests,
            validity,
            notices: Notices::default(),
            unknown_addresses: BTreeSet::new(),
            is_misfit_told: vec![false; count],
            misfits_told: 0,
            is_silence_told: false,
            batch: Vec::new(),
            ignored: Ignored::default(),
        }
    }

    /// Data transfer has started, at this time of the wall clock: no tag has a value yet.
    pub(crate) fn begin(&mut self, started: SystemTime, now: Instant) {
        self.publish_all(Reason::NotConnected);
        self.validity.begin(started, self.config.interrogate_on_start);
        self.unknown_addresses.clear();
        self.is_silence_told = false;
        self.requests.begin(now);
    }

    /// Data transfer has ended.
    pub(crate) fn end(&mut self) {
        self.flush();
        self.requests.end();
        self.publish_all(Reason::Communication);
        if let Some(notice) = self.notices.take_rest() {
            self.log_notice(&notice);
        }
        self.log_ignored();
    }

    /// Says of every tag that it has no value.
    pub(crate) fn publish_all(&self, reason: Reason) {
        self.sink.publish_bad(self.points.all().iter().map(|point| point.tag), reason);
    }

    /// Takes a data unit. Its samples go with the next [`Station::flush`] at the
    /// latest.
    pub(crate) fn handle_answer(&mut self, asdu: &[u8], received: SystemTime, now: Instant) {
        let taken = match Asdu::parse(asdu) {
            Ok(Asdu { header, body }) => match body {
                Body::Objects(objects) => self.take_objects(&header, objects, received),
                Body::InitialisationEnded => {
                    self.restart(header.common_address, received);
                    Ok(())
                }
                Body::Interrogation => self.take_answer(RequestKind::Interrogation, &header, now),
                Body::CounterInterrogation => self.take_answer(RequestKind::Counters, &header, now),
                Body::ClockSync => self.take_answer(RequestKind::ClockSync, &header, now),
                Body::Other => self.take_other(header.type_id),
            },
            Err(error) => Err(error.to_string()),
        };
        if let Err(what) = taken {
            self.distrust(common_address_of(asdu), what, now);
        }
    }

    /// Publishes the samples received.
    pub(crate) fn flush(&mut self) {
        if !self.batch.is_empty() {
            self.sink.publish(&self.batch);
            self.batch.clear();
        }
    }

    /// The request to send now, as a data unit.
    pub(crate) fn next_request(
        &mut self,
        now: Instant,
        wall_clock: fn() -> SystemTime,
    ) -> Option<Vec<u8>> {
        self.tell_due(now);
        if let Some(job) = self.requests.take_late(now) {
            self.note_outcome(job, Outcome::Unanswered);
        }
        let job = self.requests.next(now)?;
        let request = match job.kind {
            RequestKind::Interrogation => Request::Interrogation,
            RequestKind::Counters => Request::Counters,
            RequestKind::ClockSync => Request::ClockSync(wall_clock(), self.config.zone),
        };
        request.to_bytes(job.common_address, self.config.originator)
    }

    /// Returns the instant at which [`Station::next_request`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.requests.deadline().into_iter().chain(self.notices.deadline()).min()
    }

    /// # Errors
    /// Description of a contradiction: the data unit cannot be understood.
    fn take_objects(
        &mut self,
        header: &Header,
        objects: Objects<'_>,
        received: SystemTime,
    ) -> Result<(), String> {
        let &Header { type_id, cause, common_address, is_test, is_negative, .. } = header;
        if is_negative {
            return Err(format!("type {type_id} as a negative confirmation"));
        }
        if !is_process_data(cause) {
            return Err(format!("type {type_id} with cause of transmission {cause}"));
        }
        if matches!(common_address, NO_STATION | ALL_STATIONS) {
            return Err(format!("values of common address {common_address}, which is no station"));
        }
        let mut contradiction = None;
        for object in objects {
            if self.batch.len() >= MAX_BATCH {
                self.flush();
            }
            let range = self.points.of_object(common_address, object.address);
            if range.is_empty() {
                self.ignored.unknown_objects += 1;
            }
            for index in range {
                let Some(point) = self.points.all().get(index) else { continue };
                let tag = point.tag;
                if let Some(value) = value_of(point, object.value) {
                    let quality = quality_of_value(&value, &object, is_test);
                    let sample = Sample { tag, ..Sample::good(tag, value) };
                    let sample =
                        Sample { quality, ..sample }.with_flags(origin_of(object.flags, is_test));
                    self.take_value(header, index, &object, sample, received);
                    continue;
                }
                self.batch.push(Sample::bad(tag, Reason::Configuration));
                let name = name_of(object.value);
                let by = if is_event(cause) { Evidence::Event } else { Evidence::Present };
                if self.validity.note_misfit(common_address, index, by) {
                    let address = object.address;
                    contradiction =
                        Some(format!("object {address} is {name}, which is not the tag's type"));
                }
                self.tell_misfit(index, type_id, name);
            }
        }
        contradiction.map_or(Ok(()), Err)
    }

    /// Puts time and order to a value that fits.
    fn take_value(
        &mut self,
        header: &Header,
        index: usize,
        object: &Object,
        mut sample: Sample,
        received: SystemTime,
    ) {
        let &Header { cause, common_address, .. } = header;
        let is_event = is_event(cause);
        if let Some(tag) = object.time {
            sample.source_time = tag.resolve(received, self.config.zone);
            if sample.source_time.is_none() {
                sample.flags |= SampleFlags::TIME_UNUSABLE;
            }
            let order = match is_event {
                true => self.validity.order_of(common_address, index, tag, sample.source_time),
                false => EventOrder::Arrival,
            };
            if let EventOrder::Doubtful { is_before_start } = order {
                if is_before_start {
                    sample.flags |= SampleFlags::BUFFERED;
                }
                if sample.quality.is_good() {
                    sample.quality = Quality::Uncertain(Reason::SourceTime);
                }
                self.requests.demand(common_address);
            }
        }
        let evidence = match is_event && !self.validity.is_present(index) {
            true => Evidence::Event,
            false => Evidence::Present,
        };
        self.validity.note_value(common_address, index, evidence);
        self.batch.push(sample);
    }

    /// # Errors
    /// Description of a type that may carry values.
    fn take_other(&mut self, type_id: u8) -> Result<(), String> {
        let is_known = is_without_values(type_id) || self.config.ignored_types.contains(&type_id);
        if !is_known {
            return Err(format!(
                "type {type_id} is not known; if it carries no value of a tag, name it in \
                 ignored_types"
            ));
        }
        self.ignored.without_values += 1;
        Ok(())
    }

    /// A data unit could not be understood, so it may have brought any value of its common
    /// address: all of them are bad until they come again, and are asked for.
    fn distrust(&mut self, common_address: Option<u16>, what: String, now: Instant) {
        self.ignored.not_understood += 1;
        self.flush();
        for concerned in self.validity.concerned(common_address) {
            let points = self.validity.distrust(concerned);
            self.publish_bad(points.into_iter(), Reason::Communication);
            self.requests.demand(concerned);
        }
        let of = common_address.map(|address| format!(" of common address {address}"));
        self.notices.note(format!("a data unit{} cannot be used: {what}", of.unwrap_or_default()));
        self.tell_due(now);
    }

    /// A station that has started anew has new values.
    fn restart(&mut self, common_address: u16, received: SystemTime) {
        self.flush();
        for concerned in self.validity.concerned(Some(common_address)) {
            let points = self.validity.restart(concerned, received);
            self.publish_bad(points.into_iter(), Reason::NotConnected);
            self.requests.demand(concerned);
        }
    }

    fn publish_bad(&self, points: impl Iterator<Item = usize>, reason: Reason) {
        let all = self.points.all();
        self.sink.publish_bad(points.filter_map(|index| all.get(index)).map(|p| p.tag), reason);
    }

    /// # Errors
    /// Description of a cause that no answer has.
    fn take_answer(
        &mut self,
        kind: RequestKind,
        header: &Header,
        now: Instant,
    ) -> Result<(), String> {
        let &Header { type_id, cause, .. } = header;
        if !is_answer(cause) {
            return Err(format!("type {type_id} with cause of transmission {cause}"));
        }
        if let Some((job, outcome)) = self.requests.handle_answer(kind, header, now) {
            self.note_outcome(job, outcome);
        }
        Ok(())
    }

    fn note_outcome(&mut self, job: ScheduledRequest, outcome: Outcome) {
        let what = match job.kind {
            RequestKind::ClockSync => "its clock to be set",
            RequestKind::Interrogation => "an interrogation",
            RequestKind::Counters => "a counter interrogation",
        };
        let common_address = job.common_address;
        if job.kind == RequestKind::Interrogation {
            self.validity.end_round(common_address, outcome != Outcome::Unanswered);
        }
        match outcome {
            Outcome::Done if job.kind == RequestKind::Interrogation => {
                if self.unknown_addresses.remove(&common_address) {
                    self.report_link();
                }
                self.tell_silent(common_address);
            }
            Outcome::Done => {}
            Outcome::UnknownCommonAddress => {
                self.mark_unknown(job);
                if self.unknown_addresses.insert(common_address) {
                    self.log(LogLevel::Error, &unknown_address(common_address));
                    self.report_link();
                }
            }
            Outcome::Refused(cause) => self.log(
                LogLevel::Warning,
                &format!(
                    "the station refused {what} of common address {common_address} (cause of \
                     transmission {cause}): see what it supports"
                ),
            ),
            Outcome::Unanswered => self.log(
                LogLevel::Warning,
                &format!(
                    "the station did not answer, or not end, {what} of common address \
                     {common_address} in time: is the address right?"
                ),
            ),
        }
    }

    /// Names the tags that an interrogation brought nothing for, once a
    /// connection.
    fn tell_silent(&mut self, common_address: u16) {
        let range = self.points.of_station(common_address);
        let silent = |&index: &usize| !self.validity.is_answered(index);
        let ids: Vec<_> =
            range.filter(silent).map(|index| self.points.all()[index].id.as_str()).collect();
        if ids.is_empty() || self.is_silence_told {
            return;
        }
        let text = format!(
            "the interrogation of common address {common_address} brought nothing for {}; they \
             stay bad until the station sends them",
            list(&ids)
        );
        self.is_silence_told = true;
        self.log(LogLevel::Warning, &text);
    }

    /// The station does not know a common address. One that does not let its clock be set
    /// there may still send values of it.
    fn mark_unknown(&mut self, job: ScheduledRequest) {
        self.flush();
        if job.kind != RequestKind::ClockSync {
            self.validity.distrust(job.common_address);
        }
        let range = self.points.of_station(job.common_address);
        let silent = range.filter(|&index| !self.validity.is_answered(index));
        self.publish_bad(silent, Reason::Configuration);
    }

    fn tell_misfit(&mut self, index: usize, type_id: u8, name: &str) {
        if self.misfits_told >= MAX_MISFITS_TOLD
            || std::mem::replace(&mut self.is_misfit_told[index], true)
        {
            return;
        }
        self.misfits_told += 1;
        let Point { id, common_address, object_address, .. } = &self.points.all()[index];
        let text = format!(
            "tag '{id}': object {object_address} of common address {common_address} is {name} \
             (type {type_id}), which does not fit: correct the tag's type or address"
        );
        self.log(LogLevel::Warning, &text);
    }

    /// Tells of data units that could not be understood, in log and link panel.
    fn tell_due(&mut self, now: Instant) {
        if let Some(notice) = self.notices.take_due(now) {
            self.log_notice(&notice);
            self.report_link();
        }
    }

    fn log_notice(&self, Notice { last, count, total }: &Notice) {
        let more = match count {
            1 => String::new(),
            _ => format!("; {count} such data units since the line before"),
        };
        let text = format!(
            "{last}; its values are bad until they are interrogated again{more} ({total} in this \
             connection)"
        );
        self.log(LogLevel::Warning, &text);
    }

    /// Says in the link panel what is wrong with a connection that is up.
    fn report_link(&self) {
        let mut text = format!("{}: connected", self.config.endpoints[0]);
        for common_address in &self.unknown_addresses {
            text += "; ";
            text += &unknown_address(*common_address);
        }
        let (count, last) = self.notices.summary();
        if count > 0 {
            text += &format!("; {count} data units could not be used, the last: {last}");
        }
        self.sink.report_link(LinkState::Up, &text);
    }

    fn log_ignored(&mut self) {
        let Ignored { unknown_objects, without_values, not_understood } =
            std::mem::take(&mut self.ignored);
        if unknown_objects + without_values + not_understood > 0 {
            let text = format!(
                "left out in this connection: {unknown_objects} values that no tag names; data \
                 units: {without_values} of types that carry no values, {not_understood} that \
                 could not be understood"
            );
            self.log(LogLevel::Info, &text);
        }
    }

    fn log(&self, level: LogLevel, text: &str) {
        let endpoint = &self.config.endpoints[0];
        self.host.log(level, &format!("{endpoint}: {text}"));
    }
}

fn unknown_address(common_address: u16) -> String {
    format!(
        "the station does not know common address {common_address}: correct it in the settings \
         or in the tags' addresses"
    )
}

/// Reports whether a cause of transmission goes with values of the process (IEC 60870-5-101,
/// 7.2.3).
fn is_process_data(cause: u8) -> bool {
    matches!(
        cause,
        cause::PERIODIC..=cause::REQUESTED
            | cause::RETURN_REMOTE..=cause::RETURN_LOCAL
            | cause::INTERROGATED..=cause::INTERROGATED_LAST
            | cause::COUNTERS..=cause::COUNTERS_LAST
    )
}

/// Reports whether a cause of transmission tells of an event, which a station may keep in a buffer.
fn is_event(cause: u8) -> bool {
    matches!(cause, cause::SPONTANEOUS | cause::RETURN_REMOTE | cause::RETURN_LOCAL)
}

/// Reports whether an answer to a request may have a cause of transmission.
fn is_answer(cause: u8) -> bool {
    matches!(
        cause,
        cause::ACTIVATION_CONFIRMED..=cause::ACTIVATION_TERMINATED
            | cause::UNKNOWN_TYPE..=cause::UNKNOWN_OBJECT_ADDRESS
    )
}

/// `tag 'a'`, `tags 'a', 'b' and 7 more`.
fn list(ids: &[&str]) -> String {
    let named = &ids[..ids.len().min(MAX_TAGS_IN_MESSAGE)];
    let more = ids.len() - named.len();
    let tags = if ids.len() == 1 { "tag" } else { "tags" };
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{tags} '{}'{rest}", named.join("', '"))
}

/// Tags whose freshness limit is shorter than the time between values that a
/// quiet station sends, for a warning; `None` if there are none.
pub(crate) fn freshness_warning(config: &Config, tags: &[TagSpec]) -> Option<String> {
    let period = config.interrogation_period;
    let short: Vec<_> = tags
        .iter()
        .filter(|tag| period.is_none_or(|period| tag.freshness < period))
        .map(|tag| tag.id.as_str())
        .collect();
    if short.is_empty() {
        return None;
    }
    let asked = match period {
        Some(period) => format!("only every {} ms", period.as_millis()),
        None => "only when data transfer starts".to_owned(),
    };
    Some(format!(
        "all values are asked for {asked}: what the station does not send by itself in the \
         meantime goes stale, as may {}; set interrogation_period_seconds below their \
         freshness_seconds",
        list(&short)
    ))
}

#[cfg(test)]
#[path = "station_tests.rs"]
mod tests;
