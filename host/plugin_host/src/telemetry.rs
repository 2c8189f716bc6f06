//! Capability `busbar.telemetry/1-draft`.

use std::ffi::c_void;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_plugin_abi as abi;
use busbar_tags::{DoublePoint, Quality, Reason, Sample, SampleQueue, TagHandle, Value, ValueKind};

use crate::{Instance, PluginError, text};

/// Samples in one batch.
const MAX_BATCH: usize = 1 << 20;
/// Bytes of what a plugin says of its link.
const MAX_LINK_MESSAGE_BYTES: usize = 512;
/// How far a source's clock may be ahead of the host's.
const MAX_CLOCK_AHEAD: Duration = Duration::from_secs(10);

/// A tag that a telemetry plugin is to serve.
#[derive(Clone, Debug, PartialEq)]
pub struct TelemetryTag {
    /// Handle in the tag table.
    pub tag: TagHandle,
    /// Type of value wanted.
    pub kind: ValueKind,
    /// Freshness limit.
    pub freshness: Duration,
    /// Tag id.
    pub id: String,
    /// Address: JSON text.
    pub address_json: String,
}

/// State of a plugin's link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LinkState {
    /// Not tried yet.
    #[default]
    Idle,
    /// Connecting, or waiting to try again.
    Connecting,
    /// Up.
    Up,
    /// Down.
    Down,
}

/// What a plugin last said of its link, and what came through it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LinkReport {
    /// State.
    pub state: LinkState,
    /// A sentence for operators.
    pub message: String,
    /// Time since the last sample; `None` before the first.
    pub silent_for: Option<Duration>,
    /// The longest that any of its tags stays fresh.
    pub longest_freshness: Duration,
    /// Samples that named no tag of this plugin or made no sense.
    pub rejected: u64,
    /// Samples lost because the queue was full.
    pub dropped: u64,
}

/// A running telemetry plugin; dropping it stops it.
pub struct Telemetry {
    // Freed after `stop` was called in `drop`.
    _sink: Sink,
    context: Arc<SinkContext>,
    table: &'static abi::BusbarTelemetry,
    instance: Arc<Instance>,
}

/// What the plugin's sink pointers lead to; never moved.
struct Sink {
    raw: NonNull<abi::BusbarSampleSink>,
    context: *const SinkContext,
}

// SAFETY: the pointers lead to memory that only `drop` frees; what is behind
// them is shared and `Sync`.
unsafe impl Send for Sink {}
// SAFETY: as above.
unsafe impl Sync for Sink {}

struct SinkContext {
    queue: Arc<SampleQueue>,
    /// By tag handle: whether the tag is this plugin's.
    owned: Vec<bool>,
    longest_freshness: Duration,
    link: Mutex<(LinkState, String)>,
    last_sample: Mutex<Option<Instant>>,
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
    ) -> Result<Self, PluginError> {
        let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
        let (Some(start), Some(_)) = (table.start, table.stop) else {
            return Err(instance.violation("`start` or `stop` is null"));
        };
        let specs: Vec<_> = tags.iter().map(to_abi).collect();
        let context = Arc::new(SinkContext::new(tags, queue));
        let sink = Sink::new(context.clone());
        let mut error = abi::BusbarError::empty();
        let serial = instance.serialise();
        // SAFETY: specs live for the call, the sink until `stop` returned.
        let status = unsafe {
            start(instance.as_ptr(), specs.as_ptr(), specs.len(), sink.raw.as_ptr(), &mut error)
        };
        drop(serial);
        instance.outcome(status, &error)?;
        Ok(Self { _sink: sink, context, table, instance })
    }

    /// Whether an instance could serve these tags, without connecting.
    ///
    /// # Errors
    /// As [`Telemetry::start`].
    pub fn check(instance: &Instance, tags: &[TelemetryTag]) -> Result<(), PluginError> {
        let table: &abi::BusbarTelemetry = instance.capability(abi::TELEMETRY_ID)?;
        let Some(check) = table.check else { return Ok(()) };
        let specs: Vec<_> = tags.iter().map(to_abi).collect();
        let mut error = abi::BusbarError::empty();
        let _serial = instance.serialise();
        // SAFETY: specs and error live for the call.
        let status = unsafe { check(instance.as_ptr(), specs.as_ptr(), specs.len(), &mut error) };
        instance.outcome(status, &error)
    }

    /// The instance.
    pub fn instance(&self) -> &Instance {
        &self.instance
    }

    /// What it last said of its link.
    pub fn link(&self) -> LinkReport {
        let context = &self.context;
        let (state, message) = context.link.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let last = *context.last_sample.lock().unwrap_or_else(PoisonError::into_inner);
        LinkReport {
            state,
            message,
            silent_for: last.map(|last| last.elapsed()),
            longest_freshness: context.longest_freshness,
            rejected: context.rejected.load(Ordering::Relaxed),
            dropped: context.queue.dropped(),
        }
    }
}

