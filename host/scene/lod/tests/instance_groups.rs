//! Instance groups of a yard of bays.

use busbar_geometry::{Mesh, RawPrimitive, weld};
use busbar_lod::{Group, find_groups};
use busbar_scene::{
    Model, ModelIndex, ModelNode, NodeIndex, Placement, PolicyIndex, SceneGraph, Transform,
};
use glam::{DMat4, Vec3};

const PIECES: usize = 10;

fn triangle() -> Mesh {
    let primitive = RawPrimitive {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    };
    weld(&[primitive]).expect("a triangle welds").0
}

fn model() -> Model {
    let node = ModelNode {
        name: "mesh".into(),
        parent: None,
        parent_from_node: DMat4::IDENTITY,
        mesh: Some(0),
    };
    Model { meshes: vec![triangle()], nodes: vec![node], ..Default::default() }
}

/// Adds a node; its index.
fn add(to: &mut Vec<Placement>, parent: Option<usize>, at: Vec3, turn: f32, shows: bool) -> usize {
    to.push(Placement {
        id: format!("n{}", to.len()),
        parent,
        transform: Transform {
            translation: at.as_dvec3(),
            rotation_degrees: Vec3::Y * turn,
            ..Default::default()
        },
        model: shows.then_some(ModelIndex(0)),
        theta: None,
    });
    to.len() - 1
}

/// A station of two bays with ten pieces each, all at their places, turned as one.
fn station(to: &mut Vec<Placement>, at: Vec3, turn: f32) -> usize {
    let top = add(to, None, at, turn, false);
    for bay in 0..2 {
        let bay = add(to, Some(top), Vec3::X * bay as f32 * 30.0, 0.0, false);
        for piece in 0..PIECES {
            add(to, Some(bay), Vec3::Z * piece as f32 * 3.0, piece as f32 * 10.0, true);
        }
    }
    top
}

fn groups(placements: &[Placement]) -> (SceneGraph, Vec<Group>) {
    let graph = SceneGraph::build(placements, &[model()]).expect("a scene");
    let groups = find_groups(&graph, |instance| instance.theta.is_none());
    (graph, groups)
}

#[test]
fn stations_are_groups_and_alike_wherever_they_stand() {
    let mut placements = Vec::new();
    station(&mut placements, Vec3::ZERO, 0.0);
    station(&mut placements, Vec3::new(2000.0, 0.0, -1500.0), 33.0);
    let other = station(&mut placements, Vec3::X * 400.0, 0.0);
    // Of the third, a piece stands elsewhere.
    placements[other + 5].transform.translation.y += 0.1;
    let (graph, groups) = groups(&placements);
    assert_eq!(groups.len(), 3, "a bay is too small");
    let kinds: Vec<u32> = groups.iter().map(|group| group.kind).collect();
    assert_eq!(kinds, [0, 0, 2]);
    for (group, number) in groups.iter().zip(0..) {
        let count = 2 * PIECES as u32;
        assert_eq!(group.instances, number * count..(number + 1) * count);
        assert_eq!(graph.node(NodeIndex(group.nodes.start)).parent(), None);
        assert_eq!(group.after, number + 1);
        assert!(
            group
                .instances
                .clone()
                .all(|index| { group.nodes.contains(&graph.instance(index as usize).node.0) })
        );
    }
}

#[test]
fn groups_within_groups_come_after_them() {
    let mut placements = Vec::new();
    let region = add(&mut placements, None, Vec3::ZERO, 0.0, false);
    for number in 0..3 {
        let top = station(&mut placements, Vec3::X * number as f32 * 500.0, 0.0);
        placements[top].parent = Some(region);
    }
    let (_, groups) = groups(&placements);
    let found: Vec<_> = groups.iter().map(|g| (g.instances.clone(), g.after)).collect();
    assert_eq!(found, [(0..60, 4), (0..20, 2), (20..40, 3), (40..60, 4)]);
}

#[test]
fn what_has_a_policy_of_its_own_is_in_no_group() {
    let mut placements = Vec::new();
    let region = add(&mut placements, None, Vec3::ZERO, 0.0, false);
    for number in 0..2 {
        let top = station(&mut placements, Vec3::X * number as f32 * 500.0, 0.0);
        placements[top].parent = Some(region);
    }
    placements.last_mut().expect("the last piece").theta = Some(PolicyIndex(0));
    let (_, groups) = groups(&placements);
    let found: Vec<_> = groups.iter().map(|g| (g.instances.start, g.instances.end)).collect();
    assert_eq!(found, [(0, 20)]);
}

#[test]
fn a_tree_whose_nodes_lie_apart_is_no_group() {
    let mut placements = Vec::new();
    let (first, second) = (
        add(&mut placements, None, Vec3::ZERO, 0.0, false),
        add(&mut placements, None, Vec3::X, 0.0, false),
    );
    for piece in 0..40 {
        let parent = if piece % 2 == 0 { first } else { second };
        add(&mut placements, Some(parent), Vec3::Z * piece as f32, 0.0, true);
    }
    assert_eq!(groups(&placements).1, []);
}
