//! Renderer in a process of its own on one core: Busbar or a peer.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use crate::camera::Camera;
use crate::render_protocol::{RenderReply, RenderRequest};

/// Size of all pictures, pixels.
pub(crate) const SIZE: [u32; 2] = [1280, 720];

/// Longest time for loading, or for a round of frames.
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Greatest number of log lines in an error message.
const MAX_LOG_LINES: usize = 4;

/// Command line of a renderer.
#[derive(Clone, Debug)]
pub(crate) struct RendererCommand {
    /// Name in the tables.
    pub(crate) name: &'static str,
    program: PathBuf,
    arguments: Vec<String>,
}

/// Running process of a renderer.
pub(crate) struct RendererProcess {
    pub(crate) name: &'static str,
    child: Child,
    requests: ChildStdin,
    replies: Receiver<String>,
    /// Log of the renderer's standard error.
    log: File,
}

/// Name of Busbar among the renderers.
pub(crate) const OURS: &str = "busbar";

/// Returns the commands of Busbar and of all installed peers.
pub(crate) fn renderers(python: Option<&Path>, scripts: &Path) -> Result<Vec<RendererCommand>> {
    let ours = RendererCommand {
        name: OURS,
        program: std::env::current_exe()?,
        arguments: vec!["worker".into()],
    };
    let mut renderers = vec![ours];
    let Some(python) = python else { return Ok(renderers) };
    let peers: [(&str, &str, &[&str]); 4] = [
        ("VTK, one mesh", "render_vtk.py", &["merged"]),
        ("VTK, its importer", "render_vtk.py", &[]),
        ("F3D", "render_f3d.py", &[]),
        ("Open3D", "render_open3d.py", &[]),
    ];
    renderers.extend(peers.map(|(name, script, more)| {
        let script = scripts.join(script).to_string_lossy().into_owned();
        let more = more.iter().map(ToString::to_string);
        RendererCommand {
            name,
            program: python.into(),
            arguments: [script].into_iter().chain(more).collect(),
        }
    }));
    Ok(renderers)
}

impl RendererProcess {
    /// Starts the renderer on a core and loads a scene.
    pub(crate) fn start(
        renderer: &RendererCommand,
        core: &str,
        path: &Path,
        samples: u32,
    ) -> Result<Self> {
        let log = tempfile::tempfile()?;
        let mut child = Command::new("taskset")
            .args(["--cpu-list", core])
            .arg(&renderer.program)
            .args(&renderer.arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(log.try_clone()?)
            .spawn()
            .with_context(|| format!("cannot start {}", renderer.name))?;
        let requests = child.stdin.take().context("no way in")?;
        let lines = BufReader::new(child.stdout.take().context("no way out")?).lines();
        let (hand_on, replies) = channel();
        // Ends with the process, or with whoever asks.
        thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| hand_on.send(line)));
        let mut process = Self { name: renderer.name, child, requests, replies, log };
        process.request(&RenderRequest::Load { path: path.to_owned(), size: SIZE, samples })?;
        Ok(process)
    }

    /// Draws a frame from each camera.
    pub(crate) fn frames(&mut self, cameras: &[Camera]) -> Result<RenderReply> {
        let answer = self.request(&RenderRequest::Frames { cameras: cameras.to_vec() })?;
        ensure!(answer.millis.len() == cameras.len(), "{} drew too few frames", self.name);
        Ok(answer)
    }

    /// Draws one picture and writes it.
    pub(crate) fn picture(&mut self, camera: Camera, path: &Path) -> Result<()> {
        self.request(&RenderRequest::Picture { camera, path: path.to_owned() })?;
        ensure!(path.exists(), "{} wrote no {}", self.name, path.display());
        Ok(())
    }

    /// Returns the peak resident memory of the process so far, bytes (proc(5), `VmHWM`).
    pub(crate) fn peak_bytes(&self) -> Result<u64> {
        peak_bytes(self.child.id())
    }

    fn request(&mut self, wanted: &RenderRequest) -> Result<RenderReply> {
        let mut line = serde_json::to_string(wanted)?;
        line.push('\n');
        self.requests.write_all(line.as_bytes())?;
        let Ok(answer) = self.replies.recv_timeout(MAX_WAIT) else {
            let why = self.last_log_lines()?;
            bail!("{} did not answer within {MAX_WAIT:?} to {wanted:?}; it said: {why}", self.name);
        };
        Ok(serde_json::from_str(&answer)?)
    }

    fn last_log_lines(&mut self) -> Result<String> {
        let mut said = Vec::new();
        self.log.rewind()?;
        self.log.read_to_end(&mut said)?;
        let said = String::from_utf8_lossy(&said);
        let last: Vec<&str> = said.lines().rev().take(MAX_LOG_LINES).collect();
        Ok(last.into_iter().rev().collect::<Vec<_>>().join("; "))
    }
}

impl Drop for RendererProcess {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Returns the peak resident memory of a process so far, bytes.
pub(crate) fn peak_bytes(process: u32) -> Result<u64> {
    let status = fs::read_to_string(format!("/proc/{process}/status"))?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok());
    Ok(kib.context("the system tells no peak")? * 1024)
}
