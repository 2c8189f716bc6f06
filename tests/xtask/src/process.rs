//! Child processes: started with a line on the terminal, ended with us.
//!
//! Each runs in a process group of its own. A signal to this program sets a
//! flag that every wait looks at; the wait then fails, and dropping
//! [`Process`] ends the whole group.

use std::io::{BufRead, BufReader, PipeReader, Read, pipe};
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, LazyLock};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use rustix::process::{Pid, Signal, kill_process, kill_process_group};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};

/// Polling period of a child and of the signal flag.
const POLL: Duration = Duration::from_millis(50);
/// Longest time between a request to end and the kill of a child.
const MAX_END_WAIT: Duration = Duration::from_secs(5);
/// Longest delay of output after the end of its child process.
const MAX_OUTPUT_LAG: Duration = Duration::from_secs(2);
/// Greatest number of lines read from a child and not yet taken.
const MAX_PENDING_LINES: usize = 256;
/// Greatest length of a line, bytes; a longer one is cut in pieces.
const MAX_LINE_BYTES: u64 = 64 * 1024;

static INTERRUPTED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Makes Ctrl-C, hang-up and termination end the waits below.
pub(crate) fn catch_signals() -> Result<()> {
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        signal_hook::flag::register(signal, Arc::clone(&INTERRUPTED))
            .context("cannot catch signals")?;
    }
    Ok(())
}

fn fail_if_interrupted() -> Result<()> {
    if INTERRUPTED.load(Ordering::Relaxed) {
        bail!("interrupted");
    }
    Ok(())
}

/// Sleeps for a time, or fails when a signal comes.
pub(crate) fn sleep(duration: Duration) -> Result<()> {
    let end = Instant::now() + duration;
    while Instant::now() < end {
        fail_if_interrupted()?;
        thread::sleep(POLL);
    }
    Ok(())
}

/// Returns the command of the `cargo` that runs this program.
pub(crate) fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Reports whether the command can be started and succeeds; its output is not shown.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    quiet_output(command).is_ok_and(|output| output.status.success())
}

/// Runs a short command without showing it or its output.
pub(crate) fn quiet_output(command: &mut Command) -> Result<Output> {
    command
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("cannot start `{}`", name_of(command)))
}

/// Runs a command to its end; a failure of the command is an error.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    Process::start(command)?.finish()
}

/// Runs a command as [`run`] does, but on this program's terminal: the command may ask something.
pub(crate) fn run_on_terminal(command: &mut Command) -> Result<()> {
    Process::spawn(command, false, None)?.finish()
}

