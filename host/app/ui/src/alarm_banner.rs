//! Alarm banner over the scene: the most urgent unacknowledged alarm.

use egui::{Align2, Area, Frame, Id, Label, Order, Rect, RichText, Sense, Stroke, Ui, vec2};

use crate::alarm_symbol::{self, AlarmSymbol};
use crate::{AlarmModel, AlarmRow, Command, origin_mark, theme};

/// Below the upper border of the scene, points.
const TOP: f32 = 6.0;
const MARK_RADIUS: f32 = 9.0;
/// A scene wider than this has room for all in one line, points.
const ONE_LINE_WIDTH: f32 = 860.0;
/// Width that the banner's frame and the borders of the scene take, points.
const MARGINS: f32 = 40.0;

/// Shows the banner while there is something for it; a click goes there. Gives its place.
pub(crate) fn show(
    ui: &Ui,
    scene: Rect,
    model: &AlarmModel,
    commands: &mut Vec<Command>,
) -> Option<Rect> {
    let alarm = model.banner.as_ref()?;
    let waiting: usize = model.counts.iter().map(|[unacknowledged, _]| unacknowledged).sum();
    let (color, _) = alarm_symbol::colors(alarm.priority);
    let area = Area::new(Id::new("alarm banner"))
        .order(Order::Foreground)
        .pivot(Align2::CENTER_TOP)
        .fixed_pos(scene.center_top() + vec2(0.0, TOP));
    let frame = Frame::new()
        .fill(theme::palette(ui.ctx()).background)
        .stroke(Stroke::new(2.0, color))
        .inner_margin(vec2(8.0, 5.0))
        .corner_radius(3.0);
    let shown = area.show(ui.ctx(), |ui| {
        frame.show(ui, |ui| {
            // Over the scene alone, never over panels.
            ui.set_max_width((scene.width() - MARGINS).max(0.0));
            ui.horizontal(|ui| {
                let (place, _) =
                    ui.allocate_exact_size(vec2(2.0 * MARK_RADIUS + 8.0, 22.0), Sense::hover());
                let symbol = AlarmSymbol {
                    priority: alarm.priority,
                    // Hollow as at the equipment where nobody knows.
                    is_active: alarm.is_active && alarm.uncertainty.is_none(),
                    has_ring: alarm_symbol::is_flash_on(ui, model.flashes),
                };
                alarm_symbol::paint(ui.painter(), place.center(), MARK_RADIUS, symbol);
                if scene.width() > ONE_LINE_WIDTH {
                    show_message(ui, alarm);
                    show_state(ui, alarm, waiting);
                    return;
                }
                ui.vertical(|ui| {
                    ui.horizontal(|ui| show_message(ui, alarm));
                    ui.horizontal(|ui| show_state(ui, alarm, waiting));
                });
            })
        })
    });
    let is_clicked = ui.ctx().input(|input| {
        let inside = |at| shown.response.rect.contains(at);
        input.pointer.primary_clicked() && input.pointer.interact_pos().is_some_and(inside)
    });
    if is_clicked {
        commands.push(Command::SelectAlarm(alarm.number));
        commands.extend(alarm.equipment.clone().map(Command::Reveal));
    }
    Some(shown.response.rect)
}

/// Shows the origin marks, the message and the equipment of an alarm.
fn show_message(ui: &mut Ui, alarm: &AlarmRow) {
    if !alarm.origin.is_live() {
        let size = origin_mark::size(ui.painter(), alarm.origin);
        let (place, _) = ui.allocate_exact_size(size, Sense::hover());
        origin_mark::paint(ui.painter(), place.center(), Align2::CENTER_CENTER, alarm.origin);
    }
    text(ui, RichText::new(&alarm.message).strong().size(15.0));
    text(ui, RichText::new(alarm.equipment.as_deref().unwrap_or(&alarm.id)));
}

/// Shows state, time of occurrence, doubt, and the number of further unacknowledged alarms.
fn show_state(ui: &mut Ui, alarm: &AlarmRow, waiting: usize) {
    text(ui, RichText::new(format!("{} {}", alarm.priority.name(), alarm.state)));
    text(ui, RichText::new(&alarm.time));
    if let Some(uncertainty) = &alarm.uncertainty {
        text(ui, RichText::new(format!("? {uncertainty}")));
    }
    let faint = theme::palette(ui.ctx()).weak_text;
    if waiting > 1 {
        text(ui, RichText::new(format!("and {} more", waiting - 1)).color(faint));
    }
    text(ui, RichText::new("F8 goes there").color(faint));
}

fn text(ui: &mut Ui, text: RichText) {
    ui.add(Label::new(text).selectable(false).truncate());
}
