//! Asks the device what is at pixels, and does not wait for the answer.
//!
//! One question is under way at a time. What the operator asked for waits with the
//! picture that was on the screen then: the answer is about that one.

use std::collections::VecDeque;

use busbar_renderer::{CameraView, DrawList, PixelArea};

/// Questions of the operator that wait; beyond that the oldest is forgotten.
const MAX_WAITING: usize = 8;

/// What an answer is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PickPurpose {
    /// Selects what is at a pixel.
    Select,
    /// Selects all that shows in a part of the picture.
    SelectAll,
    /// Measures to what is at a pixel.
    Measure,
    /// Names what is under the pointer.
    Hover,
    /// Tells which labels' anchors are hidden.
    Labels,
}

/// A question about a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PickRequest {
    pub(crate) purpose: PickPurpose,
    pub(crate) area: PixelArea,
    /// Through which camera the picture was taken.
    pub(crate) view: CameraView,
}

/// Questions that wait, and the one that is under way.
#[derive(Default)]
pub(crate) struct PickQueue {
    waiting: VecDeque<(PickRequest, DrawList)>,
    in_progress: Option<PickRequest>,
    /// What was last asked for the pointer, and for labels.
    hover: Option<PickRequest>,
    labels: Option<PickRequest>,
}

impl PickQueue {
    /// Asks about a picture with what it showed.
    pub(crate) fn enqueue(&mut self, request: PickRequest, shown: &DrawList) {
        if self.waiting.len() == MAX_WAITING {
            self.waiting.pop_front();
        }
        self.waiting.push_back((request, shown.clone()));
    }

    /// The next that waits, with what its picture showed.
    pub(crate) fn next(&mut self) -> Option<(PickRequest, DrawList)> {
        self.waiting.pop_front()
    }

    /// Whether it is worth asking: it was not asked just before.
    pub(crate) fn is_new(&self, request: &PickRequest) -> bool {
        let last = match request.purpose {
            PickPurpose::Hover => self.hover,
            PickPurpose::Labels => self.labels,
            PickPurpose::Select | PickPurpose::SelectAll | PickPurpose::Measure => None,
        };
        last.as_ref() != Some(request)
    }

    pub(crate) fn begin(&mut self, request: PickRequest) {
        match request.purpose {
            PickPurpose::Hover => self.hover = Some(request),
            PickPurpose::Labels => self.labels = Some(request),
            PickPurpose::Select | PickPurpose::SelectAll | PickPurpose::Measure => {}
        }
        self.in_progress = Some(request);
    }

    pub(crate) fn in_progress(&self) -> Option<PickRequest> {
        self.in_progress
    }

    pub(crate) fn end(&mut self) {
        self.in_progress = None;
    }

    /// Forgets what the pointer was over, so that it is asked for anew.
    pub(crate) fn forget_hover(&mut self) {
        self.hover = None;
    }

    /// Forgets which labels were hidden, so that it is asked anew.
    pub(crate) fn forget_labels(&mut self) {
        self.labels = None;
    }

    /// Whether an answer is to come.
    pub(crate) fn is_busy(&self) -> bool {
        self.in_progress.is_some() || !self.waiting.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use glam::{Mat4, Vec3};

    use super::*;

    fn request(purpose: PickPurpose, x: u32) -> PickRequest {
        let view = CameraView {
            camera_from_world: Mat4::IDENTITY,
            projection: Mat4::IDENTITY,
            eye: Vec3::ZERO,
        };
        PickRequest { purpose, area: PixelArea::pixel([x, 0], [100, 100]), view }
    }

    #[test]
    fn clicks_are_answered_in_order_and_only_so_many_wait() {
        let mut picker = PickQueue::default();
        for x in 0..MAX_WAITING as u32 + 2 {
            picker.enqueue(request(PickPurpose::Select, x), &DrawList::default());
        }
        assert_eq!(picker.next().unwrap().0, request(PickPurpose::Select, 2));
        assert_eq!(picker.next().unwrap().0, request(PickPurpose::Select, 3));
        assert!(picker.is_busy());
    }

    #[test]
    fn a_pointer_at_rest_asks_once() {
        let mut picker = PickQueue::default();
        let [here, there] = [1, 2].map(|x| request(PickPurpose::Hover, x));
        assert!(picker.is_new(&here));
        picker.begin(here);
        assert!(!picker.is_new(&here) && picker.is_new(&there));
        assert_eq!(picker.in_progress(), Some(here));
        picker.end();
        assert!(!picker.is_busy() && !picker.is_new(&here));
        picker.forget_hover();
        assert!(picker.is_new(&here));
        assert!(picker.is_new(&request(PickPurpose::Select, 1)), "a click always is");
        let labels = request(PickPurpose::Labels, 1);
        picker.begin(labels);
        assert!(!picker.is_new(&labels));
        picker.forget_labels();
        assert!(picker.is_new(&labels), "labels are others");
    }
}
