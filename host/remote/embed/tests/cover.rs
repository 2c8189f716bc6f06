//! The cover of an X11 window: hatched over all of it, above whatever comes, until it is hidden.

mod common;
#[path = "common/x11_window.rs"]
mod x11_window;

use std::time::{Duration, Instant};

use busbar_client::{CoverError, WindowCover};
use common::judge::{Seen, is_marked, keep};
use x11_window::{SIZE, X11Window};

const TEXT: &str = "NO LIVE PICTURE SINCE 12:34:56";
const PATIENCE: Duration = Duration::from_secs(20);

/// Steps the cover until the window looks as expected.
fn wait(
    window: &X11Window,
    cover: &mut WindowCover,
    what: &str,
    wanted: impl Fn(&Seen) -> bool,
) -> Seen {
    let start = Instant::now();
    loop {
        cover.step().expect("the window is there");
        let seen = window.pixels();
        if wanted(&seen) {
            return seen;
        }
        assert!(start.elapsed() < PATIENCE, "{what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Counts the pixels of a shade.
fn count(seen: &Seen, shade: u8) -> usize {
    seen.pixels.chunks(4).filter(|pixel| pixel[..3] == [shade; 3]).count()
}

#[test]
fn a_window_is_covered_whatever_comes_until_it_is_not() {
    let Some(window) = X11Window::open() else { return };
    let mut cover = WindowCover::open(Some(&window.display.name), window.window).expect("it opens");
    let bare = wait(&window, &mut cover, "it is not shown yet", |seen| !is_marked(seen));
    cover.show(TEXT).expect("the window is there");
    let hatched = wait(&window, &mut cover, "it is not covered", is_marked);
    keep(&hatched, "cover");
    // The letters are white, on a dark box; stripes are neither.
    assert!(count(&hatched, 0xff) > 1000, "no text");
    assert!(count(&hatched, 0x10) > 1000, "no box");
    assert!(cover.is_shown());

    // A child that comes later, as of a new viewer, does not lie above it for long.
    window.put_child_above();
    wait(&window, &mut cover, "a new child lies above it", |seen| *seen.pixels == hatched.pixels);

    // It is as large as the window, whatever size that has.
    let [width, height] = SIZE;
    window.resize([width / 2, height / 2]);
    let middle = (usize::from(height / 4) * usize::from(width) + usize::from(width / 4)) * 4;
    let has_text = |seen: &Seen| {
        let row = &seen.pixels[middle - usize::from(width / 8) * 4..][..usize::from(width)];
        row.chunks(4).any(|pixel| pixel[..3] == [0xff; 3])
    };
    assert!(!has_text(&hatched));
    wait(&window, &mut cover, "its text is not in the new middle", has_text);
    window.resize(SIZE);
    wait(&window, &mut cover, "it is not larger again", |seen| *seen.pixels == hatched.pixels);

    cover.hide().expect("the window is there");
    wait(&window, &mut cover, "it is not hidden", |seen| {
        !is_marked(seen) && seen.pixels != bare.pixels
    });
    assert!(!cover.is_shown());
    cover.show("DISPLAY LATE SINCE 01:02:03").expect("the window is there");
    let late = wait(&window, &mut cover, "it is not covered again", is_marked);
    assert!(late.pixels != hatched.pixels, "the text is another");
    keep(&late, "cover_late");
}

#[test]
fn a_cover_ends_with_its_window_and_is_none_without_one() {
    let Some(window) = X11Window::open() else { return };
    let name = window.display.name.clone();
    let mut cover = WindowCover::open(Some(&name), window.window).expect("it opens");
    cover.show(TEXT).expect("the window is there");
    window.destroy();
    let start = Instant::now();
    while cover.step() != Err(CoverError::Gone) {
        assert!(start.elapsed() < PATIENCE, "the end is not noticed");
        std::thread::sleep(Duration::from_millis(5));
    }
    for (display, window) in [(name.as_str(), 0xdead_u32), (":9999", 1)] {
        let refused = WindowCover::open(Some(display), window).err();
        assert!(matches!(refused, Some(CoverError::Unreachable(_))), "{refused:?}");
    }
}
