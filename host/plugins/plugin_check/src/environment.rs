//! Environment of a case's process: its limits, and what a plugin leaves behind in it.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use rustix::process::{Resource, Rlimit, Signal, set_parent_process_death_signal, setrlimit};

/// Address space of a case's process.
const MAX_MEMORY_BYTES: u64 = 4 << 30;
/// Descriptors of a case's process.
const MAX_DESCRIPTORS: u64 = 512;
/// Bytes of a file that it may write, its own output included.
const MAX_FILE_BYTES: u64 = 16 << 20;
/// Descriptors that are opened only to see whether they stay open.
const SENTINELS: usize = 16;
/// Longest wait for threads and descriptors that are closing.
const MAX_SETTLE: Duration = Duration::from_secs(2);
/// Interval between two polls.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// Limits the resources that a plugin can take from the machine.
pub(crate) fn limit_resources() {
    // A checker that is interrupted leaves no plugin that hangs. Where this cannot be
    // set, the time limit of the case still holds while the checker lives.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    for (resource, most) in [
        (Resource::As, MAX_MEMORY_BYTES),
        (Resource::Nofile, MAX_DESCRIPTORS),
        (Resource::Fsize, MAX_FILE_BYTES),
        (Resource::Core, 0),
    ] {
        // A limit that cannot be set is one that was lower already.
        let _ = setrlimit(resource, Rlimit { current: Some(most), maximum: Some(most) });
    }
}

/// Descriptors of our own that a plugin has no business with.
pub(crate) struct Sentinels(Vec<std::fs::File>);

impl Sentinels {
    pub(crate) fn open() -> Self {
        let open = |_| std::fs::File::open("/dev/null").ok();
        Self((0..SENTINELS).filter_map(open).collect())
    }

    /// Returns the number of sentinel descriptors that were closed or replaced.
    pub(crate) fn lost(&self) -> usize {
        let is_null = |file: &&std::fs::File| {
            rustix::fs::fstat(file).is_ok_and(|stat| {
                rustix::fs::stat("/dev/null")
                    .is_ok_and(|null| (stat.st_dev, stat.st_ino) == (null.st_dev, null.st_ino))
            })
        };
        self.0.len() - self.0.iter().filter(is_null).count()
    }

    /// Releases them without closing: a lost descriptor may belong to another by now.
    pub(crate) fn forget(self) {
        self.0.into_iter().for_each(std::mem::forget);
    }
}

/// Names of the threads of this process, by id.
pub(crate) fn threads() -> BTreeSet<u32> {
    let entries = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok()).collect()
}

/// Returns the name of a thread.
pub(crate) fn thread_name(id: u32) -> String {
    let name = std::fs::read_to_string(format!("/proc/self/task/{id}/comm"));
    name.map_or_else(|_| id.to_string(), |name| name.trim().to_owned())
}

/// Number of open descriptors.
pub(crate) fn descriptors() -> usize {
    std::fs::read_dir("/proc/self/fd").map_or(0, Iterator::count)
}

/// Bytes that the C library's heap has handed out, to this whole process.
pub fn heap_bytes() -> usize {
    // SAFETY: it only reads the allocator's own counts.
    let info = unsafe { libc::mallinfo2() };
    info.uordblks + info.hblkhd
}

/// Bytes of this process in RAM.
pub(crate) fn resident_bytes() -> usize {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    let pages = text.split_whitespace().nth(1).and_then(|pages| pages.parse().ok());
    pages.unwrap_or(0_usize) * rustix::param::page_size()
}

/// Polls until `settled` returns true, or time is up.
pub(crate) fn settle(settled: impl Fn() -> bool) -> bool {
    let start = Instant::now();
    loop {
        if settled() {
            return true;
        }
        if start.elapsed() > MAX_SETTLE {
            return false;
        }
        std::thread::sleep(LOOK_PERIOD);
    }
}
