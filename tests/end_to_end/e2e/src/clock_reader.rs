//! Reader of the running clock in pictures of a view: it tells how old a picture is by its pixels
//! alone.

use std::time::{SystemTime, UNIX_EPOCH};

/// Size of the clock's place in the lower left corner of a picture with panels, pixels.
pub const CLOCK_PLACE: [u32; 2] = [90, 30];

/// Returns the wall time, milliseconds since 1970.
///
/// # Panics
/// When the clock is before 1970.
pub fn wall_millis() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).expect("after 1970");
    since.as_millis() as u64
}

/// Picture of the clock's place, any bytes of a constant size, and the wall time at which it was
/// seen, milliseconds.
pub struct ClockLook {
    /// Wall time of the look, milliseconds since 1970. No later than the look itself.
    pub at: u64,
    /// Report of whether the picture passes for live.
    pub is_live: bool,
    /// Pixels of the clock's place.
    pub pixels: Vec<u8>,
}

/// Findings on a series of looks.
#[derive(Clone, Copy, Debug, Default)]
pub struct ClockFindings {
    /// Number of looks at pictures that pass for live.
    pub live: u32,
    /// Number of those whose clock could not be read.
    pub unread: u32,
    /// Longest time since the end of the second that a picture which passes for live shows,
    /// milliseconds: the picture is older by a second at most.
    pub longest: u64,
}

/// Time of looks for [`ClockReader::learn`], milliseconds: two tens of seconds contain a whole one.
pub const LEARNING_MILLIS: u64 = 20_500;
/// Instant within a second at which an idle view shows it, milliseconds.
const SETTLED: u64 = 800;
/// Number of digits, and seconds after which a digit comes again.
const DIGITS: u64 = 10;
/// Seconds that a digit may be ahead of the look: the clock may have gone on since.
const MAX_AHEAD: u64 = 2;
/// Greatest difference of two pixels that are alike: pictures of a page lose a little.
const MAX_NOISE: u8 = 48;

/// Last digit of a clock, by its pixels.
pub struct ClockReader {
    /// Places of the bytes that tell digits apart, and their values for each digit.
    places: Vec<usize>,
    digits: Vec<Vec<u8>>,
}

impl ClockReader {
    /// Learns the digits from looks at a live picture on an idle machine, in order of time, over
    /// [`LEARNING_MILLIS`].
    ///
    /// # Panics
    /// When two digits look alike.
    pub fn learn(looks: &[ClockLook]) -> Self {
        let first = looks.first().expect("somebody looked").at;
        let second = 1000;
        let tens = first.next_multiple_of(DIGITS * second);
        let pictures: Vec<&[u8]> = (0..DIGITS)
            .map(|digit| {
                let at = tens + digit * second + SETTLED;
                let seen = looks.iter().rfind(|look| look.at <= at);
                &*seen.expect("looks reach so far").pixels
            })
            .collect();
        let differs = |place: &usize| {
            let values = || pictures.iter().map(|picture| picture[*place]);
            let [least, most] = [values().min(), values().max()];
            most.zip(least).is_some_and(|(most, least)| most - least > MAX_NOISE)
        };
        let places: Vec<usize> = (0..pictures[0].len()).filter(differs).collect();
        let digits = pictures.iter().map(|picture| at_places(picture, &places)).collect();
        let reader = Self { places, digits };
        for (digit, picture) in (0..).zip(pictures) {
            assert_eq!(reader.read(picture), Some(digit), "digits of the clock look alike");
        }
        reader
    }

    /// Reads the last digit of the seconds; none where nothing there looks like one.
    fn read(&self, pixels: &[u8]) -> Option<u64> {
        let shown = at_places(pixels, &self.places);
        let unlike = |digit: &Vec<u8>| {
            digit
                .iter()
                .zip(&shown)
                .filter(|(one, other)| one.abs_diff(**other) > MAX_NOISE)
                .count()
        };
        let mut digits: Vec<(usize, u64)> = self.digits.iter().map(unlike).zip(0..).collect();
        digits.sort_unstable();
        let [(least, digit), (next, _), ..] = digits[..] else { return None };
        (least * 2 < next).then_some(digit)
    }

    /// Judges a series of looks.
    pub fn judge(&self, looks: impl IntoIterator<Item = ClockLook>) -> ClockFindings {
        let mut findings = ClockFindings::default();
        for look in looks.into_iter().filter(|look| look.is_live) {
            findings.live += 1;
            let Some(digit) = self.read(&look.pixels) else {
                findings.unread += 1;
                continue;
            };
            let behind = (look.at / 1000 + DIGITS - digit) % DIGITS;
            if (1..DIGITS - MAX_AHEAD).contains(&behind) {
                // Since the end of the second that is shown.
                let age = look.at % 1000 + (behind - 1) * 1000;
                findings.longest = findings.longest.max(age);
            }
        }
        findings
    }
}

fn at_places(picture: &[u8], places: &[usize]) -> Vec<u8> {
    places.iter().map(|place| picture[*place]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Picture of a clock: some constant pixels, tens, and a digit.
    fn picture(millis: u64) -> Vec<u8> {
        let second = millis / 1000;
        let mut pixels = vec![90; 20];
        pixels[(second / 10 % 6) as usize] = 200;
        pixels[10 + (second % 10) as usize] = 200;
        pixels
    }

    fn looks(from: u64, to: u64, age: impl Fn(u64) -> u64) -> Vec<ClockLook> {
        let look = |at| ClockLook { at, is_live: true, pixels: picture(at - age(at)) };
        (from..to).step_by(50).map(look).collect()
    }

    #[test]
    fn ages_are_those_of_the_pictures() {
        let start = 1_700_000_003_120;
        let reader = ClockReader::learn(&looks(start, start + LEARNING_MILLIS, |_| 30));
        for age in [0, 400, 900, 1700, 5200] {
            let found = reader.judge(looks(start, start + 60_000, |_| age));
            // A picture of the end of a second is as old as it seems; others are older.
            assert!((age.saturating_sub(60)..=age).contains(&found.longest), "{age}: {found:?}");
            assert_eq!((found.live, found.unread), (1200, 0));
        }
        let marked = looks(start, start + 60_000, |_| 3000).into_iter();
        let marked = marked.map(|look| ClockLook { is_live: false, ..look });
        assert_eq!(reader.judge(marked).longest, 0);
        let blank = ClockLook { at: start, is_live: true, pixels: vec![0; 20] };
        assert_eq!(reader.judge([blank]).unread, 1);
    }
}
