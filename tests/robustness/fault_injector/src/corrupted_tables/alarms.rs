//! Function table of alarms, with corrupted results.

use busbar_plugin_sdk::abi;

use crate::corruption::text;
use crate::fault::CallSite;
use crate::sdk_tables::{SHORT, sdk_table};

/// Function tables with their true size, and with a wrong one.
pub(super) static TABLE: [abi::BusbarAlarms; 2] =
    [alarms(size_of::<abi::BusbarAlarms>() as u32), alarms(SHORT)];

const fn alarms(struct_size: u32) -> abi::BusbarAlarms {
    abi::BusbarAlarms { struct_size, reserved: 0, read: Some(read as _) }
}

unsafe extern "C" fn read(
    plugin: *const abi::BusbarPlugin,
    known_revision: u64,
    output: *mut abi::BusbarTextOutput,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let original = sdk_table::<abi::BusbarAlarms>(abi::ALARMS_ID).and_then(|table| table.read);
    let Some(read) = original else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { read(plugin, known_revision, output, error) };
    if done == abi::BUSBAR_OK {
        // SAFETY: the SDK found it good and wrote it.
        unsafe { text(CallSite::ReadAlarms, output) };
    }
    done
}
