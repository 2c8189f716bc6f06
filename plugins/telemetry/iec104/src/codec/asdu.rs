//! Data units: header and information objects (IEC 60870-5-101, 7.2 and 7.3, with
//! the field sizes of IEC 60870-5-104, 7: cause 2 bytes, common address 2, object
//! address 3).

use super::AsduError;
use super::element::{Element, Flags, Value};
use super::time::{Cp24, Cp56, TimeTag};

const HEADER_BYTES: usize = 6;
const ADDRESS_BYTES: usize = 3;
/// Object address and qualifier of an interrogation, or cause of an initialisation.
const QUALIFIED_BYTES: usize = ADDRESS_BYTES + 1;
/// The last object address.
const MAX_ADDRESS: u32 = 0xFF_FFFF;

/// Causes of transmission (IEC 60870-5-101, 7.2.3).
pub mod cause {
    /// Periodic or cyclic transmission.
    pub const PERIODIC: u8 = 1;
    /// Background scan of values.
    pub const BACKGROUND: u8 = 2;
    /// Spontaneous transmission of a change.
    pub const SPONTANEOUS: u8 = 3;
    /// Initialisation of the station.
    pub const INITIALISED: u8 = 4;
    /// Data that was requested.
    pub const REQUESTED: u8 = 5;
    /// Activation of a command.
    pub const ACTIVATION: u8 = 6;
    /// Confirmation of an activation.
    pub const ACTIVATION_CONFIRMED: u8 = 7;
    /// Termination of an activation.
    pub const ACTIVATION_TERMINATED: u8 = 10;
    /// Return information caused by a remote command.
    pub const RETURN_REMOTE: u8 = 11;
    /// Return information caused by a local command.
    pub const RETURN_LOCAL: u8 = 12;
    /// Interrogated by station interrogation; up to 36, group 16.
    pub const INTERROGATED: u8 = 20;
    /// Last of the interrogation's groups.
    pub const INTERROGATED_LAST: u8 = 36;
    /// Requested by counter interrogation; up to 41, group 4.
    pub const COUNTERS: u8 = 37;
    /// Last of the counters' groups.
    pub const COUNTERS_LAST: u8 = 41;
    /// The type is not known.
    pub const UNKNOWN_TYPE: u8 = 44;
    /// The cause is not known.
    pub const UNKNOWN_CAUSE: u8 = 45;
    /// The common address is not known.
    pub const UNKNOWN_COMMON_ADDRESS: u8 = 46;
    /// The object address is not known.
    pub const UNKNOWN_OBJECT_ADDRESS: u8 = 47;
}

/// The six bytes before the objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Type identification of the data unit.
    pub type_id: u8,
    /// SQ: one address, then elements at that address and those after it.
    pub is_sequence: bool,
    /// Objects or elements, 0 to 127.
    pub count: u8,
    /// Cause of transmission, 0 to 63; see [`cause`].
    pub cause: u8,
    /// P/N: a negative confirmation.
    pub is_negative: bool,
    /// T: sent as a test.
    pub is_test: bool,
    /// Originator address; 0 is not used.
    pub originator: u8,
    /// Common address of the station; 65535 is all of them.
    pub common_address: u16,
}

/// A data unit whose length fits what it claims to hold.
#[derive(Clone, Copy, Debug)]
pub struct Asdu<'a> {
    /// Header of the data unit.
    pub header: Header,
    /// Body of the data unit.
    pub body: Body<'a>,
}

/// Body of a data unit.
#[derive(Clone, Copy, Debug)]
pub enum Body<'a> {
    /// Information objects with values.
    Objects(Objects<'a>),
    /// End of initialisation (M_EI_NA_1).
    InitialisationEnded,
    /// An answer to an interrogation (C_IC_NA_1).
    Interrogation,
    /// An answer to a counter interrogation (C_CI_NA_1).
    CounterInterrogation,
    /// An answer to a clock synchronisation (C_CS_NA_1).
    ClockSync,
    /// A type that is no monitoring, or none of ours.
    Other,
}

/// Information object with one value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    /// Information object address, at most 16777215.
    pub address: u32,
    /// Value of the object.
    pub value: Value,
    /// Quality of the value.
    pub flags: Flags,
    /// Time tag, where the type has one.
    pub time: Option<TimeTag>,
}

/// Values of a data unit, an iterator.
#[derive(Clone, Copy, Debug)]
pub struct Objects<'a> {
    shape: Shape,
    /// The address of the next element of a sequence.
    next_address: Option<u32>,
    left: u8,
    bytes: &'a [u8],
}

/// Layout of an object after its address, by type.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Shape {
    element: Element,
    time: Time,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Time {
    None,
    Short,
    Long,
}

impl Shape {
    /// The monitoring types (IEC 60870-5-101, 7.2.1.1; IEC 60870-5-104, 6).
    fn from_type_id(type_id: u8) -> Option<Self> {
        let (element, time) = match type_id {
            1 => (Element::Single, Time::None),
            2 => (Element::Single, Time::Short),
            3 => (Element::Double, Time::None),
            4 => (Element::Double, Time::Short),
            5 => (Element::Step, Time::None),
            6 => (Element::Step, Time::Short),
            7 => (Element::Bits, Time::None),
            8 => (Element::Bits, Time::Short),
            9 => (Element::Normalized, Time::None),
            10 => (Element::Normalized, Time::Short),
            11 => (Element::Scaled, Time::None),
            12 => (Element::Scaled, Time::Short),
            13 => (Element::Float, Time::None),
            14 => (Element::Float, Time::Short),
            15 => (Element::Counter, Time::None),
            16 => (Element::Counter, Time::Short),
            17 => (Element::ProtectionEvent, Time::Short),
            18 | 19 => (Element::ProtectionBits, Time::Short),
            20 => (Element::Packed, Time::None),
            21 => (Element::NormalizedBare, Time::None),
            30 => (Element::Single, Time::Long),
            31 => (Element::Double, Time::Long),
            32 => (Element::Step, Time::Long),
            33 => (Element::Bits, Time::Long),
            34 => (Element::Normalized, Time::Long),
            35 => (Element::Scaled, Time::Long),
            36 => (Element::Float, Time::Long),
            37 => (Element::Counter, Time::Long),
            38 => (Element::ProtectionEvent, Time::Long),
            39 | 40 => (Element::ProtectionBits, Time::Long),
            _ => return None,
        };
        Some(Self { element, time })
    }

