use std::process::{Child, Command, Stdio};

use rustix::process::{Pid, Signal, kill_process};

use super::*;

/// Longer than two windows on a machine that does much else.
const PAUSE: Duration = Duration::from_millis(600);

/// A process that ends with the test.
struct Victim(Child);

impl Victim {
    fn start(script: &str) -> Self {
        let mut command = Command::new("sh");
        Self(command.args(["-c", script]).stdout(Stdio::null()).spawn().unwrap())
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_raw(self.0.id() as i32).unwrap(), signal).unwrap();
    }

    /// Activity over some time.
    fn activity(&self) -> Activity {
        let mut meter = ProgressMeter::new(self.0.id());
        meter.observe(Instant::now());
        std::thread::sleep(PAUSE);
        meter.observe(Instant::now())
    }
}

impl Drop for Victim {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn processes_that_work_sleep_stop_and_end_are_told_apart() {
    let busy = Victim::start("while :; do :; done");
    assert!(busy.activity().is_progress());
    busy.signal(Signal::STOP);
    assert_eq!(busy.activity(), Activity::Stopped);
    assert!(ProgressMeter::new(busy.0.id()).is_stopped());
    busy.signal(Signal::CONT);
    assert!(busy.activity().is_progress());
    let idle = Victim::start("exec sleep 60");
    std::thread::sleep(PAUSE);
    assert_eq!(idle.activity(), Activity::Idle);
    // A zombie until it is waited for.
    idle.signal(Signal::KILL);
    std::thread::sleep(PAUSE);
    assert_eq!(idle.activity(), Activity::Gone);
    assert_eq!(ProgressMeter::new(u32::MAX).observe(Instant::now()), Activity::Gone);
}

#[test]
fn readings_are_judged_by_states_and_cpu_time() {
    let window = Duration::from_secs(1);
    let idle = Reading { cpu_nanos: 5, ..Reading::default() };
    let ran = |share: f64| Reading { cpu_nanos: 5 + (share * 1e9) as u64, ..idle };
    assert_eq!(activity(&idle, &ran(0.0), window), Activity::Idle);
    assert_eq!(activity(&idle, &ran(0.002), window), Activity::Idle, "a heartbeat");
    assert_eq!(activity(&idle, &ran(0.05), window), Activity::Running);
    let ready = Reading { is_ready: true, ..idle };
    assert_eq!(activity(&idle, &ready, window), Activity::Starved);
    let blocked = Reading { is_blocked: true, ..idle };
    assert_eq!(activity(&idle, &blocked, window), Activity::Blocked);
    let stopped = Reading { is_stopped: true, is_ready: true, ..ran(0.5) };
    assert_eq!(activity(&idle, &stopped, window), Activity::Stopped);
    // Threads that ended take their CPU time along.
    assert_eq!(activity(&ran(0.5), &idle, window), Activity::Idle);
    assert_eq!(activity(&idle, &gone(), window), Activity::Gone);
}

#[test]
fn time_without_a_cpu_is_told_from_time_on_one() {
    let window = Duration::from_secs(1);
    let none = Reading::default();
    let half = Reading { cpu_nanos: 400_000_000, starved_nanos: 500_000_000, ..none };
    assert_eq!(starved_between(&none, &half, window), Duration::from_millis(500));
    let waits = Reading { is_ready: true, ..none };
    assert_eq!(starved_between(&none, &waits, window), window);
    let spins = Reading { cpu_nanos: 990_000_000, is_ready: true, ..none };
    assert_eq!(starved_between(&none, &spins, window), Duration::ZERO);
    let many = Reading { starved_nanos: 9_000_000_000, ..none };
    assert_eq!(starved_between(&none, &many, window), window);
}
