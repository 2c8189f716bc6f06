//! The handle of a plugin that runs in a process of its own.

use std::fs::File;
use std::sync::atomic::Ordering;
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime};

use busbar_geometry::{CollapseSequence, Mesh};
use busbar_plugin_host::{
    LinkReport, OptimizedMesh, OverlayBinding, OverlayDescription, OverlayPicture, PluginError,
    PluginInfo, SampleSink, SourcePolicy, TelemetryTag, check_stages,
};
use busbar_tags::{SourceTime, TagState};

use crate::memory;
use crate::message::{Answer, Request, ToPlugin};
use crate::picture_mailbox::PictureMailbox;
use crate::process_state::{Outcome, ProcessPhase, Shared, State};
use crate::ring::{RING_BYTES, RingReader};
use crate::sample_feed::SampleFeed;
use crate::simulator_detection::{SimulatorCheck, is_connected_to_simulator};
use crate::socket_table::SocketOwner;
use crate::status::{PluginState, PluginStatus};

/// Period of progress calls to the caller of an optimizer.
const PROGRESS_PERIOD: Duration = Duration::from_millis(20);

/// The longest that noting the death of a process takes which is killed.
const GIVE_UP_DEADLINE: Duration = Duration::from_secs(3);
/// Period of polls for a change of state.
const LOOK_PERIOD: Duration = Duration::from_millis(1);

/// A library in a supervised process, and the one instance made from it.
pub struct PluginProcess {
    pub(crate) shared: Arc<Shared>,
    pub(crate) supervisor: Option<JoinHandle<()>>,
    /// Description of the instance's plugin.
    pub(crate) info: PluginInfo,
    pub(crate) name: String,
}

impl PluginProcess {
    /// Returns the plugin's description of itself.
    pub fn info(&self) -> &PluginInfo {
        &self.info
    }

    /// The configuration's id of the instance.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the state of the process.
    pub fn status(&self) -> PluginStatus {
        let state = self.shared.state();
        PluginStatus {
            state: match state.phase {
                ProcessPhase::Running => PluginState::Running,
                ProcessPhase::Starting(_) => PluginState::Starting,
                ProcessPhase::Waiting(until) => PluginState::Restarting {
                    after: until.saturating_duration_since(Instant::now()),
                },
                ProcessPhase::Quarantined => PluginState::Quarantined,
                ProcessPhase::Ended => PluginState::Ended,
            },
            deaths: state.deaths.count(),
            last_death: state.last_death.clone(),
            pid: state.pid,
            memory_bytes: state.memory_bytes,
        }
    }

    /// Starts it again now if it waits for that or is in quarantine.
    pub fn restart(&self) {
        let mut state = self.shared.state();
        if matches!(state.phase, ProcessPhase::Waiting(_) | ProcessPhase::Quarantined) {
            state.restart = true;
            drop(state);
            self.shared.wake();
        }
    }

    /// Begins to end it; dropping the handle waits for that. So several can end
    /// at the same time.
    pub fn quit(&self) {
        self.shared.state().quit = true;
        self.shared.wake();
    }

    pub(crate) fn check(&self, tags: &[TelemetryTag]) -> Result<(), PluginError> {
        self.done(Request::Check { tags: tags.to_vec() }, &[])
    }

    pub(crate) fn start(
        &self,
        tags: &[TelemetryTag],
        policy: SourcePolicy,
    ) -> Result<(), PluginError> {
        let failed = |message: String| self.failed(message);
        let ring = memory::zeroed("ring", RING_BYTES).map_err(|error| failed(error.to_string()))?;
        let mut feed = SampleFeed::new(tags, policy);
        feed.attach(RingReader::new(&ring).map_err(failed)?);
        {
            let state = self.settled();
            if state.phase != ProcessPhase::Running {
                feed.lose(state.last_death.as_deref().unwrap_or("it is not running"));
            }
            *self.shared.feed() = Some(feed);
        }
        let started = self.configure_or_recover(Request::Start { tags: tags.to_vec() }, &[&ring]);
        started.inspect_err(|_| *self.shared.feed() = None)
    }

    pub(crate) fn drain(&self, sink: &mut impl SampleSink) {
        let check = self.shared.feed().as_mut().and_then(SampleFeed::simulator_check);
        if let Some(check) = check {
            self.check_for_simulator(check);
        }
        if let Some(feed) = self.shared.feed().as_mut() {
            feed.drain(sink);
        }
    }

