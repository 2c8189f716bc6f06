//! Pointer and keyboard input of the host program's user, translated for egui.

use busbar_protocol::message::{self, Command, KeyEvent, PointerEvent};
use egui::{Event, Key, Modifiers, MouseWheelUnit, PointerButton, RawInput, TouchPhase};

/// Input state that lasts from frame to frame.
#[derive(Debug, Default)]
pub(super) struct InputState {
    pointer: egui::Pos2,
    modifiers: Modifiers,
}

impl InputState {
    /// Translates input commands to egui events.
    pub(super) fn apply(&mut self, input: &mut RawInput, done: Vec<Command>) {
        for command in done {
            match command {
                Command::Pointer(pointing) => self.point(input, pointing),
                Command::Key(typing) => self.type_in(input, typing),
                _ => {}
            }
        }
    }

    fn point(&mut self, input: &mut RawInput, pointing: PointerEvent) {
        let viewport = input.viewports.get(&input.viewport_id);
        let scale = viewport.and_then(|v| v.native_pixels_per_point).unwrap_or(1.0);
        let points = |[x, y]: [f32; 2]| egui::pos2(x / scale, y / scale);
        let modifiers = self.modifiers;
        input.events.push(match pointing {
            PointerEvent::Moved(at) => {
                self.pointer = points(at);
                Event::PointerMoved(self.pointer)
            }
            PointerEvent::Button { at, button, pressed } => {
                let button = match button {
                    2 => PointerButton::Middle,
                    3 => PointerButton::Secondary,
                    _ => PointerButton::Primary,
                };
                self.pointer = points(at);
                Event::PointerButton { pos: self.pointer, button, pressed, modifiers }
            }
            PointerEvent::Scrolled(steps) => Event::MouseWheel {
                unit: MouseWheelUnit::Line,
                delta: egui::vec2(0.0, steps),
                phase: TouchPhase::Move,
                modifiers,
            },
            PointerEvent::Left => Event::PointerGone,
        });
    }

    fn type_in(&mut self, input: &mut RawInput, typing: KeyEvent) {
        match typing {
            KeyEvent::Key { key, pressed, repeated, modifiers } => {
                self.set_modifiers(input, modifiers);
                let modifiers = self.modifiers;
                input.events.extend(key_of(&key).map(|key| Event::Key {
                    key,
                    physical_key: None,
                    pressed,
                    repeat: repeated,
                    modifiers,
                }));
            }
            KeyEvent::Modifiers(modifiers) => self.set_modifiers(input, modifiers),
            KeyEvent::Text(text) => input.events.push(Event::Text(text)),
        }
    }

    fn set_modifiers(&mut self, input: &mut RawInput, held: message::Modifiers) {
        let message::Modifiers { shift, ctrl, alt } = held;
        let modifiers = Modifiers { alt, ctrl, shift, mac_cmd: false, command: ctrl };
        if std::mem::replace(&mut self.modifiers, modifiers) != modifiers {
            input.events.push(Event::ModifiersChanged(modifiers));
        }
    }
}

/// Returns the key of a UI Events name (W3C); letters are compared in upper case.
fn key_of(name: &str) -> Option<Key> {
    Key::from_name(name).or_else(|| Key::from_name(&name.to_uppercase()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(name: &str, shift: bool) -> KeyEvent {
        let modifiers = message::Modifiers { shift, ..Default::default() };
        KeyEvent::Key { key: name.into(), pressed: true, repeated: false, modifiers }
    }

    #[test]
    fn keys_of_a_browser_are_those_of_a_window() {
        let pairs = [("a", Key::A), ("A", Key::A), ("F9", Key::F9), ("ArrowUp", Key::ArrowUp)];
        let more = [("1", Key::Num1), ("Escape", Key::Escape), ("?", Key::Questionmark)];
        for (name, key) in pairs.into_iter().chain(more) {
            assert_eq!(key_of(name), Some(key), "{name}");
        }
        assert_eq!(key_of("Dead"), None);
        assert_eq!(key_of(""), None);
    }

    #[test]
    fn modifiers_last_until_released() {
        let (mut input_state, mut input) = (InputState::default(), RawInput::default());
        let lets_go = KeyEvent::Modifiers(message::Modifiers::default());
        let wheel = Command::Pointer(PointerEvent::Scrolled(1.0));
        let typed = [key("f", true), key("Dead", true)].map(Command::Key);
        input_state
            .apply(&mut input, typed.into_iter().chain([wheel, Command::Key(lets_go)]).collect());
        let shift = Modifiers::SHIFT;
        let [changed, pressed, wheel, released] = input.events.as_slice() else {
            panic!("{:?}", input.events)
        };
        assert_eq!(*changed, Event::ModifiersChanged(shift));
        assert!(
            matches!(pressed, Event::Key { key: Key::F, modifiers, .. } if *modifiers == shift)
        );
        assert!(matches!(wheel, Event::MouseWheel { modifiers, .. } if *modifiers == shift));
        assert_eq!(*released, Event::ModifiersChanged(Modifiers::NONE));
    }
}
