//! Overlay layers with visibility switches and legends.

use busbar_types::Pattern;
use egui::{
    Align2, Area, Color32, Context, Frame, Id, Painter, Pos2, Rect, RichText, Shape, Stroke,
    StrokeKind, Ui, pos2, vec2,
};

use crate::switch_symbols::{self, SwitchState};
use crate::{Command, ContourRow, LayerRow, LegendRow, ValueMark, quality_hatching, theme};

/// Points between the layers and the edge of the scene.
const MARGIN: f32 = 8.0;
/// Size of a sample, points.
const SWATCH_SIZE: [f32; 2] = [26.0, 13.0];
/// Height of a flag's sample, points.
const SYMBOL_HEIGHT: f32 = 17.0;
/// Largest share of the scene's height before the legend scrolls.
const MAX_SHARE: f32 = 0.5;
/// Id of the egui area.
const ID: &str = "layers";
/// Share of the state color in a solid swatch over equipment gray.
const PLAIN_SHARE: f32 = 0.55;
/// Points from stripe to stripe.
const STEP: f32 = 6.0;

/// Returns the rectangle of the layer panel in the last frame; labels are placed beside it.
pub(crate) fn last_rect(context: &Context, layers: &[LayerRow]) -> Option<Rect> {
    context.memory(|memory| memory.area_rect(Id::new(ID))).filter(|_| !layers.is_empty())
}

/// Shows the layers in the lower left corner of the scene.
pub(crate) fn show(context: &Context, scene: Rect, layers: &[LayerRow], into: &mut Vec<Command>) {
    if layers.is_empty() {
        return;
    }
    let area = Area::new(Id::new(ID)).pivot(Align2::LEFT_BOTTOM).constrain_to(scene);
    area.fixed_pos(scene.left_bottom() + vec2(MARGIN, -MARGIN)).show(context, |ui| {
        let frame = Frame::new()
            .fill(theme::palette(context).background)
            .stroke(Stroke::new(1.0, theme::palette(context).border));
        frame.corner_radius(2.0).inner_margin(6.0).show(ui, |ui| {
            let height = scene.height() * MAX_SHARE;
            let scroll = egui::ScrollArea::vertical().id_salt("legend").max_height(height);
            scroll.min_scrolled_height(height).show(ui, |ui| {
                for (index, layer) in layers.iter().enumerate() {
                    let mut shown = layer.shown;
                    if ui.checkbox(&mut shown, &layer.name).changed() {
                        into.push(Command::SetLayer { layer: index, shown });
                    }
                    if layer.shown && layer.is_late {
                        ui.horizontal(|ui| {
                            ui.add_space(18.0);
                            let mark = ValueMark::LateDisplay;
                            let words = format!("{} {}", theme::symbol(&mark), theme::LATE_DISPLAY);
                            let (ground, ink) = theme::background_and_text(context, &mark);
                            ui.label(RichText::new(words).color(ink).background_color(ground));
                        });
                    }
                    if layer.shown {
                        layer.legend.iter().for_each(|row| entry(ui, row));
                        if layer.has_switch_symbols {
                            SwitchState::ALL
                                .into_iter()
                                .for_each(|state| switch_symbol_entry(ui, state));
                        }
                        if layer.has_arrows {
                            FlowArrowKind::ALL.into_iter().for_each(|key| arrow_entry(ui, key));
                        }
                        if let Some(contour) = &layer.contour {
                            contour_entries(ui, contour);
                        }
                    }
                }
            });
        });
    });
}

/// A sample of a state with its name.
pub(crate) fn entry(ui: &mut Ui, row: &LegendRow) {
    ui.horizontal(|ui| {
        ui.add_space(18.0);
        let (rect, _) = ui.allocate_exact_size(SWATCH_SIZE.into(), egui::Sense::hover());
        paint_swatch(&ui.painter().with_clip_rect(rect), rect, row);
        ui.label(&row.name);
    });
}

/// The flag of a state with its name.
fn switch_symbol_entry(ui: &mut Ui, state: SwitchState) {
    ui.horizontal(|ui| {
        ui.add_space(18.0);
        let size = vec2(SWATCH_SIZE[0], SYMBOL_HEIGHT);
        let (rect, _) = ui.allocate_exact_size(size, egui::Sense::hover());
        switch_symbols::shape(ui.painter(), rect.center(), state);
        ui.label(state.word());
    });
}

/// The arrows of a legend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FlowArrowKind {
    /// Flow within the rating.
    Within,
    /// Flow above the rating.
    Above,
    /// No flow at all.
    None,
    /// Flow of unknown amount.
    Unknown,
}

impl FlowArrowKind {
    pub(crate) const ALL: [Self; 4] = [Self::Within, Self::Above, Self::None, Self::Unknown];

    fn word(self) -> &'static str {
        match self {
            Self::Within => "power, as wide as its share of the rating",
            Self::Above => "above the rating",
            Self::None => "no power",
            Self::Unknown => "not known",
        }
    }
}

fn arrow_entry(ui: &mut Ui, key: FlowArrowKind) {
    ui.horizontal(|ui| {
        ui.add_space(18.0);
        let (rect, _) = ui.allocate_exact_size(SWATCH_SIZE.into(), egui::Sense::hover());
        arrow(ui.painter(), rect, key);
        ui.label(key.word());
    });
}

