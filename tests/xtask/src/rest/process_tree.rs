//! Processor time, wake-ups and writes of a process and all its descendants, by `/proc`.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use serde::Serialize;

/// Rate of the kernel's clock ticks, a second, as it shows them to programs (proc(5)).
const TICKS_PER_SECOND: f64 = 100.0;

/// Counters of the processes below one, at an instant.
pub(super) struct ProcessTree(BTreeMap<u32, Counters>);

/// Counters of one process since its start.
#[derive(Clone, Debug, Default)]
struct Counters {
    name: String,
    cpu_seconds: f64,
    /// Times that a thread gave the processor up to wait.
    wakeups: u64,
    written_bytes: u64,
}

/// Usage of a process and its descendants over a period.
#[derive(Debug, Serialize)]
pub(super) struct TreeUsage {
    /// Processor time, percent of one core.
    pub(super) cpu_percent: f64,
    /// Times a second that any thread was woken.
    pub(super) wakeups_per_second: f64,
    /// Bytes that were written to disks.
    pub(super) written_bytes: u64,
    /// Parts of it, the greatest first.
    pub(super) processes: Vec<ProcessUsage>,
}

/// Usage of one process over a period.
#[derive(Debug, Serialize)]
pub(super) struct ProcessUsage {
    /// Arguments that tell it from others.
    pub(super) name: String,
    /// Processor time, percent of one core.
    pub(super) cpu_percent: f64,
    /// Times a second that any thread was woken.
    pub(super) wakeups_per_second: f64,
}

impl ProcessTree {
    /// Reads the counters of a process and its descendants.
    ///
    /// # Errors
    /// The process is not there.
    pub(super) fn read(root: u32) -> Result<Self> {
        let mut parents = BTreeMap::new();
        for entry in fs::read_dir("/proc").context("cannot list processes")? {
            let path = entry?.path();
            let id = path.file_name().and_then(|name| name.to_str()?.parse::<u32>().ok());
            // One that has ended meanwhile counts no more.
            if let Some((id, fields)) = id.zip(stat_fields(&path))
                && let Some(parent) = fields.get(1).and_then(|field| field.parse::<u32>().ok())
            {
                parents.insert(id, parent);
            }
        }
        let mut found = BTreeSet::from([root]);
        loop {
            let more = parents.iter().filter(|(_, parent)| found.contains(parent));
            let count = found.len();
            found.extend(more.map(|(&id, _)| id).collect::<Vec<_>>());
            if found.len() == count {
                break;
            }
        }
        let counters =
            |id: u32| Some((id, Counters::read(&Path::new("/proc").join(id.to_string()))?));
        let all: BTreeMap<u32, Counters> = found.into_iter().filter_map(counters).collect();
        all.contains_key(&root).then_some(Self(all)).context("the viewer has ended")
    }

    /// Returns the usage since an earlier reading. A process that came since counts from its start.
    pub(super) fn usage_since(&self, before: &Self, elapsed: Duration) -> TreeUsage {
        let seconds = elapsed.as_secs_f64();
        let mut written_bytes = 0;
        let mut processes = Vec::new();
        for (id, now) in &self.0 {
            let then = before.0.get(id).cloned().unwrap_or_default();
            written_bytes += now.written_bytes.saturating_sub(then.written_bytes);
            processes.push(ProcessUsage {
                name: now.name.clone(),
                cpu_percent: (now.cpu_seconds - then.cpu_seconds) / seconds * 100.0,
                wakeups_per_second: now.wakeups.saturating_sub(then.wakeups) as f64 / seconds,
            });
        }
        processes.sort_by(|a, b| b.cpu_percent.total_cmp(&a.cpu_percent));
        TreeUsage {
            cpu_percent: processes.iter().map(|process| process.cpu_percent).sum(),
            wakeups_per_second: processes.iter().map(|process| process.wakeups_per_second).sum(),
            written_bytes,
            processes,
        }
    }
}

impl Counters {
    /// Reads the counters of the process in a folder of `/proc`; none once it has ended.
    fn read(folder: &Path) -> Option<Self> {
        let fields = stat_fields(folder)?;
        let ticks = |index: usize| fields.get(index)?.parse::<f64>().ok();
        // utime and stime are fields 14 and 15; these begin with the third.
        let cpu_seconds = (ticks(11)? + ticks(12)?) / TICKS_PER_SECOND;
        let threads = fs::read_dir(folder.join("task")).ok()?.flatten();
        let wakeups = threads
            .filter_map(|thread| {
                number_in(&thread.path().join("status"), "voluntary_ctxt_switches:")
            })
            .sum();
        let written_bytes = number_in(&folder.join("io"), "write_bytes:").unwrap_or(0);
        Some(Self { name: name_of(folder), cpu_seconds, wakeups, written_bytes })
    }
}

/// Returns the subcommand of a process, and the name of its plugin.
fn name_of(folder: &Path) -> String {
    let line = fs::read(folder.join("cmdline")).unwrap_or_default();
    let words: Vec<String> = line
        .split(|byte| *byte == 0)
        .map(|word| String::from_utf8_lossy(word).into_owned())
        .filter(|word| !word.is_empty())
        .collect();
    let mut library = words.iter().filter_map(|word| {
        let name = Path::new(word).file_name()?.to_str()?.strip_prefix("lib")?;
        name.strip_suffix(".so").map(str::to_owned)
    });
    let name = library.next_back().or_else(|| words.get(1).cloned());
    name.unwrap_or_else(|| "?".to_owned())
}

/// Returns the fields of `stat` from the third on; the second may hold spaces.
fn stat_fields(folder: &Path) -> Option<Vec<String>> {
    let text = fs::read_to_string(folder.join("stat")).ok()?;
    let (_, rest) = text.rsplit_once(')')?;
    Some(rest.split_whitespace().map(str::to_owned).collect())
}

/// Returns the number behind a name at the start of a line.
fn number_in(file: &Path, name: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use std::process::Command;
    use std::time::Instant;

    use super::*;

    #[test]
    fn a_busy_child_counts_and_an_idle_one_does_not() {
        let start = |script: &str| {
            Command::new("sh").args(["-c", script]).spawn().expect("there is a shell")
        };
        let mut busy = start("while :; do :; done");
        let mut idle = start("sleep 60");
        let (before, begun) = (ProcessTree::read(std::process::id()).unwrap(), Instant::now());
        std::thread::sleep(Duration::from_millis(500));
        let usage =
            ProcessTree::read(std::process::id()).unwrap().usage_since(&before, begun.elapsed());
        for child in [&mut busy, &mut idle] {
            child.kill().unwrap();
            child.wait().unwrap();
        }
        let most = usage.processes.first().expect("there are some");
        assert!(most.cpu_percent > 5.0 && most.cpu_percent < 150.0, "{usage:?}");
        assert!(usage.cpu_percent >= most.cpu_percent);
        assert!(usage.processes.len() >= 3 && usage.processes.last().unwrap().cpu_percent < 5.0);
        assert!(ProcessTree::read(u32::MAX).is_err(), "no such process");
    }
}
