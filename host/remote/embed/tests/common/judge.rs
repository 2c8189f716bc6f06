//! Judge of live pictures: it knows by the pixels alone which value a picture shows, and since
//! when that is not so any more.
//!
//! The program sets a tag to one value after the other. Each value was looked at before, so that
//! a picture tells which of them it shows; the judge knows when the program set the next one.

use std::time::{Duration, Instant};

use busbar::abi::BusbarViewLiveness;

use super::{Host, TOP_OIL, save};

/// Values of the tag, all within the limits of its equipment.
const VALUES: [f64; 12] = [31.0, 42.0, 53.0, 34.0, 45.0, 56.0, 37.0, 48.0, 59.0, 30.0, 41.0, 52.0];
/// Time from value to value: a picture is that much older at most than it is judged.
pub(crate) const VALUE_PERIOD: Duration = Duration::from_millis(250);
/// Time that a picture must stay the same to be learned, and the longest that it may take.
const CALM: Duration = Duration::from_millis(1000);
const PATIENCE: Duration = Duration::from_secs(120);
/// Bytes of one pixel.
const PIXEL: usize = 4;

/// A picture as it is seen: width, and pixels whose first three bytes are colours.
#[derive(Clone)]
pub(crate) struct Seen {
    pub(crate) width: usize,
    pub(crate) pixels: Vec<u8>,
}

/// Surface that shows the view's picture.
pub(crate) trait Surface {
    /// The picture that is seen now; none before the first.
    fn look(&mut self, host: &mut Host) -> Option<Seen>;
}

/// The picture in shared memory.
pub(crate) struct SharedMemory;

impl Surface for SharedMemory {
    fn look(&mut self, host: &mut Host) -> Option<Seen> {
        let shown = host.frame()?;
        Some(Seen { width: shown.size[0] as usize, pixels: shown.pixels })
    }
}

/// Pixels that tell values apart, and their colours at each value.
pub(crate) struct Judge {
    /// Places of the pixels, bytes from the first.
    places: Vec<usize>,
    colors: Vec<Vec<u8>>,
    /// Values that the program set, with their instants; the last is the present one.
    set: Vec<(Instant, usize)>,
}

/// Findings on the pictures of some time.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Findings {
    /// Pictures that were looked at, those that pass for live, and of these those whose value
    /// could not be read.
    pub(crate) looks: u32,
    pub(crate) live: u32,
    pub(crate) unread: u32,
    /// The longest time that the value of a picture which passes for live had not been so.
    pub(crate) longest: Duration,
}

impl Judge {
    /// Learns the picture of each value on a surface.
    pub(crate) fn learn(host: &mut Host, surface: &mut impl Surface) -> Self {
        let mut pictures = Vec::new();
        for value in VALUES {
            host.set_tag(TOP_OIL, value);
            pictures.push(calm(host, surface, pictures.last()));
        }
        let first = &pictures[0];
        let differs = |place: &usize| {
            let color = |picture: &Seen| picture.pixels[*place..*place + 3].to_vec();
            pictures.iter().any(|picture| color(picture) != color(first))
        };
        let places: Vec<_> = (0..first.pixels.len()).step_by(PIXEL).filter(differs).collect();
        let colors: Vec<_> = pictures.iter().map(|picture| colors(picture, &places)).collect();
        for (number, one) in colors.iter().enumerate() {
            assert!(!colors[..number].contains(one), "{} looks like another", VALUES[number]);
        }
        Self { places, colors, set: vec![(Instant::now(), VALUES.len() - 1)] }
    }

    /// Sets the next value when its time has come.
    pub(crate) fn turn(&mut self, host: &mut Host) {
        let (since, number) = *self.set.last().expect("there is one");
        if since.elapsed() >= VALUE_PERIOD {
            let next = (number + 1) % VALUES.len();
            host.set_tag(TOP_OIL, VALUES[next]);
            self.set.push((Instant::now(), next));
        }
        host.turn();
    }

