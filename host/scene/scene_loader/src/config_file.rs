//! Configuration file: its bounded text, and the folder that its paths start from.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use busbar_config::{Config, Diagnostic, Severity};

use crate::diagnostics::LoadError;

/// The largest configuration file that is read.
pub const MAX_CONFIG_FILE_BYTES: u64 = busbar_config::MAX_CONFIG_BYTES as u64;

/// Returns the folder that relative paths of a configuration start from, absolute.
pub fn config_folder(path: &Path) -> PathBuf {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    folder.canonicalize().unwrap_or_else(|_| folder.to_owned())
}

/// Reads a configuration without checking the files it names.
///
/// # Errors
/// Every fault of the file.
pub fn read_config(path: &Path) -> Result<Config, LoadError> {
    let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
    let text = read_config_text(path).map_err(|fault| faulty(vec![fault]))?;
    busbar_config::parse(&text).map_err(faulty)
}

/// Reads the text of a configuration file, of at most [`MAX_CONFIG_FILE_BYTES`].
///
/// # Errors
/// Returns a diagnostic for a file that cannot be read, is too large or is not UTF-8.
pub fn read_config_text(path: &Path) -> Result<String, Diagnostic> {
    let fault = |cause: String, remedy: &str| Diagnostic {
        severity: Severity::Error,
        line: 1,
        column: 1,
        pointer: String::new(),
        cause,
        remedy: remedy.into(),
    };
    let unreadable = |error: std::io::Error| {
        fault(format!("cannot read the configuration: {error}"), "check the path and its rights")
    };
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(fault("it is not a regular file".into(), "name a JSON file"));
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(unreadable)?;
    file.take(MAX_CONFIG_FILE_BYTES + 1).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 > MAX_CONFIG_FILE_BYTES {
        let cause = format!("it is larger than {MAX_CONFIG_FILE_BYTES} bytes");
        return Err(fault(cause, "name a configuration file, or split it"));
    }
    String::from_utf8(bytes).map_err(|_| fault("it is not UTF-8 text".into(), "save it as UTF-8"))
}
