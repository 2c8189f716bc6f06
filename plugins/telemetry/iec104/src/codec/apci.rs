//! Frames: I, S and U formats (IEC 60870-5-104, 5.1).

use super::FrameError;

const START: u8 = 0x68;
/// Start byte and length.
const PREFIX_BYTES: usize = 2;
const CONTROL_BYTES: usize = 4;
/// The longest data unit: a length of at most 253 less the control field.
pub const MAX_ASDU_BYTES: usize = 249;
/// Longest frame, in bytes.
pub const MAX_FRAME_BYTES: usize = PREFIX_BYTES + CONTROL_BYTES + MAX_ASDU_BYTES;
/// Sequence numbers have 15 bits.
const SEQUENCE_MASK: u16 = 0x7FFF;

/// A send or receive sequence number, modulo 2^15.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sequence(u16);

impl Sequence {
    /// From the low 15 bits.
    pub fn new(number: u16) -> Self {
        Self(number & SEQUENCE_MASK)
    }

    /// The number, 0 to 32767.
    pub fn number(self) -> u16 {
        self.0
    }

    /// The one after it.
    pub fn next(self) -> Self {
        Self::new(self.0.wrapping_add(1))
    }

    /// Steps from `earlier` to this one.
    pub fn since(self, earlier: Self) -> u16 {
        self.0.wrapping_sub(earlier.0) & SEQUENCE_MASK
    }

    fn from_bytes([low, high]: [u8; 2]) -> Self {
        Self(u16::from_le_bytes([low, high]) >> 1)
    }

    fn to_bytes(self) -> [u8; 2] {
        (self.0 << 1).to_le_bytes()
    }
}

/// Function of an unnumbered frame (5.1, figure 8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Function {
    /// Activation of data transfer, STARTDT act.
    StartAct,
    /// Confirmation of data transfer, STARTDT con.
    StartCon,
    /// Stop of data transfer, STOPDT act.
    StopAct,
    /// Confirmation of the stop, STOPDT con.
    StopCon,
    /// Test of the connection, TESTFR act.
    TestAct,
    /// Confirmation of the test, TESTFR con.
    TestCon,
}

impl Function {
    fn from_byte(byte: u8) -> Option<Self> {
        Some(match byte {
            0x07 => Self::StartAct,
            0x0B => Self::StartCon,
            0x13 => Self::StopAct,
            0x23 => Self::StopCon,
            0x43 => Self::TestAct,
            0x83 => Self::TestCon,
            _ => return None,
        })
    }

    fn to_byte(self) -> u8 {
        match self {
            Self::StartAct => 0x07,
            Self::StartCon => 0x0B,
            Self::StopAct => 0x13,
            Self::StopCon => 0x23,
            Self::TestAct => 0x43,
            Self::TestCon => 0x83,
        }
    }
}

/// Frame of any format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frame<'a> {
    /// Numbered information transfer (format I).
    Information {
        /// N(S): number of this frame.
        send: Sequence,
        /// N(R): the frame that its sender expects next.
        receive: Sequence,
        /// The data unit, at most [`MAX_ASDU_BYTES`].
        asdu: &'a [u8],
    },
    /// Numbered supervision: N(R) alone.
    Supervisory(Sequence),
    /// Unnumbered control (format U).
    Unnumbered(Function),
}

impl Frame<'_> {
    /// Appends the frame. A data unit is cut after [`MAX_ASDU_BYTES`].
    pub fn write(&self, into: &mut Vec<u8>) {
        let (control, asdu): ([u8; CONTROL_BYTES], &[u8]) = match *self {
            Self::Information { send, receive, asdu } => {
                let ([s0, s1], [r0, r1]) = (send.to_bytes(), receive.to_bytes());
                ([s0, s1, r0, r1], asdu.get(..MAX_ASDU_BYTES).unwrap_or(asdu))
            }
            Self::Supervisory(receive) => {
                let [r0, r1] = receive.to_bytes();
                ([0x01, 0, r0, r1], &[])
            }
            Self::Unnumbered(function) => ([function.to_byte(), 0, 0, 0], &[]),
        };
        let length = u8::try_from(asdu.len().saturating_add(CONTROL_BYTES)).unwrap_or(u8::MAX);
        into.extend([START, length]);
        into.extend(control);
        into.extend(asdu);
    }
}

