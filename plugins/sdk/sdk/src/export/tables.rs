//! Function tables of the capabilities: each function guarded against panics.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::PoisonError;
use std::sync::atomic::Ordering;

use busbar_plugin_abi as abi;

use super::{Capability, Instance, instance};
use crate::boundary::{checked_mut, checked_ref, guard};
use crate::overlay_description::RawDescription;
use crate::{
    Alarms, Chart, Command, Error, MeshOptimizer, Notify, Overlay, Records, SampleSink, Simulator,
    Telemetry,
};

/// Creates the table of `busbar.mesh-optimizer/1-draft` for a type.
pub const fn mesh_optimizer<P: MeshOptimizer>() -> Capability {
    unsafe extern "C" fn optimize<P: MeshOptimizer>(
        plugin: *const abi::BusbarPlugin,
        mesh: *const abi::BusbarMesh,
        progress: *const abi::BusbarProgress,
        output: *mut abi::BusbarCollapseOutput,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let plugin = instance::<P>(plugin)?.plugin.read();
                let plugin = plugin.unwrap_or_else(PoisonError::into_inner);
                crate::mesh_optimizer::run(&*plugin, mesh, progress, output)
            })
        }
    }
    Capability::new(
        abi::MESH_OPTIMIZER_ID,
        const {
            &abi::BusbarMeshOptimizer {
                struct_size: size_of::<abi::BusbarMeshOptimizer>() as u32,
                flags: if P::READS_WEDGES { 0 } else { abi::BUSBAR_OPTIMIZER_NO_WEDGES },
                optimize: Some(optimize::<P>),
            }
        },
    )
}

/// Creates the table of `busbar.telemetry/2-draft` for a type.
pub const fn telemetry<P: Telemetry>() -> Capability {
    unsafe extern "C" fn check<P: Telemetry>(
        plugin: *const abi::BusbarPlugin,
        tags: *const abi::BusbarTagSpec,
        tag_count: usize,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let tags = crate::telemetry::read_specs(tags, tag_count)?;
                let plugin = instance::<P>(plugin)?.plugin.read();
                plugin.unwrap_or_else(PoisonError::into_inner).check(&tags)
            })
        }
    }
    unsafe extern "C" fn start<P: Telemetry>(
        plugin: *const abi::BusbarPlugin,
        tags: *const abi::BusbarTagSpec,
        tag_count: usize,
        sink: *const abi::BusbarSampleSink,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        let mut opened = None;
        // SAFETY: the host passes what `create` made, and valid pointers; the
        // sink stays valid until `stop` returns, which closes it first.
        let status = unsafe {
            guard(error, || {
                let instance = instance::<P>(plugin)?;
                checked_ref(sink, "start: the sink")?;
                let tags = crate::telemetry::read_specs(tags, tag_count)?;
                let sink = SampleSink::open(sink);
                let mut open = instance.sink.lock().unwrap_or_else(PoisonError::into_inner);
                if open.is_some() {
                    return Err(Error::argument("start: already started"));
                }
                *open = Some(sink.clone());
                opened = Some(instance);
                drop(open);
                let mut plugin = instance.plugin.write().unwrap_or_else(PoisonError::into_inner);
                plugin.start(tags, sink)
            })
        };
        if let (Some(instance), true) = (opened, status != abi::BUSBAR_OK) {
            end(instance);
        }
        status
    }
    unsafe extern "C" fn stop<P: Telemetry>(plugin: *const abi::BusbarPlugin) {
        // SAFETY: the host passes what `create` made.
        unsafe {
            guard(std::ptr::null_mut(), || {
                end(instance::<P>(plugin)?);
                Ok(())
            })
        };
    }
    /// Closes the sink first, so that what a straggling thread sends goes
    /// nowhere: after a failed `start`, a panic too, the host frees it at once.
    fn end<P: Telemetry>(instance: &Instance<P>) {
        instance.close_sink();
        let _ = catch_unwind(AssertUnwindSafe(|| {
            instance.plugin.write().unwrap_or_else(PoisonError::into_inner).stop();
        }));
    }
    Capability::new(
        abi::TELEMETRY_ID,
        const {
            &abi::BusbarTelemetry {
                struct_size: size_of::<abi::BusbarTelemetry>() as u32,
                origin: P::ORIGIN.bits() as u32,
                check: Some(check::<P>),
                start: Some(start::<P>),
                stop: Some(stop::<P>),
            }
        },
    )
}

