//! Options of a check, and the request to the process of one case.

use std::path::{Path, PathBuf};
use std::time::Duration;

use busbar_types::ValueKind;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

/// Bytes of a sample file.
const MAX_SAMPLE_BYTES: u64 = 1 << 20;
/// Tags of a sample.
const MAX_SAMPLE_TAGS: usize = 256;

/// Options of a check.
#[derive(Clone, Debug)]
pub struct Options {
    /// The longest that one case may take.
    pub case_limit: Duration,
    /// Settings and tags to check with.
    pub sample: Sample,
    /// Cases to run, those they need included; empty for all.
    pub only: Vec<String>,
}

/// Settings and tags with which a plugin can work.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sample {
    /// Settings; without them the least that the plugin's schema accepts.
    pub settings: Option<Value>,
    /// Tags that a telemetry plugin can serve, with their addresses.
    pub tags: Vec<SampleTag>,
}

/// A tag of a sample.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampleTag {
    /// `f64`, `i64`, `bool` or `double_point`.
    pub kind: ValueKind,
    /// The address, as a configuration has it.
    pub address: Value,
}

/// Errors of a sample file.
#[derive(Debug, Error)]
pub enum RequestError {
    /// The file cannot be read.
    #[error("cannot read the sample '{path}': {source}; check the path")]
    Unreadable {
        /// Path of the file.
        path: PathBuf,
        /// Reason from the system.
        source: std::io::Error,
    },
    /// The file is too large.
    #[error(
        "the sample '{path}' is too large: at most {MAX_SAMPLE_BYTES} bytes and {MAX_SAMPLE_TAGS} tags"
    )]
    TooLarge {
        /// Path of the file.
        path: PathBuf,
    },
    /// The file has no valid sample.
    #[error(
        "the sample '{path}': {source}; write {{\"settings\": {{...}}, \"tags\": [{{\"kind\": \"f64\", \"address\": ...}}]}}"
    )]
    Malformed {
        /// Path of the file.
        path: PathBuf,
        /// Error of the JSON parser.
        source: serde_json::Error,
    },
}

impl Sample {
    /// Reads a sample file.
    ///
    /// # Errors
    /// [`RequestError`].
    pub fn read(path: &Path) -> Result<Self, RequestError> {
        let unreadable = |source| RequestError::Unreadable { path: path.to_owned(), source };
        if std::fs::metadata(path).map_err(unreadable)?.len() > MAX_SAMPLE_BYTES {
            return Err(RequestError::TooLarge { path: path.to_owned() });
        }
        let text = std::fs::read(path).map_err(unreadable)?;
        let sample: Self = serde_json::from_slice(&text)
            .map_err(|source| RequestError::Malformed { path: path.to_owned(), source })?;
        if sample.tags.len() > MAX_SAMPLE_TAGS {
            return Err(RequestError::TooLarge { path: path.to_owned() });
        }
        Ok(sample)
    }
}

/// Request to the process of one case.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Request {
    /// Path of the library.
    pub(crate) library: PathBuf,
    /// Name of the case.
    pub(crate) case: String,
    /// Index of the plugin within the library, for cases of plugins.
    pub(crate) plugin: u32,
    /// Settings and tags of the sample.
    pub(crate) sample: Sample,
    /// Path of the journal that the case writes.
    pub(crate) journal: PathBuf,
    /// The longest it may take, milliseconds.
    pub(crate) limit_millis: u64,
}
