//! Parts of models that move with switches: where each stands, as far as it is known.
//!
//! A part of unknown position stands in the middle of its travel and is hatched, neither open nor
//! closed.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use busbar_config::EndConfig;
use busbar_scene::{NodeIndex, SceneGraph};
use busbar_scene_loader::{MovingPartKind, MovingPartTable};
use busbar_tags::Snapshot;
use busbar_types::Pattern;

use crate::overlay_layers::{NodeState, StateBasis, SwitchPosition};

/// Travel of a part whose position is unknown.
const MIDDLE: f64 = 0.5;

/// All moving parts of a scene with their positions. Clones share the table of parts.
#[derive(Clone, Default)]
pub struct MovingParts {
    parts: Arc<MovingPartTable>,
    /// Parts whose position was reported at least once, by index.
    shown: BTreeMap<u32, MovedPart>,
    /// Instances that stand elsewhere than their models show them.
    moved: BTreeSet<usize>,
    /// Instances that the last update moved.
    just_moved: Vec<usize>,
    /// Positions of the last update, with the validity of each.
    positions_seen: Vec<(SwitchPosition, bool)>,
    /// States of the parts whose position was unknown.
    unknown: Vec<NodeState>,
}

#[derive(Clone)]
struct MovedPart {
    position: PartPosition,
    /// Instances of it, once it has moved.
    instances: Vec<usize>,
}

/// Displayed position of a part, from open, 0, to closed, 1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct PartPosition {
    travelled: f64,
    is_known: bool,
}

impl PartPosition {
    const UNKNOWN: Self = Self { travelled: MIDDLE, is_known: false };
}

impl MovingParts {
    /// Creates the positions of the parts in a table: none has been reported.
    pub(crate) fn new(parts: Arc<MovingPartTable>) -> Self {
        Self { parts, ..Self::default() }
    }

    /// Reports whether a position moves any part.
    pub(crate) fn has(&self, position: &SwitchPosition) -> bool {
        self.parts_of(position).next().is_some()
    }

    /// Moves the parts whose positions changed; returns states for parts of unknown position. An
    /// unchanged frame costs a comparison.
    pub(crate) fn update(
        &mut self,
        graph: &mut Arc<SceneGraph>,
        positions: &[SwitchPosition],
        snapshot: Snapshot<'_>,
    ) -> &[NodeState] {
        self.just_moved.clear();
        let is_good = |position: &SwitchPosition| {
            snapshot.state(position.tag).is_some_and(|state| state.quality.is_good())
        };
        let now = positions.iter().map(|position| (position, is_good(position)));
        if !now.clone().eq(self.positions_seen.iter().map(|(position, good)| (position, *good))) {
            self.positions_seen = now.map(|(position, good)| (position.clone(), good)).collect();
            self.apply_positions(graph);
        }
        &self.unknown
    }

    fn apply_positions(&mut self, graph: &mut Arc<SceneGraph>) {
        // Of what an overlay does not tell any more nothing is known.
        let mut now: BTreeMap<u32, PartPosition> =
            self.shown.keys().map(|&part| (part, PartPosition::UNKNOWN)).collect();
        for (position, is_good) in &self.positions_seen {
            let travelled = position.travelled.filter(|_| *is_good);
            let known = |travelled| PartPosition { travelled, is_known: true };
            let of_position = travelled.map_or(PartPosition::UNKNOWN, known);
            now.extend(self.parts_of(position).map(|part| (part, of_position)));
        }
        self.unknown.clear();
        for (part, position) in now {
            if self.shown.get(&part).is_none_or(|shown| shown.position != position) {
                self.show(graph, part, position);
            }
            if !position.is_known {
                self.unknown.push(unknown_state(self.parts.node(part)));
            }
        }
    }

    fn show(&mut self, graph: &mut Arc<SceneGraph>, part: u32, position: PartPosition) {
        let MovingPartKind { motion, modelled, .. } = self.parts.kind(part);
        let share = match modelled {
            EndConfig::Closed => 1.0 - position.travelled,
            EndConfig::Open => position.travelled,
        };
        let pose = (share != 0.0).then(|| motion.transform_at(share as f32));
        // A copy where a reload looks at the graph just now.
        let moved = Arc::make_mut(graph).set_part_pose(self.parts.node(part), pose);
        let shown = self.shown.entry(part).or_insert(MovedPart { position, instances: Vec::new() });
        shown.position = position;
        if !moved.is_empty() {
            shown.instances.clone_from(&moved);
        }
        self.just_moved.extend(moved);
        for &instance in &shown.instances {
            match pose {
                Some(_) => self.moved.insert(instance),
                None => self.moved.remove(&instance),
            };
        }
    }

    /// Returns the parts that a position moves, by index.
    fn parts_of<'a>(&'a self, position: &'a SwitchPosition) -> impl Iterator<Item = u32> + 'a {
        self.parts.moved_by(position.node, &position.mechanism)
    }

    /// Instances that the last update moved.
    pub fn just_moved(&self) -> &[usize] {
        &self.just_moved
    }

    /// Instances that stand elsewhere than their models show them.
    pub fn moved(&self) -> &BTreeSet<usize> {
        &self.moved
    }
}