/// Creates the table of `busbar.overlay/2-draft` for a type.
pub const fn overlay<P: Overlay>() -> Capability {
    unsafe extern "C" fn configure<P: Overlay>(
        plugin: *const abi::BusbarPlugin,
        bindings: *const abi::BusbarBinding,
        binding_count: usize,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let bindings = crate::overlay::read_bindings(bindings, binding_count)?;
                let instance = instance::<P>(plugin)?;
                let plugin = instance.plugin.write();
                plugin.unwrap_or_else(PoisonError::into_inner).configure(bindings)?;
                instance.binding_count.store(binding_count, Ordering::Relaxed);
                Ok(())
            })
        }
    }
    unsafe extern "C" fn draw<P: Overlay>(
        plugin: *const abi::BusbarPlugin,
        frame: *const abi::BusbarOverlayFrame,
        output: *mut abi::BusbarOverlayOutput,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let instance = instance::<P>(plugin)?;
                let bindings = instance.binding_count.load(Ordering::Relaxed);
                let mut plugin = instance.plugin.write().unwrap_or_else(PoisonError::into_inner);
                crate::overlay::run(&mut *plugin, bindings, frame, output)
            })
        }
    }
    unsafe extern "C" fn describe<P: Overlay>(
        plugin: *const abi::BusbarPlugin,
        description: *mut abi::BusbarOverlayDescription,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        // SAFETY: the host passes what `create` made, and a description of its own.
        unsafe {
            guard(error, || {
                let instance = instance::<P>(plugin)?;
                let into = checked_mut(description, "describe: the description")?;
                let plugin = instance.plugin.read().unwrap_or_else(PoisonError::into_inner);
                let raw = RawDescription::new(plugin.describe());
                let mut kept = instance.description.lock().unwrap_or_else(PoisonError::into_inner);
                kept.insert(raw).write(into);
                Ok(())
            })
        }
    }
    Capability::new(
        abi::OVERLAY_ID,
        const {
            &abi::BusbarOverlay {
                struct_size: size_of::<abi::BusbarOverlay>() as u32,
                reserved: 0,
                configure: Some(configure::<P>),
                draw: Some(draw::<P>),
                describe: Some(describe::<P>),
            }
        },
    )
}

/// Creates the table of `busbar.simulator/1-draft` for a type.
pub const fn simulator<P: Simulator>() -> Capability {
    unsafe extern "C" fn start<P: Simulator>(
        plugin: *const abi::BusbarPlugin,
        tags: *const abi::BusbarSimulatedTag,
        tag_count: usize,
        simulation: *const abi::BusbarSimulation,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        let mut begun = None;
        // SAFETY: the host passes what `create` made, and valid pointers.
        let status = unsafe {
            guard(error, || {
                let instance = instance::<P>(plugin)?;
                let simulation = crate::simulator::read_simulation(tags, tag_count, simulation)?;
                let active = instance.is_simulating.lock();
                if std::mem::replace(&mut *active.unwrap_or_else(PoisonError::into_inner), true) {
                    return Err(Error::argument("start: already started"));
                }
                begun = Some(instance);
                let mut plugin = instance.plugin.write().unwrap_or_else(PoisonError::into_inner);
                plugin.start_simulation(simulation)
            })
        };
        if let (Some(instance), true) = (begun, status != abi::BUSBAR_OK) {
            end(instance);
        }
        status
    }
    unsafe extern "C" fn stop<P: Simulator>(plugin: *const abi::BusbarPlugin) {
        // SAFETY: the host passes what `create` made.
        unsafe {
            guard(std::ptr::null_mut(), || {
                end(instance::<P>(plugin)?);
                Ok(())
            })
        };
    }
    unsafe extern "C" fn status<P: Simulator>(
        plugin: *const abi::BusbarPlugin,
        status: *mut abi::BusbarSimulatorStatus,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        // SAFETY: the host passes what `create` made, and a status of its own.
        unsafe {
            guard(error, || {
                let instance = instance::<P>(plugin)?;
                if !*instance.is_simulating.lock().unwrap_or_else(PoisonError::into_inner) {
                    return Err(Error::argument("status: not started"));
                }
                let plugin = instance.plugin.read().unwrap_or_else(PoisonError::into_inner);
                crate::simulator::write_status(&plugin.simulation_status(), status)
            })
        }
    }
    fn end<P: Simulator>(instance: &Instance<P>) {
        let active = &instance.is_simulating;
        if !std::mem::take(&mut *active.lock().unwrap_or_else(PoisonError::into_inner)) {
            return;
        }
        let _ = catch_unwind(AssertUnwindSafe(|| {
            instance.plugin.write().unwrap_or_else(PoisonError::into_inner).stop_simulation();
        }));
    }
    Capability::new(
        abi::SIMULATOR_ID,
        const {
            &abi::BusbarSimulator {
                struct_size: size_of::<abi::BusbarSimulator>() as u32,
                reserved: 0,
                start: Some(start::<P>),
                stop: Some(stop::<P>),
                status: Some(status::<P>),
            }
        },
    )
}

