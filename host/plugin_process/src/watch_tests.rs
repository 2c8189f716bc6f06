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
use crate::shared::Connection;

/// A process that comes from a slow disk is asked nothing until it has said something; one
/// that was there and is silent goes.
#[test]
fn a_process_is_late_only_once_it_is_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("libslow.so");
    fs::write(&path, "").unwrap();
    fs::set_permissions(&path, Permissions::from_mode(0o755)).unwrap();
    let folders = [folder.path().canonicalize().unwrap()];
    let library = libraries(&folders, &LoadRules::default()).0.remove(0);
    let (here, mut there) = UnixStream::pair().unwrap();
    let (output, silent) = pipe().unwrap();
    ioctl_fionbio(&output, true).unwrap();
    let child = Command::new("sleep").arg("60").process_group(0).spawn().unwrap();
    let connection = Connection::new(here.try_clone().unwrap());
    let environment = Environment::default();
    let shared =
        Shared::new(library, DEFAULT_CONFINEMENT, environment, connection, child.id()).unwrap();
    let ended = thread::scope(|scope| {
        let watch = Watch::new(&shared, Spawned { child, socket: here, output });
        let ended = scope.spawn(move || watch.run());
        there.set_read_timeout(Some(PING_PERIOD + HEARTBEAT_DEADLINE + 4 * TURN)).unwrap();
        let asked = there.read(&mut [0; 64]).map_err(|error| error.kind());
        assert_eq!(asked, Err(ErrorKind::WouldBlock), "it is still to come");
        assert!(!ended.is_finished());
        there.write_all(&frames::encode(&FromPlugin::Pong).unwrap()).unwrap();
        assert!(there.read(&mut [0; 64]).unwrap() > 0, "it is asked whether it lives");
        ended.join().unwrap()
    });
    drop(silent);
    assert!(ended.reason.starts_with("no heartbeat for 650ms"), "{}", ended.reason);
    assert!(!ended.wanted);
}
