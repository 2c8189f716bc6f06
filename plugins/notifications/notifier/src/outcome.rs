//! Outcome of handing over one message.

/// Outcome of a try, with fault and remedy in words for operators. The words never have a
/// credential in them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// The server has taken the message.
    Delivered,
    /// The server will never take the message for this address.
    Refused(String),
    /// The message may be taken later.
    Failed(String),
}

/// Bytes of a server's words that are shown.
const MAX_SERVER_WORDS: usize = 200;

/// Returns the words of a server in one line, cut.
pub(crate) fn shown(words: &str) -> String {
    let line: String = words
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .take(MAX_SERVER_WORDS)
        .collect();
    line.trim().to_owned()
}
