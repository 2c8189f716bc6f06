//! Monitor of one process from its start to its exit: output, messages, heartbeat and deadlines.

use std::os::fd::AsFd;
use std::process::{Child, ExitStatus};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use busbar_protocol::progress::{Activity, ProgressMeter};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::{RecvFlags, recv};
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

use crate::framing::{self, Decoder};
use crate::log_capture::OutputLog;
use crate::message::{Answer, CallError, FromPlugin, Request, ToPlugin};
use crate::process_spawn::SpawnedProcess;
use crate::process_state::{ProcessPhase, Reply, Shared};
use crate::resident_memory;
use crate::status::ending;

/// Longest period between two checks of deadlines.
const TURN: Duration = Duration::from_millis(50);
/// Period of liveness probes.
const PING_PERIOD: Duration = Duration::from_millis(200);
/// The longest that it takes to answer that: with the period before it, less than the
/// second after which the tags of a plugin that hangs must be bad.
const HEARTBEAT_DEADLINE: Duration = Duration::from_millis(650);
/// The longest that a process may be late beyond a deadline while it is starved: it is slow then,
/// and does not hang. Its values grow old by themselves meanwhile.
const MAX_STARVED: Duration = Duration::from_secs(10);
/// The share of the time that a starved process waits for a CPU or a disk.
const STARVED_SHARE: f64 = 0.5;
/// Time before a deadline from which it is looked whether a process is starved.
const DOUBT: Duration = Duration::from_millis(300);
/// Delay of a turn beyond its time that shows that this thread was held up, and perhaps the process
/// too: deadlines are extended by that time.
const STALL: Duration = Duration::from_millis(200);
/// The longest that a process may take to stop and end by itself.
const QUIT_DEADLINE: Duration = Duration::from_millis(2_500);
/// The longest that a process whose socket is closed takes to be gone.
const REAP_DEADLINE: Duration = Duration::from_millis(100);
/// The longest that a killed process takes to be gone.
const KILL_DEADLINE: Duration = Duration::from_secs(2);
/// Period of polls for the exit of the process.
const REAP_PERIOD: Duration = Duration::from_millis(1);
/// Period of memory checks.
const MEMORY_PERIOD: Duration = Duration::from_secs(1);
/// Bytes read at once, and reads in one turn: a flood holds no deadline up.
const READ_BYTES: usize = 1 << 16;
const MAX_READS: usize = 16;

/// Exit of a process.
pub(crate) struct ProcessExit {
    /// Reason of the exit, for people.
    pub(crate) reason: String,
    /// True where the host asked for it.
    pub(crate) requested: bool,
}

/// One process from its start to its end.
pub(crate) struct ProcessMonitor<'a> {
    shared: &'a Shared,
    spawned: SpawnedProcess,
    output: Option<OutputLog>,
    decoder: Decoder,
    buffer: Vec<u8>,
    last_turn: Instant,
    /// Longest time that the turn was to wait.
    planned_wait: Duration,
    pinged: Instant,
    /// True once the process has sent anything. Until then the process is loading from disk and
    /// only the deadline of loading counts.
    is_there: bool,
    /// Time of the oldest unanswered ping.
    unanswered: Option<Instant>,
    weighed: Option<Instant>,
    quitting: Option<Instant>,
    meter: ProgressMeter,
}

/// Reason to kill a process, as text for the log.
type KillReason = String;

impl<'a> ProcessMonitor<'a> {
    pub(crate) fn new(shared: &'a Shared, spawned: SpawnedProcess) -> Self {
        let now = Instant::now();
        let output = spawned.output.try_clone().ok().map(OutputLog::new);
        let meter = ProgressMeter::new(spawned.child.id());
        Self {
            shared,
            spawned,
            output,
            decoder: framing::decoder(),
            buffer: vec![0; READ_BYTES],
            last_turn: now,
            planned_wait: TURN,
            pinged: now,
            is_there: false,
            unanswered: None,
            weighed: None,
            quitting: None,
            meter,
        }
    }

