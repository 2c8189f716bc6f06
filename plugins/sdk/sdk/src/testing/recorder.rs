//! Sample sink that records samples and link reports.

use std::collections::VecDeque;
use std::ffi::c_void;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use busbar_plugin_abi as abi;

use crate::value::{read_quality, read_value};
use crate::{LinkState, Sample, SampleFlags, SampleSink, Value};

/// Samples, and link reports, that a [`Recorder`] keeps; older ones go.
pub const MAX_RECORDED: usize = 100_000;

/// Recorded samples and link reports, in order.
#[derive(Clone, Debug, Default)]
pub struct Recording {
    /// Samples, the oldest first.
    pub samples: VecDeque<Sample>,
    /// Link reports, the oldest first.
    pub links: VecDeque<(LinkState, String)>,
}

impl Recording {
    /// Returns the newest sample of a tag.
    pub fn latest(&self, tag: u32) -> Option<Sample> {
        self.samples.iter().rfind(|s| s.tag == tag).cloned()
    }

    /// Returns the values of all samples that have one, with their tags, in order.
    ///
    /// # Panics
    /// When one is no integer, or older ones may be gone.
    #[track_caller]
    pub fn integers(&self) -> Vec<(u32, i64)> {
        assert!(self.samples.len() < MAX_RECORDED, "older samples may be gone");
        let integer = |sample: &Sample| match sample.value.as_ref()? {
            Value::I64(value) => Some((sample.tag, *value)),
            other => panic!("{other:?} of tag {}", sample.tag),
        };
        self.samples.iter().filter_map(integer).collect()
    }
}

/// Host's end of [`SampleSink`] that records what it receives. Samples pass through the C ABI on
/// their way, as in the real host.
pub struct Recorder {
    sink: SampleSink,
    raw: *mut abi::BusbarSampleSink,
    shared: *mut Shared,
}

// SAFETY: both pointers lead to memory that this recorder owns until it is
// dropped; `Shared` is behind a lock and the raw sink never changes.
unsafe impl Send for Recorder {}
// SAFETY: as above.
unsafe impl Sync for Recorder {}

