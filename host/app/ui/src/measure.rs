//! Distances between points of surfaces, drawn over the scene.

use egui::{Color32, Painter, Pos2, Rect, Stroke, StrokeKind, Ui, Vec2, vec2};

use crate::theme;

const POINT_RADIUS: f32 = 3.5;
const PADDING: Vec2 = vec2(5.0, 2.0);
/// Distance of the text from the middle of its line, points.
const ASIDE: f32 = 12.0;

/// Points that are measured between, in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measurement {
    /// Measured points in their order.
    pub points: Vec<MeasuredPoint>,
}

/// A point of a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MeasuredPoint {
    /// Screen position, points; none behind the camera.
    pub at: Option<Pos2>,
    /// World space, metres; y is up.
    pub world: [f64; 3],
}

impl Measurement {
    /// The length of the last piece, and of all, metres.
    pub fn lengths(&self) -> Option<(f64, f64)> {
        let pieces = self.points.windows(2).filter_map(|pair| match pair {
            [a, b] => Some(length(difference(a, b))),
            _ => None,
        });
        let pieces: Vec<f64> = pieces.collect();
        Some((*pieces.last()?, pieces.iter().sum()))
    }
}

fn difference(a: &MeasuredPoint, b: &MeasuredPoint) -> [f64; 3] {
    std::array::from_fn(|axis| b.world[axis] - a.world[axis])
}

fn length([x, y, z]: [f64; 3]) -> f64 {
    (x * x + y * y + z * z).sqrt()
}

/// Paints lines, points and lengths.
pub(crate) fn paint(ui: &Ui, measurement: &Measurement) {
    let scene = ui.max_rect();
    let painter = ui.painter().with_clip_rect(scene);
    let mut taken: Vec<Rect> = Vec::new();
    for pair in measurement.points.windows(2) {
        let [from, to] = pair else { continue };
        if let (Some(a), Some(b)) = (from.at, to.at) {
            // Light under dark: it shows on any ground.
            painter.line_segment([a, b], Stroke::new(4.0, theme::palette(ui.ctx()).background));
            painter.line_segment([a, b], Stroke::new(1.5, theme::palette(ui.ctx()).text));
        }
    }
    for at in measurement.points.iter().filter_map(|point| point.at) {
        painter.circle(
            at,
            POINT_RADIUS,
            theme::palette(ui.ctx()).background,
            Stroke::new(1.5, theme::palette(ui.ctx()).text),
        );
    }
    for pair in measurement.points.windows(2) {
        let [from, to] = pair else { continue };
        if let (Some(a), Some(b)) = (from.at, to.at) {
            caption(&painter, scene, [a, b], difference(from, to), &mut taken);
        }
    }
}

/// The length of a piece with its components, beside its middle.
fn caption(
    painter: &Painter,
    scene: Rect,
    [a, b]: [Pos2; 2],
    difference: [f64; 3],
    taken: &mut Vec<Rect>,
) {
    let layout = |text, font, ink: Color32| painter.layout_no_wrap(text, font, ink);
    let whole =
        layout(metres(length(difference)), theme::value_font(), theme::palette(painter.ctx()).text);
    let [x, y, z] = difference.map(signed_metres);
    let parts = format!("dx {x}   dy {y} (height)   dz {z}");
    let parts = layout(parts, theme::small_font(), theme::palette(painter.ctx()).weak_text);
    let size = vec2(whole.size().x.max(parts.size().x), whole.size().y + parts.size().y);
    let size = size + PADDING * 2.0;
    let across = (b - a).normalized().rot90();
    let middle = a + (b - a) * 0.5;
    let reach = ASIDE + size.y * 0.5 + across.x.abs() * size.x * 0.5;
    // Above if it can be, then farther away, so that captions do not cover each other.
    let sides = [-across.y.signum(), across.y.signum()];
    let places = (0..4).flat_map(|ring| {
        let reach = reach + ring as f32 * (size.y + 4.0);
        sides.map(|side| Rect::from_center_size(middle + across * reach * side, size))
    });
    let mut places = places;
    let first = Rect::from_center_size(middle + across * reach * sides[0], size);
    let is_free = |place: &Rect| {
        scene.contains_rect(*place) && taken.iter().all(|other| !other.intersects(*place))
    };
    let place = places.find(is_free).unwrap_or(first);
    taken.push(place);
    painter.rect(
        place,
        2.0,
        theme::palette(painter.ctx()).background,
        Stroke::new(1.0, theme::palette(painter.ctx()).border),
        StrokeKind::Inside,
    );
    painter.galley(place.min + PADDING, whole.clone(), theme::palette(painter.ctx()).text);
    painter.galley(
        place.min + PADDING + vec2(0.0, whole.size().y),
        parts,
        theme::palette(painter.ctx()).weak_text,
    );
}

/// Formats a length to the millimetre.
fn metres(length: f64) -> String {
    format!("{length:.3} m")
}

fn signed_metres(length: f64) -> String {
    // No minus before nothing.
    let length = if length.abs() < 5e-4 { 0.0 } else { length };
    format!("{length:+.3}").replace('-', "\u{2212}").replace("+0.000", "0.000")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurements_show_the_last_and_the_total_length() {
        let point = |world: [f64; 3]| MeasuredPoint { at: None, world };
        let mut measurement = Measurement::default();
        assert_eq!(measurement.lengths(), None);
        measurement.points = vec![point([0.0; 3]), point([3.0, 4.0, 0.0]), point([3.0, 4.0, 2.0])];
        assert_eq!(measurement.lengths(), Some((2.0, 7.0)));
    }

    #[test]
    fn nonzero_millimetres_have_a_sign_and_zero_has_none() {
        let texts = [0.0004, -1.5, 12.3456].map(signed_metres);
        assert_eq!(texts, ["0.000", "\u{2212}1.500", "+12.346"]);
        assert_eq!(metres(2.0), "2.000 m");
    }
}
