//! Telemetry adapters: capability `busbar.telemetry/2-draft`.

use std::ffi::c_void;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, SystemTime};

use busbar_plugin_abi as abi;
use busbar_tags::{Moment, Sample, SampleQueue, SourceTime, TagHandle};
use busbar_types::{Origin, ValueKind};
use serde::{Deserialize, Serialize};

use crate::sample_intake::{SampleIntake, SourcePolicy};
use crate::source_clock::ClockReport;
use crate::{Instance, PluginError, PublishedBatch, text};

/// Samples in one batch.
const MAX_BATCH: usize = 1 << 20;
/// Longest message of a plugin about its link, bytes.
pub const MAX_LINK_MESSAGE_BYTES: usize = 512;

/// A tag that a telemetry plugin is to serve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TelemetryTag {
    /// Handle in the tag table.
    pub tag: TagHandle,
    /// Type of value wanted.
    pub kind: ValueKind,
    /// Freshness limit of the tag.
    pub freshness: Duration,
    /// Id of the tag.
    pub id: String,
    /// Address as JSON text.
    pub address_json: String,
    /// Unit that samples must have; empty where the tag has none, or a scale leads to it.
    pub unit: String,
}

/// State of a plugin's link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum LinkState {
    /// No connection was tried yet.
    #[default]
    Idle,
    /// Connecting, or waiting to try again.
    Connecting,
    /// The connection is up.
    Up,
    /// The connection is down.
    Down,
}

impl LinkState {
    /// Returns the state in lower case: `idle`, `connecting`, `up` or `down`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Connecting => "connecting",
            Self::Up => "up",
            Self::Down => "down",
        }
    }
}

/// Last link state reported by a plugin, with counts of its samples.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LinkReport {
    /// State of the link.
    pub state: LinkState,
    /// A sentence for operators.
    pub message: String,
    /// Time since the last sample; `None` before the first.
    pub silent_for: Option<Duration>,
    /// The longest that any of its tags stays fresh.
    pub longest_freshness: Duration,
    /// Samples that named no tag of this plugin or made no sense.
    pub rejected: u64,
    /// Samples that later ones of their tags overtook because too many waited.
    pub dropped: u64,
    /// Findings about the source's clock.
    pub clock: ClockReport,
    /// Origin that all its samples have.
    pub origin: Origin,
    /// Time that its values are of, where that is not now: a recording's.
    pub scene_time: Option<SourceTime>,
}

/// Receiver of the raw samples of one plugin. Its functions are called from the plugin's threads.
pub trait SampleReceiver: Send + Sync {
    /// Sets the `BUSBAR_ORIGIN_*` flags of all samples that follow, as the plugin declares them.
    fn note_origin(&self, flags: u8);

    /// Takes a batch without blocking; returns the number of samples kept.
    fn publish(&self, batch: PublishedBatch<'_>) -> usize;

    /// Samples that came in no usable batch.
    fn reject(&self, count: u64);

    /// Receives the state of the plugin's link.
    fn report_link(&self, state: LinkState, message: String);

    /// Sets the time that the values belong to, where that is not now.
    fn report_scene_time(&self, time: Option<SourceTime>);
}

/// A running telemetry plugin that feeds a queue; dropping it stops it.
pub struct Telemetry {
    stream: TelemetryStream,
    receiver: Arc<QueueReceiver>,
}

/// A running telemetry plugin; dropping it stops it.
pub struct TelemetryStream {
    // Freed after `stop` was called in `drop`.
    _sink: Sink,
    table: &'static abi::BusbarTelemetry,
    instance: Arc<Instance>,
}

/// Target of the plugin's sink pointers, at a fixed address.
struct Sink {
    raw: NonNull<abi::BusbarSampleSink>,
    context: *const SinkContext,
}

// SAFETY: the pointers lead to memory that only `drop` frees; what is behind
// them is shared and `Sync`.
unsafe impl Send for Sink {}
// SAFETY: as above.
unsafe impl Sync for Sink {}

struct SinkContext(Arc<dyn SampleReceiver>);

/// Checks samples and queues them.
struct QueueReceiver {
    queue: Arc<SampleQueue>,
    intake: Mutex<SampleIntake>,
    longest_freshness: Duration,
    link: Mutex<(LinkState, String)>,
    last_sample: Mutex<Option<Moment>>,
    scene_time: Mutex<Option<SourceTime>>,
    rejected: AtomicU64,
}

impl Telemetry {
    /// Starts an instance on its tags; samples go into `queue`.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`], or what the plugin says of addresses.
    pub fn start(
        instance: Arc<Instance>,
        tags: &[TelemetryTag],
        queue: Arc<SampleQueue>,
        policy: SourcePolicy,
    ) -> Result<Self, PluginError> {
        let receiver = Arc::new(QueueReceiver {
            queue,
            intake: Mutex::new(SampleIntake::new(tags, policy)),
            longest_freshness: tags.iter().map(|t| t.freshness).max().unwrap_or_default(),
            link: Mutex::default(),
            last_sample: Mutex::default(),
            scene_time: Mutex::default(),
            rejected: AtomicU64::new(0),
        });
        let stream = TelemetryStream::start(instance, tags, receiver.clone())?;
        Ok(Self { stream, receiver })
    }

