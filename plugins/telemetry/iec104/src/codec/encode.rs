//! Data units of a controlled station: what [`super::Asdu`] reads, the other way round.

use super::apci::MAX_ASDU_BYTES;
use super::asdu::{Object, cause};
use super::element::Value;
use super::time::{Cp56, TimeTag};

/// Objects of one data unit (IEC 60870-5-101, 7.2.2).
const MAX_OBJECTS: u8 = 127;
/// Offset of the cause in a data unit, bytes.
const CAUSE_INDEX: usize = 2;
/// P/N: a negative confirmation.
const NEGATIVE: u8 = 0x40;
/// T: sent as a test.
const TEST: u8 = 0x80;

/// The type that carries a value, without or with CP56Time2a.
pub fn type_of(value: Value, has_time: bool) -> u8 {
    let (bare, timed) = match value {
        Value::Single(_) => (1, 30),
        Value::Double(_) => (3, 31),
        Value::Step { .. } => (5, 32),
        Value::Bits(_) => (7, 33),
        Value::Normalized(_) => (9, 34),
        Value::Scaled(_) => (11, 35),
        Value::Float(_) => (13, 36),
        Value::Counter { .. } => (15, 37),
    };
    if has_time { timed } else { bare }
}

/// A data unit with values, all of one type, each with its own address.
#[derive(Debug)]
pub struct AsduWriter {
    cause: u8,
    common_address: u16,
    type_id: u8,
    count: u8,
    objects: Vec<u8>,
}

impl AsduWriter {
    /// A data unit without an object yet.
    pub fn new(cause: u8, common_address: u16) -> Self {
        Self { cause, common_address, type_id: 0, count: 0, objects: Vec::new() }
    }

    /// Adds an object; false where it does not fit: there is no room, or it is of
    /// another type. A time tag of three bytes is left out.
    pub fn push(&mut self, object: &Object) -> bool {
        let time = match object.time {
            Some(TimeTag::Cp56(time)) => Some(time),
            _ => None,
        };
        let type_id = type_of(object.value, time.is_some());
        let bytes = object_bytes(object, time);
        let length = bytes.len().saturating_add(self.objects.len());
        let fits = length.saturating_add(HEADER_BYTES) <= MAX_ASDU_BYTES;
        if self.count == MAX_OBJECTS || !fits || (self.count > 0 && self.type_id != type_id) {
            return false;
        }
        self.type_id = type_id;
        self.count = self.count.saturating_add(1);
        self.objects.extend(bytes);
        true
    }

    /// The data unit; nothing without an object.
    pub fn finish(self) -> Option<Vec<u8>> {
        let [low, high] = self.common_address.to_le_bytes();
        let mut bytes = vec![self.type_id, self.count, self.cause, 0, low, high];
        bytes.extend(self.objects);
        (self.count > 0).then_some(bytes)
    }
}

const HEADER_BYTES: usize = 6;

/// A request as its station answers it: with another cause, perhaps a negative one.
pub fn answer_to(request: &[u8], cause: u8, is_negative: bool) -> Vec<u8> {
    let mut bytes = request.to_vec();
    if let Some(place) = bytes.get_mut(CAUSE_INDEX) {
        *place = cause & 0x3F | *place & TEST | if is_negative { NEGATIVE } else { 0 };
    }
    bytes
}

/// End of initialisation by power on (M_EI_NA_1, 7.3.3.1).
pub fn initialisation_ended(common_address: u16) -> Vec<u8> {
    let [low, high] = common_address.to_le_bytes();
    vec![70, 1, cause::INITIALISED, 0, low, high, 0, 0, 0, 0]
}

fn object_bytes(object: &Object, time: Option<Cp56>) -> Vec<u8> {
    let [a0, a1, a2, _] = object.address.to_le_bytes();
    let mut bytes = vec![a0, a1, a2];
    let flags = object.flags.bits();
    match object.value {
        Value::Single(is_on) => bytes.push(u8::from(is_on) | flags),
        Value::Double(state) => bytes.push(state & 0b11 | flags),
        Value::Step { position, is_transient } => {
            let [position] = position.to_le_bytes();
            bytes.extend([position & 0x7F | u8::from(is_transient) << 7, flags]);
        }
        Value::Bits(bits) => {
            bytes.extend(bits.to_le_bytes());
            bytes.push(flags);
        }
        Value::Normalized(value) | Value::Scaled(value) => {
            bytes.extend(value.to_le_bytes());
            bytes.push(flags);
        }
        Value::Float(value) => {
            bytes.extend(value.to_le_bytes());
            bytes.push(flags);
        }
        Value::Counter { count, sequence, is_carried, is_adjusted } => {
            bytes.extend(count.to_le_bytes());
            let notes = u8::from(is_carried) << 5 | u8::from(is_adjusted) << 6;
            bytes.push(sequence & 0x1F | notes | flags);
        }
    }
    bytes.extend(time.into_iter().flat_map(Cp56::to_bytes));
    bytes
}

#[cfg(test)]
#[path = "encode_tests.rs"]
mod tests;
