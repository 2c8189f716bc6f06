//! Messages between host and a plugin's process, within their limits.

use busbar_protocol::framing;
pub(crate) use busbar_protocol::framing::{Decoder, LENGTH_BYTES, decode};
use serde::Serialize;

/// The longest message to a plugin's process: all its tags with their addresses.
pub(crate) const MAX_SENT_BYTES: usize = 256 << 20;
/// The longest message from one.
const MAX_RECEIVED_BYTES: usize = 64 << 20;

/// A message with its length before it.
pub(crate) fn encode(message: &impl Serialize) -> Result<Vec<u8>, String> {
    framing::encode(message, MAX_SENT_BYTES)
}

/// Returns the decoder of messages from a plugin's process.
pub(crate) fn decoder() -> Decoder {
    Decoder::new(MAX_RECEIVED_BYTES)
}
