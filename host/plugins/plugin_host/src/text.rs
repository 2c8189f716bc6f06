//! Texts of plugins: bounded, validated and made printable.

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

/// Reads at most `max_bytes` of a plugin's text for logs and panels, control characters made
/// visible.
///
/// # Safety
/// As for [`read`].
pub(crate) unsafe fn read_short(text: abi::BusbarStr, max_bytes: usize) -> String {
    if text.len == 0 || text.ptr.is_null() {
        return String::new();
    }
    // SAFETY: not null; the caller vouches for `len` bytes, of which fewer are read.
    let bytes = unsafe { std::slice::from_raw_parts(text.ptr, text.len.min(max_bytes)) };
    shown(&String::from_utf8_lossy(bytes), max_bytes)
}

/// The message that a plugin wrote into an error.
pub(crate) fn message_of(error: &abi::BusbarError) -> String {
    let len = (error.message_len as usize).min(error.message.len());
    String::from_utf8_lossy(&error.message[..len]).into_owned()
}

/// Makes a text of a plugin or its process printable for logs and panels: at most `max_bytes` of
/// it, control characters made visible.
pub fn shown(text: &str, max_bytes: usize) -> String {
    let end = text.floor_char_boundary(max_bytes);
    text[..end].chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

/// JSON within formats that do not describe themselves: as text.
pub(crate) mod as_json {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use serde_json::Value;

    pub(crate) fn serialize<S: Serializer>(
        value: &Option<Value>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        value.as_ref().map(Value::to_string).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Value>, D::Error> {
        let text: Option<String> = Deserialize::deserialize(deserializer)?;
        text.map(|text| serde_json::from_str(&text)).transpose().map_err(D::Error::custom)
    }
}