/// Runs a command, shows its output, and returns the last `max_kept` lines of
/// it that `keep` chooses.
pub(crate) fn run_and_keep(
    command: &mut Command,
    max_kept: usize,
    keep: impl Fn(&str) -> bool,
) -> Result<(ExitStatus, Vec<String>)> {
    let (reader, writer) = pipe().context("cannot make a pipe")?;
    command.stdout(writer.try_clone().context("cannot share a pipe")?);
    command.stderr(writer);
    let mut process = Process::spawn(command, true, Some(reader))?;
    // The command holds the pipe's writing end, which would never close.
    command.stdout(Stdio::null()).stderr(Stdio::null());

    let mut kept = Vec::new();
    let mut last_output = Instant::now();
    while let Some(lines) = &process.lines {
        fail_if_interrupted()?;
        match lines.recv_timeout(POLL) {
            Ok(line) => {
                println!("{line}");
                last_output = Instant::now();
                if keep(&line) {
                    if kept.len() == max_kept {
                        kept.remove(0);
                    }
                    kept.push(line);
                }
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Err(RecvTimeoutError::Timeout) => {
                if process.exited()?.is_some() && last_output.elapsed() > MAX_OUTPUT_LAG {
                    break;
                }
            }
        }
    }
    Ok((process.wait()?, kept))
}

/// Running child that is ended when dropped.
pub(crate) struct Process {
    name: String,
    child: Child,
    /// Flag for a child that leads its own process group, without the terminal's input.
    own_group: bool,
    lines: Option<Receiver<String>>,
}

impl Process {
    /// Starts a child that inherits this program's output.
    pub(crate) fn start(command: &mut Command) -> Result<Self> {
        Self::spawn(command, true, None)
    }

    /// Starts a child whose standard output is read by [`Self::wait_for_line`].
    pub(crate) fn start_listening(command: &mut Command) -> Result<Self> {
        let (reader, writer) = pipe().context("cannot make a pipe")?;
        command.stdout(writer);
        let process = Self::spawn(command, true, Some(reader));
        command.stdout(Stdio::null());
        process
    }

    fn spawn(command: &mut Command, own_group: bool, output: Option<PipeReader>) -> Result<Self> {
        fail_if_interrupted()?;
        let name = name_of(command);
        println!("$ {}", shown(command));
        if own_group {
            command.stdin(Stdio::null()).process_group(0);
        }
        let child =
            command.spawn().with_context(|| format!("cannot start `{name}`: is it installed?"))?;
        let lines = output.map(|reader| {
            let (sender, receiver) = sync_channel(MAX_PENDING_LINES);
            thread::spawn(move || forward_lines(reader, &sender));
            receiver
        });
        Ok(Self { name, child, own_group, lines })
    }

    /// Returns the process id of the child.
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Waits until the child writes a line that `wanted` accepts.
    pub(crate) fn wait_for_line(
        &mut self,
        timeout: Duration,
        wanted: impl Fn(&str) -> bool,
    ) -> Result<String> {
        let deadline = Instant::now() + timeout;
        // Dropped at the end: later output is read and forgotten.
        let lines = self.lines.take().context("this child's output is not read")?;
        loop {
            fail_if_interrupted()?;
            match lines.recv_timeout(POLL) {
                Ok(line) if wanted(&line) => return Ok(line),
                Ok(_) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    let status = self.wait()?;
                    bail!("`{}` ended ({status}) before it was ready", self.name);
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
            if Instant::now() > deadline {
                bail!("`{}` was not ready after {} s", self.name, timeout.as_secs());
            }
        }
    }

    /// Waits for the end of the child, and requires its success.
    pub(crate) fn finish(mut self) -> Result<()> {
        let status = self.wait()?;
        if !status.success() {
            bail!("`{}` failed ({status}); see its messages above", self.name);
        }
        Ok(())
    }

    fn wait(&mut self) -> Result<ExitStatus> {
        loop {
            if let Some(status) = self.exited()? {
                return Ok(status);
            }
            fail_if_interrupted()?;
            thread::sleep(POLL);
        }
    }

    /// Returns the exit status, if the child has ended.
    fn exited(&mut self) -> Result<Option<ExitStatus>> {
        self.child.try_wait().with_context(|| format!("cannot wait for `{}`", self.name))
    }

    /// Sends a signal to the child's group, which may be gone already.
    fn signal(&self, signal: Signal) {
        let Some(pid) = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw) else {
            return;
        };
        let _ = if self.own_group {
            kill_process_group(pid, signal)
        } else {
            kill_process(pid, signal)
        };
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if !matches!(self.child.try_wait(), Ok(None)) {
            return;
        }
        self.signal(Signal::TERM);
        let deadline = Instant::now() + MAX_END_WAIT;
        while Instant::now() < deadline && matches!(self.child.try_wait(), Ok(None)) {
            thread::sleep(POLL);
        }
        // The child, if it survived the first signal, or its leftovers.
        self.signal(Signal::KILL);
        let _ = self.child.wait();
    }
}

fn forward_lines(reader: PipeReader, sender: &SyncSender<String>) {
    let mut reader = BufReader::new(reader);
    let mut line = Vec::new();
    loop {
        line.clear();
        match (&mut reader).take(MAX_LINE_BYTES).read_until(b'\n', &mut line) {
            Ok(0) | Err(_) => return,
            // With nobody listening any more, read on: a full pipe would stop
            // the child.
            Ok(_) => {
                let _ = sender.send(String::from_utf8_lossy(&line).trim_end().to_owned());
            }
        }
    }
}

fn name_of(command: &Command) -> String {
    let path = std::path::Path::new(command.get_program());
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// Formats the command as one would type it.
fn shown(command: &Command) -> String {
    let mut text = name_of(command);
    for argument in command.get_args() {
        text.push(' ');
        text.push_str(&argument.to_string_lossy());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn a_failure_names_the_command() {
        let error = run(&mut shell("exit 3")).unwrap_err().to_string();
        assert!(error.contains("`sh` failed (exit status: 3)"), "{error}");
    }

    #[test]
    fn a_missing_program_is_an_error() {
        let error = run(&mut Command::new("no-such-program")).unwrap_err();
        assert!(error.to_string().contains("`no-such-program`"), "{error}");
    }

    #[test]
    fn chosen_lines_of_both_streams_are_kept() {
        let script = "echo keep 1; echo other; echo keep 2 >&2; echo keep 3; exit 4";
        let (status, kept) =
            run_and_keep(&mut shell(script), 2, |line| line.starts_with("keep")).unwrap();
        assert_eq!(status.code(), Some(4));
        assert_eq!(kept, ["keep 2", "keep 3"]);
    }

    #[test]
    fn a_child_that_ends_early_is_never_ready() {
        let mut process = Process::start_listening(&mut shell("echo other; exit 1")).unwrap();
        let error =
            process.wait_for_line(Duration::from_secs(10), |line| line == "ready").unwrap_err();
        assert!(error.to_string().contains("before it was ready"), "{error}");
    }

    #[test]
    fn dropping_a_child_ends_its_children_too() {
        let script = "sleep 600 & echo $!; wait";
        let mut process = Process::start_listening(&mut shell(script)).unwrap();
        let line = process.wait_for_line(Duration::from_secs(10), |_| true);
        let grandchild = Pid::from_raw(line.unwrap().parse().unwrap()).unwrap();
        assert!(runs(grandchild));
        drop(process);
        let deadline = Instant::now() + MAX_END_WAIT;
        while runs(grandchild) {
            assert!(Instant::now() < deadline, "the grandchild still runs");
            thread::sleep(POLL);
        }
    }

    /// Reports whether a process is neither gone nor a zombie that waits for its new parent.
    fn runs(pid: Pid) -> bool {
        let stat = format!("/proc/{}/stat", pid.as_raw_nonzero());
        std::fs::read_to_string(stat).is_ok_and(|text| !text.contains(") Z "))
    }

    #[test]
    fn output_after_the_awaited_line_stops_nobody() {
        let script = "echo ready; i=0; while [ $i -lt 20000 ]; do echo line $i; i=$((i+1)); done";
        let mut process = Process::start_listening(&mut shell(script)).unwrap();
        process.wait_for_line(Duration::from_secs(10), |line| line == "ready").unwrap();
        process.finish().unwrap();
    }
}
