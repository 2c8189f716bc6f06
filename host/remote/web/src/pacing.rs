//! Flow control and adaptive quality of one page's pictures: at most one picture in flight, never a
//! queue.

use std::time::{Duration, Instant};

use crate::encode::Format;
use crate::picture::Picture;

/// Shortest time between two pictures.
const MIN_GAP: Duration = Duration::from_millis(40);
/// A picture that is older than this at a page is not live there.
pub(crate) const MAX_BEHIND: Duration = Duration::from_millis(1000);
/// Time after which a tile that was sent with loss is sent again without: longer than values stay
/// that change every second.
const REST: Duration = Duration::from_millis(1200);
/// Largest number of changed tiles that are sent without loss at once: text stays sharp.
const MAX_SHARP_TILES: usize = 12;
/// Quality of JPEG: at first, at least, at most.
const QUALITY: u8 = 75;
const MIN_QUALITY: u8 = 30;
const MAX_QUALITY: u8 = 85;
/// Times from sending to display that count as slow, and as quick.
const SLOW: Duration = Duration::from_millis(300);
const QUICK: Duration = Duration::from_millis(120);
/// Tiles made sharp by one message: at first, at least, at most.
const SHARPENED: usize = 8;
const MIN_SHARPENED: usize = 2;
const MAX_SHARPENED: usize = 96;
/// Estimated bytes of a detailed tile without loss. Simple tiles, such as sky, say nothing of
/// detailed ones.
const SHARP_TILE_BYTES: u64 = 8_000;

/// Flow control of one page: tiles sent, the picture in flight, quality.
#[derive(Debug)]
pub(crate) struct Pacing {
    size: [u32; 2],
    sent: Vec<TileState>,
    in_flight: Option<InFlightPicture>,
    last_sent: Option<Instant>,
    /// Last instant at which the page's picture was true, where a newer one was not sent.
    unsent_since: Option<Instant>,
    quality: u8,
    sharpened: usize,
}

/// Transmission state of a tile.
#[derive(Clone, Copy, Debug, Default)]
struct TileState {
    /// Number of the picture, 0 for none.
    number: u64,
    /// Instant of sending, if with loss.
    lossy: Option<Instant>,
}

/// Picture that was sent and not shown yet.
#[derive(Debug)]
struct InFlightPicture {
    number: u32,
    sent: Instant,
    bytes: u64,
    /// Last instant at which the picture before it was true.
    since: Option<Instant>,
}

/// Tiles to send next, and their format.
#[derive(Debug, PartialEq)]
pub(crate) struct SendPlan {
    pub(crate) tiles: Vec<usize>,
    pub(crate) format: Format,
}

impl Pacing {
    pub(crate) fn new() -> Self {
        Self {
            size: [0; 2],
            sent: Vec::new(),
            in_flight: None,
            last_sent: None,
            unsent_since: None,
            quality: QUALITY,
            sharpened: SHARPENED,
        }
    }

    /// Notes a new picture; the one before was true until `true_until`.
    pub(crate) fn note_change(&mut self, true_until: Instant) {
        self.unsent_since.get_or_insert(true_until);
    }

    /// Time since the page's picture was true, where the page does not show the newest one;
    /// else zero.
    pub(crate) fn behind(&self, now: Instant) -> Duration {
        let shown_late = self.in_flight.as_ref().and_then(|flight| flight.since);
        let since = shown_late.or(self.unsent_since);
        since.map_or(Duration::ZERO, |since| now.saturating_duration_since(since))
    }

    /// Chooses the tiles to send now, if any: changed ones, or lossy ones to refine.
    pub(crate) fn plan(&mut self, picture: &Picture, now: Instant) -> Option<SendPlan> {
        let is_early = self.last_sent.is_some_and(|sent| now.duration_since(sent) < MIN_GAP);
        if self.in_flight.is_some() || is_early {
            return None;
        }
        if self.size != picture.size {
            self.size = picture.size;
            self.sent = vec![TileState::default(); picture.changed().len()];
        }
        let is_unsent = |tile: &usize| picture.changed()[*tile] > self.sent[*tile].number;
        let unsent: Vec<_> = (0..self.sent.len()).filter(is_unsent).collect();
        if !unsent.is_empty() {
            let is_sharp = unsent.len() <= MAX_SHARP_TILES;
            let format = if is_sharp { Format::Png } else { Format::Jpeg(self.quality) };
            return Some(SendPlan { tiles: unsent, format });
        }
        self.unsent_since = None;
        let rests = |sent: &TileState| sent.lossy.is_some_and(|lossy| now >= lossy + REST);
        let resting = self.sent.iter().enumerate().filter(|(_, sent)| rests(sent));
        let tiles: Vec<_> = resting.map(|(tile, _)| tile).take(self.sharpened).collect();
        (!tiles.is_empty()).then_some(SendPlan { tiles, format: Format::Png })
    }

