//! Greyscale distinction of all marks in panels and scene, tested pair by pair on rasterised
//! pictures.

use busbar_types::{Origin, Pattern, Priority};
use egui::epaint::{Primitive, Vertex};
use egui::{Context, Painter, RawInput, Rect, Ui, Vec2, pos2};

use crate::alarm_symbol::{self, AlarmSymbol};
use crate::layers::{self, FlowArrowKind};
use crate::switch_symbols::{self, SwitchState};
use crate::{LegendRow, ValueMark, origin_band, origin_mark, quality_hatching, theme};

/// Side of a test picture, pixels.
const SIDE: usize = 48;
/// Levels of grey, of 255, by which a pixel is seen to differ beside its neighbour.
const VISIBLE: f32 = 14.0;
/// Pixels that differ where two marks do: a stroke as long as a mark is wide.
const MIN_PIXELS: usize = 20;

/// Luma (ITU-R BT.709) of a square of pixels.
type Picture = Vec<f32>;

fn picture(is_dark: bool, paint: impl Fn(&Painter, Rect)) -> Picture {
    let context = Context::default();
    theme::apply(&context, is_dark, None);
    let screen = Rect::from_min_size(pos2(0.0, 0.0), Vec2::splat(SIDE as f32));
    let input = || RawInput { screen_rect: Some(screen), ..RawInput::default() };
    let show = |ui: &mut Ui| {
        ui.painter().rect_filled(screen, 0.0, theme::palette(ui.ctx()).background);
        paint(ui.painter(), screen);
    };
    // Fonts are there from the second pass on.
    let mut output = context.run_ui(input(), show);
    let mut atlas = Atlas::default();
    atlas.take(&output.textures_delta);
    output.textures_delta.clear();
    let mut output = context.run_ui(input(), show);
    atlas.take(&output.textures_delta);
    output.textures_delta.clear();
    let mut picture = vec![0.0; SIDE * SIDE];
    for primitive in context.tessellate(std::mem::take(&mut output.shapes), 1.0) {
        let Primitive::Mesh(mesh) = primitive.primitive else { continue };
        for corners in mesh.indices.chunks_exact(3) {
            let corners = [0, 1, 2].map(|at| mesh.vertices[corners[at] as usize]);
            fill(&mut picture, &atlas, primitive.clip_rect, corners);
        }
    }
    picture
}

/// Coverage of letters, and of all that is plain.
#[derive(Default)]
struct Atlas {
    size: [usize; 2],
    alpha: Vec<f32>,
}

impl Atlas {
    fn take(&mut self, delta: &egui::TexturesDelta) {
        for image in delta.set.values().flatten() {
            let egui::ImageData::Color(pixels) = &image.image;
            let [width, height] = pixels.size;
            let [left, top] = image.pos.unwrap_or_default();
            if image.pos.is_none() {
                self.size = pixels.size;
                self.alpha = vec![0.0; width * height];
            }
            for y in 0..height {
                for x in 0..width {
                    let alpha = f32::from(pixels.pixels[y * width + x].a()) / 255.0;
                    self.alpha[(top + y) * self.size[0] + left + x] = alpha;
                }
            }
        }
    }

    fn at(&self, [u, v]: [f32; 2]) -> f32 {
        let [width, height] = self.size;
        let index = |part: f32, count: usize| ((part * count as f32) as usize).min(count - 1);
        self.alpha[index(v, height) * width + index(u, width)]
    }
}

/// Blends a triangle over the picture.
fn fill(picture: &mut Picture, atlas: &Atlas, clip: Rect, corners: [Vertex; 3]) {
    let [a, b, c] = corners.map(|corner| corner.pos);
    let cross = |o: egui::Pos2, p: egui::Pos2, q: egui::Pos2| {
        (p.x - o.x) * (q.y - o.y) - (p.y - o.y) * (q.x - o.x)
    };
    let area = cross(a, b, c);
    if area == 0.0 {
        return;
    }
    for y in 0..SIDE {
        for x in 0..SIDE {
            let at = pos2(x as f32 + 0.5, y as f32 + 0.5);
            let shares = [cross(b, c, at) / area, cross(c, a, at) / area, cross(a, b, at) / area];
            if !clip.contains(at) || shares.iter().any(|&share| share < 0.0) {
                continue;
            }
            let mixed = |of: &dyn Fn(&Vertex) -> f32| -> f32 {
                corners.iter().zip(shares).map(|(corner, share)| of(corner) * share).sum()
            };
            let cover = atlas.at([mixed(&|v| v.uv.x), mixed(&|v| v.uv.y)]);
            // Multiplied by their alpha already.
            let luma = mixed(&|v| {
                let [r, g, b, _] = v.color.to_array().map(f32::from);
                0.2126 * r + 0.7152 * g + 0.0722 * b
            });
            let alpha = mixed(&|v| f32::from(v.color.a()) / 255.0);
            let pixel = &mut picture[y * SIDE + x];
            *pixel = luma * cover + *pixel * (1.0 - alpha * cover);
        }
    }
}