impl Drop for Telemetry {
    fn drop(&mut self) {
        if let Some(stop) = self.table.stop {
            let _serial = self.instance.serialise();
            // SAFETY: it was started; the sink lives until after this call.
            unsafe { stop(self.instance.as_ptr()) }
        }
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

impl SinkContext {
    fn new(tags: &[TelemetryTag], queue: Arc<SampleQueue>) -> Self {
        let size = tags.iter().map(|t| t.tag.0 as usize + 1).max().unwrap_or(0);
        let mut owned = vec![false; size];
        for tag in tags {
            owned[tag.tag.0 as usize] = true;
        }
        Self {
            queue,
            owned,
            longest_freshness: tags.iter().map(|t| t.freshness).max().unwrap_or_default(),
            link: Mutex::default(),
            last_sample: Mutex::default(),
            rejected: AtomicU64::new(0),
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
        context.rejected.fetch_add(count as u64, Ordering::Relaxed);
        return 0;
    }
    // SAFETY: the plugin gives `count` samples.
    let samples = unsafe { std::slice::from_raw_parts(samples, count) };
    let (received, wall_clock) = (Instant::now(), SystemTime::now());
    // Checked before the queue is locked: the frame waits for that lock.
    let valid: Vec<_> =
        samples.iter().filter_map(|raw| context.check(raw, received, wall_clock)).collect();
    context.rejected.fetch_add((count - valid.len()) as u64, Ordering::Relaxed);
    if !valid.is_empty() {
        *context.last_sample.lock().unwrap_or_else(PoisonError::into_inner) = Some(received);
    }
    context.queue.publish(valid)
}

unsafe extern "C" fn report_link(context: *mut c_void, state: u32, message: abi::BusbarStr) {
    // SAFETY: as in `publish`.
    let Some(context) = (unsafe { context.cast::<SinkContext>().as_ref() }) else {
        return;
    };
    let state = match state {
        abi::BUSBAR_LINK_CONNECTING => LinkState::Connecting,
        abi::BUSBAR_LINK_UP => LinkState::Up,
        abi::BUSBAR_LINK_DOWN => LinkState::Down,
        _ => LinkState::Idle,
    };
    // SAFETY: the plugin gives a readable text.
    let message = unsafe { text::read_short(message, MAX_LINK_MESSAGE_BYTES) };
    *context.link.lock().unwrap_or_else(PoisonError::into_inner) = (state, message);
}

impl SinkContext {
    fn check(
        &self,
        raw: &abi::BusbarSample,
        received: Instant,
        wall_clock: SystemTime,
    ) -> Option<Sample> {
        if !self.owned.get(raw.tag as usize).copied().unwrap_or(false) {
            return None;
        }
        let value = match raw.kind {
            abi::BUSBAR_VALUE_NONE => None,
            abi::BUSBAR_VALUE_F64 => Some(Value::F64(f64::from_bits(raw.value))),
            abi::BUSBAR_VALUE_I64 => Some(Value::I64(raw.value as i64)),
            abi::BUSBAR_VALUE_BOOL => Some(Value::Bool(raw.value != 0)),
            abi::BUSBAR_VALUE_DOUBLE_POINT => Some(Value::DoublePoint(match raw.value {
                0 => DoublePoint::Intermediate,
                1 => DoublePoint::Off,
                2 => DoublePoint::On,
                3 => DoublePoint::BadState,
                _ => return None,
            })),
            _ => return None,
        };
        let reason = reason_from_abi(raw.reason)?;
        let quality = match raw.quality {
            abi::BUSBAR_QUALITY_GOOD => Quality::Good,
            abi::BUSBAR_QUALITY_UNCERTAIN => Quality::Uncertain(reason),
            abi::BUSBAR_QUALITY_BAD => Quality::Bad(reason),
            _ => return None,
        };
        // A time in the future orders nothing: it would shut out all that follows.
        let source_time = time_from_abi(raw.source_time_unix_nanos)
            .filter(|&time| time <= wall_clock + MAX_CLOCK_AHEAD);
        let lag = source_time.and_then(|time| wall_clock.duration_since(time).ok());
        let lag = lag.unwrap_or_default();
        Some(Sample { tag: TagHandle(raw.tag), value, quality, source_time, lag, received })
    }
}

fn to_abi(tag: &TelemetryTag) -> abi::BusbarTagSpec {
    abi::BusbarTagSpec {
        tag: tag.tag.0,
        kind: u32::from(kind_to_abi(tag.kind)),
        freshness_millis: tag.freshness.as_millis() as u64,
        id: abi::BusbarStr::from_borrowed(&tag.id),
        address_json: abi::BusbarStr::from_borrowed(&tag.address_json),
    }
}

pub(crate) fn kind_to_abi(kind: ValueKind) -> u8 {
    match kind {
        ValueKind::F64 => abi::BUSBAR_VALUE_F64,
        ValueKind::I64 => abi::BUSBAR_VALUE_I64,
        ValueKind::Bool => abi::BUSBAR_VALUE_BOOL,
        ValueKind::DoublePoint => abi::BUSBAR_VALUE_DOUBLE_POINT,
    }
}

pub(crate) fn reason_to_abi(reason: Reason) -> u8 {
    match reason {
        Reason::Unknown => abi::BUSBAR_REASON_NONE,
        Reason::Communication => abi::BUSBAR_REASON_COMMUNICATION,
        Reason::Sensor => abi::BUSBAR_REASON_SENSOR,
        Reason::OutOfRange => abi::BUSBAR_REASON_OUT_OF_RANGE,
        Reason::Configuration => abi::BUSBAR_REASON_CONFIGURATION,
        Reason::NotConnected => abi::BUSBAR_REASON_NOT_CONNECTED,
        Reason::NotFinite => abi::BUSBAR_REASON_NOT_FINITE,
        Reason::Stale => abi::BUSBAR_REASON_STALE,
    }
}

fn reason_from_abi(reason: u8) -> Option<Reason> {
    Some(match reason {
        abi::BUSBAR_REASON_NONE => Reason::Unknown,
        abi::BUSBAR_REASON_COMMUNICATION => Reason::Communication,
        abi::BUSBAR_REASON_SENSOR => Reason::Sensor,
        abi::BUSBAR_REASON_OUT_OF_RANGE => Reason::OutOfRange,
        abi::BUSBAR_REASON_CONFIGURATION => Reason::Configuration,
        abi::BUSBAR_REASON_NOT_CONNECTED => Reason::NotConnected,
        abi::BUSBAR_REASON_NOT_FINITE => Reason::NotFinite,
        abi::BUSBAR_REASON_STALE => Reason::Stale,
        _ => return None,
    })
}

fn time_from_abi(unix_nanos: i64) -> Option<SystemTime> {
    if unix_nanos == abi::BUSBAR_NO_TIME {
        return None;
    }
    let distance = Duration::from_nanos(unix_nanos.unsigned_abs());
    if unix_nanos < 0 { UNIX_EPOCH.checked_sub(distance) } else { UNIX_EPOCH.checked_add(distance) }
}
