//! Plugins, how their links and their processes are.

use egui::{RichText, Ui};

use crate::{Command, LinkLamp, PluginRow, theme};

pub(crate) fn show(ui: &mut Ui, plugins: &[PluginRow], commands: &mut Vec<Command>) {
    for plugin in plugins {
        ui.horizontal_wrapped(|ui| {
            ui.label(RichText::new(&plugin.name).strong());
            ui.label(RichText::new(&plugin.plugin).color(theme::FAINT_INK));
            let state = match plugin.lamp {
                LinkLamp::None => "",
                LinkLamp::Up => "link up",
                LinkLamp::Waiting => "… connecting",
                LinkLamp::Down => "× down",
            };
            ui.label(state);
            ui.label(RichText::new(&plugin.message).color(theme::FAINT_INK));
            ui.label(RichText::new(&plugin.process).color(theme::FAINT_INK));
            if plugin.can_start && ui.button("Start now").clicked() {
                commands.push(Command::StartPlugin(plugin.name.clone()));
            }
        });
    }
}
