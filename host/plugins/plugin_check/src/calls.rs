//! Calls into a plugin, each noted in the journal before it is made.
//!
//! They are not marked as what they are, dangerous: cases pass null, misaligned and
//! wrong pointers on purpose. That is sound where it matters, outside: whatever a
//! plugin does with them happens to a process that was made to be lost.

use std::ffi::c_void;

use busbar_plugin_abi as abi;

use crate::journal::Entry;
use crate::probe::Probe;

type Status = abi::BusbarStatus;
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
type Check = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarTagSpec,
    usize,
    *mut abi::BusbarError,
) -> Status;
type Optimize = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarMesh,
    *const abi::BusbarProgress,
    *mut abi::BusbarCollapseOutput,
    *mut abi::BusbarError,
) -> Status;
type Configure = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarBinding,
    usize,
    *mut abi::BusbarError,
) -> Status;
type Draw = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarOverlayFrame,
    *mut abi::BusbarOverlayOutput,
    *mut abi::BusbarError,
) -> Status;

type Simulate = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarSimulatedTag,
    usize,
    *const abi::BusbarSimulation,
    *mut abi::BusbarError,
) -> Status;
type SimulatorStatus = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *mut abi::BusbarSimulatorStatus,
    *mut abi::BusbarError,
) -> Status;

type RunCommand = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *const abi::BusbarCommandCall,
    *const abi::BusbarCommandStreams,
    *mut abi::BusbarCommandResult,
    *mut abi::BusbarError,
) -> Status;

type DescribeInText = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *mut abi::BusbarTextOutput,
    *mut abi::BusbarError,
) -> Status;
type ReadChart = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *mut abi::BusbarChartPage,
    *mut abi::BusbarError,
) -> Status;
type Explain = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    abi::BusbarStr,
    i64,
    *mut abi::BusbarTextOutput,
    *mut abi::BusbarError,
) -> Status;
type ReadAlarms = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    u64,
    *mut abi::BusbarTextOutput,
    *mut abi::BusbarError,
) -> Status;
type ReadRecords = unsafe extern "C" fn(
    *const abi::BusbarPlugin,
    *mut abi::BusbarRecordPage,
    *mut abi::BusbarError,
) -> Status;

/// Notes the name in the journal and makes the call.
macro_rules! call {
    ($probe:expr, $name:literal, $function:ident($($argument:expr),*)) => {{
        $probe.journal.note(Entry::Calling($name.into()));
        // SAFETY: see the module; the process of a case may be lost.
        let result = unsafe { $function($($argument),*) };
        $probe.journal.note(Entry::Calling(concat!("nothing, after `", $name, "` returned").into()));
        result
    }};
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

    pub(crate) fn check(
        &self,
        check: Check,
        plugin: *const abi::BusbarPlugin,
        tags: *const abi::BusbarTagSpec,
        count: usize,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "check", check(plugin, tags, count, error))
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

    pub(crate) fn simulation_status(
        &self,
        status: SimulatorStatus,
        plugin: *const abi::BusbarPlugin,
        into: *mut abi::BusbarSimulatorStatus,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "simulation_status", status(plugin, into, error))
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

    pub(crate) fn describe_chart(
        &self,
        describe: DescribeInText,
        plugin: *const abi::BusbarPlugin,
        output: *mut abi::BusbarTextOutput,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "describe_chart", describe(plugin, output, error))
    }

    pub(crate) fn read_chart(
        &self,
        read: ReadChart,
        plugin: *const abi::BusbarPlugin,
        page: *mut abi::BusbarChartPage,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "read_chart", read(plugin, page, error))
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

    pub(crate) fn describe_records(
        &self,
        describe: DescribeInText,
        plugin: *const abi::BusbarPlugin,
        output: *mut abi::BusbarTextOutput,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "describe_records", describe(plugin, output, error))
    }

    pub(crate) fn read_records(
        &self,
        read: ReadRecords,
        plugin: *const abi::BusbarPlugin,
        page: *mut abi::BusbarRecordPage,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "read_records", read(plugin, page, error))
    }

    pub(crate) fn read_alarms(
        &self,
        read: ReadAlarms,
        plugin: *const abi::BusbarPlugin,
        known: u64,
        output: *mut abi::BusbarTextOutput,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "read_alarms", read(plugin, known, output, error))
    }

    pub(crate) fn optimize(
        &self,
        optimize: Optimize,
        plugin: *const abi::BusbarPlugin,
        mesh: *const abi::BusbarMesh,
        progress: *const abi::BusbarProgress,
        output: *mut abi::BusbarCollapseOutput,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "optimize", optimize(plugin, mesh, progress, output, error))
    }

    pub(crate) fn configure(
        &self,
        configure: Configure,
        plugin: *const abi::BusbarPlugin,
        bindings: *const abi::BusbarBinding,
        count: usize,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "configure", configure(plugin, bindings, count, error))
    }

    pub(crate) fn draw(
        &self,
        draw: Draw,
        plugin: *const abi::BusbarPlugin,
        frame: *const abi::BusbarOverlayFrame,
        output: *mut abi::BusbarOverlayOutput,
        error: *mut abi::BusbarError,
    ) -> Status {
        call!(self, "draw", draw(plugin, frame, output, error))
    }
}
