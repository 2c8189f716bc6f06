//! Fake sample sink of a checked telemetry plugin, which validates every sample.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::c_void;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_abi as abi;

use crate::finding::Finding;
use crate::text;

/// Samples in one batch that the host takes.
const MAX_BATCH: usize = 1 << 20;
/// Largest time by which a source's clock may be ahead of this one.
const MAX_CLOCK_AHEAD: Duration = Duration::from_secs(10);
/// Longest message of a plugin about its link, bytes.
const MAX_LINK_BYTES: usize = 512;

/// A sink that lives as long as the process.
pub(crate) struct FakeSink {
    raw: abi::BusbarSampleSink,
    shared: &'static Mutex<SinkRecord>,
}

// SAFETY: the table never changes, and what its pointers lead to is static and locked.
unsafe impl Send for FakeSink {}
// SAFETY: as above.
unsafe impl Sync for FakeSink {}

/// Records of calls to a sink.
#[derive(Clone, Debug, Default)]
pub(crate) struct SinkRecord {
    /// `BUSBAR_VALUE_KIND_*` wanted, by tag.
    wanted: BTreeMap<u32, u8>,
    /// Tags of which at least one sample came.
    pub(crate) tags: BTreeSet<u32>,
    /// Number of samples received.
    pub(crate) samples: u64,
    /// Link reports that came.
    pub(crate) links: u64,
    /// Calls that came while the plugin was idle.
    pub(crate) late: u64,
    open: bool,
    faults: BTreeSet<String>,
}

impl FakeSink {
    /// A sink for tags with the kinds that are wanted of them.
    pub(crate) fn new(wanted: impl IntoIterator<Item = (u32, u8)>) -> &'static Self {
        let seen = SinkRecord { wanted: wanted.into_iter().collect(), ..SinkRecord::default() };
        let shared: &'static Mutex<SinkRecord> = Box::leak(Box::new(Mutex::new(seen)));
        let raw = abi::BusbarSampleSink {
            struct_size: size_of::<abi::BusbarSampleSink>() as u32,
            reserved: 0,
            context: std::ptr::from_ref(shared).cast_mut().cast(),
            publish: Some(publish),
            report_link: Some(report_link),
            report_scene_time: None,
        };
        Box::leak(Box::new(Self { raw, shared }))
    }

    pub(crate) fn as_ptr(&self) -> *const abi::BusbarSampleSink {
        &raw const self.raw
    }

    /// Sets whether the plugin is active, so that it may call.
    pub(crate) fn set_open(&self, open: bool) {
        self.lock().open = open;
    }

    /// Returns the calls recorded so far.
    pub(crate) fn seen(&self) -> SinkRecord {
        self.lock().clone()
    }

    fn lock(&self) -> MutexGuard<'_, SinkRecord> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl SinkRecord {
    /// Returns the errors in calls so far.
    pub(crate) fn findings(&self) -> Vec<Finding> {
        let remedy = "see BusbarSample and BusbarSampleSink in the header";
        self.faults.iter().map(|fault| Finding::new(fault.clone(), remedy)).collect()
    }

    fn record_call(&mut self) {
        self.late += u64::from(!self.open);
    }

    fn fault(&mut self, what: String) {
        if self.faults.len() < 16 {
            self.faults.insert(what);
        }
    }

    fn validate_text(&mut self, sample: &abi::BusbarSample) {
        // The host takes such a text as far as it goes; its author should know.
        let (tag, limit) = (sample.tag, abi::BUSBAR_MAX_TEXT_VALUE);
        match text::read(sample.text) {
            Err(what) => self.fault(format!("the text of a sample of tag {tag} {what}")),
            Ok(text) if text.len() > limit as usize => {
                let len = text.len();
                self.fault(format!("a text of tag {tag} has {len} bytes; {limit} are taken"));
            }
            Ok(_) => {}
        }
    }

    fn validate_sample(&mut self, sample: &abi::BusbarSample) {
        let tag = sample.tag;
        let Some(&wanted) = self.wanted.get(&tag) else {
            return self.fault(format!("a sample names tag {tag}, which `start` did not give"));
        };
        self.tags.insert(tag);
        let kind = sample.kind;
        if kind != abi::BUSBAR_VALUE_KIND_NONE && kind != wanted {
            self.fault(format!("a sample of tag {tag} has value kind {kind}, not {wanted}"));
        }
        match kind {
            abi::BUSBAR_VALUE_KIND_F64 if sample.quality == abi::BUSBAR_QUALITY_GOOD => {
                let value = sample.number;
                if !value.is_finite() {
                    self.fault(format!("a sample of tag {tag} is {value} and says it is good"));
                }
            }
            abi::BUSBAR_VALUE_KIND_BOOL if !(0..=1).contains(&sample.integer) => {
                self.fault(format!("a bool sample of tag {tag} has value {}", sample.integer));
            }
            abi::BUSBAR_VALUE_KIND_DOUBLE_POINT if !(0..=3).contains(&sample.integer) => {
                self.fault(format!("a double point of tag {tag} has value {}", sample.integer));
            }
            abi::BUSBAR_VALUE_KIND_TEXT => self.validate_text(sample),
            abi::BUSBAR_VALUE_KIND_NONE if sample.quality == abi::BUSBAR_QUALITY_GOOD => {
                self.fault(format!("a sample of tag {tag} is good and has no value"));
            }
            _ => {}
        }
        if sample.quality > abi::BUSBAR_QUALITY_BAD {
            self.fault(format!("a sample of tag {tag} has quality {}", sample.quality));
        }
        match sample.reason {
            abi::BUSBAR_REASON_STALE => {
                self.fault(format!("a sample of tag {tag} is stale: only the host says that"));
            }
            reason if reason > abi::BUSBAR_REASON_SOURCE_TIME => {
                self.fault(format!("a sample of tag {tag} has reason {reason}"));
            }
            _ => {}
        }
        if sample.source_time_unix_nanos != abi::BUSBAR_NO_TIME {
            let now = SystemTime::now() + MAX_CLOCK_AHEAD;
            let now = now.duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
            if i128::from(sample.source_time_unix_nanos) > now as i128 {
                self.fault(format!("a sample of tag {tag} has a source time in the future"));
            }
        }
    }
}

