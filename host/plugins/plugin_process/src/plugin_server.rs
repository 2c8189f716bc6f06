//! Plugin server: the process of an isolated plugin, `busbar plugin-host`.
//!
//! Standard input is the socket to the host. One thread reads it and answers pings. Calls run on
//! the main thread, one at a time; each optimization has a thread of its own. The plugin is
//! driven by the same code as in the viewer's process.

use std::collections::BTreeMap;
use std::fs::File;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use busbar_plugin_host::{
    Catalog, Commands, Instance, LibraryFile, LinkState, MeshOptimizer, Overlay, PluginError,
    PublishedBatch, SampleReceiver, Simulator, TelemetryStream, WrittenCollapses,
};
use busbar_tags::{ClockReadings, Moment, PauseDetector, SourceTime};
use rustix::process::{Signal, getpid, kill_process};

use crate::command::PipeStreams;
use crate::message::{Answer, CallError, FromPlugin, PROTOCOL_VERSION, Request, ToPlugin};
use crate::ring::RingWriter;
use crate::sandbox::{confine, detach_from_host};
use crate::{framing, memory};
use busbar_protocol::socket;

/// Meshes that are optimised at once.
const MAX_OPTIMISING: usize = 64;

type Outcome = Result<Answer, CallError>;
/// A call, what to do, and the descriptors that came along.
type Call = (u64, Request, Vec<File>);

/// Serves the host until it has enough.
///
/// # Errors
/// When this process was not started by a host, or cannot be set apart from it.
pub fn serve() -> Result<(), String> {
    detach_from_host()?;
    let link = HostConnection::take_stdin()?;
    let (sender, calls) = channel();
    let reader = link.clone();
    let spawned =
        thread::Builder::new().name("host".into()).spawn(move || read_host(&reader, &sender));
    spawned.map_err(|error| format!("no thread can be started: {error}"))?;
    let session = PluginServer {
        link,
        catalog: None,
        stream: None,
        simulator: None,
        overlay: None,
        instance: None,
    };
    session.run(&calls);
    Ok(())
}

/// The socket to the host.
struct HostConnection {
    socket: UnixStream,
    sending: Mutex<()>,
    /// Optimising calls under way, and whether each was cancelled.
    cancelled: Mutex<BTreeMap<u64, Arc<AtomicBool>>>,
}

impl HostConnection {
    fn take_stdin() -> Result<Arc<Self>, String> {
        let fault = |error: std::io::Error| {
            format!("this command is for Busbar itself, which starts it: {error}")
        };
        let stdin = std::io::stdin();
        let socket = UnixStream::from(stdin.as_fd().try_clone_to_owned().map_err(fault)?);
        socket.peer_addr().map_err(fault)?;
        let nothing = File::open("/dev/null").map_err(fault)?;
        rustix::stdio::dup2_stdin(nothing).map_err(|error| fault(error.into()))?;
        Ok(Arc::new(Self { socket, sending: Mutex::default(), cancelled: Mutex::default() }))
    }

    /// Sends a message. A host that cannot be reached any more has no use for
    /// this process.
    fn send(&self, message: &FromPlugin) {
        let sent = framing::encode(message).and_then(|bytes| {
            let _one = self.sending.lock().unwrap_or_else(PoisonError::into_inner);
            socket::send(&self.socket, &bytes, &[]).map_err(|error| error.to_string())
        });
        if sent.is_err() {
            kill_self();
        }
    }

    fn answer(&self, call: u64, result: Outcome) {
        self.send(&FromPlugin::Done { call, result });
    }

    fn cancelled(&self) -> std::sync::MutexGuard<'_, BTreeMap<u64, Arc<AtomicBool>>> {
        self.cancelled.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ends this process without running anything of the plugin's.
fn kill_self() -> ! {
    let _ = kill_process(getpid(), Signal::KILL);
    std::process::abort()
}

fn read_host(link: &Arc<HostConnection>, calls: &Sender<Call>) {
    loop {
        let Ok(Some((bytes, files))) = socket::receive(&link.socket, framing::MAX_SENT_BYTES)
        else {
            kill_self()
        };
        match framing::decode(&bytes) {
            Ok(ToPlugin::Ping) => link.send(&FromPlugin::Pong),
            Ok(ToPlugin::Call { call, request }) => {
                if let Request::Optimize { .. } = request {
                    link.cancelled().insert(call, Arc::default());
                }
                if calls.send((call, request, files)).is_err() {
                    return;
                }
            }
            Ok(ToPlugin::Cancel { call }) => {
                if let Some(cancelled) = link.cancelled().get(&call) {
                    cancelled.store(true, Ordering::Relaxed);
                }
            }
            // The main thread ends when this end of its channel is gone.
            Ok(ToPlugin::Quit) => return,
            Err(_) => kill_self(),
        }
    }
}

/// Server of the one instance in this process.
struct PluginServer {
    link: Arc<HostConnection>,
    catalog: Option<Catalog>,
    // In the order in which they must go.
    stream: Option<TelemetryStream>,
    simulator: Option<Simulator>,
    overlay: Option<Overlay>,
    instance: Option<Arc<Instance>>,
}

impl PluginServer {
    fn run(mut self, calls: &Receiver<Call>) {
        while let Ok((call, request, files)) = calls.recv() {
            match request {
                Request::Optimize { sizes } => {
                    if let Err(fault) = self.optimize(call, sizes, files) {
                        self.link.cancelled().remove(&call);
                        self.link.answer(call, Err(fault));
                    }
                }
                Request::Run { name, arguments } => {
                    let outcome = self.run_command(call, &name, &arguments, files);
                    self.link.answer(call, outcome);
                }
                request => {
                    let outcome = self.handle_request(request, files);
                    self.link.answer(call, outcome);
                }
            }
        }
    }

