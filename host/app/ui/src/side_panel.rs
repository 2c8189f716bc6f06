//! Side panel with the tabs equipment, tags, display and plugins.

use egui::{ScrollArea, Ui};

use crate::equipment_panel::EquipmentPanel;
use crate::search_field::SearchField;
use crate::shortcuts::Tab;
use crate::{Command, FrameTimes, ListModels, ViewModel, model_panel, plugin_panel, tag_panel};

/// The panel between frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct SidePanel {
    tab: Tab,
    equipment: EquipmentPanel,
    tags: SearchField,
}

impl SidePanel {
    /// Turns to the tab whose key is pressed, ready to type; whether one is.
    pub(crate) fn take_keys(&mut self, context: &egui::Context) -> bool {
        let Some(tab) = Tab::pressed(context) else { return false };
        self.tab = tab;
        match tab {
            Tab::Equipment => self.equipment.search.focus(),
            Tab::Tags => self.tags.focus(),
            Tab::Display | Tab::Plugins => {}
        }
        true
    }

    pub(crate) fn show(
        &mut self,
        ui: &mut Ui,
        model: &ViewModel,
        lists: &ListModels<'_>,
        commands: &mut Vec<Command>,
    ) {
        ui.add_space(3.0);
        ui.horizontal(|ui| {
            for tab in Tab::ALL {
                let label = ui.selectable_label(self.tab == tab, tab.name());
                if label.on_hover_text(tab.shortcut()).clicked() {
                    self.tab = tab;
                }
            }
        });
        ui.separator();
        match self.tab {
            Tab::Equipment => self.equipment.show(ui, lists.equipment, commands),
            Tab::Tags => tag_panel::show(ui, &mut self.tags, lists.tags, commands),
            Tab::Display => display(ui, model, commands),
            Tab::Plugins => {
                let area = ScrollArea::vertical().id_salt("plugins").auto_shrink(false);
                area.show(ui, |ui| plugin_panel::show(ui, &model.plugins, commands));
            }
        }
    }
}

/// Shows the display tab: view controls, models with their level of detail, frame times.
fn display(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    // The bar stands at the edge, not over the rows.
    let area = ScrollArea::vertical().id_salt("display").auto_shrink(false);
    area.show(ui, |ui| {
        model_panel::show_view_controls(ui, model, commands);
        ui.add_space(6.0);
        ui.heading("Models");
        model_panel::show(ui, model, commands);
        ui.add_space(6.0);
        ui.heading("Frame");
        frame_times(ui, &model.frame_times);
    });
}

/// Shows the times of a recent frame, for diagnosis.
fn frame_times(ui: &mut Ui, times: &FrameTimes) {
    ui.label(format!("until submission: {:.1} ms", times.frame));
    for (stage, millis) in &times.gpu_stages {
        ui.label(format!("GPU {stage}: {millis:.2} ms"));
    }
}
