//! Calls into a plugin, each noted in the journal before it is made.
//!
//! They are not marked as what they are, dangerous: cases pass null, misaligned and
//! wrong pointers on purpose. That is sound where it matters, outside: whatever a
//! plugin does with them happens to a process that was made to be lost.

use std::ffi::c_void;

use busbar_plugin_abi as abi;

use crate::journal::Entry;
use crate::probe::Probe;

type Status = abi::BusbarStatusNumber;
type Create = unsafe extern "C" fn(
    abi::BusbarStr,
    abi::BusbarStr,
    *const abi::BusbarHost,
    *mut abi::BusbarError,
) -> *mut abi::BusbarPlugin;
type Start = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarTagSpec,
    usize,
    *const abi::BusbarSampleSink,
    *mut abi::BusbarError,
) -> Status;

type Simulate = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarSimulatedTag,
    usize,
    *const abi::BusbarSimulation,
    *mut abi::BusbarError,
) -> Status;

type RunCommand = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarCommandCall,
    *const abi::BusbarCommandStreams,
    *mut abi::BusbarCommandResult,
    *mut abi::BusbarError,
) -> Status;

type Explain = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    abi::BusbarStr,
    i64,
    *mut abi::BusbarTextOutput,
    *mut abi::BusbarError,
) -> Status;

/// Notes the name in the journal and makes the call.
macro_rules! call {
    ($probe:expr, $name:literal, $function:ident($($argument:expr),* $(,)?)) => {{
        $probe.journal.note(Entry::Calling($name.into()));
        // SAFETY: see the module; the process of a case may be lost.
        let result = unsafe { $function($($argument),*) };
        $probe.journal.note(Entry::Calling(concat!("nothing, after `", $name, "` returned").into()));
        result
    }};
}

/// Defines functions of capability tables that take a plugin, some arguments and an error: the type
/// of each, and the method that notes it in the journal and calls it.
macro_rules! plugin_calls {
    ($($name:literal $method:ident: $function:ident($($argument:ident: $type:ty),*);)+) => {
        $(type $function = unsafe extern "C" fn(
            *const abi::BusbarPlugin,
            $($type,)*
            *mut abi::BusbarError,
        ) -> Status;)+

        impl Probe {
            $(pub(crate) fn $method(
                &self,
                function: $function,
                plugin: *const abi::BusbarPlugin,
                $($argument: $type,)*
                error: *mut abi::BusbarError,
            ) -> Status {
                call!(self, $name, function(plugin, $($argument,)* error))
            })+
        }
    };
}

plugin_calls! {
    "check" check: Check(tags: *const abi::BusbarTagSpec, count: usize);
    "optimize" optimize: Optimize(
        mesh: *const abi::BusbarMesh,
        progress: *const abi::BusbarProgress,
        output: *mut abi::BusbarCollapseOutput
    );
    "configure" configure: Configure(bindings: *const abi::BusbarBinding, count: usize);
    "draw" draw: Draw(frame: *const abi::BusbarOverlayFrame, output: *mut abi::BusbarOverlayOutput);
    "simulation_status" simulation_status: SimulatorStatus(into: *mut abi::BusbarSimulatorStatus);
    "describe_chart" describe_chart: DescribeChart(output: *mut abi::BusbarTextOutput);
    "read_chart" read_chart: ReadChart(page: *mut abi::BusbarChartPage);
    "describe_records" describe_records: DescribeRecords(output: *mut abi::BusbarTextOutput);
    "read_records" read_records: ReadRecords(page: *mut abi::BusbarRecordPage);
    "read_alarms" read_alarms: ReadAlarms(known: u64, output: *mut abi::BusbarTextOutput);
    "notify" notify: Notify(batch: abi::BusbarStr, output: *mut abi::BusbarTextOutput);
}

