//! Function tables whose results are corrupted on their way to the host.

mod alarms;
mod chart;
mod command;
mod notify;
mod overlay;
mod records;

use std::ffi::c_void;
use std::time::{Duration, Instant};

use busbar_plugin_sdk::abi;

use crate::corruption::{BAD_BYTES, NOT_UTF8, active_corruption, status};
use crate::fault::{CallSite, Misbehavior, is_set};
use crate::sdk_tables::{SHORT, sdk_table};

/// Time for which samples are published after `stop`.
const AFTERWARDS: Duration = Duration::from_secs(5);

const fn telemetry(struct_size: u32) -> abi::BusbarTelemetry {
    let (check, start, stop) = (Some(check as _), Some(start as _), Some(stop as _));
    abi::BusbarTelemetry { struct_size, origin: 0, check, start, stop }
}

const fn optimizer(struct_size: u32) -> abi::BusbarMeshOptimizer {
    abi::BusbarMeshOptimizer { struct_size, flags: 0, optimize: Some(optimize as _) }
}

const fn simulator(struct_size: u32) -> abi::BusbarSimulator {
    let (start, stop) = (Some(simulate as _), Some(stop_simulation as _));
    abi::BusbarSimulator {
        struct_size,
        reserved: 0,
        start,
        stop,
        status: Some(simulation_status as _),
    }
}

/// Function tables with their true size, and with a wrong one.
static TELEMETRY: [abi::BusbarTelemetry; 2] =
    [telemetry(size_of::<abi::BusbarTelemetry>() as u32), telemetry(SHORT)];
static OPTIMIZER: [abi::BusbarMeshOptimizer; 2] =
    [optimizer(size_of::<abi::BusbarMeshOptimizer>() as u32), optimizer(SHORT)];
static SIMULATOR: [abi::BusbarSimulator; 2] =
    [simulator(size_of::<abi::BusbarSimulator>() as u32), simulator(SHORT)];

/// Returns the table of a capability that the plugin has.
pub(crate) fn table(id: abi::BusbarStr, short: bool) -> *const c_void {
    // SAFETY: the host's text is valid for the call; the SDK found it to be an id.
    let id = unsafe { std::slice::from_raw_parts(id.ptr, id.len) };
    let index = usize::from(short);
    match std::str::from_utf8(id) {
        Ok(abi::TELEMETRY_ID) => std::ptr::from_ref(&TELEMETRY[index]).cast(),
        Ok(abi::OVERLAY_ID) => std::ptr::from_ref(&overlay::TABLE[index]).cast(),
        Ok(abi::MESH_OPTIMIZER_ID) => std::ptr::from_ref(&OPTIMIZER[index]).cast(),
        Ok(abi::SIMULATOR_ID) => std::ptr::from_ref(&SIMULATOR[index]).cast(),
        Ok(abi::COMMAND_ID) => std::ptr::from_ref(&command::TABLE[index]).cast(),
        Ok(abi::CHART_ID) => std::ptr::from_ref(&chart::TABLE[index]).cast(),
        Ok(abi::RECORDS_ID) => std::ptr::from_ref(&records::TABLE[index]).cast(),
        Ok(abi::ALARMS_ID) => std::ptr::from_ref(&alarms::TABLE[index]).cast(),
        Ok(abi::NOTIFY_ID) => std::ptr::from_ref(&notify::TABLE[index]).cast(),
        _ => std::ptr::null(),
    }
}

unsafe extern "C" fn check(
    plugin: *const abi::BusbarPlugin,
    tags: *const abi::BusbarTagSpec,
    tag_count: usize,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let original = sdk_table::<abi::BusbarTelemetry>(abi::TELEMETRY_ID).and_then(|t| t.check);
    let Some(check) = original else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    unsafe { status(CallSite::Check, check(plugin, tags, tag_count, error), error) }
}

unsafe extern "C" fn start(
    plugin: *const abi::BusbarPlugin,
    tags: *const abi::BusbarTagSpec,
    tag_count: usize,
    sink: *const abi::BusbarSampleSink,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let original = sdk_table::<abi::BusbarTelemetry>(abi::TELEMETRY_ID);
    let Some((start, stop)) = original.and_then(|t| t.start.zip(t.stop)) else {
        return abi::BUSBAR_INTERNAL;
    };
    // SAFETY: handed on as it came.
    let started = unsafe { start(plugin, tags, tag_count, sink, error) };
    if started != abi::BUSBAR_OK {
        return started;
    }
    match active_corruption(CallSite::Publish) {
        Some(Misbehavior::NotUtf8) => report_invalid_link(sink),
        _ if is_set(Misbehavior::AfterStop, CallSite::Publish) => publish_afterwards(sink),
        _ => {}
    }
    // SAFETY: the host's error is null or valid.
    let corrupted = unsafe { status(CallSite::Start, started, error) };
    if corrupted != abi::BUSBAR_OK {
        // SAFETY: it was started just now; one that failed is idle.
        unsafe { stop(plugin) };
    }
    corrupted
}

