//! Texts that plugins write as JSON into room that they are given.

use busbar_plugin_abi as abi;
use serde::de::DeserializeOwned;

use crate::{Instance, PluginError};

/// Bytes that are tried first; most texts take less.
const FIRST_BYTES: usize = 16 << 10;

/// Calls a function for JSON of at most `limit` bytes, again with a larger buffer where it needs
/// one.
pub(crate) fn ask_json<T: DeserializeOwned>(
    instance: &Instance,
    max_bytes: usize,
    ask: impl Fn(*mut abi::BusbarTextOutput, *mut abi::BusbarError) -> abi::BusbarStatusNumber,
) -> Result<T, PluginError> {
    let mut room = FIRST_BYTES;
    loop {
        let mut text = vec![0u8; room];
        let mut output = abi::BusbarTextOutput {
            struct_size: size_of::<abi::BusbarTextOutput>() as u32,
            capacity: room as u32,
            len: 0,
            reserved: 0,
            text: text.as_mut_ptr(),
        };
        let mut error = abi::BusbarError::empty();
        let serial = instance.serialize_calls();
        let status = ask(&mut output, &mut error);
        drop(serial);
        let len = output.len as usize;
        let is_larger = room < len && len <= max_bytes;
        if status == abi::BUSBAR_BUFFER_TOO_SMALL && is_larger {
            room = len;
            continue;
        }
        instance.outcome(status, &error)?;
        let text =
            text.get(..len).ok_or_else(|| instance.violation("it claims more text than fits"))?;
        return serde_json::from_slice(text).map_err(|error| {
            instance.violation(format!("what it describes is not as agreed: {error}"))
        });
    }
}