    /// Records that these tiles of a picture are being sent.
    pub(crate) fn note_sent(
        &mut self,
        picture: &Picture,
        tiles: &[usize],
        format: Format,
        now: Instant,
    ) {
        let lossy = (format != Format::Png).then_some(now);
        for &tile in tiles {
            self.sent[tile] = TileState { number: picture.number, lossy };
        }
        let since = self.unsent_since.take();
        self.in_flight =
            Some(InFlightPicture { number: picture.number as u32, sent: now, bytes: 0, since });
        self.last_sent = Some(now);
    }

    /// Records the encoded size of the picture in flight, and the instant of sending.
    pub(crate) fn note_encoded(&mut self, bytes: usize, now: Instant) {
        if let Some(flight) = &mut self.in_flight {
            (flight.sent, flight.bytes) = (now, bytes as u64);
        }
    }

    /// Records that the page shows the picture `number`; returns whether it was in flight.
    pub(crate) fn note_shown(&mut self, number: u32, now: Instant) -> bool {
        let Some(flight) = self.in_flight.take_if(|flight| flight.number == number) else {
            return false;
        };
        let took = now.saturating_duration_since(flight.sent);
        if took > SLOW {
            self.quality = self.quality.saturating_sub(15).max(MIN_QUALITY);
            self.sharpened = (self.sharpened / 2).max(MIN_SHARPENED);
        } else if took < QUICK {
            self.quality = (self.quality + 5).min(MAX_QUALITY);
            let most = (self.sharpened * 2).min(tiles_in_time(flight.bytes, took));
            self.sharpened = most.clamp(self.sharpened, MAX_SHARPENED);
        }
        true
    }

    /// Returns the instant at which there may be something to send without an event.
    pub(crate) fn due(&self) -> Option<Instant> {
        if self.in_flight.is_some() {
            return None;
        }
        let gap = self.last_sent.map(|sent| sent + MIN_GAP);
        if self.unsent_since.is_some() {
            return gap;
        }
        let rested = self.sent.iter().filter_map(|sent| sent.lossy).min()? + REST;
        Some(gap.map_or(rested, |gap| gap.max(rested)))
    }
}

/// Tiles that a line takes in [`SLOW`] which took so many bytes in that time.
fn tiles_in_time(bytes: u64, took: Duration) -> usize {
    let millis = (took.as_millis() as u64).max(1);
    (bytes * SLOW.as_millis() as u64 / millis / SHARP_TILE_BYTES) as usize
}

#[cfg(test)]
mod tests {
    use busbar_protocol::pictures::{Area, PIXEL_BYTES};

    use super::*;

    const SIZE: [u32; 2] = [640, 640];

    fn picture(shade: u8) -> Picture {
        let mut picture = Picture::default();
        change(&mut picture, shade);
        picture
    }

    fn change(picture: &mut Picture, shade: u8) {
        let pixels = vec![shade; (SIZE[0] * SIZE[1]) as usize * PIXEL_BYTES];
        let [width, height] = SIZE;
        picture.update(SIZE, &pixels, Area { x: 0, y: 0, width, height });
    }

    /// A page that shows each picture after `delay`, for so many steps of 10 ms; bytes are
    /// tiles here. What was sent, with the times.
    fn run(
        pacing: &mut Pacing,
        picture: &Picture,
        start: Instant,
        steps: u32,
        delay: u32,
    ) -> Vec<(u32, SendPlan)> {
        let (mut told, mut due) = (Vec::new(), None);
        for step in 0..steps {
            let now = start + Duration::from_millis(10) * step;
            if due == Some(step) {
                assert!(pacing.note_shown(picture.number as u32, now));
                due = None;
            }
            if let Some(next) = pacing.plan(picture, now) {
                assert_eq!(due, None, "one at a time");
                pacing.note_sent(picture, &next.tiles, next.format, now);
                due = Some(step + delay);
                told.push((step, next));
            }
        }
        told
    }