    /// Runs until the process has ended.
    pub(crate) fn run(mut self) -> ProcessExit {
        loop {
            self.wait();
            self.read_output();
            match self.read_socket() {
                Ok(true) => {}
                Ok(false) => return self.finish(None),
                Err(kill_reason) => return self.finish(Some(kill_reason)),
            }
            self.send_requests();
            if let Err(kill_reason) = self.check_deadlines() {
                return self.finish(Some(kill_reason));
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
        self.planned_wait = self.until_next_turn();
        let _ = poll(&mut descriptors, Some(&timespec(self.planned_wait)));
        clear_wake(self.shared);
    }

    /// Returns the time until something is due, where nothing happens before: the next probe, or
    /// the doubt about one. While a call is pending or the process ends, it is looked at each
    /// [`TURN`].
    fn until_next_turn(&self) -> Duration {
        let is_calm =
            self.is_there && self.quitting.is_none() && self.shared.state().calls.is_empty();
        let due = match self.unanswered {
            Some(since) => since + (HEARTBEAT_DEADLINE - DOUBT),
            None => self.pinged + PING_PERIOD,
        };
        let left = due.saturating_duration_since(Instant::now());
        // A probe is due only once its period is over.
        if is_calm && !left.is_zero() { left + Duration::from_millis(1) } else { TURN }
    }

    /// Reads a piece of output; false at the end.
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

    /// Reads and handles messages; false at the end.
    fn read_socket(&mut self) -> Result<bool, KillReason> {
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
            while let Some(message) = self.decoder.message().map_err(broken)? {
                self.handle_message(message)?;
            }
        }
        Ok(true)
    }

    fn handle_message(&mut self, message: FromPlugin) -> Result<(), KillReason> {
        self.is_there = true;
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

    fn take_answer(
        &mut self,
        call: u64,
        result: Result<Answer, CallError>,
    ) -> Result<(), KillReason> {
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
                let answer = result.map_err(|fault| {
                    format!("`{}` failed: {}", pending.what, fault.into_error(&state.id))
                })?;
                if let (Answer::Configured(description), Some(mailbox)) =
                    (answer, &mut *self.shared.mailbox())
                {
                    mailbox.describe(description)?;
                }
                if let ProcessPhase::Starting(left) = state.phase {
                    state.phase = if left <= 1 {
                        ProcessPhase::Running
                    } else {
                        ProcessPhase::Starting(left - 1)
                    };
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
                    Ok(_) => Err(CallError::Violation("it answers another question".into())),
                    Err(fault) => Err(fault),
                };
                if let Some(mailbox) = &mut *self.shared.mailbox() {
                    mailbox.answer(&id, picture);
                }
                self.shared.drawn.notify_all();
            }
        }
        Ok(())
    }

    /// Sends the pending draw request, or the request to quit.
    fn send_requests(&mut self) {
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
        if state.phase != ProcessPhase::Running {
            return;
        }
        let Some(wanted) = self.shared.mailbox().as_mut().and_then(|mailbox| mailbox.take()) else {
            return;
        };
        let request = Request::Draw { states: wanted.states, scene_time: wanted.scene_time };
        let call = self.shared.register_call(&mut state, &request, Reply::Draw);
        drop(state);
        connection.send(&ToPlugin::Call { call, request }, &[]);
    }

