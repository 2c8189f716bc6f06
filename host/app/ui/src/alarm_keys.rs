//! Keyboard shortcuts of alarms: acknowledge, shelve, next unacknowledged.

use std::time::Duration;

use busbar_types::AlarmAction;
use egui::{Context, Event, Key, Modifiers};

use crate::{AlarmModel, AlarmRows, Command};

/// Shelving time of the F10 key, limited by the configuration.
const SHELF: Duration = Duration::from_secs(30 * 60);

/// Translates keys into commands (see [`crate::help`]) and reports whether the panel's visibility
/// toggles.
pub(crate) fn handle(
    context: &Context,
    model: &AlarmModel,
    rows: &dyn AlarmRows,
    commands: &mut Vec<Command>,
) -> bool {
    if context.egui_wants_keyboard_input() {
        return false;
    }
    let mut toggles = false;
    context.input(|input| {
        for event in &input.events {
            let Event::Key { key, pressed: true, repeat: false, modifiers, .. } = event else {
                continue;
            };
            match key {
                Key::F3 => toggles = !toggles,
                Key::F8 => {
                    if let Some((alarm, equipment)) = rows.next_unacknowledged() {
                        commands.push(Command::SelectAlarm(alarm));
                        commands.extend(equipment.map(Command::Reveal));
                    }
                }
                _ => commands.extend(action_of(*key, *modifiers, model)),
            }
        }
    });
    toggles
}

/// Returns the command that a key gives to the selected alarm.
fn action_of(key: Key, modifiers: Modifiers, model: &AlarmModel) -> Option<Command> {
    let detail = model.selected.as_ref().filter(|detail| !detail.row.is_saving)?;
    let action = match key {
        Key::F9 => AlarmAction::Acknowledge,
        Key::F10 if modifiers.shift => AlarmAction::Unshelve,
        Key::F10 => AlarmAction::Shelve(SHELF.min(model.max_shelving)),
        _ => return None,
    };
    Some(Command::ActOnAlarm { alarm: detail.row.number, action })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AlarmDetail;

    #[test]
    fn keys_act_on_the_alarm_that_was_chosen() {
        let mut model = AlarmModel { max_shelving: SHELF * 2, ..AlarmModel::default() };
        assert_eq!(action_of(Key::F9, Modifiers::NONE, &model), None);
        let mut detail = AlarmDetail::default();
        detail.row.number = 7;
        model.selected = Some(detail);
        let of = |key, modifiers, model: &AlarmModel| match action_of(key, modifiers, model) {
            Some(Command::ActOnAlarm { alarm: 7, action }) => Some(action),
            _ => None,
        };
        assert_eq!(of(Key::F9, Modifiers::NONE, &model), Some(AlarmAction::Acknowledge));
        assert_eq!(of(Key::F10, Modifiers::SHIFT, &model), Some(AlarmAction::Unshelve));
        assert_eq!(of(Key::F10, Modifiers::NONE, &model), Some(AlarmAction::Shelve(SHELF)));
        model.max_shelving = Duration::from_secs(60);
        let shortest = AlarmAction::Shelve(Duration::from_secs(60));
        assert_eq!(of(Key::F10, Modifiers::NONE, &model), Some(shortest));
    }
}
