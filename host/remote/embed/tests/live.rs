//! "Is it live?" judged from pixels, in shared memory and in an X11 window: under SIGSTOP, under
//! SIGKILL, and beside 20 busy processes.
//!
//! `BUSBAR_EMBED_FAULTS` says how often a signal strikes, `BUSBAR_LIVE_SECONDS` how long the
//! machine is busy.

mod common;
#[path = "common/x11_window.rs"]
mod x11_window;

use std::time::{Duration, Instant};

use busbar::abi::*;
use common::judge::*;
use common::*;
use e2e::busy_processes::BusyProcesses;
use rustix::process::{Pid, Signal, kill_process};
use x11_window::X11Window;

/// Default number of signals.
const FAULTS: u64 = 1;
/// Time for which a surface is watched after a signal.
const WATCHED: Duration = Duration::from_secs(2);
/// The longest that an old picture may pass for live, on each surface, whatever happens.
const MAX_OLD: Duration = Duration::from_secs(1);
/// Longest time from the end of a viewer to the hatching.
const MAX_UNCOVERED: Duration = Duration::from_millis(700);
/// Number of busy processes.
const LOAD: usize = 20;
/// The longest that a call of the program may take while the machine is that busy.
const MAX_BUSY_CALL: Duration = Duration::from_secs(5);

fn signals() -> u64 {
    e2e::number_from_environment("BUSBAR_EMBED_FAULTS", FAULTS)
}

fn strike(viewer: u32, signal: Signal) {
    let pid = Pid::from_raw(viewer as i32).expect("a viewer runs");
    kill_process(pid, signal).expect("it is there");
}

/// Stops and kills viewers; returns the longest time that an old picture passed for live.
#[allow(clippy::print_stderr)]
fn check_signals(name: &str, host: &mut Host, surface: &mut impl Surface) {
    let mut judge = Judge::learn(host, surface);
    for signal in [Signal::STOP, Signal::KILL] {
        let (mut longest, mut until_marked) = (Duration::ZERO, Duration::ZERO);
        for _ in 0..signals() {
            judge.wait_until_live(host, surface);
            let (viewer, struck) = (host.viewer(), Instant::now());
            strike(viewer, signal);
            let mut findings = Findings::default();
            while struck.elapsed() < WATCHED {
                judge.turn(host);
                let is_live = judge.look(host, surface, &mut findings);
                if is_live && host.viewer() == viewer {
                    until_marked = until_marked.max(struck.elapsed());
                }
                if !is_live && host.viewer() == viewer && signal == Signal::STOP {
                    keep(&surface.look(host).expect("there is one"), &format!("{name}_stopped"));
                }
            }
            longest = longest.max(findings.longest);
            if signal == Signal::STOP {
                assert_eq!(host.viewer(), viewer, "one that is stopped is not ended at once");
                strike(viewer, Signal::CONT);
            }
        }
        eprintln!(
            "{name}, {signal:?}: an old picture passed for live for {longest:?} at most, marked \
             {until_marked:?} after the signal"
        );
        assert!(longest <= MAX_OLD, "{name}, {signal:?}: live for {longest:?}");
        assert!(until_marked <= MAX_UNCOVERED, "{name}, {signal:?}: {until_marked:?}");
    }
    judge.wait_until_live(host, surface);
}

/// Loads the machine; returns the longest time that an old picture passed for live. No viewer ends.
#[allow(clippy::print_stderr)]
fn check_busy(name: &str, host: &mut Host, surface: &mut impl Surface) {
    let mut judge = Judge::learn(host, surface);
    judge.wait_until_live(host, surface);
    let (viewer, seconds) = (host.viewer(), e2e::live_seconds());
    host.events.clear();
    let load = BusyProcesses::start(LOAD);
    let start = Instant::now();
    let findings = judge.watch(host, surface, Duration::from_secs(seconds));
    let took = start.elapsed();
    keep(&surface.look(host).expect("there is one"), &format!("{name}_busy"));
    drop(load);
    let lost = |liveness| {
        let is_lost = |e: &&Happened| e.kind == BusbarViewEventKind::Lost && e.liveness == liveness;
        host.events.iter().filter(is_lost).count()
    };
    let Findings { looks, live, unread, longest } = findings;
    eprintln!(
        "{name}, {LOAD} busy processes, {took:.1?}: an old picture passed for live for \
         {longest:?} at most; {looks} looks, {live} of them live, {unread} unread; late {} \
         times, lost {} times; longest call {:?}",
        lost(BusbarViewLiveness::Late),
        lost(BusbarViewLiveness::Dead),
        host.longest_call,
    );
    assert_eq!(host.viewer(), viewer, "a viewer that made progress was ended");
    assert!(looks > 0, "nobody looked");
    assert!(longest <= MAX_OLD, "{name}: live for {longest:?}");
    assert!(host.longest_call < MAX_BUSY_CALL, "a call took {:?}", host.longest_call);
    // That it is this long on such a machine is no fault of the library.
    host.longest_call = Duration::ZERO;
}

#[test]
fn memory_under_signals() {
    let scene = scene_of_one_label();
    let mut host = Host::open_with(&scene, |options| options.max_restart_millis = 1);
    host.wait_for(BusbarViewEventKind::Ready);
    host.arrive();
    check_signals("memory", &mut host, &mut SharedMemory);
}

#[test]
fn memory_beside_busy_processes() {
    let scene = scene_of_one_label();
    let mut host = Host::open(&scene);
    host.wait_for(BusbarViewEventKind::Ready);
    host.arrive();
    check_busy("memory", &mut host, &mut SharedMemory);
}

#[test]
fn window_under_signals() {
    let Some(mut window) = X11Window::open() else { return };
    let scene = scene_of_one_label();
    let mut host = window.host(&scene);
    host.wait_for(BusbarViewEventKind::Ready);
    check_signals("window", &mut host, &mut window);
}

#[test]
fn window_beside_busy_processes() {
    let Some(mut window) = X11Window::open() else { return };
    let scene = scene_of_one_label();
    let mut host = window.host(&scene);
    host.wait_for(BusbarViewEventKind::Ready);
    check_busy("window", &mut host, &mut window);
}
