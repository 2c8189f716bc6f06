//! Worker process: one method on one mesh, on one core. Memory is the method's own, and a crash or
//! a hang is a result and not the end.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::str::FromStr;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};
use busbar_geometry::{Mesh, Topology, theta_to_cursor};
use measure::meshoptimizer::{Input as PeerInput, Simplifier};
use measure::{level, search, used_alone, vertices_in_use};
use serde::{Deserialize, Serialize};
use weighted_collapse::MAX_THREADS;

use crate::affinity::{OneCore, processor_seconds};
use crate::levels::exchange;
use crate::levels::method::{Implementation, Method};
use crate::memory;
use crate::optimizers::{Input, sequence};

/// Longest time of a call that is repeated, seconds; the fastest counts.
const SHORT_SECONDS: f64 = 1.0;
const RUNS: usize = 3;
/// Greatest number of calls in a search for a number of vertices.
const MAX_CALLS: usize = 6;
/// Greatest number of calls of scripts, some of which take seconds.
const MAX_SCRIPT_CALLS: usize = 2;
/// Longest time of a worker, seconds; then it is ended.
const MAX_SECONDS: u64 = 300;
const POLL: Duration = Duration::from_millis(5);

/// Cost of a method on one core.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Cost {
    /// Seconds of processor time for the level of the first theta alone.
    pub(crate) one_seconds: f64,
    /// Seconds for the levels of all thetas.
    pub(crate) all_seconds: f64,
    /// Greatest growth of resident memory in the first call, bytes.
    pub(crate) peak_bytes: u64,
    /// Errors that each level claims, metres; none from peers.
    #[serde(default)]
    pub(crate) claimed: Vec<f32>,
}

/// Task of a worker process.
#[derive(clap::Args, Clone, Debug)]
pub(crate) struct Task {
    method: String,
    mesh: PathBuf,
    out: PathBuf,
    /// Targets of the levels, as `VERTICES:TRIANGLES`.
    targets: Vec<Target>,
}

/// Target of a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Target {
    /// Number of vertices to reach.
    pub(crate) vertices: usize,
    /// Number of triangles to be expected then.
    pub(crate) triangles: usize,
}

impl FromStr for Target {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> Result<Self> {
        let (vertices, triangles) = text.split_once(':').context("write VERTICES:TRIANGLES")?;
        Ok(Self { vertices: vertices.parse()?, triangles: triangles.parse()? })
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.vertices, self.triangles)
    }
}

/// Python peers: interpreter and folder of scripts.
#[derive(Clone, Debug)]
pub(crate) struct Peers {
    pub(crate) python: PathBuf,
    pub(crate) scripts: PathBuf,
}

/// Starts a worker and reads its levels, one for each target.
pub(crate) fn levels(
    method: Method,
    peers: Option<&Peers>,
    mesh: &Path,
    targets: &[Target],
) -> Result<(Cost, Vec<Topology>)> {
    let out = tempfile::tempdir().context("no folder for levels")?;
    let mut command = match (method.work, peers) {
        (Implementation::Script(script), Some(peers)) => {
            let mut command = Command::new(&peers.python);
            command.arg(peers.scripts.join(script)).arg(mesh).arg(out.path());
            command.arg(MAX_SCRIPT_CALLS.to_string());
            command
        }
        (Implementation::Script(_), None) => bail!("no Python"),
        _ => {
            let mut command = Command::new(std::env::current_exe()?);
            command.arg("worker").arg(method.id).arg(mesh).arg(out.path());
            command
        }
    };
    command.args(targets.iter().map(ToString::to_string));
    let cost = serde_json::from_str(&output(&mut command)?).context("no cost came back")?;
    let file = |index| out.path().join(format!("{index}.mesh"));
    let levels = (0..targets.len()).map(|index| exchange::read_level(&file(index)));
    Ok((cost, levels.collect::<Result<_>>()?))
}

/// Returns the output of a process that ends within [`MAX_SECONDS`].
fn output(command: &mut Command) -> Result<String> {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn()?;
    let started = Instant::now();
    // A line of JSON, and a trace at worst: no pipe fills up.
    while child.try_wait()?.is_none() {
        if started.elapsed().as_secs() >= MAX_SECONDS {
            end(&mut child)?;
            bail!("took more than {MAX_SECONDS} s");
        }
        thread::sleep(POLL);
    }
    let output = child.wait_with_output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    let why = errors.lines().rev().find(|line| !line.trim().is_empty()).unwrap_or("no word");
    ensure!(output.status.success(), "ended with {}: {why}", output.status);
    Ok(String::from_utf8(output.stdout)?)
}

fn end(child: &mut Child) -> Result<()> {
    child.kill()?;
    child.wait()?;
    Ok(())
}

/// Runs a task in the worker process; returns the cost.
pub(crate) fn run(task: &Task) -> Result<Cost> {
    let method = Method::named(&task.method).context("no such method")?;
    let _core = OneCore::hold()?;
    let mesh = exchange::read_mesh(&task.mesh)?;
    let (cost, levels) = match method.work {
        Implementation::Weighted(order) => {
            let input = Input::new(&mesh);
            measure_own(&mesh, &task.targets, || input.weighted(order, MAX_THREADS))?
        }
        Implementation::Quadric => {
            let input = Input::new(&mesh);
            measure_own(&mesh, &task.targets, || input.quadric())?
        }
        Implementation::Meshoptimizer(kind) => measure_peer(&mesh, kind, &task.targets)?,
        Implementation::Script(_) => bail!("{} is no work for this process", method.id),
    };
    for (index, level) in levels.iter().enumerate() {
        exchange::write_level(&task.out.join(format!("{index}.mesh")), level)?;
    }
    Ok(cost)
}

