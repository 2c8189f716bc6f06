//! The host table of one instance, and its log.

use std::ffi::c_void;
use std::ptr::NonNull;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use busbar_plugin_abi as abi;

/// Lines a second that one instance may log.
const MAX_LINES_PER_SECOND: u32 = 50;
/// Bytes of one line; the rest is cut.
const MAX_LINE_BYTES: usize = 2048;

/// Log functions handed to an instance, and the memory behind them.
pub(crate) struct HostTable {
    raw: Box<abi::BusbarHost>,
    log: NonNull<Log>,
}

struct Log {
    instance: String,
    rate: Mutex<LineRate>,
}

struct LineRate {
    second: Instant,
    lines: u32,
    dropped: u64,
}

impl HostTable {
    /// A table for the instance of this configuration id.
    pub(crate) fn new(instance: &str) -> Self {
        let rate = LineRate { second: Instant::now(), lines: 0, dropped: 0 };
        let log = Box::new(Log { instance: instance.to_owned(), rate: Mutex::new(rate) });
        let log = NonNull::from(Box::leak(log));
        let raw = Box::new(abi::BusbarHost {
            struct_size: size_of::<abi::BusbarHost>() as u32,
            abi_major: abi::BUSBAR_ABI_MAJOR,
            abi_minor: abi::BUSBAR_ABI_MINOR,
            reserved: 0,
            context: log.as_ptr().cast(),
            log: Some(write_line),
        });
        Self { raw, log }
    }

    pub(crate) fn as_ptr(&self) -> *const abi::BusbarHost {
        &raw const *self.raw
    }
}

impl Drop for HostTable {
    fn drop(&mut self) {
        // SAFETY: `new` leaked it; the instance that used it is destroyed.
        drop(unsafe { Box::from_raw(self.log.as_ptr()) });
    }
}

unsafe extern "C" fn write_line(context: *mut c_void, level: u32, message: abi::BusbarStr) {
    // SAFETY: `context` is the `Log` of a live `HostTable`; only shared access.
    let Some(log) = (unsafe { context.cast::<Log>().as_ref() }) else { return };
    let Some(dropped) = log.admit() else { return };
    // SAFETY: the plugin gives a readable text.
    let line = unsafe { crate::text::read_short(message, MAX_LINE_BYTES) };
    let plugin = &log.instance;
    if dropped > 0 {
        tracing::warn!(%plugin, "{dropped} log lines dropped: too many a second");
    }
    match level {
        abi::BUSBAR_LOG_ERROR => tracing::error!(%plugin, "{line}"),
        abi::BUSBAR_LOG_WARNING => tracing::warn!(%plugin, "{line}"),
        abi::BUSBAR_LOG_INFO => tracing::info!(%plugin, "{line}"),
        _ => tracing::debug!(%plugin, "{line}"),
    }
}

impl Log {
    /// Admits a line within the rate limit. Returns the count of lines dropped since the last
    /// admitted one.
    fn admit(&self) -> Option<u64> {
        let mut rate = self.rate.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if rate.second.elapsed() >= Duration::from_secs(1) {
            (rate.second, rate.lines) = (Instant::now(), 0);
        }
        if rate.lines >= MAX_LINES_PER_SECOND {
            rate.dropped += 1;
            return None;
        }
        rate.lines += 1;
        Some(std::mem::take(&mut rate.dropped))
    }
}
