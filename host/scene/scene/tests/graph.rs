//! Placements, nodes of models and features as one graph.

#![allow(clippy::unwrap_used)]

use std::slice::from_ref;

use busbar_geometry::{Bounds, RawPrimitive, weld};
use busbar_scene::{
    Model, ModelIndex, ModelNode, Placement, PolicyIndex, SceneError, SceneGraph, Transform,
};
use glam::{DMat4, DVec3, Mat4, Vec3};

fn model() -> Model {
    let primitive = RawPrimitive {
        positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
        triangles: vec![[0, 1, 2]],
        ..Default::default()
    };
    let node = |name: &str, parent, mesh| ModelNode {
        name: name.into(),
        parent,
        parent_from_node: DMat4::from_translation(DVec3::Z),
        mesh,
    };
    Model {
        meshes: vec![weld(&[primitive]).unwrap().0],
        nodes: vec![node("tank", None, None), node("bushing", Some(0), Some(0))],
        ..Default::default()
    }
}

fn placement(id: &str, parent: Option<usize>, x: f32) -> Placement {
    let transform = Transform { translation: DVec3::X * f64::from(x), ..Default::default() };
    Placement { id: id.into(), parent, transform, model: Some(ModelIndex(0)), theta: None }
}

#[test]
fn model_nodes_hang_under_their_placement() {
    let placements = [placement("T1", None, 10.0), placement("T2", Some(0), 5.0)];
    let graph = SceneGraph::build(&placements, &[model()]).unwrap();
    assert_eq!(graph.instances().len(), 2);
    let bushing = graph.find("T2/bushing").unwrap();
    let world = graph.node(bushing).world_from_node().transform_point3(Vec3::ZERO);
    assert_eq!(world, Vec3::new(15.0, 0.0, 2.0));
    let all = graph.bounds().unwrap();
    assert_eq!((all.min.x, all.max.x), (10.0, 16.0));
    let world = graph.bounds_of_mesh(&graph.instance(1)).unwrap();
    assert_eq!((world.min, world.max), (Vec3::new(15.0, 0.0, 2.0), Vec3::new(16.0, 1.0, 2.0)));
    let placed = ["T1", "T2"].map(|id| graph.node(graph.find(id).unwrap()).bounds().unwrap());
    assert_eq!(placed, [all, world], "with what hangs under it");
}

#[test]
fn pieces_of_a_mesh_take_its_place() {
    let whole = placement("T2", None, 20.0);
    let other = Placement { model: Some(ModelIndex(1)), ..whole };
    let placements = [placement("T1", None, 10.0), other, placement("T3", None, 30.0)];
    let mut graph = SceneGraph::build(&placements, &[model(), model()]).unwrap();
    let piece = |y: f32| Some(Bounds { min: Vec3::Y * y, max: Vec3::Y * (y + 1.0) });
    let pieces = 0..2;
    graph.split_meshes(ModelIndex(0), from_ref(&pieces), &[piece(0.0), piece(5.0)]);
    let shown = graph.instances().map(|instance| {
        let bounds = graph.bounds_of_mesh(&instance).unwrap();
        (instance.model.0, instance.mesh, [bounds.min.x, bounds.min.y])
    });
    let expected = [
        (0, 0, [10.0, 0.0]),
        (0, 1, [10.0, 5.0]),
        (1, 0, [20.0, 0.0]),
        (0, 0, [30.0, 0.0]),
        (0, 1, [30.0, 5.0]),
    ];
    assert!(shown.eq(expected));
    assert_eq!(
        graph.set_part_pose(graph.find("T3/bushing").unwrap(), Some(Mat4::IDENTITY)),
        [3, 4]
    );
}

#[test]
fn a_part_that_moves_takes_along_what_hangs_under_it() {
    let placements = [placement("T1", None, 10.0), placement("T2", None, 20.0)];
    let mut graph = SceneGraph::build(&placements, &[model()]).unwrap();
    let boxes = |graph: &SceneGraph| -> Vec<_> {
        graph.instances().map(|instance| graph.bounds_of_mesh(&instance).unwrap()).collect()
    };
    let as_modelled = boxes(&graph);
    let [tank, bushing] = ["T2/tank", "T2/bushing"].map(|id| graph.find(id).unwrap());
    let origin =
        |graph: &SceneGraph, node| graph.node(node).world_from_node().transform_point3(Vec3::ZERO);
    // Of the tank by a turn that takes z to x, of the bushing by a shift within that.
    let turn = Mat4::from_rotation_y(90.0_f32.to_radians());
    assert_eq!(graph.set_part_pose(tank, Some(turn)), [1]);
    assert!(origin(&graph, bushing).distance(Vec3::new(21.0, 0.0, 1.0)) < 1e-5);
    assert_eq!(graph.set_part_pose(bushing, Some(Mat4::from_translation(Vec3::Z))), [1]);
    assert!(origin(&graph, bushing).distance(Vec3::new(22.0, 0.0, 1.0)) < 1e-5);
    let bounds = boxes(&graph)[1];
    let (min, max) = (Vec3::new(22.0, 0.0, 0.0), Vec3::new(22.0, 1.0, 1.0));
    assert!(bounds.min.distance(min) < 1e-5 && bounds.max.distance(max) < 1e-5, "{bounds:?}");
    assert_eq!(boxes(&graph)[0], as_modelled[0], "another placement of the model");

    assert_eq!(
        graph.set_part_pose(bushing, Some(Mat4::from_translation(Vec3::Z))),
        [],
        "it is there"
    );
    assert_eq!(graph.set_part_pose(graph.find("T2").unwrap(), Some(turn)), [], "no part");
    assert_eq!(graph.set_part_pose(tank, None), [1]);
    assert_eq!(graph.set_part_pose(bushing, None), [1]);
    assert_eq!(boxes(&graph), as_modelled);
}