/// A state that rests on nothing: the host draws it as not known.
fn unknown_state(node: NodeIndex) -> NodeState {
    NodeState {
        node,
        basis: StateBasis::Record { is_valid: false },
        color: [0; 3],
        pattern: Pattern::Striped,
        legend: None,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use busbar_config::MovingPartConfig;
    use busbar_geometry::{RawPrimitive, weld};
    use busbar_scene::{Model, ModelIndex, ModelNode, Placement, Transform};
    use busbar_tags::{Moment, Sample, TagHandle, TagSet, TagSpec, TagTable};
    use busbar_types::{DoublePoint, Quality, Value, ValueKind};
    use glam::{DMat4, Vec3};

    use super::*;

    const TAG: TagHandle = TagHandle(0);

    /// Two poles of a switch, each with a blade along x.
    fn graph() -> Arc<SceneGraph> {
        let blade = RawPrimitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 0.1, 0.0)],
            triangles: vec![[0, 1, 2]],
            ..RawPrimitive::default()
        };
        let model = Model {
            meshes: vec![weld(&[blade]).unwrap().0],
            nodes: vec![ModelNode {
                name: "blade".into(),
                parent: None,
                parent_from_node: DMat4::IDENTITY,
                mesh: Some(0),
            }],
            ..Model::default()
        };
        let placement = |id: &str, parent: Option<usize>| Placement {
            id: id.into(),
            parent,
            transform: Transform::default(),
            model: parent.map(|_| ModelIndex(0)),
            theta: None,
        };
        let poles = [placement("Q", None), placement("Q-L1", Some(0)), placement("Q-L2", Some(0))];
        Arc::new(SceneGraph::build(&poles, &[model]).unwrap())
    }

    fn parts(graph: &SceneGraph) -> MovingParts {
        let config = MovingPartConfig {
            part: "blade".into(),
            mechanism: "blade".into(),
            modelled: EndConfig::Closed,
            pivot: [0.0; 3],
            axis: [0.0, 0.0, 1.0],
            degrees: 90.0,
            travel: [0.0; 3],
            scale: [1.0; 3],
            pointer: String::new(),
        };
        let poles = ["Q-L1/blade", "Q-L2/blade"].map(|pole| (graph.find(pole).unwrap(), 0));
        MovingParts::new(Arc::new(MovingPartTable::from_placed(graph, [&config], poles)))
    }

    /// A good value, so old.
    fn table(age: Duration) -> TagTable {
        let start = Moment::now();
        let spec = TagSpec {
            id: "a".into(),
            name: "a".into(),
            kind: ValueKind::DoublePoint,
            unit: String::new(),
            range: None,
            freshness: Duration::from_secs(1),
            scale: None,
            dead_band: 0.0,
            expression: None,
        };
        let mut table = TagTable::new(Arc::new(TagSet::new(vec![spec]).unwrap()), start);
        let value = Some(Value::DoublePoint(DoublePoint::On));
        let sample = Sample::live(TAG, value, Quality::Good, start);
        table.apply(&sample, |_| {});
        table.advance(start.after(age), |_| {});
        table
    }

    fn at(graph: &SceneGraph, id: &str, mechanism: &str, travelled: Option<f64>) -> SwitchPosition {
        let node = graph.find(id).unwrap();
        SwitchPosition { node, mechanism: mechanism.into(), tag: TAG, travelled }
    }

    /// Returns the tips of both blades.
    fn tips(graph: &SceneGraph) -> [Vec3; 2] {
        ["Q-L1/blade", "Q-L2/blade"].map(|id| {
            let world = graph.node(graph.find(id).unwrap()).world_from_node();
            world.transform_point3(Vec3::X)
        })
    }

    #[test]
    fn a_position_moves_the_parts_of_its_equipment_and_an_unchanged_one_updates_nothing() {
        let mut graph = graph();
        let mut parts = parts(&graph);
        let good = table(Duration::ZERO);
        let open = [at(&graph, "Q", "blade", Some(0.0))];
        assert!(parts.update(&mut graph, &open, good.snapshot()).is_empty());
        assert_eq!((parts.just_moved(), parts.moved().len()), (&[0, 1][..], 2));
        assert!(tips(&graph).iter().all(|tip| tip.distance(Vec3::Y) < 1e-6));
        parts.update(&mut graph, &open, good.snapshot());
        assert!(parts.just_moved().is_empty(), "nothing moves");

        let closed =
            [at(&graph, "Q-L1", "blade", Some(1.0)), at(&graph, "Q-L2", "blade", Some(0.0))];
        parts.update(&mut graph, &closed, good.snapshot());
        assert_eq!((parts.just_moved(), parts.moved().len()), (&[0][..], 1), "one pole alone");
        assert_eq!(tips(&graph)[0], Vec3::X);
    }

    #[test]
    fn an_unknown_position_is_drawn_in_the_middle_and_marked() {
        let mut graph = graph();
        let mut parts = parts(&graph);
        let (good, stale) = (table(Duration::ZERO), table(Duration::from_secs(2)));
        let other = [at(&graph, "Q", "earthing blade", Some(0.0))];
        assert!(parts.update(&mut graph, &other, good.snapshot()).is_empty(), "not this one");
        assert_eq!(tips(&graph), [Vec3::X; 2], "as modelled, as long as nobody tells");
        let half = Vec3::new(0.5_f32.sqrt(), 0.5_f32.sqrt(), 0.0);
        let closed = [at(&graph, "Q", "blade", Some(1.0))];
        let contradiction = [at(&graph, "Q", "blade", None)];
        let known = |parts: &mut MovingParts, graph: &mut Arc<SceneGraph>| {
            assert!(parts.update(graph, &closed, good.snapshot()).is_empty());
            assert_eq!(tips(graph), [Vec3::X; 2]);
        };
        for (positions, tags) in
            [(&closed[..], &stale), (&contradiction[..], &good), (&[][..], &good)]
        {
            known(&mut parts, &mut graph);
            let unknown = parts.update(&mut graph, positions, tags.snapshot());
            assert_eq!(unknown.len(), 2);
            assert!(
                unknown.iter().all(|state| state.basis == StateBasis::Record { is_valid: false })
            );
            assert!(tips(&graph).iter().all(|tip| tip.distance(half) < 1e-6));
        }
    }
}
