//! Conversion of texts from C and to C.

use std::ffi::{CStr, CString, c_char};

use busbar_protocol::message::MAX_TEXT_BYTES;

/// Returns a text that a caller passed; none where it is null, too long or not UTF-8.
///
/// # Safety
/// `text` is null or ends with a zero byte.
pub(crate) unsafe fn from_c<'a>(text: *const c_char) -> Option<&'a str> {
    if text.is_null() {
        return None;
    }
    // SAFETY: the caller's, and not null.
    let text = unsafe { CStr::from_ptr(text) }.to_str().ok()?;
    (text.len() <= MAX_TEXT_BYTES).then_some(text)
}

/// Converts a text for C; a zero byte in it ends it.
pub(crate) fn to_c(text: &str) -> CString {
    let text = text.split('\0').next().unwrap_or_default();
    CString::new(text).unwrap_or_default()
}
