//! Armed fault in a file beside the library, for one process.
//!
//! A test arms a fault by writing a [`Fault`] as JSON to [`armed_fault_path`] of the library.
//! The first call that it is meant for takes the file away, leaves the time in
//! [`fault_time_path`], and misbehaves, as do the later calls in that process. The next process
//! finds nothing: a restarted plugin behaves again. A fault can occur before settings arrive.

use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, PoisonError, RwLock};
use std::time::{SystemTime, UNIX_EPOCH};

use crate::fault::{CallSite, Fault};

/// Stem of this library's file name.
pub const LIBRARY_STEM: &str = "libfault_injector";
/// Id of the plugin in a library whose file name has no suffix.
pub const PLUGIN_ID: &str = "fault_injector";

/// File of this library, as the loader mapped it.
static LIBRARY: LazyLock<Option<PathBuf>> = LazyLock::new(|| {
    let maps = fs::read_to_string("/proc/self/maps").ok()?;
    let paths = maps.lines().filter_map(|line| line.find('/').map(|start| &line[start..]));
    paths.map(Path::new).find(|path| suffix_of(path).is_some()).map(Path::to_owned)
});
/// Fault that was taken last in this process.
static TAKEN: RwLock<Option<Fault>> = RwLock::new(None);

/// Returns the path of a library's armed fault.
pub fn armed_fault_path(library: &Path) -> PathBuf {
    beside(library, ".fault")
}

/// Returns the path at which a fault leaves the time of its occurrence: nanoseconds since 1970.
pub fn fault_time_path(library: &Path) -> PathBuf {
    beside(library, ".struck")
}

/// Returns the id of the plugin in a copy of this library: `fault_injector_7` in
/// `libfault_injector_7.so`, so that one scene can have many.
pub(crate) fn plugin_id() -> &'static str {
    static ID: LazyLock<String> = LazyLock::new(|| {
        let suffix = LIBRARY.as_deref().and_then(suffix_of).unwrap_or_default();
        format!("{PLUGIN_ID}{suffix}")
    });
    &ID
}

/// Returns this process's fault at a call site, if there is one.
pub(crate) fn fault_at(at: CallSite) -> Option<Fault> {
    if let Some(taken) = take(at) {
        *TAKEN.write().unwrap_or_else(PoisonError::into_inner) = Some(taken);
    }
    TAKEN.read().unwrap_or_else(PoisonError::into_inner).filter(|lit| lit.at == at)
}

/// Takes the armed fault, if it is meant for this call.
fn take(at: CallSite) -> Option<Fault> {
    let library = LIBRARY.as_deref()?;
    let (armed, struck) = (armed_fault_path(library), fault_time_path(library));
    let fault: Fault = serde_json::from_slice(&fs::read(&armed).ok()?).ok()?;
    if fault.at != at {
        return None;
    }
    let now = SystemTime::now().duration_since(UNIX_EPOCH).ok()?.as_nanos();
    // Of two processes, or threads, one takes it.
    fs::rename(&armed, &struck).ok()?;
    fs::write(&struck, now.to_string()).ok()?;
    Some(fault)
}

/// Returns the part of the file name between the stem and `.so`.
fn suffix_of(library: &Path) -> Option<&str> {
    library.file_name()?.to_str()?.strip_prefix(LIBRARY_STEM)?.strip_suffix(".so")
}

fn beside(library: &Path, suffix: &str) -> PathBuf {
    let mut path = OsString::from(library);
    path.push(suffix);
    path.into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_is_known_by_its_file() {
        assert_eq!(suffix_of(Path::new("/p/libfault_injector_07.so")), Some("_07"));
        assert_eq!(suffix_of(Path::new("/p/libfault_injector.so")), Some(""));
        assert_eq!(suffix_of(Path::new("/p/libfault_injector.so.fault")), None);
        assert_eq!(suffix_of(Path::new("/p/libother.so")), None);
        assert_eq!(armed_fault_path(Path::new("/p/liba.so")), Path::new("/p/liba.so.fault"));
    }
}
