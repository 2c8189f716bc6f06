//! The panel of a chart: layout, axes, brushes, time.

use busbar_chart::{Action, BrushOperator, Layout};
use egui::{
    Align2, Button, Context, DragValue, Rect, RichText, ScrollArea, Sense, Slider, Ui, Vec2,
    Window, pos2, vec2,
};

use crate::chart_model::{ChartCommand, ChartModel, DensityLegend};
use crate::{Command, layers, theme};

/// Width of the panel, points.
const WIDTH: f32 = 250.0;
const MARGIN: f32 = 8.0;
/// Height of the list of axes, points.
const AXES_HEIGHT: f32 = 170.0;
/// Room for the shades of a density, points, and how many it takes.
const SHADES: Vec2 = vec2(90.0, 12.0);
const SHADE_COUNT: usize = 18;
/// Pieces of equipment that are named.
const MAX_NAMED: usize = 6;
const NANOS_PER_DAY: f64 = 86_400e9;

/// Shows the panel in the lower right corner of the scene.
pub(crate) fn show(context: &Context, scene: Rect, model: &ChartModel, into: &mut Vec<Command>) {
    let window = Window::new(&model.name).id("chart".into()).pivot(Align2::RIGHT_BOTTOM);
    let window = window.default_pos(scene.right_bottom() - vec2(MARGIN, MARGIN));
    let window = window.constrain_to(scene).default_width(WIDTH).resizable(false);
    let mut ask = |command| into.push(Command::Chart(command));
    window.show(context, |ui| {
        ui.set_width(WIDTH);
        if let Some(fault) = &model.fault {
            ui.label(RichText::new(format!("× may be out of date: {fault}")).strong());
        }
        layouts(ui, model, &mut ask);
        time(ui, model, &mut ask);
        ui.separator();
        legend(ui, model);
        ui.separator();
        brushes(ui, model, &mut ask);
        ui.separator();
        axes(ui, model, &mut ask);
    });
}

fn layouts(ui: &mut Ui, model: &ChartModel, ask: &mut impl FnMut(ChartCommand)) {
    ui.horizontal(|ui| {
        for (layout, name, hint) in [
            (Layout::Flat, "Flat", "Axes side by side"),
            (Layout::Focus, "Focus", "The first axis in the centre, the others around it"),
            (Layout::Time, "Time", "Axes side by side, time into the depth"),
        ] {
            let label = ui.selectable_label(model.layout == layout, name).on_hover_text(hint);
            if label.clicked() {
                ask(ChartCommand::Apply(Action::SetLayout(layout)));
            }
        }
        let mut clusters = model.shows_clusters;
        let hint = "How the records of each state spread: from the lowest tenth to the highest";
        if ui.checkbox(&mut clusters, "Spread").on_hover_text(hint).changed() {
            ask(ChartCommand::Apply(Action::ShowClusters(clusters)));
        }
    });
}

/// Shows the displayed instant with a time slider and playback controls.
fn time(ui: &mut Ui, model: &ChartModel, ask: &mut impl FnMut(ChartCommand)) {
    ui.label(format!("Shows {}", model.shown_at));
    let Some([first, last]) = model.span else { return };
    ui.horizontal(|ui| {
        let days = (last - first) as f64 / NANOS_PER_DAY;
        let at = model.playhead.unwrap_or(last);
        let mut day = (at - first) as f64 / NANOS_PER_DAY;
        ui.spacing_mut().slider_width = WIDTH - 90.0;
        if ui.add(Slider::new(&mut day, 0.0..=days.max(1e-9)).show_value(false)).changed() {
            let to = first + (day * NANOS_PER_DAY) as i64;
            ask(ChartCommand::Apply(Action::SetPlayhead(Some(to))));
        }
        let now = Button::new("Now").selected(model.playhead.is_none());
        if ui.add(now).on_hover_text("Show the present").clicked() {
            ask(ChartCommand::Apply(Action::SetPlayhead(None)));
        }
    });
    ui.horizontal(|ui| {
        let name = if model.plays { "Stop" } else { "Play" };
        if ui.button(name).clicked() {
            ask(ChartCommand::Apply(Action::Play(!model.plays)));
        }
        let mut follows = model.follows;
        let hint = "Go to equipment whose record becomes abnormal, and say why";
        if ui.checkbox(&mut follows, "Follow faults").on_hover_text(hint).changed() {
            ask(ChartCommand::Follow(follows));
        }
    });
}

fn legend(ui: &mut Ui, model: &ChartModel) {
    for row in &model.legend {
        layers::entry(ui, row);
    }
    match &model.density {
        None => {
            ui.label(format!("{} records known", model.known));
        }
        Some(density) => self::density(ui, density, model.known),
    }
}

/// Shows the density scale with its range.
fn density(ui: &mut Ui, density: &DensityLegend, known: usize) {
    if let Some(fault) = &density.fault {
        ui.label(RichText::new(format!("× cannot be counted: {fault}")).strong());
        return;
    }
    match density.counting {
        Some([counted, of]) => ui.label(format!("Counting: {counted} of {of} records")),
        None => ui.label(format!("{known} records known, shown by their density")),
    };
    ui.horizontal(|ui| {
        ui.label("1 line");
        let (rect, _) = ui.allocate_exact_size(SHADES, Sense::hover());
        let step = rect.width() / SHADE_COUNT as f32;
        for shade in 0..SHADE_COUNT {
            let left = rect.left() + shade as f32 * step;
            let strip = Rect::from_min_size(pos2(left, rect.top()), vec2(step, rect.height()));
            let share = (shade as f32 + 0.5) / SHADE_COUNT as f32;
            ui.painter().rect_filled(
                strip,
                0.0,
                theme::palette(ui.ctx()).text.gamma_multiply(share),
            );
        }
        let hint = "Lines where most are; between, by the logarithm";
        ui.label(format!("{} lines", density.most)).on_hover_text(hint);
    });
}

