//! The station behind its connections: data units in, samples and requests out.

use std::time::{Instant, SystemTime};

use busbar_plugin_sdk::{Host, LinkState, LogLevel, Reason, Sample, SampleSink, TagSpec};

use crate::codec::{Asdu, Body, Header, Objects, Request, cause};
use crate::convert::{name_of, quality_of, value_of};
use crate::points::{Point, Points};
use crate::requests::{Job, Kind, Outcome, Requests};
use crate::settings::Config;

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
    requests: Requests,
    /// By point, since data transfer started: whether a value came.
    is_answered: Vec<bool>,
    /// By point: whether it was told that its object is of another type.
    is_misfit_told: Vec<bool>,
    misfits_told: usize,
    is_silence_told: bool,
    /// Samples of the bytes that are being read.
    batch: Vec<Sample>,
    ignored: Ignored,
}

/// What came since data transfer started and was not used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Ignored {
    /// Objects that no tag names.
    unknown_objects: u64,
    /// Data units sent as a test, or negative.
    no_process_data: u64,
    /// Data units of other types and causes.
    other_units: u64,
    /// Data units that contradict themselves.
    malformed: u64,
}

impl Station {
    pub(crate) fn new(config: Config, points: Points, sink: SampleSink, host: Host) -> Self {
        let requests = Requests::new(&config, points.common_addresses());
        let count = points.all().len();
        Self {
            config,
            points,
            sink,
            host,
            requests,
            is_answered: vec![false; count],
            is_misfit_told: vec![false; count],
            misfits_told: 0,
            is_silence_told: false,
            batch: Vec::new(),
            ignored: Ignored::default(),
        }
    }

    /// Data transfer has started: no tag has a value yet.
    pub(crate) fn begin(&mut self, now: Instant) {
        self.publish_all(Reason::NotConnected);
        self.is_answered.fill(false);
        self.is_silence_told = false;
        self.requests.begin(now);
    }

    /// Data transfer has ended.
    pub(crate) fn end(&mut self) {
        self.flush();
        self.requests.end();
        self.publish_all(Reason::Communication);
        self.log_ignored();
    }

    /// Says of every tag that it has no value.
    pub(crate) fn publish_all(&self, reason: Reason) {
        self.sink.publish_bad(self.points.all().iter().map(|point| point.tag), reason);
    }

    /// Takes a data unit. Its samples go with the next [`Station::flush`] at the
    /// latest.
    pub(crate) fn heed(&mut self, asdu: &[u8], received: SystemTime, now: Instant) {
        match Asdu::parse(asdu) {
            Ok(Asdu { header, body }) => match body {
                Body::Objects(objects) => self.take_objects(&header, objects, received),
                Body::InitialisationEnded => self.ask_anew(header.common_address),
                Body::Interrogation => self.take_answer(Kind::Interrogation, &header, now),
                Body::CounterInterrogation => self.take_answer(Kind::Counters, &header, now),
                Body::ClockSync => self.take_answer(Kind::ClockSync, &header, now),
                Body::Other => self.ignored.other_units += 1,
            },
            Err(error) => {
                if self.ignored.malformed == 0 {
                    let text = format!("a data unit cannot be used: {error}");
                    self.log(LogLevel::Warning, &text);
                }
                self.ignored.malformed += 1;
            }
        }
    }

