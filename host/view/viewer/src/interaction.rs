//! Interaction: what the operator selects, points at, picks and measures.

use std::collections::BTreeSet;

use busbar_geometry::Bounds;
use busbar_renderer::{DrawList, PixelArea};
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_site::IndexRemap;
use egui::{Pos2, Rect};

use crate::measurement_chain::MeasurementChain;
use crate::pick_queue::{PickPurpose, PickQueue, PickRequest};
use crate::site_definition::remapped;
use crate::view_target::ViewTarget;

/// Pieces of equipment that are selected at once; of more the first in the scene.
pub const MAX_SELECTED: usize = 10_000;

/// Selected pieces of equipment that are named; of more their number.
const MAX_NAMES: usize = 3;

/// State of the operator's interaction with the scene.
#[derive(Default)]
pub(crate) struct Interaction {
    selection: BTreeSet<NodeIndex>,
    /// Node under the pointer, as last picked.
    pub(crate) hovered: Option<NodeIndex>,
    /// Pointer position over the scene, points.
    pointer: Option<Pos2>,
    pub(crate) picks: PickQueue,
    /// Chain of measured points; none unless the operator measures.
    pub(crate) measuring: Option<MeasurementChain>,
}

impl Interaction {
    /// Selects nodes, at most [`MAX_SELECTED`].
    pub(crate) fn select(&mut self, nodes: impl IntoIterator<Item = NodeIndex>) {
        self.selection = nodes.into_iter().take(MAX_SELECTED).collect();
    }

    /// Returns the selected nodes.
    pub(crate) fn selection(&self) -> &BTreeSet<NodeIndex> {
        &self.selection
    }

    /// Returns the bounds of the selected nodes; none for an empty selection.
    pub(crate) fn selected_bounds(&self, graph: &SceneGraph) -> Option<Bounds> {
        let bounds = self.selection.iter().filter_map(|node| graph.node(*node).bounds());
        bounds.reduce(Bounds::union)
    }

    /// Names the selected equipment for the status bar.
    pub(crate) fn selected_text(&self, graph: &SceneGraph) -> Option<String> {
        let ids = self.selection.iter().map(|node| graph.node(*node).id());
        let names: Vec<String> = ids.take(MAX_NAMES).collect();
        let more = if self.selection.len() > names.len() { ", \u{2026}" } else { "" };
        match self.selection.len() {
            0 => None,
            1 => names.into_iter().next(),
            count => Some(format!("{count} selected: {}{more}", names.join(", "))),
        }
    }

    /// Sets the pointer position over the scene; none while it is elsewhere.
    pub(crate) fn point_at(&mut self, position: Option<Pos2>) {
        self.pointer = position;
        if position.is_none() {
            self.forget_hover();
        }
    }

    /// Returns the pointer position over the scene, points.
    pub(crate) fn pointer(&self) -> Option<Pos2> {
        self.pointer
    }

    /// Forgets the node under the pointer, for instance because the camera moves.
    pub(crate) fn forget_hover(&mut self) {
        self.hovered = None;
        self.picks.forget_hover();
    }

    /// Enqueues a pick of a position in the displayed picture.
    pub(crate) fn pick_at(
        &mut self,
        purpose: PickPurpose,
        at: Pos2,
        target: &ViewTarget,
        shown: PickedPicture<'_>,
    ) {
        self.enqueue(purpose, PixelArea::pixel(target.pixel(at), shown.size), shown);
    }

    /// Enqueues a pick of a part of the displayed picture.
    pub(crate) fn pick_in(
        &mut self,
        purpose: PickPurpose,
        area: Rect,
        target: &ViewTarget,
        shown: PickedPicture<'_>,
    ) {
        let picture = shown.size;
        let origin = target.pixel(area.min);
        let end = [area.max.x, area.max.y].map(|points| (points * target.pixels_per_point).ceil());
        let size =
            [0, 1].map(|axis| (end[axis] as u32).min(picture[axis]).saturating_sub(origin[axis]));
        self.enqueue(purpose, PixelArea { origin, size, picture }, shown);
    }

    fn enqueue(&mut self, purpose: PickPurpose, area: PixelArea, shown: PickedPicture<'_>) {
        if let Some(view) = shown.view {
            self.picks.enqueue(PickRequest { purpose, area, view }, shown.instances);
        }
    }

    /// Adapts to a reloaded scene with other nodes.
    pub(crate) fn remap(&mut self, remap: &IndexRemap) {
        self.selection = self.selection.iter().filter_map(|node| remapped(remap, *node)).collect();
        self.picks = PickQueue::default();
        self.hovered = None;
    }
}

/// Displayed picture that a pick refers to.
#[derive(Clone, Copy)]
pub(crate) struct PickedPicture<'a> {
    /// Size of the picture, pixels.
    pub(crate) size: [u32; 2],
    /// Camera view of the picture; none before the first.
    pub(crate) view: Option<busbar_renderer::CameraView>,
    /// Instances that the picture shows.
    pub(crate) instances: &'a DrawList,
}
