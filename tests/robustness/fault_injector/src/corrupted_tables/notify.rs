//! Function table of notifications, with corrupted results.

use busbar_plugin_sdk::abi;

use crate::corruption::text;
use crate::fault::CallSite;
use crate::sdk_tables::{SHORT, sdk_table};

/// Function tables with their true size, and with a wrong one.
pub(super) static TABLE: [abi::BusbarNotify; 2] =
    [notifications(size_of::<abi::BusbarNotify>() as u32), notifications(SHORT)];

const fn notifications(struct_size: u32) -> abi::BusbarNotify {
    abi::BusbarNotify { struct_size, reserved: 0, notify: Some(notify as _) }
}

unsafe extern "C" fn notify(
    plugin: *const abi::BusbarPlugin,
    batch: abi::BusbarStr,
    output: *mut abi::BusbarTextOutput,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let original = sdk_table::<abi::BusbarNotify>(abi::NOTIFY_ID).and_then(|table| table.notify);
    let Some(notify) = original else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { notify(plugin, batch, output, error) };
    if done == abi::BUSBAR_OK {
        // SAFETY: the SDK found it good and wrote it.
        unsafe { text(CallSite::Notify, output) };
    }
    done
}
