//! Slow is not hung: a played viewer that is late, sleeps, turns without end, is stopped or dead,
//! and what becomes of it and of its picture.
//!
//! The viewer is this test's own program: it speaks the protocol, and draws one colour.

mod common;

use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

use busbar::abi::*;
use busbar_client::liveness::{MAX_ASLEEP, MAX_STOPPED, MAX_WITHOUT_FRAME};
use busbar_protocol::message::{MAX_MESSAGE_BYTES, ViewerMessage};
use busbar_protocol::pictures::{Area, PictureMemory, PictureWriter, now};
use busbar_protocol::{framing, socket};
use common::*;
use rustix::process::{Signal, getpid, kill_process};

/// Part that this program plays when a library starts it as a viewer.
const PART: &str = "BUSBAR_PLAYED_VIEWER";
const SIZE: [u32; 2] = [64, 48];
/// Pictures that a part begins with, all in time, and the time between them.
const GOOD_PICTURES: usize = 20;
const PERIOD: Duration = Duration::from_millis(100);
/// Time that a frame of the slow part takes.
const SLOW_FRAME: Duration = Duration::from_millis(2500);
/// Time for which nobody ends the slow part, where `BUSBAR_LIVE_SECONDS` says nothing: longer
/// than a viewer may sleep or be stopped.
const SLOW_SECONDS: u64 = 12;
/// Limit of the library where nobody says: a picture is live no longer.
const SILENT: Duration = Duration::from_millis(500);
/// Slack that a busy machine may add to any of the times.
const SLACK: Duration = Duration::from_secs(5);

/// Plays the viewer: begins well, and then plays its part. Does nothing where no library started
/// it.
#[test]
fn played_viewer() {
    let Ok(part) = std::env::var(PART) else { return };
    let stdin = std::io::stdin();
    let owned = stdin.as_fd().try_clone_to_owned().expect("a library's socket");
    let socket = UnixStream::from(owned);
    let first = socket::receive(&socket, MAX_MESSAGE_BYTES).expect("it speaks");
    let (_, files) = first.expect("it is there");
    let memory = PictureMemory::open(&files[0]).expect("memory of pictures");
    let mut writer = PictureWriter::new(memory.clone());
    if part != "dead" {
        let memory = memory.clone();
        std::thread::spawn(move || {
            loop {
                memory.beat();
                std::thread::sleep(PERIOD);
            }
        });
    }
    let ready = ViewerMessage::Ready { device: "played".into() };
    let ready = framing::encode(&ready, MAX_MESSAGE_BYTES).expect("it is short");
    let mut number = 0_u8;
    let mut frame = |work: &dyn Fn()| {
        let (began, true_at) = (Instant::now(), now());
        work();
        number = number.wrapping_add(1);
        let changed = Area { x: 0, y: 0, width: SIZE[0], height: SIZE[1] };
        let red = |pixels: &mut [u8]| {
            pixels
                .chunks_exact_mut(4)
                .for_each(|pixel| pixel.copy_from_slice(&[number, 0, 200, 255]));
        };
        writer.publish(SIZE, changed, true_at, red).expect("there is room");
        memory.beat();
        memory.note_turn(began.elapsed());
    };
    frame(&|| {});
    socket::send(&socket, &ready, &[]).expect("the library is there");
    for _ in 0..GOOD_PICTURES {
        std::thread::sleep(PERIOD);
        frame(&|| {});
    }
    // The end of the library is that of this process.
    std::thread::spawn(move || {
        while let Ok(Some(_)) = socket::receive(&socket, MAX_MESSAGE_BYTES) {}
        std::process::exit(0);
    });
    match part.as_str() {
        "slow" => loop {
            frame(&|| spin(SLOW_FRAME));
        },
        "busy" => loop {
            spin(SLOW_FRAME);
        },
        "stopped" => kill_process(getpid(), Signal::STOP).expect("it is ours"),
        _ => {}
    }
    loop {
        std::thread::sleep(Duration::from_secs(60));
    }
}

fn spin(time: Duration) {
    let start = Instant::now();
    while start.elapsed() < time {
        std::hint::spin_loop();
    }
}

