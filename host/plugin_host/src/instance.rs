//! One living plugin.

use std::ffi::c_void;
use std::ptr::NonNull;
use std::sync::Arc;

use busbar_plugin_abi as abi;

use crate::PluginError;
use crate::library::{PluginInfo, PluginLibrary, table};
use crate::log::HostTable;

/// An instance of a plugin with its settings. Capabilities keep it alive.
pub struct Instance {
    raw: NonNull<abi::BusbarPlugin>,
    info: PluginInfo,
    name: String,
    // The instance may use the table until it is destroyed.
    _host: Box<HostTable>,
    // Last: the library's `deinit` follows the last instance.
    _library: Arc<PluginLibrary>,
}

// SAFETY: the ABI says from which threads each function may be called; the
// capabilities' wrappers give `[main-thread]` functions `&mut self` only.
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
        let raw = library.create(&info.id, &settings.to_string(), &host).map_err(|message| {
            PluginError::Failed { id: info.id.clone(), settings_at_fault: true, message }
        })?;
        let instance = Self { raw, info, name: name.to_owned(), _host: host, _library: library };
        // SAFETY: `create` gave it; nothing else uses it yet.
        let size = unsafe { raw.cast::<u32>().read() };
        if (size as usize) < size_of::<abi::BusbarPlugin>() {
            let violation = instance.violation("its instance is too short for its version");
            // Too short to hold a `destroy` that could be trusted.
            std::mem::forget(instance);
            return Err(violation);
        }
        Ok(instance)
    }

    /// What the plugin says of itself.
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
        // SAFETY: a live instance and a static text.
        let pointer: *const c_void = unsafe { get(self.as_ptr(), abi::BusbarStr::from_static(id)) };
        if pointer.is_null() {
            return Err(missing());
        }
        table(pointer).ok_or_else(|| self.violation(format!("the table of {id} is too short")))
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
        status: abi::BusbarStatus,
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