    /// Checks whether the process is connected to a simulator of this machine, and marks its
    /// samples if so.
    fn check_for_simulator(&self, check: SimulatorCheck) {
        // Not with the feed locked: its lock comes after that of the state.
        let pid = self.shared.state().pid;
        let is_simulated =
            pid.is_some_and(|pid| is_connected_to_simulator(SocketOwner::ProcessTree(pid), check));
        if let Some(feed) = self.shared.feed().as_mut() {
            feed.note_simulator_check(is_simulated);
        }
    }

    pub(crate) fn link(&self) -> Option<LinkReport> {
        self.shared.feed().as_ref().map(SampleFeed::link)
    }

    pub(crate) fn scene_time(&self) -> Option<SourceTime> {
        self.shared.feed().as_ref().and_then(SampleFeed::scene_time)
    }

    pub(crate) fn configure(&self, bindings: &[OverlayBinding]) -> Result<(), PluginError> {
        // First: one that dies of it is started again with these.
        {
            let _settled = self.settled();
            *self.shared.mailbox() = Some(PictureMailbox::new(bindings.to_vec()));
        }
        let configured =
            self.configure_or_recover(Request::Configure { bindings: bindings.to_vec() }, &[]);
        configured.inspect_err(|_| *self.shared.mailbox() = None)
    }

    /// Returns the last description of the overlay; the default before the first one.
    pub(crate) fn description(&self) -> Arc<OverlayDescription> {
        self.shared
            .mailbox()
            .as_ref()
            .map(|mailbox| mailbox.description().clone())
            .unwrap_or_default()
    }

    /// The last picture, which the states given lead to sooner or later. Waits
    /// for the one that they lead to up to `patience`.
    pub(crate) fn draw(
        &self,
        states: Vec<Option<TagState>>,
        scene_time: SystemTime,
        patience: Duration,
    ) -> Result<Arc<OverlayPicture>, PluginError> {
        let number = match &mut *self.shared.mailbox() {
            Some(mailbox) => mailbox.request(states, scene_time),
            None => return Err(self.failed("it is not configured".into())),
        };
        self.shared.wake();
        let until = Instant::now() + patience;
        loop {
            let runs = self.shared.state().phase == ProcessPhase::Running;
            let mailbox = self.shared.mailbox();
            let left = until.saturating_duration_since(Instant::now());
            let has = mailbox.as_ref().is_some_and(|mailbox| mailbox.has(number));
            if has || !runs || left.is_zero() {
                let picture = mailbox.as_ref().and_then(PictureMailbox::picture);
                drop(mailbox);
                return self.picture(picture);
            }
            drop(
                self.shared
                    .drawn
                    .wait_timeout(mailbox, left)
                    .unwrap_or_else(PoisonError::into_inner),
            );
        }
    }

    fn picture(
        &self,
        picture: Option<Result<Arc<OverlayPicture>, String>>,
    ) -> Result<Arc<OverlayPicture>, PluginError> {
        let lost = |reason| Err(PluginError::Lost { id: self.info.id.clone(), reason });
        match picture {
            Some(Ok(picture)) => Ok(picture),
            Some(Err(words)) => Err(PluginError::Failed {
                id: self.info.id.clone(),
                settings_at_fault: false,
                message: words,
            }),
            None => {
                let state = self.shared.state();
                match (&state.phase, &state.last_death) {
                    (ProcessPhase::Running, _) => lost("its picture is late".into()),
                    (_, Some(death)) => lost(death.clone()),
                    (_, None) => lost("it is starting".into()),
                }
            }
        }
    }

    pub(crate) fn optimize(
        &self,
        mesh: &Mesh,
        progress: &mut dyn FnMut(f32) -> bool,
    ) -> Result<OptimizedMesh, PluginError> {
        let failed = |error: std::io::Error| self.failed(format!("shared memory: {error}"));
        let described = self.call_long(Request::DescribeOptimizer, &[], progress)?;
        let Answer::OptimizerDescribed { reads_wedges } = described else {
            return Err(self.shared.unexpected_answer());
        };
        let (sizes, shared_mesh) = memory::write_mesh(mesh, reads_wedges).map_err(failed)?;
        let room = memory::room_for_collapses(mesh).map_err(failed)?;
        let outcome = self.call_long(Request::Optimize { sizes }, &[&shared_mesh, &room], progress);
        let Answer::Optimized { collapses, stages, theta_by_mesh } = outcome? else {
            return Err(self.shared.unexpected_answer());
        };
        let violation = |what: String| PluginError::Violation { id: self.info.id.clone(), what };
        check_stages(&stages).map_err(|what| violation(what.into()))?;
        let entries = memory::read_collapses(collapses, &room)
            .map_err(|error| violation(error.to_string()))?;
        let count = mesh.positions.len() as u32;
        let sequence = CollapseSequence::new(entries, count)
            .map_err(|source| PluginError::Sequence { id: self.info.id.clone(), source })?;
        let sequence = sequence.with_theta_by_mesh(theta_by_mesh);
        Ok(OptimizedMesh { sequence, stages })
    }

