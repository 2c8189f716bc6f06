//! Information elements: values and their quality (IEC 60870-5-101, 7.2.6).

/// A value as the station sent it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Single point (SPI, 7.2.6.1).
    Single(bool),
    /// Double point (DPI, 7.2.6.2): 0 intermediate, 1 off, 2 on, 3 bad state.
    Double(u8),
    /// Step position (VTI, 7.2.6.5).
    Step {
        /// Position of the step, -64 to 63.
        position: i8,
        /// Reports whether the equipment is moving.
        is_transient: bool,
    },
    /// A string of bits (BSI, 7.2.6.13), packed single points (SCD, 7.2.6.40) or
    /// relays' start and output circuits (SPE, OCI).
    Bits(u32),
    /// Normalised value (NVA, 7.2.6.6): -1 to 1 less 2^-15, in units of 2^-15.
    Normalized(i16),
    /// Scaled value (SVA, 7.2.6.7).
    Scaled(i16),
    /// Short floating point (7.2.6.8).
    Float(f32),
    /// Binary counter reading (BCR, 7.2.6.9).
    Counter {
        /// Count of the counter.
        count: i32,
        /// Sequence number, 0 to 31.
        sequence: u8,
        /// CY: it passed its largest value since the last reading.
        is_carried: bool,
        /// CA: it was set anew since the last reading.
        is_adjusted: bool,
    },
}

/// Quality bits (QDS, 7.2.6.3; SIQ, DIQ, QDP and SEP have some of them; a
/// counter only IV).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags(u8);

impl Flags {
    const OVERFLOW: u8 = 0x01;
    const ELAPSED_INVALID: u8 = 0x08;
    const BLOCKED: u8 = 0x10;
    const SUBSTITUTED: u8 = 0x20;
    const NOT_TOPICAL: u8 = 0x40;
    const INVALID: u8 = 0x80;

    /// From a quality byte, of which only these bits count.
    fn new(byte: u8, counting: u8) -> Self {
        Self(byte & counting)
    }

    /// OV: beyond the range of the element.
    pub fn is_overflow(self) -> bool {
        self.0 & Self::OVERFLOW != 0
    }

    /// EI: the elapsed time of a protection event is not valid.
    pub fn is_elapsed_invalid(self) -> bool {
        self.0 & Self::ELAPSED_INVALID != 0
    }

    /// BL: blocked for transmission; holds the value from before.
    pub fn is_blocked(self) -> bool {
        self.0 & Self::BLOCKED != 0
    }

    /// SB: put in by an operator or automation.
    pub fn is_substituted(self) -> bool {
        self.0 & Self::SUBSTITUTED != 0
    }

    /// NT: not updated when it should have been.
    pub fn is_not_topical(self) -> bool {
        self.0 & Self::NOT_TOPICAL != 0
    }

    /// Reports an invalid value (bit IV).
    pub fn is_invalid(self) -> bool {
        self.0 & Self::INVALID != 0
    }

    /// The bits as in a quality descriptor.
    pub fn bits(self) -> u8 {
        self.0
    }
}

/// Bits of a quality descriptor with all there is.
const QDS: u8 = Flags::OVERFLOW | POINT_QUALITY;
/// Bits that share a byte with a single or double point.
const POINT_QUALITY: u8 = Flags::BLOCKED | Flags::SUBSTITUTED | Flags::NOT_TOPICAL | Flags::INVALID;
/// Bits of protection equipment.
const PROTECTION_QUALITY: u8 = Flags::ELAPSED_INVALID | POINT_QUALITY;

/// Encoding of a value in its bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Element {
    Single,
    Double,
    Step,
    Bits,
    Normalized,
    /// Without a quality descriptor.
    NormalizedBare,
    Scaled,
    Float,
    Counter,
    /// Sixteen single points with change detection.
    Packed,
    /// A protection event, with its elapsed time.
    ProtectionEvent,
    /// Start events or output circuits of protection, with a time.
    ProtectionBits,
}