    fn bytes(self) -> usize {
        let time = match self.time {
            Time::None => 0,
            Time::Short => Cp24::BYTES,
            Time::Long => Cp56::BYTES,
        };
        self.element.bytes().saturating_add(time)
    }
}

impl<'a> Asdu<'a> {
    /// Parses a data unit.
    ///
    /// # Errors
    /// [`AsduError`]. Types that are not known are no error: [`Body::Other`].
    pub fn parse(bytes: &'a [u8]) -> Result<Self, AsduError> {
        let Some((&header, rest)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
            return Err(AsduError::Header(bytes.len()));
        };
        let [type_id, qualifier, cause, originator, low, high] = header;
        let header = Header {
            type_id,
            is_sequence: qualifier & 0x80 != 0,
            count: qualifier & 0x7F,
            cause: cause & 0x3F,
            is_negative: cause & 0x40 != 0,
            is_test: cause & 0x80 != 0,
            originator,
            common_address: u16::from_le_bytes([low, high]),
        };
        let body = match type_id {
            70 => single(&header, rest).map(|()| Body::InitialisationEnded)?,
            100 => single(&header, rest).map(|()| Body::Interrogation)?,
            101 => single(&header, rest).map(|()| Body::CounterInterrogation)?,
            103 => Body::ClockSync,
            _ => match Shape::from_type_id(type_id) {
                Some(shape) => Body::Objects(Objects::new(&header, shape, rest)?),
                None => Body::Other,
            },
        };
        Ok(Self { header, body })
    }
}

/// Checks a data unit that has one object address and one byte.
fn single(header: &Header, bytes: &[u8]) -> Result<(), AsduError> {
    let &Header { type_id, count, .. } = header;
    let wanted = QUALIFIED_BYTES;
    match (count, bytes.len()) {
        (0, _) => Err(AsduError::Empty(type_id)),
        (1, QUALIFIED_BYTES) => Ok(()),
        (_, found) => Err(AsduError::Length { type_id, count, wanted, found }),
    }
}

/// The common address of a data unit, wherever else it is at fault.
pub fn common_address_of(bytes: &[u8]) -> Option<u16> {
    let (&[.., low, high], _) = bytes.split_first_chunk::<HEADER_BYTES>()?;
    Some(u16::from_le_bytes([low, high]))
}

/// Reports whether the standard has a type that carries no values of the process: commands and
/// parameters that are mirrored, system information, file transfer (IEC 60870-5-101,
/// 7.2.1.1; IEC 60870-5-104, 6).
pub fn is_without_values(type_id: u8) -> bool {
    matches!(type_id, 45..=51 | 58..=64 | 70 | 100..=107 | 110..=113 | 120..=127)
}

impl<'a> Objects<'a> {
    fn new(header: &Header, shape: Shape, bytes: &'a [u8]) -> Result<Self, AsduError> {
        let &Header { type_id, is_sequence, count, .. } = header;
        if count == 0 {
            return Err(AsduError::Empty(type_id));
        }
        let objects = usize::from(count);
        let wanted = if is_sequence {
            objects.saturating_mul(shape.bytes()).saturating_add(ADDRESS_BYTES)
        } else {
            objects.saturating_mul(shape.bytes().saturating_add(ADDRESS_BYTES))
        };
        let fault = AsduError::Length { type_id, count, wanted, found: bytes.len() };
        if bytes.len() != wanted {
            return Err(fault);
        }
        let (next_address, bytes) = if is_sequence {
            let (first, elements) = split_address(bytes).ok_or(fault)?;
            if first.saturating_add(u32::from(count)) > MAX_ADDRESS.saturating_add(1) {
                return Err(AsduError::Address(first));
            }
            (Some(first), elements)
        } else {
            (None, bytes)
        };
        Ok(Self { shape, next_address, left: count, bytes })
    }
}

impl Iterator for Objects<'_> {
    type Item = Object;

    fn next(&mut self) -> Option<Object> {
        self.left = self.left.checked_sub(1)?;
        let (address, bytes) = match self.next_address {
            Some(address) => (address, self.bytes),
            None => split_address(self.bytes)?,
        };
        self.next_address = self.next_address.map(|address| address.saturating_add(1));
        let (object, rest) = bytes.split_at_checked(self.shape.bytes())?;
        self.bytes = rest;
        let (value, flags) = self.shape.element.read(object)?;
        let time = match self.shape.time {
            Time::None => None,
            Time::Short => Some(TimeTag::Cp24(Cp24::from_bytes(*object.last_chunk()?))),
            Time::Long => Some(TimeTag::Cp56(Cp56::from_bytes(*object.last_chunk()?))),
        };
        Some(Object { address, value, flags, time })
    }
}

fn split_address(bytes: &[u8]) -> Option<(u32, &[u8])> {
    let (&[a0, a1, a2], rest) = bytes.split_first_chunk::<ADDRESS_BYTES>()?;
    Some((u32::from_le_bytes([a0, a1, a2, 0]), rest))
}

#[cfg(test)]
#[path = "asdu_tests.rs"]
mod tests;
