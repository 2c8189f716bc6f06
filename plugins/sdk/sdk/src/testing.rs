//! Test support for plugins: a host that records what a plugin sends.
//!
//! ```
//! use std::time::Duration;
//! use busbar_plugin_sdk::testing::Recorder;
//! use busbar_plugin_sdk::{Sample, Value};
//!
//! let recorder = Recorder::new();
//! recorder.sink().publish(&[Sample::good(7, Value::F64(220.1))]);
//! assert_eq!(recorder.latest(7), Some(Sample::good(7, Value::F64(220.1))));
//! assert!(recorder.wait_until(Duration::from_secs(1), |seen| seen.samples.len() == 1));
//! ```

mod clock;
mod command;
mod mesh;
mod message_faults;
mod overlay;
mod recorder;
mod running_plugin;
mod silence;
mod truth;

use std::ffi::c_void;

use busbar_plugin_abi as abi;

use crate::{Host, Progress, TagSpec, ValueKind};

pub use clock::TestClock;
pub use command::{CommandRun, run_command};
pub use mesh::{Grid, check_sequence};
pub use message_faults::{FaultGenerator, MessageFault, matrix_steps};
pub use overlay::{Drawing, DrawnLine, DrawnQuantity, DrawnState, DrawnVerdict, draw, draw_at};
pub use recorder::{MAX_RECORDED, Recorder, Recording};
pub use running_plugin::RunningPlugin;
pub use silence::{
    AdmittedVerdicts, InputFault, InputGenerator, SILENCE_CASES_VARIABLE, check_verdicts,
    silence_cases,
};
pub use truth::{ShownTag, TruthCounts, TruthMoment, TruthOracle};

/// Creates a host without a log.
pub fn host() -> Host {
    Host::closed()
}

/// Creates a tag with a freshness limit of five seconds and `id` as its name.
pub fn tag_spec(tag: u32, id: &str, kind: ValueKind, address: serde_json::Value) -> TagSpec {
    let (id, freshness) = (id.to_owned(), std::time::Duration::from_secs(5));
    TagSpec { tag, kind, freshness, id, address, unit: String::new() }
}

/// Runs work with a progress that asks to stop after so many reports.
pub fn stopping_after<T>(reports: u32, work: impl FnOnce(&mut Progress<'_>) -> T) -> T {
    unsafe extern "C" fn count_down(context: *mut c_void, _fraction: f32) -> u32 {
        // SAFETY: the context is `left` below, which outlives the work, on the
        // thread of the work.
        let left = unsafe { &mut *context.cast::<u32>() };
        *left = left.saturating_sub(1);
        u32::from(*left > 0)
    }
    let mut left = reports;
    let raw = abi::BusbarProgress {
        struct_size: size_of::<abi::BusbarProgress>() as u32,
        reserved: 0,
        context: (&raw mut left).cast(),
        report: Some(count_down),
    };
    work(&mut Progress::from_raw(&raw))
}
