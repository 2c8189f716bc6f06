//! Drawn items, and their changes since the last report.

use super::active_morphs::Morph;
use super::cursor_state::{DrawItem, MeshCursor};
use super::lod_cursors::LodCursors;
use super::reported_drawing::{IS_DRAWN, ReportedDrawing, WAS_DRAWN};

impl LodCursors {
    /// Visits each drawn item with its cursor and its morph.
    pub fn for_each_drawn(&self, mut each: impl FnMut(DrawItem, MeshCursor, Option<Morph>)) {
        self.walk(0..self.own, 0, &mut |drawn, index| {
            let instance = &self.instances[index];
            each(drawn, self.place(instance, instance.shown), self.morph_of(instance));
        });
    }

    /// Visits each item that is drawn differently from the last report; none for one that is gone.
    /// The cost depends on the changes, or on all drawn items after groups changed.
    pub fn for_each_changed(
        &mut self,
        mut each: impl FnMut(DrawItem, Option<(MeshCursor, Option<Morph>)>),
    ) {
        let mut reported = std::mem::replace(&mut self.reported, ReportedDrawing::nothing());
        if std::mem::take(&mut reported.has_regrouped) {
            self.find_drawn(&mut reported, |index| each(self.drawn_at(index), None));
        }
        for index in reported.changed.drain(..) {
            if reported.states[index] == WAS_DRAWN {
                let instance = &self.instances[index];
                let place = self.place(instance, instance.shown);
                each(self.drawn_at(index), Some((place, self.morph_of(instance))));
            }
        }
        self.reported = reported;
    }

    /// Finds the drawn items; newly drawn ones count as changed.
    fn find_drawn(&self, reported: &mut ReportedDrawing, mut is_gone: impl FnMut(usize)) {
        let ReportedDrawing { changed, drawn, states, .. } = reported;
        states.resize(self.instances.len(), 0);
        let before = std::mem::take(drawn);
        self.walk(0..self.own, 0, &mut |_, index| {
            drawn.push(index);
            if states[index] != WAS_DRAWN {
                changed.push(index);
            }
            states[index] |= IS_DRAWN;
        });
        for index in before {
            if states[index] == WAS_DRAWN {
                states[index] = 0;
                is_gone(index);
            }
        }
        drawn.iter().for_each(|&index| states[index] = WAS_DRAWN);
    }

    fn drawn_at(&self, index: usize) -> DrawItem {
        index.checked_sub(self.own).map_or(DrawItem::Instance(index), DrawItem::Group)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use proptest::prelude::*;

    use super::super::group_merging_tests;
    use super::super::tests::eye_at;
    use super::*;

    /// Event before a frame.
    #[derive(Clone, Copy, Debug)]
    enum Event {
        CameraDistance(f32),
        ManualTheta(Option<f64>),
        Full(usize),
        NoneFull,
        Nothing,
    }

    fn event() -> impl Strategy<Value = Event> {
        prop_oneof![
            8 => (0.0_f32..2.5).prop_map(|power| Event::CameraDistance(10_f32.powf(power))),
            1 => prop::option::of(0.0..1.0).prop_map(Event::ManualTheta),
            1 => (0_usize..4).prop_map(Event::Full),
            1 => Just(Event::NoneFull),
            3 => Just(Event::Nothing),
        ]
    }

    /// Applies the reported changes to a copy of the drawing.
    fn apply_changes(
        cursors: &mut LodCursors,
        known: &mut BTreeMap<DrawItem, (MeshCursor, Option<Morph>)>,
    ) {
        cursors.for_each_changed(|drawn, shown| {
            let was = match shown {
                Some(shown) => known.insert(drawn, shown).or(Some(shown)),
                None => known.remove(&drawn),
            };
            assert!(was.is_some(), "{drawn:?} was not there");
        });
    }

    proptest! {
        /// Accumulated changes equal the present drawing after any events.
        #[test]
        fn all_draw_changes_together_reproduce_the_draw_list(
            steps in prop::collection::vec(
                (event(), any::<bool>(), 0_u32..10, any::<bool>()), 1..60)
        ) {
            let mut cursors = group_merging_tests::groups();
            cursors.set_morph_seconds(0.5);
            let mut known = BTreeMap::new();
            for (step, (event, is_ready, settles, collects)) in steps.into_iter().enumerate() {
                let settle = settles == 0;
                match event {
                    Event::CameraDistance(metres) => cursors.choose_levels(eye_at(-metres), settle),
                    Event::ManualTheta(theta) => cursors.set_manual_theta(0, theta),
                    Event::Full(instance) => cursors.set_full_detail([instance].into()),
                    Event::NoneFull => cursors.set_full_detail([].into()),
                    Event::Nothing => {}
                }
                cursors.advance(settle, step as f64 * 0.2, |_| is_ready);
                if !collects {
                    continue;
                }
                apply_changes(&mut cursors, &mut known);
                let mut all = BTreeMap::new();
                cursors.for_each_drawn(|drawn, place, morph| {
                    all.insert(drawn, (place, morph));
                });
                prop_assert_eq!(&known, &all, "step {}", step);
            }
        }
    }
}
