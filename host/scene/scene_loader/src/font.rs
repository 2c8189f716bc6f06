//! The font that the configuration names.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use busbar_config::Config;
use skrifa::{FontRef, MetadataProvider};

use crate::diagnostics::DiagnosticsCollector;

/// The largest font file; those of all Chinese signs have some 20 MB.
const MAX_FONT_BYTES: u64 = 64 << 20;

/// Reads the font and ensures that it is one; none where the built-in one is used, or
/// with a fault.
pub(crate) fn load(
    config: &Config,
    folder: &Path,
    faults: &mut DiagnosticsCollector<'_>,
) -> Option<Vec<u8>> {
    let path = config.view.font.as_ref()?;
    match read(&folder.join(path)) {
        Ok(bytes) => Some(bytes),
        Err(cause) => {
            let cause = format!("cannot use the font '{path}': {cause}");
            let remedy = "name a TrueType or OpenType file (.ttf or .otf), or remove \"font\"";
            faults.add("/theme/font", cause, remedy);
            None
        }
    }
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    let metadata = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if !metadata.is_file() {
        return Err("it is not a regular file".to_owned());
    }
    let mut bytes = Vec::new();
    let file = File::open(path).map_err(|error| error.to_string())?;
    let read = file.take(MAX_FONT_BYTES + 1).read_to_end(&mut bytes);
    read.map_err(|error| error.to_string())?;
    if bytes.len() as u64 > MAX_FONT_BYTES {
        return Err(format!("it has more than {MAX_FONT_BYTES} bytes"));
    }
    let font = FontRef::from_index(&bytes, 0).map_err(|error| error.to_string())?;
    if font.charmap().map('0').is_none() {
        return Err("it has no digits".to_owned());
    }
    Ok(bytes)
}
