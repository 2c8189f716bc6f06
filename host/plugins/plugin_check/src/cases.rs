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
mod notify;
mod optimizer;
mod overlay;
mod plugin_instance;
mod records;
mod records_arguments;
mod settings;
mod simulator;
mod simulator_arguments;
mod telemetry;
mod telemetry_samples;
mod text_buffer;

use busbar_plugin_abi as abi;

use crate::finding::Outcome;
use crate::probe::Probe;

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
const NOTIFY: Scope = Scope::Capability(abi::NOTIFY_ID);

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
    "notify-arguments" NOTIFY, ["create"], notify::refused:
        "null, misaligned, short and malformed arguments are refused";
    "notify-takes" NOTIFY, ["create"], notify::takes:
        "what is handed over is taken, reports keep their rules, and they say what room they take";
};

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
