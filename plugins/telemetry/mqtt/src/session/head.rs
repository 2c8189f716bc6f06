//! Head of a PUBLISH packet: topic and length of the payload, before the payload has come.

use std::ops::Range;

use super::SessionFault;
use super::packet::{Reply, Version};

/// Type of PUBLISH packets, the high half of their first byte (MQTT 3.1.1, 2.2.1).
const PUBLISH: u8 = 3;
/// Bytes of a variable byte integer at most (MQTT 5, 1.5.5).
const MAX_DIGITS: usize = 4;

/// Head of a message, all that is needed to leave the message out and yet answer it.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct MessageHead {
    /// Bytes of the whole packet.
    pub(super) packet: usize,
    /// Bytes of the topic within the packet.
    pub(super) topic: Range<usize>,
    /// Bytes of the payload.
    pub(super) payload: usize,
    pub(super) is_retained: bool,
    pub(super) reply: Reply,
}

/// Reports whether the first byte is that of a PUBLISH packet.
pub(super) fn is_message(input: &[u8]) -> bool {
    input.first().is_some_and(|first| first >> 4 == PUBLISH)
}

/// Reads the head of the PUBLISH packet that begins here (MQTT 3.1.1 and 5, 3.3); `None`
/// while too little of it has come.
///
/// # Errors
/// [`SessionFault::Malformed`] where parts of the head are longer than the packet.
pub(super) fn read_message_head(
    input: &[u8],
    version: Version,
) -> Result<Option<MessageHead>, SessionFault> {
    let Some((&first, rest)) = input.split_first() else { return Ok(None) };
    let Some((length, digits)) = variable_integer(rest)? else { return Ok(None) };
    let body = 1 + digits;
    let packet = body + length;
    let mut at = body;
    let mut take = |count: usize| -> Result<Option<Range<usize>>, SessionFault> {
        let range = at..at + count;
        if range.end > packet {
            return Err(malformed("a message whose head is longer than its packet"));
        }
        at = range.end;
        Ok((range.end <= input.len()).then_some(range))
    };
    let Some(topic_length) = take(2)? else { return Ok(None) };
    let Some(topic) = take(number(input, topic_length))? else { return Ok(None) };
    let id = match first >> 1 & 0b11 {
        0 => None,
        1 | 2 => match take(2)? {
            Some(id) => Some(number(input, id) as u16),
            None => return Ok(None),
        },
        _ => return Err(malformed("a message of an unknown quality of service")),
    };
    if version == Version::V5 {
        let properties = input.get(at..packet.min(input.len())).unwrap_or_default();
        let Some((length, digits)) = variable_integer(properties)? else {
            return if input.len() < packet {
                Ok(None)
            } else {
                Err(malformed("a message without its properties' length"))
            };
        };
        at += digits + length;
        if at > packet {
            return Err(malformed("a message whose properties are longer than its packet"));
        }
    }
    let reply = match (first >> 1 & 0b11, id) {
        (1, Some(id)) => Reply::Acknowledged(id),
        (2, Some(id)) => Reply::Received(id),
        _ => Reply::None,
    };
    let is_retained = first & 1 == 1;
    Ok(Some(MessageHead { packet, topic, payload: packet - at, is_retained, reply }))
}

/// Reads a big-endian number of two bytes.
fn number(input: &[u8], range: Range<usize>) -> usize {
    let bytes = input.get(range).unwrap_or_default();
    bytes.iter().fold(0, |number, byte| number << 8 | usize::from(*byte))
}

/// Reads a variable byte integer: its value and its bytes; `None` while it is not whole.
fn variable_integer(input: &[u8]) -> Result<Option<(usize, usize)>, SessionFault> {
    let mut value = 0_usize;
    for (index, byte) in input.iter().take(MAX_DIGITS).enumerate() {
        value |= usize::from(byte & 0x7F) << (7 * index);
        if byte & 0x80 == 0 {
            return Ok(Some((value, index + 1)));
        }
    }
    match input.len() < MAX_DIGITS {
        true => Ok(None),
        false => Err(malformed("a length of more than four bytes")),
    }
}

fn malformed(what: &str) -> SessionFault {
    SessionFault::Malformed(what.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A packet of QoS 1 on `a/b`, as both versions have it.
    fn packet(version: Version, properties: &[u8], payload: &[u8]) -> Vec<u8> {
        let mut body = vec![0, 3, b'a', b'/', b'b', 0, 9];
        if version == Version::V5 {
            body.push(properties.len() as u8);
            body.extend_from_slice(properties);
        }
        body.extend_from_slice(payload);
        [vec![0x33, body.len() as u8], body].concat()
    }

    #[test]
    fn a_head_is_read_as_soon_as_it_is_whole() {
        for (version, properties) in [(Version::V4, &[][..]), (Version::V5, &[1, 1])] {
            let bytes = packet(version, properties, b"12345");
            let head = MessageHead {
                packet: bytes.len(),
                topic: 4..7,
                payload: 5,
                is_retained: true,
                reply: Reply::Acknowledged(9),
            };
            let whole = if version == Version::V5 { 10 } else { 9 };
            for end in 0..bytes.len() {
                let read = read_message_head(&bytes[..end], version).unwrap();
                assert_eq!(read.as_ref(), (end >= whole).then_some(&head), "{version:?} {end}");
            }
        }
    }

    #[test]
    fn heads_that_do_not_fit_their_packet_are_refused() {
        let cases = [
            (Version::V4, &[0x30, 3, 0, 9, b'a'][..]),
            (Version::V4, &[0x30, 1, 0]),
            (Version::V4, &[0x36, 5, 0, 1, b'a', 0, 1]),
            (Version::V4, &[0x32, 4, 0, 1, b'a', 0]),
            (Version::V4, &[0x30, 0xFF, 0xFF, 0xFF, 0xFF, 1]),
            (Version::V5, &[0x30, 4, 0, 1, b'a', 9]),
            (Version::V5, &[0x30, 3, 0, 1, b'a']),
        ];
        for (version, bytes) in cases {
            let read = read_message_head(bytes, version);
            assert!(matches!(read, Err(SessionFault::Malformed(_))), "{bytes:?}: {read:?}");
        }
    }
}
