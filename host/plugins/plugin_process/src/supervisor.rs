//! Supervisor thread of a plugin's process: runs its monitor, records exits and restarts it by
//! policy.

use std::fs::File;
use std::sync::Arc;
use std::time::Instant;

use busbar_plugin_host::{LinkState, PluginError};
use rustix::event::{PollFd, PollFlags, poll};

use crate::memory;
use crate::message::{PROTOCOL_VERSION, Request, ToPlugin};
use crate::process_monitor::{ProcessExit, ProcessMonitor, clear_wake, timespec};
use crate::process_spawn::{SpawnedProcess, spawn};
use crate::process_state::{Connection, ProcessPhase, Reply, Shared, State};
use crate::restart_policy::RestartDecision;
use crate::ring::{RING_BYTES, RingReader};

/// Supervises a process and its successors until the plugin is dropped.
pub(crate) fn supervise(shared: &Shared, first: SpawnedProcess) {
    let mut spawned = Ok(first);
    loop {
        let ended = match spawned {
            Ok(spawned) => ProcessMonitor::new(shared, spawned).run(),
            Err(reason) => ProcessExit { reason, requested: false },
        };
        if !record_exit(shared, &ended) || !wait_for_start(shared) {
            return;
        }
        spawned = spawn(&shared.environment).and_then(|spawned| set_up(shared, spawned));
    }
}

/// Fails all pending calls and decides on a restart; false where the plugin has ended for good.
fn record_exit(shared: &Shared, ended: &ProcessExit) -> bool {
    let mut state = shared.state();
    (state.connection, state.pid, state.memory_bytes) = (None, None, None);
    fail_calls(&mut state, &ended.reason);
    let name = state.name.clone();
    state.last_death = Some(ended.reason.clone());
    let policy = match &state.instance {
        Some(instance) if !ended.requested && !state.quit => instance.policy,
        _ => {
            state.phase = ProcessPhase::Ended;
            return false;
        }
    };
    let now = Instant::now();
    let reason = &ended.reason;
    let said = match state.deaths.record(&policy, now, fastrand::f64()) {
        RestartDecision::RestartAfter(delay) => {
            state.phase = ProcessPhase::Waiting(now + delay);
            tracing::error!(plugin = %name, "died: {reason}; starts again in {delay:.1?}");
            format!("died: {reason}")
        }
        RestartDecision::Quarantine => {
            state.phase = ProcessPhase::Quarantined;
            let (deaths, within) = (policy.max_deaths, policy.window);
            tracing::error!(
                plugin = %name,
                "died: {reason}; in quarantine after {deaths} deaths within {within:?}, until it \
                 is started by hand or the scene is loaded again"
            );
            format!("in quarantine; died last: {reason}")
        }
    };
    drop(state);
    if let Some(feed) = &mut *shared.feed() {
        feed.note_link(LinkState::Down, &said);
    }
    true
}

fn fail_calls(state: &mut State, reason: &str) {
    for pending in std::mem::take(&mut state.calls).into_values() {
        if let Reply::Caller { sender, .. } = pending.reply {
            let (id, reason) = (state.id.clone(), reason.to_owned());
            let _ = sender.try_send(Err(PluginError::Lost { id, reason }));
        }
    }
}

/// Waits until the plugin is to be restarted; false where it is no longer needed.
fn wait_for_start(shared: &Shared) -> bool {
    loop {
        let timeout = {
            let mut state = shared.state();
            if state.quit {
                state.phase = ProcessPhase::Ended;
                return false;
            }
            if std::mem::take(&mut state.restart) {
                state.deaths.reset();
                return true;
            }
            match state.phase {
                ProcessPhase::Waiting(until) => {
                    let left = until.saturating_duration_since(Instant::now());
                    if left.is_zero() {
                        return true;
                    }
                    Some(left)
                }
                _ => None,
            }
        };
        let mut descriptors = [PollFd::new(&shared.wake, PollFlags::IN)];
        let _ = poll(&mut descriptors, timeout.map(timespec).as_ref());
        clear_wake(shared);
    }
}

/// Sets up a new process like the one before. All calls are sent at once; the process answers
/// them in order.
fn set_up(shared: &Shared, spawned: SpawnedProcess) -> Result<SpawnedProcess, String> {
    let text = |error: std::io::Error| format!("it cannot be started again: {error}");
    let connection = Arc::new(Connection::new(spawned.socket.try_clone().map_err(text)?));
    let mut requests: Vec<(Request, Option<File>)> = Vec::new();
    let library = shared.library.file().try_clone().map_err(text)?;
    requests.push((load_request(shared), Some(library)));
    let mut state = shared.state();
    if let Some(instance) = state.instance.clone() {
        let (name, plugin, settings) = (instance.name, instance.plugin, instance.settings);
        requests.push((Request::Create { name, plugin, settings }, None));
    }
    if let Some(feed) = &mut *shared.feed() {
        let ring = memory::zeroed("ring", RING_BYTES).map_err(text)?;
        feed.attach(RingReader::new(&ring)?);
        requests.push((Request::Start { tags: feed.tags().to_vec() }, Some(ring)));
    }
    if let Some(mailbox) = &*shared.mailbox() {
        requests.push((Request::Configure { bindings: mailbox.bindings().to_vec() }, None));
    }
    if let Some(simulated) = shared.simulation().clone() {
        requests.push((simulated.into_request(), None));
    }
    state.phase = ProcessPhase::Starting(requests.len());
    state.pid = Some(spawned.child.id());
    state.connection = Some(connection.clone());
    let calls: Vec<u64> = requests
        .iter()
        .map(|(request, _)| shared.register_call(&mut state, request, Reply::Setup))
        .collect();
    drop(state);
    for ((request, file), call) in requests.into_iter().zip(calls) {
        let files: Vec<&File> = file.iter().collect();
        connection.send(&ToPlugin::Call { call, request }, &files);
    }
    Ok(spawned)
}

pub(crate) fn load_request(shared: &Shared) -> Request {
    Request::Load {
        version: PROTOCOL_VERSION,
        path: shared.library.path().to_owned(),
        confinement: shared.confinement,
    }
}