unsafe extern "C" fn publish(
    context: *mut c_void,
    samples: *const abi::BusbarSample,
    count: usize,
) -> usize {
    // SAFETY: a plugin passes the static context of its sink, or breaks the ABI.
    let Some(seen) = (unsafe { context.cast::<Mutex<SinkRecord>>().as_ref() }) else { return 0 };
    let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
    seen.record_call();
    if count > MAX_BATCH || (count > 0 && (samples.is_null() || !samples.is_aligned())) {
        seen.fault(format!("a batch of {count} samples is null, misaligned or too large"));
        return 0;
    }
    if count == 0 {
        return 0;
    }
    // SAFETY: not null and aligned; the plugin vouches for `count` samples.
    for sample in unsafe { std::slice::from_raw_parts(samples, count) } {
        seen.validate_sample(sample);
    }
    seen.samples += count as u64;
    count
}

unsafe extern "C" fn report_link(context: *mut c_void, state: u32, message: abi::BusbarStr) {
    // SAFETY: as in `publish`.
    let Some(seen) = (unsafe { context.cast::<Mutex<SinkRecord>>().as_ref() }) else { return };
    let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
    seen.record_call();
    seen.links += 1;
    if state > abi::BUSBAR_LINK_STATE_DOWN {
        seen.fault(format!("a link report has the unknown state {state}"));
    }
    match text::read(message) {
        Err(what) => seen.fault(format!("the text of a link report {what}")),
        Ok(text) if text.len() > MAX_LINK_BYTES => {
            seen.fault(format!("the text of a link report has more than {MAX_LINK_BYTES} bytes"));
        }
        Ok(_) => {}
    }
}