    /// Judges the surface once; returns whether its picture passes for live.
    pub(crate) fn look(
        &mut self,
        host: &mut Host,
        surface: &mut impl Surface,
        findings: &mut Findings,
    ) -> bool {
        // Before the look: what is seen then is not older than it is judged to be.
        let now = Instant::now();
        let Some(seen) = surface.look(host) else { return false };
        findings.looks += 1;
        if is_marked(&seen) {
            return false;
        }
        findings.live += 1;
        let Some(value) = self.read(&colors(&seen, &self.places)) else {
            findings.unread += 1;
            return true;
        };
        let age = self.age(value, now);
        if age > findings.longest {
            findings.longest = age;
        }
        true
    }

    /// Value that most pixels are of: parts of a picture may be of an overlay that is late.
    fn read(&self, shown: &[u8]) -> Option<usize> {
        let same = |colors: &Vec<u8>| {
            colors.chunks(3).zip(shown.chunks(3)).filter(|(one, other)| one == other).count()
        };
        let counts = self.colors.iter().map(same).enumerate();
        let (value, count) = counts.max_by_key(|(_, count)| *count)?;
        (count * 3 >= shown.len() * 2 / 3).then_some(value)
    }

    /// Time since a value is not the present one any more.
    fn age(&self, value: usize, now: Instant) -> Duration {
        let Some(last) = self.set.iter().rposition(|(_, set)| *set == value) else {
            return Duration::ZERO;
        };
        let replaced = self.set.get(last + 1);
        replaced.map_or(Duration::ZERO, |(at, _)| now.saturating_duration_since(*at))
    }

    /// Judges the surface repeatedly for some time.
    pub(crate) fn watch(
        &mut self,
        host: &mut Host,
        surface: &mut impl Surface,
        time: Duration,
    ) -> Findings {
        let (mut findings, start) = (Findings::default(), Instant::now());
        while start.elapsed() < time {
            self.turn(host);
            self.look(host, surface, &mut findings);
        }
        findings
    }

    /// Waits until pictures pass for live and their values can be read.
    #[track_caller]
    pub(crate) fn wait_until_live(&mut self, host: &mut Host, surface: &mut impl Surface) {
        let start = Instant::now();
        loop {
            let findings = self.watch(host, surface, Duration::from_millis(600));
            if findings.live > findings.unread {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "no live picture: {findings:?}");
        }
    }
}

fn colors(picture: &Seen, places: &[usize]) -> Vec<u8> {
    places.iter().flat_map(|place| &picture.pixels[*place..*place + 3]).copied().collect()
}

/// Waits for a live picture that stays the same, and is not the one `before`.
#[track_caller]
fn calm(host: &mut Host, surface: &mut impl Surface, before: Option<&Seen>) -> Seen {
    let (start, mut last): (_, Option<(Seen, Instant)>) = (Instant::now(), None);
    loop {
        host.turn();
        if let Some(seen) = surface.look(host).filter(|seen| !is_marked(seen)) {
            match &last {
                Some((same, since)) if same.pixels == seen.pixels => {
                    let is_other = before.is_none_or(|before| before.pixels != seen.pixels);
                    if is_other && since.elapsed() >= CALM {
                        return seen;
                    }
                }
                _ => last = Some((seen, Instant::now())),
            }
        }
        assert!(start.elapsed() < PATIENCE, "no calm live picture");
    }
}

/// Reports whether a picture has no colour, and stripes along its first row.
pub(crate) fn is_marked(seen: &Seen) -> bool {
    let pixels = || seen.pixels.chunks_exact(PIXEL);
    let is_grey = pixels().all(|pixel| pixel[0] == pixel[1] && pixel[1] == pixel[2]);
    let row = || pixels().take(seen.width);
    let jumps = row().zip(row().skip(1)).filter(|(a, b)| a[0].abs_diff(b[0]) > 60).count();
    is_grey && jumps >= seen.width / 24
}

/// Keeps a picture where `BUSBAR_PICTURES` says, if it does.
pub(crate) fn keep(seen: &Seen, name: &str) {
    let height = seen.pixels.len() / PIXEL / seen.width;
    let mut pixels = seen.pixels.clone();
    pixels.chunks_exact_mut(PIXEL).for_each(|pixel| pixel[3] = 255);
    save(
        &super::Shown {
            is_new: true,
            liveness: BusbarViewLiveness::Live,
            size: [seen.width as u32, height as u32],
            damage: [0; 4],
            age: Duration::ZERO,
            sequence: 0,
            pixels,
        },
        name,
    );
}
