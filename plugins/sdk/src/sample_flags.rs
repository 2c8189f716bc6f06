//! Flags of a sample: order of arrival or of source time, and origin.

use std::ops::{BitOr, BitOrAssign};

use busbar_plugin_abi as abi;

/// A set of flags of a sample; none for a live value in order of arrival.
///
/// ```
/// use busbar_plugin_sdk::SampleFlags;
///
/// let flags = SampleFlags::BUFFERED | SampleFlags::HISTORICAL;
/// assert!(flags.contains(SampleFlags::BUFFERED));
/// assert!(!flags.contains(SampleFlags::TEST));
/// assert_eq!(SampleFlags::default(), SampleFlags::LIVE);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SampleFlags(u8);

impl SampleFlags {
    /// A live value in order of arrival: no flag at all.
    pub const LIVE: Self = Self(0);
    /// Comes out of a buffer (buffered report, stored or historical value): ordered by
    /// source time. All other samples count in order of arrival.
    pub const BUFFERED: Self = Self(abi::BUSBAR_SAMPLE_BUFFERED);
    /// A source time is promised by settings or protocol and is missing or unreadable: a
    /// good value becomes [`Quality::Uncertain`](crate::Quality::Uncertain)
    /// ([`Reason::SourceTime`](crate::Reason::SourceTime)).
    pub const TIME_UNUSABLE: Self = Self(abi::BUSBAR_SAMPLE_TIME_UNUSABLE);
    /// Put in place of the measured value by a person or program (IEC 61850-7-3 `source`,
    /// IEC 60870-5-101 SB).
    pub const SUBSTITUTED: Self = Self(abi::BUSBAR_ORIGIN_SUBSTITUTED);
    /// Sent by a device under test (IEC 61850-7-3 `test`, IEC 60870-5-101 T bit of the cause).
    pub const TEST: Self = Self(abi::BUSBAR_ORIGIN_TEST);
    /// Made by a simulator.
    pub const SIMULATED: Self = Self(abi::BUSBAR_ORIGIN_SIMULATED);
    /// Replayed from a recording.
    pub const RECORDED: Self = Self(abi::BUSBAR_ORIGIN_RECORDED);
    /// Of the past, as its source says (Sparkplug B `is_historical`).
    pub const HISTORICAL: Self = Self(abi::BUSBAR_ORIGIN_HISTORICAL);

    /// Flags of a sample as the ABI has them.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// Bits of the ABI.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Reports whether all of these flags are set.
    pub const fn contains(self, flags: Self) -> bool {
        self.0 & flags.0 == flags.0
    }
}

impl BitOr for SampleFlags {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl BitOrAssign for SampleFlags {
    fn bitor_assign(&mut self, other: Self) {
        self.0 |= other.0;
    }
}
