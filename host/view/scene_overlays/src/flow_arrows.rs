//! Flows of power to arrows in the scene: where to, and how much of the rating.
//!
//! An arrow stands above the middle between two pieces of equipment and faces the eye. Arrows are
//! static, since motion would draw attention to normal values. The shape distinguishes states
//! without color. One head means within the rating, two above it, none no flow; a dashed outline
//! means unknown.

use busbar_renderer::{WorldFace, WorldStroke};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_tags::Snapshot;
use glam::Vec3;

use crate::labels::top_of;
use crate::overlay_layers::PowerFlow;

/// Arrows in a frame.
const MAX_ARROWS: usize = 5_000;
/// Height of an arrow above the higher end, metres.
const CLEARANCE: f32 = 1.2;
/// Share of the distance between the equipment that an arrow takes; least and greatest length,
/// metres.
const SHARE_OF_WAY: f32 = 0.6;
const LENGTH: [f32; 2] = [1.8, 3.6];
/// Width of the shaft at no load and at the rating, and at most, metres.
const WIDTH: [f32; 3] = [0.14, 0.7, 0.9];
/// Width of an arrow head relative to its shaft, and its length relative to its width.
const HEAD_WIDTH: f32 = 2.0;
const HEAD_LENGTH: f32 = 0.75;
/// Least relative width of an arrow that is seen from its end.
const LEAST_NARROWED: f32 = 0.3;
/// Share of the rating below which nothing flows that is worth a direction.
const LEAST_SHARE: f64 = 0.005;
/// Color of arrows within the rating, sRGB: dark against sky and equipment.
const NORMAL: [u8; 3] = [112, 118, 126];
/// Color of arrows above the rating, sRGB.
const OVERLOADED: [u8; 3] = [232, 120, 20];
const EDGE: [u8; 3] = [30, 32, 36];
const EDGE_POINTS: f32 = 1.6;
const COVER: f32 = 0.92;
const DASHED: u32 = 1;

/// Shape of an arrow by its load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ArrowShape {
    /// So wide, metres, with so many heads.
    Known { width: f32, heads: u32 },
    /// Arrow of an unknown flow.
    Unknown,
}

impl ArrowShape {
    fn for_load(share: Option<f64>) -> Self {
        let Some(share) = share else { return Self::Unknown };
        let size = share.abs();
        let [least, rated, most] = WIDTH;
        let width = (least + (rated - least) * size as f32).min(most);
        let heads = match () {
            () if size < LEAST_SHARE => 0,
            () if size > 1.0 => 2,
            () => 1,
        };
        Self::Known { width, heads }
    }
}

/// An arrow in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Arrow {
    middle: Vec3,
    /// Direction of the arrow, a unit vector.
    along: Vec3,
    length: f32,
    shape: ArrowShape,
}

/// Draws the flows as seen by an eye.
pub(crate) fn draw(
    flows: &[PowerFlow],
    graph: &SceneGraph,
    snapshot: Snapshot<'_>,
    eye: Vec3,
    faces: &mut Vec<WorldFace>,
    strokes: &mut Vec<WorldStroke>,
) {
    let mut arrows: Vec<Arrow> = flows
        .iter()
        .take(MAX_ARROWS)
        .filter_map(|flow| {
            let is_good = snapshot.state(flow.tag).is_some_and(|state| state.quality.is_good());
            arrow(graph, [flow.from, flow.to], Some(flow.share).filter(|_| is_good))
        })
        .collect();
    // What lies behind comes first.
    arrows
        .sort_by(|a, b| b.middle.distance_squared(eye).total_cmp(&a.middle.distance_squared(eye)));
    arrows.iter().for_each(|arrow| arrow.draw(eye, faces, strokes));
}

/// Largest difference of two arrows' widths that nobody sees, pixels.
const UNSEEN_PIXELS: f32 = 0.25;

/// Reports whether two flows have arrows between which nobody sees a difference. `pixel_at` gives
/// the size of a pixel at a distance from the eye, both in metres.
pub(crate) fn look_alike(
    [before, now]: [&PowerFlow; 2],
    is_good: bool,
    graph: &SceneGraph,
    (eye, pixel_at): (Vec3, &dyn Fn(f32) -> f32),
) -> bool {
    if before == now {
        return true;
    }
    let arrow_of =
        |flow: &PowerFlow| arrow(graph, [flow.from, flow.to], Some(flow.share).filter(|_| is_good));
    let (Some(before), Some(now)) = (arrow_of(before), arrow_of(now)) else { return false };
    let is_same_shape = match (before.shape, now.shape) {
        (ArrowShape::Unknown, ArrowShape::Unknown) => true,
        (ArrowShape::Known { width: before, heads: had }, ArrowShape::Known { width, heads }) => {
            let nearest = (now.middle.distance(eye) - now.length / 2.0).max(0.0);
            had == heads && (width - before).abs() <= UNSEEN_PIXELS * pixel_at(nearest)
        }
        _ => false,
    };
    is_same_shape && Arrow { shape: now.shape, ..before } == now
}

