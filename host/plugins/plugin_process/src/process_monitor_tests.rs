use std::fs::{self, Permissions};
use std::io::{ErrorKind, Read, Write, pipe};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::process::Command;
use std::thread;

use busbar_plugin_host::{LoadRules, libraries};
use rustix::io::ioctl_fionbio;

use super::*;
use crate::catalog::DEFAULT_CONFINEMENT;
use crate::environment::Environment;
use crate::process_state::Connection;

/// A supervisor's end of a process that a test plays.
struct Played {
    shared: Shared,
    spawned: Option<SpawnedProcess>,
    there: UnixStream,
    _folder: tempfile::TempDir,
    _silent: std::io::PipeWriter,
}

impl Played {
    fn start(command: &mut Command) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("libslow.so");
        fs::write(&path, "").unwrap();
        fs::set_permissions(&path, Permissions::from_mode(0o755)).unwrap();
        let folders = [folder.path().canonicalize().unwrap()];
        let library = libraries(&folders, &LoadRules::default()).0.remove(0);
        let (here, there) = UnixStream::pair().unwrap();
        let (output, silent) = pipe().unwrap();
        ioctl_fionbio(&output, true).unwrap();
        let child = command.process_group(0).spawn().unwrap();
        let connection = Connection::new(here.try_clone().unwrap());
        let environment = Environment::default();
        let shared =
            Shared::new(library, DEFAULT_CONFINEMENT, environment, connection, child.id()).unwrap();
        let spawned = Some(SpawnedProcess { child, socket: here, output });
        Self { shared, spawned, there, _folder: folder, _silent: silent }
    }
}

/// A process that comes from a slow disk is asked nothing until it has said something; one
/// that was there and is silent goes.
#[test]
fn a_process_is_late_only_once_it_is_there() {
    let mut played = Played::start(Command::new("sleep").arg("60"));
    let (spawned, mut there) = (played.spawned.take().unwrap(), &played.there);
    let shared = &played.shared;
    let ended = thread::scope(|scope| {
        let ended = scope.spawn(move || ProcessMonitor::new(shared, spawned).run());
        there.set_read_timeout(Some(PING_PERIOD + HEARTBEAT_DEADLINE + 4 * TURN)).unwrap();
        let asked = there.read(&mut [0; 64]).map_err(|error| error.kind());
        assert_eq!(asked, Err(ErrorKind::WouldBlock), "it is still to come");
        assert!(!ended.is_finished());
        there.write_all(&framing::encode(&FromPlugin::Pong).unwrap()).unwrap();
        assert!(there.read(&mut [0; 64]).unwrap() > 0, "it is asked whether it lives");
        ended.join().unwrap()
    });
    assert!(ended.reason.starts_with("no heartbeat for 650ms"), "{}", ended.reason);
    assert!(!ended.requested);
}

/// A CPU that this process may use.
fn cpu() -> String {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap();
    list.trim().split([',', '-']).next().unwrap().to_owned()
}

/// A process that gets no CPU is slow; the same process that has one and does not answer hangs.
#[test]
fn a_starved_process_is_not_ended_for_being_late() {
    let on_cpu = |scheduling: &[&str]| {
        let mut command = Command::new("taskset");
        command.args(["-c", &cpu()]).args(scheduling);
        command.args(["sh", "-c", "while :; do :; done"]);
        command
    };
    // What runs only where nobody else wants to, beside one that always does.
    let mut other = on_cpu(&[]).spawn().unwrap();
    let mut played = Played::start(&mut on_cpu(&["chrt", "--idle", "0"]));
    let spawned = played.spawned.take().unwrap();
    // Until both are what they are to be.
    thread::sleep(Duration::from_millis(500));
    let (shared, mut there) = (&played.shared, &played.there);
    let ended = thread::scope(|scope| {
        let ended = scope.spawn(move || ProcessMonitor::new(shared, spawned).run());
        there.write_all(&framing::encode(&FromPlugin::Pong).unwrap()).unwrap();
        thread::sleep(HEARTBEAT_DEADLINE * 4);
        let is_over = ended.is_finished();
        other.kill().unwrap();
        other.wait().unwrap();
        let ended = ended.join().unwrap();
        assert!(!is_over, "{}", ended.reason);
        ended
    });
    assert!(ended.reason.starts_with("no heartbeat for 650ms"), "{}", ended.reason);
}

#[test]
fn nobody_who_is_early_or_stopped_is_given_patience() {
    let mut child = Command::new("sleep").arg("60").spawn().unwrap();
    let mut meter = ProgressMeter::new(child.id());
    let now = Instant::now();
    assert_eq!(starvation_allowance(&mut meter, None, now), Duration::ZERO);
    assert_eq!(starvation_allowance(&mut meter, Some(now + 2 * DOUBT), now), Duration::ZERO);
    assert_eq!(
        starvation_allowance(&mut meter, Some(now), now),
        MAX_STARVED,
        "nothing is known yet"
    );
    thread::sleep(DOUBT);
    let later = Instant::now();
    assert_eq!(starvation_allowance(&mut meter, Some(now), later), Duration::ZERO, "it sleeps");
    meter.reset();
    let pid = Pid::from_raw(child.id() as i32).unwrap();
    rustix::process::kill_process(pid, Signal::STOP).unwrap();
    thread::sleep(DOUBT);
    assert_eq!(
        starvation_allowance(&mut meter, Some(now), Instant::now()),
        Duration::ZERO,
        "stopped"
    );
    child.kill().unwrap();
    child.wait().unwrap();
}
