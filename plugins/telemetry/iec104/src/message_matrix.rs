//! Message matrix: seeded sequences of frames that are lost, cut, oversized, unknown,
//! misassigned, repeated and reordered, by clocks that step, against an oracle that knows
//! the truth at every step.
//!
//! The oracle calls a good value wrong if it is not the present one of its object. Two
//! bounds hold: a lost frame is noticed at the next information frame, and before the
//! interrogated value of an object an event out of the buffer counts, with its own time,
//! unless a live event with a later time came before. Once a buffer had its time to come, events
//! count in order of arrival.
//!
//! `BUSBAR_MATRIX_STEPS` sets the count of steps.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_plugin_sdk::testing::{Recorder, host, matrix_steps, tag_spec};
use busbar_plugin_sdk::{Quality, Reason, Sample, SampleFlags, Value, ValueKind};
use fastrand::Rng;
use serde_json::json;

use crate::apci_session::{Event, Session};
use crate::codec::{Asdu, Body, Cp56, Frame, Function, Sequence, Zone, cause, split_frame};
use crate::points::Points;
use crate::settings::{Config, Settings};
use crate::station::Station;

/// Steps where the environment sets none: a sample of what a soak does.
const STEPS: u64 = 50_000;
const STEPS_A_SEQUENCE: u64 = 250;
/// Common addresses, and objects of each.
const ADDRESSES: [u8; 2] = [1, 2];
const OBJECTS: u8 = 4;
/// Bytes of a data unit up to its common address.
const HEADER_BYTES: usize = 6;
/// Longest time until all is good again where nothing fails any more: an interrogation that
/// does not end, and the time after which it is tried again.
const RECOVERY: Duration = Duration::from_secs(120 + 30 + 15 + 5);
/// Shown times further ahead than this are not believed, as in the host.
const MAX_AHEAD: Duration = Duration::from_secs(10);

/// Time from an interrogation for which a live event or a present value shuts out older events
/// of the buffer: less than the client waits for two that are not answered.
const CATCH_UP: Duration = Duration::from_secs(50);

/// An object of the station.
type Place = (u8, u8);

/// Damage to a data unit on its way, or within it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Damage {
    Lost,
    Cut,
    Extended,
    OversizedFrame,
    WrongStart,
    WrongCount,
    WrongSequenceBit,
    UnknownType,
    UnknownCause,
    Negative,
    Misassigned,
    NoStation,
    Repeated,
    Reordered,
}

const DAMAGES: [Damage; 14] = [
    Damage::Lost,
    Damage::Cut,
    Damage::Extended,
    Damage::OversizedFrame,
    Damage::WrongStart,
    Damage::WrongCount,
    Damage::WrongSequenceBit,
    Damage::UnknownType,
    Damage::UnknownCause,
    Damage::Negative,
    Damage::Misassigned,
    Damage::NoStation,
    Damage::Repeated,
    Damage::Reordered,
];

/// Behaviour of a station at an interrogation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InterrogationBehavior {
    Whole,
    Refusing,
    Silent,
    WithoutEnd,
    UnknownAddress,
}

/// Something that the station is about to send.
#[derive(Clone, Debug)]
enum Item {
    Unit(Vec<u8>),
    /// An event out of the buffer.
    Buffered(Vec<u8>),
    /// The value that an object has when it is sent.
    Present(Place, u8),
}

/// A tag as the host shows it.
#[derive(Clone, Copy, Debug)]
struct DisplayedTag {
    value: Option<f64>,
    quality: Quality,
    source_time: Option<SystemTime>,
    valid_from: SystemTime,
    /// Tells whether its source alone can make it good: its time is ahead or none, or it is sent
    /// as a test.
    is_of_source: bool,
}

struct Matrix {
    seed: u64,
    random: Rng,
    config: Config,
    recorder: Recorder,
    station: Station,
    session: Option<Session>,
    started: Instant,
    elapsed: Duration,
    /// Lead of the station's clock over the true time, milliseconds.
    clock_ahead_millis: i64,
    truth: BTreeMap<Place, f64>,
    next_value: f64,
    /// Events that wait for a connection.
    buffer: Vec<Vec<u8>>,
    queue: VecDeque<Item>,
    /// Numbers of the station's and the client's frames.
    sent: u16,
    received: u16,
    is_frame_lost: bool,
    /// Last values out of the buffer of objects that were not interrogated since.
    buffered: BTreeMap<Place, f64>,
    /// Source times of live events, and arrivals of present values, since the connection or the
    /// last damage.
    live_events: BTreeMap<Place, SystemTime>,
    /// Time of the first interrogation of the connection, by common address.
    interrogated: BTreeMap<u8, Duration>,
    shown: BTreeMap<Place, DisplayedTag>,
    answering: InterrogationBehavior,
    counts: BTreeMap<Damage, u32>,
    good: u64,
    judged: u64,
}

