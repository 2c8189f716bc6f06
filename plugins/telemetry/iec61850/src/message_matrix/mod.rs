//! Message matrix: seeded sequences of reports and answers that are lost, cut, oversized,
//! unknown, misassigned, repeated and reordered, from buffered and unbuffered blocks of
//! servers that start anew, through sockets' bytes and all, against an oracle that knows the
//! truth at every step.
//!
//! `BUSBAR_MATRIX_STEPS` sets the count of steps.

mod damage;
mod delivery;
mod device;
mod report_block;

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use busbar_link::TcpDial;
use busbar_plugin_sdk::testing::{
    FaultGenerator, TruthMoment, TruthOracle, host, matrix_steps, tag_spec,
};
use busbar_plugin_sdk::{Reason, TagSpec};
use iec61850_rs::proto::mms::association::{Association, AssociationConfig, AssociationEvent};
use serde_json::json;

use self::device::{
    BLOCKS, DOMAIN, Device, OBJECTS, OBJECTS_A_BLOCK, Reply, ServerQuirks, object_item,
};
use self::report_block::{Instants, Outgoing};
use crate::link::{Link, parameters};
use crate::points::Points;
use crate::server::{Job, Server};
use crate::session::Session;
use crate::settings::Settings;

/// Steps where the environment sets none, and steps with faults of one sequence.
const STEPS: u64 = 60_000;
const STEPS_A_SEQUENCE: u64 = 600;
/// Time within which all is good again where nothing fails any more: an answer that does not
/// come, connecting, an interrogation that does not come, and a block that is tried again.
const RECOVERY: Duration = Duration::from_secs(40);
const CALM_STEP: Duration = Duration::from_millis(100);
/// Time after which all messages on their way arrive with the next step; with that, shorter
/// than the pause by which the end of a buffer is told.
const MAX_DELAY: Duration = Duration::from_millis(200);
const MAX_STEP: Duration = Duration::from_millis(250);
const RECONNECT: Duration = Duration::from_secs(1);

/// Something on its way to the client.
enum Message {
    Report {
        outgoing: Outgoing,
        /// Marks a segment other than the first one.
        is_later_segment: bool,
        is_last: bool,
    },
    Answer {
        id: i64,
        reply: Reply,
        /// Reports that had arrived when it was asked for.
        asked: u64,
        /// Instant at which the answer was made.
        moment: TruthMoment,
    },
}

/// Arrivals of a block's reports.
#[derive(Clone, Copy, Default)]
struct Arrivals {
    /// Number of the last one since the block was enabled, by which a gap can be seen.
    number: Option<u32>,
    /// So far all segments of the present one came.
    is_run_whole: bool,
    /// Instant of the last report that did not arrive intact.
    lost: Option<TruthMoment>,
}

struct Matrix {
    link: Link,
    session: Option<Session<Job>>,
    peer: Association,
    device: Device,
    oracle: TruthOracle,
    random: FaultGenerator,
    start: Instant,
    /// Requests that the server did not look at yet.
    inbox: VecDeque<(i64, Vec<u8>, u64)>,
    wire: VecDeque<Message>,
    /// Comes after others that were sent later.
    held: Option<Message>,
    arrivals: [Arrivals; BLOCKS],
    /// Count of reports that arrived, and that of the last one of each object.
    reports: u64,
    reported: [u64; OBJECTS],
    connect_at: Duration,
    /// Last time at which nothing was on its way.
    all_came_at: Duration,
    keys: u16,
}

fn tags() -> Vec<TagSpec> {
    let tag = |object: usize| {
        let item = object_item(object).replace("GGIO1$ST$", "GGIO1.");
        let address = json!({"reference": format!("{DOMAIN}/{item}"), "fc": "ST"});
        tag_spec(object as u32, &format!("object {object}"), Device::kind(object), address)
    };
    (0..OBJECTS).map(tag).collect()
}

fn quirks(random: &mut FaultGenerator) -> ServerQuirks {
    ServerQuirks {
        takes_options: random.one_in(2),
        has_reasons: random.one_in(2),
        names_data_sets: random.one_in(2),
        has_numbers: !random.one_in(4),
        shares_id: random.one_in(3),
        last_number: [255, 65_535, u32::MAX][random.below(3)],
        integrity: [Duration::from_secs(2), Duration::from_secs(1), Duration::ZERO]
            [random.below(3)],
        buffer_time: [Duration::ZERO, Duration::from_millis(300)][random.below(2)],
    }
}

/// Tags of the objects that blocks report.
fn tags_of(blocks: impl IntoIterator<Item = usize>) -> impl Iterator<Item = u32> {
    blocks.into_iter().flat_map(|block| {
        let first = (block * OBJECTS_A_BLOCK) as u32;
        first..first + OBJECTS_A_BLOCK as u32
    })
}

