//! Queue of asynchronous picks: requests the objects at pixels without waiting for the device.
//!
//! One pick is in progress at a time. An operator's request keeps the draw list of the picture that
//! was displayed then, so that the result refers to that picture.

use std::collections::VecDeque;

use busbar_renderer::{CameraView, DrawList, PixelArea};

/// Questions of the operator that wait; beyond that the oldest is forgotten.
const MAX_WAITING: usize = 8;

/// Purpose of a pick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PickPurpose {
    /// Select the equipment at a pixel.
    Select,
    /// Selects all that shows in a part of the picture.
    SelectAll,
    /// Measure to the surface at a pixel.
    Measure,
    /// Name the equipment under the pointer.
    Hover,
    /// Find the labels whose anchors are occluded.
    Labels,
}

/// A question about a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PickRequest {
    pub(crate) purpose: PickPurpose,
    pub(crate) area: PixelArea,
    /// Camera view of the picture.
    pub(crate) view: CameraView,
}

/// Questions that wait, and the one that is under way.
#[derive(Default)]
pub(crate) struct PickQueue {
    waiting: VecDeque<(PickRequest, DrawList)>,
    in_progress: Option<PickRequest>,
    /// Last requests for hovering and for label occlusion.
    hover: Option<PickRequest>,
    labels: Option<PickRequest>,
}

impl PickQueue {
    /// Enqueues a request about a picture with its draw list.
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

    /// Reports whether the request differs from the last one of its purpose.
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

    /// Forgets the last hover request, so that the next one is issued.
    pub(crate) fn forget_hover(&mut self) {
        self.hover = None;
    }

    /// Forgets the last label request, so that the next one is issued.
    pub(crate) fn forget_labels(&mut self) {
        self.labels = None;
    }

    /// Reports whether a result is pending.
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
    fn clicks_are_answered_in_order_and_the_queue_is_bounded() {
        let mut picker = PickQueue::default();
        for x in 0..MAX_WAITING as u32 + 2 {
            picker.enqueue(request(PickPurpose::Select, x), &DrawList::default());
        }
        assert_eq!(picker.next().unwrap().0, request(PickPurpose::Select, 2));
        assert_eq!(picker.next().unwrap().0, request(PickPurpose::Select, 3));
        assert!(picker.is_busy());
    }

    #[test]
    fn a_pointer_at_rest_queues_one_pick() {
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