fn brushes(ui: &mut Ui, model: &ChartModel, ask: &mut impl FnMut(ChartCommand)) {
    ui.horizontal(|ui| {
        ui.strong("Brushes");
        for (join, name, hint) in [
            (BrushOperator::And, "all", "What meets all brushes"),
            (BrushOperator::Or, "any", "What meets any brush"),
        ] {
            if ui.selectable_label(model.join == join, name).on_hover_text(hint).clicked() {
                ask(ChartCommand::Apply(Action::SetBrushOperator(join)));
            }
        }
        if !model.brushes.is_empty() && ui.button("Clear").clicked() {
            ask(ChartCommand::Apply(Action::ClearBrushes));
        }
    });
    for (index, words) in model.brushes.iter().enumerate() {
        ui.horizontal(|ui| {
            if ui.small_button("×").on_hover_text("Take it away").clicked() {
                ask(ChartCommand::Apply(Action::RemoveBrush(index)));
            }
            ui.label(words);
        });
    }
    match model.meant {
        None => {
            ui.label("Drag along an axis; with Ctrl once more.");
        }
        Some(meant) => {
            let named = model.meant_equipment.len();
            ui.label(format!("{meant} records; {named} pieces of equipment now:"));
            for id in model.meant_equipment.iter().take(MAX_NAMED) {
                if ui.link(id).clicked() {
                    ask_reveal(ui, id);
                }
            }
            if named > MAX_NAMED {
                ui.label(format!("and {} more", named - MAX_NAMED));
            }
        }
    }
    let hint = "Copies brushed records as CSV; without brushes, all";
    if ui.button("Copy as CSV").on_hover_text(hint).clicked() {
        ask(ChartCommand::Copy);
    }
}

/// Remembered for the end of the pass, where commands other than a chart's may go.
fn ask_reveal(ui: &Ui, id: &str) {
    ui.ctx().data_mut(|data| data.insert_temp(reveal_id(), id.to_owned()));
}

fn reveal_id() -> egui::Id {
    egui::Id::new("chart reveals")
}

/// The equipment whose name was clicked.
pub(crate) fn take_reveal(context: &Context) -> Option<String> {
    context.data_mut(|data| data.remove_temp(reveal_id()))
}

fn axes(ui: &mut Ui, model: &ChartModel, ask: &mut impl FnMut(ChartCommand)) {
    ui.strong("Axes");
    let last = model.axes.len().saturating_sub(1);
    let area = ScrollArea::vertical().id_salt("chart axes").max_height(AXES_HEIGHT);
    area.auto_shrink([false, true]).show(ui, |ui| {
        let mut shown = 0;
        for (at, axis) in model.axes.iter().enumerate() {
            ui.horizontal(|ui| {
                let mut action = None;
                let mut visible = !axis.is_hidden;
                if ui.checkbox(&mut visible, "").on_hover_text("Show this axis").changed() {
                    action = Some(Action::HideAxis(at));
                }
                let up = Button::new("<").small();
                if ui.add_enabled(at > 0, up).on_hover_text("To the left").clicked() {
                    action = Some(Action::MoveAxis { from: at, to: at - 1 });
                }
                let down = Button::new(">").small();
                if ui.add_enabled(at < last, down).on_hover_text("To the right").clicked() {
                    action = Some(Action::MoveAxis { from: at, to: at + 1 });
                }
                let flip = ui.selectable_label(axis.is_flipped, "flip");
                if flip.on_hover_text("Upside down").clicked() {
                    action = Some(Action::FlipAxis(at));
                }
                let scale = ui.selectable_label(axis.log, "log");
                if scale.on_hover_text("Logarithmic").clicked() {
                    action = Some(Action::SwitchScale(at));
                }
                let fit = ui.small_button("fit");
                let hint = "From the lowest brushed value to the highest; without, as described";
                if fit.on_hover_text(hint).clicked() {
                    action = Some(Action::Rescale(at));
                }
                ui.label(&axis.name);
                if let Some(action) = action {
                    ask(ChartCommand::Apply(action));
                }
            });
            shown += usize::from(!axis.is_hidden);
        }
        angle(ui, shown, ask);
    });
}

/// A brush by angle: how much lines rise from an axis to the next one.
fn angle(ui: &mut Ui, shown: usize, ask: &mut impl FnMut(ChartCommand)) {
    let id = ui.id().with("angle");
    let (mut axis, mut low, mut high): (usize, f32, f32) =
        ui.data(|data| data.get_temp(id)).unwrap_or((1, 25.0, 100.0));
    ui.horizontal(|ui| {
        ui.label("Rise from axis");
        ui.add(DragValue::new(&mut axis).range(1..=shown.saturating_sub(1).max(1)));
        ui.add(DragValue::new(&mut low).range(-100.0..=high).suffix(" %"));
        ui.label("to");
        ui.add(DragValue::new(&mut high).range(low..=100.0).suffix(" %"));
        let hint = "Brush lines that rise so much to the next axis";
        if ui.small_button("brush").on_hover_text(hint).clicked() {
            let range = [low, high].map(|percent| percent / 100.0);
            ask(ChartCommand::BrushRise { shown: axis - 1, range });
        }
    });
    ui.data_mut(|data| data.insert_temp(id, (axis, low, high)));
}
