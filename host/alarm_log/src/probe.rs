//! Reading and writing a log without a file: for fuzzing.

use twox_hash::XxHash3_64;

use crate::Recovered;
use crate::line;
use crate::recovery::Reading;

/// What bytes of a file tell, and how many of them are whole lines.
pub fn read(bytes: &[u8]) -> (Recovered, u64) {
    let reading = Reading::of(bytes);
    (reading.found, reading.good_bytes)
}

/// The file of what was recovered: the alarms that are open, then the newest records.
///
/// # Errors
/// A record that cannot be written.
pub fn write(recovered: &Recovered) -> std::io::Result<Vec<u8>> {
    let open = recovered.open.values().map(line::write_carried);
    let lines = open.chain(recovered.tail.iter().map(line::write));
    lines
        .map(|line| line.map(String::into_bytes))
        .collect::<std::io::Result<Vec<_>>>()
        .map(|l| l.concat())
}

/// A line with this text behind a checksum that is right.
pub fn signed(json: &[u8], is_carried: bool) -> Vec<u8> {
    let mark = if is_carried { b'*' } else { b' ' };
    let hash = format!("{:016x}", XxHash3_64::oneshot(json));
    [hash.as_bytes(), &[mark], json, b"\n"].concat()
}