/// Creates the table of `busbar.command/1-draft` for a type.
pub const fn command<P: Command>() -> Capability {
    unsafe extern "C" fn count<P: Command>(_plugin: *const abi::BusbarPlugin) -> u32 {
        P::COMMANDS.len() as u32
    }
    unsafe extern "C" fn describe<P: Command>(
        plugin: *const abi::BusbarPlugin,
        index: u32,
    ) -> *const abi::BusbarCommandInfo {
        let mut found = std::ptr::null();
        // SAFETY: the host passes what `create` made.
        unsafe {
            guard(std::ptr::null_mut(), || {
                let infos = &instance::<P>(plugin)?.commands;
                let infos = infos.get_or_init(|| crate::command::infos::<P>());
                if let Some(info) = infos.get(index as usize) {
                    found = &raw const info.0;
                }
                Ok(())
            })
        };
        found
    }
    unsafe extern "C" fn run<P: Command>(
        plugin: *const abi::BusbarPlugin,
        call: *const abi::BusbarCommandCall,
        streams: *const abi::BusbarCommandStreams,
        result: *mut abi::BusbarCommandResult,
        error: *mut abi::BusbarError,
    ) -> abi::BusbarStatusNumber {
        // SAFETY: the host passes what `create` made, and valid pointers.
        unsafe {
            guard(error, || {
                let plugin = instance::<P>(plugin)?.plugin.read();
                let plugin = plugin.unwrap_or_else(PoisonError::into_inner);
                crate::command::run(&*plugin, call, streams, result)
            })
        }
    }
    Capability::new(
        abi::COMMAND_ID,
        const {
            &abi::BusbarCommand {
                struct_size: size_of::<abi::BusbarCommand>() as u32,
                reserved: 0,
                count: Some(count::<P>),
                describe: Some(describe::<P>),
                run: Some(run::<P>),
            }
        },
    )
}

/// Creates the tables of capabilities from one line a function. Each function locks the plugin and
/// hands its arguments on to the function of the same name in the capability's module.
macro_rules! capability_tables {
    ($($(#[$doc:meta])* $module:ident: $trait:ident = $id:ident, $table:ident {
        $($function:ident($($argument:ident: $type:ty),*);)+
    })+) => {$(
        $(#[$doc])*
        pub const fn $module<P: $trait>() -> Capability {
            $(unsafe extern "C" fn $function<P: $trait>(
                plugin: *const abi::BusbarPlugin,
                $($argument: $type,)*
                error: *mut abi::BusbarError,
            ) -> abi::BusbarStatusNumber {
                // SAFETY: the host passes what `create` made, and valid pointers.
                unsafe {
                    guard(error, || {
                        let plugin = instance::<P>(plugin)?.plugin.write();
                        let mut plugin = plugin.unwrap_or_else(PoisonError::into_inner);
                        crate::$module::$function(&mut *plugin, $($argument),*)
                    })
                }
            })+
            Capability::new(
                abi::$id,
                const {
                    &abi::$table {
                        struct_size: size_of::<abi::$table>() as u32,
                        reserved: 0,
                        $($function: Some($function::<P>),)+
                    }
                },
            )
        }
    )+};
}

capability_tables! {
    /// Creates the table of `busbar.chart/1-draft` for a type.
    chart: Chart = CHART_ID, BusbarChart {
        describe(output: *mut abi::BusbarTextOutput);
        read(page: *mut abi::BusbarChartPage);
        explain(
            equipment: abi::BusbarStr,
            time_unix_nanos: i64,
            output: *mut abi::BusbarTextOutput
        );
    }
    /// Creates the table of `busbar.records/1-draft` for a type.
    records: Records = RECORDS_ID, BusbarRecords {
        describe(output: *mut abi::BusbarTextOutput);
        read(page: *mut abi::BusbarRecordPage);
    }
    /// Creates the table of `busbar.alarms/1-draft` for a type.
    alarms: Alarms = ALARMS_ID, BusbarAlarms {
        read(known_revision: u64, output: *mut abi::BusbarTextOutput);
    }
    /// Creates the table of `busbar.notify/1-draft` for a type.
    notify: Notify = NOTIFY_ID, BusbarNotify {
        notify(batch: abi::BusbarStr, output: *mut abi::BusbarTextOutput);
    }
}
