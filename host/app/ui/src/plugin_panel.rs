//! Plugins, how their links and their processes are.

use egui::{Align2, Label, RichText, Sense, Ui};

use crate::{Command, LinkIndicator, PluginRow, origin_mark, theme};

pub(crate) fn show(ui: &mut Ui, plugins: &[PluginRow], commands: &mut Vec<Command>) {
    for plugin in plugins {
        ui.horizontal(|ui| {
            ui.label(RichText::new(&plugin.name).strong());
            ui.label(RichText::new(&plugin.plugin).color(theme::palette(ui.ctx()).weak_text));
            if !plugin.origin.is_live() {
                let size = origin_mark::size(ui.painter(), plugin.origin);
                let (place, response) = ui.allocate_exact_size(size, Sense::hover());
                let center = place.center();
                origin_mark::paint(ui.painter(), center, Align2::CENTER_CENTER, plugin.origin);
                response.on_hover_text(origin_mark::tooltip(plugin.origin).trim_start());
            }
            let state = match plugin.link_indicator {
                LinkIndicator::None => "",
                LinkIndicator::Up => "link up",
                LinkIndicator::Waiting => "… connecting",
                LinkIndicator::Down => "× down",
            };
            ui.label(state);
            if plugin.can_start && ui.button("Start now").clicked() {
                commands.push(Command::StartPlugin(plugin.name.clone()));
            }
        });
        // What may be long has lines of its own.
        for words in [&plugin.message, &plugin.process].into_iter().filter(|w| !w.is_empty()) {
            ui.add(
                Label::new(RichText::new(words).color(theme::palette(ui.ctx()).weak_text)).wrap(),
            );
        }
    }
}
