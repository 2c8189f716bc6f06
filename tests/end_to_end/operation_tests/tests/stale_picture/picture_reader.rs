//! Reads a picture as an operator does: by hatching and colour.

use std::collections::BTreeMap;

use busbar_viewer::{Picture, Viewer};

use crate::script::SHOWN;

/// The cell that a gauge's label lies in: so far to the left, right, up and down of the
/// gauge's middle, pixels.
const CELL: [usize; 4] = [130, 290, 90, 90];
/// Levels by which pixels of the same look may differ.
const ALIKE_LEVELS: u8 = 8;
/// Share of a shape's pixels that decides.
const MOST: f64 = 0.9;
/// Difference between the strongest and the weakest channel above which a pixel has a color.
const COLORED: u8 = 60;
const COLORED_SHARE: f64 = 0.2;
/// Levels of grey of the stripes of a hatched body.
const BODY_DARK: u8 = 160;
const BODY_LIGHT: u8 = 200;
/// Share of the body's pixels that each kind of stripe has at least.
const BODY_SHARE: f64 = 0.1;
/// Pixels of a stripe, diagonally.
const STRIPE: usize = 4;
/// Stripes that make a hatched ground.
const MIN_STRIPES: usize = 2;

/// Knows where everything is.
pub(crate) struct PictureReader {
    size: [usize; 2],
    /// Pixels of each piece of equipment, by id.
    shapes: BTreeMap<String, Vec<usize>>,
}

impl PictureReader {
    /// For pictures of this size.
    pub(crate) fn new(viewer: &mut Viewer, size: [u32; 2]) -> Self {
        let pixels: Vec<_> = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| [x, y])).collect();
        let ids = viewer.pick_many(&pixels).expect("ids are drawn");
        let mut shapes: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (at, id) in ids.into_iter().enumerate() {
            if let Some(id) = id {
                let equipment = id.split('/').next().unwrap_or_default().to_owned();
                shapes.entry(equipment).or_default().push(at);
            }
        }
        Self { size: size.map(|side| side as usize), shapes }
    }

    /// Reads a piece of equipment from a picture. A lamp is compared with its known pictures off
    /// and on; a gauge is read by its label.
    pub(crate) fn see(
        &self,
        picture: &Picture,
        looks: &[Picture; 2],
        equipment: &str,
        is_lamp: bool,
    ) -> ShownState {
        if is_lamp {
            let known = looks.iter().position(|look| self.looks_as(picture, look, equipment));
            return known.map_or(ShownState::NotGood, |look| ShownState::Good(SHOWN[look]));
        }
        // Its label may stand elsewhere, where many have one: then the body itself tells.
        let is_hatched =
            self.is_hatched(picture, equipment) || self.is_striped_body(picture, equipment);
        match (is_hatched, self.is_colored(picture, equipment)) {
            (true, false) => ShownState::NotGood,
            (false, colored) => ShownState::Good(colored),
            (true, true) => ShownState::Unclear,
        }
    }

    fn shape(&self, equipment: &str) -> &[usize] {
        self.shapes.get(equipment).unwrap_or_else(|| panic!("{equipment} is not seen"))
    }

    /// Reports whether a piece of equipment looks alike in two pictures.
    pub(crate) fn looks_as(&self, picture: &Picture, other: &Picture, equipment: &str) -> bool {
        let shape = self.shape(equipment);
        let alike = |&&at: &&usize| {
            let channels = rgb(picture, at).into_iter().zip(rgb(other, at));
            channels.into_iter().all(|(now, then)| now.abs_diff(then) <= ALIKE_LEVELS)
        };
        shape.iter().filter(alike).count() as f64 >= MOST * shape.len() as f64
    }

    /// Reports whether the body itself is hatched: dark and light stripes without a color.
    fn is_striped_body(&self, picture: &Picture, equipment: &str) -> bool {
        let shape = self.shape(equipment);
        let share = |is_it: fn(u8) -> bool| {
            let greys = shape.iter().map(|&at| rgb(picture, at)[1]);
            greys.filter(|grey| is_it(*grey)).count() as f64 / shape.len() as f64
        };
        share(|grey| grey < BODY_DARK) > BODY_SHARE && share(|grey| grey > BODY_LIGHT) > BODY_SHARE
    }

    /// Reports whether the equipment has a color, such as that of an alarm.
    fn is_colored(&self, picture: &Picture, equipment: &str) -> bool {
        let shape = self.shape(equipment);
        let colored = |&&at: &&usize| {
            let [r, g, b] = rgb(picture, at);
            r.max(g).max(b) - r.min(g).min(b) > COLORED
        };
        shape.iter().filter(colored).count() as f64 > COLORED_SHARE * shape.len() as f64
    }

    /// Reports whether anything in the cell around a piece of equipment is hatched: stripes at 45
    /// degrees, darker than their neighborhood.
    fn is_hatched(&self, picture: &Picture, equipment: &str) -> bool {
        let shape = self.shape(equipment);
        let count = shape.len();
        let [width, height] = self.size;
        let middle = |of: fn(usize, usize) -> usize| {
            shape.iter().map(|&at| of(at, width)).sum::<usize>() / count
        };
        let [x, y] = [middle(|at, width| at % width), middle(|at, width| at / width)];
        let range = |middle: usize, before: usize, after: usize, end: usize| {
            middle.saturating_sub(before)..(middle + after).min(end)
        };
        let grey = |x: usize, y: usize| rgb(picture, y * width + x)[1];
        // Upwards where a value is not good, downwards where the display is late.
        let is_stripe_by = |x: usize, y: usize, is_up: bool| {
            (0..STRIPE).all(|i| {
                let (x, y) = (x + i, if is_up { y.wrapping_sub(i) } else { y + i });
                let inside = x + 2 < width && x >= 2 && y < height;
                inside && {
                    let dark = grey(x, y);
                    (120..=200).contains(&dark)
                        && grey(x - 2, y) > dark.saturating_add(20)
                        && grey(x + 2, y) > dark.saturating_add(20)
                }
            })
        };
        let is_stripe = |x, y| is_stripe_by(x, y, true) || is_stripe_by(x, y, false);
        let [left, right, up, down] = CELL;
        let rows = range(y, up, down, height);
        rows.flat_map(|y| range(x, left, right, width).map(move |x| (x, y)))
            .filter(|&(x, y)| is_stripe(x, y))
            .take(MIN_STRIPES)
            .count()
            == MIN_STRIPES
    }
}

/// State of a tag as it is read from a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ShownState {
    Good(bool),
    NotGood,
    /// Neither clearly good nor clearly not good.
    Unclear,
}

fn rgb(picture: &Picture, at: usize) -> [u8; 3] {
    [0, 1, 2].map(|channel| picture.rgba8[at * 4 + channel])
}
