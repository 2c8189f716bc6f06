//! Models with theta and the sizes of their stacks.

use egui::{RichText, Slider, Ui};

use crate::{Command, ModelRow, ViewModel, theme};

pub(crate) fn show(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    for (index, row) in model.models.iter().enumerate() {
        ui.horizontal(|ui| {
            ui.label(RichText::new(&row.name).strong());
            ui.label(RichText::new(format!("× {}", row.instances)).color(theme::FAINT_INK));
        });
        if row.s1 + row.s2 > 0 {
            theta_slider(ui, index, row, commands);
        }
        let sizes = format!(
            "S1 {}   S2 {}   triangles {}",
            thousands(row.s1),
            thousands(row.s2),
            thousands(row.triangles)
        );
        ui.label(RichText::new(sizes).color(theme::FAINT_INK));
        ui.add_space(4.0);
    }
}

fn theta_slider(ui: &mut Ui, model: usize, row: &ModelRow, commands: &mut Vec<Command>) {
    let mut percent = row.theta * 100.0;
    ui.horizontal(|ui| {
        ui.label("theta");
        let slider = Slider::new(&mut percent, 0.0..=100.0).suffix(" %").fixed_decimals(0);
        if ui.add(slider).changed() {
            commands.push(Command::SetTheta { model, theta: percent / 100.0 });
        }
    });
}

/// What concerns the whole view: wireframe and cameras.
pub(crate) fn show_view_controls(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    ui.horizontal_wrapped(|ui| {
        let mut wireframe = model.wireframe;
        if ui.checkbox(&mut wireframe, "Wireframe").changed() {
            commands.push(Command::SetWireframe(wireframe));
        }
        for camera in &model.cameras {
            if ui.button(camera).clicked() {
                commands.push(Command::UseCamera(camera.clone()));
            }
        }
        if ui.button("Fit").clicked() {
            commands.push(Command::FitAll);
        }
    });
}

/// A count with thin spaces between thousands.
pub(crate) fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .filter_map(|group| std::str::from_utf8(group).ok())
        .collect();
    groups.join("\u{2009}")
}

#[cfg(test)]
mod tests {
    use super::thousands;

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!(thousands(7), "7");
        assert_eq!(thousands(1_057_086), "1\u{2009}057\u{2009}086");
    }
}
