//! The course of a quantity over the ground, from levels at equipment: the mean of those
//! within reach, each weighted by one over its squared distance (Shepard 1968).
//!
//! A position whose nearest level is not good has no data, whatever is known farther away. A
//! position without any level within reach shows nothing. Only values outside the normal band are
//! colored.

use busbar_overlay_picture::Contour;
use busbar_renderer::{WorldFace, WorldStroke};
use busbar_ui::ContourRow;
use glam::{Vec2, Vec3, vec2, vec3};

/// Cells along the longer side.
const MAX_CELLS: usize = 96;
/// The smallest cell, metres.
const MIN_CELL: f32 = 0.5;
/// Cells that a reach is divided into at least, as far as there may be so many.
const CELLS_A_REACH: f32 = 8.0;
/// Within so many metres a level counts fully.
const CORE: f32 = 1.0;
/// Lines and colours beyond a limit; what lies farther beyond looks like the last.
const MAX_BANDS: i32 = 6;
/// Height over the ground, metres: above what lies flat on it.
const HEIGHT: f32 = 0.15;
/// sRGB: within the band, and beyond it from the first step to the last.
const NORMAL: [u8; 3] = [236, 238, 240];
const FIRST: [u8; 3] = [244, 186, 66];
const LAST: [u8; 3] = [158, 20, 34];
const LINE: [u8; 3] = [46, 48, 54];

/// A level at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeasuredLevel {
    /// Position seen from above: x and z, metres.
    pub(crate) place: Vec2,
    /// Measured value; none if it is not good.
    pub(crate) value: Option<f64>,
}

/// Interpolated value at a position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum FieldValue {
    /// No level is within reach.
    OutOfReach,
    /// The nearest measured value is not good.
    NoData,
    /// Interpolated value in the contour's unit.
    Value(f64),
}

/// Interpolates the levels at a position by inverse distance weighting (Shepard 1968).
pub(crate) fn interpolate(place: Vec2, levels: &[MeasuredLevel], reach: f32) -> FieldValue {
    let mut nearest: Option<(f32, bool)> = None;
    let (mut sum, mut weights) = (0.0, 0.0);
    for level in levels {
        let distance = level.place.distance(place);
        if distance > reach {
            continue;
        }
        if nearest.is_none_or(|(least, _)| distance < least) {
            nearest = Some((distance, level.value.is_some()));
        }
        if let Some(value) = level.value {
            let weight = 1.0 / f64::from(distance.max(CORE)).powi(2);
            (sum, weights) = (sum + weight * value, weights + weight);
        }
    }
    match nearest {
        None => FieldValue::OutOfReach,
        Some((_, false)) => FieldValue::NoData,
        Some((_, true)) => FieldValue::Value(sum / weights),
    }
}

/// Returns the number of steps outside the normal band: 0 within it, 1 just above, -1 just below.
fn band_of(contour: &Contour, value: f64) -> i32 {
    let steps = |beyond: f64| ((beyond / contour.step).floor() as i32).min(MAX_BANDS - 1) + 1;
    match (contour.low, contour.high) {
        (_, Some(high)) if value > high => steps(value - high),
        (Some(low), _) if value < low => -steps(low - value),
        _ => 0,
    }
}

/// Colour and cover of a band.
fn band_style(band: i32) -> ([u8; 3], f32) {
    if band == 0 {
        return (NORMAL, 0.22);
    }
    let share = (band.unsigned_abs() - 1) as f32 / (MAX_BANDS - 1) as f32;
    let mixed = |i: usize| f32::from(FIRST[i]) * (1.0 - share) + f32::from(LAST[i]) * share;
    ([0, 1, 2].map(|i| mixed(i) as u8), 0.75)
}

