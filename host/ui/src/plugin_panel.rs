//! Plugins and how their links are.

use egui::{RichText, Ui};

use crate::{LinkLamp, PluginRow, theme};

pub(crate) fn show(ui: &mut Ui, plugins: &[PluginRow]) {
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
        });
    }
}
