//! Command-line verbs of plugins: capability `busbar.command/1-draft`.

use std::ffi::c_void;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use busbar_plugin_abi as abi;
use serde::{Deserialize, Serialize};

use crate::library::checked;
use crate::{Instance, PluginError, shown, text};

/// Diagnostics of one run that are kept; those beyond are counted.
pub const MAX_DIAGNOSTICS: usize = 1000;
/// Least number of diagnostics reserved for those without a line, such as sums at the end.
const MAX_REMARKS: usize = 16;
/// Bytes of one diagnostic.
const MAX_DIAGNOSTIC_BYTES: usize = 512;
/// Longest help line of a command, bytes.
const MAX_HELP_BYTES: usize = 200;
/// Bytes of input that a command gets at once at most.
const MAX_READ: usize = abi::BUSBAR_MAX_CHUNK;

/// A command that a plugin offers.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CommandInfo {
    /// Verb that users type.
    pub name: String,
    /// Help text of one line.
    pub help: String,
}

/// Importance of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum DiagnosticLevel {
    /// A part of the input was left out.
    Error,
    /// Input that may be a mistake.
    Warning,
    /// Information without a problem.
    Info,
}

/// Diagnostic that a command reports about its input.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// Importance of the diagnostic.
    pub level: DiagnosticLevel,
    /// Line of the input; the first is 1.
    pub line: Option<u64>,
    /// Text for users, a sentence.
    pub message: String,
}

/// Outcome of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum CommandExit {
    /// The command ended successfully.
    Done,
    /// The input could not be processed.
    InputAtFault,
    /// The arguments are at fault.
    WrongUse,
}

/// A command that ran.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CommandReport {
    /// Outcome of the command.
    pub exit: CommandExit,
    /// The first diagnostics, in their order.
    pub diagnostics: Vec<Diagnostic>,
    /// Count of diagnostics beyond the limit.
    pub omitted: u64,
}

/// Input and output streams of a command.
pub trait CommandStreams {
    /// Input, as much as there is room for; nothing at the end. An error stops the command.
    ///
    /// # Errors
    /// I/O errors of the input, and whatever else is to stop it.
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize>;

    /// Writes a whole piece of output. An error stops the command.
    ///
    /// # Errors
    /// I/O errors of the output, and whatever else is to stop it.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()>;
}

/// Validates a list of commands that came from elsewhere against the limits of the ABI.
///
/// # Errors
/// The rule that they break, in words.
pub fn check_commands(commands: &[CommandInfo]) -> Result<(), String> {
    let limit = abi::BUSBAR_MAX_COMMANDS;
    if commands.len() > limit as usize {
        return Err(format!("it offers {} commands; the limit is {limit}", commands.len()));
    }
    for CommandInfo { name, help } in commands {
        let fits = name.len() <= abi::BUSBAR_MAX_COMMAND_NAME
            && name.starts_with(|first: char| first.is_ascii_lowercase())
            && name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-');
        if !fits {
            return Err(format!("'{}' is no name of a command", shown(name, MAX_HELP_BYTES)));
        }
        if help.len() > MAX_HELP_BYTES || help.chars().any(char::is_control) {
            return Err(format!("the help of '{name}' is too long or not one line"));
        }
    }
    Ok(())
}

impl CommandReport {
    /// The same, with nothing in it that a plugin may not say.
    #[must_use]
    pub fn bounded(mut self) -> Self {
        let beyond = self.diagnostics.len().saturating_sub(MAX_DIAGNOSTICS);
        self.omitted = self.omitted.saturating_add(beyond as u64);
        self.diagnostics.truncate(MAX_DIAGNOSTICS);
        for diagnostic in &mut self.diagnostics {
            diagnostic.message = shown(&diagnostic.message, MAX_DIAGNOSTIC_BYTES);
        }
        self
    }
}

/// A plugin that offers commands.
pub struct Commands {
    table: &'static abi::BusbarCommand,
    instance: Arc<Instance>,
}

