use std::process::{Child, Command};

use rustix::process::{Pid, Signal, kill_process};

use super::*;

const LIMITS: LivenessLimits =
    LivenessLimits { silent: Duration::from_millis(500), hung: Duration::from_millis(1000) };

fn millis(millis: u64) -> Duration {
    Duration::from_millis(millis)
}

/// A viewer that is well, with a picture of this age.
fn well(picture_age: u64) -> LivenessSample {
    LivenessSample {
        picture_age: Some(millis(picture_age)),
        without_frame: Duration::ZERO,
        without_heartbeat: Duration::ZERO,
        without_progress: Duration::ZERO,
        frame_time: millis(20),
        activity: Activity::Running,
    }
}

fn check(signs: LivenessSample, expected: Liveness) {
    assert_eq!(assess(&signs, &LIMITS), expected, "{signs:?}");
}

#[test]
fn a_picture_passes_for_live_by_the_age_of_what_it_shows() {
    check(well(0), Liveness::Live);
    check(well(500), Liveness::Live);
    // However well the viewer is: a frame of 4.5 s shows values of 4.5 s ago.
    check(well(501), Liveness::Late);
    check(LivenessSample { frame_time: millis(4500), ..well(4500) }, Liveness::Late);
    check(LivenessSample { picture_age: None, ..well(0) }, Liveness::Late);
}

#[test]
fn silence_is_loss_unless_the_process_makes_progress() {
    let silent =
        LivenessSample { without_frame: millis(600), without_heartbeat: millis(600), ..well(600) };
    for activity in [Activity::Running, Activity::Starved, Activity::Blocked] {
        check(LivenessSample { activity, ..silent }, Liveness::Late);
    }
    let asleep =
        LivenessSample { activity: Activity::Idle, without_progress: millis(600), ..silent };
    check(asleep, Liveness::Lost);
    // One that a signal stopped is lost before its picture is old.
    check(LivenessSample { activity: Activity::Stopped, ..well(100) }, Liveness::Lost);
}

#[test]
fn nothing_that_makes_progress_is_ended_within_the_bound() {
    let slow = |activity, seconds: u64| LivenessSample {
        activity,
        without_frame: millis(seconds * 1000),
        without_heartbeat: millis(seconds * 1000),
        ..well(seconds * 1000)
    };
    for activity in [Activity::Running, Activity::Starved, Activity::Blocked] {
        for seconds in 1..MAX_WITHOUT_FRAME.as_secs() {
            check(slow(activity, seconds), Liveness::Late);
        }
        check(slow(activity, MAX_WITHOUT_FRAME.as_secs()), Liveness::Hung);
    }
    // Measured frame times give more patience, up to a limit.
    let slow_frames =
        |seconds| LivenessSample { frame_time: millis(10_000), ..slow(Activity::Running, seconds) };
    check(slow_frames(79), Liveness::Late);
    check(slow_frames(80), Liveness::Hung);
    let slowest = LivenessSample { frame_time: Duration::MAX, ..slow(Activity::Running, 120) };
    check(slowest, Liveness::Hung);
}

#[test]
fn what_hangs_is_ended() {
    let dead = |silence: u64| LivenessSample {
        activity: Activity::Idle,
        without_frame: millis(silence),
        without_heartbeat: millis(silence),
        without_progress: millis(silence),
        ..well(silence)
    };
    check(dead(999), Liveness::Lost);
    check(dead(1000), Liveness::Hung);
    // The heartbeat goes on, the frame loop waits for ever.
    let deadlocked =
        |silence: u64| LivenessSample { without_heartbeat: Duration::ZERO, ..dead(silence) };
    check(deadlocked(4999), Liveness::Late);
    check(deadlocked(5000), Liveness::Hung);
    // The heartbeat goes on, and the frame loop turns without end.
    let livelocked =
        |silence: u64| LivenessSample { without_frame: millis(silence), ..well(silence) };
    check(livelocked(29_999), Liveness::Late);
    check(livelocked(30_000), Liveness::Hung);
    let stopped = |silence| LivenessSample { activity: Activity::Stopped, ..dead(silence) };
    check(stopped(9_999), Liveness::Lost);
    check(stopped(10_000), Liveness::Hung);
    check(LivenessSample { activity: Activity::Gone, ..well(0) }, Liveness::Hung);
    // A host program that asks for more patience gets it in each case.
    let patient = LivenessLimits { hung: millis(60_000), ..LIMITS };
    for signs in [dead(59_000), deadlocked(59_000), livelocked(59_000), stopped(59_000)] {
        assert_ne!(assess(&signs, &patient), Liveness::Hung, "{signs:?}");
    }
}

