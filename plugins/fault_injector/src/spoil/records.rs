//! Function table of records, with corrupted results.

use busbar_plugin_sdk::abi;

use super::{due_again, text};
use crate::fault::{At, Kind};
use crate::strike::strike;
use crate::tables::{SHORT, honest_table};

/// Function tables with their true size, and with a wrong one.
pub(super) static TABLE: [abi::BusbarRecords; 2] =
    [records(size_of::<abi::BusbarRecords>() as u32), records(SHORT)];

const fn records(struct_size: u32) -> abi::BusbarRecords {
    let (describe, read) = (Some(describe as _), Some(read as _));
    abi::BusbarRecords { struct_size, reserved: 0, describe, read }
}

fn honest() -> Option<&'static abi::BusbarRecords> {
    honest_table::<abi::BusbarRecords>(abi::RECORDS_ID)
}

unsafe extern "C" fn describe(
    plugin: *const abi::BusbarPlugin,
    output: *mut abi::BusbarTextOutput,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatus {
    strike(At::DescribeRecords);
    let Some(describe) = honest().and_then(|t| t.describe) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { describe(plugin, output, error) };
    if done == abi::BUSBAR_OK {
        // SAFETY: the SDK found it good and wrote it.
        unsafe { text(At::DescribeRecords, output) };
    }
    done
}

unsafe extern "C" fn read(
    plugin: *const abi::BusbarPlugin,
    page: *mut abi::BusbarRecordPage,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatus {
    strike(At::ReadRecords);
    let Some(read) = honest().and_then(|t| t.read) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { read(plugin, page, error) };
    if done != abi::BUSBAR_OK {
        return done;
    }
    // SAFETY: the SDK found it good.
    let page = unsafe { &mut *page };
    let some = page.row_count > 0;
    match due_again(At::ReadRecords) {
        // SAFETY: there is a first row, whose equipment has a first byte.
        Some(Kind::NotUtf8) if some => unsafe { page.text.write(0xff) },
        // SAFETY: there is a first row.
        Some(Kind::OutOfRange) if some => unsafe { (*page.rows).severity = 1000 },
        Some(Kind::Overrun) if some => {
            // SAFETY: none; writing beyond the end is the fault, which is the purpose.
            unsafe { page.text.add(page.text_capacity as usize).write_bytes(0x11, 8) };
        }
        _ => {}
    }
    done
}