#[test]
fn a_placement_may_have_a_policy_of_its_own() {
    let mut placements = [placement("T1", None, 0.0), placement("T2", None, 5.0)];
    placements[1].theta = Some(PolicyIndex(7));
    let graph = SceneGraph::build(&placements, &[model()]).unwrap();
    let thetas: Vec<_> = graph.instances().map(|i| i.theta).collect();
    assert_eq!(thetas, [None, Some(PolicyIndex(7))]);
}

#[test]
fn an_id_used_twice_is_refused() {
    let placements = [placement("T1", None, 0.0), placement("T1", None, 1.0)];
    let error = SceneGraph::build(&placements, &[model()]).unwrap_err();
    let id = "T1".into();
    let expected = SceneError::DuplicateId { id, first_parent: None, second_parent: None };
    assert_eq!(error, expected);
}

/// A mesh of two triangles, at x = 0..1 and x = 4..5: the features 0 and 1.
fn model_with_features(names: [&str; 2], nodes: &[&str]) -> Model {
    let at = [0.0, 4.0];
    let primitive = RawPrimitive {
        positions: at
            .iter()
            .flat_map(|&x| [Vec3::ZERO, Vec3::X, Vec3::Y].map(|p| p + Vec3::X * x))
            .collect(),
        features: vec![0, 0, 0, 1, 1, 1],
        triangles: vec![[0, 1, 2], [3, 4, 5]],
        ..Default::default()
    };
    let node = |name: &&str| ModelNode {
        name: (*name).into(),
        parent: None,
        parent_from_node: DMat4::from_translation(DVec3::Y),
        mesh: Some(0),
    };
    Model {
        meshes: vec![weld(&[primitive]).unwrap().0],
        features: vec![names.map(String::from).to_vec()],
        nodes: nodes.iter().map(node).collect(),
        ..Default::default()
    }
}

fn ids(graph: &SceneGraph) -> Vec<String> {
    graph.nodes().map(|node| node.id()).collect()
}

#[test]
fn features_are_nodes_under_their_mesh_with_boxes_of_their_own() {
    let model = model_with_features(["QA1", "QB9"], &["body"]);
    let graph = SceneGraph::build(&[placement("S", None, 10.0)], &[model]).unwrap();
    assert_eq!(ids(&graph), ["S", "S/body", "S/QA1", "S/QB9"]);
    let first = graph.instance(0).first_feature;
    assert_eq!(first, graph.find("S/QA1"));
    for (id, from) in [("S/QA1", 10.0), ("S/QB9", 14.0), ("S/body", 10.0)] {
        let node = graph.node(graph.find(id).unwrap());
        let bounds = node.bounds().unwrap();
        let to = if id == "S/body" { 15.0 } else { from + 1.0 };
        assert_eq!([bounds.min.x, bounds.max.x, bounds.min.y], [from, to, 1.0], "{id}");
    }
    let parent = graph.node(graph.find("S/QB9").unwrap()).parent();
    assert_eq!(parent, graph.find("S/body"));
}

#[test]
fn features_that_would_share_an_id_are_called_after_their_node_too() {
    let check = |model: Model, expected: &[&str]| {
        let graph = SceneGraph::build(&[placement("S", None, 0.0)], &[model]).unwrap();
        assert_eq!(ids(&graph), expected);
        for instance in graph.instances() {
            let first = graph.node(instance.first_feature.unwrap());
            assert_eq!(first.parent(), Some(instance.node));
        }
    };
    check(
        model_with_features(["a", "b"], &["left", "right"]),
        &["S", "S/left", "S/left/a", "S/left/b", "S/right", "S/right/a", "S/right/b"],
    );
    check(
        model_with_features(["a", "body"], &["body"]),
        &["S", "S/body", "S/body/a", "S/body/body"],
    );
    // Exporters make a mesh a material: the same names in each.
    let mut two = model_with_features(["a", "b"], &["steel", "paint"]);
    two.meshes.push(two.meshes[0].clone());
    two.features.push(vec!["b".into(), "c".into()]);
    two.nodes[1].mesh = Some(1);
    check(two, &["S", "S/steel", "S/steel/a", "S/steel/b", "S/paint", "S/paint/b", "S/paint/c"]);
}

#[test]
fn a_placement_that_is_called_like_a_feature_is_refused() {
    let placements = [placement("S", None, 0.0), placement("S/QA1", None, 0.0)];
    let model = model_with_features(["QA1", "QB9"], &["body"]);
    let error = SceneGraph::build(&placements, &[model]).unwrap_err();
    assert_eq!(error, SceneError::SlashInId { id: "S/QA1".into() });
}

#[test]
fn parts_of_one_name_are_both_named() {
    let mut model = model();
    model.nodes[1].name = "tank".into();
    let error = SceneGraph::build(&[placement("T", None, 0.0)], &[model]).unwrap_err();
    let expected = "equipment id 'T/tank' is used twice: under 'T' and under 'T/tank'";
    assert_eq!(error.to_string(), expected);
}

#[test]
fn rotations_apply_about_x_then_y_then_z() {
    let transform =
        Transform { rotation_degrees: Vec3::new(90.0, 0.0, 90.0), ..Default::default() };
    let turned = transform.matrix().transform_vector3(DVec3::Y);
    assert!((turned - DVec3::Z).length() < 1e-6, "y -> z about x; z stays about z");
}