impl Commands {
    /// The capability of an instance.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_instance(instance: Arc<Instance>) -> Result<Self, PluginError> {
        let table = instance.capability(abi::COMMAND_ID)?;
        Ok(Self { table, instance })
    }

    /// Lists the commands that the instance offers.
    ///
    /// # Errors
    /// The rule that it breaks.
    pub fn list(&self) -> Result<Vec<CommandInfo>, PluginError> {
        let violation = |what: String| self.instance.violation(what);
        let (Some(count), Some(describe)) = (self.table.count, self.table.describe) else {
            return Err(violation("`count` or `describe` is null".into()));
        };
        let _serial = self.instance.serialize_calls();
        // SAFETY: a live instance.
        let count = unsafe { count(self.instance.as_ptr()) };
        if count > abi::BUSBAR_MAX_COMMANDS {
            return Err(violation(format!("it claims {count} commands")));
        }
        let mut commands = Vec::new();
        for index in 0..count {
            // SAFETY: a live instance.
            let info = checked(unsafe { describe(self.instance.as_ptr(), index) });
            let info = info.ok_or_else(|| violation(format!("command {index} is not there")))?;
            // SAFETY: the ABI makes its texts valid until `destroy`.
            let read = |text| unsafe { text::read(text) }.map_err(violation);
            commands.push(CommandInfo { name: read(info.name)?, help: read(info.help)? });
        }
        check_commands(&commands).map_err(violation)?;
        Ok(commands)
    }

    /// Runs a command to its end.
    ///
    /// # Errors
    /// [`PluginError::Failed`] with the streams' own words where they failed, or else what
    /// the plugin says, or the rule that it breaks.
    pub fn run(
        &self,
        name: &str,
        arguments: &[String],
        streams: &mut dyn CommandStreams,
    ) -> Result<CommandReport, PluginError> {
        let violation = |what: &str| self.instance.violation(what);
        let run = self.table.run.ok_or_else(|| violation("`run` is null"))?;
        let arguments: Vec<_> =
            arguments.iter().map(|text| abi::BusbarStr::from_borrowed(text)).collect();
        let call = abi::BusbarCommandCall {
            struct_size: size_of::<abi::BusbarCommandCall>() as u32,
            argument_count: arguments.len() as u32,
            name: abi::BusbarStr::from_borrowed(name),
            arguments: arguments.as_ptr(),
        };
        let mut host_streams =
            HostStreams { streams, stopped: None, diagnostics: Vec::new(), omitted: 0 };
        let raw = abi::BusbarCommandStreams {
            struct_size: size_of::<abi::BusbarCommandStreams>() as u32,
            reserved: 0,
            context: (&raw mut host_streams).cast(),
            read: Some(read),
            write: Some(write),
            diagnose: Some(diagnose),
        };
        let mut result = abi::BusbarCommandResult {
            struct_size: size_of::<abi::BusbarCommandResult>() as u32,
            exit_code: u32::MAX,
        };
        let mut error = abi::BusbarError::empty();
        let serial = self.instance.serialize_calls();
        // SAFETY: everything lives for the call.
        let status = unsafe { run(self.instance.as_ptr(), &call, &raw, &mut result, &mut error) };
        drop(serial);
        if let Some(reason) = host_streams.stopped {
            let (id, message) = (self.instance.info().id.clone(), reason.to_string());
            return Err(PluginError::Failed { id, settings_at_fault: false, message });
        }
        self.instance.outcome(status, &error)?;
        let exit = match result.exit_code {
            abi::BUSBAR_EXIT_CODE_DONE => CommandExit::Done,
            abi::BUSBAR_EXIT_CODE_INPUT => CommandExit::InputAtFault,
            abi::BUSBAR_EXIT_CODE_USAGE => CommandExit::WrongUse,
            _ => return Err(violation("a command ended with an unknown exit code")),
        };
        Ok(CommandReport {
            exit,
            diagnostics: host_streams.diagnostics,
            omitted: host_streams.omitted,
        })
    }
}