    fn handle_request(&mut self, request: Request, files: Vec<File>) -> Outcome {
        let file =
            || files.into_iter().next().ok_or_else(|| invalid_request("a descriptor is missing"));
        match request {
            Request::Load { version, .. } if version != PROTOCOL_VERSION => {
                Err(CallError::Library(format!(
                    "this host speaks version {PROTOCOL_VERSION}, the viewer {version}"
                )))
            }
            Request::Load { path, confinement, .. } => {
                let library = LibraryFile::trusted(path, file()?);
                let confined = confine(confinement);
                let catalog = Catalog::from_file(&library).map_err(CallError::Library)?;
                let plugins = catalog.plugins().cloned().collect();
                self.catalog = Some(catalog);
                Ok(Answer::Loaded { plugins, confined })
            }
            Request::Create { name, plugin, settings } => {
                let catalog =
                    self.catalog.as_ref().ok_or_else(|| invalid_request("nothing is loaded"))?;
                let settings = serde_json::from_str(&settings)
                    .map_err(|error| invalid_request(&format!("settings are no JSON: {error}")))?;
                self.instance = Some(catalog.create(&name, &plugin, &settings)?);
                Ok(Answer::Done)
            }
            Request::Check { tags } => {
                busbar_plugin_host::Telemetry::check(self.instance()?, &tags)?;
                Ok(Answer::Done)
            }
            Request::Start { tags } => {
                let ring = RingWriter::new(&file()?).map_err(|error| invalid_request(&error))?;
                let receiver =
                    SampleForwarder::start(self.link.clone(), ring).map_err(|e| failed(&e))?;
                let stream = TelemetryStream::start(self.instance()?.clone(), &tags, receiver)?;
                self.stream = Some(stream);
                Ok(Answer::Done)
            }
            Request::Simulate { tags, simulation, scenario } => {
                let instance = self.instance()?.clone();
                let simulator = Simulator::start(instance, &tags, &simulation, &scenario)?;
                self.simulator = Some(simulator);
                Ok(Answer::Done)
            }
            Request::SimulationStatus => {
                let simulator = self.simulator.as_ref();
                let simulator = simulator.ok_or_else(|| invalid_request("it does not simulate"))?;
                Ok(Answer::Simulating(simulator.status()?))
            }
            Request::Configure { bindings } => {
                let overlay = Overlay::configure(self.instance()?.clone(), bindings)?;
                let description = overlay.description().as_ref().clone();
                self.overlay = Some(overlay);
                Ok(Answer::Configured(description))
            }
            Request::Draw { states, scene_time } => {
                let overlay =
                    self.overlay.as_mut().ok_or_else(|| invalid_request("it is not configured"))?;
                Ok(Answer::Drawn(overlay.draw_states(&states, scene_time)?))
            }
            Request::DescribeOptimizer => {
                let optimizer = MeshOptimizer::from_instance(self.instance()?.clone())?;
                Ok(Answer::OptimizerDescribed { reads_wedges: optimizer.reads_wedges() })
            }
            Request::Capability(request) => {
                Ok(Answer::Capability(request.answer(self.instance()?)?))
            }
            Request::Commands => {
                Ok(Answer::Commands(Commands::from_instance(self.instance()?.clone())?.list()?))
            }
            Request::Optimize { .. } | Request::Run { .. } => Err(invalid_request("not done here")),
        }
    }

    fn instance(&self) -> Result<&Arc<Instance>, CallError> {
        self.instance.as_ref().ok_or_else(|| invalid_request("there is no instance"))
    }

    /// Runs a command; its output is closed before the answer goes.
    fn run_command(
        &self,
        call: u64,
        name: &str,
        arguments: &[String],
        files: Vec<File>,
    ) -> Outcome {
        let [input, output]: [File; 2] =
            files.try_into().map_err(|_| invalid_request("a descriptor is missing"))?;
        let tell = |fraction| self.link.send(&FromPlugin::Progress { call, fraction });
        let mut streams = PipeStreams::new(input, output, tell);
        let commands = Commands::from_instance(self.instance()?.clone())?;
        Ok(Answer::Ran(commands.run(name, arguments, &mut streams)?))
    }

