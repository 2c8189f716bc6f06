//! Resource usage of a process, by `/proc`.

use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::Serialize;

/// Rate of the kernel's clock ticks, a second, as it shows them to programs (proc(5)).
const TICKS_PER_SECOND: f64 = 100.0;

/// Resource usage of a process over a period.
#[derive(Clone, Copy, Debug, Serialize)]
pub(crate) struct Usage {
    /// Processor time as a share of one core.
    pub(crate) cores: f64,
    /// Resident memory, and its peak, MiB.
    pub(crate) mib: f64,
    pub(crate) peak_mib: f64,
}

/// Returns the processor time of a process so far, seconds.
pub(crate) fn cpu_seconds(process: u32) -> Result<f64> {
    let fields = stat(process)?;
    let ticks = |index: usize| fields.get(index).and_then(|field| field.parse::<f64>().ok());
    // utime and stime are fields 14 and 15; these begin with the third.
    let (user, system) = ticks(11).zip(ticks(12)).context("stat lacks its times")?;
    Ok((user + system) / TICKS_PER_SECOND)
}

/// Measures the usage of a process over `seconds`, since it had used `before` seconds of CPU.
pub(crate) fn usage(process: u32, before: f64, seconds: f64) -> Result<Usage> {
    let cores = (cpu_seconds(process)? - before) / seconds;
    let status = fs::read_to_string(format!("/proc/{process}/status"))?;
    let mib = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        let kib = line.and_then(|line| line.split_whitespace().next()?.parse::<f64>().ok());
        Some(kib? / 1024.0)
    };
    let (now, peak) = mib("VmRSS:").zip(mib("VmHWM:")).context("status lacks its sizes")?;
    Ok(Usage { cores, mib: now, peak_mib: peak })
}

/// Finds the child of this process that runs a plugin.
pub(crate) fn plugin_process() -> Result<u32> {
    let own = std::process::id().to_string();
    for entry in fs::read_dir("/proc")? {
        let path = entry?.path();
        let Some(id) = id_of(&path) else { continue };
        let is_child = stat(id).is_ok_and(|fields| fields.get(1) == Some(&own));
        let line = fs::read_to_string(path.join("cmdline")).unwrap_or_default();
        if is_child && line.contains("plugin-host") {
            return Ok(id);
        }
    }
    anyhow::bail!("the plugin has no process")
}

fn id_of(path: &Path) -> Option<u32> {
    path.file_name()?.to_str()?.parse().ok()
}

/// Returns the fields of `stat` from the third on; the second may hold spaces.
fn stat(process: u32) -> Result<Vec<String>> {
    let text = fs::read_to_string(format!("/proc/{process}/stat"))?;
    let (_, rest) = text.rsplit_once(')').context("stat has no name")?;
    Ok(rest.split_whitespace().map(str::to_owned).collect())
}
