//! Support of the end-to-end tests: the built program is run as a user runs it, against real
//! servers, displays and drivers.
//!
//! Everything here panics with a clear message instead of returning errors: a
//! test that cannot be set up has failed. What may be missing on a developer's
//! machine (a Modbus server, an X server) is announced and skipped, except
//! where `CI` or `BUSBAR_REQUIRE_PEERS` is set.

pub mod busy_processes;
pub mod clock_reader;
pub mod display;
pub mod faulty_plugins;
pub mod glb;
pub mod peer;
pub mod picture;
pub mod process;
pub mod relay;
pub mod scene;
pub mod stats;
pub mod window;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

pub use process::{Output, Process, finish};
pub use scene::{Scene, YARDS};
pub use stats::Stats;

/// Path from this crate to the workspace's root.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../..");
/// Variable that says how long the machine is busy in tests of what is shown then, seconds, and
/// the time where it is not set.
const LIVE_SECONDS: (&str, u64) = ("BUSBAR_LIVE_SECONDS", 5);
/// Polling period of a condition.
const LOOK_PERIOD: Duration = Duration::from_millis(10);

/// Returns a path of the workspace.
pub fn workspace_path(path: &str) -> PathBuf {
    Path::new(ROOT).join(path)
}

/// Returns the folder of programs and plugins, `target/<profile>`: the tests themselves are in
/// `deps` below it.
pub fn built_folder() -> PathBuf {
    let test = std::env::current_exe().expect("a test has a path");
    test.ancestors().nth(2).expect("it is in target/<profile>/deps").to_owned()
}

/// Returns the path of a file that a build or staging makes.
///
/// # Panics
/// When it is missing, with the command that makes it.
pub fn built(path: PathBuf) -> PathBuf {
    assert!(path.exists(), "{} is missing: run `cargo xtask test`", path.display());
    path
}

/// Returns the command of the built program, ready for arguments, with a user's cache of its own.
pub fn busbar() -> Command {
    let mut command = Command::new(built(built_folder().join("busbar")));
    command.env_remove("BUSBAR_LOG").env("XDG_CACHE_HOME", built_folder().join("e2e-cache"));
    command
}

/// Returns the time for which the machine is busy in tests of what is shown then, seconds.
///
/// # Panics
/// When the variable holds no number.
pub fn live_seconds() -> u64 {
    let (variable, default) = LIVE_SECONDS;
    number_from_environment(variable, default)
}

/// Returns the number that an environment variable holds, or a default where it is not set.
///
/// # Panics
/// When the variable holds no number.
pub fn number_from_environment(variable: &str, default: u64) -> u64 {
    let text = std::env::var(variable).ok();
    let parse =
        |text: String| text.parse().unwrap_or_else(|_| panic!("{variable} is no number: {text}"));
    text.map_or(default, parse)
}

/// Returns the path of a staged model of the demo, such as `breaker.glb`.
pub fn model(name: &str) -> PathBuf {
    built(workspace_path("config/models").join(name))
}

/// Reports whether a prerequisite of a test is present. Where prerequisites are required, absence
/// is a failure; elsewhere the test is skipped with a message.
#[allow(clippy::print_stderr)]
pub fn available(present: bool, remedy: &str) -> bool {
    let required = |name| std::env::var_os(name).is_some();
    assert!(present || !(required("CI") || required("BUSBAR_REQUIRE_PEERS")), "{remedy}");
    if !present {
        eprintln!("SKIPPED: {remedy}");
    }
    present
}

/// Waits until `condition` returns a value.
///
/// # Panics
/// When `limit` passes before.
pub fn wait_for<T>(what: &str, limit: Duration, mut condition: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(found) = condition() {
            return found;
        }
        assert!(start.elapsed() < limit, "waited {limit:?} in vain for {what}");
        std::thread::sleep(LOOK_PERIOD);
    }
}
