//! Models with theta and the sizes of their stacks.

use egui::{RichText, Slider, Ui};

use crate::{Command, ModelRow, ViewModel, camera_panel, section_panel, theme};

/// Points of a label with the slider after it, without the gap between.
const LABEL_AND_SLIDER_WIDTH: f32 = 204.0;

pub(crate) fn show(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    for (index, row) in model.models.iter().enumerate() {
        ui.horizontal(|ui| {
            ui.label(RichText::new(&row.name).strong());
            ui.label(
                RichText::new(format!("× {}", row.instances))
                    .color(theme::palette(ui.ctx()).weak_text),
            );
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
        ui.label(RichText::new(sizes).color(theme::palette(ui.ctx()).weak_text));
        ui.add_space(4.0);
    }
}

fn theta_slider(ui: &mut Ui, model: usize, row: &ModelRow, commands: &mut Vec<Command>) {
    let [least, greatest] = row.theta;
    let mut percent = greatest * 100.0;
    ui.horizontal(|ui| {
        label_before_slider(ui, "theta");
        let mut slider = Slider::new(&mut percent, 0.0..=100.0).suffix(" %").fixed_decimals(0);
        if least < greatest {
            slider = slider.custom_formatter(move |_, _| span(least, greatest));
        }
        if ui.add(slider).changed() {
            commands.push(Command::SetTheta { model, theta: percent / 100.0 });
        }
        let mut by_policy = row.by_policy;
        let hint = "Theta as configured: fixed, or by distance. The slider overrides it.";
        if ui.checkbox(&mut by_policy, "auto").on_hover_text(hint).changed() {
            commands.push(match by_policy {
                true => Command::UsePolicy { model },
                false => Command::SetTheta { model, theta: greatest },
            });
        }
    });
}

/// A label, and so much width for the slider after it that all sliders end in
/// one line.
fn label_before_slider(ui: &mut Ui, text: &str) {
    let label = ui.label(text);
    ui.spacing_mut().slider_width = LABEL_AND_SLIDER_WIDTH - label.rect.width();
}

/// Percentages from the least to the greatest theta of a model's instances.
fn span(least: f64, greatest: f64) -> String {
    format!("{:.0}–{:.0}", least * 100.0, greatest * 100.0)
}

/// Shows controls of the whole view: theta scale, wireframe, measuring, section, cameras.
pub(crate) fn show_view_controls(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    if model.models.iter().any(|row| row.s1 + row.s2 > 0) {
        theta_scale_slider(ui, model, commands);
    }
    ui.horizontal_wrapped(|ui| {
        let mut wireframe = model.wireframe;
        if ui.checkbox(&mut wireframe, "Wireframe").changed() {
            commands.push(Command::SetWireframe(wireframe));
        }
        let mut measures = model.measuring.is_some();
        let hint = "Distances between clicks on surfaces; Esc ends it. M";
        if ui.checkbox(&mut measures, "Measure").on_hover_text(hint).changed() {
            commands.push(Command::SetMeasuring(measures));
        }
    });
    section_panel::show(ui, model, commands);
    camera_panel::show(ui, model, commands);
    // The panel ends here, and would cut off the buttons' frames.
    ui.add_space(2.0);
}

fn theta_scale_slider(ui: &mut Ui, model: &ViewModel, commands: &mut Vec<Command>) {
    let mut scale = model.theta_scale;
    ui.horizontal(|ui| {
        label_before_slider(ui, "auto theta");
        let range = 0.0..=model.max_theta_scale;
        let slider = Slider::new(&mut scale, range).prefix("× ").fixed_decimals(2);
        let hint = "Factor on every theta that a policy chooses; 0 shows all in full detail.";
        if ui.add(slider).on_hover_text(hint).changed() {
            commands.push(Command::SetThetaScale(scale));
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
    use super::{span, thousands};

    #[test]
    fn a_span_is_in_percent() {
        assert_eq!(span(0.0, 0.854), "0–85");
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!(thousands(7), "7");
        assert_eq!(thousands(1_057_086), "1\u{2009}057\u{2009}086");
    }
}
