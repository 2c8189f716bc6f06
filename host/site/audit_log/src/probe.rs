//! Reading and writing a log without a file: for fuzzing.

use crate::RecoveredLog;
use crate::chain::{ChainKey, Digest256, KeyRing};
use crate::chain_check::CheckedFile;
use crate::file_header::FileHeader;
use crate::line;

/// Reads the bytes of a file: the recovered state, and the number of bytes in whole lines.
pub fn read(bytes: &[u8]) -> (RecoveredLog, u64) {
    let mut found = RecoveredLog::default();
    let reading = CheckedFile::read(bytes, &KeyRing::default(), None, &mut found);
    found.remarks = reading.remarks();
    (found, reading.whole_bytes)
}

/// Writes the file of a recovered log: a header, the alarms that are open, the newest records.
///
/// # Errors
/// A record that cannot be written.
pub fn write(recovered: &RecoveredLog) -> std::io::Result<Vec<u8>> {
    let (key, mut text) = (ChainKey::default(), Vec::new());
    let header = FileHeader { carried: recovered.open.len() as u64, ..FileHeader::default() };
    let mut chain = line::write(&mut text, line::HEADER, &header, &Digest256::default(), &key)?;
    let open = recovered.open.values().map(|record| (line::CARRIED, record));
    for (mark, record) in open.chain(recovered.tail.iter().map(|record| (line::NEWS, record))) {
        chain = line::write(&mut text, mark, record, &chain, &key)?;
    }
    Ok(text)
}

/// Writes a line with this text behind a checksum that is right.
pub fn signed(json: &[u8], is_carried: bool) -> Vec<u8> {
    line::signed(if is_carried { line::CARRIED } else { line::NEWS }, json)
}

/// Writes a line with this mark and text behind a checksum that is right.
pub fn marked(mark: u8, json: &[u8]) -> Vec<u8> {
    line::signed(mark, json)
}
