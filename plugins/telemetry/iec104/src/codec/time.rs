//! Time tags (IEC 60870-5-101, 7.2.6.18 and 7.2.6.19), to and from system time.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use super::calendar::{civil_from_days, days_from_civil};

const MILLIS_PER_MINUTE: i64 = 60_000;
const MILLIS_PER_HOUR: i64 = 60 * MILLIS_PER_MINUTE;
const MILLIS_PER_DAY: i64 = 24 * MILLIS_PER_HOUR;

/// Time zone of a station's time tags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Zone {
    /// UTC, as recommended (IEC 60870-5-104, 7.6). There is no summer time.
    #[default]
    Utc,
    /// Local time: so many minutes ahead of UTC, and one hour more while the
    /// tag says summer time.
    Local {
        /// Minutes ahead of UTC in winter.
        offset_minutes: i16,
    },
}

impl Zone {
    fn ahead_millis(self, is_summer: bool) -> i64 {
        match self {
            Self::Utc => 0,
            Self::Local { offset_minutes } => {
                let summer = if is_summer { MILLIS_PER_HOUR } else { 0 };
                i64::from(offset_minutes) * MILLIS_PER_MINUTE + summer
            }
        }
    }
}

/// Three bytes: milliseconds and minute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cp24 {
    /// Milliseconds of the minute, 0 to 59999 where valid.
    pub millis: u16,
    /// Minute, 0 to 59 where valid.
    pub minute: u8,
    /// IV: the clock was not set.
    pub is_invalid: bool,
}

/// Seven bytes: milliseconds to year.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cp56 {
    /// Milliseconds of the minute, minute, and IV.
    pub within_hour: Cp24,
    /// Hour, 0 to 23 where valid.
    pub hour: u8,
    /// Summer time flag, SU.
    pub is_summer: bool,
    /// Day of month, 1 to 31 where valid.
    pub day: u8,
    /// Day of week, 1 Monday to 7 Sunday, 0 not used.
    pub weekday: u8,
    /// Month, 1 to 12 where valid.
    pub month: u8,
    /// Years since 2000, 0 to 99 where valid.
    pub year: u8,
}

/// A time tag of either length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeTag {
    /// Time tag of three bytes.
    Cp24(Cp24),
    /// Time tag of seven bytes.
    Cp56(Cp56),
}

impl TimeTag {
    /// The instant, or nothing where the tag is marked invalid or names no
    /// instant. A short tag names the one nearest to `received`.
    pub fn resolve(self, received: SystemTime, zone: Zone) -> Option<SystemTime> {
        match self {
            Self::Cp24(tag) => tag.resolve(received, zone),
            Self::Cp56(tag) => tag.resolve(zone),
        }
    }
}

impl Cp24 {
    pub(super) const BYTES: usize = 3;

    pub(super) fn from_bytes([low, high, minute]: [u8; Self::BYTES]) -> Self {
        Self {
            millis: u16::from_le_bytes([low, high]),
            minute: minute & 0x3F,
            is_invalid: minute & 0x80 != 0,
        }
    }

    fn to_bytes(self) -> [u8; Self::BYTES] {
        let [low, high] = self.millis.to_le_bytes();
        [low, high, self.minute & 0x3F | u8::from(self.is_invalid) << 7]
    }

    /// Since the full hour; nothing where the tag is not valid.
    fn since_hour(self) -> Option<i64> {
        let is_valid =
            !self.is_invalid && i64::from(self.millis) < MILLIS_PER_MINUTE && self.minute < 60;
        is_valid.then(|| i64::from(self.minute) * MILLIS_PER_MINUTE + i64::from(self.millis))
    }

    fn resolve(self, received: SystemTime, zone: Zone) -> Option<SystemTime> {
        let wanted = self.since_hour()?;
        // Summer time moves by whole hours, and the hour is not in the tag.
        let ahead = zone.ahead_millis(false);
        let received = unix_millis(received)?.checked_add(ahead)?;
        let now = received.rem_euclid(MILLIS_PER_HOUR);
        let half = MILLIS_PER_HOUR / 2;
        let distance = (wanted - now + half).rem_euclid(MILLIS_PER_HOUR) - half;
        system_time(received.checked_add(distance)?.checked_sub(ahead)?)
    }
}

impl Cp56 {
    pub(super) const BYTES: usize = 7;

    pub(super) fn from_bytes(bytes: [u8; Self::BYTES]) -> Self {
        let [b0, b1, b2, hour, day, month, year] = bytes;
        Self {
            within_hour: Cp24::from_bytes([b0, b1, b2]),
            hour: hour & 0x1F,
            is_summer: hour & 0x80 != 0,
            day: day & 0x1F,
            weekday: day >> 5,
            month: month & 0x0F,
            year: year & 0x7F,
        }
    }

    /// Encodes the time tag as seven bytes.
    pub fn to_bytes(self) -> [u8; Self::BYTES] {
        let [b0, b1, b2] = self.within_hour.to_bytes();
        let hour = self.hour & 0x1F | u8::from(self.is_summer) << 7;
        let day = self.day & 0x1F | self.weekday << 5;
        [b0, b1, b2, hour, day, self.month & 0x0F, self.year & 0x7F]
    }

    /// A valid tag without weekday, in winter time; nothing outside of the
    /// years 2000 to 2099.
    pub fn from_system_time(time: SystemTime, zone: Zone) -> Option<Self> {
        let millis = unix_millis(time)?.checked_add(zone.ahead_millis(false))?;
        let (days, of_day) = (millis.div_euclid(MILLIS_PER_DAY), millis.rem_euclid(MILLIS_PER_DAY));
        let (year, month, day) = civil_from_days(days);
        if !(2000..2100).contains(&year) {
            return None;
        }
        let within_hour = Cp24 {
            millis: u16::try_from(of_day % MILLIS_PER_MINUTE).ok()?,
            minute: u8::try_from(of_day % MILLIS_PER_HOUR / MILLIS_PER_MINUTE).ok()?,
            is_invalid: false,
        };
        Some(Self {
            within_hour,
            hour: u8::try_from(of_day / MILLIS_PER_HOUR).ok()?,
            is_summer: false,
            day,
            weekday: 0,
            month,
            year: u8::try_from(year - 2000).ok()?,
        })
    }

    fn resolve(self, zone: Zone) -> Option<SystemTime> {
        let since_hour = self.within_hour.since_hour()?;
        if self.hour > 23 || self.year > 99 {
            return None;
        }
        let year = 2000 + i64::from(self.year);
        let days = days_from_civil(year, self.month, self.day);
        // Refuses day 0, 31 April and the like.
        if civil_from_days(days) != (year, self.month, self.day) {
            return None;
        }
        let local = days * MILLIS_PER_DAY + i64::from(self.hour) * MILLIS_PER_HOUR + since_hour;
        system_time(local - zone.ahead_millis(self.is_summer))
    }
}

fn unix_millis(time: SystemTime) -> Option<i64> {
    i64::try_from(time.duration_since(UNIX_EPOCH).ok()?.as_millis()).ok()
}

fn system_time(unix_millis: i64) -> Option<SystemTime> {
    UNIX_EPOCH.checked_add(Duration::from_millis(u64::try_from(unix_millis).ok()?))
}

#[cfg(test)]
#[path = "time_tests.rs"]
mod tests;
