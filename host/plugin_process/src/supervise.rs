//! One thread a plugin's process: it reads what comes, keeps the deadlines, ends
//! what is past them and starts again what died.

use std::fs::File;
use std::os::fd::AsFd;
use std::process::{Child, ExitStatus};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::{RecvFlags, recv};
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

use crate::frames::Decoder;
use crate::message::{Answer, Fault, FromPlugin, PROTOCOL_VERSION, Request, ToPlugin};
use crate::output::Output;
use crate::policy::Verdict;
use crate::ring::{RING_BYTES, RingReader};
use crate::shared::{Connection, Life, Reply, Shared, State};
use crate::spawn::{Spawned, spawn};
use crate::status::ending;
use crate::{memory, proc};

/// How often the supervisor looks at its deadlines at least.
const TURN: Duration = Duration::from_millis(50);
/// How often a process is asked whether it lives.
const PING_PERIOD: Duration = Duration::from_millis(200);
/// The longest that it takes to answer that.
const HEARTBEAT_DEADLINE: Duration = Duration::from_millis(800);
/// A turn that comes this late says that this thread was held up, and the
/// process perhaps too: nobody is late for that time.
const STALL: Duration = Duration::from_millis(250);
/// The longest that a process may take to stop and end by itself.
const QUIT_DEADLINE: Duration = Duration::from_millis(2_500);
/// The longest that a process whose socket is closed takes to be gone.
const REAP_DEADLINE: Duration = Duration::from_millis(100);
/// The longest that a killed process takes to be gone.
const KILL_DEADLINE: Duration = Duration::from_secs(2);
/// How often its end is looked for.
const REAP_PERIOD: Duration = Duration::from_millis(1);
/// How often its memory is looked at.
const MEMORY_PERIOD: Duration = Duration::from_secs(1);
/// Bytes read at once, and reads in one turn: a flood holds no deadline up.
const READ_BYTES: usize = 1 << 16;
const MAX_READS: usize = 16;

/// Looks after a process, and those after it, until nobody needs it.
pub(crate) fn supervise(shared: &Shared, first: Spawned) {
    let mut spawned = Ok(first);
    loop {
        let ended = match spawned {
            Ok(spawned) => Watch::new(shared, spawned).run(),
            Err(reason) => Ended { reason, wanted: false },
        };
        if !note_end(shared, &ended) || !wait_for_start(shared) {
            return;
        }
        spawned = spawn().and_then(|spawned| set_up(shared, spawned));
    }
}

/// How a process ended.
struct Ended {
    reason: String,
    wanted: bool,
}

