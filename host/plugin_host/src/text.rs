//! Reading what a plugin gives, trusting as little as possible.

use busbar_plugin_abi as abi;

/// The longest text taken from a plugin, bytes.
pub(crate) const MAX_TEXT_BYTES: usize = 1 << 20;

/// A text that a plugin gave, checked.
///
/// # Safety
/// If `text.ptr` is not null, `text.len` bytes behind it are readable; that
/// much an ABI in C has to be trusted with in one process.
pub(crate) unsafe fn read(text: abi::BusbarStr) -> Result<String, String> {
    if text.len == 0 {
        return Ok(String::new());
    }
    if text.ptr.is_null() || text.len > MAX_TEXT_BYTES {
        return Err(format!("a text is null or longer than {MAX_TEXT_BYTES} bytes"));
    }
    // SAFETY: not null, of bounded length; the caller vouches for the rest.
    let bytes = unsafe { std::slice::from_raw_parts(text.ptr, text.len) };
    std::str::from_utf8(bytes).map(str::to_owned).map_err(|_| "a text is not UTF-8".into())
}

/// At most `max_bytes` of a text that a plugin gave, control characters made
/// visible, for logs and panels.
///
/// # Safety
/// As for [`read`].
pub(crate) unsafe fn read_short(text: abi::BusbarStr, max_bytes: usize) -> String {
    if text.len == 0 || text.ptr.is_null() {
        return String::new();
    }
    // SAFETY: not null; the caller vouches for `len` bytes, of which fewer are read.
    let bytes = unsafe { std::slice::from_raw_parts(text.ptr, text.len.min(max_bytes)) };
    let lossy = String::from_utf8_lossy(bytes);
    let visible = lossy.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c });
    visible.collect()
}

/// The message that a plugin wrote into an error.
pub(crate) fn message_of(error: &abi::BusbarError) -> String {
    let len = (error.message_len as usize).min(error.message.len());
    String::from_utf8_lossy(&error.message[..len]).into_owned()
}