fn tag_of((address, object): Place) -> u32 {
    u32::from(address) * 100 + u32::from(object)
}

fn places() -> impl Iterator<Item = Place> {
    ADDRESSES.into_iter().flat_map(|address| (1..=OBJECTS).map(move |object| (address, object)))
}

impl Matrix {
    fn new(seed: u64) -> Self {
        let config = serde_json::from_value::<Settings>(json!({"host": "a"}));
        let config = config.unwrap().parse().unwrap();
        let tag = |place: Place| {
            let address = json!({"ioa": place.1, "common_address": place.0});
            tag_spec(tag_of(place), "t", ValueKind::F64, address)
        };
        let tags: Vec<_> = places().map(tag).collect();
        let points = Points::parse(&tags, &config).unwrap();
        let recorder = Recorder::new();
        let station = Station::new(config.clone(), points, recorder.sink(), host());
        let shown = DisplayedTag {
            value: None,
            quality: Quality::Bad(Reason::NotConnected),
            source_time: None,
            valid_from: UNIX_EPOCH,
            is_of_source: false,
        };
        Self {
            seed,
            random: Rng::with_seed(seed),
            config,
            recorder,
            station,
            session: None,
            started: Instant::now(),
            elapsed: Duration::ZERO,
            clock_ahead_millis: 0,
            truth: places().map(|place| (place, 0.0)).collect(),
            next_value: 1.0,
            buffer: Vec::new(),
            queue: VecDeque::new(),
            sent: 0,
            received: 0,
            is_frame_lost: false,
            buffered: BTreeMap::new(),
            live_events: BTreeMap::new(),
            interrogated: BTreeMap::new(),
            shown: places().map(|place| (place, shown)).collect(),
            answering: InterrogationBehavior::Whole,
            counts: BTreeMap::new(),
            good: 0,
            judged: 0,
        }
    }

    fn now(&self) -> Instant {
        self.started + self.elapsed
    }

    /// 2024-02-29 and what has passed since.
    fn wall(&self) -> SystemTime {
        UNIX_EPOCH + Duration::from_secs(1_709_210_096) + self.elapsed
    }

    /// One step of a sequence.
    fn step(&mut self) {
        let millis = self.random.u64(0..400);
        self.elapsed += Duration::from_millis(millis);
        match self.random.u32(0..100) {
            0..=44 => self.change(),
            45..=59 => {
                let place = self.any_place();
                let cause = *self.random.choice(&[cause::PERIODIC, cause::BACKGROUND]).unwrap();
                self.queue.push_back(Item::Present(place, cause));
            }
            60..=64 => self.send_test(),
            65..=67 => self.initialise(),
            68..=70 => self.hang_up(),
            71..=74 => self.step_clock(),
            75..=77 => {
                use InterrogationBehavior::{Refusing, Silent, UnknownAddress, Whole, WithoutEnd};
                let all = [Whole, Whole, Refusing, Silent, WithoutEnd, UnknownAddress];
                self.answering = *self.random.choice(all.iter()).unwrap();
            }
            78..=79 => self.elapsed += Duration::from_secs(self.random.u64(1..40)),
            _ => {}
        }
        let count = self.random.usize(0..6);
        self.exchange(count, true);
    }

    /// All is good again, where nothing fails any more.
    fn settle(&mut self) {
        self.answering = InterrogationBehavior::Whole;
        let end = self.elapsed + RECOVERY;
        let is_settled = |shown: &DisplayedTag| shown.quality.is_good() || shown.is_of_source;
        while !self.shown.values().all(is_settled) {
            assert!(self.elapsed < end, "never good again: {:?}", self.shown);
            self.elapsed += Duration::from_millis(250);
            self.exchange(usize::MAX, false);
        }
        self.exchange(usize::MAX, false);
    }

