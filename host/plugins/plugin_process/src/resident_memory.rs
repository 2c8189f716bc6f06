//! Resident memory of a process, read from `/proc`.

use std::fs::File;
use std::io::Read;

/// The most that is read of one file there.
const MAX_BYTES: u64 = 8192;

/// Memory that a process has in RAM, bytes.
pub(crate) fn resident_bytes(pid: u32) -> Option<u64> {
    let mut text = String::new();
    let file = File::open(format!("/proc/{pid}/status")).ok()?;
    file.take(MAX_BYTES).read_to_string(&mut text).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_has_memory() {
        assert!(resident_bytes(std::process::id()).is_some_and(|bytes| bytes > 100_000));
        assert_eq!(resident_bytes(u32::MAX), None);
    }
}
