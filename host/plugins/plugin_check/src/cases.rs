//! The cases: a table, and one file for each part of the ABI.

mod alarms;
mod arguments;
mod chart;
mod chart_arguments;
mod command;
mod factory;
mod instance;
mod leaks;
mod library;
mod optimizer;
mod overlay;
mod records;
mod records_arguments;
mod settings;
mod simulator;
mod simulator_arguments;
mod telemetry;
mod telemetry_samples;
mod text_buffer;

use busbar_plugin_abi as abi;

use crate::finding::{Finding, Outcome, Stop};
use crate::library::sized;
use crate::probe::{Probe, Subject};

/// Conformance case of the table.
pub(crate) struct Case {
    /// Name of the case.
    pub(crate) name: &'static str,
    /// Property that a passed case proves.
    pub(crate) what: &'static str,
    /// Cases that must have passed for it to make sense.
    pub(crate) needs: &'static [&'static str],
    /// Once for a library, or once for each of its plugins, if they can do this.
    pub(crate) scope: Scope,
    /// Function that runs the case.
    pub(crate) run: fn(&Probe) -> Outcome,
}

/// Subject of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    /// The library as a whole.
    Library,
    /// Each plugin of the library.
    Plugin,
    /// Each plugin with this capability.
    Capability(&'static str),
}

const TELEMETRY: Scope = Scope::Capability(abi::TELEMETRY_ID);
const OPTIMIZER: Scope = Scope::Capability(abi::MESH_OPTIMIZER_ID);
const OVERLAY: Scope = Scope::Capability(abi::OVERLAY_ID);
const SIMULATOR: Scope = Scope::Capability(abi::SIMULATOR_ID);
const COMMAND: Scope = Scope::Capability(abi::COMMAND_ID);
const CHART: Scope = Scope::Capability(abi::CHART_ID);
const RECORDS: Scope = Scope::Capability(abi::RECORDS_ID);
const ALARMS: Scope = Scope::Capability(abi::ALARMS_ID);

macro_rules! cases {
    ($($name:literal $scope:expr, $needs:expr, $run:path: $what:literal;)*) => {
        &[$(Case { name: $name, what: $what, needs: &$needs, scope: $scope, run: $run }),*]
    };
}

