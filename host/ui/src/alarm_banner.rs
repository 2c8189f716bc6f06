//! The most urgent alarm that nobody has acknowledged, over the scene.

use egui::{Align2, Area, Frame, Id, Label, Order, Rect, RichText, Sense, Stroke, Ui, vec2};

use crate::alarm_mark::{self, Look};
use crate::{AlarmModel, Command, theme};

/// Below the upper border of the scene, points.
const TOP: f32 = 6.0;
const MARK_RADIUS: f32 = 9.0;

/// Shows the banner while there is something for it; a click goes there. Gives its place.
pub(crate) fn show(
    ui: &Ui,
    scene: Rect,
    model: &AlarmModel,
    commands: &mut Vec<Command>,
) -> Option<Rect> {
    let alarm = model.banner.as_ref()?;
    let waiting: usize = model.counts.iter().map(|[unacknowledged, _]| unacknowledged).sum();
    let (color, _) = alarm_mark::colors(alarm.priority);
    let area = Area::new(Id::new("alarm banner"))
        .order(Order::Foreground)
        .pivot(Align2::CENTER_TOP)
        .fixed_pos(scene.center_top() + vec2(0.0, TOP));
    let frame = Frame::new()
        .fill(theme::PAPER)
        .stroke(Stroke::new(2.0, color))
        .inner_margin(vec2(8.0, 5.0))
        .corner_radius(3.0);
    let shown = area.show(ui.ctx(), |ui| {
        frame.show(ui, |ui| {
            ui.horizontal(|ui| {
                let (place, _) =
                    ui.allocate_exact_size(vec2(2.0 * MARK_RADIUS + 8.0, 22.0), Sense::hover());
                let look = Look {
                    priority: alarm.priority,
                    is_active: alarm.is_active,
                    has_ring: alarm_mark::is_lit(ui, model.flashes),
                };
                alarm_mark::paint(ui.painter(), place.center(), MARK_RADIUS, look);
                let text = |text: RichText| Label::new(text).selectable(false).extend();
                ui.add(text(RichText::new(&alarm.message).strong().size(15.0)));
                let place = alarm.equipment.as_deref().unwrap_or(&alarm.id);
                ui.add(text(RichText::new(place)));
                let words = format!("{} {}", alarm.priority.name(), alarm.state);
                ui.add(text(RichText::new(words)));
                ui.add(text(RichText::new(&alarm.time)));
                if let Some(doubt) = &alarm.doubt {
                    ui.add(text(RichText::new(format!("? {doubt}"))));
                }
                if waiting > 1 {
                    let more = format!("and {} more", waiting - 1);
                    ui.add(text(RichText::new(more).color(theme::FAINT_INK)));
                }
                let keys = RichText::new("F8 goes there").color(theme::FAINT_INK);
                ui.add(text(keys));
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