#[track_caller]
fn assert_all_differ<T: std::fmt::Debug>(marks: &[T], paint: impl Fn(&Painter, Rect, &T)) {
    for is_dark in [false, true] {
        let pictures: Vec<Picture> = marks
            .iter()
            .map(|mark| picture(is_dark, |painter, rect| paint(painter, rect, mark)))
            .collect();
        for (index, a) in pictures.iter().enumerate() {
            for (other, b) in pictures.iter().enumerate().skip(index + 1) {
                let differs = |(a, b): &(&f32, &f32)| (*a - *b).abs() > VISIBLE;
                let count = a.iter().zip(b).filter(differs).count();
                let pair = [&marks[index], &marks[other]];
                assert!(count >= MIN_PIXELS, "{pair:?}, dark {is_dark}: {count} pixels");
            }
        }
    }
}

#[test]
fn alarm_marks_are_distinguishable() {
    let states = [(true, true), (true, false), (false, true), (false, false)];
    let symbols: Vec<AlarmSymbol> = Priority::ALL
        .into_iter()
        .flat_map(|priority| {
            states.map(|(is_active, has_ring)| AlarmSymbol { priority, is_active, has_ring })
        })
        .collect();
    assert_all_differ(&symbols, |painter, rect, symbol| {
        alarm_symbol::paint(painter, rect.center(), 11.0, *symbol);
    });
}

#[test]
fn switch_symbols_are_distinguishable() {
    assert_all_differ(&SwitchState::ALL, |painter, rect, state| {
        switch_symbols::shape(painter, rect.center(), *state);
    });
}

#[test]
fn arrows_of_the_legend_are_distinguishable() {
    assert_all_differ(&FlowArrowKind::ALL, |painter, rect, key| {
        layers::arrow(painter, rect.shrink2(Vec2::new(11.0, 17.0)), *key);
    });
}

#[test]
fn values_of_every_quality_and_severity_are_distinguishable() {
    let reason = String::new;
    let marks = [
        ValueMark::Normal,
        ValueMark::Warning,
        ValueMark::Alarm,
        ValueMark::Uncertain { reason: reason() },
        ValueMark::Bad { reason: reason() },
        ValueMark::LateDisplay,
    ];
    assert_all_differ(&marks, |painter, rect, mark| {
        quality_hatching::fill(painter, rect.shrink2(Vec2::new(4.0, 15.0)), mark);
        let (_, ink) = theme::background_and_text(painter.ctx(), mark);
        let symbol = theme::symbol(mark);
        painter.text(rect.center(), egui::Align2::CENTER_CENTER, symbol, theme::value_font(), ink);
    });
}

#[test]
fn legend_patterns_of_one_colour_are_distinguishable() {
    let patterns = [Pattern::Solid, Pattern::Striped, Pattern::Crossed, Pattern::Dotted];
    assert_all_differ(&patterns, |painter, rect, pattern| {
        let row = LegendRow { name: String::new(), color: [74, 78, 84], pattern: *pattern };
        layers::paint_swatch(painter, rect.shrink2(Vec2::new(11.0, 17.0)), &row);
    });
}

#[test]
fn origins_are_distinguishable_from_each_other_and_from_live_values() {
    let all = origin_mark::ORIGINS.map(|words| words.origin);
    let marks: Vec<Origin> = [Origin::LIVE].into_iter().chain(all).collect();
    assert_all_differ(&marks, |painter, rect, origin| {
        origin_mark::paint(painter, rect.center(), egui::Align2::CENTER_CENTER, *origin);
    });
}

#[test]
fn bands_of_every_origin_are_distinguishable() {
    let all = origin_mark::ORIGINS.into_iter().filter(|words| words.band.is_some());
    let bands: Vec<Origin> = [Origin::LIVE].into_iter().chain(all.map(|w| w.origin)).collect();
    assert_all_differ(&bands, |painter, rect, origin| {
        let context = painter.ctx();
        if let Some(place) = origin_band::place(context, rect, *origin) {
            origin_band::paint(context, place, *origin);
        }
    });
}
