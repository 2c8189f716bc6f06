//! Draw list of the scene, updated incrementally from one frame to the next.

use busbar_renderer::{DrawInstance, DrawList};
use busbar_scene::NodeIndex;

use crate::highlight::Highlights;
use crate::highlight_styles;
use crate::object_numbers::object_of;
use crate::uploaded_models::UploadedModel;
use busbar_lod::{DrawItem, LodCursors, MeshCursor, Morph};
use busbar_scene_loader::LoadedScene;

/// The instances of the graph, in their order, then its groups.
#[derive(Default)]
pub(crate) struct SceneDrawList {
    list: DrawList,
    /// The revision of the highlights that it shows.
    highlighted: u64,
}

impl SceneDrawList {
    pub(crate) fn list(&self) -> &DrawList {
        &self.list
    }

    /// Updates the transforms of moved instances.
    pub(crate) fn move_instances(&mut self, scene: &LoadedScene, moved: &[usize]) {
        for &index in moved {
            let instance = scene.graph.instance(index);
            if let Some(&drawn) = self.list.get(index) {
                let world_from_mesh = scene.graph.world_from_mesh(&instance);
                self.list.set(index, Some(DrawInstance { world_from_mesh, ..drawn }));
            }
        }
    }

    /// Updates the items and highlights that have changed.
    pub(crate) fn update(
        &mut self,
        scene: &LoadedScene,
        models: &[UploadedModel],
        cursors: &mut LodCursors,
        highlights: &Highlights,
    ) {
        let own = scene.graph.instances().len();
        if self.list.is_empty() {
            self.list = DrawList::with_places(own + scene.proxies.groups.len());
        }
        let place_of = |drawn| match drawn {
            DrawItem::Instance(index) => index,
            DrawItem::Group(index) => own + index,
        };
        cursors.for_each_changed(|drawn, shown| {
            let instance = shown
                .map(|(place, morph)| instance_of(scene, models, highlights, drawn, place, morph));
            self.list.set(place_of(drawn), instance);
        });
        if self.highlighted != highlights.revision() {
            self.highlighted = highlights.revision();
            for place in 0..self.list.len() {
                let drawn = match place.checked_sub(own) {
                    None => DrawItem::Instance(place),
                    Some(group) => DrawItem::Group(group),
                };
                self.list.set_highlight(place, highlight_of(highlights, node_of(scene, drawn)));
            }
        }
    }
}

fn node_of(scene: &LoadedScene, drawn: DrawItem) -> NodeIndex {
    match drawn {
        DrawItem::Instance(index) => scene.graph.instance(index).node,
        DrawItem::Group(index) => NodeIndex(scene.proxies.groups[index].group.nodes.start),
    }
}

fn highlight_of(highlights: &Highlights, node: NodeIndex) -> [f32; 4] {
    highlights.of_nodes().get(node.0 as usize).copied().unwrap_or(highlight_styles::NONE)
}

fn instance_of(
    scene: &LoadedScene,
    models: &[UploadedModel],
    highlights: &Highlights,
    drawn: DrawItem,
    place: MeshCursor,
    morph: Option<Morph>,
) -> DrawInstance {
    let node = node_of(scene, drawn);
    let (world_from_mesh, first_feature) = match drawn {
        DrawItem::Instance(index) => {
            let instance = scene.graph.instance(index);
            (scene.graph.world_from_mesh(&instance), instance.first_feature)
        }
        DrawItem::Group(index) => (scene.proxies.groups[index].group.world_from_group, Some(node)),
    };
    DrawInstance {
        model: models[place.model].handle,
        mesh: place.mesh as u32,
        cursor: place.cursor,
        morph: morph.map(|Morph { coarser, weight }| busbar_renderer::Morph { coarser, weight }),
        world_from_mesh,
        object: object_of(node),
        highlight: highlight_of(highlights, node),
        first_feature: first_feature.map(object_of),
    }
}