impl Probe {
    pub(crate) fn init(
        &self,
        init: unsafe extern "C" fn(*mut abi::BusbarError) -> Status,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "init", init(error))
    }

    pub(crate) fn deinit(&self, deinit: unsafe extern "C" fn()) {
        call!(self, "deinit", deinit());
    }

    pub(crate) fn get_factory(
        &self,
        get_factory: unsafe extern "C" fn(abi::BusbarStr) -> *const c_void,
        id: abi::BusbarStr,
    ) -> *const c_void {
        call!(self, "get_factory", get_factory(id))
    }

    pub(crate) fn count(&self, count: unsafe extern "C" fn() -> u32) -> u32 {
        call!(self, "count", count())
    }

    pub(crate) fn descriptor(
        &self,
        descriptor: unsafe extern "C" fn(u32) -> *const abi::BusbarPluginDescriptor,
        index: u32,
    ) -> *const abi::BusbarPluginDescriptor {
        call!(self, "descriptor", descriptor(index))
    }

    pub(crate) fn create(
        &self,
        create: Create,
        id: abi::BusbarStr,
        settings: abi::BusbarStr,
        host: *const abi::BusbarHost,
        error: *mut abi::BusbarError,
    ) -> *mut abi::BusbarPlugin {
        call!(self, "create", create(id, settings, host, error))
    }

    pub(crate) fn destroy(
        &self,
        destroy: unsafe extern "C" fn(*mut abi::BusbarPlugin),
        plugin: *mut abi::BusbarPlugin,
    ) {
        call!(self, "destroy", destroy(plugin));
    }

    pub(crate) fn get_capability(
        &self,
        get: unsafe extern "C" fn(*const abi::BusbarPlugin, abi::BusbarStr) -> *const c_void,
        plugin: *const abi::BusbarPlugin,
        id: abi::BusbarStr,
    ) -> *const c_void {
        call!(self, "get_capability", get(plugin, id))
    }

    pub(crate) fn start(
        &self,
        start: Start,
        plugin: *const abi::BusbarPlugin,
        tags: (*const abi::BusbarTagSpec, usize),
        sink: *const abi::BusbarSampleSink,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "start", start(plugin, tags.0, tags.1, sink, error))
    }

    pub(crate) fn stop(
        &self,
        stop: unsafe extern "C" fn(*const abi::BusbarPlugin),
        plugin: *const abi::BusbarPlugin,
    ) {
        call!(self, "stop", stop(plugin));
    }

    pub(crate) fn simulate(
        &self,
        simulate: Simulate,
        plugin: *const abi::BusbarPlugin,
        tags: (*const abi::BusbarSimulatedTag, usize),
        simulation: *const abi::BusbarSimulation,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "simulate", simulate(plugin, tags.0, tags.1, simulation, error))
    }

    pub(crate) fn stop_simulation(
        &self,
        stop: unsafe extern "C" fn(*const abi::BusbarPlugin),
        plugin: *const abi::BusbarPlugin,
    ) {
        call!(self, "stop_simulation", stop(plugin));
    }

    pub(crate) fn count_commands(
        &self,
        count: unsafe extern "C" fn(*const abi::BusbarPlugin) -> u32,
        plugin: *const abi::BusbarPlugin,
    ) -> u32 {
        call!(self, "count_commands", count(plugin))
    }

    pub(crate) fn describe_command(
        &self,
        describe: unsafe extern "C" fn(
            *const abi::BusbarPlugin,
            u32,
        ) -> *const abi::BusbarCommandInfo,
        plugin: *const abi::BusbarPlugin,
        index: u32,
    ) -> *const abi::BusbarCommandInfo {
        call!(self, "describe_command", describe(plugin, index))
    }

    pub(crate) fn run_command(
        &self,
        run: RunCommand,
        plugin: *const abi::BusbarPlugin,
        call: *const abi::BusbarCommandCall,
        streams: *const abi::BusbarCommandStreams,
        result: *mut abi::BusbarCommandResult,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "run_command", run(plugin, call, streams, result, error))
    }

    pub(crate) fn explain(
        &self,
        explain: Explain,
        plugin: *const abi::BusbarPlugin,
        (equipment, time): (abi::BusbarStr, i64),
        output: *mut abi::BusbarTextOutput,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "explain", explain(plugin, equipment, time, output, error))
    }
}