impl Matrix {
    fn new(seed: u64) -> Self {
        let mut random = FaultGenerator::new(seed);
        let rarity = [4, 12, 40, 150][random.below(4)];
        let quirks = quirks(&mut random);
        let tags = tags();
        let oracle =
            TruthOracle::new(seed, Duration::ZERO, &tags).with_delay(2 * MAX_DELAY + MAX_STEP);
        let blocks = ["BR.b0", "RP.u1", "RP.u2"]
            .map(|block| json!({ "rcb": format!("{DOMAIN}/LLN0.{block}") }));
        let settings = json!({"host": "127.0.0.1", "reports": blocks});
        let settings: Settings = serde_json::from_value(settings).unwrap();
        let config = settings.parse().unwrap();
        let points = Points::parse(&tags).unwrap();
        let server = Server::new(&config, points, oracle.sink(), host());
        let sink = oracle.sink();
        let (now, wall, before) = (oracle.now(), oracle.wall_clock(), oracle.moment());
        let at = Instants { now, wall, before };
        let link = Link { server, config, sink, dial: Arc::new(TcpDial { tls: None }) };
        let mut matrix = Self {
            link,
            session: None,
            peer: Association::server(AssociationConfig::default()),
            device: Device::new(quirks, at),
            oracle,
            random: random.with_rarity(rarity),
            start: Instant::now(),
            inbox: VecDeque::new(),
            wire: VecDeque::new(),
            held: None,
            arrivals: [Arrivals::default(); BLOCKS],
            reports: 0,
            reported: [0; OBJECTS],
            connect_at: Duration::ZERO,
            all_came_at: Duration::ZERO,
            keys: 0,
        };
        matrix.link.server.end(Reason::NotConnected);
        matrix.sync();
        matrix
    }

    fn now(&self) -> Instant {
        self.start + self.oracle.now()
    }

    /// Tells the oracle what is true now.
    fn sync(&mut self) {
        for object in 0..OBJECTS {
            self.oracle.set_truth(object as u32, self.device.truth(object));
        }
        self.device.date(self.oracle.moment());
    }

    fn step(&mut self, elapsed: Duration, is_faulty: bool) {
        self.oracle.advance(elapsed);
        let (now, wall, before) =
            (self.oracle.now(), self.oracle.wall_clock(), self.oracle.moment());
        self.device.at = Instants { now, wall, before };
        self.oracle.check();
        self.device.tick();
        self.sync();
        if is_faulty {
            self.disturb();
        } else {
            self.device.calm();
        }
        self.sync();
        self.queue_reports(is_faulty);
        self.advance_client();
        // What was reported before is sent before what is answered now.
        while !self.inbox.is_empty() {
            if is_faulty && self.random.one_in(4) {
                break;
            }
            self.answer(is_faulty);
        }
        let is_late = self.oracle.now() > self.all_came_at + MAX_DELAY;
        let mut count = if is_faulty && !is_late { self.random.below(8) } else { usize::MAX };
        while count > 0
            && self.session.is_some()
            && let Some(message) = self.wire.pop_front()
        {
            count -= 1;
            self.send(message, is_faulty);
            self.advance_client();
            self.oracle.check();
        }
        if self.wire.is_empty() && self.session.is_some() {
            // It comes at last.
            if let Some(held) = self.held.take() {
                self.deliver(held);
            }
            self.all_came_at = self.oracle.now();
        }
        self.oracle.check();
    }

    /// Changes the process, the server and the connection.
    fn disturb(&mut self) {
        while self.random.one_in(2) {
            let object = self.random.below(OBJECTS);
            self.device.change(object, &mut self.random, true);
            self.sync();
        }
        match self.random.below(400) {
            0 => self.close(),
            1 => {
                self.close();
                self.device.restart(&mut self.random);
            }
            2 => self.device.blocks[self.random.below(BLOCKS)].revision += 1,
            3..=5 => {
                let block = &mut self.device.blocks[0];
                let (is_live, object) = (block.is_enabled, self.random.below(OBJECTS_A_BLOCK));
                if is_live && block.options.buffer_overflow() {
                    // What is gathered, and a change, do not come into the buffer.
                    block.overflow();
                    self.device.change(object, &mut self.random, false);
                    self.sync();
                }
            }
            _ => {}
        }
    }

    fn queue_reports(&mut self, is_faulty: bool) {
        for outgoing in std::mem::take(&mut self.device.reports) {
            let is_segmented = is_faulty && self.random.one_in(5);
            let parts = match is_segmented {
                true => report_block::segments(&outgoing.report),
                false => vec![outgoing.report.clone()],
            };
            let count = parts.len();
            for (index, report) in parts.into_iter().enumerate() {
                self.wire.push_back(Message::Report {
                    outgoing: Outgoing { report, ..outgoing.clone() },
                    is_later_segment: index > 0,
                    is_last: index + 1 == count,
                });
            }
        }
    }

