//! State shared by the handle of a plugin's process and its supervisor.

use std::collections::BTreeMap;
use std::fs::File;
use std::net::Shutdown;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use busbar_plugin_host::{
    DeviceScenario, LibraryFile, OverlayDescription, PluginError, SimulatedTag, Simulation,
};
use rustix::event::{EventfdFlags, eventfd};

use crate::environment::Environment;
use crate::framing;
use crate::message::{Answer, Confinement, Request, ToPlugin};
use crate::picture_mailbox::PictureMailbox;
use crate::restart_policy::{CrashHistory, Deadlines, RestartPolicy};
use crate::sample_feed::SampleFeed;
use busbar_protocol::socket;

/// The longest that working out a picture takes.
const DRAW_DEADLINE: Duration = Duration::from_secs(1);
/// Additional deadline for each tag of a call: half a million tags on a busy machine take more
/// than the 10 s that suffice for a few.
const DEADLINE_PER_TAG: Duration = Duration::from_micros(100);
/// Calls under way at once.
const MAX_CALLS: usize = 256;

pub(crate) type Outcome = Result<Answer, PluginError>;

pub(crate) struct Shared {
    pub(crate) library: LibraryFile,
    pub(crate) confinement: Confinement,
    pub(crate) environment: Environment,
    /// Event file descriptor that wakes the supervisor.
    pub(crate) wake: OwnedFd,
    next_call: AtomicU64,
    state: Mutex<State>,
    feed: Mutex<Option<SampleFeed>>,
    mailbox: Mutex<Option<PictureMailbox>>,
    simulation: Mutex<Option<SimulationSetup>>,
    /// A picture came, or none will.
    pub(crate) drawn: Condvar,
}

/// Running simulation of a process.
#[derive(Clone)]
pub(crate) struct SimulationSetup {
    pub(crate) tags: Vec<SimulatedTag>,
    pub(crate) simulation: Simulation,
    pub(crate) scenario: DeviceScenario,
}

impl SimulationSetup {
    pub(crate) fn into_request(self) -> Request {
        let Self { tags, simulation, scenario } = self;
        Request::Simulate { tags, simulation, scenario }
    }
}

pub(crate) struct State {
    /// Name for the log: the configuration's, or the library's before that.
    pub(crate) name: String,
    /// Plugin id for errors: the configuration's, or the library's before that.
    pub(crate) id: String,
    pub(crate) phase: ProcessPhase,
    /// The one instance, once it was made; only then is the process started again.
    pub(crate) instance: Option<InstanceSetup>,
    pub(crate) connection: Option<Arc<Connection>>,
    pub(crate) calls: BTreeMap<u64, UnansweredCall>,
    pub(crate) deadlines: Deadlines,
    pub(crate) deaths: CrashHistory,
    pub(crate) last_death: Option<String>,
    pub(crate) pid: Option<u32>,
    pub(crate) memory_bytes: Option<u64>,
    pub(crate) quit: bool,
    pub(crate) restart: bool,
    /// Reason to kill the process; none once it was killed.
    pub(crate) kill_reason: Option<String>,
}

/// Configuration from which an instance is created again.
#[derive(Clone)]
pub(crate) struct InstanceSetup {
    pub(crate) name: String,
    pub(crate) plugin: String,
    pub(crate) settings: String,
    pub(crate) policy: RestartPolicy,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ProcessPhase {
    /// The process is being set up as the one before it was; so many calls to go.
    Starting(usize),
    Running,
    Waiting(Instant),
    Quarantined,
    Ended,
}

/// A call that the process has not answered.
pub(crate) struct UnansweredCall {
    pub(crate) what: &'static str,
    pub(crate) allowance: Duration,
    pub(crate) deadline: Instant,
    pub(crate) reply: Reply,
}

/// Recipient of an answer.
pub(crate) enum Reply {
    Caller { sender: SyncSender<Outcome>, progress: Arc<AtomicU32> },
    Setup,
    Draw,
}

/// A call of this thread.
pub(crate) struct PendingCall {
    pub(crate) call: u64,
    pub(crate) outcome: Receiver<Outcome>,
    /// Bits of the fraction done.
    pub(crate) progress: Arc<AtomicU32>,
    pub(crate) connection: Arc<Connection>,
}

/// The socket to one process. Any thread may send.
pub(crate) struct Connection {
    pub(crate) socket: UnixStream,
    sending: Mutex<()>,
}

impl Connection {
    pub(crate) fn new(socket: UnixStream) -> Self {
        Self { socket, sending: Mutex::default() }
    }

    /// Sends a message. A failure may leave half a message: the connection is closed, and the
    /// supervisor handles the rest.
    pub(crate) fn send(&self, message: &ToPlugin, files: &[&File]) {
        let descriptors: Vec<_> = files.iter().map(|file| file.as_fd()).collect();
        let sent = framing::encode(message).and_then(|bytes| {
            let _one = self.sending.lock().unwrap_or_else(PoisonError::into_inner);
            socket::send(&self.socket, &bytes, &descriptors).map_err(|error| error.to_string())
        });
        if let Err(error) = sent {
            tracing::debug!("a plugin's process takes no messages: {error}");
            self.close();
        }
    }

