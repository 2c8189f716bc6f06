//! Child processes with a deadline, whose output and peak memory are kept.

use std::io::{Read, Write};
use std::process::{ChildStdin, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use wait4::Wait4;

use crate::wait_for;

/// Longest run of a program, loaded machines included.
pub const MAX_RUN: Duration = Duration::from_secs(60);
/// Longest time from the start of a server until it says that it is ready.
pub const MAX_START: Duration = Duration::from_secs(20);
/// Greatest output kept of each stream, bytes; more is a failure.
const MAX_OUTPUT_BYTES: u64 = 4 << 20;
/// Number of output bytes read at once.
const CHUNK_BYTES: usize = 4096;

/// Result of a finished program.
#[derive(Debug)]
pub struct Output {
    /// Exit code; `None` if a signal ended the program.
    pub code: Option<i32>,
    /// Text of standard output.
    pub stdout: String,
    /// Text of standard error.
    pub stderr: String,
    /// Time from the program's start to its end.
    pub elapsed: Duration,
    /// Peak resident memory, bytes.
    pub peak_bytes: u64,
}

impl Output {
    /// Asserts the exit code.
    ///
    /// # Panics
    /// When it is another, with all output.
    #[track_caller]
    pub fn expect_code(self, code: i32) -> Self {
        let Self { stdout, stderr, .. } = &self;
        assert_eq!(self.code, Some(code), "exit code; it said:\n{stdout}{stderr}");
        self
    }
}

/// Running program that is killed when dropped.
pub struct Process {
    pid: Pid,
    stdin: Option<ChildStdin>,
    streams: [Stream; 2],
    started: Instant,
    ended: Receiver<(ExitStatus, u64, Duration)>,
    has_ended: bool,
}

/// Output stream that a thread gathers.
struct Stream {
    text: Arc<Mutex<Vec<u8>>>,
    reader: Option<JoinHandle<()>>,
}

/// Runs a program to its end.
///
/// # Panics
/// When it does not start or does not end within [`MAX_RUN`].
pub fn finish(command: &mut Command) -> Output {
    Process::start(command).finish()
}

impl Process {
    /// Starts a program with piped streams.
    ///
    /// # Panics
    /// When it cannot be started.
    pub fn start(command: &mut Command) -> Self {
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let started = Instant::now();
        let spawned = command.spawn();
        let mut child = spawned.unwrap_or_else(|error| panic!("{command:?}: {error}"));
        let stdin = child.stdin.take();
        let streams = [
            Stream::read(child.stdout.take().expect("it is piped")),
            Stream::read(child.stderr.take().expect("it is piped")),
        ];
        let pid = Pid::from_child(&child);
        let (sender, ended) = channel();
        thread::spawn(move || {
            let used = child.wait4().expect("a child can be waited for");
            // Nobody listens any more where the process was dropped.
            let _ = sender.send((used.status, used.rusage.maxrss, started.elapsed()));
        });
        Self { pid, stdin, streams, started, ended, has_ended: false }
    }

    /// Waits for a whole line of standard output for which `wanted` returns a value.
    ///
    /// # Panics
    /// When none comes within [`MAX_START`].
    pub fn wait_for_line<T>(&self, mut wanted: impl FnMut(&str) -> Option<T>) -> T {
        let mut seen = 0;
        wait_for("a line of output", MAX_START, || {
            // Asked first: what it said before its end is then complete.
            let is_over = self.is_over();
            let text = self.streams[0].so_far();
            let lines = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
            let new: Vec<_> = lines.skip(seen).collect();
            seen += new.len();
            let found = new.into_iter().find_map(|line| wanted(line.trim_end()));
            let said = self.streams[1].so_far();
            assert!(found.is_some() || !is_over, "it ended early:\n{text}{said}");
            found
        })
    }

    /// Writes a line to the program's standard input.
    ///
    /// # Panics
    /// When the program does not read it.
    pub fn write_line(&mut self, line: &str) {
        let stdin = self.stdin.as_mut().expect("it is piped");
        writeln!(stdin, "{line}").expect("it reads its input");
    }

    /// Returns the process id.
    pub fn id(&self) -> u32 {
        self.pid.as_raw_pid() as u32
    }

    /// Sends a signal to the process.
    pub fn signal(&self, signal: Signal) {
        // One that has ended needs none.
        let _ = kill_process(self.pid, signal);
    }

    /// Reports whether the process has closed its output, as at its end.
    pub fn is_over(&self) -> bool {
        self.streams.iter().all(|s| s.reader.as_ref().is_none_or(JoinHandle::is_finished))
    }

    /// Waits for the end of the program.
    ///
    /// # Panics
    /// When it does not end within [`MAX_RUN`] from its start, or writes too much.
    pub fn finish(self) -> Output {
        self.finish_within(MAX_RUN)
    }

    /// Waits for the end of the program, which may run for so long since its start.
    ///
    /// # Panics
    /// When it does not end, or says more than is kept.
    pub fn finish_within(mut self, limit: Duration) -> Output {
        let left = limit.saturating_sub(self.started.elapsed());
        let (status, peak_bytes, elapsed) = match self.ended.recv_timeout(left) {
            Ok(ended) => ended,
            Err(RecvTimeoutError::Timeout) => {
                let [stdout, stderr] = self.streams.each_ref().map(Stream::so_far);
                panic!("it did not end within {limit:?}; it said:\n{stdout}{stderr}")
            }
            Err(RecvTimeoutError::Disconnected) => panic!("the waiting thread panicked"),
        };
        self.has_ended = true;
        let [stdout, stderr] = self.streams.each_mut().map(Stream::whole);
        // A chunk that does not fit is dropped, so what is near the limit may be cut.
        let fits = |text: &String| text.len() + CHUNK_BYTES < MAX_OUTPUT_BYTES as usize;
        assert!(fits(&stdout) && fits(&stderr), "it said more than {MAX_OUTPUT_BYTES} bytes");
        Output { code: status.code(), stdout, stderr, elapsed, peak_bytes }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        if !self.has_ended && self.ended.try_recv().is_err() {
            self.signal(Signal::KILL);
            let _ = self.ended.recv_timeout(MAX_RUN);
        }
    }
}

impl Stream {
    fn read(mut stream: impl Read + Send + 'static) -> Self {
        let text = Arc::new(Mutex::new(Vec::new()));
        let gathered = text.clone();
        let reader = thread::spawn(move || {
            let mut buffer = [0; CHUNK_BYTES];
            while let Ok(count @ 1..) = stream.read(&mut buffer) {
                let mut gathered = gathered.lock().unwrap_or_else(PoisonError::into_inner);
                if (gathered.len() + count) as u64 <= MAX_OUTPUT_BYTES {
                    gathered.extend_from_slice(&buffer[..count]);
                }
            }
        });
        Self { text, reader: Some(reader) }
    }

    fn so_far(&self) -> String {
        let text = self.text.lock().unwrap_or_else(PoisonError::into_inner);
        String::from_utf8_lossy(&text).into_owned()
    }

    fn whole(&mut self) -> String {
        if let Some(reader) = self.reader.take() {
            reader.join().expect("reading output does not panic");
        }
        self.so_far()
    }
}
