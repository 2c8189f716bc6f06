//! Flags of a sample: order of arrival or of source time, and origin.

use std::ops::{BitOr, BitOrAssign};

use busbar_plugin_abi as abi;

/// Set of flags of a sample; empty for a live value in order of arrival.
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
    /// Empty set: a live value in order of arrival.
    pub const LIVE: Self = Self(0);
    /// Flag of a sample out of a buffer (buffered report, stored or historical value): ordered by
    /// source time. All other samples count in order of arrival.
    pub const BUFFERED: Self = Self(abi::BUSBAR_SAMPLE_BUFFERED);
    /// Flag of a source time that settings or protocol promise, and that is missing or unreadable.
    /// A good value becomes [`Quality::Uncertain`](crate::Quality::Uncertain)
    /// ([`Reason::SourceTime`](crate::Reason::SourceTime)).
    pub const TIME_UNUSABLE: Self = Self(abi::BUSBAR_SAMPLE_TIME_UNUSABLE);
    /// Origin of a value that a person or program substituted (IEC 61850-7-3 `source`, IEC
    /// 60870-5-101 SB).
    pub const SUBSTITUTED: Self = Self(abi::BUSBAR_ORIGIN_SUBSTITUTED);
    /// Origin of a value from a device under test (IEC 61850-7-3 `test`, IEC 60870-5-101 T bit of
    /// the cause).
    pub const TEST: Self = Self(abi::BUSBAR_ORIGIN_TEST);
    /// Origin of a value that a simulator made.
    pub const SIMULATED: Self = Self(abi::BUSBAR_ORIGIN_SIMULATED);
    /// Origin of a value that is replayed from a recording.
    pub const RECORDED: Self = Self(abi::BUSBAR_ORIGIN_RECORDED);
    /// Origin of a value that its source calls historical (Sparkplug B `is_historical`).
    pub const HISTORICAL: Self = Self(abi::BUSBAR_ORIGIN_HISTORICAL);

    /// Creates a set from its bits in the ABI.
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// Returns the bits of the set in the ABI.
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
