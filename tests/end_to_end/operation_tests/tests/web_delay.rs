//! Web page behind a line whose delay grows and beside busy processes, judged from the page's record
//! and its pixels: however steadily messages arrive, nothing older than a second passes for live.
//!
//! `BUSBAR_LIVE_SECONDS` says how long the machine is busy.

mod web_browser;

use std::net::SocketAddr;
use std::thread::sleep;
use std::time::Duration;

use e2e::busy_processes::BusyProcesses;
use e2e::clock_reader::{ClockReader, LEARNING_MILLIS};
use e2e::{Process, live_seconds};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::json;
use web_browser::delay_line::{Delay, DelayLine, Delays};
use web_browser::*;

/// Longest time after a fault in which the picture passes for live, milliseconds.
const MAX_OLD: u64 = 1000;
/// Observation time of a page after a fault.
const WATCHED: Duration = Duration::from_secs(6);
/// Number of busy processes, and the time of one look at them, milliseconds.
const BUSY_PROCESSES: usize = 20;
const LOOK_MILLIS: u64 = 5000;
/// Growth of the delay, seconds a second, at which beats each 250 ms arrive twice a second, older
/// and older.
const GROWTH: f64 = 0.95;

fn growing(growth: f64) -> Delay {
    Delay { at_first: Duration::ZERO, growth }
}

fn address_of(url: &str) -> SocketAddr {
    let address = url.trim_start_matches("http://").trim_end_matches('/');
    address.parse().expect("an address")
}

/// Process that a fault strikes.
#[derive(Clone, Copy, Debug)]
enum TargetProcess {
    Viewer,
    Server,
}

fn strike(server: &Process, victim: TargetProcess, signal: Signal) {
    match victim {
        TargetProcess::Server => server.signal(signal),
        TargetProcess::Viewer => {
            let viewer = Pid::from_raw(viewer_of(server) as i32).expect("a process");
            kill_process(viewer, signal).expect("it is there");
        }
    }
}

/// Measures the longest time in which a page passes for live after a fault, milliseconds: by its
/// own record, and by pixels. The latter is that of the last screenshot begun.
fn longest_old(
    browser: &mut Browser,
    struck: u64,
    pictures: &std::path::Path,
) -> (u64, Option<u64>) {
    let mut seen = None;
    while wall_millis() < struck + WATCHED.as_millis() as u64 {
        let begun = wall_millis();
        if browser.looks_live(&pictures.join("watched.png")) {
            seen = Some(begun.saturating_sub(struck));
        }
    }
    let spans = browser.live_spans();
    let last = spans.iter().map(|[_, end]| end.saturating_sub(struck)).max();
    (last.unwrap_or(0), seen)
}

#[test]
#[allow(clippy::print_stderr)]
fn nothing_passes_for_live_behind_a_growing_delay() {
    let Some(mut browser) = Browser::start() else { return };
    let scene = scene();
    let folder = scene.path("stats.json").parent().expect("a folder").to_owned();
    let (down, up) = (growing(GROWTH), growing(GROWTH));
    let none = Delay::default();
    let cases = [
        (TargetProcess::Viewer, Signal::STOP, Delays { down, up: none }, 300),
        (TargetProcess::Viewer, Signal::STOP, Delays { down, up: none }, 3000),
        (TargetProcess::Viewer, Signal::STOP, Delays { down: growing(0.3), up: growing(0.3) }, 300),
        (TargetProcess::Viewer, Signal::KILL, Delays { down, up }, 300),
        (TargetProcess::Server, Signal::STOP, Delays { down, up: none }, 300),
        (TargetProcess::Server, Signal::STOP, Delays { down: none, up }, 3000),
        (TargetProcess::Server, Signal::KILL, Delays { down, up: none }, 300),
    ];
    for (victim, signal, delays, lead_millis) in cases {
        let (server, url) = serve(&scene, "127.0.0.1:0", TOKEN, &[]);
        let line = DelayLine::start(address_of(&url));
        browser.ask("open", json!(format!("http://{}/?token={TOKEN}", line.address)));
        browser.until_looks_live(&folder.join("live.png"));
        browser.watch();
        line.set(delays);
        sleep(Duration::from_millis(lead_millis));
        let struck = wall_millis();
        strike(&server, victim, signal);
        let (recorded, seen) = longest_old(&mut browser, struck, &folder);
        eprintln!(
            "{victim:?} {signal:?}, delays {delays:?} for {lead_millis} ms: live for {recorded} ms \
             by its record, {} ms by its pixels",
            seen.map_or_else(|| "0".to_owned(), |seen| seen.to_string())
        );
        assert!(recorded <= MAX_OLD, "live for {recorded} ms by the page's record");
        assert!(seen.unwrap_or(0) <= MAX_OLD, "live for {seen:?} ms by pixels");
        browser.shot(&format!("web_delay_{victim:?}_{signal:?}").to_lowercase());
    }
}

#[test]
fn a_page_far_away_is_live_where_its_echo_is_quick_enough_and_comes_back() {
    let Some(mut browser) = Browser::start() else { return };
    let scene = scene();
    let (_server, url) = serve(&scene, "127.0.0.1:0", TOKEN, &[]);
    let line = DelayLine::start(address_of(&url));
    let constant = |millis| Delay { at_first: Duration::from_millis(millis), growth: 0.0 };
    line.set(Delays { down: constant(60), up: constant(60) });
    browser.ask("open", json!(format!("http://{}/?token={TOKEN}", line.address)));
    browser.until_live();
    // Beats come four times a second, each 2 s old.
    line.set(Delays { down: constant(2000), up: constant(0) });
    browser.until_dead("The picture comes too late");
    browser.ask("wait", json!(2500));
    browser.watch();
    browser.ask("wait", json!(4000));
    assert_eq!(browser.live_spans(), Vec::<[u64; 2]>::new(), "it is never live");
    browser.shot("web_late");
    line.set(Delays::default());
    browser.until_live();
    browser.expect_no_errors();
}

#[test]
#[allow(clippy::print_stderr)]
fn nothing_old_passes_for_live_beside_busy_processes() {
    let Some(mut browser) = Browser::start() else { return };
    let scene = scene();
    let (server, address) = serve(&scene, "127.0.0.1:0", TOKEN, &["--panels"]);
    browser.ask("open", json!(format!("{address}?token={TOKEN}")));
    browser.until_live();
    let record = scene.path("clock.json");
    let reader = ClockReader::learn(&browser.clock_looks(&record, LEARNING_MILLIS));
    let viewer = viewer_of(&server);
    let busy = BusyProcesses::start(BUSY_PROCESSES);
    let (until, mut live) = (wall_millis() + live_seconds() * 1000, 0);
    while wall_millis() < until {
        let found = reader.judge(browser.clock_looks(&record, LOOK_MILLIS));
        eprintln!("{found:?}");
        assert!(found.longest <= MAX_OLD, "live for {} ms", found.longest);
        assert!(found.unread * 10 <= found.live, "{found:?}");
        live += found.live;
    }
    assert!(live > 0, "nobody saw a live picture");
    browser.shot("web_busy");
    drop(busy);
    assert_eq!(viewer_of(&server), viewer, "a viewer that made progress was ended");
    browser.until_live();
}
