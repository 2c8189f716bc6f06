//! Conversion of durations from seconds, as the text has them.

/// Returns a time in whole milliseconds.
pub(crate) fn whole_millis(seconds: f64) -> u64 {
    (seconds * 1_000.0).round() as u64
}
