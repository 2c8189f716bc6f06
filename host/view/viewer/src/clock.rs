//! Time of day for the status bar; running seconds reveal a frozen picture.

use busbar_tags::SourceTime;
use jiff::Timestamp;
use jiff::tz::TimeZone;

/// Writes the time of day by the local clock, with seconds.
pub(crate) fn time_of_day(wall_clock: SourceTime) -> String {
    time_in(wall_clock, TimeZone::system())
}

fn time_in(wall_clock: SourceTime, zone: TimeZone) -> String {
    let timestamp = Timestamp::from_nanosecond(i128::from(wall_clock.0)).unwrap_or_default();
    timestamp.to_zoned(zone).strftime("%H:%M:%S").to_string()
}

#[cfg(test)]
mod tests {
    use jiff::tz::offset;

    use super::*;

    #[test]
    fn the_clock_has_seconds_of_its_zone() {
        let at = SourceTime(1_700_000_000_999_999_999);
        assert_eq!(time_in(at, TimeZone::UTC), "22:13:20");
        assert_eq!(time_in(at, TimeZone::fixed(offset(8))), "06:13:20");
        assert_eq!(time_in(SourceTime(-1), TimeZone::UTC), "23:59:59");
    }
}
