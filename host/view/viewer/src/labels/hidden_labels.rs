//! Occlusion of labels: finds labels whose equipment is behind other equipment.

use std::collections::BTreeSet;

use busbar_scene::{NodeIndex, SceneGraph};
use glam::Vec3;

use crate::labels::top_of;
use crate::object_numbers::node_of;
use crate::pick_queue::PickRequest;
use crate::ray_casting::{Ray, SceneSurfaces, distance_to_node};

/// Pixels beside an anchor that must be covered too: the edge of a wire hides nothing.
const BESIDE: [i64; 3] = [-3, 0, 3];
/// Metres, and share of the distance, by which what hides an anchor is nearer.
const NEARER_METRES: f64 = 0.05;
const NEARER_SHARE: f64 = 0.005;

/// The objects of a whole picture, and how it was taken.
pub(crate) struct IdPicture<'a> {
    pub(crate) objects: &'a [Option<u32>],
    pub(crate) request: &'a PickRequest,
}

/// Returns the nodes whose label anchors are occluded.
pub(crate) fn find_hidden_labels(
    surfaces: &SceneSurfaces<'_>,
    nodes: &[NodeIndex],
    ids: &IdPicture<'_>,
) -> BTreeSet<NodeIndex> {
    let is_hidden = |node: &NodeIndex| {
        let graph = surfaces.graph;
        let anchor = top_of(graph.node(*node));
        let [x, y] = ids.pixel_of(anchor)?;
        let covered = |beside: i64| {
            let at = [x + beside, y];
            let seen = ids.node_at(at)?;
            (!is_related(graph, seen, *node)).then(|| ids.is_nearer(surfaces, seen, at, anchor))
        };
        Some(BESIDE.into_iter().all(|beside| covered(beside).unwrap_or(false)))
    };
    nodes.iter().copied().filter(|node| is_hidden(node).unwrap_or(false)).collect()
}

impl IdPicture<'_> {
    fn pixel_of(&self, world: Vec3) -> Option<[i64; 2]> {
        let clip = self.request.view.clip_from_world() * world.extend(1.0);
        let place = [clip.x, clip.y].map(|along| along / clip.w * 0.5 + 0.5);
        let size = self.request.area.size.map(|pixels| pixels as f32);
        let pixel = [0, 1].map(|axis| (place[axis] * size[axis]).floor() as i64);
        (clip.w > 0.0).then_some(pixel)
    }

    fn node_at(&self, [x, y]: [i64; 2]) -> Option<NodeIndex> {
        let [width, height] = self.request.area.size.map(i64::from);
        let is_within = (0..width).contains(&x) && (0..height).contains(&y);
        let index = usize::try_from(y * width + x).ok().filter(|_| is_within)?;
        node_of(self.objects.get(index).copied().flatten())
    }

    /// Reports whether the surface seen at a pixel is nearer than a point.
    fn is_nearer(
        &self,
        surfaces: &SceneSurfaces<'_>,
        seen: NodeIndex,
        pixel: [i64; 2],
        point: Vec3,
    ) -> bool {
        let PickRequest { view, area, .. } = self.request;
        let ray = Ray::through_pixel(view, pixel.map(|p| p as f64 + 0.5), area.picture);
        let along = (point.as_dvec3() - ray.origin).dot(ray.direction);
        let enough = along * (1.0 - NEARER_SHARE) - NEARER_METRES;
        distance_to_node(surfaces, seen, &ray).is_some_and(|distance| distance < enough)
    }
}

/// Reports whether one node is the other's ancestor, or the same.
fn is_related(graph: &SceneGraph, a: NodeIndex, b: NodeIndex) -> bool {
    let is_under = |node: NodeIndex, top: NodeIndex| {
        let parents = std::iter::successors(Some(node), |node| graph.node(*node).parent());
        parents.into_iter().any(|node| node == top)
    };
    is_under(a, b) || is_under(b, a)
}
