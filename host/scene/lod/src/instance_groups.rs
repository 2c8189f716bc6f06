//! Instance groups: subtrees that one proxy can stand for at a distance (HLOD).

use std::collections::HashMap;
use std::ops::Range;

use busbar_geometry::Bounds;
use busbar_scene::{MeshInstance, NodeIndex, SceneGraph};
use glam::{Mat4, Vec3};

/// The fewest mesh instances that are worth a group.
const MIN_INSTANCES: u32 = 16;
/// Least ratio of a group's instances to those of the greatest group within it. A smaller ratio
/// would stand for hardly more.
const MIN_GROWTH: u32 = 2;
/// Rounding tolerance between transforms of equal groups, as a share of their size and of their
/// axes.
const TOLERANCE: f32 = 1e-4;

/// A node with all that hangs under it.
#[derive(Clone, Debug, PartialEq)]
pub struct Group {
    /// The nodes, the one at the top first.
    pub nodes: Range<u32>,
    /// Range of their mesh instances in [`SceneGraph::instances`].
    pub instances: Range<u32>,
    /// Index of the first group after those within this one.
    pub after: u32,
    /// The box around it in the world.
    pub bounds: Bounds,
    /// Transform from the top node's space to the world.
    pub world_from_group: Mat4,
    /// Index of the first group with the same contents, in its own space.
    pub kind: u32,
}

/// Finds the groups of a scene whose instances are all allowed, outer groups before inner ones.
pub fn find_groups(graph: &SceneGraph, is_allowed: impl Fn(&MeshInstance) -> bool) -> Vec<Group> {
    let trees = Subtrees::new(graph, is_allowed);
    let mut groups: Vec<Group> = Vec::new();
    for (node, scene_node) in graph.nodes().enumerate() {
        if let (true, Some(bounds)) = (trees.is_group(node), scene_node.bounds()) {
            groups.push(Group {
                nodes: node as u32..trees.ends[node],
                instances: trees.instances[node].clone(),
                after: 0,
                bounds,
                world_from_group: scene_node.world_from_node(),
                kind: 0,
            });
        }
    }
    let starts: Vec<u32> = groups.iter().map(|group| group.instances.start).collect();
    for group in &mut groups {
        group.after = first_group_after(&starts, group.instances.end);
    }
    find_equal_groups(graph, &mut groups);
    groups
}

/// Returns the index of the first group that begins after some instances, of groups in order.
pub fn first_group_after(starts: &[u32], end: u32) -> u32 {
    starts.partition_point(|&start| start < end) as u32
}

/// Subtree measurements of each node.
struct Subtrees {
    /// The first node after those under it.
    ends: Vec<u32>,
    instances: Vec<Range<u32>>,
    usable: Vec<bool>,
    /// Instances of the greatest group under it.
    greatest: Vec<u32>,
}

impl Subtrees {
    fn new(graph: &SceneGraph, is_allowed: impl Fn(&MeshInstance) -> bool) -> Self {
        let count = graph.node_count();
        let mut trees = Self {
            ends: (1..=count as u32).collect(),
            instances: vec![0..0; count],
            usable: vec![true; count],
            greatest: vec![0; count],
        };
        let mut below = vec![1_u32; count];
        for (index, instance) in (0..).zip(graph.instances()) {
            let node = instance.node.0 as usize;
            trees.usable[node] &= is_allowed(&instance);
            trees.include(node, &(index..index + 1));
        }
        for node in (0..count).rev() {
            // Nodes of another tree stand between, or its instances.
            trees.usable[node] &= trees.ends[node] - node as u32 == below[node];
            let own = trees.is_group(node).then(|| trees.instances[node].len() as u32);
            let greatest = own.unwrap_or(trees.greatest[node]);
            if let Some(NodeIndex(parent)) = graph.node(NodeIndex(node as u32)).parent() {
                let parent = parent as usize;
                below[parent] += below[node];
                trees.ends[parent] = trees.ends[parent].max(trees.ends[node]);
                trees.usable[parent] &= trees.usable[node];
                trees.greatest[parent] = trees.greatest[parent].max(greatest);
                let instances = trees.instances[node].clone();
                trees.include(parent, &instances);
            }
        }
        trees
    }

    /// Instances come in the order of their nodes, so that a tree's are a range.
    fn include(&mut self, node: usize, more: &Range<u32>) {
        if more.is_empty() {
            return;
        }
        let own = &mut self.instances[node];
        *own = match own.end {
            0 => more.clone(),
            end => own.start.min(more.start)..end.max(more.end),
        };
    }

    fn is_group(&self, node: usize) -> bool {
        let count = self.instances[node].len() as u32;
        self.usable[node] && count >= MIN_INSTANCES.max(self.greatest[node] * MIN_GROWTH)
    }
}

/// Identity of a mesh instance apart from its transform.
type InstanceSignature = (u32, u32, u32, Option<u32>, Option<u32>);

/// Finds groups with the same contents.
fn find_equal_groups(graph: &SceneGraph, groups: &mut [Group]) {
    let mut kinds: HashMap<Vec<InstanceSignature>, Vec<u32>> = HashMap::new();
    for index in 0..groups.len() {
        let group = &groups[index];
        let signatures = instances_of(graph, group).map(|instance| signature(group, &instance));
        let alike = kinds.entry(signatures.collect()).or_default();
        let same = |kind: &&u32| has_same_layout(graph, &groups[**kind as usize], group);
        let kind = alike.iter().find(same).copied();
        if kind.is_none() {
            alike.push(index as u32);
        }
        groups[index].kind = kind.unwrap_or(index as u32);
    }
}

fn instances_of(graph: &SceneGraph, group: &Group) -> impl Iterator<Item = MeshInstance> {
    group.instances.clone().map(|index| graph.instance(index as usize))
}

fn signature(group: &Group, instance: &MeshInstance) -> InstanceSignature {
    let relative = |node: NodeIndex| node.0 - group.nodes.start;
    (
        instance.model.0,
        instance.mesh,
        relative(instance.node),
        instance.first_feature.map(relative),
        instance.theta.map(|policy| policy.0),
    )
}

/// Reports whether instances of the same meshes have the same layout as well.
fn has_same_layout(graph: &SceneGraph, a: &Group, b: &Group) -> bool {
    if a.nodes.len() != b.nodes.len() {
        return false;
    }
    let within = |group: &Group| group.world_from_group.inverse();
    let (in_a, in_b) = (within(a), within(b));
    let size = a.bounds.radius().max(1.0);
    let mut pairs = instances_of(graph, a).zip(instances_of(graph, b));
    pairs.all(|(first, second)| {
        let (first, second) =
            (in_a * graph.world_from_mesh(&first), in_b * graph.world_from_mesh(&second));
        let shift: Vec3 = (first.w_axis - second.w_axis).truncate();
        let axes = [
            first.x_axis - second.x_axis,
            first.y_axis - second.y_axis,
            first.z_axis - second.z_axis,
        ];
        shift.length() <= TOLERANCE * size
            && axes.iter().all(|axis| axis.length() <= TOLERANCE * first.x_axis.length().max(1.0))
    })
}
