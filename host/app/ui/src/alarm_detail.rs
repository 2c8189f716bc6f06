//! Details and actions of the selected alarm.

use std::time::Duration;

use busbar_types::AlarmAction;
use egui::{Button, Label, RichText, ScrollArea, Ui};

use crate::{AlarmDetail, AlarmModel, Command, origin_mark, theme};

/// Shelving times to choose from, minutes, with their captions.
const SHELVES: [(u64, &str); 4] = [(15, "15 min"), (60, "1 h"), (240, "4 h"), (480, "8 h")];

/// Shows the selected alarm's details and the buttons of the permitted actions.
pub(crate) fn show(ui: &mut Ui, model: &AlarmModel, commands: &mut Vec<Command>) {
    if let Some(trouble) = &model.trouble {
        ui.add(Label::new(RichText::new(format!("× {trouble}")).strong()).wrap());
        ui.separator();
    }
    let Some(detail) = &model.selected else { return };
    let alarm = &detail.row;
    ui.add(Label::new(RichText::new(&alarm.message).strong()).truncate());
    buttons(ui, model, detail, commands);
    let area = ScrollArea::vertical().id_salt("alarm detail").auto_shrink(false);
    area.show(ui, |ui| {
        let state = format!("{} · {}", alarm.priority.name(), alarm.state);
        line(ui, "State", &state);
        if let Some(uncertainty) = &alarm.uncertainty {
            line(ui, "Doubt", &format!("× {uncertainty}: whether it holds still is not known"));
        }
        for words in origin_mark::words(alarm.origin) {
            line(ui, words.letters, &format!("not live: {}", words.meaning));
        }
        line(ui, "When", &detail.condition);
        line(ui, "At", alarm.equipment.as_deref().unwrap_or(""));
        line(ui, "Do", &detail.response);
        line(ui, "Else", &detail.consequence);
        line(ui, "Id", &alarm.id);
    });
}

fn line(ui: &mut Ui, caption: &str, text: &str) {
    if text.is_empty() {
        return;
    }
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(caption).color(theme::palette(ui.ctx()).weak_text));
        ui.label(text);
    });
}

fn buttons(ui: &mut Ui, model: &AlarmModel, detail: &AlarmDetail, commands: &mut Vec<Command>) {
    let alarm = detail.row.number;
    let is_ours = detail.decided_by.is_none() && !detail.row.is_saving;
    let is_free = is_ours || detail.can_ask && !detail.row.is_saving;
    let mut act = |action| commands.push(Command::ActOnAlarm { alarm, action });
    ui.horizontal_wrapped(|ui| {
        let mut button = |ui: &mut Ui, enabled: bool, words: &str, action| {
            if ui.add_enabled(enabled && is_free, Button::new(words)).clicked() {
                act(action);
            }
        };
        let unacknowledged = detail.row.is_unacknowledged;
        button(ui, unacknowledged, "Acknowledge", AlarmAction::Acknowledge);
        if detail.can_reset {
            button(ui, true, "Reset", AlarmAction::Reset);
        }
        match detail.is_out_of_service {
            true => button(ui, is_ours, "Return to service", AlarmAction::ReturnToService),
            false => button(ui, is_ours, "Out of service", AlarmAction::RemoveFromService),
        }
        if detail.is_shelved {
            button(ui, true, "Unshelve", AlarmAction::Unshelve);
        }
    });
    if detail.can_shelve && is_ours {
        ui.horizontal(|ui| {
            ui.label(RichText::new("Shelve for").color(theme::palette(ui.ctx()).weak_text));
            for (minutes, words) in SHELVES {
                let time = Duration::from_secs(minutes * 60);
                if time <= model.max_shelving && ui.button(words).clicked() {
                    let action = AlarmAction::Shelve(time);
                    commands.push(Command::ActOnAlarm { alarm, action });
                }
            }
        });
    }
    if let Some(equipment) = &detail.row.equipment
        && ui.button("Show the equipment").clicked()
    {
        commands.push(Command::Reveal(equipment.clone()));
    }
    if let Some(who) = &detail.decided_by {
        let how = if detail.can_ask { "a button asks it." } else { "act on it there." };
        let words = format!("{who} decides: {how}");
        ui.label(RichText::new(words).color(theme::palette(ui.ctx()).weak_text));
    }
}
