//! Connection faults, described for operators.

use std::time::Duration;

use async_opcua::types::{Error as LibraryError, StatusCode};
use busbar_link::ConnectError;
use thiserror::Error;

/// Longest server text that is repeated in a message, characters.
const MAX_WORDS: usize = 200;

/// Reason for which a connection was not made, or ended.
#[derive(Debug, Error)]
pub(crate) enum Fault {
    #[error("{0}")]
    Connect(#[from] ConnectError),
    #[error("the server did not answer within {} ms; does it speak OPC UA on this port?", .0.as_millis())]
    NoAnswer(Duration),
    #[error("the server was silent for {} ms", .0.as_millis())]
    Silent(Duration),
    #[error(
        "a subscription gave no sign of life for {} ms, where one is due every {} ms; the server \
         answers other requests",
        .silence.as_millis(), .due.as_millis()
    )]
    SilentSubscription { silence: Duration, due: Duration },
    #[error("{0}")]
    Lost(String),
    #[error("{what}: {}", in_words(*.status))]
    Refused { what: &'static str, status: StatusCode },
    #[error(
        "the server offers no {wanted}; it offers {offered}: correct the setting security, or the \
         server"
    )]
    NoEndpoint { wanted: String, offered: String },
    #[error("security: {0}")]
    Security(String),
    #[error("user: {0}")]
    User(String),
    #[error("{0}: {1}")]
    Library(&'static str, String),
    #[error("the server broke the rules: {0}")]
    Server(&'static str),
    #[error("what the server sent made the OPC UA library panic")]
    Panic,
    #[error("stopped")]
    Stopped,
}

impl Fault {
    /// Reports whether a request asked for more than the server can do at once.
    pub(crate) fn is_too_much(&self) -> bool {
        let Self::Refused { status, .. } = self else { return false };
        [
            StatusCode::BadTooManyOperations,
            StatusCode::BadResponseTooLarge,
            StatusCode::BadEncodingLimitsExceeded,
        ]
        .contains(status)
    }

    /// Converts a library error of the service `what`, called with the deadline `limit`.
    pub(crate) fn from_library(what: &'static str, error: &LibraryError, limit: Duration) -> Self {
        match error.status() {
            StatusCode::BadTimeout => Self::NoAnswer(limit),
            status @ (StatusCode::BadIdentityTokenRejected
            | StatusCode::BadIdentityTokenInvalid
            | StatusCode::BadUserAccessDenied) => Self::User(in_words(status)),
            status @ (StatusCode::BadSecurityChecksFailed
            | StatusCode::BadCertificateUntrusted
            | StatusCode::BadCertificateInvalid
            | StatusCode::BadCertificateUriInvalid
            | StatusCode::BadCertificateTimeInvalid
            | StatusCode::BadCertificateUseNotAllowed) => Self::Security(format!(
                "{what}: {}; does the server trust our certificate?",
                in_words(status)
            )),
            _ => Self::Library(what, error.to_string().chars().take(MAX_WORDS).collect()),
        }
    }
}

/// Formats a status code by its name, with the standard's sentence.
pub(crate) fn in_words(status: StatusCode) -> String {
    let code = status.sub_code();
    if StatusCode::from_category(code).is_good() && !status.is_good() {
        return format!("status 0x{:08X}", status.bits());
    }
    let name = code.to_string();
    let sentence = code.description();
    if sentence.is_empty() { name } else { format!("{name} ({})", sentence.trim_end_matches('.')) }
}
