//! Services of the host for a plugin instance.

use std::ffi::c_void;
use std::sync::{Arc, PoisonError, RwLock};

use busbar_plugin_abi as abi;

use crate::clock::Clock;

/// Level of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// Fault that a user must act on.
    Error,
    /// Condition that may become a fault.
    Warning,
    /// Ordinary event of operation.
    Info,
    /// Detail for the plugin's author.
    Debug,
}

impl LogLevel {
    pub(crate) fn to_abi(self) -> u32 {
        match self {
            Self::Error => abi::BUSBAR_LOG_ERROR,
            Self::Warning => abi::BUSBAR_LOG_WARNING,
            Self::Info => abi::BUSBAR_LOG_INFO,
            Self::Debug => abi::BUSBAR_LOG_DEBUG,
        }
    }
}

/// Handle to the host, for logging. Clones share it; any thread may use it. Once the plugin is gone
/// it does nothing, so that a straggling thread does no harm.
#[derive(Clone, Debug)]
pub struct Host {
    raw: Arc<RwLock<Option<RawHost>>>,
    clock: Clock,
}

#[derive(Debug)]
struct RawHost {
    context: *mut c_void,
    log: unsafe extern "C" fn(*mut c_void, u32, abi::BusbarStr),
}

// SAFETY: the ABI lets `log` be called from any thread, also at once, and the
// context is only ever passed back to it.
unsafe impl Send for RawHost {}
// SAFETY: as above.
unsafe impl Sync for RawHost {}

impl Host {
    /// Creates a handle that does nothing.
    pub(crate) fn closed() -> Self {
        Self::with_clock(Clock::default())
    }

    /// Creates a handle with a clock and without a log.
    pub(crate) fn with_clock(clock: Clock) -> Self {
        Self { raw: Arc::default(), clock }
    }

    /// Returns the clock by which [`crate::Worker`]s wait.
    pub(crate) fn clock(&self) -> &Clock {
        &self.clock
    }

    /// # Safety
    /// What the table leads to stays valid until [`Host::close`] returned.
    pub(crate) unsafe fn open(&self, host: &abi::BusbarHost) {
        let raw = host.log.map(|log| RawHost { context: host.context, log });
        *self.raw.write().unwrap_or_else(PoisonError::into_inner) = raw;
    }

    pub(crate) fn close(&self) {
        *self.raw.write().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Writes one line to the host's log.
    pub fn log(&self, level: LogLevel, message: &str) {
        let level = level.to_abi();
        if let Some(raw) = &*self.raw.read().unwrap_or_else(PoisonError::into_inner) {
            // SAFETY: context and function belong together, and `close`, which
            // waits for this guard, runs before they go; the text outlives the call.
            unsafe { (raw.log)(raw.context, level, abi::BusbarStr::from_borrowed(message)) }
        }
    }
}
