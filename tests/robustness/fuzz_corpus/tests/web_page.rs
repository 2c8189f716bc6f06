//! Fuzzing of the web page's server: input that reaches the viewer passes its check, and the
//! picture keeps within its limits. One page steers as long as there is one, and held buttons are
//! released in the end.

use std::collections::BTreeSet;

use busbar_protocol::message::{Command, KeyEvent, PointerEvent};
use busbar_web::Origin;
use busbar_web::probe::{MAX_MESSAGE_BYTES, Pages};

/// Greatest number of pages at once, as servers have it by default.
const MAX_PAGES: usize = 4;
/// Greatest number of pixels of a picture for a page.
const MAX_PIXELS: u32 = 2560 * 1600;

/// Runs one input, a line for each event: `+` connects a page, `-` disconnects one. Else the first
/// byte selects the page, and the rest is its message. A line that begins with `o` is an origin
/// instead.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let (mut pages, mut held) = (Pages::default(), HeldInput::default());
    let (mut has_done, mut has_refused) = (false, false);
    for line in text.lines().filter(|line| line.len() <= MAX_MESSAGE_BYTES) {
        if let Some(origin) = line.strip_prefix('o') {
            has_done |= is_an_origin_that_needs_no_escape(origin);
            continue;
        }
        let mut rest = line.chars();
        let commands = match (rest.next(), pages.count()) {
            (Some('+'), ..MAX_PAGES) => pages.join(),
            (Some('-'), 1..) => pages.leave(pages.count() - 1),
            (Some(page), count @ 1..) => {
                pages.receive(page as usize % count, rest.as_str()).unwrap_or_else(|_| {
                    has_refused = true;
                    Vec::new()
                })
            }
            _ => continue,
        };
        has_done |= !commands.is_empty();
        commands.iter().for_each(|command| held.note(command));
        assert_eq!(pages.steering(), usize::from(pages.count() > 0));
    }
    while pages.count() > 0 {
        pages.leave(0).iter().for_each(|command| held.note(command));
    }
    assert!(held.buttons.is_empty(), "{:?} is down for ever", held.buttons);
    has_done && !has_refused
}

/// Buttons that the viewer takes for held down.
#[derive(Default)]
struct HeldInput {
    buttons: BTreeSet<u8>,
}

impl HeldInput {
    fn note(&mut self, command: &Command) {
        assert_eq!(command.check(), Ok(()), "{command:?}");
        match command {
            Command::Resize([width, height]) => {
                // Rounding, and the least side of one that is very long.
                assert!(width * height <= MAX_PIXELS + 64 * 3840, "{width} x {height}");
            }
            Command::Pointer(PointerEvent::Button { button, pressed: true, .. }) => {
                self.buttons.insert(*button);
            }
            Command::Pointer(PointerEvent::Button { button, .. }) => {
                self.buttons.remove(button);
            }
            Command::Pointer(PointerEvent::Scrolled(steps)) => assert!(steps.abs() <= 100.0),
            Command::Key(KeyEvent::Text(text)) => assert!(text.len() <= 256),
            // Nothing else is a page's to ask.
            Command::Pointer(_)
            | Command::Key(_)
            | Command::SetVisible(_)
            | Command::Focus(_)
            | Command::UseCamera(_)
            | Command::SetTheta(_)
            | Command::Pick(_) => {}
            other => panic!("a page asked for {other:?}"),
        }
    }
}

fn is_an_origin_that_needs_no_escape(text: &str) -> bool {
    let Ok(origin) = text.parse::<Origin>() else { return false };
    let written = origin.to_string();
    assert!(written.bytes().all(|b| b.is_ascii_alphanumeric() || b":/.-[]".contains(&b)));
    assert_eq!(written.parse::<Origin>(), Ok(origin), "it is the same again");
    true
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("web_page", fuzz_one);
}