    fn any_place(&mut self) -> Place {
        (*self.random.choice(&ADDRESSES).unwrap(), self.random.u8(1..=OBJECTS))
    }

    fn change(&mut self) {
        let place = self.any_place();
        let value = self.new_value();
        self.truth.insert(place, value);
        let (kind, cause) =
            (self.random.u8(0..4), *self.random.choice(&[3, 3, 3, 11, 12]).unwrap());
        // Without a time nothing is kept in a buffer.
        let time = match kind {
            0 if self.session.is_some() => Vec::new(),
            1 => self.stamp()[..3].to_vec(),
            _ => self.stamp(),
        };
        let unit = unit(place, cause, value, &time);
        if self.session.is_some() {
            self.queue.push_back(Item::Unit(unit));
        } else {
            self.buffer.push(unit);
        }
    }

    fn new_value(&mut self) -> f64 {
        self.next_value += 1.0;
        self.next_value
    }

    /// A time by the station's clock, sometimes none.
    fn stamp(&mut self) -> Vec<u8> {
        let ahead = Duration::from_millis(self.clock_ahead_millis.unsigned_abs());
        let time = match self.clock_ahead_millis < 0 {
            true => self.wall() - ahead,
            false => self.wall() + ahead,
        };
        let mut bytes = Cp56::from_system_time(time, Zone::Utc).unwrap().to_bytes();
        match self.random.u8(0..20) {
            0 => bytes[2] |= 0x80,
            1 => bytes[5] = 13,
            _ => {}
        }
        bytes.to_vec()
    }

    /// A value that is none of the process.
    fn send_test(&mut self) {
        let (place, value) = (self.any_place(), self.new_value());
        let mut bytes = unit(place, cause::SPONTANEOUS, value, &[]);
        bytes[2] |= 0x80;
        self.queue.push_back(Item::Unit(bytes));
    }

    /// A station that starts anew has other values, and sends none of the changes.
    fn initialise(&mut self) {
        let address = *self.random.choice(&ADDRESSES).unwrap();
        if self.session.is_none() {
            return;
        }
        for object in 1..=OBJECTS {
            let value = self.new_value();
            self.truth.insert((address, object), value);
        }
        self.queue.push_back(Item::Unit(vec![70, 1, 4, 0, address, 0, 0, 0, 0, 0]));
    }

    fn step_clock(&mut self) {
        self.clock_ahead_millis = match self.random.u8(0..5) {
            0 => 0,
            1 => self.random.i64(-3000..3000),
            2 => -3_600_000,
            3 => 8 * 3_600_000,
            _ => self.random.i64(-100_000..5000),
        };
    }

    fn hang_up(&mut self) {
        if self.session.take().is_some() {
            self.station.end();
        }
        self.queue.clear();
        self.is_frame_lost = false;
        self.note_samples();
        self.judge();
    }

    /// Connects anew; what the buffer holds comes at once, or while it is interrogated.
    fn connect(&mut self) {
        let mut session = Session::new(self.config.parameters, self.now());
        session.start(self.now());
        (self.sent, self.received) = (0, 0);
        self.buffered.clear();
        self.live_events.clear();
        self.interrogated.clear();
        self.session = Some(session);
        let mut confirmed = Vec::new();
        Frame::Unnumbered(Function::StartCon).write(&mut confirmed);
        self.receive(&confirmed);
    }

    /// Lets the client do what is due, and the station send so many data units.
    fn exchange(&mut self, mut count: usize, is_damaged: bool) {
        if self.session.is_none() {
            if is_damaged && self.random.u8(0..3) > 0 {
                self.judge();
                return;
            }
            self.connect();
        }
        loop {
            self.serve_client();
            self.judge();
            if count == 0 || self.session.is_none() {
                return;
            }
            let Some(item) = self.queue.pop_front() else { return };
            count -= 1;
            let (bytes, is_buffered) = match item {
                Item::Unit(bytes) => (bytes, false),
                Item::Buffered(bytes) => (bytes, true),
                Item::Present(place, cause) => (unit(place, cause, self.truth[&place], &[]), false),
            };
            let damage = (is_damaged && self.random.u8(0..12) == 0)
                .then(|| *self.random.choice(&DAMAGES).unwrap());
            match damage {
                None => self.deliver(&bytes, is_buffered),
                Some(damage) => {
                    self.deliver_damaged(bytes, damage);
                }
            }
        }
    }

