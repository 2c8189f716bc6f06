//! Label placement: boxes beside their anchors, without overlap, stable between frames.
//!
//! A box has a slot: a direction and a ring around its anchor. A free slot is kept from frame to
//! frame, so that boxes follow their equipment when the camera moves. A more urgent label displaces
//! a less urgent one only if no other slot is free.

use std::collections::HashMap;

use egui::{Pos2, Rect, Vec2, vec2};

/// Distance of a box from its anchor, points.
const STAND_OFF: f32 = 34.0;
/// Radians from straight up, in the order of preference.
const DIRECTIONS: [f32; 10] = [0.0, 0.6, -0.6, 1.1, -1.1, 1.57, -1.57, 2.3, -2.3, 3.0];
/// Slots tried for one box; one that finds none shrinks to a dot.
const MAX_TRIES: usize = 4 * DIRECTIONS.len();
/// Points between boxes, and what a box must have around it to come back to a nearer ring:
/// it does not where the next frame would drive it away again.
const GAP: f32 = 3.0;
const RETURN_GAP: f32 = 60.0;

/// A box that wants a place.
#[derive(Clone, Copy, Debug)]
pub(super) struct LabelRequest<'a> {
    /// The same in each frame.
    pub(super) key: &'a str,
    pub(super) size: Vec2,
    /// Screen position of the equipment, points.
    pub(super) anchor: Pos2,
}

/// The slots of the last frame's boxes.
#[derive(Debug, Default)]
pub(crate) struct LabelPlacement {
    slots: HashMap<String, usize>,
}

impl LabelPlacement {
    /// Places boxes in order of priority beside occupied places; a box without room gets none.
    pub(super) fn place(
        &mut self,
        wanted: &[LabelRequest<'_>],
        within: Rect,
        occupied: &[Rect],
    ) -> Vec<Option<Rect>> {
        let last: Vec<Option<(usize, Rect)>> = wanted
            .iter()
            .map(|wanted| {
                let slot = *self.slots.get(wanted.key)?;
                Some((slot, place_at(wanted, slot)))
            })
            .collect();
        let mut taken: Vec<Rect> = occupied.to_vec();
        let mut slots = HashMap::new();
        let mut places = Vec::with_capacity(wanted.len());
        for (index, wanted) in wanted.iter().enumerate() {
            let later: Vec<Rect> = last[index + 1..].iter().flatten().map(|(_, r)| *r).collect();
            let chosen = choose(wanted, last[index], within, &taken, &later);
            if let Some((slot, place)) = chosen {
                slots.insert(wanted.key.to_owned(), slot);
                taken.push(place);
            }
            places.push(chosen.map(|(_, place)| place));
        }
        self.slots = slots;
        places
    }
}

/// The slot of a box, given those that are taken and those that less urgent boxes had.
fn choose(
    wanted: &LabelRequest<'_>,
    last: Option<(usize, Rect)>,
    within: Rect,
    taken: &[Rect],
    later: &[Rect],
) -> Option<(usize, Rect)> {
    let fits =
        |place: &Rect| within.contains_rect(*place) && !place.expand(GAP).contains(wanted.anchor);
    let is_apart = |place: &Rect, from: &[Rect], gap: f32| {
        let place = place.expand(gap);
        !from.iter().any(|other| other.intersects(place))
    };
    let slots = |range: std::ops::Range<usize>| {
        range.map(|slot| (slot, place_at(wanted, slot))).filter(|(_, place)| fits(place))
    };
    if let Some((slot, place)) = last.filter(|(_, p)| fits(p) && is_apart(p, taken, GAP)) {
        let nearer = 0..slot / DIRECTIONS.len() * DIRECTIONS.len();
        let has_room = |(_, place): &(usize, Rect)| {
            is_apart(place, taken, RETURN_GAP) && is_apart(place, later, RETURN_GAP)
        };
        return slots(nearer).find(has_room).or(Some((slot, place)));
    }
    let free = || slots(0..MAX_TRIES).filter(|(_, place)| is_apart(place, taken, GAP));
    free().find(|(_, place)| is_apart(place, later, GAP)).or_else(|| free().next())
}

/// Above first, then to the sides and below, on widening rings.
fn place_at(wanted: &LabelRequest<'_>, slot: usize) -> Rect {
    let LabelRequest { size, anchor, .. } = *wanted;
    let ring = (slot / DIRECTIONS.len() + 1) as f32;
    let side = DIRECTIONS[slot % DIRECTIONS.len()];
    let direction = vec2(f32::sin(side), -f32::cos(side));
    let reach = STAND_OFF * ring + size.y * 0.5 + direction.x.abs() * size.x * 0.5;
    Rect::from_center_size(anchor + direction * reach, size)
}

#[cfg(test)]
mod tests {
    use egui::pos2;

    use super::*;

    fn screen() -> Rect {
        Rect::from_min_size(Pos2::ZERO, vec2(1280.0, 720.0))
    }

