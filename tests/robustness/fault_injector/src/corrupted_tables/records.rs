//! Function table of records, with corrupted results.

use busbar_plugin_sdk::abi;

use crate::corruption::{active_corruption, text};
use crate::fault::{CallSite, Misbehavior};
use crate::injection::inject;
use crate::sdk_tables::{SHORT, sdk_table};

/// Function tables with their true size, and with a wrong one.
pub(super) static TABLE: [abi::BusbarRecords; 2] =
    [records(size_of::<abi::BusbarRecords>() as u32), records(SHORT)];

const fn records(struct_size: u32) -> abi::BusbarRecords {
    let (describe, read) = (Some(describe as _), Some(read as _));
    abi::BusbarRecords { struct_size, reserved: 0, describe, read }
}

fn original() -> Option<&'static abi::BusbarRecords> {
    sdk_table::<abi::BusbarRecords>(abi::RECORDS_ID)
}

unsafe extern "C" fn describe(
    plugin: *const abi::BusbarPlugin,
    output: *mut abi::BusbarTextOutput,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    inject(CallSite::DescribeRecords);
    let Some(describe) = original().and_then(|t| t.describe) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { describe(plugin, output, error) };
    if done == abi::BUSBAR_OK {
        // SAFETY: the SDK found it good and wrote it.
        unsafe { text(CallSite::DescribeRecords, output) };
    }
    done
}

unsafe extern "C" fn read(
    plugin: *const abi::BusbarPlugin,
    page: *mut abi::BusbarRecordPage,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    inject(CallSite::ReadRecords);
    let Some(read) = original().and_then(|t| t.read) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { read(plugin, page, error) };
    if done != abi::BUSBAR_OK {
        return done;
    }
    // SAFETY: the SDK found it good.
    let page = unsafe { &mut *page };
    let some = page.row_count > 0;
    match active_corruption(CallSite::ReadRecords) {
        // SAFETY: there is a first row, whose equipment has a first byte.
        Some(Misbehavior::NotUtf8) if some => unsafe { page.text.write(0xff) },
        // SAFETY: there is a first row.
        Some(Misbehavior::OutOfRange) if some => unsafe { (*page.rows).severity = 1000 },
        Some(Misbehavior::Overrun) if some => {
            // SAFETY: none; writing beyond the end is the fault, which is the purpose.
            unsafe { page.text.add(page.text_capacity as usize).write_bytes(0x11, 8) };
        }
        _ => {}
    }
    done
}
