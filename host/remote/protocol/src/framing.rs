//! Messages on the socket: a length of four bytes, little-endian, then postcard.

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Bytes of the length before each message.
pub const LENGTH_BYTES: usize = 4;

/// A message with its length before it.
///
/// # Errors
/// In words: a message longer than `limit` bytes.
pub fn encode(message: &impl Serialize, limit: usize) -> Result<Vec<u8>, String> {
    let mut bytes = postcard::to_extend(message, vec![0; LENGTH_BYTES])
        .map_err(|error| format!("a message cannot be written: {error}"))?;
    let length = bytes.len() - LENGTH_BYTES;
    if length > limit || u32::try_from(length).is_err() {
        return Err(format!("a message has {length} bytes; the limit is {limit}"));
    }
    bytes[..LENGTH_BYTES].copy_from_slice(&(length as u32).to_le_bytes());
    Ok(bytes)
}

/// The length that four bytes give.
///
/// # Errors
/// In words: more than `limit`.
pub fn length(bytes: [u8; LENGTH_BYTES], limit: usize) -> Result<usize, String> {
    let length = u32::from_le_bytes(bytes) as usize;
    if length > limit {
        return Err(format!("a message of {length} bytes; the limit is {limit}"));
    }
    Ok(length)
}

/// A whole message without its length.
///
/// # Errors
/// In words: bytes that are no such message.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    match postcard::take_from_bytes(bytes) {
        Ok((message, [])) => Ok(message),
        Ok((_, rest)) => Err(format!("a message with {} bytes too many", rest.len())),
        Err(error) => Err(format!("a message that cannot be read: {error}")),
    }
}

/// Bytes in, messages out.
#[derive(Debug)]
pub struct Decoder {
    limit: usize,
    buffer: Vec<u8>,
    start: usize,
}

impl Decoder {
    /// Creates a decoder that accepts no message longer than `limit` bytes.
    pub fn new(limit: usize) -> Self {
        Self { limit, buffer: Vec::new(), start: 0 }
    }

    /// Takes bytes as they come.
    pub fn push(&mut self, bytes: &[u8]) {
        if self.start > 0 && self.start == self.buffer.len() {
            self.buffer.clear();
            self.start = 0;
        }
        self.buffer.extend_from_slice(bytes);
    }

    /// The next whole message, if it is there.
    ///
    /// # Errors
    /// In words: what is no message, or a longer one; nothing after it can be read.
    pub fn message<T: DeserializeOwned>(&mut self) -> Result<Option<T>, String> {
        let rest = &self.buffer[self.start..];
        let Some((head, body)) = rest.split_first_chunk::<LENGTH_BYTES>() else {
            return Ok(None);
        };
        let length = length(*head, self.limit)?;
        let Some(message) = body.get(..length) else {
            // A long message is moved down once, not at every piece.
            self.buffer.drain(..std::mem::take(&mut self.start));
            return Ok(None);
        };
        let message = decode(message)?;
        self.start += LENGTH_BYTES + length;
        Ok(Some(message))
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::message::{HostMessage, MAX_MESSAGE_BYTES as LIMIT};

    proptest! {
        #[test]
        fn messages_come_out_however_they_are_cut(
            texts in prop::collection::vec(".{0,40}", 0..8),
            cut in 1..17_usize,
        ) {
            let bytes: Vec<u8> = texts.iter().flat_map(|text| encode(text, LIMIT).unwrap()).collect();
            let (mut decoder, mut out) = (Decoder::new(LIMIT), Vec::<String>::new());
            for piece in bytes.chunks(cut) {
                decoder.push(piece);
                while let Some(text) = decoder.message().unwrap() {
                    out.push(text);
                }
            }
            prop_assert_eq!(out, texts);
        }

        #[test]
        fn random_bytes_are_an_error_or_a_message(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            let mut decoder = Decoder::new(LIMIT);
            decoder.push(&bytes);
            while let Ok(Some(_)) = decoder.message::<HostMessage>() {}
            let _ = decode::<HostMessage>(&bytes);
        }
    }

    #[test]
    fn a_length_past_the_limit_is_refused_before_its_bytes_come() {
        let mut decoder = Decoder::new(LIMIT);
        decoder.push(&u32::MAX.to_le_bytes());
        assert!(decoder.message::<HostMessage>().unwrap_err().contains("the limit"));
    }
}
