//! Capability `busbar.command/1-draft`: subcommands of the program that a plugin offers.
//!
//! A command reads one stream of bytes and writes another. The host opens the files; the
//! plugin sees bytes alone, in pieces, so that neither holds a whole file in memory.

use core::ffi::c_void;

use crate::{BusbarError, BusbarPlugin, BusbarStatus, BusbarStr};

/// Id of the capability.
pub const COMMAND_ID: &str = "busbar.command/1-draft";

/// Commands of one plugin at most.
pub const BUSBAR_MAX_COMMANDS: u32 = 16;
/// Bytes of a command's name at most.
pub const BUSBAR_MAX_COMMAND_NAME: usize = 32;
/// Bytes of one `write` at most.
pub const BUSBAR_MAX_CHUNK: usize = 1 << 20;

/// Exit code: done.
pub const BUSBAR_EXIT_DONE: u32 = 0;
/// Exit code: the input is at fault, and nothing could be done.
pub const BUSBAR_EXIT_INPUT: u32 = 1;
/// Exit code: the arguments are at fault.
pub const BUSBAR_EXIT_USAGE: u32 = 2;

/// A command that a plugin offers. Valid until `destroy`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommandInfo {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// What users type: a lower-case letter, then lower-case letters, digits and `-`.
    pub name: BusbarStr,
    /// One line: what it does.
    pub help: BusbarStr,
}

/// What a command is to do.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommandCall {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Number of arguments.
    pub argument_count: u32,
    /// Name of the command.
    pub name: BusbarStr,
    /// What users wrote for the plugin, besides files.
    pub arguments: *const BusbarStr,
}

/// Input, output and diagnostics of a command. Valid during `run`, on its thread alone.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommandStreams {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// Passed back in every call.
    pub context: *mut c_void,
    /// `[the thread of the call]` Puts at most `capacity` bytes of the input into `buffer`.
    /// Returns how many; 0 at the end, and less than 0 if the plugin must stop and return
    /// `BUSBAR_CANCELLED`.
    pub read:
        Option<unsafe extern "C" fn(context: *mut c_void, buffer: *mut u8, capacity: usize) -> i64>,
    /// `[the thread of the call]` Takes `len` bytes of output, at most
    /// [`BUSBAR_MAX_CHUNK`], copying them. Returns 0 if the plugin must stop and return
    /// `BUSBAR_CANCELLED`.
    pub write:
        Option<unsafe extern "C" fn(context: *mut c_void, bytes: *const u8, len: usize) -> u32>,
    /// `[the thread of the call]` Says something of the input: `level` is a
    /// `BUSBAR_LOG_*`, `line` the line of the input that it is about, 1 the first, 0 for
    /// none. Messages beyond the host's limit are counted, not kept. Cannot fail.
    pub diagnose: Option<
        unsafe extern "C" fn(context: *mut c_void, level: u32, line: u64, message: BusbarStr),
    >,
}

/// What a command came to. The caller owns it and fills in `struct_size`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommandResult {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// `BUSBAR_EXIT_*`.
    pub exit_code: u32,
}

/// Table of `busbar.command/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCommand {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Zero.
    pub reserved: u32,
    /// `[main-thread]` Number of commands, at most [`BUSBAR_MAX_COMMANDS`].
    pub count: Option<unsafe extern "C" fn(plugin: *const BusbarPlugin) -> u32>,
    /// `[main-thread]` One of them, valid until `destroy`, or null if `index` is too large.
    pub describe: Option<
        unsafe extern "C" fn(plugin: *const BusbarPlugin, index: u32) -> *const BusbarCommandInfo,
    >,
    /// `[main-thread]` Does a command: reads the input as far as it needs, writes its output
    /// in order, and fills in the exit code. Everything is borrowed for the call. What is
    /// wrong with the input is a diagnostic and at worst `BUSBAR_EXIT_INPUT`, no failure.
    /// Fails with `BUSBAR_INVALID_ARGUMENT` for a name that it does not offer, with
    /// `BUSBAR_CANCELLED`, `BUSBAR_FAILED` or `BUSBAR_INTERNAL`.
    pub run: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            call: *const BusbarCommandCall,
            streams: *const BusbarCommandStreams,
            result: *mut BusbarCommandResult,
            error: *mut BusbarError,
        ) -> BusbarStatus,
    >,
}
