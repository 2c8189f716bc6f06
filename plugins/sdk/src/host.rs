//! What the host offers to a plugin instance.

use std::ffi::c_void;

use busbar_plugin_abi as abi;

/// How important a log line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogLevel {
    /// What a user must act on.
    Error,
    /// What may become a fault.
    Warning,
    /// What happened.
    Info,
    /// For the plugin's author.
    Debug,
}

/// A handle to the host: a log. Clones share it; any thread may use it while
/// the plugin lives.
#[derive(Clone, Debug)]
pub struct Host {
    context: *mut c_void,
    log: Option<unsafe extern "C" fn(*mut c_void, u32, abi::BusbarStr)>,
}

// SAFETY: the ABI lets `log` be called from any thread, also at once, and the
// context is only ever passed back to it.
unsafe impl Send for Host {}
// SAFETY: as above.
unsafe impl Sync for Host {}

impl Host {
    /// # Safety
    /// `host` is null or points to a `BusbarHost` that stays valid as long as
    /// the plugin lives.
    pub(crate) unsafe fn from_raw(host: *const abi::BusbarHost) -> Self {
        // SAFETY: the caller vouches for the pointer.
        match unsafe { host.as_ref() } {
            Some(host) => Self { context: host.context, log: host.log },
            None => Self { context: std::ptr::null_mut(), log: None },
        }
    }

    /// Writes one line to the host's log.
    pub fn log(&self, level: LogLevel, message: &str) {
        let level = match level {
            LogLevel::Error => abi::BUSBAR_LOG_ERROR,
            LogLevel::Warning => abi::BUSBAR_LOG_WARNING,
            LogLevel::Info => abi::BUSBAR_LOG_INFO,
            LogLevel::Debug => abi::BUSBAR_LOG_DEBUG,
        };
        if let Some(log) = self.log {
            // SAFETY: context and function belong together; the text outlives the call.
            unsafe { log(self.context, level, abi::BusbarStr::from_borrowed(message)) }
        }
    }
}
