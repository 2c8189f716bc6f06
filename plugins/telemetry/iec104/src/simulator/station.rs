//! A simulated station as one client sees it: requests in, values out, without a socket
//! and without a clock. Whatever is to be sent is made when the window has room, so that
//! a slow client costs no memory.

use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use thiserror::Error;

use super::map::{ObjectSelection, StationMap};
use super::session::{self, Event, Session};
use crate::apci_session::Parameters;
use crate::codec::{
    self, Asdu, AsduWriter, Body, Cp56, Object, TimeTag, Zone, answer_to, cause,
    initialisation_ended,
};

/// Requests that wait for their answer.
const MAX_JOBS: usize = 1024;
/// The common address that means all of them (IEC 60870-5-101, 7.2.4).
const ALL_STATIONS: u16 = 0xFFFF;
/// Offset of a request's first element, bytes: after header and object address.
const ELEMENT_INDEX: usize = 9;
/// Station interrogation, global, and of groups 1 to 16 (QOI, 7.2.6.22).
const QOI_STATION: u8 = 20;
const QOI_LAST_GROUP: u8 = 36;
/// General request for counters; less are groups 1 to 4 (QCC, 7.2.6.23).
const RQT_GENERAL: u8 = 5;
/// The request's bits of a QCC, and those that freeze or reset.
const RQT: u8 = 0x3F;
const FRZ: u8 = 0xC0;
/// Types that a client may send: interrogations, read, clock, tests.
const C_IC_NA: u8 = 100;
const C_CI_NA: u8 = 101;
const C_RD_NA: u8 = 102;
const C_CS_NA: u8 = 103;
const C_TS_NA: u8 = 104;
const C_TS_TA: u8 = 107;

/// State shared by all clients.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) map: StationMap,
    pub(super) zone: Zone,
    pub(super) parameters: Parameters,
    /// Reports whether the end of initialisation was sent.
    pub(super) has_sent_start: AtomicBool,
}

/// An instant on all clocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Times {
    /// Instant by which deadlines count.
    pub(super) now: Instant,
    /// By which values move.
    pub(super) true_time: SystemTime,
    /// Time of the station's clock.
    pub(super) station_time: SystemTime,
}

/// Reason for which a client is closed.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub(super) enum CloseReason {
    /// Fault of the connection.
    #[error("{0}")]
    Session(#[from] session::CloseReason),
    /// More requests than can be kept.
    #[error("{MAX_JOBS} requests wait for their answers")]
    Overrun,
}

/// Message to be sent, in order.
#[derive(Debug)]
enum Job {
    /// Data unit to be sent.
    Send(Vec<u8>),
    /// Objects of a common address, then this data unit.
    Report { common_address: u16, cause: u8, left: Range<usize>, end: Option<Vec<u8>> },
}

/// A walk through all objects, for those that have changed.
#[derive(Debug)]
struct Scan {
    /// Instant of the values, by the true clock and the station's.
    true_time: SystemTime,
    station_time: SystemTime,
    next: usize,
}

/// Client of the simulated station.
#[derive(Debug)]
pub(super) struct Station {
    shared: Arc<Shared>,
    session: Session,
    jobs: VecDeque<Job>,
    /// Values of each object that the client knows, while data transfer is started.
    known: Vec<codec::Value>,
    scan: Option<Scan>,
    sent_count: u64,
}

impl Station {
    pub(super) fn new(shared: Arc<Shared>, now: Instant) -> Self {
        let session = Session::new(shared.parameters, now);
        let (jobs, known) = (VecDeque::new(), Vec::new());
        Self { shared, session, jobs, known, scan: None, sent_count: 0 }
    }

    /// Processes bytes that were received.
    ///
    /// # Errors
    /// After any [`CloseReason`] the connection must be closed.
    pub(super) fn receive(&mut self, bytes: &[u8], times: Times) -> Result<(), CloseReason> {
        let Self { shared, session, jobs, known, scan, .. } = self;
        session.receive(bytes, times.now, |event| match event {
            Event::Started => {
                let time = whole_millis(times.true_time);
                *known = shared.map.objects().iter().map(|object| object.value_at(time)).collect();
                if !shared.has_sent_start.swap(true, Ordering::Relaxed) {
                    let all = shared.map.common_addresses().iter();
                    jobs.extend(all.map(|&address| Job::Send(initialisation_ended(address))));
                }
            }
            Event::Stopped => {
                jobs.clear();
                *scan = None;
            }
            Event::Asdu(request) => answer(shared, request, jobs),
        })?;
        if jobs.len() > MAX_JOBS {
            return Err(CloseReason::Overrun);
        }
        self.fill(times);
        Ok(())
    }

