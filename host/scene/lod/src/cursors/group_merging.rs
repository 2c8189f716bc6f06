//! Groups that are drawn as one where they are far.
//!
//! A group *wants* to be merged if its policy permits the base error of its proxy. It *is* merged
//! or split only when all required meshes are ready, so that nothing is ever missing from the
//! picture.

use std::collections::BTreeSet;
use std::ops::Range;

use super::cursor_state::{DrawItem, InstanceCursor, NO_LEVEL};
use super::group_state::HlodState;
use super::lod_cursors::LodCursors;
use crate::lod_camera::LodCamera;
use crate::theta_policy::Detail;

impl LodCursors {
    /// Chooses whether a group wants to be drawn as one, and at which cursor. `at_once`
    /// it is so too: where all may change, or nothing of it is drawn by itself yet.
    pub(super) fn choose_group(&mut self, group: usize, eye: LodCamera, at_once: bool) {
        let proxy = self.own + group;
        let level = self.level_of(proxy, eye);
        let policy = &self.policies[self.kind_of(&self.instances[proxy]).policy as usize];
        let coarse_enough = match policy.detail(level) {
            Detail::Error(metres) => metres >= self.groups[group].base_error,
            Detail::Theta(_) => false,
        };
        let wants_merge = coarse_enough && self.follows_policy(group);
        self.groups[group].wants_merge = wants_merge;
        if wants_merge {
            if self.instances[proxy].level != level {
                self.take_level(proxy, level);
            }
        } else if self.groups[group].is_merged {
            // It stays as it is until its instances are ready.
            self.instances[proxy].level = NO_LEVEL;
        } else {
            self.instances[proxy].hide();
        }
        if at_once {
            self.apply_merge(group);
        }
    }

    /// Reports whether the policy alone decides on the detail of the group's instances.
    fn follows_policy(&self, group: usize) -> bool {
        let manual_theta = |&model: &u32| self.manual_theta[model as usize].is_some();
        let within = &self.groups[group].instances;
        let has_any = |of: &BTreeSet<usize>| of.range(within.clone()).next().is_some();
        let is_special =
            [&self.full_detail, &self.displaced, &self.individual].into_iter().any(has_any);
        self.scale == 1.0 && !is_special && !self.groups[group].models.iter().any(manual_theta)
    }

    fn apply_merge(&mut self, group: usize) {
        let state = &mut self.groups[group];
        if state.is_merged == state.wants_merge {
            return;
        }
        state.is_merged = state.wants_merge;
        self.has_changed = true;
        self.reported.has_regrouped = true;
        if state.is_merged {
            let (instances, after) = (state.instances.clone(), state.after);
            self.instances[instances].iter_mut().for_each(InstanceCursor::hide);
            for inner in group + 1..after {
                let inner_state = &mut self.groups[inner];
                (inner_state.wants_merge, inner_state.is_merged) = (false, false);
                self.instances[self.own + inner].hide();
            }
        } else {
            self.instances[self.own + group].hide();
        }
    }

    pub(super) fn has_groups_to_change(&self) -> bool {
        self.groups.iter().any(|group| group.is_merged != group.wants_merge)
    }

    /// Draws groups as they want to be, where all that takes is ready.
    pub(super) fn change_groups(&mut self) {
        for group in 0..self.groups.len() {
            let HlodState { wants_merge, is_merged, .. } = self.groups[group];
            let ready = match (is_merged, wants_merge) {
                (false, true) => self.instances[self.own + group].is_ready(),
                (true, false) => self.is_group_ready(group),
                _ => false,
            };
            if ready {
                self.apply_merge(group);
            }
        }
    }

    fn is_group_ready(&self, group: usize) -> bool {
        let mut ready = true;
        let instances = self.groups[group].instances.clone();
        self.walk(instances, group + 1, &mut |_, index| ready &= self.instances[index].is_ready());
        ready
    }

    /// Visits the drawn items of a range of instances with their cursor indices. `group` is the
    /// first group that begins there.
    pub(super) fn walk(
        &self,
        instances: Range<usize>,
        mut group: usize,
        visit: &mut impl FnMut(DrawItem, usize),
    ) {
        let mut index = instances.start;
        while index < instances.end {
            match self.groups.get(group) {
                Some(state) if state.instances.start == index => {
                    if state.is_merged {
                        visit(DrawItem::Group(group), self.own + group);
                        (index, group) = (state.instances.end, state.after);
                    } else {
                        group += 1;
                    }
                }
                _ => {
                    visit(DrawItem::Instance(index), index);
                    index += 1;
                }
            }
        }
    }
}
