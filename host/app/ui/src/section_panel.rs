//! The plane that cuts the scene open.

use egui::{Slider, Ui};

use crate::{AxisSection, Command, ViewModel};

const AXES: [&str; 3] = ["x", "y", "z"];
/// Points: with the switches before it, the slider ends where the others do.
const SLIDER_WIDTH: f32 = 66.0;

/// A switch, and where the plane lies while it is on.
pub(crate) fn show(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    let before = model.section;
    let mut cut = before;
    ui.horizontal(|ui| {
        let mut is_on = cut.is_some();
        let hint = "Cuts away what lies beyond a plane across an axis";
        if ui.checkbox(&mut is_on, "Section").on_hover_text(hint).changed() {
            cut = is_on.then(|| middle_of(model, 0));
        }
        let Some(cut) = &mut cut else { return };
        for (axis, name) in AXES.into_iter().enumerate() {
            if ui.selectable_label(axis == cut.axis, name).clicked() && axis != cut.axis {
                *cut = AxisSection { from_below: cut.from_below, ..middle_of(model, axis) };
            }
        }
        let [low, high] = extent(model, cut.axis);
        ui.spacing_mut().slider_width = SLIDER_WIDTH;
        ui.add(Slider::new(&mut cut.at, low..=high).suffix(" m").fixed_decimals(2));
        ui.checkbox(&mut cut.from_below, "other side");
    });
    if cut != before {
        commands.push(Command::SetSection(cut));
    }
}

fn middle_of(model: &ViewModel, axis: usize) -> AxisSection {
    let [low, high] = extent(model, axis);
    AxisSection { axis, at: (low + high) * 0.5, from_below: false }
}

fn extent(model: &ViewModel, axis: usize) -> [f32; 2] {
    model.extent.map(|corner| corner.get(axis).copied().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_new_section_starts_in_the_middle_of_the_scene() {
        let model = ViewModel { extent: [[-4.0, 0.0, 2.0], [8.0, 6.0, 3.0]], ..Default::default() };
        let at = [0, 1, 2].map(|axis| middle_of(&model, axis).at);
        assert_eq!(at, [2.0, 3.0, 2.5]);
    }
}
