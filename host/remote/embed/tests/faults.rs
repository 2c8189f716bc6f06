//! Viewers that die, hang and stop: the program goes on, sees that its picture is dead, and
//! gets a live one back.
//!
//! `BUSBAR_EMBED_FAULTS` says how often each happens.

mod common;

use std::time::{Duration, Instant};

use busbar::abi::*;
use common::*;
use rustix::process::{Pid, Signal, kill_process};

/// Default number of strikes of each fault.
const FAULTS: u64 = 3;
const VARIABLE: &str = "BUSBAR_EMBED_FAULTS";
/// Longest time that a picture passes for live after its viewer stopped: 500 ms, and a scheduling
/// delay of a busy machine.
const MAX_UNNOTICED: Duration = Duration::from_millis(800);
/// Growth of the program's own memory that a view may cost after its first faults, bytes.
const MAX_GROWTH: u64 = 8 << 20;

fn faults() -> u64 {
    e2e::number_from_environment(VARIABLE, FAULTS)
}

fn strike(viewer: u32, signal: Signal) {
    let pid = Pid::from_raw(viewer as i32).expect("a viewer runs");
    kill_process(pid, signal).expect("it is there");
}

/// Recovery times of one kind of fault.
#[derive(Default)]
struct Times {
    until_dead: Vec<Duration>,
    until_correct: Vec<Duration>,
}

#[test]
#[allow(clippy::print_stderr)]
fn a_program_outlives_its_viewers() {
    let scene = scene();
    let mut host = Host::open_with(&scene, |options| options.max_restart_millis = 1);
    host.wait_for(BusbarViewEventKind::Ready);
    host.set_tag(TOP_OIL, 120.0);
    shelve(&mut host);
    let correct = host.arrive();
    save(&correct, "correct");
    let mut used = None;
    for signal in [Signal::KILL, Signal::ABORT, Signal::STOP] {
        let mut times = Times::default();
        for number in 0..faults() {
            fault(&mut host, signal, &correct, &mut times);
            // Buffers have their sizes by then.
            if number == 0 && signal == Signal::KILL {
                used = Some(own_use());
            }
        }
        let Times { mut until_dead, mut until_correct } = times;
        let mut ms = |share| {
            let dead = percentile(&mut until_dead, share).as_millis();
            (dead, percentile(&mut until_correct, share).as_millis())
        };
        let ((dead_50, back_50), (dead_99, back_99)) = (ms(0.5), ms(0.99));
        eprintln!(
            "{} times {signal:?}: dead after {dead_50} ms (p50), {dead_99} ms (p99); correct \
             again after {back_50} ms (p50), {back_99} ms (p99); longest call {:?}",
            faults(),
            host.longest_call,
        );
    }
    // The next viewer's memory may be there already.
    let (descriptors, bytes) = used.expect("at least one fault");
    let (descriptors_after, bytes_after) = own_use();
    assert!(
        descriptors_after <= descriptors,
        "{descriptors} descriptors, then {descriptors_after}"
    );
    assert!(bytes_after < bytes + MAX_GROWTH, "{bytes} bytes, then {bytes_after}");
}

/// Injects one fault: the picture dies in time, looks dead, and a viewer comes back that shows the
/// same.
fn fault(host: &mut Host, signal: Signal, correct: &Shown, times: &mut Times) {
    let viewer = host.viewer();
    host.events.clear();
    strike(viewer, signal);
    let struck = Instant::now();
    let dead =
        host.wait_for_frame("that is dead", |frame| frame.liveness == BusbarViewLiveness::Dead);
    let until_dead = struck.elapsed();
    assert!(looks_dead(&dead), "{signal:?}: a dead picture looks live");
    assert_eq!(dead.damage, [0, 0, 640, 360], "all of it is drawn anew");
    assert!(until_dead < MAX_UNNOTICED, "{signal:?}: live for {until_dead:?}");
    host.wait_for(BusbarViewEventKind::Lost);
    host.wait_for_frame("that is correct again", |frame| {
        frame.liveness == BusbarViewLiveness::Live && frame.pixels == correct.pixels
    });
    times.until_correct.push(struck.elapsed());
    times.until_dead.push(until_dead);
    host.wait_for(BusbarViewEventKind::Recovered);
    assert_ne!(host.viewer(), viewer, "it is another process");
    let shelved = |e: &Happened| e.kind == BusbarViewEventKind::Alarm && e.id == ALARM;
    let alarm = host.wait("state of the alarm", shelved);
    assert_eq!(alarm.alarm_state, BusbarViewAlarmState::Shelved, "the shelf outlives the viewer");
}

fn shelve(host: &mut Host) {
    let alarm = std::ffi::CString::new(ALARM).expect("no zero byte in it");
    let of_alarm =
        |state| move |e: &Happened| e.kind == BusbarViewEventKind::Alarm && e.alarm_state == state;
    host.wait("alarm", of_alarm(BusbarViewAlarmState::Unacknowledged));
    let shelve = |view| {
        let (action, nobody) = (BusbarViewAlarmAction::Shelve as u32, std::ptr::null());
        // SAFETY: an open view and texts that end.
        unsafe {
            busbar::commands::busbar_view_act_on_alarm(view, alarm.as_ptr(), action, 3000, nobody)
        }
    };
    assert_eq!(host.call(shelve), BusbarStatus::Ok);
    host.wait("shelved alarm", of_alarm(BusbarViewAlarmState::Shelved));
}

#[test]
fn a_viewer_that_goes_on_in_time_is_not_started_again() {
    let scene = scene_of_one_label();
    let mut host = Host::open_with(&scene, |options| options.hung_millis = 20_000);
    let before = host.look_around();
    let viewer = host.viewer();
    strike(viewer, Signal::STOP);
    host.wait_for(BusbarViewEventKind::Lost);
    let dead =
        host.wait_for_frame("that is dead", |frame| frame.liveness == BusbarViewLiveness::Dead);
    assert!(looks_dead(&dead));
    strike(viewer, Signal::CONT);
    host.wait_for(BusbarViewEventKind::Recovered);
    host.wait_for_frame("as before", |frame| {
        frame.liveness == BusbarViewLiveness::Live && frame.pixels == before.pixels
    });
    assert_eq!(host.viewer(), viewer);
}

#[test]
fn a_view_ends_with_its_program() {
    let scene = scene();
    let mut host = Host::open(&scene);
    host.wait_for(BusbarViewEventKind::Ready);
    let viewer = host.viewer();
    drop(host);
    let process = format!("/proc/{viewer}");
    e2e::wait_for("the viewer's end", Duration::from_secs(5), || {
        (!std::path::Path::new(&process).exists()).then_some(())
    });
}