/// Returns the legend of a contour.
pub(crate) fn legend(contour: &Contour) -> ContourRow {
    let Contour { name, unit, reach_metres, low, high, step } = contour;
    let with_unit = |number: f64| format!("{number} {unit}").trim_end().to_owned();
    let normal = match (low, high) {
        (Some(low), Some(high)) => format!("{low} to {}: normal", with_unit(*high)),
        (Some(low), None) => format!("{} and more: normal", with_unit(*low)),
        (None, Some(high)) => format!("up to {}: normal", with_unit(*high)),
        (None, None) => "normal".to_owned(),
    };
    ContourRow {
        name: name.clone(),
        normal,
        step: format!("beyond, a line each {}", with_unit(*step)),
        reach: format!("values count within {reach_metres} m"),
        colors: [FIRST, LAST],
    }
}

/// Cells over all that is within reach of the levels.
struct Grid {
    origin: Vec2,
    cell: f32,
    size: [usize; 2],
    /// Values of the cells, row by row.
    values: Vec<FieldValue>,
}

impl Grid {
    fn over(levels: &[MeasuredLevel], reach: f32) -> Option<Self> {
        let places = levels.iter().map(|level| level.place).filter(|place| place.is_finite());
        let bounds = places.map(|place| [place, place]);
        let [least, most] = bounds.reduce(|[a, b], [c, d]| [a.min(c), b.max(d)])?;
        let (least, most) = (least - reach, most + reach);
        let longest = (most - least).max_element();
        let cell = (reach / CELLS_A_REACH).max(MIN_CELL).max(longest / MAX_CELLS as f32);
        let size = (most - least).to_array().map(|side| ((side / cell).ceil() as usize).max(1));
        let mut grid = Self { origin: least, cell, size, values: Vec::new() };
        grid.values = (0..size[0] * size[1])
            .map(|at| interpolate(grid.middle(at % size[0], at / size[0]), levels, reach))
            .collect();
        Some(grid)
    }

    fn middle(&self, x: usize, y: usize) -> Vec2 {
        self.origin + vec2(x as f32 + 0.5, y as f32 + 0.5) * self.cell
    }

    fn corner(&self, x: usize, y: usize) -> Vec3 {
        let place = self.origin + vec2(x as f32, y as f32) * self.cell;
        vec3(place.x, HEIGHT, place.y)
    }

    fn value_at(&self, x: usize, y: usize) -> FieldValue {
        self.values[y * self.size[0] + x]
    }
}

/// Draws the course of a quantity on the ground.
pub(crate) fn draw(
    contour: &Contour,
    levels: &[MeasuredLevel],
    faces: &mut Vec<WorldFace>,
    strokes: &mut Vec<WorldStroke>,
) {
    let Some(grid) = Grid::over(levels, contour.reach_metres as f32) else { return };
    let band = |x: usize, y: usize| match grid.value_at(x, y) {
        FieldValue::Value(value) => Some(band_of(contour, value)),
        FieldValue::NoData | FieldValue::OutOfReach => None,
    };
    let [width, height] = grid.size;
    for y in 0..height {
        // Cells of one look in a row are one face.
        let mut x = 0;
        while x < width {
            let from = x;
            let own = band(x, y);
            while x < width && band(x, y) == own {
                x += 1;
            }
            if let Some(own) = own {
                let (color, cover) = band_style(own);
                let corners = [
                    grid.corner(from, y),
                    grid.corner(x, y),
                    grid.corner(x, y + 1),
                    grid.corner(from, y + 1),
                ];
                faces.push(WorldFace { corners, color, cover });
            }
        }
        for x in 0..width {
            hatch(&grid, x, y, strokes);
            borders(&grid, band, x, y, strokes);
        }
    }
}

/// Slanted lines through cells without data.
fn hatch(grid: &Grid, x: usize, y: usize, strokes: &mut Vec<WorldStroke>) {
    if grid.value_at(x, y) == FieldValue::NoData && (x + grid.size[1] - y).is_multiple_of(2) {
        strokes.push(line(grid.corner(x, y), grid.corner(x + 1, y + 1), 1.6));
    }
}

