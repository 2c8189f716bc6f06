//! Capability `busbar.command/1-draft`: subcommands of the program that a plugin offers.
//!
//! A command reads one stream of bytes and writes another. The host opens the files; the
//! plugin sees bytes alone, in pieces, so that neither holds a whole file in memory.

use core::ffi::c_void;

use crate::{BusbarError, BusbarLogLevelNumber, BusbarPlugin, BusbarStatusNumber, BusbarStr};

/// Id of the capability.
pub const COMMAND_ID: &str = "busbar.command/1-draft";

/// Commands of one plugin, at most.
pub const BUSBAR_MAX_COMMANDS: u32 = 16;
/// Bytes of a command's name, at most.
pub const BUSBAR_MAX_COMMAND_NAME: usize = 32;
/// Bytes of one `write`, at most.
pub const BUSBAR_MAX_CHUNK: usize = 1 << 20;

/// Exit code of a command.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusbarExitCode {
    /// Exit code of a command that is done.
    Done = 0,
    /// Exit code of a command whose input is at fault; nothing could be done.
    Input = 1,
    /// Exit code of a command whose arguments are at fault.
    Usage = 2,
}

enum_numbers! {
    /// Number of a [`BusbarExitCode`] that the other side wrote.
    BusbarExitCodeNumber: u32 = BusbarExitCode {
        BUSBAR_EXIT_CODE_DONE = Done,
        BUSBAR_EXIT_CODE_INPUT = Input,
        BUSBAR_EXIT_CODE_USAGE = Usage,
    }
}

/// Command that a plugin offers. Valid until `destroy`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommandInfo {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Name that users type: a lower-case letter, then lower-case letters, digits and `-`.
    pub name: BusbarStr,
    /// Help text of one line.
    pub help: BusbarStr,
}

/// Call of a command, with its arguments.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommandCall {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Number of arguments in `arguments`.
    pub argument_count: u32,
    /// Name of the command.
    pub name: BusbarStr,
    /// Arguments that users wrote for the plugin, besides files.
    pub arguments: *const BusbarStr,
}

/// Input, output and diagnostics of a command. Valid during `run`, on its thread alone.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommandStreams {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Context that is passed back in every call.
    pub context: *mut c_void,
    /// `[the thread of the call]` Reads at most `capacity` bytes of the input into `buffer`.
    /// Returns their number, 0 at the end of the input. Below 0, the plugin must stop and return
    /// `BUSBAR_CANCELLED`.
    pub read:
        Option<unsafe extern "C" fn(context: *mut c_void, buffer: *mut u8, capacity: usize) -> i64>,
    /// `[the thread of the call]` Takes `len` bytes of output, at most
    /// [`BUSBAR_MAX_CHUNK`], copying them. Returns 0 if the plugin must stop and return
    /// `BUSBAR_CANCELLED`.
    pub write:
        Option<unsafe extern "C" fn(context: *mut c_void, bytes: *const u8, len: usize) -> u32>,
    /// `[the thread of the call]` Reports a diagnostic on the input. `line` is a line of the
    /// input, 1 the first, 0 for none. Messages beyond the host's limit are counted, not kept.
    /// Cannot fail.
    pub diagnose: Option<
        unsafe extern "C" fn(
            context: *mut c_void,
            level: BusbarLogLevelNumber,
            line: u64,
            message: BusbarStr,
        ),
    >,
}

/// Result of a command. The caller owns it and fills in `struct_size`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommandResult {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Exit code of the command.
    pub exit_code: BusbarExitCodeNumber,
}

/// Function table of `busbar.command/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommand {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// `[serialized]` Number of commands, at most [`BUSBAR_MAX_COMMANDS`].
    pub count: Option<unsafe extern "C" fn(plugin: *const BusbarPlugin) -> u32>,
    /// `[serialized]` Returns a command's description, valid until `destroy`, or null if `index`
    /// is too large.
    pub describe: Option<
        unsafe extern "C" fn(plugin: *const BusbarPlugin, index: u32) -> *const BusbarCommandInfo,
    >,
    /// `[serialized]` Runs a command: reads the input as far as it needs, writes its output in
    /// order, and fills in the exit code. All arguments are borrowed for the call. A fault of the
    /// input is a diagnostic and at worst `BUSBAR_EXIT_CODE_INPUT`, no failure. Fails with
    /// `BUSBAR_INVALID_ARGUMENT` for a name that the plugin does not offer, with
    /// `BUSBAR_CANCELLED`, `BUSBAR_FAILED` or `BUSBAR_INTERNAL`.
    pub run: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            call: *const BusbarCommandCall,
            streams: *const BusbarCommandStreams,
            result: *mut BusbarCommandResult,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
}