    /// Pings, and finds who is late.
    fn check_deadlines(&mut self) -> Result<(), KillReason> {
        let now = Instant::now();
        let held_up = (now - self.last_turn).saturating_sub(self.planned_wait + STALL);
        self.last_turn = now;
        if !held_up.is_zero() {
            self.unanswered = self.unanswered.map(|_| now);
        }
        if let Some(since) = self.quitting {
            let late = now - since > QUIT_DEADLINE;
            return if late { Err("it did not stop in time".into()) } else { Ok(()) };
        }
        let mut state = self.shared.state();
        if let Some(reason) = state.kill_reason.take() {
            return Err(reason);
        }
        state.calls.values_mut().for_each(|pending| pending.deadline += held_up);
        let heartbeat_due = self.unanswered.map(|since| since + HEARTBEAT_DEADLINE);
        let calls_due = state.calls.values().map(|pending| pending.deadline);
        let first_due = calls_due.chain(heartbeat_due).min();
        let starvation_allowance = starvation_allowance(&mut self.meter, first_due, now);
        if let Some(pending) =
            state.calls.values().find(|call| now > call.deadline + starvation_allowance)
        {
            let (what, allowance) = (pending.what, pending.allowance);
            return Err(format!("`{what}` took longer than {allowance:?}"));
        }
        if self.weighed.is_none_or(|then| now - then > MEMORY_PERIOD) {
            self.weighed = Some(now);
            state.memory_bytes = state.pid.and_then(resident_memory::resident_bytes);
        }
        let connection = state.connection.clone();
        drop(state);
        match (self.unanswered, connection) {
            (Some(since), _) if now - since > HEARTBEAT_DEADLINE + starvation_allowance => {
                Err(format!("no heartbeat for {HEARTBEAT_DEADLINE:?}"))
            }
            (None, Some(connection)) if self.is_there && now - self.pinged > PING_PERIOD => {
                (self.pinged, self.unanswered) = (now, Some(now));
                connection.send(&ToPlugin::Ping, &[]);
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Finishes the process: kills it where it has not ended, and returns its exit.
    fn finish(mut self, kill_reason: Option<KillReason>) -> ProcessExit {
        let first_words = kill_reason.as_deref().unwrap_or("its process is gone");
        if let Some(feed) = &mut *self.shared.feed() {
            feed.lose(first_words);
        }
        if let Some(mailbox) = &mut *self.shared.mailbox() {
            mailbox.clear();
        }
        self.shared.drawn.notify_all();
        let child = &mut self.spawned.child;
        if kill_reason.is_none() {
            await_ending(child, REAP_DEADLINE);
        }
        // The whole group, with whatever the plugin started itself. Before it is
        // reaped nobody else can have its number.
        if let Some(group) = Pid::from_raw(child.id() as i32) {
            let _ = kill_process_group(group, Signal::KILL);
        }
        let how = reap(child).map_or_else(|| "does not die".to_owned(), ending);
        let reason = match kill_reason {
            Some(kill_reason) => format!("{kill_reason}; {how}"),
            None => how,
        };
        for _ in 0..MAX_READS {
            if !self.read_output() {
                break;
            }
        }
        ProcessExit { reason, requested: self.quitting.is_some() }
    }
}

/// Decides how long a process may be late beyond its deadlines, the first of which is `first_due`:
/// not at all, or [`MAX_STARVED`] where it waits for a CPU or a disk most of the time.
fn starvation_allowance(
    meter: &mut ProgressMeter,
    first_due: Option<Instant>,
    now: Instant,
) -> Duration {
    if first_due.is_none_or(|due| now + DOUBT < due) {
        meter.reset();
        return Duration::ZERO;
    }
    if matches!(meter.observe(now), Activity::Stopped | Activity::Gone) {
        return Duration::ZERO;
    }
    match meter.starved_share() {
        Some(share) if share < STARVED_SHARE => Duration::ZERO,
        // Until there are two readings nothing is known.
        _ => MAX_STARVED,
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

pub(crate) fn clear_wake(shared: &Shared) {
    // Nothing there is as good as a count.
    let _ = rustix::io::read(&shared.wake, &mut [0_u8; 8]);
}

pub(crate) fn timespec(duration: Duration) -> Timespec {
    Timespec { tv_sec: duration.as_secs() as i64, tv_nsec: i64::from(duration.subsec_nanos()) }
}

#[cfg(test)]
#[path = "process_monitor_tests.rs"]
mod tests;
