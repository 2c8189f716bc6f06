//! Peak memory of a call by the process's resident set, whoever allocates it.

use std::fs;

use anyhow::{Context, Result};

const STATUS: &str = "/proc/self/status";

/// Runs work; returns the greatest growth of the process's resident memory meanwhile, bytes
/// (proc(5), `VmHWM`).
pub(crate) fn peak<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, u64)> {
    // The peak is that from here on.
    fs::write("/proc/self/clear_refs", "5").context("cannot reset the peak of memory")?;
    let before = resident("VmRSS")?;
    let result = work()?;
    Ok((result, resident("VmHWM")?.saturating_sub(before)))
}

/// Reads a figure of the process's memory, bytes.
fn resident(field: &str) -> Result<u64> {
    let status = fs::read_to_string(STATUS).with_context(|| format!("cannot read {STATUS}"))?;
    let line = status.lines().find_map(|line| line.strip_prefix(field)?.strip_prefix(':'));
    let kib = line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<u64>().ok());
    Ok(kib.with_context(|| format!("{STATUS} has no {field}"))? * 1024)
}

#[cfg(test)]
mod tests {
    use std::hint::black_box;

    use super::*;

    #[test]
    fn a_buffer_counts_though_it_is_gone_again() {
        const BYTES: u64 = 64 << 20;
        let fill = || Ok(black_box(vec![1_u8; BYTES as usize]).len());
        let (len, bytes) = peak(fill).unwrap();
        assert_eq!(len as u64, BYTES);
        // Other tests' threads come and go.
        assert!((BYTES * 9 / 10..BYTES * 3).contains(&bytes), "{bytes}");
    }
}