    fn answer(&mut self, is_faulty: bool) {
        let Some((id, request, asked)) = self.inbox.pop_front() else { return };
        let fails = (is_faulty && self.random.one_in(60)).then(|| self.random.below(OBJECTS));
        let was_enabled = self.device.blocks.iter().map(|b| b.is_enabled).collect::<Vec<_>>();
        let reply = self.device.answer(id, &request, fails);
        self.sync();
        let moment = self.oracle.moment();
        for (block, was_enabled) in was_enabled.into_iter().enumerate() {
            if self.device.blocks[block].is_enabled && !was_enabled {
                self.arrivals[block] = Arrivals::default();
            }
        }
        // A server may report what was in a buffer before it answers, or after.
        if is_faulty && self.random.one_in(2) {
            self.queue_reports(true);
        }
        self.wire.push_back(Message::Answer { id, reply, asked, moment });
        self.queue_reports(is_faulty);
    }

    fn advance_client(&mut self) {
        let now = self.now();
        if self.session.is_none() && self.connect_at <= self.oracle.now() {
            self.connect();
        }
        let Some(session) = &mut self.session else { return };
        let outcome = self.link.advance(session, now);
        let output = session.take_output();
        if outcome.is_err() {
            return self.close();
        }
        self.peer.on_bytes(iec61850_rs::Instant::ZERO, &output);
        while let Some(event) = self.peer.poll_event() {
            if let AssociationEvent::Request { invoke_id, pdu } = event {
                self.inbox.push_back((invoke_id, pdu, self.reports));
            }
        }
    }

    fn connect(&mut self) {
        let now = self.now();
        self.keys += 1;
        let parameters = parameters(&self.link.config).unwrap();
        let mut session = Session::new(&parameters, self.keys, now);
        session.start(now).unwrap();
        self.peer = Association::server(AssociationConfig::default());
        for _ in 0..4 {
            self.peer.on_bytes(iec61850_rs::Instant::ZERO, &session.take_output());
            while let Some(bytes) = self.peer.poll_transmit().map(<[u8]>::to_vec) {
                let endpoint = self.link.config.endpoints[0].clone();
                self.link.receive(&mut session, &endpoint, &bytes, now).unwrap();
            }
        }
        while self.peer.poll_event().is_some() {}
        self.session = Some(session);
    }

    /// The connection ends, at either end.
    fn close(&mut self) {
        if self.session.take().is_some() {
            self.link.server.end(Reason::Communication);
        }
        self.device.close();
        self.inbox.clear();
        self.wire.clear();
        self.held = None;
        self.arrivals = [Arrivals::default(); BLOCKS];
        self.connect_at = self.oracle.now() + RECONNECT;
    }

    /// Hands the client what the server's end has encoded.
    fn transmit(&mut self) {
        let now = self.now();
        let endpoint = self.link.config.endpoints[0].clone();
        while let Some(bytes) = self.peer.poll_transmit().map(<[u8]>::to_vec) {
            let Some(session) = &mut self.session else { return };
            if self.link.receive(session, &endpoint, &bytes, now).is_err() {
                self.close();
            }
        }
    }

    /// All is good again, where nothing fails any more.
    fn settle(&mut self) {
        // Without a period, what does not change is not told again, and goes stale.
        let is_repeated = !self.device.quirks.integrity.is_zero();
        let wanted: Vec<_> =
            (0..OBJECTS).filter(|o| is_repeated || *o >= BLOCKS * OBJECTS_A_BLOCK).collect();
        let end = self.oracle.now() + RECOVERY;
        loop {
            self.step(CALM_STEP, false);
            let is_well = wanted.iter().all(|&object| {
                let truth = self.device.truth(object);
                let tag = object as u32;
                self.oracle.is_good(tag) && self.oracle.shown(tag).value() == truth
            });
            if is_well {
                return;
            }
            if self.oracle.now() > end {
                return self.oracle.check_recovered();
            }
        }
    }

    fn run(&mut self, steps: u64) {
        for _ in 0..steps {
            let is_all_here = self.wire.is_empty() && self.held.is_none();
            let millis = match self.random.below(60) {
                0 if is_all_here => self.random.below(6000),
                _ => self.random.below(MAX_STEP.as_millis() as usize),
            };
            self.step(Duration::from_millis(millis as u64), true);
        }
        self.settle();
    }
}

#[test]
fn no_wrong_or_old_value_is_good_whatever_messages_do() {
    let steps = matrix_steps(STEPS);
    let (mut judged, mut good, mut signs, mut messages) = (0, 0, 0, 0);
    for seed in 0..steps.div_ceil(STEPS_A_SEQUENCE) {
        let mut matrix = Matrix::new(seed);
        matrix.run(STEPS_A_SEQUENCE.min(steps));
        let counts = matrix.oracle.counts();
        judged += counts.judged;
        good += counts.good;
        signs += counts.signs;
        messages += counts.messages;
    }
    println!("{steps} steps: {judged} judged, {good} good, {messages} messages, {signs} signs");
    assert!(good > judged / 5 && signs > steps / 100, "{good} of {judged}, {signs} signs");
}