    /// Publishes what came.
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
        if let Some(job) = self.requests.take_late(now) {
            self.note_outcome(job, Outcome::Unanswered);
        }
        let job = self.requests.next(now)?;
        let request = match job.kind {
            Kind::Interrogation => Request::Interrogation,
            Kind::Counters => Request::Counters,
            Kind::ClockSync => Request::ClockSync(wall_clock(), self.config.zone),
        };
        request.to_bytes(job.common_address, self.config.originator)
    }

    /// When [`Station::next_request`] has something to do.
    pub(crate) fn deadline(&self) -> Option<Instant> {
        self.requests.deadline()
    }

    fn take_objects(&mut self, header: &Header, objects: Objects<'_>, received: SystemTime) {
        if header.is_test || header.is_negative {
            self.ignored.no_process_data += 1;
            return;
        }
        if !is_process_data(header.cause) {
            self.ignored.other_units += 1;
            return;
        }
        for object in objects {
            if self.batch.len() >= MAX_BATCH {
                self.flush();
            }
            let range = self.points.of_object(header.common_address, object.address);
            if range.is_empty() {
                self.ignored.unknown_objects += 1;
            }
            let source_time = object.time.and_then(|tag| tag.resolve(received, self.config.zone));
            for index in range {
                let Some(point) = self.points.all().get(index) else { continue };
                self.is_answered[index] = true;
                let (tag, value) = (point.tag, value_of(point, object.value));
                if value.is_some() {
                    let quality = quality_of(&object);
                    self.batch.push(Sample { tag, value, quality, source_time });
                } else {
                    self.batch.push(Sample::bad(tag, Reason::Configuration));
                    self.tell_misfit(index, header.type_id, name_of(object.value));
                }
            }
        }
    }

    /// A station that has started anew has new values.
    fn ask_anew(&mut self, common_address: u16) {
        if self.points.common_addresses().contains(&common_address) {
            self.requests.add(Job { kind: Kind::Interrogation, common_address });
        }
    }

    fn take_answer(&mut self, kind: Kind, header: &Header, now: Instant) {
        if let Some((job, outcome)) = self.requests.heed(kind, header, now) {
            self.note_outcome(job, outcome);
        }
    }

    fn note_outcome(&mut self, job: Job, outcome: Outcome) {
        let what = match job.kind {
            Kind::ClockSync => "its clock to be set",
            Kind::Interrogation => "an interrogation",
            Kind::Counters => "a counter interrogation",
        };
        let common_address = job.common_address;
        match outcome {
            Outcome::Done if job.kind == Kind::Interrogation => self.tell_silent(common_address),
            Outcome::Done => {}
            Outcome::UnknownCommonAddress => {
                self.mark_unanswered(common_address, Reason::Configuration);
                let text = format!(
                    "the station does not know common address {common_address}: correct it in \
                     the settings or in the tags' addresses"
                );
                self.log(LogLevel::Error, &text);
                let endpoint = &self.config.endpoints[0];
                self.sink.report_link(LinkState::Up, &format!("{endpoint}: {text}"));
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
        let silent = |&index: &usize| !self.is_answered[index];
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

    fn mark_unanswered(&self, common_address: u16, reason: Reason) {
        let range = self.points.of_station(common_address);
        let silent = range.filter(|&index| !self.is_answered[index]);
        self.sink.publish_bad(silent.map(|index| self.points.all()[index].tag), reason);
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

    fn log_ignored(&mut self) {
        let Ignored { unknown_objects, no_process_data, other_units, malformed } =
            std::mem::take(&mut self.ignored);
        if unknown_objects + no_process_data + other_units + malformed > 0 {
            let text = format!(
                "left out in this connection: {unknown_objects} values that no tag names; data \
                 units: {no_process_data} tests or negative, {other_units} of other types or \
                 causes, {malformed} malformed"
            );
            self.log(LogLevel::Info, &text);
        }
    }

    fn log(&self, level: LogLevel, text: &str) {
        let endpoint = &self.config.endpoints[0];
        self.host.log(level, &format!("{endpoint}: {text}"));
    }
}

/// Whether a cause of transmission goes with values of the process
/// (IEC 60870-5-101, 7.2.3).
fn is_process_data(cause: u8) -> bool {
    matches!(
        cause,
        cause::PERIODIC..=cause::REQUESTED
            | cause::RETURN_REMOTE..=cause::RETURN_LOCAL
            | cause::INTERROGATED..=cause::INTERROGATED_LAST
            | cause::COUNTERS..=cause::COUNTERS_LAST
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
         meantime goes stale, as may {}; set interrogation_period_millis below their \
         freshness_millis",
        list(&short)
    ))
}

#[cfg(test)]
#[path = "station_tests.rs"]
mod tests;