/// Lines between cells of different bands: the greyscale picture has them too.
fn borders(
    grid: &Grid,
    band: impl Fn(usize, usize) -> Option<i32>,
    x: usize,
    y: usize,
    strokes: &mut Vec<WorldStroke>,
) {
    let Some(own) = band(x, y) else { return };
    let mut border = |other: Option<i32>, from: Vec3, to: Vec3| {
        if other.is_some_and(|other| other != own) {
            strokes.push(line(from, to, 1.2));
        }
    };
    if x + 1 < grid.size[0] {
        border(band(x + 1, y), grid.corner(x + 1, y), grid.corner(x + 1, y + 1));
    }
    if y + 1 < grid.size[1] {
        border(band(x, y + 1), grid.corner(x, y + 1), grid.corner(x + 1, y + 1));
    }
}

fn line(from: Vec3, to: Vec3, width: f32) -> WorldStroke {
    WorldStroke { from, to, width, color: LINE, cover: 0.8, pattern: 0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(x: f32, value: Option<f64>) -> MeasuredLevel {
        MeasuredLevel { place: vec2(x, 0.0), value }
    }

    fn contour() -> Contour {
        Contour {
            name: "Contacts".into(),
            unit: "°C".into(),
            reach_metres: 6.0,
            low: Some(-20.0),
            high: Some(70.0),
            step: 10.0,
        }
    }

    #[test]
    fn near_levels_count_more_and_far_ones_not_at_all() {
        let levels = [level(0.0, Some(40.0)), level(6.0, Some(80.0)), level(50.0, Some(500.0))];
        let at = |x: f32| interpolate(vec2(x, 0.0), &levels, 8.0);
        let value = |x: f32| match at(x) {
            FieldValue::Value(value) => value,
            other => panic!("{other:?} at {x}"),
        };
        assert!((value(3.0) - 60.0).abs() < 1e-9);
        // Weights 1/4 and 1/16.
        assert!((value(2.0) - 48.0).abs() < 1e-9);
        assert_eq!(at(-8.5), FieldValue::OutOfReach);
        assert_eq!(value(50.0), 500.0);
    }

    #[test]
    fn no_data_is_shown_where_the_nearest_value_is_bad() {
        let levels = [level(0.0, Some(40.0)), level(6.0, None)];
        let at = |x: f32| interpolate(vec2(x, 0.0), &levels, 8.0);
        assert_eq!(
            (at(2.9), at(3.1), at(14.0)),
            (FieldValue::Value(40.0), FieldValue::NoData, FieldValue::NoData)
        );
        assert_eq!(at(14.1), FieldValue::OutOfReach);
    }

    #[test]
    fn bands_begin_outside_the_limits() {
        let check = |value, band| assert_eq!(band_of(&contour(), value), band, "{value}");
        check(70.0, 0);
        check(70.1, 1);
        check(85.0, 2);
        check(1e9, MAX_BANDS);
        check(-20.0, 0);
        check(-21.0, -1);
    }

    #[test]
    fn chart_lines_are_bounded_and_missing_values_are_shown() {
        let drawn = |levels: &[MeasuredLevel]| {
            let (mut faces, mut strokes) = (Vec::new(), Vec::new());
            draw(&contour(), levels, &mut faces, &mut strokes);
            (faces, strokes)
        };
        assert_eq!(drawn(&[]), (vec![], vec![]));
        let (faces, strokes) = drawn(&[level(0.0, None)]);
        assert!(faces.is_empty() && strokes.len() > 20, "hatched alone");
        let (faces, strokes) = drawn(&[level(0.0, Some(40.0))]);
        assert!(faces.iter().all(|face| face.color == NORMAL) && strokes.is_empty());
        let (faces, strokes) = drawn(&[level(0.0, Some(40.0)), level(5.0, Some(112.0))]);
        assert!(faces.iter().any(|face| face.color != NORMAL) && !strokes.is_empty());
        let far: Vec<MeasuredLevel> =
            (0..100).map(|i| level(1000.0 * i as f32, Some(90.0))).collect();
        assert!(drawn(&far).0.len() <= MAX_CELLS * (MAX_CELLS + 1));
    }
}