    /// Checks that the plugin has a capability.
    pub(crate) fn require_capability(&self, capability: &'static str) -> Result<(), PluginError> {
        if self.info.capabilities.iter().any(|id| id == capability) {
            return Ok(());
        }
        Err(PluginError::WrongCapability {
            id: self.info.id.clone(),
            wanted: capability,
            has: self.info.capabilities.clone(),
        })
    }

    /// A rule that its answer breaks.
    pub(crate) fn broken(&self, what: impl ToString) -> PluginError {
        PluginError::Violation { id: self.info.id.clone(), what: what.to_string() }
    }

    /// Calls with reports of progress, and cancels where `progress` returns false.
    fn call_long(
        &self,
        request: Request,
        files: &[&File],
        progress: &mut dyn FnMut(f32) -> bool,
    ) -> Outcome {
        let waiting = self.shared.start_call(request, files)?;
        let mut cancelled = false;
        loop {
            match waiting.outcome.recv_timeout(PROGRESS_PERIOD) {
                Ok(outcome) => return outcome,
                Err(RecvTimeoutError::Disconnected) => return Err(self.shared.unexpected_answer()),
                Err(RecvTimeoutError::Timeout) => {}
            }
            let fraction = f32::from_bits(waiting.progress.load(Ordering::Relaxed));
            let fraction = if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 };
            if !cancelled && !progress(fraction) {
                cancelled = true;
                waiting.connection.send(&ToPlugin::Cancel { call: waiting.call }, &[]);
            }
        }
    }

    pub(crate) fn done(&self, request: Request, files: &[&File]) -> Result<(), PluginError> {
        match self.shared.call(request, files)? {
            Answer::Done => Ok(()),
            Answer::Configured(description) => self.shared.describe(description),
            _ => Err(self.shared.unexpected_answer()),
        }
    }

    /// Configures the plugin. A process that crashes over it is restarted and configured again.
    /// One whose plugin fails by itself is killed for that. Neither is a failure of the view.
    pub(crate) fn configure_or_recover(
        &self,
        request: Request,
        files: &[&File],
    ) -> Result<(), PluginError> {
        let what = request.name();
        match self.done(request, files) {
            Err(PluginError::Lost { .. }) => Ok(()),
            Err(error) if error.is_reported_by_plugin() => {
                self.kill_and_wait(format!("`{what}` failed: {error}"));
                Ok(())
            }
            done => done,
        }
    }

    /// Locks the state while no new process is being set up.
    fn settled(&self) -> MutexGuard<'_, State> {
        loop {
            let state = self.shared.state();
            match state.phase {
                // It ends with its calls, which have deadlines.
                ProcessPhase::Starting(_) => drop(state),
                _ => return state,
            }
            std::thread::sleep(LOOK_PERIOD);
        }
    }

    /// Has the process killed, and waits until its exit is recorded.
    fn kill_and_wait(&self, reason: String) {
        let deaths = {
            let mut state = self.shared.state();
            state.kill_reason = Some(reason);
            state.deaths.count()
        };
        self.shared.wake();
        let start = Instant::now();
        while start.elapsed() < GIVE_UP_DEADLINE && self.shared.state().deaths.count() == deaths {
            std::thread::sleep(LOOK_PERIOD);
        }
    }

    fn failed(&self, message: String) -> PluginError {
        PluginError::Failed { id: self.info.id.clone(), settings_at_fault: false, message }
    }
}

impl Drop for PluginProcess {
    fn drop(&mut self) {
        self.quit();
        if let Some(supervisor) = self.supervisor.take() {
            // It ends within its own deadlines, whatever the process does.
            let _ = supervisor.join();
        }
    }
}
