//! Words by which programs say that there is no value, and how good one is.

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

/// Quality that a word or a code says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QualityWord {
    /// The value can be trusted.
    Good,
    /// The value may be wrong.
    Uncertain,
    /// The value is wrong, or none.
    Bad,
}

/// Words for qualities, in lower case.
const QUALITIES: &[(&str, QualityWord)] = &[
    ("good", QualityWord::Good),
    ("ok", QualityWord::Good),
    ("valid", QualityWord::Good),
    ("g", QualityWord::Good),
    ("uncertain", QualityWord::Uncertain),
    ("questionable", QualityWord::Uncertain),
    ("suspect", QualityWord::Uncertain),
    ("doubtful", QualityWord::Uncertain),
    ("substituted", QualityWord::Uncertain),
    ("u", QualityWord::Uncertain),
    ("bad", QualityWord::Bad),
    ("invalid", QualityWord::Bad),
    ("error", QualityWord::Bad),
    ("b", QualityWord::Bad),
];
/// Bits of a quality of OPC DA 3.0 (6.8), and what they can be.
const OPC_QUALITY: u16 = 0xC0;
const OPC_GOOD: u16 = 0xC0;
const OPC_UNCERTAIN: u16 = 0x40;

/// Finds the quality of a word, without regard to case, or of a code of OPC DA, 192 being good.
pub fn find_quality(text: &str) -> Option<QualityWord> {
    let lower = text.trim().to_lowercase();
    if let Ok(code) = lower.parse::<u16>() {
        return Some(match code & OPC_QUALITY {
            OPC_GOOD => QualityWord::Good,
            OPC_UNCERTAIN => QualityWord::Uncertain,
            _ => QualityWord::Bad,
        });
    }
    QUALITIES.iter().find(|(word, _)| *word == lower).map(|(_, quality)| *quality)
}