    /// Time that its values are of, where that is not now.
    pub fn scene_time(&self) -> Option<SourceTime> {
        *self.receiver.scene_time.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Validates tags and their addresses with the plugin, without a connection.
    ///
    /// # Errors
    /// Returns the errors of [`Telemetry::start`].
    pub fn check(instance: &Instance, tags: &[TelemetryTag]) -> Result<(), PluginError> {
        let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
        let Some(check) = table.check else { return Ok(()) };
        let specs: Vec<_> = tags.iter().map(to_abi).collect();
        let mut error = abi::BusbarError::empty();
        let _serial = instance.serialize_calls();
        // SAFETY: specs and error live for the call.
        let status = unsafe { check(instance.as_ptr(), specs.as_ptr(), specs.len(), &mut error) };
        instance.outcome(status, &error)
    }

    /// Returns the plugin instance of the stream.
    pub fn instance(&self) -> &Instance {
        &self.stream.instance
    }

    /// Adds origins to all samples from now on.
    pub fn add_origin(&self, origin: Origin) {
        self.receiver.intake.lock().unwrap_or_else(PoisonError::into_inner).add_origin(origin);
    }

    /// Returns the last report of the link.
    pub fn link(&self) -> LinkReport {
        let receiver = &self.receiver;
        let (state, message) = receiver.link.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let scene_time = *receiver.scene_time.lock().unwrap_or_else(PoisonError::into_inner);
        let last = *receiver.last_sample.lock().unwrap_or_else(PoisonError::into_inner);
        let intake = receiver.intake.lock().unwrap_or_else(PoisonError::into_inner);
        LinkReport {
            state,
            message,
            silent_for: last.map(|last| Moment::now().since(last)),
            longest_freshness: receiver.longest_freshness,
            rejected: receiver.rejected.load(Ordering::Relaxed),
            dropped: receiver.queue.dropped(),
            clock: intake.clock_report(),
            origin: intake.origin(),
            scene_time,
        }
    }
}

impl TelemetryStream {
    /// Starts an instance on its tags; raw samples go to `receiver`.
    ///
    /// # Errors
    /// Returns the errors of [`Telemetry::start`].
    pub fn start(
        instance: Arc<Instance>,
        tags: &[TelemetryTag],
        receiver: Arc<dyn SampleReceiver>,
    ) -> Result<Self, PluginError> {
        let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
        let (Some(start), Some(_)) = (table.start, table.stop) else {
            return Err(instance.violation("`start` or `stop` is null"));
        };
        let specs: Vec<_> = tags.iter().map(to_abi).collect();
        receiver.note_origin(table.origin as u8);
        let sink = Sink::new(Arc::new(SinkContext(receiver)));
        let mut error = abi::BusbarError::empty();
        let serial = instance.serialize_calls();
        // SAFETY: specs live for the call, the sink until `stop` returned.
        let status = unsafe {
            start(instance.as_ptr(), specs.as_ptr(), specs.len(), sink.raw.as_ptr(), &mut error)
        };
        drop(serial);
        instance.outcome(status, &error)?;
        Ok(Self { _sink: sink, table, instance })
    }
}

impl Drop for TelemetryStream {
    fn drop(&mut self) {
        if let Some(stop) = self.table.stop {
            let _serial = self.instance.serialize_calls();
            // SAFETY: it was started; the sink lives until after this call.
            unsafe { stop(self.instance.as_ptr()) }
        }
    }
}

impl SampleReceiver for QueueReceiver {
    fn note_origin(&self, flags: u8) {
        let mut intake = self.intake.lock().unwrap_or_else(PoisonError::into_inner);
        intake.add_origin(abi::origin_of_flags(flags));
    }