    /// Optimises on a thread of its own, which answers the call.
    fn optimize(
        &self,
        call: u64,
        sizes: memory::MeshSizes,
        files: Vec<File>,
    ) -> Result<(), CallError> {
        let optimizer = MeshOptimizer::from_instance(self.instance()?.clone())?;
        let [mesh, room]: [File; 2] =
            files.try_into().map_err(|_| invalid_request("a descriptor is missing"))?;
        if self.link.cancelled().len() > MAX_OPTIMISING {
            return Err(invalid_request("too many meshes at once"));
        }
        let link = self.link.clone();
        let work = move || {
            let outcome = optimize_shared(&optimizer, sizes, &mesh, &room, &link, call);
            link.cancelled().remove(&call);
            link.answer(call, outcome);
        };
        let spawned = thread::Builder::new().name("optimize".into()).spawn(work);
        spawned.map(drop).map_err(|error| failed(&error))
    }
}

fn optimize_shared(
    optimizer: &MeshOptimizer,
    sizes: memory::MeshSizes,
    mesh: &File,
    room: &File,
    link: &HostConnection,
    call: u64,
) -> Outcome {
    let mesh = memory::SharedMesh::map(sizes, mesh).map_err(|error| failed(&error))?;
    let mut room = memory::CollapseRoom::map(room).map_err(|error| failed(&error))?;
    let cancelled = link.cancelled().get(&call).cloned().unwrap_or_default();
    let mut told = Instant::now();
    // The host checks what was written: it could not rely on a check here.
    let written = optimizer.optimize_into(mesh.view(), room.collapses(), |fraction| {
        if told.elapsed() > PROGRESS_PERIOD {
            told = Instant::now();
            link.send(&FromPlugin::Progress { call, fraction });
        }
        !cancelled.load(Ordering::Relaxed)
    })?;
    let WrittenCollapses { collapses, stages, theta_by_mesh } = written;
    Ok(Answer::Optimized { collapses: collapses as u32, stages, theta_by_mesh })
}

/// Shortest period between two progress messages.
const PROGRESS_PERIOD: Duration = Duration::from_millis(20);

/// Samples into the ring, the rest over the socket. Unchecked: the host checks.
struct SampleForwarder {
    link: Arc<HostConnection>,
    writing: Mutex<RingState>,
    /// Told when samples wait for room.
    waiting: Condvar,
}

struct RingState {
    ring: RingWriter,
    pauses: PauseDetector,
}

impl RingState {
    /// Reports a pause of this process that just ended to the reader.
    fn report_pause(&mut self) {
        if let Some(pause) = self.pauses.observe(ClockReadings::now()) {
            self.ring.note_pause(pause.until);
        }
    }
}

/// Retry period for samples that found no room in the ring.
const FLUSH_PERIOD: Duration = Duration::from_millis(5);
/// Period at which the flushing thread checks for its end and for pauses of this process. It is
/// well below the gap that counts as a pause.
const FLUSH_CHECK: Duration = Duration::from_millis(500);

impl SampleForwarder {
    /// Writes into `ring`, with a thread that helps when that is full.
    fn start(link: Arc<HostConnection>, ring: RingWriter) -> std::io::Result<Arc<Self>> {
        let writing = RingState { ring, pauses: PauseDetector::default() };
        let writing = Mutex::new(writing);
        let forwarder = Arc::new(Self { link, writing, waiting: Condvar::new() });
        let weak = Arc::downgrade(&forwarder);
        let flush = move || while weak.upgrade().map(|forwarder| forwarder.flush()).is_some() {};
        thread::Builder::new().name("samples".into()).spawn(flush)?;
        Ok(forwarder)
    }

    fn writing(&self) -> MutexGuard<'_, RingState> {
        self.writing.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits a while for samples to wait for room, and writes them as there is some.
    fn flush(&self) {
        let waiting = self.waiting.wait_timeout(self.writing(), FLUSH_CHECK);
        let (mut writing, _) = waiting.unwrap_or_else(PoisonError::into_inner);
        writing.report_pause();
        while writing.ring.flush() {
            drop(writing);
            thread::sleep(FLUSH_PERIOD);
            writing = self.writing();
            writing.report_pause();
        }
    }
}

impl SampleReceiver for SampleForwarder {
    fn note_origin(&self, flags: u8) {
        self.writing().ring.note_origin(flags);
    }

    fn publish(&self, batch: PublishedBatch<'_>) -> usize {
        let mut writing = self.writing();
        // First: what is written after a pause may be from before it.
        writing.report_pause();
        if writing.ring.write(batch.samples(), Moment::now()) {
            self.waiting.notify_one();
        }
        batch.len()
    }

    fn reject(&self, count: u64) {
        self.writing().ring.reject(count);
    }

    fn report_link(&self, state: LinkState, message: String) {
        self.link.send(&FromPlugin::Link { state, message });
    }

    fn report_scene_time(&self, time: Option<SourceTime>) {
        self.writing().ring.note_scene_time(time);
    }
}

/// Error of a request that does not fit the state.
fn invalid_request(what: &str) -> CallError {
    CallError::Violation(format!("the call does not fit: {what}"))
}

fn failed(error: &std::io::Error) -> CallError {
    CallError::from(PluginError::Failed {
        id: String::new(),
        settings_at_fault: false,
        message: error.to_string(),
    })
}
