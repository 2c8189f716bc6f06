//! Commands of plugins, wherever they run.
//!
//! A plugin's process gets two descriptors with the call: the input, opened for reading,
//! and a pipe for the output, which is read here. So what a plugin writes passes through
//! this process, and neither holds more than a piece of it.

use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use busbar_plugin_abi as abi;
use busbar_plugin_host::{
    CommandInfo, CommandReport, CommandStreams, Commands, PluginError, PluginInfo, check_commands,
};
use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::{Errno, ioctl_fionbio};

use crate::message::{Answer, Request};
use crate::plugin::Plugin;
use crate::process::PluginProcess;
use crate::process_monitor::timespec;

/// Bytes of output that are taken at once.
const PIECE_BYTES: usize = 1 << 16;
/// Shortest period between two progress messages of a command.
const TELL_PERIOD: Duration = Duration::from_millis(100);
/// Longest wait for room in the pipe before a progress message.
const ROOM_PERIOD: Duration = Duration::from_secs(1);

/// Errors of a command.
#[derive(Debug)]
pub enum CommandError {
    /// The plugin failed, or its process.
    Plugin(PluginError),
    /// The output could not be written.
    Output(io::Error),
}

impl Plugin {
    /// Reports whether a plugin declares the capability of commands.
    pub fn offer_commands(info: &PluginInfo) -> bool {
        info.capabilities.iter().any(|id| id == abi::COMMAND_ID)
    }

    /// The commands that it offers.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`], or the rule that it breaks.
    pub fn commands(&self) -> Result<Vec<CommandInfo>, PluginError> {
        match self {
            Self::InProcess(instance) => Commands::from_instance(instance.clone())?.list(),
            Self::Isolated(process) => process.commands(),
        }
    }

    /// Runs a command. `input` is a file opened for reading. `output` receives the output in
    /// order, `progress` the share of the input that was read, 0 to 1.
    ///
    /// # Errors
    /// What the plugin says, how it ended, or the error of `output`, which stops it.
    pub fn run_command(
        &self,
        name: &str,
        arguments: &[String],
        input: File,
        output: &mut dyn FnMut(&[u8]) -> io::Result<()>,
        progress: &mut dyn FnMut(f32),
    ) -> Result<CommandReport, CommandError> {
        match self {
            Self::InProcess(instance) => {
                let commands =
                    Commands::from_instance(instance.clone()).map_err(CommandError::Plugin)?;
                let size = size_of_input(&input);
                let mut streams =
                    LocalStreams { input, size, done: 0, output, progress, failed: None };
                let report = commands.run(name, arguments, &mut streams);
                match streams.failed {
                    Some(error) => Err(CommandError::Output(error)),
                    None => report.map_err(CommandError::Plugin),
                }
            }
            Self::Isolated(process) => {
                process.run_command(name, arguments, input, output, progress)
            }
        }
    }
}

fn size_of_input(input: &File) -> u64 {
    input.metadata().map_or(0, |metadata| metadata.len())
}

/// Share of the input that was read, 0 to 1.
fn share(done: u64, size: u64) -> f32 {
    if size == 0 { 1.0 } else { (done as f64 / size as f64).min(1.0) as f32 }
}

/// Streams of a command in this process.
struct LocalStreams<'a> {
    input: File,
    size: u64,
    done: u64,
    output: &'a mut dyn FnMut(&[u8]) -> io::Result<()>,
    progress: &'a mut dyn FnMut(f32),
    /// Error of the output.
    failed: Option<io::Error>,
}

impl CommandStreams for LocalStreams<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = read_input(&mut self.input, buffer)?;
        self.done += count as u64;
        (self.progress)(share(self.done, self.size));
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        (self.output)(bytes).map_err(|error| {
            let stop = io::Error::other(error.to_string());
            self.failed = Some(error);
            stop
        })
    }
}