    /// Does what is due.
    ///
    /// # Errors
    /// Returns the errors of [`Station::receive`].
    pub(super) fn tick(&mut self, times: Times) -> Result<(), CloseReason> {
        self.session.tick(times.now)?;
        self.fill(times);
        Ok(())
    }

    /// Looks for changes, unless it still does.
    pub(super) fn look_for_changes(&mut self, times: Times) {
        if self.scan.is_none() && !self.known.is_empty() && self.session.is_started() {
            let (true_time, station_time) =
                (whole_millis(times.true_time), whole_millis(times.station_time));
            self.scan = Some(Scan { true_time, station_time, next: 0 });
        }
        self.fill(times);
    }

    /// Returns the latest instant at which [`Station::tick`] has something to do.
    pub(super) fn deadline(&self) -> Instant {
        self.session.deadline()
    }

    /// Takes the bytes to send, and the count of data units in them.
    pub(super) fn take_output(&mut self) -> (Vec<u8>, u64) {
        (self.session.take_output(), std::mem::take(&mut self.sent_count))
    }

    /// Sends as much as the window allows.
    fn fill(&mut self, times: Times) {
        while self.session.can_send() {
            let Some(asdu) = self.next_reply(times).or_else(|| self.next_change()) else { return };
            self.session.send(&asdu, times.now);
            self.sent_count += 1;
        }
    }

    fn next_reply(&mut self, times: Times) -> Option<Vec<u8>> {
        loop {
            match self.jobs.pop_front()? {
                Job::Send(asdu) => return Some(asdu),
                Job::Report { common_address, cause, mut left, end } => {
                    let time = whole_millis(times.true_time);
                    let mut writer = AsduWriter::new(cause, common_address);
                    while let Some(object) =
                        self.shared.map.objects().get(left.clone()).and_then(|o| o.first())
                    {
                        let value = object.value_at(time);
                        if !writer.push(&good(object.address, value, None)) {
                            break;
                        }
                        if let Some(known) = self.known.get_mut(left.start) {
                            *known = value;
                        }
                        left.start += 1;
                    }
                    match (writer.finish(), end) {
                        (Some(asdu), end) => {
                            self.jobs.push_front(Job::Report { common_address, cause, left, end });
                            return Some(asdu);
                        }
                        (None, Some(end)) => return Some(end),
                        (None, None) => {}
                    }
                }
            }
        }
    }

    /// The next data unit of changes; nothing when the walk is over.
    fn next_change(&mut self) -> Option<Vec<u8>> {
        let scan = self.scan.as_mut()?;
        let time = Cp56::from_system_time(scan.station_time, self.shared.zone).map(TimeTag::Cp56);
        let objects = self.shared.map.objects();
        let mut writer: Option<AsduWriter> = None;
        let mut common_address = 0;
        while let (Some(object), Some(known)) =
            (objects.get(scan.next), self.known.get_mut(scan.next))
        {
            let value = object.value_at(scan.true_time);
            if value != *known {
                let writing = writer.get_or_insert_with(|| {
                    common_address = object.common_address;
                    AsduWriter::new(cause::SPONTANEOUS, common_address)
                });
                let is_of_unit = common_address == object.common_address;
                if !is_of_unit || !writing.push(&good(object.address, value, time)) {
                    break;
                }
                *known = value;
            }
            scan.next += 1;
        }
        if scan.next >= objects.len() {
            self.scan = None;
        }
        writer.and_then(AsduWriter::finish)
    }
}

fn good(address: u32, value: codec::Value, time: Option<TimeTag>) -> Object {
    Object { address, value, flags: codec::Flags::default(), time }
}

/// Rounds a time to whole milliseconds, as time tags have it: a value computed from a tag is
/// exactly this value.
fn whole_millis(time: SystemTime) -> SystemTime {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    let millis = u64::try_from(since.as_millis()).unwrap_or_default();
    UNIX_EPOCH + Duration::from_millis(millis)
}

