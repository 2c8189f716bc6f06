//! Which fault strikes where, and when.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{LazyLock, PoisonError, RwLock};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::fuse;

/// The environment variable with a fault that holds before settings come.
pub const FAULT_VARIABLE: &str = "BUSBAR_FAULT";

macro_rules! named {
    ($(#[$of:meta])* $type:ident { $($(#[$doc:meta])* $name:ident,)* }) => {
        $(#[$of])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum $type { $($(#[$doc])* $name,)* }

        impl $type {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$name),*];
        }
    };
}

named! {
    /// A way to misbehave.
    Kind {
        /// Panics.
        Panic,
        /// Indexes beyond the end of a slice.
        IndexOutOfBounds,
        /// Panics while dropping a value.
        PanicInDrop,
        /// Writes to a bad address.
        Segfault,
        /// Recurses without end.
        StackOverflow,
        /// Calls `abort`.
        Abort,
        /// Calls `exit`, with 0.
        Exit,
        /// Asks for memory that cannot be had.
        AllocationFailure,
        /// Never returns, at full speed.
        EndlessLoop,
        /// Takes a lock twice.
        Deadlock,
        /// Frees memory twice.
        DoubleFree,
        /// Closes descriptors that are not its own.
        CloseDescriptors,
        /// Forgets 64 KiB each time.
        LeakMemory,
        /// Forgets a descriptor each time.
        LeakDescriptor,
        /// Leaves a thread behind each time.
        LeakThread,
        /// Gives a struct that says it is shorter than it is.
        LieAboutSize,
        /// Gives text that is not UTF-8.
        NotUtf8,
        /// Gives numbers that are not finite.
        NotFinite,
        /// Gives counts, indices and handles that do not exist.
        OutOfRange,
        /// Gives nothing, and no reason.
        NullResult,
        /// Writes beyond the end of the host's buffers.
        Overrun,
        /// Publishes as fast as it can.
        Flood,
        /// Publishes after `stop`.
        AfterStop,
        /// Gives no verdict on equipment that it describes.
        MissingVerdict,
        /// Gives a verdict on equipment that it does not describe.
        VerdictOutOfRange,
        /// Gives an unknown verdict without a reason.
        UnknownWithoutReason,
    }
}

named! {
    /// A function of the ABI, and the plugin's own thread.
    At {
        /// `BusbarPluginEntry.init`.
        Init,
        /// `BusbarPluginEntry.deinit`.
        Deinit,
        /// `BusbarPluginEntry.get_factory`.
        GetFactory,
        /// `BusbarPluginFactory.count`.
        Count,
        /// `BusbarPluginFactory.descriptor`.
        Descriptor,
        /// `BusbarPluginFactory.create`.
        Create,
        /// `BusbarPlugin.get_capability`.
        GetCapability,
        /// `BusbarPlugin.destroy`.
        Destroy,
        /// `BusbarTelemetry.check`.
        Check,
        /// `BusbarTelemetry.start`.
        Start,
        /// Each batch that its thread publishes.
        Publish,
        /// `BusbarTelemetry.stop`.
        Stop,
        /// `BusbarOverlay.configure`.
        Configure,
        /// `BusbarOverlay.draw`.
        Draw,
        /// `BusbarMeshOptimizer.optimize`.
        Optimize,
        /// `BusbarSimulator.start`.
        Simulate,
        /// `BusbarSimulator.status`.
        SimulationStatus,
        /// `BusbarSimulator.stop`.
        StopSimulation,
        /// `BusbarCommand.run`.
        RunCommand,
        /// `BusbarChart.describe`.
        DescribeChart,
        /// `BusbarChart.read`.
        ReadChart,
        /// `BusbarChart.explain`.
        Explain,
        /// `BusbarRecords.describe`.
        DescribeRecords,
        /// `BusbarRecords.read`.
        ReadRecords,
        /// `BusbarAlarms.read`.
        ReadAlarms,
    }
}

impl Kind {
    /// Whether this can happen there: what spoils a result needs a result to spoil.
    pub fn reaches(self, at: At) -> bool {
        use At::*;
        match self {
            Self::LieAboutSize => matches!(at, GetFactory | Descriptor | Create | GetCapability),
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
            ),
            Self::Flood => matches!(at, Publish | ReadAlarms),
            Self::AfterStop => at == Publish,
            Self::MissingVerdict | Self::VerdictOutOfRange | Self::UnknownWithoutReason => {
                at == Draw
            }
            _ => true,
        }
    }
}

impl At {
    /// Whether frames wait for it; simulators and commands have no part in a view, and
    /// charts and records are read beside its frames.
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
        )
    }

    /// Whether settings have come by then.
    pub fn knows_settings(self) -> bool {
        !matches!(
            self,
            Self::Init | Self::Deinit | Self::GetFactory | Self::Count | Self::Descriptor
        )
    }
}

/// A fault to come.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What happens.
    pub kind: Kind,
    /// Where.
    pub at: At,
    /// Calls there that go well before; every later one goes wrong.
    #[serde(default)]
    pub after_calls: u64,
}

static FROM_ENVIRONMENT: LazyLock<Option<Fault>> = LazyLock::new(|| {
    let text = std::env::var(FAULT_VARIABLE).ok()?;
    serde_json::from_str(&text).ok()
});
static FROM_SETTINGS: RwLock<Option<Fault>> = RwLock::new(None);
static CALLS: [AtomicU64; At::ALL.len()] = [const { AtomicU64::new(0) }; At::ALL.len()];

/// Sets the fault that settings ask for.
pub(crate) fn set(fault: Option<Fault>) {
    *FROM_SETTINGS.write().unwrap_or_else(PoisonError::into_inner) = fault;
}

/// Counts a call; the kind that strikes it, if any.
pub(crate) fn due(at: At) -> Option<Kind> {
    let before = CALLS[at as usize].fetch_add(1, Ordering::Relaxed);
    pending(at).filter(|fault| before >= fault.after_calls).map(|fault| fault.kind)
}

/// Whether calls there shall have this kind of fault, now or later.
pub(crate) fn is_set(kind: Kind, at: At) -> bool {
    pending(at).is_some_and(|fault| fault.kind == kind)
}

fn pending(at: At) -> Option<Fault> {
    let from_settings = *FROM_SETTINGS.read().unwrap_or_else(PoisonError::into_inner);
    let set = from_settings.or(*FROM_ENVIRONMENT).filter(|fault| fault.at == at);
    set.or_else(|| fuse::fault_at(at))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_strikes_somewhere_and_everywhere_is_struck() {
        assert!(Kind::ALL.len() >= 15);
        for kind in Kind::ALL {
            assert!(At::ALL.iter().any(|&at| kind.reaches(at)), "{kind:?}");
        }
        for &at in At::ALL {
            let kinds = Kind::ALL.iter().filter(|kind| kind.reaches(at)).count();
            assert!(kinds >= 15, "{at:?}: {kinds} kinds");
        }
    }

    #[test]
    fn calls_go_well_before_the_fault() {
        set(Some(Fault { kind: Kind::Panic, at: At::Draw, after_calls: 2 }));
        let due: Vec<_> = (0..4).map(|_| due(At::Draw)).collect();
        assert_eq!(due, [None, None, Some(Kind::Panic), Some(Kind::Panic)]);
        assert_eq!(super::due(At::Stop), None);
        set(None);
    }
}