fn read_input(input: &mut File, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match input.read(buffer) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            read => {
                let named = |e| io::Error::other(format!("the input cannot be read: {e}"));
                return read.map_err(named);
            }
        }
    }
}

impl PluginProcess {
    fn commands(&self) -> Result<Vec<CommandInfo>, PluginError> {
        let Answer::Commands(commands) = self.shared.call(Request::Commands, &[])? else {
            return Err(self.shared.unexpected_answer());
        };
        let violation = |what| PluginError::Violation { id: self.info().id.clone(), what };
        check_commands(&commands).map_err(violation)?;
        Ok(commands)
    }

    fn run_command(
        &self,
        name: &str,
        arguments: &[String],
        input: File,
        output: &mut dyn FnMut(&[u8]) -> io::Result<()>,
        progress: &mut dyn FnMut(f32),
    ) -> Result<CommandReport, CommandError> {
        let plugin = CommandError::Plugin;
        let (mut theirs, writer) = io::pipe().map_err(CommandError::Output)?;
        ioctl_fionbio(&writer, true).map_err(|e| CommandError::Output(e.into()))?;
        let writer = File::from(std::os::fd::OwnedFd::from(writer));
        let request = Request::Run { name: name.to_owned(), arguments: arguments.to_vec() };
        let waiting = self.shared.start_call(request, &[&input, &writer]).map_err(plugin)?;
        // Now theirs is the only other end: it closes with the call, or with the process.
        drop((input, writer));
        let mut piece = vec![0; PIECE_BYTES];
        let copied = loop {
            let count = match theirs.read(&mut piece) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => break Err(error),
                Ok(count) => count,
            };
            progress(f32::from_bits(waiting.progress.load(Ordering::Relaxed)).clamp(0.0, 1.0));
            if count == 0 {
                break Ok(());
            }
            if let Err(error) = output(&piece[..count]) {
                break Err(error);
            }
        };
        // A command that still writes finds that nobody reads.
        drop(theirs);
        let gone = || plugin(self.shared.unexpected_answer());
        let outcome = waiting.outcome.recv().map_err(|_| gone())?;
        copied.map_err(CommandError::Output)?;
        match outcome.map_err(plugin)? {
            Answer::Ran(report) => Ok(report.bounded()),
            _ => Err(gone()),
        }
    }
}

/// Streams of a command in a plugin's process.
pub(crate) struct PipeStreams<T> {
    input: File,
    size: u64,
    done: u64,
    output: File,
    /// Reports the share of the input that was read.
    tell: T,
    told: Instant,
}

impl<T: FnMut(f32)> PipeStreams<T> {
    pub(crate) fn new(input: File, output: File, tell: T) -> Self {
        let size = size_of_input(&input);
        Self { input, size, done: 0, output, tell, told: Instant::now() }
    }

    /// Reports progress, or that the command waits for the reader of its output.
    fn report_progress(&mut self, is_due: bool) {
        if is_due || self.told.elapsed() > TELL_PERIOD {
            self.told = Instant::now();
            (self.tell)(share(self.done, self.size));
        }
    }
}

impl<T: FnMut(f32)> CommandStreams for PipeStreams<T> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = read_input(&mut self.input, buffer)?;
        self.done += count as u64;
        self.report_progress(false);
        Ok(count)
    }

    fn write(&mut self, mut bytes: &[u8]) -> io::Result<()> {
        while !bytes.is_empty() {
            match self.output.write(bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                    let mut ends = [PollFd::from_borrowed_fd(self.output.as_fd(), PollFlags::OUT)];
                    match poll(&mut ends, Some(&timespec(ROOM_PERIOD))) {
                        // Who reads is slow, not the plugin.
                        Ok(0) => self.report_progress(true),
                        Ok(_) | Err(Errno::INTR) => {}
                        Err(error) => return Err(error.into()),
                    }
                }
                Err(error) => return Err(error),
            }
        }
        self.report_progress(false);
        Ok(())
    }
}