/// A view whose viewer plays a part.
fn open(part: &str) -> Host {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("played");
    let own = std::env::current_exe().expect("a test has a path");
    let script = format!(
        "#!/bin/sh\nexport {PART}={part}\nexec '{}' --exact played_viewer --nocapture\n",
        own.display()
    );
    std::fs::write(&path, script).expect("it is written");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o700)).expect("it is ours");
    let config = std::ffi::CString::new("/none.json").expect("no zero byte");
    let program = std::ffi::CString::new(path.to_str().expect("UTF-8")).expect("no zero byte");
    let mut host = Host::open_program(&config, &program, [SIZE[0], SIZE[1]]);
    host.wait_for(BusbarViewEventKind::Ready);
    host
}

/// Observed fate of a viewer and its picture.
#[derive(Debug, Default)]
struct Course {
    /// Time until the library ended the viewer; none where it did not.
    ended_after: Option<Duration>,
    /// Ages of the oldest picture that was called live, and whether one that was not looked live.
    oldest_live: Duration,
    unmarked: u32,
    late: u32,
    dead: u32,
}

/// Follows a view from its last good picture on.
fn follow(host: &mut Host, time: Duration) -> Course {
    let viewer = host.viewer();
    let (mut course, start) = (Course::default(), Instant::now());
    let good = PERIOD * GOOD_PICTURES as u32;
    while start.elapsed() < time + good {
        host.turn();
        if host.viewer() != viewer {
            course.ended_after = Some(start.elapsed().saturating_sub(good));
            break;
        }
        let Some(frame) = host.frame() else { continue };
        match frame.liveness {
            BusbarViewLiveness::Live => course.oldest_live = course.oldest_live.max(frame.age),
            liveness => {
                course.late += u32::from(liveness == BusbarViewLiveness::Late);
                course.dead += u32::from(liveness == BusbarViewLiveness::Dead);
                course.unmarked += u32::from(!looks_dead(&frame));
            }
        }
    }
    course
}

/// Checks one part; `ended` is when the library ends the viewer, none for never within `time`.
#[allow(clippy::print_stderr)]
fn check(part: &str, time: Duration, ended: Option<Duration>) -> Course {
    let mut host = open(part);
    let course = follow(&mut host, time);
    eprintln!("{part}: {course:?}");
    assert!(course.oldest_live <= SILENT, "{part}: {course:?}");
    assert_eq!(course.unmarked, 0, "{part}: {course:?}");
    match (ended, course.ended_after) {
        (None, after) => assert_eq!(after, None, "{part}: one that makes progress is ended"),
        (Some(ended), Some(after)) => {
            assert!(after + PERIOD * 10 >= ended, "{part}: ended after {after:?}");
            assert!(after <= ended + SLACK, "{part}: ended after {after:?}");
        }
        (Some(_), None) => panic!("{part}: it is not ended"),
    }
    host.wait("loss or lateness", |event| event.kind == BusbarViewEventKind::Lost);
    course
}

#[test]
fn slow_is_not_hung_and_hung_is_ended() {
    let hung = Duration::from_secs(1);
    std::thread::scope(|scope| {
        let seconds = e2e::number_from_environment("BUSBAR_LIVE_SECONDS", SLOW_SECONDS);
        let slow = scope.spawn(move || check("slow", Duration::from_secs(seconds), None));
        let dead = scope.spawn(move || check("dead", MAX_ASLEEP + SLACK, Some(hung)));
        let asleep = || check("asleep", MAX_ASLEEP + SLACK, Some(MAX_ASLEEP));
        let asleep = scope.spawn(asleep);
        let stopped = || check("stopped", MAX_STOPPED + SLACK, Some(MAX_STOPPED));
        let stopped = scope.spawn(stopped);
        // A frame loop that turns without end is ended by its bound.
        let busy = || check("busy", MAX_WITHOUT_FRAME + SLACK, Some(MAX_WITHOUT_FRAME));
        let busy = scope.spawn(busy);
        let slow = slow.join().expect("slow");
        assert!(slow.late > 0 && slow.dead == 0, "{slow:?}");
        let dead = dead.join().expect("dead");
        assert!(dead.dead > 0, "{dead:?}");
        let asleep = asleep.join().expect("asleep");
        assert!(asleep.late > 0 && asleep.dead == 0, "{asleep:?}");
        let stopped = stopped.join().expect("stopped");
        assert!(stopped.dead > 0, "{stopped:?}");
        let busy = busy.join().expect("busy");
        assert!(busy.late > 0 && busy.dead == 0, "{busy:?}");
    });
}
