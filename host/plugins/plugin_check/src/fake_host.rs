//! Fake host: the host table of a checked plugin, which validates log calls.

use std::ffi::c_void;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

use busbar_plugin_abi as abi;

use crate::finding::Finding;
use crate::text;

/// Lines that one case may log.
const MAX_LINES: u64 = 10_000;

/// Host that lives as long as the process, so that a late call of a plugin is found and does not
/// crash.
pub(crate) struct FakeHost {
    raw: abi::BusbarHost,
    watch: &'static LogRecord,
}

// SAFETY: the table never changes, and what its pointers lead to is shared and static.
unsafe impl Send for FakeHost {}
// SAFETY: as above.
unsafe impl Sync for FakeHost {}

#[derive(Default)]
struct LogRecord {
    lines: AtomicU64,
    /// Instances that may call.
    alive: AtomicU64,
    late: AtomicU64,
    faults: Mutex<Vec<String>>,
}

impl FakeHost {
    pub(crate) fn new() -> &'static Self {
        let watch: &'static LogRecord = Box::leak(Box::default());
        let raw = abi::BusbarHost {
            struct_size: size_of::<abi::BusbarHost>() as u32,
            abi_major: abi::BUSBAR_ABI_MAJOR,
            abi_minor: abi::BUSBAR_ABI_MINOR,
            reserved: 0,
            context: std::ptr::from_ref(watch).cast_mut().cast(),
            log: Some(log),
        };
        Box::leak(Box::new(Self { raw, watch }))
    }

    pub(crate) fn as_ptr(&self) -> *const abi::BusbarHost {
        &raw const self.raw
    }

    /// An instance is made: it may call.
    pub(crate) fn open(&self) {
        self.watch.alive.fetch_add(1, Ordering::SeqCst);
    }

    /// Records that an instance was destroyed, or not created.
    pub(crate) fn close(&self) {
        self.watch.alive.fetch_sub(1, Ordering::SeqCst);
    }

    /// Lines logged so far.
    pub(crate) fn lines(&self) -> u64 {
        self.watch.lines.load(Ordering::SeqCst)
    }

    /// Returns the errors in calls so far.
    pub(crate) fn findings(&self) -> Vec<Finding> {
        let faults = self.watch.faults.lock().unwrap_or_else(PoisonError::into_inner);
        let remedy = "pass UTF-8 text and one of the BUSBAR_LOG_* levels";
        let mut findings: Vec<_> = faults.iter().map(|f| Finding::new(f.clone(), remedy)).collect();
        let late = self.watch.late.load(Ordering::SeqCst);
        if late > 0 {
            findings.push(Finding::new(
                format!("it called the host's log {late} times after `destroy`"),
                "end every thread that logs before `destroy` returns",
            ));
        }
        let lines = self.lines();
        if lines > MAX_LINES {
            findings.push(Finding::new(
                format!(
                    "it logged {lines} lines in one case; the host drops more than 50 a second"
                ),
                "log changes, not every event",
            ));
        }
        findings
    }
}

unsafe extern "C" fn log(context: *mut c_void, level: u32, message: abi::BusbarStr) {
    // SAFETY: a plugin passes the static `LogRecord` of its host, or breaks the ABI.
    let Some(watch) = (unsafe { context.cast::<LogRecord>().as_ref() }) else { return };
    watch.lines.fetch_add(1, Ordering::SeqCst);
    if watch.alive.load(Ordering::SeqCst) == 0 {
        watch.late.fetch_add(1, Ordering::SeqCst);
    }
    let unknown = !(abi::BUSBAR_LOG_ERROR..=abi::BUSBAR_LOG_DEBUG).contains(&level);
    let level_fault = unknown.then(|| format!("it logged with the unknown level {level}"));
    let text_fault = text::read(message).err().map(|what| format!("a line it logged {what}"));
    let mut faults = watch.faults.lock().unwrap_or_else(PoisonError::into_inner);
    for fault in level_fault.into_iter().chain(text_fault) {
        if !faults.contains(&fault) && faults.len() < 8 {
            faults.push(fault);
        }
    }
}
