//! Checks of the system: memory, files, time, folders, a watchdog.

use std::path::{Path, PathBuf};
use std::process::Command;

use rustix::fs::{MemfdFlags, memfd_create, statvfs};
use rustix::process::{Resource, getrlimit};
use rustix::system::uname;

use super::finding::Finding;

/// Files that a view with many plugins has open at once.
const MIN_OPEN_FILES: u64 = 1024;
/// Free space for a cache of models and the logs, bytes.
const MIN_FREE_BYTES: u64 = 500_000_000;

pub(super) fn version() -> Finding {
    let system = uname();
    let [name, release] = [system.sysname(), system.release()].map(|text| text.to_string_lossy());
    Finding::ok("version", format!("busbar {} on {name} {release}", env!("CARGO_PKG_VERSION")))
}

pub(super) fn check() -> Vec<Finding> {
    vec![shared_memory(), open_files(), clock(), cache(), watchdog()]
}

/// Checks shared memory: plugins get values and meshes in anonymous memory that is shared.
fn shared_memory() -> Finding {
    const CHECK: &str = "shared memory";
    match memfd_create("doctor", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING) {
        Ok(_) => Finding::ok(CHECK, "sealed memory can be made"),
        Err(error) => Finding::fault(
            CHECK,
            format!("no sealed memory can be made: {error}"),
            "allow memfd_create in the container or seccomp profile that this runs in",
        ),
    }
}

fn open_files() -> Finding {
    const CHECK: &str = "open files";
    match getrlimit(Resource::Nofile).current {
        Some(most) if most < MIN_OPEN_FILES => Finding::warning(
            CHECK,
            format!("at most {most} files may be open, {MIN_OPEN_FILES} are wanted"),
            "raise it: `ulimit -n 4096`, or LimitNOFILE= in the unit",
        ),
        Some(most) => Finding::ok(CHECK, format!("at most {most}")),
        None => Finding::ok(CHECK, "as many as wanted"),
    }
}

/// Checks the clock of this machine, which source times are compared with.
fn clock() -> Finding {
    const CHECK: &str = "clock";
    let mut asked = Command::new("timedatectl");
    let asked = asked.args(["show", "--property=NTPSynchronized", "--value"]).output();
    let answer = asked.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    match answer.as_deref() {
        Ok("yes") => Finding::ok(CHECK, "synchronised"),
        Ok("no") => Finding::warning(
            CHECK,
            "the clock is not synchronised: ages by source times may be wrong",
            "start a time service, such as `systemctl enable --now systemd-timesyncd`, or chrony",
        ),
        _ => Finding::warning(
            CHECK,
            "nobody tells whether the clock is synchronised (no timedatectl)",
            "ensure that a time service runs, such as chrony",
        ),
    }
}

/// Checks the cache folder of optimizers' results, by the XDG Base Directory Specification.
fn cache() -> Finding {
    const CHECK: &str = "cache";
    let folder = |name| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let cache = folder("XDG_CACHE_HOME").or_else(|| folder("HOME").map(|home| home.join(".cache")));
    let Some(cache) = cache else {
        return Finding::warning(
            CHECK,
            "neither XDG_CACHE_HOME nor HOME is set: models are optimised at each start",
            "set HOME, or name a \"cache\" directory in the configuration",
        );
    };
    writable(CHECK, &cache.join("busbar"))
}

/// Checks whether files can be made in a folder, which may have to be made first.
pub(super) fn writable(check: &'static str, folder: &Path) -> Finding {
    let probe = folder.join(format!(".doctor.{}", std::process::id()));
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| std::fs::write(&probe, b"x"))
        .and_then(|()| std::fs::remove_file(&probe));
    let shown = folder.display();
    if let Err(error) = written {
        return Finding::fault(
            check,
            format!("'{shown}' cannot be written: {error}"),
            "give this user the right to write there, or name another folder",
        );
    }
    let free = statvfs(folder).map_or(u64::MAX, |disk| disk.f_bavail.saturating_mul(disk.f_frsize));
    if free < MIN_FREE_BYTES {
        let cause = format!("only {} MB are free at '{shown}'", free / 1_000_000);
        return Finding::warning(check, cause, "free some, or name a folder on another disk");
    }
    Finding::ok(check, format!("'{shown}' can be written"))
}

/// Checks the watchdog of systemd (sd_watchdog_enabled(3)).
fn watchdog() -> Finding {
    const CHECK: &str = "watchdog";
    let set = |name| std::env::var_os(name).is_some();
    match (set("NOTIFY_SOCKET"), set("WATCHDOG_USEC")) {
        (_, true) => Finding::ok(CHECK, "systemd watches; frames feed it"),
        (true, false) => Finding::warning(
            CHECK,
            "systemd runs this without a watchdog",
            "set WatchdogSec=10 in the unit, so that a view that hangs is started again",
        ),
        (false, false) => Finding::ok(CHECK, "not run by systemd"),
    }
}
