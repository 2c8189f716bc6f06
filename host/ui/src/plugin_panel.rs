//! Plugins, how their links and their processes are.

use egui::{Label, RichText, Ui};

use crate::{Command, LinkLamp, PluginRow, theme};

pub(crate) fn show(ui: &mut Ui, plugins: &[PluginRow], commands: &mut Vec<Command>) {
    for plugin in plugins {
        ui.horizontal(|ui| {
            ui.label(RichText::new(&plugin.name).strong());
            ui.label(RichText::new(&plugin.plugin).color(theme::of(ui.ctx()).faint_ink));
            let state = match plugin.lamp {
                LinkLamp::None => "",
                LinkLamp::Up => "link up",
                LinkLamp::Waiting => "… connecting",
                LinkLamp::Down => "× down",
            };
            ui.label(state);
            if plugin.can_start && ui.button("Start now").clicked() {
                commands.push(Command::StartPlugin(plugin.name.clone()));
            }
        });
        // What may be long has lines of its own.
        for words in [&plugin.message, &plugin.process].into_iter().filter(|w| !w.is_empty()) {
            ui.add(Label::new(RichText::new(words).color(theme::of(ui.ctx()).faint_ink)).wrap());
        }
    }
}