    /// Sends what the client has to send, and answers it.
    fn serve_client(&mut self) {
        let now = self.now();
        let Some(session) = &mut self.session else { return };
        if session.tick(now).is_err() {
            return self.hang_up();
        }
        while session.is_started() {
            let Some(asdu) = self.station.next_request(now, SystemTime::now) else { break };
            session.send(asdu, now).unwrap();
        }
        let output = session.take_output();
        let (mut rest, mut answers) = (&output[..], Vec::new());
        while let Some((frame, taken)) = split_frame(rest).unwrap() {
            match frame {
                Frame::Information { asdu, .. } => {
                    self.received += 1;
                    let receive = Sequence::new(self.received);
                    Frame::Supervisory(receive).write(&mut answers);
                    self.answer(asdu);
                }
                Frame::Unnumbered(Function::TestAct) => {
                    Frame::Unnumbered(Function::TestCon).write(&mut answers);
                }
                _ => {}
            }
            rest = &rest[taken..];
        }
        self.receive(&answers);
    }

    /// Queues the answer to an interrogation. The buffer comes before, among or after its
    /// values.
    fn answer(&mut self, request: &[u8]) {
        let address = request[4];
        self.interrogated.entry(address).or_insert(self.elapsed);
        let with_cause = |cause: u8| {
            let mut bytes = request.to_vec();
            bytes[2] = cause;
            Item::Unit(bytes)
        };
        let (own, others) = std::mem::take(&mut self.buffer)
            .into_iter()
            .partition::<Vec<_>, _>(|unit| unit[4] == address);
        self.buffer = others;
        let refusal = match self.answering {
            InterrogationBehavior::Silent => Some(None),
            InterrogationBehavior::Refusing => Some(Some(with_cause(7 | 0x40))),
            InterrogationBehavior::UnknownAddress => Some(Some(with_cause(46 | 0x40))),
            InterrogationBehavior::WithoutEnd | InterrogationBehavior::Whole => None,
        };
        if let Some(refusal) = refusal {
            self.queue.extend(own.into_iter().map(Item::Buffered));
            return self.queue.extend(refusal);
        }
        let mut items: Vec<_> =
            (1..=OBJECTS).map(|object| Item::Present((address, object), 20)).collect();
        // In their order, as a buffer is read.
        let mut place = 0;
        for event in own {
            place = self.random.usize(place..=items.len());
            items.insert(place, Item::Buffered(event));
            place += 1;
        }
        self.queue.push_back(with_cause(7));
        if self.random.u8(0..3) == 0 {
            // A live event before the buffer.
            let (place, value) = ((address, self.random.u8(1..=OBJECTS)), self.new_value());
            self.truth.insert(place, value);
            let time = self.stamp();
            self.queue.push_back(Item::Unit(unit(place, cause::SPONTANEOUS, value, &time)));
        }
        self.queue.extend(items);
        if self.answering == InterrogationBehavior::Whole {
            self.queue.push_back(with_cause(10));
        }
    }

    fn frame(&mut self, asdu: &[u8]) -> Vec<u8> {
        let (send, receive) = (Sequence::new(self.sent), Sequence::new(self.received));
        self.sent = send.next().number();
        let mut bytes = Vec::new();
        Frame::Information { send, receive, asdu }.write(&mut bytes);
        bytes
    }

    fn deliver(&mut self, asdu: &[u8], is_buffered: bool) {
        let place = (asdu[4], asdu[6]);
        let time = time_of(asdu, self.wall());
        if is_buffered {
            // Later, events count in order of arrival.
            let interrogated = self.interrogated.get(&place.0);
            let live = self.live_events.get(&place).filter(|_| {
                interrogated.is_none_or(|interrogated| self.elapsed < *interrogated + CATCH_UP)
            });
            let is_overtaken = time.zip(live).is_some_and(|(time, live)| time < *live);
            if !is_overtaken {
                let [b0, b1, b2, b3] = [asdu[9], asdu[10], asdu[11], asdu[12]];
                self.buffered.insert(place, f32::from_le_bytes([b0, b1, b2, b3]).into());
            }
        } else if asdu[0] == 13 {
            self.buffered.remove(&place);
            if matches!(asdu[2], cause::PERIODIC | cause::BACKGROUND | cause::INTERROGATED) {
                self.live_events.insert(place, self.wall());
            }
        } else if asdu[0] == 36
            && let Some(time) = time
        {
            self.live_events.insert(place, time);
        } else if asdu[0] == 70 || (asdu[0] == 100 && asdu[2] != 7) {
            self.live_events.clear();
        }
        let frame = self.frame(asdu);
        self.receive_information(&frame);
        self.judge();
    }

