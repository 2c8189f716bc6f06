//! Origin of a value: live, or substituted, under test, simulated, recorded, historical.

use core::fmt;
use core::ops::{BitOr, BitOrAssign};

/// A set of origins of a value; empty for a live one. Values that are worked out of
/// others have all origins of these.
///
/// ```
/// use busbar_types::Origin;
///
/// let origin = Origin::SIMULATED | Origin::TEST;
/// assert!(origin.contains(Origin::TEST) && !origin.is_live());
/// assert_eq!(origin.to_string(), "test, simulated");
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Origin(u8);

impl Origin {
    /// Measured now by the process itself.
    pub const LIVE: Self = Self(0);
    /// Put in place of the measured value by a person or program.
    pub const SUBSTITUTED: Self = Self(1 << 0);
    /// Sent by a device under test.
    pub const TEST: Self = Self(1 << 1);
    /// Made by a simulator, not measured.
    pub const SIMULATED: Self = Self(1 << 2);
    /// Replayed from a recording of values.
    pub const RECORDED: Self = Self(1 << 3);
    /// Value of the past, as its source marks it.
    pub const HISTORICAL: Self = Self(1 << 4);

    /// All origins, each as a set of its own, in the order of their bits.
    pub const ALL: [Self; 5] =
        [Self::SUBSTITUTED, Self::TEST, Self::SIMULATED, Self::RECORDED, Self::HISTORICAL];

    const NAMES: [&'static str; 5] = ["substituted", "test", "simulated", "recorded", "historical"];

    /// Creates a set from its bits; bits that no origin has are left out.
    #[inline]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits & ((1 << Self::ALL.len()) - 1))
    }

    /// Returns the bits of the set.
    #[inline]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Reports whether the value is live: no origin is set.
    #[inline]
    pub const fn is_live(self) -> bool {
        self.0 == 0
    }

    /// Reports whether all of these origins are set.
    pub const fn contains(self, origins: Self) -> bool {
        self.0 & origins.0 == origins.0
    }

    /// Returns those origins by which a value is none of the real plant now: test, simulated,
    /// recorded. A history of such values says nothing of live ones.
    #[must_use]
    pub const fn unreal(self) -> Self {
        Self(self.0 & (Self::TEST.0 | Self::SIMULATED.0 | Self::RECORDED.0))
    }

    /// Returns the origins of either set.
    #[must_use]
    #[inline]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Lists the names of the origins that are set.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let named = Self::ALL.into_iter().zip(Self::NAMES);
        named.filter(move |(origin, _)| self.contains(*origin)).map(|(_, name)| name)
    }

    /// Finds the origin of a name, such as `simulated`.
    pub fn from_name(name: &str) -> Option<Self> {
        let index = Self::NAMES.iter().position(|known| *known == name)?;
        Some(Self::ALL[index])
    }
}

impl BitOr for Origin {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        self.union(other)
    }
}

impl BitOrAssign for Origin {
    fn bitor_assign(&mut self, other: Self) {
        *self = self.union(other);
    }
}

impl fmt::Display for Origin {
    /// Writes the names of the origins with commas between; `live` without any.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_live() {
            return f.write_str("live");
        }
        for (index, name) in self.names().enumerate() {
            let comma = if index == 0 { "" } else { ", " };
            write!(f, "{comma}{name}")?;
        }
        Ok(())
    }
}
