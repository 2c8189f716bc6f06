//! Kinds of faults, the calls that they hit, and their schedule.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{LazyLock, PoisonError, RwLock};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::armed_fault;

/// Environment variable with a fault that is active before settings arrive.
pub const FAULT_VARIABLE: &str = "BUSBAR_FAULT";

macro_rules! named {
    ($(#[$of:meta])* $type:ident { $($(#[$doc:meta])* $name:ident,)* }) => {
        $(#[$of])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum $type { $($(#[$doc])* $name,)* }

        impl $type {
            /// All values of the type.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];
        }
    };
}

named! {
    /// Misbehaviour of a plugin in a call.
    Misbehavior {
        /// Panics in the call.
        Panic,
        /// Indexes beyond the end of a slice.
        IndexOutOfBounds,
        /// Panics while dropping a value.
        PanicInDrop,
        /// Writes to an invalid address.
        Segfault,
        /// Recurses until the stack overflows.
        StackOverflow,
        /// Calls the C function `abort`.
        Abort,
        /// Calls the C function `exit`, with 0.
        Exit,
        /// Requests more memory than there is.
        AllocationFailure,
        /// Never returns, at full speed.
        EndlessLoop,
        /// Takes a non-recursive lock twice.
        Deadlock,
        /// Frees a memory block twice.
        DoubleFree,
        /// Closes descriptors that are not its own.
        CloseDescriptors,
        /// Leaks 64 KiB in each call.
        LeakMemory,
        /// Leaks a descriptor in each call.
        LeakDescriptor,
        /// Leaks a thread in each call.
        LeakThread,
        /// Returns a struct whose size field is smaller than its size.
        WrongStructSize,
        /// Returns text that is not UTF-8.
        NotUtf8,
        /// Returns numbers that are not finite.
        NotFinite,
        /// Returns counts, indices and handles that do not exist.
        OutOfRange,
        /// Returns nothing, and no reason.
        NullResult,
        /// Writes beyond the end of the host's buffers.
        Overrun,
        /// Publishes as fast as it can.
        Flood,
        /// Publishes samples after `stop`.
        AfterStop,
        /// Omits the verdict on equipment that it describes.
        MissingVerdict,
        /// Returns a verdict on equipment that it does not describe.
        VerdictOutOfRange,
        /// Returns an unknown verdict without a reason.
        UnknownWithoutReason,
        /// Returns a normal verdict with the severity of an abnormal one.
        SeverityOfNormal,
    }
}

named! {
    /// Call site of a fault: a function of the ABI, or the plugin's own thread.
    CallSite {
        /// Function `BusbarPluginEntry.init` of the ABI.
        Init,
        /// Function `BusbarPluginEntry.deinit` of the ABI.
        Deinit,
        /// Function `BusbarPluginEntry.get_factory` of the ABI.
        GetFactory,
        /// Function `BusbarPluginFactory.count` of the ABI.
        Count,
        /// Function `BusbarPluginFactory.descriptor` of the ABI.
        Descriptor,
        /// Function `BusbarPluginFactory.create` of the ABI.
        Create,
        /// Function `BusbarPlugin.get_capability` of the ABI.
        GetCapability,
        /// Function `BusbarPlugin.destroy` of the ABI.
        Destroy,
        /// Function `BusbarTelemetry.check` of the ABI.
        Check,
        /// Function `BusbarTelemetry.start` of the ABI.
        Start,
        /// Each batch that the plugin's thread publishes.
        Publish,
        /// Function `BusbarTelemetry.stop` of the ABI.
        Stop,
        /// Function `BusbarOverlay.configure` of the ABI.
        Configure,
        /// Function `BusbarOverlay.draw` of the ABI.
        Draw,
        /// Function `BusbarMeshOptimizer.optimize` of the ABI.
        Optimize,
        /// Function `BusbarSimulator.start` of the ABI.
        Simulate,
        /// Function `BusbarSimulator.status` of the ABI.
        SimulationStatus,
        /// Function `BusbarSimulator.stop` of the ABI.
        StopSimulation,
        /// Function `BusbarCommand.run` of the ABI.
        RunCommand,
        /// Function `BusbarChart.describe` of the ABI.
        DescribeChart,
        /// Function `BusbarChart.read` of the ABI.
        ReadChart,
        /// Function `BusbarChart.explain` of the ABI.
        Explain,
        /// Function `BusbarRecords.describe` of the ABI.
        DescribeRecords,
        /// Function `BusbarRecords.read` of the ABI.
        ReadRecords,
        /// Function `BusbarAlarms.read` of the ABI.
        ReadAlarms,
        /// Function `BusbarNotify.notify` of the ABI.
        Notify,
    }
}

impl Misbehavior {
    /// Reports whether the fault can occur at a call site: corrupting a result needs a result.
    pub fn reaches(self, at: CallSite) -> bool {
        use CallSite::*;
        match self {
            Self::WrongStructSize => matches!(at, GetFactory | Descriptor | Create | GetCapability),
            Self::NotUtf8 => matches!(
                at,
                Descriptor
                    | Create
                    | Check
                    | Start
                    | Publish
                    | Configure
                    | Draw
                    | Optimize
                    | Simulate
                    | SimulationStatus
                    | RunCommand
                    | DescribeChart
                    | ReadChart
                    | Explain
                    | DescribeRecords
                    | ReadRecords
                    | ReadAlarms
                    | Notify
            ),
            Self::NotFinite => matches!(at, Publish | Optimize | ReadChart),
            Self::OutOfRange => {
                matches!(
                    at,
                    Count
                        | Descriptor
                        | Publish
                        | Draw
                        | Optimize
                        | RunCommand
                        | ReadChart
                        | ReadRecords
                        | ReadAlarms
                        | Notify
                )
            }
            Self::NullResult => matches!(at, GetFactory | Descriptor | Create | GetCapability),
            Self::Overrun => matches!(
                at,
                Draw | Optimize
                    | DescribeChart
                    | ReadChart
                    | Explain
                    | DescribeRecords
                    | ReadRecords
                    | ReadAlarms
                    | Notify
            ),
            Self::Flood => matches!(at, Publish | ReadAlarms),
            Self::AfterStop => at == Publish,
            Self::MissingVerdict
            | Self::VerdictOutOfRange
            | Self::UnknownWithoutReason
            | Self::SeverityOfNormal => at == Draw,
            _ => true,
        }
    }
}

impl CallSite {
    /// Reports whether frames wait for the call. Simulators and commands have no part in a view,
    /// and charts and records are read beside its frames.
    pub fn is_in_view(self) -> bool {
        !matches!(
            self,
            Self::Simulate
                | Self::SimulationStatus
                | Self::StopSimulation
                | Self::RunCommand
                | Self::DescribeChart
                | Self::ReadChart
                | Self::Explain
                | Self::DescribeRecords
                | Self::ReadRecords
                | Self::ReadAlarms
                | Self::Notify
        )
    }

    /// Reports whether settings have arrived by the call.
    pub fn knows_settings(self) -> bool {
        !matches!(
            self,
            Self::Init | Self::Deinit | Self::GetFactory | Self::Count | Self::Descriptor
        )
    }
}

/// Fault that is to occur.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// Misbehaviour in the call.
    pub kind: Misbehavior,
    /// Call site of the fault.
    pub at: CallSite,
    /// Number of calls there that succeed before; every later one fails.
    #[serde(default)]
    pub after_calls: u64,
}

static FROM_ENVIRONMENT: LazyLock<Option<Fault>> = LazyLock::new(|| {
    let text = std::env::var(FAULT_VARIABLE).ok()?;
    serde_json::from_str(&text).ok()
});
static FROM_SETTINGS: RwLock<Option<Fault>> = RwLock::new(None);
static CALLS: [AtomicU64; CallSite::ALL.len()] = [const { AtomicU64::new(0) }; CallSite::ALL.len()];

/// Sets the fault of the settings.
pub(crate) fn set(fault: Option<Fault>) {
    *FROM_SETTINGS.write().unwrap_or_else(PoisonError::into_inner) = fault;
}

/// Counts a call; returns the kind of fault that hits it, if any.
pub(crate) fn due(at: CallSite) -> Option<Misbehavior> {
    let before = CALLS[at as usize].fetch_add(1, Ordering::Relaxed);
    pending(at).filter(|fault| before >= fault.after_calls).map(|fault| fault.kind)
}

/// Reports whether a call site has this kind of fault, now or later.
pub(crate) fn is_set(kind: Misbehavior, at: CallSite) -> bool {
    pending(at).is_some_and(|fault| fault.kind == kind)
}

fn pending(at: CallSite) -> Option<Fault> {
    let from_settings = *FROM_SETTINGS.read().unwrap_or_else(PoisonError::into_inner);
    let set = from_settings.or(*FROM_ENVIRONMENT).filter(|fault| fault.at == at);
    set.or_else(|| armed_fault::fault_at(at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_misbehavior_has_a_call_site_and_the_reverse() {
        assert!(Misbehavior::ALL.len() >= 15);
        for kind in Misbehavior::ALL {
            assert!(CallSite::ALL.iter().any(|&at| kind.reaches(at)), "{kind:?}");
        }
        for &at in CallSite::ALL {
            let kinds = Misbehavior::ALL.iter().filter(|kind| kind.reaches(at)).count();
            assert!(kinds >= 15, "{at:?}: {kinds} kinds");
        }
    }

    #[test]
    fn calls_go_well_before_the_fault() {
        set(Some(Fault { kind: Misbehavior::Panic, at: CallSite::Draw, after_calls: 2 }));
        let due: Vec<_> = (0..4).map(|_| due(CallSite::Draw)).collect();
        assert_eq!(due, [None, None, Some(Misbehavior::Panic), Some(Misbehavior::Panic)]);
        assert_eq!(super::due(CallSite::Stop), None);
        set(None);
    }
}