fn arrow(graph: &SceneGraph, ends: [NodeIndex; 2], share: Option<f64>) -> Option<Arrow> {
    let [from, to] = ends.map(|node| top_of(graph.node(node)));
    let height = from.y.max(to.y) + CLEARANCE;
    let [from, to] = [from, to].map(|end| end.with_y(height));
    let way = to - from;
    let along = way.try_normalize()?;
    let forward = share.is_none_or(|share| share >= 0.0);
    Some(Arrow {
        middle: (from + to) / 2.0,
        along: if forward { along } else { -along },
        length: (way.length() * SHARE_OF_WAY).clamp(LENGTH[0], LENGTH[1]),
        shape: ArrowShape::for_load(share),
    })
}

impl Arrow {
    fn draw(self, eye: Vec3, faces: &mut Vec<WorldFace>, strokes: &mut Vec<WorldStroke>) {
        let Self { middle, along, length, shape } = self;
        let aside = along.cross((eye - middle).normalize_or(Vec3::Y));
        // Seen from its end an arrow is short: as narrow then, so that it keeps its shape.
        let across = aside.normalize_or(Vec3::Y) * aside.length().max(LEAST_NARROWED);
        let (width, heads, color, pattern) = match shape {
            ArrowShape::Known { width, heads: 2 } => (width, 2, OVERLOADED, 0),
            ArrowShape::Known { width, heads } => (width, heads, NORMAL, 0),
            ArrowShape::Unknown => (WIDTH[1] / 2.0, 0, NORMAL, DASHED),
        };
        let at = |along_by: f32, across_by: f32| middle + along * along_by + across * across_by;
        let head_half = 0.5 * width * HEAD_WIDTH;
        let head = (2.0 * head_half * HEAD_LENGTH).min(length / 3.0);
        let shaft_end = 0.5 * length - head * heads as f32;
        let half = 0.5 * width;
        let mut outline = |corners: &[Vec3], is_filled: bool| {
            if is_filled {
                let [a, b, c] = [corners[0], corners[1], corners[2]];
                let d = corners.get(3).copied().unwrap_or(c);
                faces.push(WorldFace { corners: [a, b, c, d], color, cover: COVER });
            }
            for (index, &from) in corners.iter().enumerate() {
                let to = corners[(index + 1) % corners.len()];
                let (width, color, cover) = (EDGE_POINTS, EDGE, 1.0);
                strokes.push(WorldStroke { from, to, width, color, cover, pattern });
            }
        };
        let start = -0.5 * length;
        let shaft = [at(start, -half), at(shaft_end, -half), at(shaft_end, half), at(start, half)];
        outline(&shaft, pattern == 0);
        for number in 0..heads {
            let base = shaft_end + head * number as f32;
            let head = [at(base, -head_half), at(base + head, 0.0), at(base, head_half)];
            outline(&head, true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(share: Option<f64>) -> (Vec<WorldFace>, Vec<WorldStroke>) {
        let (mut faces, mut strokes) = (Vec::new(), Vec::new());
        let along = if share.is_none_or(|share| share >= 0.0) { Vec3::X } else { -Vec3::X };
        let arrow =
            Arrow { middle: Vec3::Y * 9.0, along, length: 5.0, shape: ArrowShape::for_load(share) };
        arrow.draw(Vec3::new(0.0, 9.0, 30.0), &mut faces, &mut strokes);
        (faces, strokes)
    }

    /// Returns the x coordinate of the tip.
    fn tip(faces: &[WorldFace]) -> f32 {
        let head = faces.last().unwrap().corners;
        head[1].x
    }

    #[test]
    fn the_sign_reverses_an_arrow_and_the_load_widens_it() {
        let (there, _) = drawn(Some(0.4));
        let (back, _) = drawn(Some(-0.4));
        assert!((tip(&there) - 2.5).abs() < 1e-5 && (tip(&back) + 2.5).abs() < 1e-5);
        let width = |share| {
            let shaft = drawn(Some(share)).0[0].corners;
            shaft[0].distance(shaft[3])
        };
        assert!(width(0.1) < width(0.5) && width(0.5) < width(1.0));
        assert!((width(3.0) - WIDTH[2]).abs() < 1e-4, "within bounds");
    }

    #[test]
    fn shapes_distinguish_states_without_colour() {
        let parts = |share| {
            let (faces, strokes) = drawn(share);
            (faces.len(), strokes.len(), strokes[0].pattern)
        };
        let all = [Some(0.4), Some(1.2), Some(0.001), None].map(parts);
        assert_eq!(all, [(2, 7, 0), (3, 10, 0), (1, 4, 0), (0, 4, DASHED)]);
        let color = |share| drawn(Some(share)).0[0].color;
        assert_eq!((color(1.0), color(-1.01)), (NORMAL, OVERLOADED));
    }
}
