//! Mouse and keyboard over the 3D scene.

use egui::{Event, InputState, Key, Modifiers, PointerButton, Rect, Response, Sense, Stroke, Ui};

use crate::{CameraMode, Command, MAX_BOOKMARKS, StandardView, ViewModel, theme};

/// Distance factor of one point of scrolling.
const ZOOM_PER_POINT: f32 = 0.998;
/// Smallest selection rectangle, points; a smaller one counts as a click.
const MIN_RECTANGLE: f32 = 3.0;
/// Digits of bookmarks, from 1.
const DIGITS: [Key; MAX_BOOKMARKS] = [
    Key::Num1,
    Key::Num2,
    Key::Num3,
    Key::Num4,
    Key::Num5,
    Key::Num6,
    Key::Num7,
    Key::Num8,
    Key::Num9,
];
/// Keys that move the eye: to the right, up and forward.
const MOVES: [(Key, [f32; 3]); 10] = [
    (Key::W, [0.0, 0.0, 1.0]),
    (Key::ArrowUp, [0.0, 0.0, 1.0]),
    (Key::S, [0.0, 0.0, -1.0]),
    (Key::ArrowDown, [0.0, 0.0, -1.0]),
    (Key::D, [1.0, 0.0, 0.0]),
    (Key::ArrowRight, [1.0, 0.0, 0.0]),
    (Key::A, [-1.0, 0.0, 0.0]),
    (Key::ArrowLeft, [-1.0, 0.0, 0.0]),
    (Key::E, [0.0, 1.0, 0.0]),
    (Key::Q, [0.0, -1.0, 0.0]),
];

/// Translates input over the scene into commands (see [`crate::help`]).
pub(crate) fn handle(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    let response = ui.allocate_rect(ui.max_rect(), Sense::click_and_drag());
    drags(ui, &response, commands);
    if response.hovered() {
        let (scroll, pinch) = ui.input(|i| (i.smooth_scroll_delta().y, i.zoom_delta()));
        if scroll != 0.0 || pinch != 1.0 {
            commands.push(Command::Zoom(ZOOM_PER_POINT.powf(scroll) / pinch));
        }
    }
    clicks(&response, model, commands);
    if !ui.ctx().egui_wants_keyboard_input() {
        ui.input(|input| keys(input, model, commands));
        moves(ui, model.navigation.mode, commands);
    }
}

fn drags(ui: &Ui, response: &Response, commands: &mut Vec<Command>) {
    let modifiers = ui.input(|i| i.modifiers);
    if modifiers.command && rectangle(ui, response, commands) {
        return;
    }
    let delta = response.drag_delta();
    let turns = response.dragged_by(PointerButton::Primary) && !modifiers.shift;
    if delta != egui::Vec2::ZERO {
        commands.push(if turns { Command::Orbit(delta) } else { Command::Pan(delta) });
    }
    if response.drag_stopped_by(PointerButton::Primary) && !modifiers.shift {
        commands.push(Command::StartInertia(ui.input(|i| i.pointer.velocity())));
    }
}

/// The rectangle between where a drag began and where it is; whether there is one.
fn rectangle(ui: &Ui, response: &Response, commands: &mut Vec<Command>) -> bool {
    let is_drawn = response.dragged_by(PointerButton::Primary);
    let is_done = response.drag_stopped_by(PointerButton::Primary);
    let pointer = ui.input(|i| i.pointer.latest_pos());
    let begins = response.drag_started_by(PointerButton::Primary);
    let pressed = ui.input(|i| i.pointer.press_origin());
    // Nothing else of the context may be asked for in there.
    let origin = response.ctx.data_mut(|data| {
        let memory = data.get_temp_mut_or_default::<Option<egui::Pos2>>(response.id);
        if begins {
            *memory = pressed;
        }
        if is_done { memory.take() } else { *memory }
    });
    let (Some(from), Some(to)) = (origin, pointer) else { return is_drawn };
    let area = Rect::from_two_pos(from, to).intersect(response.rect);
    if is_drawn {
        let painter = ui.painter().with_clip_rect(response.rect);
        painter.rect_filled(area, 0.0, theme::palette(ui.ctx()).selection.gamma_multiply(0.12));
        let line = Stroke::new(1.0, theme::palette(ui.ctx()).selection);
        painter.rect_stroke(area, 0.0, line, egui::StrokeKind::Inside);
    }
    if is_done && area.size().min_elem() >= MIN_RECTANGLE {
        commands.push(Command::PickRectangle(area));
    }
    is_drawn || is_done
}

