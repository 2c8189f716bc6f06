//! Advance: instances move to their wanted cursors as their meshes become ready.

use super::active_morphs::NO_TRANSITION;
use super::cursor_state::{LodRequest, MeshCursor, ModelDetail, NOT_SHOWN};
use super::instance_kinds::FIRST_PROXY;
use super::lod_cursors::LodCursors;

impl LodCursors {
    /// Moves instances to their wanted cursors, or starts their morphs, where the required meshes
    /// are ready. With `settle`, and at the first call, all move at once. `now` is the frame's
    /// time, seconds.
    pub fn advance(&mut self, settle: bool, now: f64, is_ready: impl Fn(LodRequest) -> bool) {
        let settle = settle || !self.has_settled;
        self.has_settled = true;
        self.end_morphs(now, settle);
        let mut moving = std::mem::take(&mut self.moving);
        moving.retain(|&index| self.advance_instance(index, settle, &is_ready));
        self.moving = moving;
        self.has_changed |= !self.moved.is_empty();
        self.change_groups();
        self.note_morphing();
    }

    /// Advances an instance if possible; reports whether it has yet to arrive.
    fn advance_instance(
        &mut self,
        index: usize,
        settle: bool,
        is_ready: impl Fn(LodRequest) -> bool,
    ) -> bool {
        let instance = &self.instances[index];
        // It may have come back meanwhile.
        if instance.transition != NO_TRANSITION || instance.wanted == instance.shown {
            return instance.transition != NO_TRANSITION;
        }
        if !settle && !is_ready(LodRequest::Mesh(self.place(instance, instance.wanted))) {
            return true;
        }
        if settle || !self.morphs(instance) {
            self.show(index, instance.wanted);
            return false;
        }
        if is_ready(self.morph_request(instance)) {
            self.begin_morph(index);
        }
        true
    }

    /// Returns the resources that instances wait for, with repetitions.
    pub fn waiting(&self) -> impl Iterator<Item = LodRequest> {
        let cursors = self.moving.iter().map(|&index| &self.instances[index]);
        cursors.filter(|instance| instance.transition == NO_TRANSITION).flat_map(|instance| {
            let transition = self.morphs(instance).then(|| self.morph_request(instance));
            [LodRequest::Mesh(self.place(instance, instance.wanted))].into_iter().chain(transition)
        })
    }

    /// Notes the live triangles of instances that moved, once they are drawn.
    pub fn count_moved(&mut self, triangles_at: impl Fn(MeshCursor) -> Option<u32>) {
        let Self { kinds, instances, moved, .. } = self;
        // A frame of a minimised window draws nothing.
        moved.retain(|&index| {
            let instance = &mut instances[index];
            if instance.shown == NOT_SHOWN {
                return false;
            }
            let triangles = triangles_at(kinds[instance.kind as usize].at(instance.shown));
            instance.triangles = triangles.unwrap_or(instance.triangles);
            triangles.is_none()
        });
    }

    /// Returns the detail of each model if it has changed since the last call.
    pub fn changed_detail(&mut self) -> Option<Vec<ModelDetail>> {
        if !std::mem::take(&mut self.has_changed) {
            return None;
        }
        let mut details: Vec<Option<ModelDetail>> = vec![None; self.manual_theta.len()];
        self.walk(0..self.own, 0, &mut |_, index| {
            let instance = &self.instances[index];
            let kind = self.kind_of(instance);
            let detail = details[kind.model as usize].get_or_insert(ModelDetail {
                theta: [instance.theta; 2],
                ..ModelDetail::default()
            });
            let [least, greatest] = detail.theta;
            detail.theta = [least.min(instance.theta), greatest.max(instance.theta)];
            let stacks = &kind.stacks;
            let is_own = instance.shown < FIRST_PROXY;
            let cursor =
                if is_own { instance.shown } else { stacks.cursor_for_theta(instance.theta) };
            detail.s1 += u64::from(stacks.collapse_count() - cursor);
            detail.s2 += u64::from(cursor);
            detail.triangles += u64::from(instance.triangles);
        });
        let with_source = |(detail, manual_theta): (Option<ModelDetail>, &Option<f64>)| {
            ModelDetail { by_policy: manual_theta.is_none(), ..detail.unwrap_or_default() }
        };
        Some(details.into_iter().zip(&self.manual_theta).map(with_source).collect())
    }
}