#[derive(Default)]
struct Shared {
    recording: Mutex<Recording>,
    changed: Condvar,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Recording> {
        self.recording.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Default for Recorder {
    fn default() -> Self {
        Self::new()
    }
}

impl Recorder {
    /// Creates an empty recording.
    pub fn new() -> Self {
        let shared = Box::into_raw(Box::new(Shared::default()));
        let raw = Box::into_raw(Box::new(abi::BusbarSampleSink {
            struct_size: size_of::<abi::BusbarSampleSink>() as u32,
            reserved: 0,
            context: shared.cast(),
            publish: Some(publish),
            report_link: Some(report_link),
            report_scene_time: None,
        }));
        Self {
            // SAFETY: `drop` closes the sink before it frees `raw`.
            sink: unsafe { SampleSink::open(raw) },
            raw,
            shared,
        }
    }

    /// Returns the sink to pass to a plugin. After the recorder is dropped it takes nothing more.
    pub fn sink(&self) -> SampleSink {
        self.sink.clone()
    }

    /// Returns all that was recorded so far.
    pub fn recording(&self) -> Recording {
        self.shared().lock().clone()
    }

    /// Returns the newest sample of a tag.
    pub fn latest(&self, tag: u32) -> Option<Sample> {
        self.shared().lock().latest(tag)
    }

    /// Takes away all that was recorded so far.
    pub fn take(&self) -> Recording {
        std::mem::take(&mut *self.shared().lock())
    }

    /// Forgets all that was recorded so far.
    pub fn clear(&self) {
        *self.shared().lock() = Recording::default();
    }

    /// Waits until the recording satisfies a condition; returns false if it does not in time.
    pub fn wait_until(&self, timeout: Duration, wanted: impl Fn(&Recording) -> bool) -> bool {
        let deadline = Instant::now() + timeout;
        let shared = self.shared();
        let mut recording = shared.lock();
        while !wanted(&recording) {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            let waited = shared.changed.wait_timeout(recording, left);
            recording = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
        true
    }

    fn shared(&self) -> &Shared {
        // SAFETY: `new` made it and only `drop` frees it.
        unsafe { &*self.shared }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // Waits for calls under way; later ones find nothing.
        self.sink.close();
        // SAFETY: `new` made both boxes, and the closed sink names neither.
        unsafe {
            drop(Box::from_raw(self.raw));
            drop(Box::from_raw(self.shared));
        }
    }
}

unsafe extern "C" fn publish(
    context: *mut c_void,
    samples: *const abi::BusbarSample,
    count: usize,
) -> usize {
    // SAFETY: the context is the recorder's `Shared`, which outlives the sink.
    let shared = unsafe { &*context.cast::<Shared>() };
    // SAFETY: `SampleSink::publish` gives `count` samples.
    let Ok(samples) = (unsafe { crate::boundary::slice(samples, count) }) else {
        return 0;
    };
    let mut recording = shared.lock();
    for sample in samples {
        // SAFETY: `SampleSink::publish` gives texts that live for the call.
        push(&mut recording.samples, unsafe { from_abi(sample) });
    }
    shared.changed.notify_all();
    count
}

unsafe extern "C" fn report_link(context: *mut c_void, state: u32, message: abi::BusbarStr) {
    // SAFETY: the context is the recorder's `Shared`, which outlives the sink.
    let shared = unsafe { &*context.cast::<Shared>() };
    // SAFETY: `SampleSink::report_link` gives a text that lives for the call.
    let message = unsafe { crate::boundary::text(message) }.unwrap_or("not UTF-8");
    let state = match state {
        abi::BUSBAR_LINK_STATE_UP => LinkState::Up,
        abi::BUSBAR_LINK_STATE_DOWN => LinkState::Down,
        _ => LinkState::Connecting,
    };
    push(&mut shared.lock().links, (state, message.to_owned()));
    shared.changed.notify_all();
}

fn push<T>(queue: &mut VecDeque<T>, item: T) {
    if queue.len() == MAX_RECORDED {
        queue.pop_front();
    }
    queue.push_back(item);
}

/// # Safety
/// The text of the sample is null or readable for its length.
unsafe fn from_abi(sample: &abi::BusbarSample) -> Sample {
    let nanos = sample.source_time_unix_nanos;
    let &abi::BusbarSample { kind, number, integer, text, .. } = sample;
    Sample {
        tag: sample.tag,
        // SAFETY: as the caller vouches.
        value: unsafe { read_value(abi::ValueFields { kind, number, integer, text }) },
        quality: read_quality(sample.quality, sample.reason),
        source_time: (nanos != abi::BUSBAR_NO_TIME).then(|| system_time(nanos)),
        flags: SampleFlags::from_bits(sample.flags),
    }
}

fn system_time(unix_nanos: i64) -> SystemTime {
    let distance = Duration::from_nanos(unix_nanos.unsigned_abs());
    if unix_nanos < 0 { UNIX_EPOCH - distance } else { UNIX_EPOCH + distance }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DoublePoint, Reason, Text};

    #[test]
    fn samples_survive_the_abi() {
        let recorder = Recorder::new();
        let sent = [
            Sample::good(1, Value::F64(-1.5)),
            Sample::good(2, Value::I64(-7)),
            Sample::good(3, Value::Bool(true)),
            Sample::good(4, Value::DoublePoint(DoublePoint::On)),
            Sample::good(8, Value::Text(Text::new("AUTO").unwrap())),
            Sample::good(9, Value::Text(Text::new("").unwrap())),
            Sample::bad(5, Reason::Configuration),
            Sample {
                source_time: Some(UNIX_EPOCH + Duration::from_nanos(1_700_000_000_123_456_789)),
                ..Sample::good(6, Value::I64(i64::MIN))
            },
            Sample {
                source_time: Some(UNIX_EPOCH - Duration::from_nanos(5)),
                ..Sample::good(7, Value::I64(1))
            }
            .with_flags(SampleFlags::BUFFERED | SampleFlags::SUBSTITUTED),
        ];
        assert_eq!(recorder.sink().publish(&sent), sent.len());
        assert_eq!(Vec::from(recorder.recording().samples), sent);
    }

    #[test]
    fn a_time_beyond_counting_is_unusable_not_missing() {
        let recorder = Recorder::new();
        let far = UNIX_EPOCH + Duration::from_secs(1 << 40);
        let sample = Sample { source_time: Some(far), ..Sample::good(1, Value::I64(1)) };
        recorder.sink().publish(&[sample]);
        let expected = Sample::good(1, Value::I64(1)).with_flags(SampleFlags::TIME_UNUSABLE);
        assert_eq!(recorder.latest(1), Some(expected));
    }

    #[test]
    fn link_reports_keep_their_order() {
        let recorder = Recorder::new();
        recorder.sink().report_link(LinkState::Connecting, "a");
        recorder.sink().report_link(LinkState::Down, "b");
        let links = Vec::from(recorder.recording().links);
        let expected = [(LinkState::Connecting, "a".to_owned()), (LinkState::Down, "b".to_owned())];
        assert_eq!(links, expected);
    }

    #[test]
    fn a_dropped_recorder_takes_nothing_more() {
        let recorder = Recorder::new();
        let sink = recorder.sink();
        drop(recorder);
        assert_eq!(sink.publish(&[Sample::bad(1, Reason::Stale)]), 0);
    }
}
