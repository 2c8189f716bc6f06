//! Memory that two processes share.

use std::fs::File;
use std::io;

use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, memfd_create};

/// Memory whose size is still open.
///
/// # Errors
/// The kernel's.
pub fn create(name: &str) -> io::Result<File> {
    Ok(memfd_create(name, MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?.into())
}

/// Zeroed memory whose size nobody can change: whoever cut it short would end all who
/// have it mapped.
///
/// # Errors
/// The kernel's.
pub fn zeroed(name: &str, bytes: u64) -> io::Result<File> {
    let memory = create(name)?;
    memory.set_len(bytes)?;
    fcntl_add_seals(&memory, SealFlags::SHRINK | SealFlags::GROW | SealFlags::SEAL)?;
    Ok(memory)
}