    fn deliver_damaged(&mut self, mut asdu: Vec<u8>, damage: Damage) {
        *self.counts.entry(damage).or_default() += 1;
        self.live_events.clear();
        let is_value = matches!(asdu[0], 13 | 14 | 36);
        match damage {
            Damage::Lost => {
                self.buffered.clear();
                self.frame(&asdu);
                self.is_frame_lost = true;
                return;
            }
            Damage::OversizedFrame => {
                self.buffered.clear();
                self.receive(&[0x68, 254, 0, 0, 0, 0]);
                return self.judge();
            }
            Damage::WrongStart => {
                self.buffered.clear();
                self.receive(&[0x69, 4, 0, 0]);
                return self.judge();
            }
            Damage::Repeated => {
                self.buffered.clear();
                let frame = self.frame(&asdu);
                self.receive_information(&frame);
                self.receive_information(&frame);
                return self.judge();
            }
            Damage::Reordered => {
                self.buffered.clear();
                let frame = self.frame(&asdu);
                let later = unit(self.any_place(), 3, -1.0, &[]);
                let later = self.frame(&later);
                self.receive_information(&later);
                self.receive_information(&frame);
                return self.judge();
            }
            Damage::Cut => {
                let length = self.random.usize(1..asdu.len());
                asdu.truncate(length);
            }
            Damage::Extended => asdu.extend(std::iter::repeat_n(7, self.random.usize(1..9))),
            Damage::WrongCount => asdu[1] = self.random.u8(2..=127),
            Damage::WrongSequenceBit => asdu[1] = 0x80 | self.random.u8(2..=127),
            Damage::UnknownType => {
                asdu[0] = *self.random.choice(&[0, 22, 29, 41, 44, 52, 69, 71, 128, 255]).unwrap();
            }
            Damage::UnknownCause => {
                asdu[2] = *self.random.choice(&[0, 6, 13, 14, 42, 43, 48, 63]).unwrap();
            }
            Damage::Negative if is_value => asdu[2] |= 0x40,
            // A confirmation may be negative: it is no value.
            Damage::Negative => asdu[2] = 0x40,
            // A single point where there is a measured value.
            Damage::Misassigned => {
                asdu = vec![1, 1, 3, 0, asdu[4], 0, self.random.u8(1..=OBJECTS), 0, 0, 1];
            }
            Damage::NoStation => {
                asdu = unit((*self.random.choice(&[0, 0xFF]).unwrap(), 1), 3, -1.0, &[]);
                asdu[5] = asdu[4];
            }
        }
        // Where the common address can be read, only its values are doubtful.
        let address = asdu.get(4).filter(|_| asdu.len() >= HEADER_BYTES).copied();
        let address = address.filter(|address| ADDRESSES.contains(address));
        self.buffered.retain(|place, _| address.is_some_and(|address| place.0 != address));
        let frame = self.frame(&asdu);
        self.receive_information(&frame);
        self.judge();
    }

    fn receive_information(&mut self, frame: &[u8]) {
        self.receive(frame);
        // The numbers showed it.
        assert!(!self.is_frame_lost || self.session.is_none());
    }

    /// Bytes in pieces, as a socket gives them.
    fn receive(&mut self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            let (piece, rest) = bytes.split_at(self.random.usize(1..=bytes.len()));
            bytes = rest;
            let (now, wall) = (self.now(), self.wall());
            let Some(session) = &mut self.session else { return };
            let station = &mut self.station;
            let outcome = session.receive(piece, now, |event| match event {
                Event::Started => station.begin(wall, now),
                Event::Asdu(asdu) => station.handle_answer(asdu, wall, now),
            });
            station.flush();
            if outcome.is_err() {
                return self.hang_up();
            }
        }
        self.note_samples();
    }

    fn note_samples(&mut self) {
        let samples = self.recorder.recording().samples;
        self.recorder.clear();
        let wall = self.wall();
        for sample in samples {
            let place = ((sample.tag / 100) as u8, (sample.tag % 100) as u8);
            self.shown.get_mut(&place).unwrap().take(&sample, wall);
        }
    }

    fn judge(&mut self) {
        for (place, shown) in &self.shown {
            self.judged += 1;
            if !shown.quality.is_good() {
                continue;
            }
            self.good += 1;
            let is_right = shown.value == Some(self.truth[place]);
            let is_of_buffer =
                shown.value.is_some() && shown.value == self.buffered.get(place).copied();
            let is_on_its_way = self.queue.iter().any(|item| is_about(item, *place));
            assert!(
                is_right || self.is_frame_lost || is_on_its_way || is_of_buffer,
                "seed {}: {place:?} is {shown:?} and should be {} after {:?}",
                self.seed,
                self.truth[place],
                self.elapsed
            );
        }
    }
}