impl Element {
    /// Bytes, without a time tag.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Single | Self::Double => 1,
            Self::Step | Self::NormalizedBare => 2,
            Self::Normalized | Self::Scaled | Self::ProtectionEvent => 3,
            Self::ProtectionBits => 4,
            Self::Bits | Self::Float | Self::Counter | Self::Packed => 5,
        }
    }

    /// Value and quality from the first of these bytes; nothing if there are
    /// less than [`Element::bytes`].
    pub(super) fn read(self, bytes: &[u8]) -> Option<(Value, Flags)> {
        Some(match (self, bytes) {
            (Self::Single, &[siq, ..]) => {
                (Value::Single(siq & 1 != 0), Flags::new(siq, POINT_QUALITY))
            }
            (Self::Double, &[diq, ..]) => {
                (Value::Double(diq & 0b11), Flags::new(diq, POINT_QUALITY))
            }
            (Self::Step, &[vti, qds, ..]) => (step(vti), Flags::new(qds, QDS)),
            (Self::Bits, &[b0, b1, b2, b3, qds, ..]) => {
                (Value::Bits(u32::from_le_bytes([b0, b1, b2, b3])), Flags::new(qds, QDS))
            }
            (Self::NormalizedBare, &[b0, b1, ..]) => {
                (Value::Normalized(i16::from_le_bytes([b0, b1])), Flags::default())
            }
            (Self::Normalized, &[b0, b1, qds, ..]) => {
                (Value::Normalized(i16::from_le_bytes([b0, b1])), Flags::new(qds, QDS))
            }
            (Self::Scaled, &[b0, b1, qds, ..]) => {
                (Value::Scaled(i16::from_le_bytes([b0, b1])), Flags::new(qds, QDS))
            }
            (Self::Float, &[b0, b1, b2, b3, qds, ..]) => {
                (Value::Float(f32::from_le_bytes([b0, b1, b2, b3])), Flags::new(qds, QDS))
            }
            (Self::Counter, &[b0, b1, b2, b3, notes, ..]) => (
                Value::Counter {
                    count: i32::from_le_bytes([b0, b1, b2, b3]),
                    sequence: notes & 0x1F,
                    is_carried: notes & 0x20 != 0,
                    is_adjusted: notes & 0x40 != 0,
                },
                Flags::new(notes, Flags::INVALID),
            ),
            // The two bytes that say which points changed are left out.
            (Self::Packed, &[s0, s1, _, _, qds, ..]) => {
                (Value::Bits(u32::from(u16::from_le_bytes([s0, s1]))), Flags::new(qds, QDS))
            }
            (Self::ProtectionEvent, &[sep, _, _, ..]) => {
                (Value::Double(sep & 0b11), Flags::new(sep, PROTECTION_QUALITY))
            }
            (Self::ProtectionBits, &[bits, qdp, _, _, ..]) => {
                (Value::Bits(u32::from(bits)), Flags::new(qdp, PROTECTION_QUALITY))
            }
            _ => return None,
        })
    }
}

/// Seven bits with sign, and the transient bit above.
fn step(vti: u8) -> Value {
    let doubled = i8::from_le_bytes([vti << 1]);
    Value::Step { position: doubled >> 1, is_transient: vti & 0x80 != 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_where_the_standard_has_them() {
        let cases: [(Element, &[u8], Value, u8); 20] = [
            (Element::Single, &[0x01], Value::Single(true), 0),
            (Element::Single, &[0xFE], Value::Single(false), 0xF0),
            (Element::Double, &[0x02], Value::Double(2), 0),
            (Element::Double, &[0x8F], Value::Double(3), 0x80),
            (Element::Step, &[0x3F, 0], Value::Step { position: 63, is_transient: false }, 0),
            (Element::Step, &[0x40, 0], Value::Step { position: -64, is_transient: false }, 0),
            (Element::Step, &[0xFF, 1], Value::Step { position: -1, is_transient: true }, 1),
            (Element::Bits, &[1, 2, 3, 4, 0x10], Value::Bits(0x0403_0201), 0x10),
            (Element::Normalized, &[0, 0x80, 0xFF], Value::Normalized(-32768), 0xF1),
            (Element::NormalizedBare, &[0, 0x40], Value::Normalized(16384), 0),
            (Element::Scaled, &[0xFE, 0xFF, 0x40], Value::Scaled(-2), 0x40),
            // 230.5 is 43668000h by IEEE 754.
            (Element::Float, &[0, 0x80, 0x66, 0x43, 0x20], Value::Float(230.5), 0x20),
            (Element::Packed, &[5, 0x80, 0xFF, 0xFF, 0x80], Value::Bits(0x8005), 0x80),
            (Element::ProtectionEvent, &[0x0A, 1, 2], Value::Double(2), 0x08),
            (Element::ProtectionEvent, &[0xF1, 1, 2], Value::Double(1), 0xF0),
            (Element::ProtectionBits, &[0x3F, 0x00, 1, 2], Value::Bits(0x3F), 0),
            (Element::ProtectionBits, &[0x01, 0xFF, 1, 2], Value::Bits(1), 0xF8),
            (
                Element::Counter,
                &[0xFF, 0xFF, 0xFF, 0xFF, 0x1F],
                Value::Counter { count: -1, sequence: 31, is_carried: false, is_adjusted: false },
                0,
            ),
            (
                Element::Counter,
                &[7, 0, 0, 0, 0xA0],
                Value::Counter { count: 7, sequence: 0, is_carried: true, is_adjusted: false },
                0x80,
            ),
            (
                Element::Counter,
                &[7, 0, 0, 0, 0x41],
                Value::Counter { count: 7, sequence: 1, is_carried: false, is_adjusted: true },
                0,
            ),
        ];
        for (element, bytes, value, flags) in cases {
            assert_eq!(bytes.len(), element.bytes());
            assert_eq!(element.read(bytes), Some((value, Flags(flags))), "{element:?}");
            assert_eq!(element.read(&bytes[1..]), None, "{element:?} cut short");
        }
    }
}