unsafe extern "C" fn stop(plugin: *const abi::BusbarPlugin) {
    let original = sdk_table::<abi::BusbarTelemetry>(abi::TELEMETRY_ID).and_then(|t| t.stop);
    if let Some(stop) = original {
        // SAFETY: handed on as it came.
        unsafe { stop(plugin) };
    }
}

/// Reports a link with text that is not UTF-8.
fn report_invalid_link(sink: *const abi::BusbarSampleSink) {
    // SAFETY: the SDK just found it good; it stays so until `stop`.
    let sink = unsafe { &*sink };
    if let Some(report) = sink.report_link {
        // SAFETY: the bytes are static.
        unsafe { report(sink.context, abi::BUSBAR_LINK_STATE_UP, NOT_UTF8) };
    }
}

/// Publishes for a while, regardless of `stop`.
fn publish_afterwards(sink: *const abi::BusbarSampleSink) {
    struct Sink(abi::BusbarSampleSink);
    // SAFETY: none after `stop`; using it too late is the fault, which is the purpose.
    unsafe impl Send for Sink {}
    // SAFETY: the SDK just found it good.
    let sink = Sink(unsafe { *sink });
    std::thread::spawn(move || {
        let Sink(sink) = { sink };
        let until = Instant::now() + AFTERWARDS;
        while Instant::now() < until {
            std::thread::sleep(Duration::from_millis(5));
            if let Some(report) = sink.report_link {
                let text = abi::BusbarStr::from_static("still here");
                // SAFETY: as above.
                unsafe { report(sink.context, abi::BUSBAR_LINK_STATE_UP, text) };
            }
        }
    });
}

unsafe extern "C" fn optimize(
    plugin: *const abi::BusbarPlugin,
    mesh: *const abi::BusbarMesh,
    progress: *const abi::BusbarProgress,
    output: *mut abi::BusbarCollapseOutput,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let original = sdk_table::<abi::BusbarMeshOptimizer>(abi::MESH_OPTIMIZER_ID);
    let Some(optimize) = original.and_then(|t| t.optimize) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { optimize(plugin, mesh, progress, output, error) };
    if done != abi::BUSBAR_OK {
        return done;
    }
    // SAFETY: the SDK found it good.
    let result = unsafe { &mut *output };
    let some = result.collapse_count > 0;
    match active_corruption(CallSite::Optimize) {
        // SAFETY: there is a first collapse.
        Some(Misbehavior::NotFinite) if some => unsafe { (*result.collapses).error = f32::NAN },
        // SAFETY: as above.
        Some(Misbehavior::OutOfRange) if some => unsafe { (*result.collapses).kept = u32::MAX },
        Some(Misbehavior::Overrun) => {
            // SAFETY: none; writing beyond the end is the fault, which is the purpose.
            unsafe {
                let end = result.collapses.add(result.collapse_capacity as usize);
                end.write_bytes(0x11, 1);
            }
        }
        _ => {}
    }
    // SAFETY: the host's error is null or valid.
    unsafe { status(CallSite::Optimize, done, error) }
}

fn sdk_simulator() -> Option<&'static abi::BusbarSimulator> {
    sdk_table::<abi::BusbarSimulator>(abi::SIMULATOR_ID)
}

unsafe extern "C" fn simulate(
    plugin: *const abi::BusbarPlugin,
    tags: *const abi::BusbarSimulatedTag,
    tag_count: usize,
    simulation: *const abi::BusbarSimulation,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some((start, stop)) = sdk_simulator().and_then(|t| t.start.zip(t.stop)) else {
        return abi::BUSBAR_INTERNAL;
    };
    // SAFETY: handed on as it came.
    let started = unsafe { start(plugin, tags, tag_count, simulation, error) };
    // SAFETY: the host's error is null or valid.
    let corrupted = unsafe { status(CallSite::Simulate, started, error) };
    if started == abi::BUSBAR_OK && corrupted != abi::BUSBAR_OK {
        // SAFETY: it was started just now; one that failed is idle.
        unsafe { stop(plugin) };
    }
    corrupted
}

unsafe extern "C" fn stop_simulation(plugin: *const abi::BusbarPlugin) {
    if let Some(stop) = sdk_simulator().and_then(|t| t.stop) {
        // SAFETY: handed on as it came.
        unsafe { stop(plugin) };
    }
}

unsafe extern "C" fn simulation_status(
    plugin: *const abi::BusbarPlugin,
    into: *mut abi::BusbarSimulatorStatus,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some(original) = sdk_simulator().and_then(|t| t.status) else {
        return abi::BUSBAR_INTERNAL;
    };
    // SAFETY: handed on as it came.
    let code = unsafe { original(plugin, into, error) };
    if code == abi::BUSBAR_OK
        && active_corruption(CallSite::SimulationStatus) == Some(Misbehavior::NotUtf8)
    {
        // SAFETY: the SDK found it good.
        let into = unsafe { &mut *into };
        into.message[..BAD_BYTES.len()].copy_from_slice(&BAD_BYTES);
        into.message_len = BAD_BYTES.len() as u32;
    }
    code
}
