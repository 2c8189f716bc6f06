//! Instance of the plugin that a case runs with, and functions that its tables must have.

use busbar_plugin_abi as abi;

use crate::finding::{Finding, Outcome, Stop};
use crate::library::sized;
use crate::probe::{Probe, Subject};

/// An instance of the plugin of a case.
pub(crate) struct Instance<'a> {
    probe: &'a Probe,
    raw: *mut abi::BusbarPlugin,
}

// SAFETY: the ABI lets calls come from any thread, one at a time; the cases that share
// an instance between threads call `[any-thread]` functions only.
unsafe impl Send for Instance<'_> {}

// SAFETY: as above.
unsafe impl Sync for Instance<'_> {}

impl Subject {
    /// Creates an instance with the sample settings.
    pub(crate) fn make<'a>(&self, probe: &'a Probe) -> Result<Instance<'a>, Stop> {
        self.make_with(probe, &self.settings)
    }

    /// Creates an instance, or stops the case.
    pub(crate) fn make_with<'a>(
        &self,
        probe: &'a Probe,
        settings: &str,
    ) -> Result<Instance<'a>, Stop> {
        let create = self.factory.create.ok_or_else(|| {
            Finding::new("the factory lacks `create`", "set it in the BusbarPluginFactory")
        })?;
        let mut error = abi::BusbarError::empty();
        let (id, settings) =
            (abi::BusbarStr::from_borrowed(&self.id), abi::BusbarStr::from_borrowed(settings));
        probe.host.open();
        let raw = probe.create(create, id, settings, probe.host.as_ptr(), &mut error);
        if raw.is_null() {
            probe.host.close();
            let status = match error.status {
                abi::BUSBAR_OK => abi::BUSBAR_INTERNAL,
                status => status,
            };
            probe.expect_ok("create", status, &error)?;
        }
        sized(raw.cast_const(), "BusbarPlugin")?;
        Ok(Instance { probe, raw })
    }
}

impl Instance<'_> {
    pub(crate) fn as_ptr(&self) -> *const abi::BusbarPlugin {
        self.raw
    }

    /// The table of a capability, which must be there.
    pub(crate) fn capability<T>(&self, id: &'static str) -> Result<&'static T, Stop> {
        // SAFETY: `make` checked it; it lives until `destroy`.
        let get = unsafe { (*self.raw).get_capability }
            .ok_or_else(|| Finding::new("the plugin lacks `get_capability`", "set it"))?;
        let table = self.probe.get_capability(get, self.raw, abi::BusbarStr::from_static(id));
        Ok(sized(table.cast(), &format!("table of {id}"))?)
    }

    /// Asks the instance for a capability that it need not have.
    pub(crate) fn ask(&self, id: abi::BusbarStr) -> *const std::ffi::c_void {
        // SAFETY: `make` checked it; it lives until `destroy`.
        match unsafe { (*self.raw).get_capability } {
            Some(get) => self.probe.get_capability(get, self.raw, id),
            None => std::ptr::null(),
        }
    }

    /// Destroys the plugin instance.
    pub(crate) fn destroy(self) -> Outcome {
        // SAFETY: `make` checked it; it lives until here.
        let destroy = unsafe { (*self.raw).destroy }
            .ok_or_else(|| Finding::new("the plugin lacks `destroy`", "set it"))?;
        self.probe.destroy(destroy, self.raw);
        self.probe.host.close();
        Ok(())
    }
}

/// A function that a table must have.
pub(crate) fn required<F>(function: Option<F>, name: &str) -> Result<F, Stop> {
    function.ok_or_else(|| {
        let remedy = "set every function that the header does not call optional";
        Finding::new(format!("`{name}` is null"), remedy).into()
    })
}
