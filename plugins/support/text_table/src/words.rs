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
/// Bits of a quality of OPC DA 3.0 (6.8), and what they can be.
const OPC_QUALITY: u16 = 0xC0;
const OPC_GOOD: u16 = 0xC0;
const OPC_UNCERTAIN: u16 = 0x40;

/// Finds the quality of a word, without regard to case, or of a code of OPC DA, 192 being good.
pub fn find_quality(text: &str) -> Option<QualityLevel> {
    let lower = text.trim().to_lowercase();
    if let Ok(code) = lower.parse::<u16>() {
        return Some(match code & OPC_QUALITY {
            OPC_GOOD => QualityLevel::Good,
            OPC_UNCERTAIN => QualityLevel::Uncertain,
            _ => QualityLevel::Bad,
        });
    }
    QUALITIES.iter().find(|(word, _)| *word == lower).map(|(_, quality)| *quality)
}