fn clicks(response: &Response, model: &ViewModel, commands: &mut Vec<Command>) {
    let is_free = !response.dragged() && response.hovered();
    commands.push(Command::Hover(response.hover_pos().filter(|_| is_free)));
    let measuring = model.measuring.is_some();
    if response.double_clicked() && !measuring {
        commands.push(Command::FitAll);
    } else if response.clicked()
        && let Some(position) = response.interact_pointer_pos()
    {
        commands.push(match measuring {
            true => Command::Measure(position),
            false => Command::Pick(position),
        });
    }
}

/// Handles key presses with the modifiers of each event: in slow frames they may be released
/// already.
fn keys(input: &InputState, model: &ViewModel, commands: &mut Vec<Command>) {
    for event in &input.events {
        if let Event::Key { key, pressed: true, repeat: false, modifiers, .. } = event {
            commands.extend(command_of(*key, *modifiers, model));
        }
    }
}

fn command_of(key: Key, modifiers: Modifiers, model: &ViewModel) -> Option<Command> {
    if let Some(index) = DIGITS.iter().position(|digit| *digit == key) {
        let number = index + 1;
        return Some(match modifiers.command {
            true => Command::StoreBookmark(number),
            false => Command::GoToBookmark(number),
        });
    }
    if modifiers.command {
        return None;
    }
    let navigation = model.navigation;
    Some(match key {
        Key::F if modifiers.shift => Command::FitSelection,
        Key::F => Command::FitAll,
        Key::C => Command::SetCameraMode(navigation.mode.next()),
        Key::O => Command::SetOrthographic(!navigation.orthographic),
        Key::F5 => Command::UseStandardView(StandardView::Top),
        Key::F6 => Command::UseStandardView(StandardView::Front),
        Key::F7 => Command::UseStandardView(StandardView::Right),
        Key::M => Command::SetMeasuring(model.measuring.is_none()),
        Key::Escape => Command::Escape,
        _ => return None,
    })
}

/// Walks and flies as long as keys are down.
fn moves(ui: &Ui, mode: CameraMode, commands: &mut Vec<Command>) {
    if mode == CameraMode::Orbit {
        return;
    }
    let (direction, seconds, is_fast) = ui.input(|input| {
        let down = MOVES.iter().filter(|(key, _)| input.key_down(*key));
        let sum = down.fold([0.0; 3], |sum: [f32; 3], (_, way)| {
            std::array::from_fn(|axis| (sum[axis] + way[axis]).clamp(-1.0, 1.0))
        });
        (sum, input.unstable_dt, input.modifiers.shift)
    });
    let [right, up, forward] = direction;
    let up = if mode == CameraMode::Walk { 0.0 } else { up };
    if [right, up, forward] != [0.0; 3] {
        commands.push(Command::Move { direction: [right, up, forward], seconds, is_fast });
        ui.ctx().request_repaint();
    }
}

impl CameraMode {
    /// The one after it, round and round.
    fn next(self) -> Self {
        match self {
            Self::Orbit => Self::Walk,
            Self::Walk => Self::Fly,
            Self::Fly => Self::Orbit,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_match_the_help() {
        let model = ViewModel::default();
        let of = |key, modifiers| command_of(key, modifiers, &model);
        assert_eq!(of(Key::Num1, Modifiers::NONE), Some(Command::GoToBookmark(1)));
        assert_eq!(of(Key::Num9, Modifiers::COMMAND), Some(Command::StoreBookmark(9)));
        assert_eq!(of(Key::Num0, Modifiers::NONE), None);
        assert_eq!(of(Key::F, Modifiers::NONE), Some(Command::FitAll));
        assert_eq!(of(Key::F, Modifiers::SHIFT), Some(Command::FitSelection));
        assert_eq!(of(Key::F, Modifiers::COMMAND), None);
        assert_eq!(of(Key::M, Modifiers::NONE), Some(Command::SetMeasuring(true)));
        let walk = Command::SetCameraMode(CameraMode::Walk);
        assert_eq!(of(Key::C, Modifiers::NONE), Some(walk));
    }

    #[test]
    fn ctrl_counts_if_released_in_the_same_frame() {
        let mut input = InputState::default();
        let key = |key, modifiers| Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers,
        };
        let none = Modifiers::NONE;
        input.events = vec![key(Key::Num4, Modifiers::COMMAND), key(Key::Num4, none)];
        let mut commands = Vec::new();
        keys(&input, &ViewModel::default(), &mut commands);
        assert_eq!(commands, [Command::StoreBookmark(4), Command::GoToBookmark(4)]);
    }
}
