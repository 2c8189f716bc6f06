//! Function table of commands, with corrupted results.

use busbar_plugin_sdk::abi;

use crate::corruption::{active_corruption, status};
use crate::fault::{CallSite, Misbehavior};
use crate::sdk_tables::{SHORT, sdk_table};

/// Function tables with their true size, and with a wrong one.
pub(super) static TABLE: [abi::BusbarCommand; 2] =
    [command(size_of::<abi::BusbarCommand>() as u32), command(SHORT)];

const fn command(struct_size: u32) -> abi::BusbarCommand {
    let (count, describe) = (Some(count_commands as _), Some(describe_command as _));
    abi::BusbarCommand { struct_size, reserved: 0, count, describe, run: Some(run_command as _) }
}

fn sdk_command() -> Option<&'static abi::BusbarCommand> {
    sdk_table::<abi::BusbarCommand>(abi::COMMAND_ID)
}

unsafe extern "C" fn count_commands(plugin: *const abi::BusbarPlugin) -> u32 {
    // SAFETY: handed on as it came.
    sdk_command().and_then(|t| t.count).map_or(0, |count| unsafe { count(plugin) })
}

unsafe extern "C" fn describe_command(
    plugin: *const abi::BusbarPlugin,
    index: u32,
) -> *const abi::BusbarCommandInfo {
    let describe = sdk_command().and_then(|t| t.describe);
    // SAFETY: handed on as it came.
    describe.map_or(std::ptr::null(), |describe| unsafe { describe(plugin, index) })
}

unsafe extern "C" fn run_command(
    plugin: *const abi::BusbarPlugin,
    call: *const abi::BusbarCommandCall,
    streams: *const abi::BusbarCommandStreams,
    result: *mut abi::BusbarCommandResult,
    error: *mut abi::BusbarError,
) -> abi::BusbarStatusNumber {
    let Some(run) = sdk_command().and_then(|t| t.run) else { return abi::BUSBAR_INTERNAL };
    // SAFETY: handed on as it came.
    let done = unsafe { run(plugin, call, streams, result, error) };
    if done == abi::BUSBAR_OK
        && active_corruption(CallSite::RunCommand) == Some(Misbehavior::OutOfRange)
    {
        // SAFETY: the SDK found it good.
        unsafe { (*result).exit_code = u32::MAX };
    }
    // SAFETY: the host's error is null or valid.
    unsafe { status(CallSite::RunCommand, done, error) }
}
