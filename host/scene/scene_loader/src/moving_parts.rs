//! Moving parts of models, as configured: their nodes, motions and mechanisms.

use std::collections::HashMap;
use std::ops::Range;

use busbar_config::{Config, EndConfig, MovingPartConfig};
use busbar_scene::{Motion, NodeIndex, SceneGraph};

/// Moving parts of a scene as modelled: a hundred stations have tens of thousands, of few kinds.
#[derive(Default)]
pub struct MovingPartTable {
    kinds: Vec<MovingPartKind>,
    /// Node and kind of each part.
    all: Vec<(NodeIndex, u32)>,
    /// Pieces of equipment with runs of the parts at them or under them, in order.
    at: Vec<(NodeIndex, Range<u32>)>,
}

/// Motion of a model's part, shared by all its placements.
pub struct MovingPartKind {
    mechanism: String,
    /// Motion between the ends of the travel.
    pub motion: Motion,
    /// End of the travel at which the part is modelled.
    pub modelled: EndConfig,
}

impl MovingPartTable {
    /// Finds the moving parts of all placed models.
    pub fn new(config: &Config, graph: &SceneGraph) -> Self {
        let (mut kinds, mut placed_parts) = (Vec::new(), Vec::new());
        let mut first_kinds: HashMap<&str, u32> = HashMap::new();
        for (name, model) in &config.models {
            first_kinds.insert(name, kinds.len() as u32);
            kinds.extend(&model.moving_parts);
        }
        if kinds.is_empty() {
            return Self::default();
        }
        for placed in config.scene.iter() {
            let Some((name, model)) =
                placed.model.as_ref().and_then(|name| config.models.get_key_value(name))
            else {
                continue;
            };
            for (kind, part) in (first_kinds[name.as_str()]..).zip(&model.moving_parts) {
                if let Some(node) = graph.find(&format!("{}/{}", placed.id, part.part)) {
                    placed_parts.push((node, kind));
                }
            }
        }
        Self::from_placed(graph, kinds, placed_parts)
    }

    /// Creates the table of parts of these kinds: the node of each part and the index of its kind.
    pub fn from_placed<'a>(
        graph: &SceneGraph,
        kinds: impl IntoIterator<Item = &'a MovingPartConfig>,
        parts: impl IntoIterator<Item = (NodeIndex, u32)>,
    ) -> Self {
        let kinds = kinds.into_iter().map(MovingPartKind::new).collect();
        let mut table = Self { kinds, ..Self::default() };
        for (node, kind) in parts {
            table.add(graph, node, kind);
        }
        table.finish()
    }

    /// Adds the part of a kind that a node is.
    fn add(&mut self, graph: &SceneGraph, node: NodeIndex, kind: u32) {
        let index = self.all.len() as u32;
        self.all.push((node, kind));
        let above = |node: &NodeIndex| graph.node(*node).parent();
        self.at
            .extend(std::iter::successors(Some(node), above).map(|node| (node, index..index + 1)));
    }

    fn finish(mut self) -> Self {
        self.all.shrink_to_fit();
        self.at.sort_unstable_by_key(|(node, run)| (*node, run.start));
        // Most parts under a piece follow each other.
        self.at.dedup_by(|(node, next), (of_run, run)| {
            let goes_on = node == of_run && next.start == run.end;
            if goes_on {
                run.end = next.end;
            }
            goes_on
        });
        self.at.shrink_to_fit();
        self
    }

    /// Returns the node of a part, by the part's index.
    pub fn node(&self, part: u32) -> NodeIndex {
        self.all[part as usize].0
    }

    /// Returns the kind of a part, by the part's index.
    pub fn kind(&self, part: u32) -> &MovingPartKind {
        &self.kinds[self.all[part as usize].1 as usize]
    }

    /// Returns the indices of the parts that a mechanism moves, at a node or under it.
    pub fn moved_by<'a>(
        &'a self,
        equipment: NodeIndex,
        mechanism: &'a str,
    ) -> impl Iterator<Item = u32> + 'a {
        let first = self.at.partition_point(|(node, _)| *node < equipment);
        let at = self.at[first..].iter().take_while(move |(node, _)| *node == equipment);
        at.flat_map(|(_, run)| run.clone())
            .filter(move |&part| self.kind(part).mechanism == mechanism)
    }
}

impl MovingPartKind {
    fn new(config: &MovingPartConfig) -> Self {
        let motion = Motion {
            pivot: config.pivot.into(),
            axis: config.axis.into(),
            degrees: config.degrees,
            travel: config.travel.into(),
            scale: config.scale.into(),
        };
        Self { mechanism: config.mechanism.clone(), motion, modelled: config.modelled }
    }
}
