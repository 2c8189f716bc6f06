//! Return of freed memory to the system, by a function of the program's allocator.

use std::sync::OnceLock;

/// Function that returns free memory to the system, where the program has one.
static RELEASE: OnceLock<fn()> = OnceLock::new();

/// Sets the function that returns free memory of the process's heap to the system. It is called
/// when a scene was loaded or dropped, and may take milliseconds. The first one set stays.
pub fn set_memory_release(release: fn()) {
    RELEASE.get_or_init(|| release);
}

/// Returns free memory to the system, if the program said how.
pub(crate) fn release_freed_memory() {
    if let Some(release) = RELEASE.get() {
        release();
    }
}
