//! The heap under a software rasteriser.

/// Memory that a frame of a million triangles takes, and more.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const KEPT_BYTES: libc::c_int = 512 << 20;
/// Blocks up to this size come from the heap; the most that glibc takes.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
const HEAP_BLOCK_BYTES: libc::c_int = 32 << 20;

/// Lets the heap keep what a frame frees. A software rasteriser takes a frame's
/// triangles from the heap; by default glibc may give that memory back to the
/// system after each frame and fault it in again in the next, which was
/// measured to take up to two fifths of a frame. What was freed before, by loading,
/// frames have no use for: that goes.
pub(crate) fn keep_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: the first frees what malloc holds free, the others set two numbers that it
    // reads, all under its own lock.
    unsafe {
        libc::malloc_trim(0);
        libc::mallopt(libc::M_TRIM_THRESHOLD, KEPT_BYTES);
        libc::mallopt(libc::M_MMAP_THRESHOLD, HEAP_BLOCK_BYTES);
    }
}

/// Gives the system back what the heap holds free. Where frames keep what they free, so does
/// all else: what a scene took that is gone would stay for ever, and in the arena of each
/// thread that ever loaded one. Takes milliseconds, and the next frame faults in what it needs.
pub fn give_back_freed_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: it frees what malloc holds free, under its own locks.
    unsafe {
        libc::malloc_trim(0);
    }
}
