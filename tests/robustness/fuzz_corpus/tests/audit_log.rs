//! Fuzzing of the audit log: any bytes are a log as far as their lines are whole. No normal alarm
//! is open, limits hold, and what was recovered is recovered again from what is written of it.

use busbar_audit_log::probe::{marked, read, signed, write};
use busbar_audit_log::{MAX_TAIL, RecoveredLog};

/// Marks of lines: of a header, of an anchor, and of none that is known.
const MARKS: [u8; 3] = *b"#@?";

/// Runs one input. Its first byte selects the form of the rest: a file, or texts of lines whose
/// checksums are right.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Some((&kind, rest)) = bytes.split_first() else { return false };
    if kind & 1 == 0 {
        return is_log(rest);
    }
    let lines = rest.split(|byte| *byte == b'\n').enumerate();
    let line = |(index, text): (usize, &[u8])| match kind & 12 {
        0 => signed(text, kind & 2 != 0),
        // Files begin with a header.
        4 if index == 0 => marked(MARKS[0], text),
        4 => signed(text, kind & 2 != 0),
        _ => marked(MARKS[usize::from(kind >> 4) % MARKS.len()], text),
    };
    is_log(&lines.map(line).collect::<Vec<_>>().concat())
}

fn is_log(bytes: &[u8]) -> bool {
    let (found, good_bytes) = read(bytes);
    assert!(good_bytes <= bytes.len() as u64);
    check(&found);
    let (again, _) = read(&bytes[..good_bytes as usize]);
    assert_eq!((again.open, again.tail), (found.open.clone(), found.tail.clone()));
    let written = write(&found).expect("it can be written");
    let (again, whole) = read(&written);
    assert_eq!(whole, written.len() as u64, "every line is whole");
    assert_eq!(again.tail, found.tail);
    let is_broken = |remark: &String| !remark.contains("are missing");
    assert_eq!(again.remarks.iter().find(|remark| is_broken(remark)), None, "its chain is whole");
    !found.tail.is_empty()
}

fn check(found: &RecoveredLog) {
    assert!(found.tail.len() <= MAX_TAIL && found.last_number < u64::MAX, "another follows");
    assert!(found.tail.iter().all(|record| record.number <= found.last_number));
    for (alarm, record) in &found.open {
        assert!(
            record.alarm == *alarm && record.to != busbar_types::AlarmState::Normal,
            "{record:?}"
        );
    }
    for remark in &found.remarks {
        assert!(!remark.is_empty() && !remark.contains(char::is_control), "{remark}");
    }
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("audit_log", fuzz_one);
}
