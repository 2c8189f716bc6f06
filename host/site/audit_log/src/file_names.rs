//! Names of the files in a log's folder.

/// The file that is appended to.
pub(crate) const CURRENT: &str = "alarms.jsonl";
/// Temporary name of a file that is being started.
pub(crate) const SCRATCH: &str = "alarms.jsonl.new";
/// Held locked by the writer.
pub(crate) const LOCK: &str = "lock";

const PREFIX: &str = "alarms.";
const SUFFIX: &str = ".jsonl";
const QUARANTINE: &str = "quarantine";
const UNFINISHED: &str = "unfinished";
/// Digits of a file number in a name; older releases wrote ages, with fewer.
const DIGITS: usize = 8;
/// Names that are tried for a file that must not replace another.
pub(crate) const MAX_NAMES_TRIED: u32 = 10_000;

/// Role of a file, by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FileRole {
    /// File that is being written.
    Current,
    /// One that is being begun.
    Scratch,
    /// One that ended, with its number.
    Ended(u64),
    /// One that ended with damage, with its number; never removed.
    Quarantined(u64),
    /// An ended one of an older release, with its age; the greatest is the oldest.
    Aged(u64),
    /// A beginning that a crash left behind.
    Unfinished(u64),
    /// The lock file, or a foreign file.
    Other,
}

/// Returns the role of a file by its name.
pub(crate) fn role_of(name: &str) -> FileRole {
    match name {
        CURRENT => return FileRole::Current,
        SCRATCH => return FileRole::Scratch,
        _ => {}
    }
    let inner = name.strip_prefix(PREFIX).and_then(|rest| rest.strip_suffix(SUFFIX));
    let Some(inner) = inner else { return FileRole::Other };
    let (number, kind) = inner.split_once('.').map_or((inner, None), |(n, k)| (n, Some(k)));
    if number.is_empty() || !number.bytes().all(|byte| byte.is_ascii_digit()) {
        return FileRole::Other;
    }
    let Ok(value) = number.parse() else { return FileRole::Other };
    let is_kind = |kind: &str, name| {
        kind.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
    };
    match kind {
        None if number.len() >= DIGITS => FileRole::Ended(value),
        None => FileRole::Aged(value),
        Some(kind) if is_kind(kind, QUARANTINE) => FileRole::Quarantined(value),
        Some(kind) if is_kind(kind, UNFINISHED) => FileRole::Unfinished(value),
        Some(_) => FileRole::Other,
    }
}

/// Names for a file that ended, the first one first.
pub(crate) fn ended_names(file: u64, is_damaged: bool) -> impl Iterator<Item = String> {
    let plain = (!is_damaged).then(|| format!("{PREFIX}{file:08}{SUFFIX}"));
    plain.into_iter().chain(numbered(file, QUARANTINE))
}

/// Names for a beginning that was left behind.
pub(crate) fn unfinished_names(file: u64) -> impl Iterator<Item = String> {
    numbered(file, UNFINISHED)
}

fn numbered(file: u64, kind: &'static str) -> impl Iterator<Item = String> {
    (1..=MAX_NAMES_TRIED).map(move |copy| match copy {
        1 => format!("{PREFIX}{file:08}.{kind}{SUFFIX}"),
        copy => format!("{PREFIX}{file:08}.{kind}-{copy}{SUFFIX}"),
    })
}

/// Sorts files of a log by age, the oldest first.
pub(crate) fn age_order(role: FileRole) -> (u8, u64, bool) {
    match role {
        FileRole::Aged(age) => (0, u64::MAX - age, false),
        FileRole::Ended(file) => (1, file, false),
        FileRole::Quarantined(file) => (1, file, true),
        FileRole::Current => (2, 0, false),
        FileRole::Scratch => (3, 0, false),
        FileRole::Unfinished(file) => (4, file, false),
        FileRole::Other => (5, 0, false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_roles_and_roles_names() {
        let cases = [
            ("alarms.jsonl", FileRole::Current),
            ("alarms.jsonl.new", FileRole::Scratch),
            ("alarms.7.jsonl", FileRole::Aged(7)),
            ("alarms.1000.jsonl", FileRole::Aged(1000)),
            ("alarms.00000007.jsonl", FileRole::Ended(7)),
            ("alarms.123456789.jsonl", FileRole::Ended(123_456_789)),
            ("alarms.00000007.quarantine.jsonl", FileRole::Quarantined(7)),
            ("alarms.00000007.quarantine-3.jsonl", FileRole::Quarantined(7)),
            ("alarms.00000007.unfinished.jsonl", FileRole::Unfinished(7)),
            ("alarms.00000007.jsonl.gz", FileRole::Other),
            ("alarms.+0000007.jsonl", FileRole::Other),
            ("alarms.99999999999999999999999.jsonl", FileRole::Other),
            ("alarms..jsonl", FileRole::Other),
            ("lock", FileRole::Other),
        ];
        for (name, role) in cases {
            assert_eq!(role_of(name), role, "{name}");
        }
        assert_eq!(ended_names(7, false).next().unwrap(), "alarms.00000007.jsonl");
        for name in ended_names(7, true).take(3) {
            assert_eq!(role_of(&name), FileRole::Quarantined(7));
        }
        for name in unfinished_names(8).take(3) {
            assert_eq!(role_of(&name), FileRole::Unfinished(8));
        }
        let mut names = cases[..6].to_vec();
        names.sort_by_key(|(_, role)| age_order(*role));
        let sorted: Vec<_> = names.iter().map(|(name, _)| *name).collect();
        assert_eq!(sorted[..2], ["alarms.1000.jsonl", "alarms.7.jsonl"]);
        assert_eq!(sorted[2..4], ["alarms.00000007.jsonl", "alarms.123456789.jsonl"]);
    }
}