/// Every case, in the order in which they run.
#[rustfmt::skip]
pub(crate) const CASES: &[Case] = cases! {
    "load" Scope::Library, [], library::load:
        "the library loads and its entry has this ABI's version and size";
    "init" Scope::Library, ["load"], library::init:
        "init, deinit and init again succeed, without an error struct too";
    "factory" Scope::Library, ["init"], factory::factory:
        "the factory is found by its id alone, and whole";
    "descriptors" Scope::Library, ["factory"], factory::descriptors:
        "every plugin says what it is, in UTF-8, and stays with it";
    "init-order" Scope::Library, ["descriptors"], library::order:
        "deinit before init, and init twice, do no harm";
    "library-leaks" Scope::Library, ["descriptors"], leaks::check_library:
        "starting and ending the library leaves no thread, descriptor or memory";
    "schema" Scope::Plugin, ["descriptors"], settings::schema:
        "the settings schema is valid and accepts the sample settings";
    "create" Scope::Plugin, ["descriptors"], instance::create:
        "an instance is made with the sample settings and has its capabilities";
    "create-arguments" Scope::Plugin, ["create"], arguments::create:
        "null, misaligned, short and unknown arguments are refused";
    "bad-settings" Scope::Plugin, ["create", "schema"], settings::bad:
        "wrong settings are refused in words";
    "instances" Scope::Plugin, ["create"], instance::two:
        "two instances live side by side, and others after them";
    "threads" Scope::Plugin, ["create"], instance::threads:
        "calls may come from other threads, one after another";
    "left-behind" Scope::Plugin, ["create"], instance::left_behind:
        "no thread and no descriptor outlives the instance";
    "leaks" Scope::Plugin, ["create"], instance::leaks:
        "making and destroying instances costs no memory and no descriptors";
    "telemetry-arguments" TELEMETRY, ["create"], arguments::telemetry:
        "null, misaligned and malformed arguments are refused";
    "telemetry-addresses" TELEMETRY, ["create"], telemetry::addresses:
        "odd addresses are refused in words, alike by check and start";
    "telemetry-zero-tags" TELEMETRY, ["create"], telemetry::zero_tags:
        "starting without tags succeeds, and sends nothing";
    "telemetry-order" TELEMETRY, ["create"], telemetry::order:
        "stop before start, start twice and destroy while active do no harm";
    "telemetry-samples" TELEMETRY, ["create"], telemetry_samples::samples:
        "every tag gets samples, and samples are valid and not too many";
    "telemetry-stop" TELEMETRY, ["create"], telemetry_samples::stop:
        "stop ends within two seconds, nothing comes after it, and start works again";
    "optimizer-arguments" OPTIMIZER, ["create"], arguments::optimizer:
        "null, misaligned, short and contradictory arguments are refused";
    "optimizer-limits" OPTIMIZER, ["create"], optimizer::limits:
        "empty, tiny, large and degenerate meshes give valid sequences";
    "optimizer-sequence" OPTIMIZER, ["create"], optimizer::sequence:
        "sequences are valid, lossless, and the same each time and on each thread";
    "optimizer-cancel" OPTIMIZER, ["create"], optimizer::cancel:
        "a call that is asked to stop does so soon";
    "overlay-arguments" OVERLAY, ["create"], arguments::overlay:
        "null, misaligned and short arguments are refused";
    "overlay-draw" OVERLAY, ["create"], overlay::draw:
        "what is drawn names bindings, nodes and text that exist";
    "overlay-limits" OVERLAY, ["create"], overlay::limits:
        "no bindings, small buffers and many bindings are borne, in time";
    "overlay-order" OVERLAY, ["create"], overlay::order:
        "draw before configure, and configure twice, do no harm";
    "simulator-arguments" SIMULATOR, ["create"], simulator_arguments::refused:
        "null, misaligned, short and unknown arguments are refused";
    "simulator-order" SIMULATOR, ["create"], simulator::order:
        "stop before start, start twice and destroy while active do no harm";
    "simulator-stop" SIMULATOR, ["create"], simulator::ends:
        "stop ends within two seconds and frees its place, and start works again";
    "command-list" COMMAND, ["create"], command::list:
        "commands have names and help, and stay";
    "command-arguments" COMMAND, ["create"], command::arguments:
        "null, misaligned, short and unknown arguments are refused";
    "command-inputs" COMMAND, ["create"], command::inputs:
        "any input, in any pieces, comes to an end and an exit code";
    "command-stop" COMMAND, ["create"], command::stops:
        "a command that is asked to stop does so at once, and runs again";
    "chart-arguments" CHART, ["create"], chart_arguments::refused:
        "null, misaligned and short arguments are refused";
    "chart-describe" CHART, ["create"], chart::describes:
        "the description keeps its rules, and says what room it takes";
    "chart-read" CHART, ["create"], chart::reads:
        "records keep their rules, and are the same in pages of any size";
    "chart-explain" CHART, ["create"], chart::explains:
        "explanations keep their rules, and what has no record is refused in words";
    "records-arguments" RECORDS, ["create"], records_arguments::refused:
        "null, misaligned, short and unknown arguments are refused";
    "records-describe" RECORDS, ["create"], records::describes:
        "the description keeps its rules, and says what room it takes";
    "records-read" RECORDS, ["create"], records::reads:
        "rows keep their rules, and are the same in pages of any size";
    "alarms-arguments" ALARMS, ["create"], alarms::refused:
        "null, misaligned and short arguments are refused";
    "alarms-read" ALARMS, ["create"], alarms::reads:
        "alarms keep their rules, their revision grows, and they say what room they take";
};

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needs_come_before_those_who_need_them() {
        for (index, case) in CASES.iter().enumerate() {
            for need in case.needs {
                assert!(CASES[..index].iter().any(|c| c.name == *need), "{}: {need}", case.name);
            }
            assert!(CASES[..index].iter().all(|c| c.name != case.name), "{} twice", case.name);
        }
    }
}