/// An arrow as it is in the scene, in a sample.
pub(crate) fn arrow(painter: &Painter, rect: Rect, key: FlowArrowKind) {
    let ink = theme::palette(painter.ctx()).text;
    let fill = match key {
        FlowArrowKind::Above => theme::WARNING,
        _ => Color32::from_gray(120),
    };
    let heads = match key {
        FlowArrowKind::Within => 1,
        FlowArrowKind::Above => 2,
        FlowArrowKind::None | FlowArrowKind::Unknown => 0,
    };
    let edge = Stroke::new(1.0, ink);
    let head = 6.0;
    let shaft = Rect::from_center_size(rect.center(), vec2(rect.width(), 5.0));
    let shaft = shaft.with_max_x(rect.right() - head * heads as f32);
    if key == FlowArrowKind::Unknown {
        let [a, b, c, d] =
            [shaft.left_top(), shaft.right_top(), shaft.right_bottom(), shaft.left_bottom()];
        painter.extend(Shape::dashed_line(&[a, b, c, d, a], edge, 3.0, 2.0));
        return;
    }
    painter.rect(shaft, 0.0, fill, edge, StrokeKind::Inside);
    for number in 0..heads {
        let base = shaft.right() + head * number as f32;
        let tip = vec![
            pos2(base, rect.top()),
            pos2(base + head, rect.center().y),
            pos2(base, rect.bottom()),
        ];
        painter.add(Shape::convex_polygon(tip, fill, edge));
    }
}

fn contour_entries(ui: &mut Ui, contour: &ContourRow) {
    let row = |ui: &mut Ui, words: &str, paint: &dyn Fn(&Painter, Rect)| {
        ui.horizontal(|ui| {
            ui.add_space(18.0);
            let (rect, _) = ui.allocate_exact_size(SWATCH_SIZE.into(), egui::Sense::hover());
            paint(&ui.painter().with_clip_rect(rect), rect);
            ui.label(words);
        });
    };
    let line = Stroke::new(1.0, Color32::from_gray(46));
    ui.horizontal(|ui| {
        ui.add_space(18.0);
        ui.label(&contour.name);
    });
    row(ui, &contour.normal, &|painter, rect| {
        painter.rect(rect, 0.0, Color32::from_gray(236), line, StrokeKind::Inside);
    });
    row(ui, &contour.step, &|painter, rect| {
        let [first, last] = contour.colors.map(|[r, g, b]| Color32::from_rgb(r, g, b));
        for part in 0..4 {
            let width = rect.width() / 4.0;
            let left = rect.left() + width * part as f32;
            let own = Rect::from_min_size(pos2(left, rect.top()), vec2(width, rect.height()));
            painter.rect_filled(own, 0.0, first.lerp_to_gamma(last, part as f32 / 3.0));
            painter.line_segment([own.left_top(), own.left_bottom()], line);
        }
    });
    row(ui, "no data", &|painter, rect| {
        quality_hatching::draw_stripes(painter, rect, &ValueMark::Bad { reason: String::new() });
        painter.rect_stroke(rect, 0.0, line, StrokeKind::Inside);
    });
    ui.horizontal(|ui| {
        ui.add_space(18.0);
        ui.label(&contour.reach);
    });
}

pub(crate) fn paint_swatch(painter: &Painter, rect: Rect, row: &LegendRow) {
    let [red, green, blue] = row.color;
    let color = Color32::from_rgb(red, green, blue);
    // What shows between stripes is equipment, as a rule light grey.
    let body = Color32::from_gray(205);
    let plain = body.lerp_to_gamma(color, PLAIN_SHARE);
    painter.rect_filled(rect, 0.0, if row.pattern == Pattern::Solid { plain } else { body });
    let line = Stroke::new(0.5 * STEP, color);
    let slants: &[f32] = match row.pattern {
        Pattern::Solid => &[],
        Pattern::Striped => &[1.0],
        Pattern::Crossed => &[1.0, -1.0],
        Pattern::Dotted => {
            dots(rect).for_each(|at| {
                let _ = painter.circle_filled(at, 1.6, color);
            });
            &[]
        }
    };
    for slant in slants {
        let count = ((rect.width() + rect.height()) / (STEP * 1.4)) as i32 + 1;
        for i in 0..=count {
            let x = rect.left() + i as f32 * STEP * 1.4;
            let (a, b) = (pos2(x - rect.height(), rect.bottom()), pos2(x, rect.top()));
            let mirrored = |p: Pos2| pos2(p.x, rect.top() + rect.bottom() - p.y);
            let ends = if *slant > 0.0 { [a, b] } else { [mirrored(a), mirrored(b)] };
            painter
                .line_segment(ends, if slants.len() > 1 { Stroke::new(1.6, color) } else { line });
        }
    }
}

fn dots(rect: Rect) -> impl Iterator<Item = Pos2> {
    let (columns, rows) = ((rect.width() / STEP) as i32, (rect.height() / STEP) as i32);
    (0..=columns).flat_map(move |x| {
        (0..=rows).map(move |y| rect.min + vec2(x as f32 + 0.5, y as f32 + 0.5) * STEP)
    })
}

#[cfg(test)]
#[path = "layers_tests.rs"]
mod tests;