    #[test]
    fn label_boxes_do_not_overlap_and_stay_inside_the_screen() {
        let keys = ["a", "b", "c", "d", "e", "f"];
        let size = vec2(120.0, 60.0);
        let wanted = keys.map(|key| LabelRequest { key, size, anchor: pos2(400.0, 300.0) });
        let places = LabelPlacement::default().place(&wanted, screen(), &[]);
        for (index, place) in places.iter().enumerate() {
            let place = place.unwrap();
            assert!(screen().contains_rect(place));
            assert!(places[..index].iter().flatten().all(|other| !other.intersects(place)));
        }
    }

    #[test]
    fn occupied_areas_get_no_labels() {
        let wanted =
            [LabelRequest { key: "a", size: vec2(80.0, 40.0), anchor: pos2(400.0, 300.0) }];
        let above = Rect::from_min_max(pos2(385.0, 255.0), pos2(415.0, 290.0));
        let free = LabelPlacement::default().place(&wanted, screen(), &[])[0].unwrap();
        assert!(free.intersects(above));
        let place = LabelPlacement::default().place(&wanted, screen(), &[above])[0].unwrap();
        assert!(!place.intersects(above));
    }

    #[test]
    fn a_box_larger_than_the_screen_finds_no_place() {
        let within = Rect::from_min_size(Pos2::ZERO, vec2(100.0, 100.0));
        let wanted = [LabelRequest { key: "a", size: vec2(200.0, 20.0), anchor: pos2(50.0, 50.0) }];
        assert_eq!(LabelPlacement::default().place(&wanted, within, &[]), [None]);
    }

    #[test]
    fn the_more_urgent_label_is_placed_if_only_one_fits() {
        let within = Rect::from_min_size(Pos2::ZERO, vec2(130.0, 120.0));
        let wanted = |key| LabelRequest { key, size: vec2(120.0, 40.0), anchor: pos2(65.0, 100.0) };
        let mut placement = LabelPlacement::default();
        assert!(placement.place(&[wanted("calm")], within, &[])[0].is_some());
        let places = placement.place(&[wanted("alarm"), wanted("calm")], within, &[]);
        assert!(places[0].is_some() && places[1].is_none(), "{places:?}");
    }

    /// A bay seen by a camera that goes around it once.
    fn anchors(step: usize) -> Vec<(String, Pos2, f32)> {
        const STEPS_A_TURN: f32 = 720.0;
        let angle = step as f32 / STEPS_A_TURN * std::f32::consts::TAU;
        let mut anchors: Vec<(String, Pos2, f32)> = (0..24)
            .map(|index| {
                let (x, z) = ((index % 6) as f32 * 5.0 - 12.5, (index / 6) as f32 * 7.0 - 10.5);
                let right = x * angle.cos() + z * angle.sin();
                let depth = 60.0 + x * angle.sin() - z * angle.cos();
                let at = pos2(640.0 + right / depth * 1100.0, 360.0 + 9000.0 / depth - 120.0);
                (format!("=Q{index}"), at, depth)
            })
            .collect();
        // As labels come: nearer before farther.
        anchors.sort_by(|a, b| a.2.total_cmp(&b.2));
        anchors
    }

    /// Slot changes of all boxes over two turns, those that come back within ten frames to
    /// the slot that they left, and the most boxes that change in one frame.
    fn changes(forget: bool) -> [usize; 3] {
        let mut placement = LabelPlacement::default();
        let mut history: HashMap<String, Vec<(usize, usize)>> = HashMap::new();
        let (mut all, mut back, mut worst) = (0, 0, 0);
        for step in 0..1440 {
            if forget {
                placement = LabelPlacement::default();
            }
            let anchors = anchors(step);
            let wanted: Vec<LabelRequest<'_>> = anchors
                .iter()
                .map(|(key, anchor, _)| LabelRequest {
                    key,
                    size: vec2(110.0, 46.0),
                    anchor: *anchor,
                })
                .collect();
            let places = placement.place(&wanted, screen(), &[]);
            for (index, place) in places.iter().enumerate() {
                let others = places[..index].iter().flatten();
                assert!(place.is_none_or(|p| others.clone().all(|o| !o.intersects(p))));
            }
            let mut now = 0;
            for (key, slot) in &placement.slots {
                let past = history.entry(key.clone()).or_default();
                if past.last().is_some_and(|(_, last)| last != slot) {
                    now += 1;
                    let before = past.iter().rev().nth(1);
                    let left = past.last().map_or(0, |(since, _)| *since);
                    back += usize::from(before.is_some_and(|(_, b)| b == slot && step - left < 10));
                }
                if past.last().is_none_or(|(_, last)| last != slot) {
                    past.push((step, *slot));
                }
            }
            all += now;
            worst = worst.max(now);
        }
        [all, back, worst]
    }

    #[test]
    fn in_a_slow_orbit_boxes_stay_where_they_are() {
        let [calm, back, worst] = changes(false);
        let [forgetful, forgetful_back, _] = changes(true);
        // A crowd: 24 boxes pass each other in two turns, and some must go elsewhere.
        assert!(calm * 4 < forgetful, "{calm} changes, {forgetful} without memory");
        assert!(back * 10 <= forgetful_back.max(10), "{back} flicker, {forgetful_back} without");
        assert!(worst <= 8, "{worst} in one frame");
    }
}
