//! Peer in Python that answers each line with one line.

use std::io::{BufRead, BufReader, Lines, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use anyhow::{Context, Result, bail};
use serde_json::Value;

/// Running peer that is ended when dropped.
pub(crate) struct Peer {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
    /// Text of the peer after `READY`.
    pub(crate) greeting: String,
}

impl Peer {
    pub(crate) fn start(python: &Path, script: &Path, arguments: &[String]) -> Result<Self> {
        let mut command = Command::new(python);
        command.arg(script).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut child = command.spawn().with_context(|| {
            format!("cannot start {}: was the environment made?", python.display())
        })?;
        let stdout = child.stdout.take().context("it has no output")?;
        let lines = BufReader::new(stdout).lines();
        let mut peer = Self { child, lines, greeting: String::new() };
        let first = peer.line()?;
        match first.strip_prefix("READY") {
            Some(rest) => peer.greeting = rest.trim().to_owned(),
            None => bail!("{} did not start: it said '{first}'", script.display()),
        }
        Ok(peer)
    }

    /// Sends a question and waits for its answer.
    pub(crate) fn ask(&mut self, question: &Value) -> Result<Value> {
        let stdin = self.child.stdin.as_mut().context("it has no input")?;
        writeln!(stdin, "{question}")?;
        let line = self.line()?;
        serde_json::from_str(&line).with_context(|| format!("it answered '{line}'"))
    }

    fn line(&mut self) -> Result<String> {
        Ok(self.lines.next().context("the peer has ended; see its messages above")??)
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // One that has ended needs no end.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns a number of an answer.
pub(crate) fn number(answer: &Value, name: &str) -> Result<f64> {
    answer[name].as_f64().with_context(|| format!("no {name} in {answer}"))
}