    /// Ends the process by ending its link to the host.
    pub(crate) fn close(&self) {
        // One that is closed already is as good.
        let _ = self.socket.shutdown(Shutdown::Both);
    }
}

impl Shared {
    pub(crate) fn new(
        library: LibraryFile,
        confinement: Confinement,
        environment: Environment,
        connection: Connection,
        pid: u32,
    ) -> std::io::Result<Self> {
        let name = library.path().file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let state = State {
            id: name.clone(),
            name,
            phase: ProcessPhase::Running,
            instance: None,
            connection: Some(Arc::new(connection)),
            calls: BTreeMap::new(),
            deadlines: Deadlines::default(),
            deaths: CrashHistory::default(),
            last_death: None,
            pid: Some(pid),
            memory_bytes: None,
            quit: false,
            restart: false,
            kill_reason: None,
        };
        Ok(Self {
            library,
            confinement,
            environment,
            wake: eventfd(0, EventfdFlags::CLOEXEC | EventfdFlags::NONBLOCK)?,
            next_call: AtomicU64::new(1),
            state: Mutex::new(state),
            feed: Mutex::default(),
            mailbox: Mutex::default(),
            simulation: Mutex::default(),
            drawn: Condvar::new(),
        })
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn feed(&self) -> MutexGuard<'_, Option<SampleFeed>> {
        self.feed.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn mailbox(&self) -> MutexGuard<'_, Option<PictureMailbox>> {
        self.mailbox.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(crate) fn simulation(&self) -> MutexGuard<'_, Option<SimulationSetup>> {
        self.simulation.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Wakes the supervisor for a change of state.
    pub(crate) fn wake(&self) {
        // A counter that is full has woken it already.
        let _ = rustix::io::write(&self.wake, &1_u64.to_ne_bytes());
    }

    /// Registers a call that awaits its answer; returns its number.
    pub(crate) fn register_call(&self, state: &mut State, request: &Request, reply: Reply) -> u64 {
        let allowance = allowance(request, state.deadlines);
        let call = self.next_call.fetch_add(1, Ordering::Relaxed);
        let deadline = Instant::now() + allowance;
        state
            .calls
            .insert(call, UnansweredCall { what: request.name(), allowance, deadline, reply });
        call
    }

    /// Sends a call whose answer the caller waits for.
    pub(crate) fn start_call(
        &self,
        request: Request,
        files: &[&File],
    ) -> Result<PendingCall, PluginError> {
        let (sender, outcome) = sync_channel(1);
        let progress = Arc::new(AtomicU32::new(0));
        let (call, connection) = {
            let mut state = self.state();
            let lost = |reason: String| PluginError::Lost { id: state.id.clone(), reason };
            let connection = match (&state.phase, &state.connection) {
                (ProcessPhase::Running, Some(connection)) => connection.clone(),
                _ => {
                    let died = state.last_death.as_deref().unwrap_or("it is not running");
                    return Err(lost(died.to_owned()));
                }
            };
            if state.calls.len() >= MAX_CALLS {
                return Err(lost(format!("more than {MAX_CALLS} calls at once")));
            }
            let reply = Reply::Caller { sender, progress: progress.clone() };
            (self.register_call(&mut state, &request, reply), connection)
        };
        connection.send(&ToPlugin::Call { call, request }, files);
        Ok(PendingCall { call, outcome, progress, connection })
    }

    /// Calls and waits. The supervisor answers in any case.
    pub(crate) fn call(&self, request: Request, files: &[&File]) -> Outcome {
        let waiting = self.start_call(request, files)?;
        let gone = |_| PluginError::Lost { id: self.state().id.clone(), reason: "it ended".into() };
        waiting.outcome.recv().map_err(gone)?
    }

    /// Stores the plugin's description of the overlay.
    pub(crate) fn describe(&self, description: OverlayDescription) -> Result<(), PluginError> {
        // The mailbox is let go before the state is taken.
        let described = self.mailbox().as_mut().map(|mailbox| mailbox.describe(description));
        match described {
            None => Err(self.unexpected_answer()),
            Some(described) => described.map_err(|what| PluginError::Violation {
                id: self.state().id.clone(),
                what: what.to_owned(),
            }),
        }
    }

    /// An answer of another kind than the question.
    pub(crate) fn unexpected_answer(&self) -> PluginError {
        let what = "its process answers another question".into();
        PluginError::Violation { id: self.state().id.clone(), what }
    }
}

/// Returns the deadline of a call.
fn allowance(request: &Request, deadlines: Deadlines) -> Duration {
    match request {
        Request::Draw { .. } => DRAW_DEADLINE,
        // What an optimiser looks at is asked before it works, and may have to wait for a command
        // to end as that has.
        Request::Optimize { .. } | Request::Run { .. } | Request::DescribeOptimizer => {
            deadlines.optimize
        }
        _ => deadlines.lifecycle + DEADLINE_PER_TAG * request.tags(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_waits_for_a_command_may_take_as_long_as_one() {
        let deadlines = Deadlines::default();
        let run = Request::Run { name: String::new(), arguments: Vec::new() };
        for request in [run, Request::DescribeOptimizer] {
            assert_eq!(allowance(&request, deadlines), deadlines.optimize, "{}", request.name());
        }
        assert_eq!(allowance(&Request::Commands, deadlines), deadlines.lifecycle);
    }
}
