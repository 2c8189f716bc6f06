//! Runner for commands, with input and output in memory.

use std::ffi::c_void;

use busbar_plugin_abi as abi;

use crate::boundary::{slice, text};
use crate::command::run;
use crate::{Command, Error};

/// Result of a command's run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CommandRun {
    /// Exit code; `None` before the command ended.
    pub exit_code: Option<u32>,
    /// Bytes that the command wrote.
    pub output: Vec<u8>,
    /// Diagnostics of the command: line of the input, 0 for none, and message.
    pub diagnostics: Vec<(u64, String)>,
}

/// Host's ends of the streams.
struct Ends<'a> {
    input: &'a [u8],
    piece: usize,
    writes_left: usize,
    run: CommandRun,
}

/// Runs a command through the C ABI. Input comes in pieces of at most `piece` bytes, and
/// after so many writes the command is asked to stop.
///
/// # Errors
/// What the command says.
pub fn run_command<P: Command>(
    plugin: &P,
    name: &str,
    arguments: &[&str],
    input: &[u8],
    (piece, writes): (usize, usize),
) -> Result<CommandRun, Error> {
    let mut ends =
        Ends { input, piece: piece.max(1), writes_left: writes, run: CommandRun::default() };
    let arguments: Vec<_> = arguments.iter().map(|a| abi::BusbarStr::from_borrowed(a)).collect();
    let call = abi::BusbarCommandCall {
        struct_size: size_of::<abi::BusbarCommandCall>() as u32,
        argument_count: arguments.len() as u32,
        name: abi::BusbarStr::from_borrowed(name),
        arguments: arguments.as_ptr(),
    };
    let streams = abi::BusbarCommandStreams {
        struct_size: size_of::<abi::BusbarCommandStreams>() as u32,
        reserved: 0,
        context: (&raw mut ends).cast(),
        read: Some(read),
        write: Some(write),
        diagnose: Some(diagnose),
    };
    let mut result = abi::BusbarCommandResult {
        struct_size: size_of::<abi::BusbarCommandResult>() as u32,
        exit_code: u32::MAX,
    };
    // SAFETY: everything lives for the call.
    unsafe { run(plugin, &raw const call, &raw const streams, &raw mut result)? };
    ends.run.exit_code = Some(result.exit_code);
    Ok(ends.run)
}

/// # Safety
/// `context` is the `Ends` of a [`run_command`] that runs, on its thread.
unsafe fn ends<'a>(context: *mut c_void) -> &'a mut Ends<'a> {
    // SAFETY: the caller vouches for it.
    unsafe { &mut *context.cast::<Ends<'a>>() }
}

unsafe extern "C" fn read(context: *mut c_void, buffer: *mut u8, capacity: usize) -> i64 {
    // SAFETY: the SDK hands on what `run_command` gave.
    let ends = unsafe { ends(context) };
    let count = ends.piece.min(capacity).min(ends.input.len());
    let (piece, rest) = ends.input.split_at(count);
    ends.input = rest;
    // SAFETY: the buffer has room for `capacity` bytes.
    unsafe { buffer.copy_from_nonoverlapping(piece.as_ptr(), count) };
    count as i64
}

unsafe extern "C" fn write(context: *mut c_void, bytes: *const u8, len: usize) -> u32 {
    // SAFETY: the SDK hands on what `run_command` gave.
    let ends = unsafe { ends(context) };
    if ends.writes_left == 0 || len > abi::BUSBAR_MAX_CHUNK {
        return 0;
    }
    ends.writes_left -= 1;
    // SAFETY: the SDK gives `len` bytes.
    if let Ok(bytes) = unsafe { slice(bytes, len) } {
        ends.run.output.extend_from_slice(bytes);
    }
    1
}

unsafe extern "C" fn diagnose(
    context: *mut c_void,
    _level: u32,
    line: u64,
    message: abi::BusbarStr,
) {
    // SAFETY: the SDK hands on what `run_command` gave, and a text.
    let (ends, message) = unsafe { (ends(context), text(message)) };
    ends.run.diagnostics.push((line, message.unwrap_or_default().to_owned()));
}
