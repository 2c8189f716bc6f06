//! Words by which programs say that there is no value, and how good one is.

use busbar_types::QualityLevel;

/// Words that are no value wherever they stand, without regard to case: of Home Assistant, of
/// spreadsheets, of databases, of PI.
pub const NO_VALUE_WORDS: &[&str] = &[
    "unknown",
    "unavailable",
    "none",
    "null",
    "nil",
    "n/a",
    "na",
    "#n/a",
    "#na",
    "#value!",
    "#div/0!",
    "#ref!",
    "-",
    "--",
    "---",
    "----",
    "-----",
    "*",
    "***",
    "?",
    "no data",
    "bad",
    "bad input",
    "bad data",
    "i/o timeout",
    "comm fail",
    "pt created",
    "not connect",
    "shutdown",
    "no value",
    "missing",
    "invalid",
    "error",
];

/// Words for qualities, in lower case.
const QUALITIES: &[(&str, QualityLevel)] = &[
    ("good", QualityLevel::Good),
    ("ok", QualityLevel::Good),
    ("valid", QualityLevel::Good),
    ("g", QualityLevel::Good),
    ("uncertain", QualityLevel::Uncertain),
    ("questionable", QualityLevel::Uncertain),
    ("suspect", QualityLevel::Uncertain),
    ("doubtful", QualityLevel::Uncertain),
    ("substituted", QualityLevel::Uncertain),
    ("u", QualityLevel::Uncertain),
    ("bad", QualityLevel::Bad),
    ("invalid", QualityLevel::Bad),
    ("error", QualityLevel::Bad),
    ("b", QualityLevel::Bad),
];
/// Finds the quality of a word, without regard to case, or of a code of OPC DA 3.0 (6.8): of its
/// eight bits the two highest count, so that 192 is good. Codes beyond eight bits are of no
/// standard that all follow: Sparkplug and Ignition call what is stale 500, others what is good.
pub fn find_quality(text: &str) -> Option<QualityLevel> {
    let lower = text.trim().to_lowercase();
    if let Ok(code) = lower.parse::<u64>() {
        return match code {
            192..=255 => Some(QualityLevel::Good),
            64..=127 => Some(QualityLevel::Uncertain),
            0..=191 => Some(QualityLevel::Bad),
            _ => None,
        };
    }
    QUALITIES.iter().find(|(word, _)| *word == lower).map(|(_, quality)| *quality)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_of_opc_da_and_of_eight_bits() {
        for code in 0..=1_200_u64 {
            let quality = find_quality(&code.to_string());
            let level = match code & 0xC0 {
                _ if code > 0xFF => None,
                0xC0 => Some(QualityLevel::Good),
                0x40 => Some(QualityLevel::Uncertain),
                _ => Some(QualityLevel::Bad),
            };
            assert_eq!(quality, level, "{code}");
        }
        for text in ["-1", "192.5", "0xC0", "18446744073709551808", ""] {
            assert_eq!(find_quality(text), None, "{text}");
        }
        assert_eq!(find_quality(" GOOD "), Some(QualityLevel::Good));
    }
}
