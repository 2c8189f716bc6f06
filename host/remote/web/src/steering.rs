//! Control of a view by one of several pages, with takeover.
//!
//! The first steers; another takes over when it asks to, or when the one that steers goes.
//! What that one held down is let go of.

use busbar_protocol::message::{Command, KeyEvent, Modifiers, PointerEvent};

use crate::message::{FromPage, picture_size};

/// Greatest number of keys held down; no release is sent for further ones.
const MAX_KEYS: usize = 16;

/// Identifier of one page of the view.
pub(crate) type PageId = u64;

/// Pages of a view in the order of their arrival, and the one that steers.
#[derive(Debug, Default)]
pub(crate) struct Steering {
    pages: Vec<Page>,
    steers: Option<PageId>,
    last_page_id: PageId,
    /// Buttons held down by the page that steers.
    buttons: Vec<u8>,
    keys: Vec<String>,
    /// Pointer position of the page that steers.
    at: [f32; 2],
    /// Visibility and size that the viewer was sent last.
    is_visible: bool,
    size: Option<[u32; 2]>,
}

#[derive(Debug)]
struct Page {
    page_id: PageId,
    size: Option<[u32; 2]>,
    is_visible: bool,
}

impl Steering {
    /// Adds a page; returns commands for the viewer.
    pub(crate) fn join(&mut self) -> (PageId, Vec<Command>) {
        self.last_page_id += 1;
        let page_id = self.last_page_id;
        self.pages.push(Page { page_id, size: None, is_visible: true });
        self.steers.get_or_insert(page_id);
        (page_id, self.settle())
    }

    /// Removes a page. If it steered, the next visible page steers, or else the next one.
    pub(crate) fn leave(&mut self, page_id: PageId) -> Vec<Command> {
        self.pages.retain(|page| page.page_id != page_id);
        if self.steers != Some(page_id) {
            return self.settle();
        }
        let next = self.pages.iter().find(|page| page.is_visible).or(self.pages.first());
        self.steers = next.map(|page| page.page_id);
        let released = self.release();
        released.into_iter().chain(self.settle()).collect()
    }

    /// Reports whether a page steers.
    pub(crate) fn is_steering(&self, page_id: PageId) -> bool {
        self.steers == Some(page_id)
    }

    /// Handles a page's message; returns commands for the viewer. Input of a page that does not
    /// steer is ignored.
    ///
    /// # Errors
    /// In words, why a command of such a page is not done.
    pub(crate) fn act(&mut self, page_id: PageId, said: FromPage) -> Result<Vec<Command>, String> {
        match said {
            FromPage::View { size, visible } => {
                if let Some(page) = self.pages.iter_mut().find(|page| page.page_id == page_id) {
                    (page.size, page.is_visible) = (Some(picture_size(size)), visible);
                }
                return Ok(self.settle());
            }
            FromPage::Steer if self.steers != Some(page_id) => {
                self.steers = Some(page_id);
                let released = self.release();
                return Ok(released.into_iter().chain(self.settle()).collect());
            }
            _ => {}
        }
        let Some(command) = said.into_command() else { return Ok(Vec::new()) };
        if self.steers == Some(page_id) {
            self.note(&command);
            return Ok(vec![command]);
        }
        match command {
            Command::Pointer(_) | Command::Key(_) => Ok(Vec::new()),
            _ => Err("another page steers the view; take control of it first".to_owned()),
        }
    }

    /// Records the buttons and keys held down.
    fn note(&mut self, command: &Command) {
        match command {
            Command::Pointer(PointerEvent::Moved(at)) => self.at = *at,
            Command::Pointer(PointerEvent::Button { at, button, pressed }) => {
                self.at = *at;
                self.buttons.retain(|held| held != button);
                if *pressed {
                    self.buttons.push(*button);
                }
            }
            Command::Key(KeyEvent::Key { key, pressed, .. }) => {
                self.keys.retain(|held| held != key);
                if *pressed && self.keys.len() < MAX_KEYS {
                    self.keys.push(key.clone());
                }
            }
            _ => {}
        }
    }

