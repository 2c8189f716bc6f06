//! Capability `busbar.command/1-draft`: subcommands of the program.

use std::cell::Cell;
use std::io;

use busbar_plugin_abi as abi;

use crate::boundary::{checked_mut, checked_ref, slice, text};
use crate::{Error, LogLevel, Plugin};

/// Bytes of one write, at most; longer ones are cut into several.
pub const MAX_CHUNK: usize = abi::BUSBAR_MAX_CHUNK;

/// Subcommands of the program: `busbar NAME FILE` runs one.
///
/// One that is called `points` lists what the device of a configured instance has, as a point
/// list for `busbar import` (CSV: `tag`, `type`, `address.FIELD` and more columns). Only `busbar
/// import CONFIG --from INSTANCE` runs it, with the instance's settings and an empty input. What
/// waits for a device reads the input meanwhile, which tells the host that it goes on.
pub trait Command: Plugin {
    /// Commands of the plugin, at most 16.
    const COMMANDS: &'static [CommandInfo];

    /// Runs the command of this name, one of [`Command::COMMANDS`]. A fault of the input is a
    /// diagnostic.
    ///
    /// # Errors
    /// What failed otherwise. Errors of the streams may be handed on as they are: where the
    /// host asks to stop, that is what it is told.
    fn run(
        &self,
        name: &str,
        arguments: &[&str],
        streams: &Streams<'_>,
    ) -> Result<CommandExit, Error>;
}

/// Name and help of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CommandInfo {
    /// Name that users type: a lower-case letter, then lower-case letters, digits and `-`, at most
    /// 32 bytes.
    pub name: &'static str,
    /// Help text of one line.
    pub help: &'static str,
}

/// Outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommandExit {
    /// Command done, perhaps without some parts of the input.
    Done,
    /// Input at fault: nothing could be done with it.
    InputAtFault,
    /// Arguments that are at fault.
    WrongUse,
}

/// Input, output and diagnostics of a command that runs.
pub struct Streams<'a> {
    raw: &'a abi::BusbarCommandStreams,
    is_stopped: Cell<bool>,
}

impl Streams<'_> {
    /// Returns a reader of the input. It ends where reading gives nothing.
    pub fn input(&self) -> impl io::Read + '_ {
        Input(self)
    }

    /// Returns a writer of the output. Each write goes to the host: buffer small ones.
    pub fn output(&self) -> impl io::Write + '_ {
        Output(self)
    }

    /// Reports a diagnostic on the input, at a line of it if there is one; 1 is the first.
    pub fn diagnose(&self, level: LogLevel, line: Option<u64>, message: &str) {
        if let Some(diagnose) = self.raw.diagnose {
            let message = abi::BusbarStr::from_borrowed(message);
            // SAFETY: the host's streams are valid for the call, on this thread.
            unsafe { diagnose(self.raw.context, level.to_abi(), line.unwrap_or(0), message) };
        }
    }

    fn stop(&self) -> io::Error {
        self.is_stopped.set(true);
        io::Error::new(io::ErrorKind::ConnectionAborted, "the host asks to stop")
    }
}

struct Input<'a>(&'a Streams<'a>);

impl io::Read for Input<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let raw = self.0.raw;
        if self.0.is_stopped.get() {
            return Err(self.0.stop());
        }
        let Some(read) = raw.read.filter(|_| !buffer.is_empty()) else { return Ok(0) };
        // SAFETY: the host's streams are valid for the call, on this thread; the buffer is
        // as long as it says.
        let count = unsafe { read(raw.context, buffer.as_mut_ptr(), buffer.len()) };
        usize::try_from(count)
            .ok()
            .filter(|count| *count <= buffer.len())
            .ok_or_else(|| self.0.stop())
    }
}

struct Output<'a>(&'a Streams<'a>);

impl io::Write for Output<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let raw = self.0.raw;
        if self.0.is_stopped.get() {
            return Err(self.0.stop());
        }
        let piece = &bytes[..bytes.len().min(MAX_CHUNK)];
        let Some(write) = raw.write.filter(|_| !piece.is_empty()) else { return Ok(piece.len()) };
        // SAFETY: the host's streams are valid for the call, on this thread.
        match unsafe { write(raw.context, piece.as_ptr(), piece.len()) } {
            0 => Err(self.0.stop()),
            _ => Ok(piece.len()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Converts the commands of a type to their ABI structs.
pub(crate) fn infos<P: Command>() -> Vec<Info> {
    let raw = |info: &CommandInfo| {
        Info(abi::BusbarCommandInfo {
            struct_size: size_of::<abi::BusbarCommandInfo>() as u32,
            reserved: 0,
            name: abi::BusbarStr::from_static(info.name),
            help: abi::BusbarStr::from_static(info.help),
        })
    };
    P::COMMANDS.iter().map(raw).collect()
}

/// ABI struct of a command, whose texts are static.
pub(crate) struct Info(pub(crate) abi::BusbarCommandInfo);

// SAFETY: all pointers lead to static memory that never changes.
unsafe impl Send for Info {}
// SAFETY: as above.
unsafe impl Sync for Info {}

/// Runs a command as the ABI's `run` does.
///
/// # Safety
/// Pointers are null or valid as the ABI's `run` demands.
pub(crate) unsafe fn run<P: Command>(
    plugin: &P,
    call: *const abi::BusbarCommandCall,
    streams: *const abi::BusbarCommandStreams,
    result: *mut abi::BusbarCommandResult,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointers.
    let (call, raw, result) = unsafe {
        (
            checked_ref(call, "run: the call")?,
            checked_ref(streams, "run: the streams")?,
            checked_mut(result, "run: the result")?,
        )
    };
    if raw.read.is_none() || raw.write.is_none() || raw.diagnose.is_none() {
        return Err(Error::argument("run: a function of the streams is null"));
    }
    // SAFETY: the host's texts are valid for the call.
    let name = unsafe { text(call.name)? };
    if !P::COMMANDS.iter().any(|info| info.name == name) {
        return Err(Error::argument(format!("run: there is no command '{name}'")));
    }
    let mut arguments = Vec::new();
    // SAFETY: the host gives `argument_count` texts, valid for the call.
    for argument in unsafe { slice(call.arguments, call.argument_count as usize)? } {
        // SAFETY: as above.
        arguments.push(unsafe { text(*argument)? });
    }
    let streams = Streams { raw, is_stopped: Cell::new(false) };
    let outcome = plugin.run(name, &arguments, &streams);
    if streams.is_stopped.get() {
        return Err(Error::cancelled());
    }
    result.exit_code = match outcome? {
        CommandExit::Done => abi::BUSBAR_EXIT_CODE_DONE,
        CommandExit::InputAtFault => abi::BUSBAR_EXIT_CODE_INPUT,
        CommandExit::WrongUse => abi::BUSBAR_EXIT_CODE_USAGE,
    };
    Ok(())
}
