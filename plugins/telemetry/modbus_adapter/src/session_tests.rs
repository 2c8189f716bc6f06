use std::collections::BTreeSet;
use std::sync::atomic::{AtomicU16, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use busbar_link::TcpDial;
use busbar_plugin_sdk::testing::{Recorder, host};
use busbar_plugin_sdk::{Quality, TagSpec};
use serde_json::json;

use super::*;
use crate::Settings;
use crate::poll_group::MAX_RETRIES_PER_POLL;
use crate::tests::holding;
use crate::tests::server::{Server, at_once, illegal_address, right};

#[test]
fn polls_keep_their_beat() {
    let start = Instant::now();
    let at = |millis| start + Duration::from_millis(millis);
    let period = Duration::from_millis(100);
    assert_eq!(next_due(start, period, at(0)), at(100));
    assert_eq!(next_due(start, period, at(99)), at(100));
    assert_eq!(next_due(start, period, at(100)), at(200));
    assert_eq!(next_due(start, period, at(350)), at(400));
}

/// Simulated device: its refusals and a count of its requests.
#[derive(Default)]
struct Device {
    /// Number of requests to refuse, whatever they ask for.
    refusals: AtomicUsize,
    missing: Mutex<BTreeSet<u16>>,
    requests: AtomicU16,
}

impl Device {
    fn answer(&self, request: &[u8]) -> Vec<u8> {
        self.requests.fetch_add(1, Ordering::SeqCst);
        let first = u16::from_be_bytes([request[8], request[9]]);
        let cells = first..first + u16::from(request[11]);
        let less = |left: usize| left.checked_sub(1);
        let is_refused =
            self.refusals.fetch_update(Ordering::SeqCst, Ordering::SeqCst, less).is_ok()
                || self.missing.lock().unwrap().range(cells).next().is_some();
        if is_refused { illegal_address(request) } else { right(request) }
    }
}

/// A connected session with one poll group, polled by hand.
struct Bench {
    device: Arc<Device>,
    recorder: Recorder,
    session: Session,
    runtime: tokio::runtime::Runtime,
    link: Link,
    group: Group,
}

impl Bench {
    /// Tags are named by their register.
    fn new(registers: impl IntoIterator<Item = u16>) -> Self {
        let device = Arc::new(Device::default());
        let served = Arc::clone(&device);
        let server = Server::start(move |request| at_once(served.answer(request)));
        let settings = json!({"host": "127.0.0.1", "port": server.port, "timeout_seconds": 10});
        let config = serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap();
        let tags: Vec<TagSpec> =
            registers.into_iter().map(|register| holding(register.into(), register)).collect();
        let points = crate::address::parse(&tags, &config).unwrap();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        let recorder = Recorder::new();
        let dial = Arc::new(TcpDial { tls: None });
        let session = Session::new(config, dial, points, recorder.sink(), host());
        let link = runtime.block_on(session.connect()).unwrap();
        let group = session.groups().pop().unwrap();
        Self { device, recorder, session, runtime, link, group }
    }

    /// Requests of one poll.
    fn poll(&mut self) -> u16 {
        self.device.requests.store(0, Ordering::SeqCst);
        let poll = self.session.poll(&mut self.link, &mut self.group);
        self.runtime.block_on(poll).unwrap();
        self.device.requests.load(Ordering::SeqCst)
    }

    fn refuse_all(&self, is_on: bool) {
        let refusals = if is_on { usize::MAX } else { 0 };
        self.device.refusals.store(refusals, Ordering::SeqCst);
    }

    /// Makes the retries of all refused blocks due at once.
    fn make_retries_due(&mut self) {
        for refused in &mut self.group.refused {
            refused.retry_at = Instant::now();
        }
    }

    fn make_replan_due(&mut self) {
        assert!(self.group.replan_at.is_some());
        self.group.replan_at = Some(Instant::now());
    }

    /// Polls until all refused cells have been requested again, and once more.
    fn retry_all(&mut self) {
        self.make_retries_due();
        for _ in 0..=self.group.refused.len().div_ceil(MAX_RETRIES_PER_POLL) {
            self.poll();
        }
    }

    /// Tags that are not good, and why.
    fn bad(&self) -> Vec<(u32, Quality)> {
        let newest = |point: &Point| {
            let sample = self.recorder.latest(point.tag)?;
            (!sample.quality.is_good()).then_some((point.tag, sample.quality))
        };
        self.session.points.iter().filter_map(newest).collect()
    }
}

#[test]
fn a_device_that_recovers_is_asked_as_planned_again() {
    // The second is more than one poll can split.
    for registers in [10, 100] {
        let mut bench = Bench::new(0..registers);
        assert_eq!(bench.poll(), 1);
        bench.refuse_all(true);
        bench.poll();
        bench.refuse_all(false);
        assert!(bench.poll() <= registers);
        bench.retry_all();
        assert_eq!(bench.bad(), []);
        assert_eq!(bench.poll(), 1, "{registers}");
    }
}

#[test]
fn only_what_stays_refused_stays_apart() {
    let mut bench = Bench::new(0..20);
    bench.device.missing.lock().unwrap().insert(7);
    bench.refuse_all(true);
    bench.poll();
    bench.refuse_all(false);
    bench.retry_all();
    let configuration = Quality::Bad(Reason::Configuration);
    assert_eq!(bench.bad(), [(7, configuration)]);
    // 0 to 6, and 8 to 19.
    assert_eq!(bench.poll(), 2);
    bench.device.missing.lock().unwrap().clear();
    bench.retry_all();
    assert_eq!(bench.bad(), []);
    assert_eq!(bench.poll(), 1);
}

#[test]
fn a_split_without_a_refused_tag_does_not_last() {
    let mut bench = Bench::new(0..20);
    bench.device.refusals.store(1, Ordering::SeqCst);
    assert_eq!(bench.poll(), 3);
    assert_eq!(bench.poll(), 2);
    bench.make_replan_due();
    assert_eq!(bench.poll(), 1);
    assert_eq!(bench.poll(), 1);
    assert_eq!(bench.group.replan_at, None);
}

#[test]
fn planning_anew_in_vain_turns_no_tag_bad_and_thins_out() {
    // Every gap is refused: more splits than one poll has.
    let mut bench = Bench::new((0..100).map(|i| 2 * i));
    bench.device.missing.lock().unwrap().extend((0..100).map(|i| 2 * i + 1));
    while bench.poll() != 100 {}
    assert_eq!(bench.bad(), []);
    let mut pauses = Vec::new();
    for _ in 0..6 {
        bench.recorder.clear();
        bench.make_replan_due();
        bench.poll();
        let samples = bench.recorder.recording().samples;
        assert!(samples.iter().all(|sample| sample.quality.is_good()));
        assert_eq!(samples.len(), 100);
        assert_eq!(bench.poll(), 100);
        pauses.push(bench.group.replan_pause.as_secs());
    }
    assert_eq!(pauses, [120, 240, 480, 600, 600, 600]);
}

#[test]
fn tags_of_halves_that_wait_for_the_next_poll_are_bad() {
    let mut bench = Bench::new(0..100);
    bench.poll();
    assert_eq!(bench.bad(), []);
    bench.refuse_all(true);
    bench.poll();
    let configuration = Quality::Bad(Reason::Configuration);
    let expected: Vec<_> = (0..100).map(|tag| (tag, configuration)).collect();
    assert_eq!(bench.bad(), expected);
}