/// Adds what answers a request.
fn answer(shared: &Shared, request: &[u8], jobs: &mut VecDeque<Job>) {
    // Too many: the connection is about to be closed.
    if jobs.len() > MAX_JOBS {
        return;
    }
    // One that is cut short or of no known form has no answer.
    let Ok(asdu) = Asdu::parse(request) else { return };
    let header = asdu.header;
    let mut refuse = |cause| jobs.push_back(Job::Send(answer_to(request, cause, true)));
    let is_known =
        matches!(header.type_id, C_IC_NA | C_CI_NA | C_RD_NA | C_CS_NA | C_TS_NA | C_TS_TA);
    if !is_known || matches!(asdu.body, Body::Objects(_)) {
        return refuse(cause::UNKNOWN_TYPE);
    }
    let wanted_cause = if header.type_id == C_RD_NA { cause::REQUESTED } else { cause::ACTIVATION };
    if header.cause != wanted_cause {
        return refuse(cause::UNKNOWN_CAUSE);
    }
    let known = shared.map.common_addresses();
    let stations: Vec<u16> = match header.common_address {
        ALL_STATIONS => known.to_vec(),
        one => known.iter().copied().filter(|&address| address == one).collect(),
    };
    if stations.is_empty() {
        return refuse(cause::UNKNOWN_COMMON_ADDRESS);
    }
    let element = request.get(ELEMENT_INDEX).copied();
    for station in stations {
        let named = named(request, station);
        match (header.type_id, element) {
            (C_IC_NA, Some(qoi @ QOI_STATION..=QOI_LAST_GROUP)) => {
                let group = usize::from(qoi - QOI_STATION).checked_sub(1);
                let left = shared.map.range(station, ObjectSelection::Values(group));
                report(&named, station, qoi, left, jobs);
            }
            (C_CI_NA, Some(qcc)) if qcc & FRZ == 0 && (1..=RQT_GENERAL).contains(&(qcc & RQT)) => {
                let group = (qcc & RQT != RQT_GENERAL).then(|| usize::from((qcc & RQT) - 1));
                let left = shared.map.range(station, ObjectSelection::Counters(group));
                let cause = cause::COUNTERS + group.map_or(0, |group| group as u8 + 1);
                report(&named, station, cause, left, jobs);
            }
            (C_RD_NA, _) => {
                let address = request.get(6..ELEMENT_INDEX).map_or(0, |bytes| {
                    bytes.iter().rev().fold(0, |all, &byte| all << 8 | u32::from(byte))
                });
                jobs.push_back(match shared.map.find(station, address) {
                    Some(index) => Job::Report {
                        common_address: station,
                        cause: cause::REQUESTED,
                        left: index..index + 1,
                        end: None,
                    },
                    None => Job::Send(answer_to(&named, cause::UNKNOWN_OBJECT_ADDRESS, true)),
                });
            }
            // Its clock is this machine's: it is confirmed and left as it is.
            (C_CS_NA | C_TS_NA | C_TS_TA, _) => {
                jobs.push_back(Job::Send(answer_to(&named, cause::ACTIVATION_CONFIRMED, false)));
            }
            _ => {
                jobs.push_back(Job::Send(answer_to(&named, cause::ACTIVATION_CONFIRMED, true)));
            }
        }
    }
}

/// Confirms a request, sends objects, and says that it is done.
fn report(
    request: &[u8],
    common_address: u16,
    cause: u8,
    left: Range<usize>,
    jobs: &mut VecDeque<Job>,
) {
    jobs.push_back(Job::Send(answer_to(request, cause::ACTIVATION_CONFIRMED, false)));
    let end = Some(answer_to(request, cause::ACTIVATION_TERMINATED, false));
    jobs.push_back(Job::Report { common_address, cause, left, end });
}

/// A request with the common address of the station that answers it.
fn named(request: &[u8], station: u16) -> Vec<u8> {
    let mut bytes = request.to_vec();
    if let Some(place) = bytes.get_mut(4..6) {
        place.copy_from_slice(&station.to_le_bytes());
    }
    bytes
}

#[cfg(test)]
#[path = "station_tests.rs"]
mod tests;
