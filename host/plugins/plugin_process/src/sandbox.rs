//! Sandbox of a plugin process: resource limits, no new privileges and a seccomp filter, set
//! before the library is loaded.

use std::collections::BTreeMap;

use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};
use seccompiler::{
    SeccompAction, SeccompCmpArgLen, SeccompCmpOp, SeccompCondition, SeccompFilter, SeccompRule,
    apply_filter_all_threads,
};

use crate::message::Confinement;

/// Prefix of a restriction that the kernel refused.
pub(crate) const REFUSED: &str = "NOT ";
/// Descriptors that a plugin may have open at once.
const MAX_DESCRIPTORS: u64 = 1024;
/// The first descriptor after the three that every process has.
const FIRST_OWN_DESCRIPTOR: u32 = 3;
/// System calls of the x32 ABI have this bit; a filter by number must know both.
#[cfg(target_arch = "x86_64")]
const X32_BIT: i64 = 0x4000_0000;

/// Closes every inherited descriptor and ties this process to the life of its host. It is the
/// first thing that the process does.
pub(crate) fn detach_from_host() -> Result<(), String> {
    // SAFETY: nothing in this process has opened a descriptor yet, so none that
    // anybody owns is closed.
    let status = unsafe { libc::close_range(FIRST_OWN_DESCRIPTOR, u32::MAX, 0) };
    if status != 0 {
        let error = std::io::Error::last_os_error();
        return Err(format!("inherited descriptors cannot be closed: {error}"));
    }
    set_parent_process_death_signal(Some(Signal::KILL))
        .map_err(|error| format!("this process cannot be tied to its host: {error}"))
}

/// Restricts this process; returns the restrictions in effect. One that the kernel refuses is
/// listed too, and is no error: the process is still isolated.
pub(crate) fn confine(confinement: Confinement) -> Vec<String> {
    let mut said = Vec::new();
    let mut say = |result: Result<(), String>, what: String| {
        said.push(match result {
            Ok(()) => what,
            Err(error) => format!("{REFUSED}{what} ({error})"),
        });
    };
    let limit = |resource, value| {
        let limit = Rlimit { current: Some(value), maximum: Some(value) };
        setrlimit(resource, limit).map_err(|error| error.to_string())
    };
    let megabytes = confinement.memory_bytes / 1_000_000;
    say(limit(Resource::As, confinement.memory_bytes), format!("{megabytes} MB of memory at most"));
    say(limit(Resource::Core, 0), "no core files".into());
    say(limit(Resource::Nofile, MAX_DESCRIPTORS), format!("{MAX_DESCRIPTORS} descriptors"));
    let no_new = rustix::thread::set_no_new_privs(true).map_err(|error| error.to_string());
    say(no_new, "no new privileges".into());
    if !confinement.network {
        say(deny_network(), "no network".into());
    }
    said
}

/// Refuses sockets that lead out of the machine, and io_uring, which could make
/// them past this filter.
fn deny_network() -> Result<(), String> {
    let text = |error: &dyn std::fmt::Display| error.to_string();
    let local = libc::AF_UNIX as u64;
    let not_local = || {
        SeccompCondition::new(0, SeccompCmpArgLen::Dword, SeccompCmpOp::Ne, local)
            .and_then(|condition| SeccompRule::new(vec![condition]))
            .map_err(|error| text(&error))
    };
    let mut rules = BTreeMap::new();
    rules.insert(libc::SYS_socket, vec![not_local()?]);
    rules.insert(libc::SYS_io_uring_setup, Vec::new());
    #[cfg(target_arch = "x86_64")]
    {
        rules.insert(libc::SYS_socket | X32_BIT, vec![not_local()?]);
        rules.insert(libc::SYS_io_uring_setup | X32_BIT, Vec::new());
    }
    let architecture = std::env::consts::ARCH
        .try_into()
        .map_err(|error| format!("no filter for {}: {}", std::env::consts::ARCH, text(&error)))?;
    let refuse = SeccompAction::Errno(libc::EPERM as u32);
    let filter = SeccompFilter::new(rules, SeccompAction::Allow, refuse, architecture)
        .map_err(|error| text(&error))?;
    let program: seccompiler::BpfProgram =
        filter.try_into().map_err(|error: seccompiler::BackendError| text(&error))?;
    apply_filter_all_threads(&program).map_err(|error| text(&error))
}
