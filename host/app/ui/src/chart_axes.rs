//! Chart texts over the scene, and brushing of axes with the mouse.

use busbar_chart::TextKind;
use egui::{
    Align2, Color32, CursorIcon, Event, FontId, Painter, Pos2, Rect, Sense, Stroke, StrokeKind, Ui,
    vec2,
};

use crate::chart_model::{ChartCommand, ChartOverlay, ProjectedChartAxis};
use crate::{Command, theme};

/// Distance within which the pointer grabs an axis, points.
const GRIP: f32 = 9.0;
/// Depth of the lane for missing values below the axis foot, as a share of the axis length.
const LANE: f32 = 0.09;
/// Axes shorter than this show no ticks, points.
const MIN_TICKED: f32 = 130.0;
/// Axes shorter than this show no names.
const MIN_NAMED: f32 = 40.0;
/// Rows that names of axes are spread over where they stand close, and their height, points.
const NAME_ROWS: u32 = 3;
const NAME_HEIGHT: f32 = 17.0;
/// Horizontal gap between texts, points.
const WORD_GAP: f32 = 2.0;
/// A drag shorter than this is none, points.
const MIN_DRAG: f32 = 3.0;

/// Shows texts and brushes, and handles drags on axes.
pub(crate) fn show(ui: &mut Ui, overlay: &ChartOverlay, commands: &mut Vec<Command>) {
    let longest = overlay.axes.iter().map(|axis| axis.head.distance(axis.foot));
    let longest = longest.fold(0.0, f32::max);
    let gap = overlay.axes.windows(2).map(|pair| pair[0].head.distance(pair[1].head));
    let gap = gap.fold(f32::INFINITY, f32::min);
    let painter = ui.painter().with_clip_rect(ui.max_rect());
    let mut words = Vec::new();
    // Names of axes first: ticks give way to them.
    let (names, others): (Vec<_>, Vec<_>) =
        overlay.texts.iter().partition(|(_, _, kind)| *kind == TextKind::Axis);
    for (at, text, kind) in names.into_iter().chain(others) {
        let is_shown = match kind {
            TextKind::Axis | TextKind::Time => longest >= MIN_NAMED,
            TextKind::Tick | TextKind::Limit => longest >= MIN_TICKED && gap >= MIN_NAMED,
            TextKind::Missing => longest >= MIN_TICKED && gap >= MIN_NAMED,
        };
        if is_shown {
            place_text(&painter, *at, text, *kind, &mut words);
        }
    }
    for axis in &overlay.axes {
        brushes(&painter, axis);
        drag(ui, axis, commands);
        title(ui, axis, &overlay.axes, commands);
    }
    if !overlay.tooltip.is_empty() {
        tooltip(ui, &overlay.tooltip);
    }
}

/// Places a text where there is room. An axis name drops its unit or moves up before it is left
/// out.
fn place_text(painter: &Painter, at: Pos2, text: &str, kind: TextKind, there: &mut Vec<Rect>) {
    if try_place_text(painter, at, text, kind, there) || kind != TextKind::Axis {
        return;
    }
    let name = text.split(" [").next().unwrap_or_default();
    for row in 0..NAME_ROWS {
        if try_place_text(painter, at - vec2(0.0, row as f32 * NAME_HEIGHT), name, kind, there) {
            return;
        }
    }
}

/// Paints a text unless it would cover another one; reports whether it was painted.
fn try_place_text(
    painter: &Painter,
    at: Pos2,
    text: &str,
    kind: TextKind,
    there: &mut Vec<Rect>,
) -> bool {
    let (align, offset, size, ink) = match kind {
        TextKind::Axis => {
            (Align2::CENTER_BOTTOM, vec2(0.0, -7.0), 13.0, theme::palette(painter.ctx()).text)
        }
        TextKind::Tick => {
            (Align2::RIGHT_CENTER, vec2(-1.0, 0.0), 10.5, theme::palette(painter.ctx()).weak_text)
        }
        TextKind::Limit => {
            (Align2::LEFT_CENTER, vec2(2.0, 0.0), 11.0, theme::palette(painter.ctx()).text)
        }
        TextKind::Missing => {
            (Align2::CENTER_TOP, vec2(0.0, 3.0), 10.0, theme::palette(painter.ctx()).weak_text)
        }
        TextKind::Time => {
            (Align2::LEFT_CENTER, vec2(4.0, 0.0), 12.0, theme::palette(painter.ctx()).text)
        }
    };
    let font = FontId::proportional(size);
    let galley = painter.layout_no_wrap(text.to_owned(), font, ink);
    let rect = align.anchor_size(at + offset, galley.size());
    if there.iter().any(|other| other.intersects(rect.expand2(vec2(WORD_GAP, 0.0)))) {
        return false;
    }
    there.push(rect);
    // Words are read against paper, not against lines.
    painter.rect_filled(
        rect.expand2(vec2(1.5, 0.0)),
        1.0,
        theme::palette(painter.ctx()).background.gamma_multiply(0.82),
    );
    painter.galley(rect.min, galley, ink);
    true
}

fn at(axis: &ProjectedChartAxis, position: f32) -> Pos2 {
    axis.foot + (axis.head - axis.foot) * position
}

/// A frame around each brushed interval.
fn brushes(painter: &Painter, axis: &ProjectedChartAxis) {
    let along = (axis.head - axis.foot).normalized();
    let across = along.rot90() * 5.0;
    for &[low, high] in &axis.brushed {
        let (low, high) = (at(axis, low), at(axis, high));
        let corners = vec![low - across, low + across, high + across, high - across];
        painter.add(egui::Shape::convex_polygon(
            corners,
            Color32::from_white_alpha(70),
            Stroke::new(1.6, theme::palette(painter.ctx()).text),
        ));
    }
}

