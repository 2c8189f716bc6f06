//! Plugin instance: one created plugin, destroyed on drop.

use std::ffi::c_void;
use std::ptr::NonNull;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use busbar_plugin_abi as abi;

use crate::PluginError;
use crate::library::{PluginInfo, PluginLibrary, checked};
use crate::log::HostTable;

/// An instance of a plugin with its settings. Capabilities keep it alive.
pub struct Instance {
    raw: NonNull<abi::BusbarPlugin>,
    info: PluginInfo,
    name: String,
    /// Held during `[serialized]` calls, which must not meet.
    serial: Mutex<()>,
    // The instance may use the table until it is destroyed.
    _host: HostTable,
    // Last: the library's `deinit` follows the last instance.
    _library: Arc<PluginLibrary>,
}

// SAFETY: the ABI lets `[any-thread]` functions be called from anywhere, and
// `[serialized]` ones one at a time, which `serial` sees to; `destroy` runs
// when nobody else holds the instance.
unsafe impl Send for Instance {}
// SAFETY: as above.
unsafe impl Sync for Instance {}

impl Instance {
    pub(crate) fn create(
        library: Arc<PluginLibrary>,
        info: PluginInfo,
        name: &str,
        settings: &serde_json::Value,
    ) -> Result<Self, PluginError> {
        let host = HostTable::new(name);
        let raw = library
            .create(&info.id, &settings.to_string(), &host)
            .map_err(|(status, message)| PluginError::from_status(&info.id, status, message))?;
        if checked(raw.as_ptr().cast_const()).is_none() {
            // Too short to hold a `destroy` that could be trusted: it is left,
            // and so is the table that it may use.
            std::mem::forget(host);
            let what = "its instance is misaligned or too short for its version".into();
            return Err(PluginError::Violation { id: info.id, what });
        }
        let (name, serial) = (name.to_owned(), Mutex::new(()));
        Ok(Self { raw, info, name, serial, _host: host, _library: library })
    }

    /// Locks out other `[serialized]` calls until the guard is dropped.
    pub(crate) fn serialize_calls(&self) -> MutexGuard<'_, ()> {
        self.serial.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the plugin's description of itself.
    pub fn info(&self) -> &PluginInfo {
        &self.info
    }

    /// The configuration's id of this instance.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The table of a capability.
    pub(crate) fn capability<T>(&self, id: &'static str) -> Result<&'static T, PluginError> {
        let missing = || PluginError::WrongCapability {
            id: self.info.id.clone(),
            wanted: id,
            has: self.info.capabilities.clone(),
        };
        // SAFETY: a live instance.
        let get = unsafe { self.raw.as_ref() }.get_capability.ok_or_else(missing)?;
        let _serial = self.serialize_calls();
        // SAFETY: a live instance and a static text.
        let pointer: *const c_void = unsafe { get(self.as_ptr(), abi::BusbarStr::from_static(id)) };
        if pointer.is_null() {
            return Err(missing());
        }
        checked(pointer.cast())
            .ok_or_else(|| self.violation(format!("the table of {id} is misaligned or too short")))
    }

    pub(crate) fn as_ptr(&self) -> *const abi::BusbarPlugin {
        self.raw.as_ptr()
    }

    /// A broken rule of the ABI.
    pub(crate) fn violation(&self, what: impl Into<String>) -> PluginError {
        PluginError::Violation { id: self.info.id.clone(), what: what.into() }
    }

    /// The outcome of a call.
    pub(crate) fn outcome(
        &self,
        status: abi::BusbarStatusNumber,
        error: &abi::BusbarError,
    ) -> Result<(), PluginError> {
        if status == abi::BUSBAR_OK {
            return Ok(());
        }
        Err(PluginError::from_status(&self.info.id, status, crate::text::message_of(error)))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: the instance lives until here; this is the one `destroy`.
        unsafe {
            if let Some(destroy) = self.raw.as_ref().destroy {
                destroy(self.raw.as_ptr());
            }
        }
    }
}