    /// Releases all buttons and keys held down.
    fn release(&mut self) -> Vec<Command> {
        let (at, modifiers) = (self.at, Modifiers::default());
        let buttons = std::mem::take(&mut self.buttons).into_iter();
        let buttons = buttons
            .map(|button| Command::Pointer(PointerEvent::Button { at, button, pressed: false }));
        let keys = std::mem::take(&mut self.keys).into_iter().map(|key| {
            Command::Key(KeyEvent::Key { key, pressed: false, repeated: false, modifiers })
        });
        let rest =
            [Command::Key(KeyEvent::Modifiers(modifiers)), Command::Pointer(PointerEvent::Left)];
        buttons.chain(keys).chain(rest).collect()
    }

    /// Returns commands that adapt the picture to the size of the page that steers, and to the
    /// visibility of all pages.
    fn settle(&mut self) -> Vec<Command> {
        let mut commands = Vec::new();
        let is_visible = self.pages.iter().any(|page| page.is_visible);
        if std::mem::replace(&mut self.is_visible, is_visible) != is_visible {
            commands.push(Command::SetVisible(is_visible));
        }
        let steers = self.pages.iter().find(|page| Some(page.page_id) == self.steers);
        if let Some(size) = steers.and_then(|page| page.size)
            && self.size.replace(size) != Some(size)
        {
            commands.push(Command::Resize(size));
        }
        commands
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(width: u32, visible: bool) -> FromPage {
        FromPage::View { size: [width, 100], visible }
    }

    fn press() -> FromPage {
        FromPage::Button { at: [3.0, 4.0], button: 1, pressed: true }
    }

    #[test]
    fn one_page_steers_and_others_look() {
        let mut steering = Steering::default();
        let (first, commands) = steering.join();
        assert_eq!(commands, [Command::SetVisible(true)]);
        let (second, _) = steering.join();
        assert!(steering.is_steering(first) && !steering.is_steering(second));
        assert_eq!(steering.act(first, view(200, true)), Ok(vec![Command::Resize([200, 100])]));
        assert_eq!(steering.act(second, view(300, true)), Ok(vec![]), "not its size");
        assert_eq!(steering.act(second, press()), Ok(vec![]));
        assert!(steering.act(second, FromPage::Focus("=A".into())).is_err());
        let focus = steering.act(first, FromPage::Focus("=A".into()));
        assert_eq!(focus, Ok(vec![Command::Focus("=A".into())]));
    }

    #[test]
    fn who_takes_over_finds_nothing_held_down() {
        let mut steering = Steering::default();
        let ((first, _), (second, _)) = (steering.join(), steering.join());
        let key = |pressed| FromPage::Key {
            key: "W".into(),
            pressed,
            repeated: false,
            modifiers: Default::default(),
        };
        for said in [view(200, true), press(), key(true)] {
            steering.act(first, said).unwrap();
        }
        steering.act(second, view(300, true)).unwrap();
        let modifiers = Modifiers::default();
        let released = [
            Command::Pointer(PointerEvent::Button { at: [3.0, 4.0], button: 1, pressed: false }),
            Command::Key(KeyEvent::Key {
                key: "W".into(),
                pressed: false,
                repeated: false,
                modifiers,
            }),
            Command::Key(KeyEvent::Modifiers(modifiers)),
            Command::Pointer(PointerEvent::Left),
        ];
        let taken = steering.act(second, FromPage::Steer).unwrap();
        assert_eq!(taken[..4], released);
        assert_eq!(taken[4..], [Command::Resize([300, 100])]);
        assert_eq!(steering.act(second, FromPage::Steer), Ok(vec![]), "it does already");
        assert!(steering.is_steering(second));
        assert_eq!(steering.leave(second).last(), Some(&Command::Resize([200, 100])));
        assert!(steering.is_steering(first));
    }

    #[test]
    fn what_nobody_sees_is_hardly_drawn() {
        let mut steering = Steering::default();
        let ((first, _), (second, _)) = (steering.join(), steering.join());
        assert_eq!(steering.act(first, view(200, false)), Ok(vec![Command::Resize([200, 100])]));
        assert_eq!(steering.act(second, view(9, false)), Ok(vec![Command::SetVisible(false)]));
        assert_eq!(steering.act(second, view(9, true)), Ok(vec![Command::SetVisible(true)]));
        assert!(steering.leave(first).contains(&Command::Resize([64, 100])));
        assert!(steering.leave(second).contains(&Command::SetVisible(false)));
    }
}
