//! The beginning of a message that is too long to be taken.

use super::SessionFault;
use super::packet::Reply;

/// First byte of PUBLISH packets, its high half (MQTT 3.1.1, 2.2.1).
const PUBLISH: u8 = 3;

/// Length of the PUBLISH packet that begins here, and what it is answered with; nothing
/// while too little of it has come (MQTT 3.1.1, 3.3).
pub(super) fn head_of_message(input: &[u8]) -> Result<Option<(usize, Reply)>, SessionFault> {
    let malformed = |what: &str| SessionFault::Malformed(what.into());
    let [first, rest @ ..] = input else { return Ok(None) };
    if first >> 4 != PUBLISH {
        return Err(malformed("a packet that is too long, and no message"));
    }
    let (mut length, mut digits) = (0_usize, 0);
    for byte in rest.iter().take(4) {
        length |= usize::from(byte & 0x7F) << (7 * digits);
        digits += 1;
        if byte & 0x80 == 0 {
            break;
        }
    }
    let Some(body) = rest.get(digits..) else { return Ok(None) };
    let packet = 1 + digits + length;
    let qos = first >> 1 & 0b11;
    if qos == 0 {
        return Ok(Some((packet, Reply::None)));
    }
    let [high, low, body @ ..] = body else { return Ok(None) };
    let topic = usize::from(u16::from_be_bytes([*high, *low]));
    let Some([high, low]) = body.get(topic..topic + 2) else { return Ok(None) };
    let id = u16::from_be_bytes([*high, *low]);
    Ok(Some((packet, if qos == 1 { Reply::Acknowledged(id) } else { Reply::Received(id) })))
}
