//! Choice of levels: the wanted cursor of each instance for a camera.

use super::active_morphs::NO_TRANSITION;
use super::cursor_state::{InstanceCursor, NO_LEVEL, NOT_SHOWN};
use super::instance_kinds::{InstanceKind, LevelCursors};
use super::lod_cursors::LodCursors;
use crate::lod_camera::LodCamera;
use crate::theta_policy::{ViewMetrics, distance_to_bounds};

impl LodCursors {
    /// Chooses the wanted cursors. Nothing is computed while the camera rests. With `settle`,
    /// groups are merged or split at once.
    pub fn choose_levels(&mut self, eye: LodCamera, settle: bool) {
        let settle = settle || !self.has_settled;
        let last = self.eye.replace(eye);
        if last == Some(eye) && !(settle && self.has_groups_to_change()) {
            return;
        }
        let forced = last.is_none();
        self.has_changed |= forced;
        let (mut index, mut group) = (0, 0);
        // Instances up to here are in a group that is drawn as one still.
        let mut covered = 0;
        while index < self.own {
            match self.groups.get(group).map(|state| (state.instances.clone(), state.after)) {
                Some((instances, after)) if instances.start == index => {
                    self.choose_group(group, eye, settle || index < covered);
                    if self.groups[group].stays_merged() {
                        (index, group) = (instances.end, after);
                    } else {
                        if self.groups[group].is_merged {
                            covered = covered.max(instances.end);
                        }
                        group += 1;
                    }
                }
                _ => {
                    self.choose_instance(index, eye, forced);
                    index += 1;
                }
            }
        }
    }

    fn choose_instance(&mut self, index: usize, eye: LodCamera, forced: bool) {
        let InstanceCursor { kind, shown, .. } = self.instances[index];
        let &InstanceKind { model, policy, .. } = &self.kinds[kind as usize];
        let forced = forced || shown == NOT_SHOWN;
        let pinned = self.full_detail.contains(&index).then_some(0.0);
        if let Some(theta) = pinned.or(self.manual_theta[model as usize]) {
            if forced {
                self.instances[index].level = NO_LEVEL;
                self.request_theta(index, theta);
            }
        } else if forced || self.policies[policy as usize].follows_camera() {
            let level = self.level_of(index, eye);
            if forced || self.instances[index].level != level {
                self.take_level(index, level);
            }
        }
    }

    /// The level of an instance by its policy.
    pub(super) fn level_of(&self, index: usize, eye: LodCamera) -> u32 {
        let instance = &self.instances[index];
        let policy = self.kind_of(instance).policy;
        let distance = distance_to_bounds(eye.position, &instance.bounds);
        let pixel = eye.pixel_at(&instance.bounds, distance) * self.coarseness;
        self.policies[policy as usize]
            .level(ViewMetrics { distance, meters_per_pixel: pixel }, instance.level())
    }

    pub(super) fn take_level(&mut self, index: usize, level: u32) {
        let instance = &mut self.instances[index];
        instance.level = level;
        let kind = &mut self.kinds[instance.kind as usize];
        let LevelCursors { theta, own, proxy } = kind.cursors_at_level(level, &self.policies);
        if self.scale == 1.0 {
            // A proxy may leave out what must be seen.
            let proxy = proxy.filter(|_| !self.individual.contains(&index));
            self.request_cursor(index, theta, proxy.unwrap_or(own));
        } else {
            self.request_theta(index, (theta * self.scale).clamp(0.0, 1.0));
        }
    }

    fn request_theta(&mut self, index: usize, theta: f64) {
        let cursor = self.kind_of(&self.instances[index]).stacks.cursor_for_theta(theta);
        self.request_cursor(index, theta, cursor);
    }

    /// Wants a theta, which is at this cursor.
    fn request_cursor(&mut self, index: usize, theta: f64, cursor: u32) {
        let instance = &mut self.instances[index];
        let is_as_before = theta == instance.theta && cursor == instance.wanted;
        if is_as_before && instance.shown != NOT_SHOWN {
            return;
        }
        let was_moving = instance.wanted != instance.shown || instance.transition != NO_TRANSITION;
        (instance.theta, instance.wanted) = (theta, cursor);
        self.has_changed = true;
        if !was_moving && instance.wanted != instance.shown {
            self.moving.push(index);
        }
    }
}
