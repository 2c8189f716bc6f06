//! Function table of charts, with corrupted results.

use busbar_plugin_sdk::abi;

use crate::corruption::{active_corruption, status, text};
use crate::fault::{CallSite, Misbehavior};
use crate::sdk_tables::{SHORT, sdk_table};

/// Function tables with their true size, and with a wrong one.
pub(super) static TABLE: [abi::BusbarChart; 2] =
    [chart(size_of::<abi::BusbarChart>() as u32), chart(SHORT)];

const fn chart(struct_size: u32) -> abi::BusbarChart {
    let (describe, read) = (Some(describe as _), Some(read as _));
    abi::BusbarChart { struct_size, reserved: 0, describe, read, explain: Some(explain as _) }
}

fn original() -> Option<&'static abi::BusbarChart> {
    sdk_table::<abi::BusbarChart>(abi::CHART_ID)
}

unsafe extern "C" fn describe(
    plugin: *const abi::BusbarPlugin,
    output: *mut abi::BusbarTextOutput,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some(describe) = original().and_then(|t| t.describe) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { describe(plugin, output, error) };
    if done == abi::BUSBAR_OK {
        // SAFETY: the SDK found it good and wrote it.
        unsafe { text(CallSite::DescribeChart, output) };
    }
    done
}

unsafe extern "C" fn read(
    plugin: *const abi::BusbarPlugin,
    page: *mut abi::BusbarChartPage,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some(read) = original().and_then(|t| t.read) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { read(plugin, page, error) };
    if done != abi::BUSBAR_OK {
        return done;
    }
    // SAFETY: the SDK found it good.
    let page = unsafe { &mut *page };
    let some = page.count > 0;
    match active_corruption(CallSite::ReadChart) {
        // SAFETY: there is a first value.
        Some(Misbehavior::NotFinite) if some => unsafe { page.values.write(f32::INFINITY) },
        // SAFETY: there is a first record.
        Some(Misbehavior::OutOfRange) if some => unsafe { (*page.records).equipment = u32::MAX },
        Some(Misbehavior::Overrun) if some => {
            // SAFETY: none; writing beyond the end is the fault, which is the purpose.
            unsafe {
                let end = page.values.add((page.capacity * page.axis_count) as usize);
                end.write_bytes(0x11, 1);
            }
        }
        _ => {}
    }
    // SAFETY: the host's error is null or valid.
    unsafe { status(CallSite::ReadChart, done, error) }
}

unsafe extern "C" fn explain(
    plugin: *const abi::BusbarPlugin,
    equipment: abi::BusbarStr,
    time_unix_nanos: i64,
    output: *mut abi::BusbarTextOutput,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some(explain) = original().and_then(|t| t.explain) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { explain(plugin, equipment, time_unix_nanos, output, error) };
    if done == abi::BUSBAR_OK {
        // SAFETY: the SDK found it good and wrote it.
        unsafe { text(CallSite::Explain, output) };
    }
    done
}
