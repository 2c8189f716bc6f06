//! Bounded reading of a file that may be anything.

use std::fs::File;
use std::io::Read;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

use record_source::ReadDeadline;
use rustix::fs::OFlags;

/// Bytes of a file, at most.
pub(crate) const MAX_FILE_BYTES: u64 = 64 << 20;
/// Bytes between two checks of the deadline.
const PIECE_BYTES: usize = 1 << 20;

/// Reads a file of any kind: one that blocks, is no regular file or is huge is refused.
pub(crate) fn read(path: &Path, deadline: &ReadDeadline) -> Result<Vec<u8>, String> {
    let words = |error: std::io::Error| error.to_string();
    // Opening a FIFO would wait for somebody who writes.
    let flags = OFlags::NONBLOCK.bits() as i32;
    let file = File::options().read(true).custom_flags(flags).open(path).map_err(words)?;
    let metadata = file.metadata().map_err(words)?;
    if !metadata.is_file() {
        return Err("it is no regular file".into());
    }
    let mut bytes = Vec::new();
    loop {
        let read = (&file).take(PIECE_BYTES as u64).read_to_end(&mut bytes).map_err(words)?;
        if read == 0 {
            return Ok(bytes);
        }
        deadline.check()?;
        if bytes.len() as u64 > MAX_FILE_BYTES {
            let limit = MAX_FILE_BYTES >> 20;
            return Err(format!("it has more than {limit} MiB: export fewer rows or columns"));
        }
    }
}
