//! Time zones by name of the IANA data base, and what their clocks skip and repeat.

use jiff::civil::DateTime;
use jiff::tz::{AmbiguousOffset, Offset, TimeZone, TimeZoneDatabase};

/// Bytes of the longest name of a zone.
const MAX_NAME_BYTES: usize = 64;

/// Time zone: a name of the IANA data base, or a fixed offset from UTC.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Zone {
    name: String,
    zone: TimeZone,
}

/// Instant of a local time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Resolved {
    /// Nanoseconds since 1970-01-01 00:00 UTC.
    pub nanos: i64,
    /// True where the clock showed the time twice, and nothing tells which is meant.
    pub is_ambiguous: bool,
}

impl Zone {
    /// UTC, which skips and repeats nothing.
    pub fn utc() -> Self {
        Self { name: "UTC".into(), zone: TimeZone::UTC }
    }

    /// Parses `Europe/Berlin`, `UTC` or `+05:30`.
    ///
    /// # Errors
    /// The unknown name, and examples of what is allowed.
    pub fn parse(text: &str) -> Result<Self, String> {
        let name = text.trim();
        let fault = || {
            format!(
                "'{}' is no zone: write a name of the IANA data base such as Europe/Berlin, UTC, \
                 or an offset such as +05:30",
                crate::shorten(text)
            )
        };
        if name.is_empty() || name.len() > MAX_NAME_BYTES {
            return Err(fault());
        }
        if name.eq_ignore_ascii_case("utc") || name.eq_ignore_ascii_case("z") {
            return Ok(Self::utc());
        }
        let zone = match name.strip_prefix(['+', '-']) {
            Some(digits) => {
                let (hours, minutes) = digits.split_once(':').unwrap_or((digits, "0"));
                let is_number =
                    |t: &str| (1..=2).contains(&t.len()) && t.bytes().all(|b| b.is_ascii_digit());
                if !is_number(hours) || !is_number(minutes) {
                    return Err(fault());
                }
                let part = |text: &str| text.parse::<i32>().map_err(|_| fault());
                let (hours, minutes) = (part(hours)?, part(minutes)?);
                let total = hours * 60 + minutes;
                if minutes > 59 || total > 14 * 60 {
                    return Err(fault());
                }
                let sign = if name.starts_with('-') { -60 } else { 60 };
                TimeZone::fixed(Offset::from_seconds(sign * total).map_err(|_| fault())?)
            }
            // The bundled one: a plugin's process may see no other.
            None => TimeZoneDatabase::bundled().get(name).map_err(|_| fault())?,
        };
        Ok(Self { name: zone.iana_name().unwrap_or(name).to_owned(), zone })
    }

    /// Name of the zone, for messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Writes an instant as local time of ISO 8601 with its offset; nothing out of reach.
    pub fn in_words(&self, nanos: i64) -> Option<String> {
        let zoned =
            jiff::Timestamp::from_nanosecond(nanos.into()).ok()?.to_zoned(self.zone.clone());
        jiff::fmt::strtime::format("%Y-%m-%dT%H:%M:%S%.f%:z", &zoned).ok()
    }

    /// Finds the instant of a local time, which is in nanoseconds from its 1970-01-01T00:00:00.
    ///
    /// # Errors
    /// That the clock never showed it, in words.
    pub fn resolve_nanos(&self, local: i64) -> Result<Resolved, String> {
        let time = jiff::Timestamp::from_nanosecond(local.into());
        let civil = time.map(|time| TimeZone::UTC.to_datetime(time));
        self.resolve(civil.map_err(|error| error.to_string())?, None, None)
    }

    /// Finds the instant of a local time. Of two the one that `abbreviation` names, else the first
    /// that is not before `last`.
    ///
    /// # Errors
    /// That the clock never showed it, in words.
    pub fn resolve(
        &self,
        civil: DateTime,
        last: Option<i64>,
        abbreviation: Option<&str>,
    ) -> Result<Resolved, String> {
        let ambiguous = self.zone.to_ambiguous_zoned(civil);
        let (candidates, is_ambiguous) = match ambiguous.offset() {
            AmbiguousOffset::Unambiguous { offset } => ([offset, offset], false),
            AmbiguousOffset::Fold { before, after } => ([before, after], true),
            AmbiguousOffset::Gap { .. } => {
                return Err(format!(
                    "'{civil}' never was in {}, whose clock skipped it: a clock that keeps winter \
                     time has an offset such as +01:00 as its zone",
                    self.name
                ));
            }
        };
        let instant = |offset: Offset| {
            let timestamp = offset.to_timestamp(civil).ok()?;
            Some((timestamp, i64::try_from(timestamp.as_nanosecond()).ok()?))
        };
        let fault = || format!("'{civil}' is out of reach");
        let [first, second] = candidates.map(instant);
        let ([first, second], mut is_doubtful) =
            ([first.ok_or_else(fault)?, second.ok_or_else(fault)?], is_ambiguous);
        let mut nanos = match last {
            Some(last) if first.1 < last => second.1,
            _ => first.1,
        };
        if let Some(abbreviation) = abbreviation.map(international) {
            let is_named = |timestamp| {
                let info = self.zone.to_offset_info(timestamp);
                info.abbreviation().eq_ignore_ascii_case(abbreviation)
            };
            let named = [first, second].into_iter().find(|(timestamp, _)| is_named(*timestamp));
            nanos = named.map(|(_, nanos)| nanos).ok_or_else(|| {
                let info = self.zone.to_offset_info(first.0);
                let (shown, said) = (crate::shorten(abbreviation), info.abbreviation());
                format!("its zone is {shown}, where {} had {said}: is `zone` right?", self.name)
            })?;
            is_doubtful = false;
        }
        Ok(Resolved { nanos, is_ambiguous: is_doubtful })
    }
}

/// The abbreviation of the IANA data base for one of German programs.
fn international(abbreviation: &str) -> &str {
    match abbreviation {
        "MEZ" => "CET",
        "MESZ" => "CEST",
        other => other,
    }
}

#[cfg(test)]
#[path = "zone_tests.rs"]
mod tests;
