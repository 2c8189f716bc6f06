//! Changes of detail that are under way, so that nothing pops.
//!
//! Between two cursors the finer mesh is drawn, interpolated towards the coarser one by a weight
//! that grows with time. A morph that has begun is completed before the next. Beyond the limits,
//! cursors switch at once.

use super::active_morphs::{ActiveMorphs, MAX_MORPHS, Morph, MorphTransition, NO_TRANSITION};
use super::cursor_state::{InstanceCursor, LodRequest, NOT_SHOWN};
use super::instance_kinds::FIRST_PROXY;
use super::lod_cursors::LodCursors;

impl LodCursors {
    /// Lets changes take so many seconds; 0 shows them at once.
    pub fn set_morph_seconds(&mut self, seconds: f64) {
        self.morphs.seconds = seconds;
    }

    /// Reports whether any instance is morphing.
    pub fn is_morphing(&self) -> bool {
        !self.morphs.transitions.is_empty()
    }

    /// Returns the morph of an instance in transition.
    pub(super) fn morph_of(&self, instance: &InstanceCursor) -> Option<Morph> {
        let transition = self.morphs.transitions.get(instance.transition as usize)?;
        let share = transition.share(self.morphs.now, self.morphs.seconds) as f32;
        let weight = if transition.to > transition.from { share } else { 1.0 - share };
        Some(Morph { coarser: transition.coarser(), weight })
    }

    /// Notes that morphing instances change in each frame.
    pub(super) fn note_morphing(&mut self) {
        self.reported
            .changed
            .extend(self.morphs.transitions.iter().map(|transition| transition.index));
    }

    /// Ends the ways that are gone; all of them, to settle.
    pub(super) fn end_morphs(&mut self, now: f64, settle: bool) {
        self.morphs.now = now;
        let mut at = 0;
        while let Some(&transition) = self.morphs.transitions.get(at) {
            let instance = &self.instances[transition.index];
            let is_hidden = instance.shown == NOT_SHOWN;
            if !(settle || is_hidden || transition.share(now, self.morphs.seconds) == 1.0) {
                at += 1;
                continue;
            }
            self.end(at);
            if !is_hidden {
                self.show(transition.index, transition.to);
            }
        }
    }

    fn end(&mut self, at: usize) {
        let transition = self.morphs.transitions.swap_remove(at);
        self.morphs.bytes -= transition.bytes;
        self.instances[transition.index].transition = NO_TRANSITION;
        self.reported.changed.push(transition.index);
        if let Some(moved) = self.morphs.transitions.get(at) {
            self.instances[moved.index].transition = at as u32;
        }
    }

    /// Shows an instance at another cursor.
    pub(super) fn show(&mut self, index: usize, cursor: u32) {
        let instance = &mut self.instances[index];
        if instance.shown != cursor {
            instance.shown = cursor;
            self.moved.push(index);
            self.reported.changed.push(index);
        }
    }

    /// Reports whether an instance morphs to its wanted cursor; to and from proxies it switches at
    /// once.
    pub(super) fn morphs(&self, instance: &InstanceCursor) -> bool {
        let ActiveMorphs { budget, seconds, transitions, bytes, .. } = &self.morphs;
        *seconds > 0.0
            && instance.shown.max(instance.wanted) < FIRST_PROXY
            && transitions.len() < MAX_MORPHS
            && bytes + self.vertex_bytes(instance) <= budget.max_bytes
    }

    /// Starts the morph of an instance to its wanted cursor.
    pub(super) fn begin_morph(&mut self, index: usize) {
        let ActiveMorphs { now, transitions, .. } = &self.morphs;
        let (begun, at) = (*now, transitions.len() as u32);
        let bytes = self.vertex_bytes(&self.instances[index]);
        let instance = &mut self.instances[index];
        instance.transition = at;
        let (from, to) = (instance.shown, instance.wanted);
        self.morphs.bytes += bytes;
        self.morphs.transitions.push(MorphTransition { index, from, to, begun, bytes });
        self.show(index, from.min(to));
    }

    /// Returns the morph data that an instance needs besides the mesh at its wanted cursor.
    pub(super) fn morph_request(&self, instance: &InstanceCursor) -> LodRequest {
        LodRequest::Morph(self.place(instance, instance.shown.max(instance.wanted)))
    }

    fn vertex_bytes(&self, instance: &InstanceCursor) -> u64 {
        let mesh = self.kind_of(instance).stacks.mesh();
        mesh.wedges.position.len() as u64 * self.morphs.budget.vertex_bytes
    }
}