    fn publish(&self, batch: PublishedBatch<'_>) -> usize {
        let received = Moment::now();
        let wall_clock = wall_clock();
        // Checked before the queue is locked: the frame waits for that lock.
        let (mut valid, mut refused) = (Vec::with_capacity(batch.len()), 0);
        let mut intake = self.intake.lock().unwrap_or_else(PoisonError::into_inner);
        intake.follow_clock(wall_clock, received);
        for raw in batch.samples() {
            let mut sink = |sample: &Sample| valid.push(sample.clone());
            refused += u64::from(!intake.take(&raw, received, wall_clock, &mut sink));
        }
        drop(intake);
        self.reject(refused);
        if !valid.is_empty() {
            *self.last_sample.lock().unwrap_or_else(PoisonError::into_inner) = Some(received);
        }
        self.queue.publish(valid)
    }

    fn reject(&self, count: u64) {
        self.rejected.fetch_add(count, Ordering::Relaxed);
    }

    fn report_link(&self, state: LinkState, message: String) {
        *self.link.lock().unwrap_or_else(PoisonError::into_inner) = (state, message);
    }

    fn report_scene_time(&self, time: Option<SourceTime>) {
        *self.scene_time.lock().unwrap_or_else(PoisonError::into_inner) = time;
    }
}

impl Sink {
    fn new(context: Arc<SinkContext>) -> Self {
        let context = Arc::into_raw(context);
        let raw = Box::new(abi::BusbarSampleSink {
            struct_size: size_of::<abi::BusbarSampleSink>() as u32,
            reserved: 0,
            context: context.cast_mut().cast(),
            publish: Some(publish),
            report_link: Some(report_link),
            report_scene_time: Some(report_scene_time),
        });
        Self { raw: NonNull::from(Box::leak(raw)), context }
    }
}

impl Drop for Sink {
    fn drop(&mut self) {
        // SAFETY: `new` leaked both; after `stop`, or a failed `start`, the
        // plugin uses them no more.
        unsafe {
            drop(Box::from_raw(self.raw.as_ptr()));
            drop(Arc::from_raw(self.context));
        }
    }
}

unsafe extern "C" fn publish(
    context: *mut c_void,
    samples: *const abi::BusbarSample,
    count: usize,
) -> usize {
    // SAFETY: the `SinkContext` of a sink that lives until `stop` returned.
    let Some(context) = (unsafe { context.cast::<SinkContext>().as_ref() }) else {
        return 0;
    };
    if count == 0 || count > MAX_BATCH || samples.is_null() || !samples.is_aligned() {
        context.0.reject(count as u64);
        return 0;
    }
    // SAFETY: the plugin gives `count` samples.
    let samples = unsafe { std::slice::from_raw_parts(samples, count) };
    // SAFETY: the plugin keeps the texts of the samples for the call.
    context.0.publish(unsafe { PublishedBatch::new(samples) })
}

unsafe extern "C" fn report_link(context: *mut c_void, state: u32, message: abi::BusbarStr) {
    // SAFETY: as in `publish`.
    let Some(context) = (unsafe { context.cast::<SinkContext>().as_ref() }) else {
        return;
    };
    let state = match state {
        abi::BUSBAR_LINK_STATE_CONNECTING => LinkState::Connecting,
        abi::BUSBAR_LINK_STATE_UP => LinkState::Up,
        abi::BUSBAR_LINK_STATE_DOWN => LinkState::Down,
        _ => LinkState::Idle,
    };
    // SAFETY: the plugin gives a readable text.
    let message = unsafe { text::read_short(message, MAX_LINK_MESSAGE_BYTES) };
    context.0.report_link(state, message);
}

unsafe extern "C" fn report_scene_time(context: *mut c_void, unix_nanos: i64) {
    // SAFETY: as in `publish`.
    let Some(context) = (unsafe { context.cast::<SinkContext>().as_ref() }) else {
        return;
    };
    let time = (unix_nanos != abi::BUSBAR_NO_TIME).then_some(SourceTime(unix_nanos));
    context.0.report_scene_time(time);
}

/// The wall clock; one that is beyond counting is for ever.
pub fn wall_clock() -> SourceTime {
    SourceTime::from_system_time(SystemTime::now()).unwrap_or(SourceTime(i64::MAX))
}

pub(crate) fn to_abi(tag: &TelemetryTag) -> abi::BusbarTagSpec {
    abi::BusbarTagSpec {
        tag: tag.tag.0,
        kind: tag.kind.code(),
        reserved: [0; 3],
        freshness_millis: tag.freshness.as_millis() as u64,
        id: abi::BusbarStr::from_borrowed(&tag.id),
        address_json: abi::BusbarStr::from_borrowed(&tag.address_json),
        unit: abi::BusbarStr::from_borrowed(&tag.unit),
    }
}
