//! Mark of a value by its quality and severity.

/// Presentation of a value by quality and severity.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum ValueMark {
    /// Good and in its normal band.
    #[default]
    Normal,
    /// Good, outside its normal band.
    Warning,
    /// Good, and needs action.
    Alarm,
    /// Value of uncertain quality.
    Uncertain {
        /// Reason of the quality.
        reason: String,
    },
    /// Value of bad quality.
    Bad {
        /// Reason of the quality.
        reason: String,
    },
    /// Value drawn by a late overlay: the picture is old, which does not affect the value's
    /// quality.
    LateDisplay,
}

impl ValueMark {
    /// The more urgent of two: alarm, bad, warning, uncertain, normal.
    pub fn most_urgent(self, other: Self) -> Self {
        if other.urgency() > self.urgency() { other } else { self }
    }

    /// Returns the urgency; 0 is normal.
    pub fn urgency(&self) -> u8 {
        match self {
            Self::Normal => 0,
            Self::Uncertain { .. } => 1,
            Self::Warning => 2,
            Self::Bad { .. } | Self::LateDisplay => 3,
            Self::Alarm => 4,
        }
    }
}

/// Bytes of a value that its column has room for in any case.
const MAX_SHOWN_VALUE: usize = 16;

/// Returns a line with a value for whoever hovers over it; empty where its column shows it whole.
pub(crate) fn whole_value(value: &str) -> String {
    if value.len() > MAX_SHOWN_VALUE { format!("\n{value}") } else { String::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_most_urgent_mark_wins() {
        let bad = ValueMark::Bad { reason: "stale".into() };
        assert_eq!(ValueMark::Warning.most_urgent(bad.clone()), bad);
        assert_eq!(ValueMark::Alarm.most_urgent(bad.clone()), ValueMark::Alarm);
        assert_eq!(ValueMark::Normal.most_urgent(ValueMark::Normal), ValueMark::Normal);
    }
}