/// Fails everything that waits, and says what becomes of the plugin; false if
/// it is over.
fn note_end(shared: &Shared, ended: &Ended) -> bool {
    let mut state = shared.state();
    (state.connection, state.pid, state.memory_bytes) = (None, None, None);
    fail_calls(&mut state, &ended.reason);
    let name = state.name.clone();
    state.last_death = Some(ended.reason.clone());
    let policy = match &state.instance {
        Some(instance) if !ended.wanted && !state.quit => instance.policy,
        _ => {
            state.life = Life::Ended;
            return false;
        }
    };
    let now = Instant::now();
    let reason = &ended.reason;
    let said = match state.deaths.note(&policy, now, fastrand::f64()) {
        Verdict::Again(delay) => {
            state.life = Life::Waiting(now + delay);
            tracing::error!(plugin = %name, "died: {reason}; starts again in {delay:.1?}");
            format!("died: {reason}")
        }
        Verdict::Quarantine => {
            state.life = Life::Quarantined;
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
        feed.note_link(busbar_plugin_host::LinkState::Down, &said);
    }
    true
}

fn fail_calls(state: &mut State, reason: &str) {
    for pending in std::mem::take(&mut state.calls).into_values() {
        if let Reply::Caller { sender, .. } = pending.reply {
            let (id, reason) = (state.id.clone(), reason.to_owned());
            let _ = sender.try_send(Err(busbar_plugin_host::PluginError::Lost { id, reason }));
        }
    }
}

/// Waits until the plugin is to be started; false if nobody needs it any more.
fn wait_for_start(shared: &Shared) -> bool {
    loop {
        let timeout = {
            let mut state = shared.state();
            if state.quit {
                state.life = Life::Ended;
                return false;
            }
            if std::mem::take(&mut state.start_again) {
                state.deaths.forgive();
                return true;
            }
            match state.life {
                Life::Waiting(until) => {
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

/// Makes a new process what the one before it was. Everything is asked at once;
/// the process does it in order.
fn set_up(shared: &Shared, spawned: Spawned) -> Result<Spawned, String> {
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
    if let Some(slot) = &*shared.slot() {
        requests.push((Request::Configure { bindings: slot.bindings().to_vec() }, None));
    }
    state.life = Life::Starting(requests.len());
    state.pid = Some(spawned.child.id());
    state.connection = Some(connection.clone());
    let calls: Vec<u64> = requests
        .iter()
        .map(|(request, _)| shared.expect(&mut state, request, Reply::Setup))
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

/// One process from its start to its end.
struct Watch<'a> {
    shared: &'a Shared,
    spawned: Spawned,
    output: Option<Output>,
    decoder: Decoder,
    buffer: Vec<u8>,
    last_turn: Instant,
    pinged: Instant,
    /// When the ping that was not answered yet was sent.
    unanswered: Option<Instant>,
    weighed: Option<Instant>,
    quitting: Option<Instant>,
}

/// Why a process must go: words for the log.
type Lapse = String;

impl<'a> Watch<'a> {
    fn new(shared: &'a Shared, spawned: Spawned) -> Self {
        let now = Instant::now();
        let output = spawned.output.try_clone().ok().map(Output::new);
        Self {
            shared,
            spawned,
            output,
            decoder: Decoder::default(),
            buffer: vec![0; READ_BYTES],
            last_turn: now,
            pinged: now,
            unanswered: None,
            weighed: None,
            quitting: None,
        }
    }

    fn run(mut self) -> Ended {
        loop {
            self.wait();
            self.read_output();
            match self.read_socket() {
                Ok(true) => {}
                Ok(false) => return self.end(None),
                Err(lapse) => return self.end(Some(lapse)),
            }
            self.obey();
            if let Err(lapse) = self.keep_time() {
                return self.end(Some(lapse));
            }
        }
    }

    fn wait(&mut self) {
        let mut descriptors = vec![
            PollFd::new(&self.spawned.socket, PollFlags::IN),
            PollFd::new(&self.shared.wake, PollFlags::IN),
        ];
        if let Some(output) = &self.output {
            descriptors.push(PollFd::from_borrowed_fd(output.pipe().as_fd(), PollFlags::IN));
        }
        // Interrupted or not, everything is looked at.
        let _ = poll(&mut descriptors, Some(&timespec(TURN)));
        clear_wake(self.shared);
    }

    /// Takes a piece of what it wrote; false if there is no more.
    fn read_output(&mut self) -> bool {
        let Some(output) = &mut self.output else { return false };
        let name = self.shared.state().name.clone();
        let more = output.read(&name);
        if !more {
            output.finish(&name);
            self.output = None;
        }
        more
    }

    /// Takes what came; false at the end.
    fn read_socket(&mut self) -> Result<bool, Lapse> {
        for _ in 0..MAX_READS {
            match recv(&self.spawned.socket, &mut self.buffer[..], RecvFlags::DONTWAIT) {
                Ok((_, 0)) => return Ok(false),
                Ok((_, count)) => self.decoder.push(&self.buffer[..count]),
                Err(rustix::io::Errno::AGAIN) => break,
                Err(rustix::io::Errno::INTR) => continue,
                Err(rustix::io::Errno::CONNRESET) => return Ok(false),
                Err(error) => return Err(format!("its socket failed: {error}")),
            }
            let broken = |what| format!("it broke the protocol between processes: {what}");
            while let Some(message) = self.decoder.next().map_err(broken)? {
                self.take(message)?;
            }
        }
        Ok(true)
    }

    fn take(&mut self, message: FromPlugin) -> Result<(), Lapse> {
        match message {
            FromPlugin::Pong => self.unanswered = None,
            FromPlugin::Link { state, message } => {
                if let Some(feed) = &mut *self.shared.feed() {
                    feed.note_link(state, &message);
                }
            }
            FromPlugin::Progress { call, fraction } => {
                if let Some(pending) = self.shared.state().calls.get_mut(&call) {
                    pending.deadline = Instant::now() + pending.allowance;
                    if let Reply::Caller { progress, .. } = &pending.reply {
                        progress.store(fraction.to_bits(), Ordering::Relaxed);
                    }
                }
            }
            FromPlugin::Done { call, result } => self.take_answer(call, result)?,
        }
        Ok(())
    }

    fn take_answer(&mut self, call: u64, result: Result<Answer, Fault>) -> Result<(), Lapse> {
        let mut state = self.shared.state();
        let Some(pending) = state.calls.remove(&call) else {
            return Err("it broke the protocol between processes: nobody asked for this".into());
        };
        match pending.reply {
            Reply::Caller { sender, .. } => {
                // Who asked may have given up.
                let _ = sender.try_send(result.map_err(|fault| fault.into_error(&state.id)));
            }
            Reply::Setup => {
                result.map_err(|fault| {
                    format!("`{}` failed: {}", pending.what, fault.into_error(&state.id))
                })?;
                if let Life::Starting(left) = state.life {
                    state.life = if left <= 1 { Life::Running } else { Life::Starting(left - 1) };
                    if left <= 1 {
                        tracing::info!(plugin = %state.name, "runs again");
                    }
                }
            }
            Reply::Draw => {
                let id = state.id.clone();
                drop(state);
                let picture = match result {
                    Ok(Answer::Drawn(picture)) => Ok(picture),
                    Ok(_) => Err(Fault::Violation("it answers another question".into())),
                    Err(fault) => Err(fault),
                };
                if let Some(slot) = &mut *self.shared.slot() {
                    slot.answer(&id, picture);
                }
                self.shared.drawn.notify_all();
            }
        }
        Ok(())
    }

    /// Does what the viewer wants: draws, or ends.
    fn obey(&mut self) {
        let mut state = self.shared.state();
        let Some(connection) = state.connection.clone() else { return };
        if state.quit && self.quitting.is_none() {
            self.quitting = Some(Instant::now());
            // Without an instance there is nothing to bring to an end.
            let last_words = state.instance.is_some();
            drop(state);
            return match last_words {
                true => connection.send(&ToPlugin::Quit, &[]),
                false => connection.close(),
            };
        }
        if state.life != Life::Running {
            return;
        }
        let Some(wanted) = self.shared.slot().as_mut().and_then(|slot| slot.take()) else { return };
        let request = Request::Draw { states: wanted.states, now: wanted.now };
        let call = self.shared.expect(&mut state, &request, Reply::Draw);
        drop(state);
        connection.send(&ToPlugin::Call { call, request }, &[]);
    }

    /// Pings, and finds who is late.
    fn keep_time(&mut self) -> Result<(), Lapse> {
        let now = Instant::now();
        let held_up = (now - self.last_turn).saturating_sub(STALL);
        self.last_turn = now;
        if !held_up.is_zero() {
            self.unanswered = self.unanswered.map(|_| now);
        }
        if let Some(since) = self.quitting {
            let late = now - since > QUIT_DEADLINE;
            return if late { Err("it did not stop in time".into()) } else { Ok(()) };
        }
        let mut state = self.shared.state();
        for pending in state.calls.values_mut() {
            pending.deadline += held_up;
            if now > pending.deadline {
                let (what, allowance) = (pending.what, pending.allowance);
                return Err(format!("`{what}` took longer than {allowance:?}"));
            }
        }
        if self.weighed.is_none_or(|then| now - then > MEMORY_PERIOD) {
            self.weighed = Some(now);
            state.memory_bytes = state.pid.and_then(proc::resident_bytes);
        }
        let connection = state.connection.clone();
        drop(state);
        match (self.unanswered, connection) {
            (Some(since), _) if now - since > HEARTBEAT_DEADLINE => {
                Err(format!("no heartbeat for {HEARTBEAT_DEADLINE:?}"))
            }
            (None, Some(connection)) if now - self.pinged > PING_PERIOD => {
                (self.pinged, self.unanswered) = (now, Some(now));
                connection.send(&ToPlugin::Ping, &[]);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Sees the process off: kills it where it has not ended, and says why.
    fn end(mut self, lapse: Option<Lapse>) -> Ended {
        let first_words = lapse.as_deref().unwrap_or("its process is gone");
        if let Some(feed) = &mut *self.shared.feed() {
            feed.lose(first_words);
        }
        if let Some(slot) = &mut *self.shared.slot() {
            slot.lose();
        }
        self.shared.drawn.notify_all();
        let child = &mut self.spawned.child;
        if lapse.is_none() {
            await_ending(child, REAP_DEADLINE);
        }
        // The whole group, with whatever the plugin started itself. Before it is
        // reaped nobody else can have its number.
        if let Some(group) = Pid::from_raw(child.id() as i32) {
            let _ = kill_process_group(group, Signal::KILL);
        }
        let how = reap(child).map_or_else(|| "does not die".to_owned(), ending);
        let reason = match lapse {
            Some(lapse) => format!("{lapse}; {how}"),
            None => how,
        };
        for _ in 0..MAX_READS {
            if !self.read_output() {
                break;
            }
        }
        Ended { reason, wanted: self.quitting.is_some() }
    }
}

/// Waits for a child to end by itself, and leaves its status to be reaped.
fn await_ending(child: &Child, limit: Duration) {
    let Some(pid) = Pid::from_raw(child.id() as i32) else { return };
    let options = WaitIdOptions::EXITED | WaitIdOptions::NOWAIT | WaitIdOptions::NOHANG;
    let start = Instant::now();
    while matches!(waitid(WaitId::Pid(pid), options), Ok(None)) && start.elapsed() < limit {
        std::thread::sleep(REAP_PERIOD);
    }
}

/// Waits for a killed child to be gone; none if it is still there.
fn reap(child: &mut Child) -> Option<ExitStatus> {
    let start = Instant::now();
    while start.elapsed() < KILL_DEADLINE {
        if let Ok(Some(status)) = child.try_wait() {
            return Some(status);
        }
        std::thread::sleep(REAP_PERIOD);
    }
    None
}

fn clear_wake(shared: &Shared) {
    // Nothing there is as good as a count.
    let _ = rustix::io::read(&shared.wake, &mut [0_u8; 8]);
}

fn timespec(duration: Duration) -> Timespec {
    Timespec { tv_sec: duration.as_secs() as i64, tv_nsec: i64::from(duration.subsec_nanos()) }
}