/// Brushing: a drag along an axis makes an interval, with Ctrl one more.
fn drag(ui: &mut Ui, axis: &ProjectedChartAxis, commands: &mut Vec<Command>) {
    let lane = at(axis, -LANE);
    let around = Rect::from_two_pos(lane, axis.head).expand(GRIP).intersect(ui.max_rect());
    let way = axis.head - axis.foot;
    let position = |pointer: Pos2| {
        let share = (pointer - axis.foot).dot(way) / way.length_sq().max(1.0);
        share.clamp(-LANE, 1.0)
    };
    // An axis that lies aslant takes drags near its line alone.
    let near = |pointer: Pos2| pointer.distance(at(axis, position(pointer))) <= GRIP;
    let pointer = ui.input(|input| input.pointer.latest_pos());
    let id = ui.id().with(("chart axis", axis.place));
    // Where the drag began; egui forgets it as the button is let go of.
    let mut origin: Option<Pos2> = ui.data(|data| data.get_temp(id));
    let is_near = pointer.is_some_and(|pointer| around.contains(pointer) && near(pointer));
    if origin.is_none() && !is_near {
        return;
    }
    let response = ui.interact(around, id, Sense::click_and_drag());
    let response = response.on_hover_cursor(CursorIcon::ResizeVertical);
    if response.drag_started() {
        origin = ui.input(|input| input.pointer.press_origin());
        ui.data_mut(|data| origin.map(|origin| data.insert_temp(id, origin)));
    }
    if response.drag_stopped() || !ui.input(|input| input.pointer.any_down()) {
        ui.data_mut(|data| data.remove_temp::<Pos2>(id));
    }
    // Where frames are slow, the pointer may be elsewhere by the time it is let go of.
    let (Some(from), Some(to)) = (origin, released_at(ui).or(pointer)) else { return };
    let alone = !ui.input(|input| input.modifiers.command);
    let positions = [position(from), position(to)];
    if response.dragged() && from.distance(to) >= MIN_DRAG {
        let shown = ProjectedChartAxis { brushed: vec![positions], ..axis.clone() };
        brushes(&ui.painter().with_clip_rect(ui.max_rect()), &shown);
    }
    if response.drag_stopped() && from.distance(to) >= MIN_DRAG {
        let command = ChartCommand::BrushAt { shown: axis.shown, positions, alone };
        commands.push(Command::Chart(command));
    }
}

/// Returns the position at which a button was released in this frame.
fn released_at(ui: &Ui) -> Option<Pos2> {
    let released = |event: &Event| match event {
        Event::PointerButton { pos, pressed: false, .. } => Some(*pos),
        _ => None,
    };
    ui.input(|input| input.events.iter().find_map(released))
}

/// Dragging an axis' name moves the axis.
fn title(
    ui: &mut Ui,
    axis: &ProjectedChartAxis,
    all: &[ProjectedChartAxis],
    commands: &mut Vec<Command>,
) {
    let rect = Rect::from_center_size(axis.head - vec2(0.0, 15.0), vec2(44.0, 16.0));
    let id = ui.id().with(("chart title", axis.place));
    let response = ui.interact(rect.intersect(ui.max_rect()), id, Sense::drag());
    let response = response.on_hover_cursor(CursorIcon::ResizeHorizontal);
    let Some(pointer) = released_at(ui).or(response.interact_pointer_pos()) else { return };
    let painter = ui.painter().with_clip_rect(ui.max_rect());
    if response.dragged() {
        let line = Stroke::new(1.0, theme::palette(painter.ctx()).selection);
        painter.rect_stroke(rect.translate(pointer - rect.center()), 2.0, line, StrokeKind::Inside);
    }
    if response.drag_stopped() {
        let distance = |other: &&ProjectedChartAxis| (other.head.x - pointer.x).abs();
        let nearest = all.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        if let Some(nearest) = nearest.filter(|nearest| nearest.place != axis.place) {
            let action = busbar_chart::Action::MoveAxis { from: axis.place, to: nearest.place };
            commands.push(Command::Chart(ChartCommand::Apply(action)));
        }
    }
}

/// Paints the tooltip of a polyline beside the pointer.
fn tooltip(ui: &Ui, lines: &[String]) {
    let scene = ui.max_rect();
    let Some(pointer) = ui.input(|input| input.pointer.hover_pos()) else { return };
    let painter = ui.painter().with_clip_rect(scene);
    let text = painter.layout_no_wrap(
        lines.join("\n"),
        theme::small_font(),
        theme::palette(painter.ctx()).text,
    );
    let size = text.size() + vec2(12.0, 8.0);
    let mut rect = Rect::from_min_size(pointer + vec2(16.0, 12.0), size);
    if rect.right() > scene.right() {
        rect = rect.translate(vec2(-size.x - 28.0, 0.0));
    }
    if rect.bottom() > scene.bottom() {
        rect = rect.translate(vec2(0.0, -size.y - 20.0));
    }
    painter.rect(
        rect,
        2.0,
        theme::palette(painter.ctx()).background,
        Stroke::new(1.0, theme::palette(painter.ctx()).border),
        StrokeKind::Inside,
    );
    painter.galley(rect.min + vec2(6.0, 4.0), text, theme::palette(painter.ctx()).text);
}