/// Reports whether something that is not sent yet tells of an object's value.
fn is_about(item: &Item, place: Place) -> bool {
    match item {
        Item::Present(other, _) => *other == place,
        Item::Buffered(_) => false,
        Item::Unit(bytes) if bytes[0] == 70 => bytes[4] == place.0,
        Item::Unit(bytes) => {
            let is_of_process = matches!(bytes[0], 13 | 14 | 36) && bytes[2] & 0x80 == 0;
            is_of_process && (bytes[4], bytes[6]) == place
        }
    }
}

/// Returns the time of a value as the client reads it.
fn time_of(asdu: &[u8], wall: SystemTime) -> Option<SystemTime> {
    let Ok(Asdu { body: Body::Objects(mut objects), .. }) = Asdu::parse(asdu) else { return None };
    objects.next()?.time?.resolve(wall, Zone::Utc)
}

fn unit((address, object): Place, cause: u8, value: f64, time: &[u8]) -> Vec<u8> {
    let type_id = match time.len() {
        0 => 13,
        3 => 14,
        _ => 36,
    };
    let head = [type_id, 1, cause, 0, address, 0, object, 0, 0];
    [&head[..], &(value as f32).to_le_bytes(), &[0], time].concat()
}

impl DisplayedTag {
    /// By the rules of the host: order of arrival, but for what comes out of a buffer.
    fn take(&mut self, sample: &Sample, wall: SystemTime) {
        let Some(Value::F64(value)) = sample.value else {
            (self.quality, self.is_of_source) = (sample.quality, false);
            return;
        };
        let is_future = sample.source_time.is_some_and(|time| time > wall + MAX_AHEAD);
        let source_time = sample.source_time.filter(|_| !is_future);
        let valid_from = source_time.map_or(wall, |time| time.min(wall));
        let is_unusable = is_future || sample.flags.contains(SampleFlags::TIME_UNUSABLE);
        let quality = match sample.quality {
            Quality::Good if is_unusable => Quality::Uncertain(Reason::SourceTime),
            quality => quality,
        };
        let is_older = match (source_time, self.source_time) {
            (Some(time), Some(shown)) => time < shown,
            _ => self.value.is_some() && valid_from < self.valid_from,
        };
        if sample.flags.contains(SampleFlags::BUFFERED) && is_older {
            if !quality.is_good() {
                (self.quality, self.is_of_source) = (quality, false);
            }
            return;
        }
        let is_of_source =
            sample.flags.contains(SampleFlags::TEST) || (is_unusable && sample.quality.is_good());
        *self = Self { value: Some(value), quality, source_time, valid_from, is_of_source };
    }
}

#[test]
fn no_message_makes_a_wrong_value_good() {
    let (mut counts, mut good, mut judged) = (BTreeMap::<Damage, u32>::new(), 0, 0);
    let steps = matrix_steps(STEPS);
    for seed in 0..steps.div_ceil(STEPS_A_SEQUENCE) {
        let mut matrix = Matrix::new(seed);
        for step in 1..=STEPS_A_SEQUENCE {
            matrix.step();
            if step % 50 == 0 {
                matrix.settle();
            }
        }
        for (damage, count) in &matrix.counts {
            *counts.entry(*damage).or_default() += count;
        }
        (good, judged) = (good + matrix.good, judged + matrix.judged);
    }
    println!("{steps} steps: {judged} judged, {good} good; {counts:?}");
    // As many as in the sample at least, where there are not fewer steps.
    if steps >= STEPS {
        assert_eq!(counts.len(), DAMAGES.len());
        assert!(counts.values().all(|count| *count > 20), "{counts:?}");
    }
    assert!(good * 4 > judged, "{good} of {judged}");
}