/// Builds a whole sequence, then its levels.
fn measure_own(
    mesh: &Mesh,
    targets: &[Target],
    optimize: impl Fn() -> Result<busbar_plugin_sdk::CollapseList>,
) -> Result<(Cost, Vec<Topology>)> {
    let topology = mesh.topology();
    let count = topology.positions.len();
    let ((mut seconds, list), peak_bytes) = memory::peak(|| timed(&optimize))?;
    for _ in 1..runs(seconds) {
        seconds = seconds.min(timed(&optimize)?.0);
    }
    let sequence = sequence(&list, count)?;
    let (mut levels, mut level_seconds, mut claimed) = (Vec::new(), Vec::new(), Vec::new());
    for target in targets {
        let theta = 1.0 - target.vertices as f64 / count as f64;
        let cursor = theta_to_cursor(theta, count as u32, sequence.len());
        let (taken, triangles) = timed(|| Ok(level(&topology, &sequence, cursor)))?;
        level_seconds.push(taken);
        levels.push(used_alone(&topology, &triangles));
        claimed.push(sequence.entries()[..cursor as usize].last().map_or(0.0, |e| e.error));
    }
    let one_seconds = seconds + level_seconds.first().context("no level is wanted")?;
    let all_seconds = seconds + level_seconds.iter().sum::<f64>();
    Ok((Cost { one_seconds, all_seconds, peak_bytes, claimed }, levels))
}

/// Runs a search and a call for each level.
fn measure_peer(
    mesh: &Mesh,
    kind: Simplifier,
    targets: &[Target],
) -> Result<(Cost, Vec<Topology>)> {
    let topology = mesh.topology();
    let wedges = &mesh.wedges;
    let of_wedges: Vec<_> =
        wedges.position.iter().map(|&p| topology.positions[p as usize]).collect();
    let normals: Vec<[f32; 3]> = wedges.normal.iter().map(|n| n.to_array()).collect();
    let (input, welds) = match kind {
        Simplifier::WithNormals => {
            let normals = normals.as_flattened();
            (PeerInput::with_normals(&mesh.triangles, &of_wedges, normals)?, true)
        }
        Simplifier::Plain | Simplifier::Sloppy => (PeerInput::new(&topology)?, false),
    };
    let welded = |level: Vec<[u32; 3]>| -> Vec<[u32; 3]> {
        if !welds {
            return level;
        }
        let triangles = level.iter().map(|&triangle| mesh.corner_positions(triangle));
        triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect()
    };
    let full = [topology.triangles.len(), vertices_in_use(&topology.triangles)];
    let first = targets.first().context("no level is wanted")?;
    let (_, peak_bytes) = memory::peak(|| input.simplify(kind, first.triangles))?;
    let (mut levels, mut level_seconds) = (Vec::new(), Vec::new());
    for target in targets {
        let guess = Some(target.triangles);
        let triangles = search(full, guess, target.vertices, MAX_CALLS, |triangles| {
            anyhow::Ok(vertices_in_use(&welded(input.simplify(kind, triangles)?)))
        })?;
        let (mut seconds, level) = timed(|| input.simplify(kind, triangles))?;
        for _ in 1..runs(seconds) {
            seconds = seconds.min(timed(|| input.simplify(kind, triangles))?.0);
        }
        level_seconds.push(seconds);
        levels.push(used_alone(&topology, &welded(level)));
    }
    let all_seconds = level_seconds.iter().sum();
    let one_seconds = level_seconds[0];
    Ok((Cost { one_seconds, all_seconds, peak_bytes, claimed: Vec::new() }, levels))
}

fn runs(seconds: f64) -> usize {
    if seconds < SHORT_SECONDS { RUNS } else { 1 }
}

/// Runs work; returns its result and its seconds of processor time.
fn timed<T>(work: impl FnOnce() -> Result<T>) -> Result<(f64, T)> {
    let start = processor_seconds();
    let result = work()?;
    Ok((processor_seconds() - start, result))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_process_that_fails_says_why() {
        let mut command = Command::new("sh");
        command.args(["-c", "echo first >&2; echo why >&2; exit 3"]);
        let error = output(&mut command).unwrap_err().to_string();
        assert!(error.contains("why") && error.contains('3'), "{error}");
        let mut command = Command::new("echo");
        assert_eq!(output(command.arg("done")).unwrap(), "done\n");
    }

    #[test]
    fn every_method_of_this_process_makes_its_levels() {
        let mesh = demo_model::breaker_pole().unwrap().meshes.swap_remove(0);
        let count = mesh.positions.len();
        let target = |vertices| Target { vertices, triangles: vertices * 2 };
        let targets = [target(count / 2), target(count / 4)];
        assert_eq!(targets[0].to_string().parse::<Target>().unwrap(), targets[0]);
        let (cost, levels) = measure_peer(&mesh, Simplifier::Plain, &targets).unwrap();
        assert!(cost.one_seconds > 0.0 && cost.all_seconds > cost.one_seconds);
        assert!(levels[0].positions.len() > levels[1].positions.len());
        // Hard edges stop it, but nothing is torn.
        let (_, levels) = measure_peer(&mesh, Simplifier::WithNormals, &targets).unwrap();
        assert!(levels.iter().all(|level| (count / 4..=count).contains(&level.positions.len())));
        let input = Input::new(&mesh);
        let (cost, levels) = measure_own(&mesh, &targets, || input.quadric()).unwrap();
        assert!(cost.one_seconds > 0.0 && cost.all_seconds > cost.one_seconds);
        for (level, target) in levels.iter().zip(targets) {
            let found = level.positions.len();
            assert!(found <= target.vertices && found > target.vertices * 8 / 10, "{found}");
        }
    }
}