    #[test]
    fn a_picture_that_rests_becomes_sharp_and_then_costs_nothing() {
        let (start, picture) = (Instant::now(), picture(1));
        let mut pacing = Pacing::new();
        pacing.note_change(start);
        let told = run(&mut pacing, &picture, start, 300, 1);
        assert_eq!(
            told[0].1,
            SendPlan { tiles: (0..100).collect(), format: Format::Jpeg(QUALITY) }
        );
        assert!(told[1].0 >= 120, "it rests first");
        let sharp: Vec<_> = told[1..].iter().flat_map(|(_, next)| next.tiles.clone()).collect();
        assert_eq!(sharp, (0..100).collect::<Vec<_>>(), "each tile once");
        assert!(told[1..].iter().all(|(_, next)| next.format == Format::Png));
        assert_eq!(pacing.due(), None, "nothing is left to do");
        assert_eq!(pacing.behind(start + Duration::from_secs(9)), Duration::ZERO);
    }

    #[test]
    fn a_page_that_shows_nothing_is_sent_nothing_and_is_behind() {
        let (start, mut picture) = (Instant::now(), picture(1));
        let mut pacing = Pacing::new();
        pacing.note_change(start);
        assert_eq!(run(&mut pacing, &picture, start, 1, 9).len(), 1);
        let later = start + Duration::from_secs(2);
        change(&mut picture, 2);
        pacing.note_change(later);
        assert_eq!(pacing.plan(&picture, later), None);
        assert!(pacing.behind(later) >= MAX_BEHIND);
        assert!(!pacing.note_shown(77, later), "what was never sent");
        assert!(pacing.note_shown(1, later));
        let next = pacing.plan(&picture, later).unwrap();
        assert_eq!(next.format, Format::Jpeg(QUALITY - 15), "worse, for it was slow");
        assert_eq!(pacing.behind(later), Duration::ZERO, "since the second change");
    }

    #[test]
    fn quality_falls_to_its_least_and_comes_back() {
        let (start, mut picture) = (Instant::now(), picture(1));
        let mut pacing = Pacing::new();
        let mut now = start;
        let mut turn = |took: u64| {
            picture = picture_after(&picture);
            pacing.note_change(now);
            let next = pacing.plan(&picture, now).unwrap();
            pacing.note_sent(&picture, &next.tiles, next.format, now);
            now += Duration::from_millis(took);
            assert!(pacing.note_shown(picture.number as u32, now));
            next.format
        };
        let slow: Vec<_> = (0..9).map(|_| turn(900)).collect();
        assert_eq!(*slow.last().unwrap(), Format::Jpeg(MIN_QUALITY));
        let quick: Vec<_> = (0..30).map(|_| turn(50)).collect();
        assert_eq!(*quick.last().unwrap(), Format::Jpeg(MAX_QUALITY));
    }

    /// Returns the tiles that are refined after pictures of so many bytes took so long.
    fn sharpened_after(bytes: usize, took: u64) -> usize {
        let (mut pacing, mut picture, mut now) = (Pacing::new(), picture(1), Instant::now());
        for _ in 0..9 {
            picture = picture_after(&picture);
            pacing.note_change(now);
            let next = pacing.plan(&picture, now).unwrap();
            pacing.note_sent(&picture, &next.tiles, next.format, now);
            pacing.note_encoded(bytes, now);
            now += Duration::from_millis(took);
            assert!(pacing.note_shown(picture.number as u32, now));
        }
        pacing.plan(&picture, now + REST).unwrap().tiles.len()
    }

    #[test]
    fn what_is_made_sharp_at_once_is_what_the_line_takes() {
        assert_eq!(sharpened_after(40_000, 320), MIN_SHARPENED);
        assert_eq!(sharpened_after(1_000, 50), SHARPENED, "little on any line says nothing");
        assert_eq!(sharpened_after(40_000, 100), 15);
        assert_eq!(sharpened_after(400_000, 50), MAX_SHARPENED);
    }

    fn picture_after(before: &Picture) -> Picture {
        let mut after = before.clone();
        change(&mut after, (before.number % 200) as u8 + 3);
        after
    }

    #[test]
    fn few_tiles_are_sharp_at_once() {
        let (start, mut picture) = (Instant::now(), picture(1));
        let mut pacing = Pacing::new();
        pacing.note_change(start);
        run(&mut pacing, &picture, start, 300, 1);
        let mut pixels = vec![1; (SIZE[0] * SIZE[1]) as usize * PIXEL_BYTES];
        pixels[0] = 9;
        let now = start + Duration::from_secs(5);
        picture.update(SIZE, &pixels, Area { x: 0, y: 0, width: 1, height: 1 });
        pacing.note_change(now);
        let next = pacing.plan(&picture, now);
        assert_eq!(next, Some(SendPlan { tiles: vec![0], format: Format::Png }));
    }
}
