//! Words by which programs say that there is no value.

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

/// Reports a text that is one of the words, without regard to case and outer blanks.
pub fn is_word_of<S: AsRef<str>>(text: &str, words: &[S]) -> bool {
    let text = text.trim().to_lowercase();
    words.iter().any(|word| word.as_ref().trim().to_lowercase() == text)
}
