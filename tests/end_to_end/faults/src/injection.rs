//! Fault injections: all faults, the phase in which each can strike, and the outcomes that are
//! required.

use fault_injector::{CallSite, Fault, Misbehavior};
use serde::Serialize;

/// Phase of a scene's life in which a fault strikes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// Loading of the scene.
    Load,
    /// Restart of the plugin's process.
    Restart,
    /// Operation of the plugin.
    Running,
    /// Closing of the scene.
    End,
}

/// Role of a plugin in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Role {
    Telemetry,
    Overlay,
    Optimizer,
}

/// Outcome of an injection.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Outcome {
    /// End or kill of the plugin's process, with its reason.
    Died(String),
    /// Bad values or a bad picture, shown as such.
    Bad,
    /// Refusal of the plugin's output.
    Refused,
    /// Absence of any effect on the view.
    Harmless,
    /// Fault during closing; the scene closed all the same.
    Closed,
}

/// Record of one finished injection.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Record {
    pub(crate) kind: Misbehavior,
    pub(crate) at: CallSite,
    pub(crate) outcome: Outcome,
    /// Milliseconds from the strike, or the death before it, until a frame showed bad data.
    pub(crate) to_bad_millis: Option<f64>,
    /// Milliseconds from the death until a frame had correct data again.
    pub(crate) to_good_millis: Option<f64>,
}

/// Lists every kind of fault at every function in which it can happen.
pub(crate) fn all() -> Vec<Fault> {
    let kinds = Misbehavior::ALL.iter().copied();
    let pairs = kinds.flat_map(|kind| CallSite::ALL.iter().map(move |&at| (kind, at)));
    pairs
        .filter(|&(kind, at)| kind.reaches(at) && at.is_in_view())
        .map(|(kind, at)| Fault { kind, at, after_calls: 0 })
        .collect()
}

/// Returns the phase and the roles in which a fault is to strike. Faults of functions that all
/// plugins have are spread over the roles with room for them.
pub(crate) fn place(fault: Fault) -> (Phase, &'static [Role]) {
    match fault.at {
        CallSite::Check => (Phase::Load, &[Role::Telemetry]),
        CallSite::Optimize => (Phase::Load, &[Role::Optimizer]),
        CallSite::Stop => (Phase::End, &[Role::Telemetry]),
        CallSite::Destroy | CallSite::Deinit => (Phase::End, &[Role::Overlay, Role::Optimizer]),
        CallSite::Configure => (Phase::Restart, &[Role::Overlay]),
        CallSite::Draw => (Phase::Running, &[Role::Overlay]),
        CallSite::Publish if fault.kind == Misbehavior::AfterStop => {
            (Phase::End, &[Role::Telemetry])
        }
        // It begins with `start`.
        CallSite::Publish if fault.kind == Misbehavior::NotUtf8 => {
            (Phase::Restart, &[Role::Telemetry])
        }
        CallSite::Publish => (Phase::Running, &[Role::Telemetry]),
        _ => (Phase::Restart, &[Role::Telemetry]),
    }
}

/// Reports whether the fault strikes a process that is started for it. Faults that continue until
/// the end begin with `start` too.
pub(crate) fn needs_restart(fault: Fault) -> bool {
    place(fault).0 == Phase::Restart || fault.kind == Misbehavior::AfterStop
}

/// Reports whether the process ends within the call.
pub(crate) fn is_sudden(kind: Misbehavior) -> bool {
    matches!(
        kind,
        Misbehavior::Segfault
            | Misbehavior::StackOverflow
            | Misbehavior::Abort
            | Misbehavior::Exit
            | Misbehavior::AllocationFailure
            | Misbehavior::DoubleFree
    )
}

/// Reports whether the process must end, at once or by its deadline; a plugin's own thread has no
/// deadline.
pub(crate) fn must_die(fault: Fault) -> bool {
    let hangs = matches!(fault.kind, Misbehavior::EndlessLoop | Misbehavior::Deadlock);
    is_sudden(fault.kind) || (hangs && fault.at != CallSite::Publish)
}

/// Returns a reason without the figures and words that differ from case to case.
pub(crate) fn class_of(reason: &str) -> String {
    if reason.contains("took longer than") {
        return "killed past the deadline of its call".into();
    }
    if reason.contains("no heartbeat") {
        return "killed without a heartbeat".into();
    }
    if reason.contains("` failed: ") {
        return "killed because its plugin failed".into();
    }
    if reason.contains("protocol between processes") || reason.contains("socket failed") {
        return "killed for the protocol".into();
    }
    reason.split(';').next().unwrap_or_default().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_fault_has_a_place() {
        assert!(all().len() >= 252, "{}", all().len());
        for phase in [Phase::Load, Phase::Restart, Phase::Running, Phase::End] {
            assert!(all().into_iter().any(|fault| place(fault).0 == phase), "{phase:?}");
        }
        let stuck = Fault { kind: Misbehavior::Deadlock, at: CallSite::Publish, after_calls: 0 };
        assert!(!must_die(stuck) && must_die(Fault { at: CallSite::Draw, ..stuck }));
    }

    #[test]
    fn reasons_are_told_apart_by_their_class() {
        let check = |reason: &str, class| assert_eq!(class_of(reason), class);
        check("killed by SIGSEGV", "killed by SIGSEGV");
        let late = "`draw` took longer than 1s; killed by SIGKILL";
        check(late, "killed past the deadline of its call");
        check(
            "`start` failed: plugin 'a': no; killed by SIGKILL",
            "killed because its plugin failed",
        );
    }
}
