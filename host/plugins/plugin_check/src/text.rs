//! Texts at the border.

use busbar_plugin_abi as abi;

/// The longest text taken from a plugin, bytes.
pub(crate) const MAX_TEXT_BYTES: usize = 1 << 20;

/// Reads a text of a plugin; `Err` describes the broken rule.
pub(crate) fn read(text: abi::BusbarStr) -> Result<String, String> {
    if text.len == 0 {
        return Ok(String::new());
    }
    if text.ptr.is_null() {
        return Err(format!("is null with a length of {}", text.len));
    }
    if text.len > MAX_TEXT_BYTES {
        return Err(format!("has {} bytes; at most {MAX_TEXT_BYTES} are taken", text.len));
    }
    // SAFETY: not null and of bounded length; whether that many bytes are there is
    // what this process finds out, at the worst by its end.
    let bytes = unsafe { std::slice::from_raw_parts(text.ptr, text.len) };
    std::str::from_utf8(bytes).map(str::to_owned).map_err(|_| "is not UTF-8".to_owned())
}

/// A view of bytes, valid as long as they are.
pub(crate) fn of_bytes(bytes: &[u8]) -> abi::BusbarStr {
    abi::BusbarStr { ptr: bytes.as_ptr(), len: bytes.len() }
}

/// Reads the message of an error; `Err` describes the broken rule.
pub(crate) fn message_of(error: &abi::BusbarError) -> Result<String, String> {
    let len = error.message_len as usize;
    let bytes = error
        .message
        .get(..len)
        .ok_or_else(|| format!("claims {len} bytes of {}", error.message.len()))?;
    std::str::from_utf8(bytes).map(str::to_owned).map_err(|_| "is not UTF-8".to_owned())
}

/// A status as the header names it.
pub(crate) fn status_name(status: abi::BusbarStatusNumber) -> String {
    match status {
        abi::BUSBAR_OK => "BUSBAR_OK".into(),
        abi::BUSBAR_INVALID_ARGUMENT => "BUSBAR_INVALID_ARGUMENT".into(),
        abi::BUSBAR_INVALID_SETTINGS => "BUSBAR_INVALID_SETTINGS".into(),
        abi::BUSBAR_BUFFER_TOO_SMALL => "BUSBAR_BUFFER_TOO_SMALL".into(),
        abi::BUSBAR_CANCELLED => "BUSBAR_CANCELLED".into(),
        abi::BUSBAR_FAILED => "BUSBAR_FAILED".into(),
        abi::BUSBAR_INTERNAL => "BUSBAR_INTERNAL".into(),
        other => format!("the unknown status {other}"),
    }
}