/// The first frame of a stream, and how many bytes it takes; `None` while it is
/// not whole.
///
/// # Errors
/// [`FrameError`], as soon as it shows, for what can never become a frame.
pub fn split_frame(bytes: &[u8]) -> Result<Option<(Frame<'_>, usize)>, FrameError> {
    let Some((&start, rest)) = bytes.split_first() else { return Ok(None) };
    if start != START {
        return Err(FrameError::Start(start));
    }
    let Some((&length, rest)) = rest.split_first() else { return Ok(None) };
    if !(CONTROL_BYTES..=CONTROL_BYTES + MAX_ASDU_BYTES).contains(&usize::from(length)) {
        return Err(FrameError::Length(length));
    }
    let Some(body) = rest.get(..usize::from(length)) else { return Ok(None) };
    let Some((&control, asdu)) = body.split_first_chunk::<CONTROL_BYTES>() else {
        return Err(FrameError::Length(length));
    };
    let frame = match (control, asdu) {
        ([s0, s1, r0, r1], [_, ..]) if s0 & 1 == 0 && r0 & 1 == 0 => Frame::Information {
            send: Sequence::from_bytes([s0, s1]),
            receive: Sequence::from_bytes([r0, r1]),
            asdu,
        },
        ([0x01, 0, r0, r1], []) if r0 & 1 == 0 => {
            Frame::Supervisory(Sequence::from_bytes([r0, r1]))
        }
        ([function, 0, 0, 0], []) if let Some(function) = Function::from_byte(function) => {
            Frame::Unnumbered(function)
        }
        _ => return Err(FrameError::Control(control, length)),
    };
    Ok(Some((frame, usize::from(length).saturating_add(PREFIX_BYTES))))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn written(frame: Frame<'_>) -> Vec<u8> {
        let mut bytes = Vec::new();
        frame.write(&mut bytes);
        bytes
    }

    #[test]
    fn frames_are_those_of_the_standard() {
        let cases = [
            (Frame::Unnumbered(Function::StartAct), vec![0x68, 4, 0x07, 0, 0, 0]),
            (Frame::Unnumbered(Function::StartCon), vec![0x68, 4, 0x0B, 0, 0, 0]),
            (Frame::Unnumbered(Function::StopAct), vec![0x68, 4, 0x13, 0, 0, 0]),
            (Frame::Unnumbered(Function::StopCon), vec![0x68, 4, 0x23, 0, 0, 0]),
            (Frame::Unnumbered(Function::TestAct), vec![0x68, 4, 0x43, 0, 0, 0]),
            (Frame::Unnumbered(Function::TestCon), vec![0x68, 4, 0x83, 0, 0, 0]),
            (Frame::Supervisory(Sequence::new(32767)), vec![0x68, 4, 1, 0, 0xFE, 0xFF]),
            (
                Frame::Information {
                    send: Sequence::new(1),
                    receive: Sequence::new(128),
                    asdu: &[7],
                },
                vec![0x68, 5, 2, 0, 0, 1, 7],
            ),
        ];
        for (frame, bytes) in cases {
            assert_eq!(written(frame), bytes, "{frame:?}");
            assert_eq!(split_frame(&bytes), Ok(Some((frame, bytes.len()))), "{bytes:02X?}");
        }
    }

    #[test]
    fn what_is_no_frame_is_named() {
        let cases: [(&[u8], FrameError); 9] = [
            (&[0x10], FrameError::Start(0x10)),
            (&[0x68, 3], FrameError::Length(3)),
            (&[0x68, 254], FrameError::Length(254)),
            // An I frame without data, S and U frames with some, odd functions.
            (&[0x68, 4, 0, 0, 0, 0], FrameError::Control([0, 0, 0, 0], 4)),
            (&[0x68, 5, 1, 0, 0, 0, 9], FrameError::Control([1, 0, 0, 0], 5)),
            (&[0x68, 5, 7, 0, 0, 0, 9], FrameError::Control([7, 0, 0, 0], 5)),
            (&[0x68, 4, 0x0F, 0, 0, 0], FrameError::Control([0x0F, 0, 0, 0], 4)),
            (&[0x68, 4, 7, 0, 2, 0], FrameError::Control([7, 0, 2, 0], 4)),
            (&[0x68, 5, 0, 0, 1, 0, 9], FrameError::Control([0, 0, 1, 0], 5)),
        ];
        for (bytes, error) in cases {
            assert_eq!(split_frame(bytes), Err(error), "{bytes:02X?}");
        }
    }

    #[test]
    fn sequence_numbers_wrap_at_two_to_the_fifteenth() {
        let last = Sequence::new(32767);
        assert_eq!(last.next(), Sequence::new(0));
        assert_eq!(last.next().since(last), 1);
        assert_eq!(last.since(last.next()), 32767);
    }

    proptest! {
        #[test]
        fn any_bytes_are_a_frame_or_named(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
            if let Ok(Some((frame, taken))) = split_frame(&bytes) {
                prop_assert_eq!(written(frame), &bytes[..taken]);
            }
        }

        #[test]
        fn a_frame_is_whole_only_at_its_end(
            send in 0_u16..32768,
            receive in 0_u16..32768,
            asdu in prop::collection::vec(any::<u8>(), 1..=MAX_ASDU_BYTES),
        ) {
            let frame = Frame::Information {
                send: Sequence::new(send),
                receive: Sequence::new(receive),
                asdu: &asdu,
            };
            let bytes = written(frame);
            for end in 0..bytes.len() {
                prop_assert_eq!(split_frame(&bytes[..end]), Ok(None));
            }
            prop_assert_eq!(split_frame(&bytes), Ok(Some((frame, bytes.len()))));
        }
    }
}