/// The host's side of a running command's streams.
struct HostStreams<'a> {
    streams: &'a mut dyn CommandStreams,
    /// I/O error that made the command stop.
    stopped: Option<io::Error>,
    diagnostics: Vec<Diagnostic>,
    omitted: u64,
}

impl HostStreams<'_> {
    /// Runs `work` unless the command must stop; an error or a panic stops it.
    fn run_unless_stopped<T>(
        &mut self,
        work: impl FnOnce(&mut dyn CommandStreams) -> io::Result<T>,
    ) -> Option<T> {
        if self.stopped.is_some() {
            return None;
        }
        let streams = &mut *self.streams;
        let done = catch_unwind(AssertUnwindSafe(|| work(streams)))
            .unwrap_or_else(|_| Err(io::Error::other("the host's stream panicked")));
        done.map_err(|error| self.stopped = Some(error)).ok()
    }
}

/// # Safety
/// `context` is the `HostStreams` of a `run` under way, on its thread.
unsafe fn host_streams<'a>(context: *mut c_void) -> Option<&'a mut HostStreams<'a>> {
    // SAFETY: the caller vouches for it.
    unsafe { context.cast::<HostStreams<'a>>().as_mut() }
}

unsafe extern "C" fn read(context: *mut c_void, buffer: *mut u8, capacity: usize) -> i64 {
    // SAFETY: the plugin hands back what `run` gave.
    let Some(host_streams) = (unsafe { host_streams(context) }) else { return -1 };
    if buffer.is_null() || capacity == 0 {
        return 0;
    }
    // SAFETY: the plugin gives a buffer of `capacity` bytes, of which no more are written.
    let buffer = unsafe {
        buffer.write_bytes(0, capacity.min(MAX_READ));
        std::slice::from_raw_parts_mut(buffer, capacity.min(MAX_READ))
    };
    let count = host_streams.run_unless_stopped(|streams| streams.read(buffer));
    count.and_then(|count| i64::try_from(count).ok()).unwrap_or(-1)
}

unsafe extern "C" fn write(context: *mut c_void, bytes: *const u8, len: usize) -> u32 {
    // SAFETY: the plugin hands back what `run` gave.
    let Some(host_streams) = (unsafe { host_streams(context) }) else { return 0 };
    if len == 0 {
        return u32::from(host_streams.stopped.is_none());
    }
    if bytes.is_null() || len > abi::BUSBAR_MAX_CHUNK {
        let fault = format!("it writes {len} bytes at once, or from null");
        host_streams.stopped.get_or_insert_with(|| io::Error::other(fault));
        return 0;
    }
    // SAFETY: the plugin gives `len` bytes.
    let bytes = unsafe { std::slice::from_raw_parts(bytes, len) };
    u32::from(host_streams.run_unless_stopped(|streams| streams.write(bytes)).is_some())
}

unsafe extern "C" fn diagnose(
    context: *mut c_void,
    level: u32,
    line: u64,
    message: abi::BusbarStr,
) {
    // SAFETY: the plugin hands back what `run` gave.
    let Some(host_streams) = (unsafe { host_streams(context) }) else { return };
    // Rows leave room for remarks on the whole.
    let room = if line > 0 { MAX_DIAGNOSTICS - MAX_REMARKS } else { MAX_DIAGNOSTICS };
    if host_streams.diagnostics.len() >= room {
        host_streams.omitted += 1;
        return;
    }
    let level = match level {
        abi::BUSBAR_LOG_ERROR => DiagnosticLevel::Error,
        abi::BUSBAR_LOG_WARNING => DiagnosticLevel::Warning,
        _ => DiagnosticLevel::Info,
    };
    // SAFETY: the plugin gives a readable text.
    let message = unsafe { text::read_short(message, MAX_DIAGNOSTIC_BYTES) };
    host_streams.diagnostics.push(Diagnostic { level, line: (line > 0).then_some(line), message });
}