/// A process that ends with the test.
struct Victim(Child);

impl Victim {
    fn start(script: &str) -> Self {
        Self(Command::new("sh").args(["-c", script]).spawn().unwrap())
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_raw(self.0.id() as i32).unwrap(), signal).unwrap();
    }
}

impl Drop for Victim {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Samples a process without a heartbeat every 50 ms, until the verdict differs from `before`.
fn next_verdict(
    watch: &mut LivenessMonitor,
    true_at: u64,
    before: Liveness,
    limit: Duration,
) -> Liveness {
    let start = Instant::now();
    loop {
        let now = Instant::now();
        let boot_now = true_at + (now - start).as_nanos() as u64;
        let beats = LivenessInstants {
            heartbeat: 1,
            frame: 1,
            picture_true_at: true_at,
            ..LivenessInstants::default()
        };
        let verdict = assess(&watch.sample(beats, boot_now, now), &LIMITS);
        if verdict != before || start.elapsed() > limit {
            return verdict;
        }
        std::thread::sleep(millis(50));
    }
}

#[test]
fn a_busy_process_is_late_and_a_sleeping_one_hangs() {
    let busy = Victim::start("while :; do :; done");
    let mut watch = LivenessMonitor::new(busy.0.id(), Instant::now());
    assert_eq!(next_verdict(&mut watch, 1, Liveness::Live, millis(9000)), Liveness::Late);
    assert_eq!(next_verdict(&mut watch, 1, Liveness::Live, millis(9000)), Liveness::Late);
    let idle = Victim::start("exec sleep 60");
    let mut watch = LivenessMonitor::new(idle.0.id(), Instant::now());
    let first = next_verdict(&mut watch, 1, Liveness::Live, millis(9000));
    assert!(matches!(first, Liveness::Late | Liveness::Lost), "{first:?}");
}

#[test]
fn a_stopped_process_is_lost_before_its_picture_is_old() {
    let busy = Victim::start("while :; do :; done");
    let mut watch = LivenessMonitor::new(busy.0.id(), Instant::now());
    busy.signal(Signal::STOP);
    let start = Instant::now();
    let verdict = next_verdict(&mut watch, 1, Liveness::Live, millis(9000));
    assert_eq!(verdict, Liveness::Lost);
    assert!(start.elapsed() < millis(800), "{:?}", start.elapsed());
}

#[test]
fn whoever_was_held_up_itself_blames_nobody() {
    let idle = Victim::start("exec sleep 60");
    let start = Instant::now();
    let mut watch = LivenessMonitor::new(idle.0.id(), start);
    let beats = LivenessInstants {
        heartbeat: 1,
        frame: 1,
        picture_true_at: 1,
        ..LivenessInstants::default()
    };
    watch.sample(beats, 1, start);
    let hour = Duration::from_secs(3600);
    let signs = watch.sample(beats, hour.as_nanos() as u64, start + hour);
    assert_eq!(signs.picture_age, Some(hour - Duration::from_nanos(1)));
    assert_ne!(assess(&signs, &LIMITS), Liveness::Hung, "{signs:?}");
    assert!(!assess(&signs, &LIMITS).is_live());
}

#[test]
fn frame_times_are_those_that_were_measured_last() {
    let start = Instant::now();
    let mut watch = LivenessMonitor::new(std::process::id(), start);
    let mut look = |frame, time| {
        let beats =
            LivenessInstants { frame, frame_time: millis(time), ..LivenessInstants::default() };
        watch.sample(beats, 1, start).frame_time
    };
    assert_eq!(look(1, 700), millis(700));
    assert_eq!(look(1, 900), millis(700), "the same frame");
    assert_eq!(look(2, 30), millis(700), "the longest of the last");
    let last = (3..3 + FRAME_TIMES as u64).map(|frame| look(frame, 40)).last();
    assert_eq!(last, Some(millis(40)), "what is long ago is forgotten");
}
