//! Skinned meshes as their joints stand in the file, and morph targets at the weights of nodes.

#![allow(clippy::unwrap_used)]

mod common;

use busbar_gltf_import::ImportedModel;
use common::{Builder, SQUARE, floats, push, shorts};
use glam::{DMat4, DQuat, DVec3, Vec3};
use serde_json::{Value, json};

/// A matrix by columns, as glTF writes it.
type Columns = [[f64; 4]; 4];

/// Multiplies matrices, element by element.
fn product(a: Columns, b: Columns) -> Columns {
    std::array::from_fn(|column| {
        std::array::from_fn(|row| (0..4).map(|k| a[k][row] * b[column][k]).sum())
    })
}

fn apply(matrix: Columns, point: [f64; 3]) -> [f64; 3] {
    let point = [point[0], point[1], point[2], 1.0];
    std::array::from_fn(|row| (0..4).map(|k| matrix[k][row] * point[k]).sum())
}

/// Makes the matrix of a turn about an axis (0 for x), a scale and a translation.
fn placed(axis: usize, degrees: f64, scale: f64, translation: [f64; 3]) -> Columns {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let mut matrix = [[0.0; 4]; 4];
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    matrix[axis][axis] = scale;
    matrix[next][next] = cos * scale;
    matrix[next][last] = sin * scale;
    matrix[last][next] = -sin * scale;
    matrix[last][last] = cos * scale;
    matrix[3] = [translation[0], translation[1], translation[2], 1.0];
    matrix
}

fn flat(matrix: Columns) -> Vec<f64> {
    matrix.concat()
}

/// Skin of the square: two joints under a common root, in this order among the nodes: mesh, root,
/// first joint, second joint.
struct Skinned {
    builder: Builder,
    node: Columns,
    root: Columns,
    joints: [Columns; 2],
    inverse_binds: [Columns; 2],
}

impl Skinned {
    fn new() -> Self {
        let mut builder = Builder::square();
        let inverse_binds =
            [placed(2, -20.0, 0.5, [0.1, 0.2, 0.3]), placed(1, 35.0, 2.0, [-1.0, 0.0, 0.5])];
        let root = placed(0, 90.0, 1.0, [0.0, 0.0, 7.0]);
        let joints =
            [placed(2, 30.0, 2.0, [1.0, 2.0, 3.0]), placed(0, -70.0, 1.5, [-4.0, 0.5, 0.0])];
        let matrices =
            inverse_binds.concat().concat().iter().map(|&v| v as f32).collect::<Vec<_>>();
        let matrices = builder.accessor(&floats(&matrices), 5126, "MAT4", 2);
        builder.json["skins"] =
            json!([{ "joints": [2, 3], "inverseBindMatrices": matrices, "skeleton": 77 }]);
        let node = placed(1, 50.0, 3.0, [10.0, -20.0, 30.0]);
        let mut skinned = Self { builder, node, root, joints, inverse_binds };
        skinned.influences(&[[0, 1, 0, 0]; 4], &WEIGHTS);
        skinned.place();
        skinned
    }

    /// Writes the nodes into the document.
    fn place(&mut self) {
        self.builder.json["nodes"] = json!([
            { "name": "tank", "mesh": 0, "skin": 0, "matrix": flat(self.node) },
            { "children": [2], "matrix": flat(self.root) },
            { "children": [3], "matrix": flat(self.joints[0]) },
            { "matrix": flat(self.joints[1]) },
        ]);
        self.builder.json["scenes"] = json!([{ "nodes": [0, 1] }]);
    }

    fn influences(&mut self, joints: &[[u8; 4]], weights: &[[f32; 4]]) {
        let joints = self.builder.accessor(&joints.concat(), 5121, "VEC4", 4);
        let weights = self.builder.accessor(&floats(&weights.concat()), 5126, "VEC4", 4);
        self.set("JOINTS_0", joints);
        self.set("WEIGHTS_0", weights);
    }

    fn set(&mut self, attribute: &str, accessor: usize) {
        self.builder.primitive()["attributes"][attribute] = json!(accessor);
    }

    /// Returns where a point is shown by the weights of the two joints.
    fn expected(&self, point: [f64; 3], weights: [f64; 2]) -> [f64; 3] {
        let joints = [
            product(self.root, self.joints[0]),
            product(product(self.root, self.joints[0]), self.joints[1]),
        ];
        let total = weights[0] + weights[1];
        let mut sum = [0.0; 3];
        for joint in 0..2 {
            let moved = apply(product(joints[joint], self.inverse_binds[joint]), point);
            for (sum, moved) in sum.iter_mut().zip(moved) {
                *sum += weights[joint] / total * moved;
            }
        }
        sum
    }

    /// Checks that the corners of the square are shown by these weights; returns the remarks.
    fn check(&self, weights: [[f64; 2]; 4]) -> Vec<String> {
        let imported = self.builder.import();
        let shown = shown_points(&imported, 0);
        assert_eq!(shown.len(), 4);
        for (corner, weights) in weights.into_iter().enumerate() {
            let expected = DVec3::from_array(self.expected(corner_of_square(corner), weights));
            // Mirrored triangles are turned round, which changes the order of the points.
            let nearest = shown.iter().map(|shown| shown.distance(expected)).min_by(f64::total_cmp);
            assert!(nearest < Some(1e-4), "{corner}: none of {shown:?} is {expected}");
        }
        imported.report.notes
    }
}

/// Weights of the two joints, whose sum is one.
const WEIGHTS: [[f32; 4]; 4] =
    [[1., 0., 0., 0.], [0.25, 0.75, 0., 0.], [0.5, 0.5, 0., 0.], [0., 1., 0., 0.]];
const BOTH: [[f64; 2]; 4] = [[1., 0.], [0.25, 0.75], [0.5, 0.5], [0., 1.]];

fn corner_of_square(corner: usize) -> [f64; 3] {
    std::array::from_fn(|axis| SQUARE[3 * corner + axis].into())
}

/// Points of a node's mesh in the space of the model.
fn shown_points(imported: &ImportedModel, node: usize) -> Vec<DVec3> {
    let nodes = &imported.model.nodes;
    let mut model_from_node = nodes[node].parent_from_node;
    let mut parent = nodes[node].parent;
    while let Some(above) = parent {
        model_from_node = nodes[above as usize].parent_from_node * model_from_node;
        parent = nodes[above as usize].parent;
    }
    let mesh = &imported.model.meshes[nodes[node].mesh.unwrap() as usize];
    mesh.positions.iter().map(|point| model_from_node.transform_point3(point.as_dvec3())).collect()
}

/// Checks that all normals are unit vectors which look where the corners of triangles run
/// counter-clockwise around them.
fn check_normals(imported: &ImportedModel) {
    let mesh = &imported.model.meshes[0];
    for triangle in &mesh.triangles {
        let [a, b, c] =
            triangle.map(|w| mesh.positions[mesh.wedges.position[w as usize] as usize].as_dvec3());
        let face = (b - a).cross(c - a).normalize();
        for wedge in *triangle {
            let normal = mesh.wedges.normal[wedge as usize].as_dvec3();
            assert!((normal.length() - 1.0).abs() < 1e-5, "{normal}");
            assert!(normal.dot(face) > 0.0, "{normal} beside {face}");
        }
    }
}

fn count(notes: &[String], expected: &str) -> usize {
    let note = notes.iter().find(|note| note.contains(expected));
    let note = note.unwrap_or_else(|| panic!("{expected}: {notes:?}"));
    note.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn skinned_meshes_stand_as_their_joints_do() {
    let skinned = Skinned::new();
    assert!(skinned.check(BOTH).is_empty());
}

#[test]
fn transforms_of_skinned_nodes_themselves_are_ignored() {
    let mut skinned = Skinned::new();
    for node in [
        placed(0, 0.0, 1.0, [0.0; 3]),
        placed(0, 10.0, -1.0, [5.0, 5.0, 5.0]),
        placed(2, 200.0, 1e-3, [900.0, 0.0, 0.0]),
    ] {
        skinned.node = node;
        skinned.place();
        assert!(skinned.check(BOTH).is_empty());
        let imported = skinned.builder.import();
        let name = imported.model.nodes.iter().find(|node| node.mesh.is_some()).unwrap();
        assert_eq!(name.name, "tank");
    }
}

#[test]
fn flat_and_far_nodes_show_skinned_meshes_by_a_node_of_their_own() {
    // A transform that nothing undoes, and one where single precision is a quarter of a metre.
    for (node, parent) in [
        (placed(0, 0.0, 0.0, [1.0, 2.0, 3.0]), None),
        (placed(2, 200.0, 1e-3, [2.6e6, 0.0, -1.2e6]), Some(0)),
    ] {
        let mut skinned = Skinned::new();
        skinned.node = node;
        skinned.place();
        let imported = skinned.builder.import();
        let last = imported.model.nodes.len() - 1;
        let added = &imported.model.nodes[last];
        assert_eq!((added.name.as_str(), added.parent), ("tank[skin]", parent));
        assert!(imported.model.nodes[0].mesh.is_none());
        for (corner, shown) in shown_points(&imported, last).iter().enumerate() {
            let expected = skinned.expected(corner_of_square(corner), BOTH[corner]);
            assert!(DVec3::from_array(expected).distance(*shown) < 1e-4);
        }
        assert_eq!(count(&imported.report.notes, "by a node of its own"), 1);
    }
}

#[test]
fn normals_turn_with_the_joints() {
    let mut skinned = Skinned::new();
    let normals = skinned.builder.accessor(&floats(&[0., 0., 1.].repeat(4)), 5126, "VEC3", 4);
    skinned.set("NORMAL", normals);
    // One joint, stretched and mirrored along an axis: the surface is not turned inside out.
    for stretch in [3.0, -3.0] {
        skinned.influences(&[[0, 0, 0, 0]; 4], &[[1., 0., 0., 0.]; 4]);
        skinned.joints[0] = placed(2, 30.0, 1.0, [0.0; 3]);
        for row in &mut skinned.joints[0][2] {
            *row *= stretch;
        }
        skinned.inverse_binds[0] = placed(0, 40.0, 1.0, [0.0; 3]);
        let matrices = skinned.inverse_binds.concat().concat();
        let matrices = matrices.iter().map(|&v| v as f32).collect::<Vec<_>>();
        let matrices = skinned.builder.accessor(&floats(&matrices), 5126, "MAT4", 2);
        skinned.builder.json["skins"][0]["inverseBindMatrices"] = json!(matrices);
        skinned.place();
        skinned.check([[1.0, 0.0]; 4]);
        check_normals(&skinned.builder.import());
    }
}

#[test]
fn inverse_bind_matrices_that_are_missing_are_identities() {
    let mut skinned = Skinned::new();
    skinned.inverse_binds = [placed(0, 0.0, 1.0, [0.0; 3]); 2];
    let skin = &mut skinned.builder.json["skins"][0];
    skin.as_object_mut().unwrap().remove("inverseBindMatrices");
    assert!(skinned.check(BOTH).is_empty());
    // Positions of the square are no matrices, and there is no accessor 99.
    for accessor in [0, 99] {
        skinned.builder.json["skins"][0]["inverseBindMatrices"] = json!(accessor);
        assert_eq!(count(&skinned.check(BOTH), "identities are used"), 1);
    }
}

#[test]
fn weights_of_every_component_type_and_further_sets_count() {
    let mut skinned = Skinned::new();
    let thirds = [[85, 170, 0, 0_u8]; 4];
    let mut weights = skinned.builder.accessor(&thirds.concat(), 5121, "VEC4", 4);
    for normalized in [true, false] {
        skinned.builder.json["accessors"][weights]["normalized"] = json!(normalized);
        skinned.set("WEIGHTS_0", weights);
        assert!(skinned.check([[85.0, 170.0]; 4]).is_empty());
    }
    weights = skinned.builder.accessor(&shorts(&[13107, 52428, 0, 0].repeat(4)), 5123, "VEC4", 4);
    let joints = skinned.builder.accessor(&shorts(&[0, 1, 0, 0].repeat(4)), 5123, "VEC4", 4);
    skinned.builder.json["accessors"][weights]["normalized"] = json!(true);
    skinned.set("WEIGHTS_0", weights);
    skinned.set("JOINTS_0", joints);
    assert!(skinned.check([[0.2, 0.8]; 4]).is_empty());
    // Two sets: a quarter and a half of each.
    skinned.influences(&[[0, 0, 0, 1]; 4], &[[0.125, 0.125, 0.0, 0.25]; 4]);
    let joints = skinned.builder.accessor(&[1, 9, 9, 9].repeat(4), 5121, "VEC4", 4);
    let weights = skinned.builder.accessor(&floats(&[0.5, 0., 0., 0.].repeat(4)), 5126, "VEC4", 4);
    skinned.set("JOINTS_1", joints);
    skinned.set("WEIGHTS_1", weights);
    assert!(skinned.check([[0.25, 0.75]; 4]).is_empty());
}

#[test]
fn odd_weights_and_joints_are_remarked_on() {
    let mut skinned = Skinned::new();
    // Of another sum than one, none at all, of a joint that does not exist, and no numbers.
    let weights = [
        [0.5, 1.5, 0., 0.],
        [0., 0., 0., 0.],
        [0.25, 0.25, 0.5, 0.],
        [f32::NAN, -1.0, 0.0, f32::INFINITY],
    ];
    skinned.influences(&[[0, 1, 9, 0], [1, 0, 0, 0], [0, 1, 200, 0], [1, 0, 0, 0]], &weights);
    let notes = skinned.check([[0.5, 1.5], [0.0, 1.0], [1.0, 1.0], [0.0, 1.0]]);
    assert_eq!(notes.len(), 3, "{notes:?}");
    assert_eq!(count(&notes, "weights were normalised"), 1);
    assert_eq!(count(&notes, "follows its first joint"), 2);
    assert_eq!(count(&notes, "no such joint"), 1);
}

#[test]
fn skins_that_cannot_be_read_leave_the_mesh_as_modelled() {
    let change = |change: &dyn Fn(&mut Skinned)| {
        let mut skinned = Skinned::new();
        change(&mut skinned);
        let imported = skinned.builder.import();
        for (corner, shown) in shown_points(&imported, 0).iter().enumerate() {
            let expected = DVec3::from_array(apply(skinned.node, corner_of_square(corner)));
            assert!(expected.distance(*shown) < 1e-4, "{corner}: {shown} for {expected}");
        }
        let notes = imported.report.notes.join("; ");
        assert!(notes.contains("shown as modelled"), "{notes}");
    };
    change(&|of| of.builder.json["skins"][0]["joints"] = json!([2, 99]));
    change(&|of| of.builder.json["skins"][0]["joints"] = json!(["arm"]));
    change(&|of| of.builder.json["skins"] = json!(7));
    change(&|of| of.builder.json["skins"] = json!([]));
    change(&|of| of.builder.json["nodes"][0]["skin"] = json!("arm"));
    change(&|of| of.builder.json["nodes"][0]["skin"] = json!(3));
    change(&|of| of.set("JOINTS_0", 1));
    change(&|of| of.set("WEIGHTS_0", 99));
    change(&|of| {
        let short = of.builder.accessor(&[0; 12], 5121, "VEC4", 3);
        of.set("JOINTS_0", short);
    });
    change(&|of| {
        // Joints that lead back to themselves, outside the scene.
        of.builder.json["scenes"] = json!([{ "nodes": [0] }]);
        of.builder.json["nodes"][3]["children"] = json!([1]);
    });
    change(&|of| {
        of.builder.json["nodes"] = json!([
            { "mesh": 0, "skin": 0, "matrix": flat(of.node) }, {}, { "translation": [1, 2] }, {},
        ])
    });
}

#[test]
fn joints_may_stand_outside_the_scene_and_after_their_mesh() {
    let mut skinned = Skinned::new();
    skinned.builder.json["scenes"] = json!([{ "nodes": [0] }]);
    let notes = skinned.check(BOTH);
    assert_eq!(count(&notes, "node skipped"), 3);
    skinned.builder.json["scenes"] = json!([{ "nodes": [1, 0] }]);
    let imported = skinned.builder.import();
    assert_eq!(imported.model.nodes[3].name, "tank");
    for (corner, shown) in shown_points(&imported, 3).iter().enumerate() {
        let expected = skinned.expected(corner_of_square(corner), BOTH[corner]);
        assert!(DVec3::from_array(expected).distance(*shown) < 1e-4);
    }
}

#[test]
fn nodes_of_one_mesh_have_poses_of_their_own() {
    let mut skinned = Skinned::new();
    push(&mut skinned.builder.json["nodes"], json!({ "name": "bare", "mesh": 0 }));
    push(&mut skinned.builder.json["nodes"], json!({ "name": "other", "mesh": 0, "skin": 1 }));
    push(&mut skinned.builder.json["skins"], json!({ "joints": [1] }));
    skinned.builder.json["scenes"] = json!([{ "nodes": [0, 1, 4, 5] }]);
    let imported = skinned.builder.import();
    skinned.check(BOTH);
    assert_eq!(imported.model.meshes.len(), 3);
    let points = |node| shown_points(&imported, node);
    for corner in 0..4 {
        let point = corner_of_square(corner);
        assert!(points(4)[corner].distance(DVec3::from_array(point)) < 1e-6);
        // The second joint of the vertices is none of this skin.
        let expected = DVec3::from_array(apply(skinned.root, point));
        assert!(points(5)[corner].distance(expected) < 1e-4);
    }
}

/// Poses of many nodes: one skin is read once, and what is beyond the bound is shown as modelled.
#[test]
fn poses_beyond_their_bound_are_shown_as_modelled() {
    const NODES: usize = 40_000;
    let mut skinned = Skinned::new();
    let nodes = skinned.builder.json["nodes"].as_array_mut().unwrap();
    let first = nodes.len();
    nodes.extend((0..NODES).map(|_| json!({ "mesh": 0, "skin": 0 })));
    let shown: Vec<usize> = [0, 1].into_iter().chain(first..first + NODES).collect();
    skinned.builder.json["scenes"] = json!([{ "nodes": shown }]);
    let imported = skinned.builder.import();
    let left = count(&imported.report.notes, "mesh shown as modelled: too many nodes");
    let posed = NODES + 1 - left;
    assert!((20_000..NODES).contains(&posed), "{posed}: {:?}", imported.report.notes);
    assert!(imported.report.notes.len() < 10, "{:?}", imported.report.notes);
}

/// The square with two morph targets, up and to the right, and nodes with these weights.
fn morphed(nodes: &[Value], mesh: &Value) -> ImportedModel {
    let mut builder = Builder::square();
    let up = builder.accessor(&floats(&[0., 0., 2.].repeat(4)), 5126, "VEC3", 4);
    let right = builder.accessor(&floats(&[4., 0., 0.].repeat(4)), 5126, "VEC3", 4);
    builder.primitive()["targets"] = json!([{ "POSITION": up }, { "POSITION": right }]);
    builder.json["meshes"][0]["weights"] = mesh.clone();
    let node = |weights: &Value| json!({ "mesh": 0, "weights": weights });
    builder.json["nodes"] = nodes.iter().map(node).collect();
    builder.json["scenes"][0]["nodes"] = (0..nodes.len()).collect();
    builder.import()
}

#[test]
fn weights_of_nodes_go_before_those_of_the_mesh() {
    let weights = [json!([1, 0]), json!(null), json!([0, 0.5]), json!([1, 0]), json!([0, 0])];
    let imported = morphed(&weights, &json!([0.5, 0.25]));
    let nodes = &imported.model.nodes;
    let shown =
        |node: usize| imported.model.meshes[nodes[node].mesh.unwrap() as usize].positions[0];
    for (node, expected) in
        [[0., 0., 2.], [1., 0., 1.], [2., 0., 0.], [0., 0., 2.], [0.; 3]].into_iter().enumerate()
    {
        assert_eq!(shown(node), Vec3::from_array(expected), "node {node}");
    }
    // Nodes of equal weights share a mesh.
    assert_eq!(imported.model.meshes.len(), 4);
    assert_eq!(nodes[0].mesh, nodes[3].mesh);
    assert!(imported.report.notes.is_empty(), "{:?}", imported.report.notes);
}

#[test]
fn weights_that_cannot_be_read_are_those_of_the_mesh() {
    for odd in [json!("much"), json!([{}]), json!({ "up": 1 })] {
        let imported = morphed(std::slice::from_ref(&odd), &json!([0.5, 0.25]));
        assert_eq!(imported.model.meshes[0].positions[0], Vec3::new(1.0, 0.0, 1.0));
        assert_eq!(count(&imported.report.notes, "weights of morph targets"), 1);
        let imported = morphed(&[json!(null)], &odd);
        assert_eq!(imported.model.meshes[0].positions[0], Vec3::ZERO);
        assert_eq!(count(&imported.report.notes, "weights of morph targets"), 1);
    }
}

#[test]
fn morphed_meshes_are_skinned_after() {
    let mut skinned = Skinned::new();
    let moved = skinned.builder.accessor(&floats(&[0.5, -1., 2.].repeat(4)), 5126, "VEC3", 4);
    skinned.builder.primitive()["targets"] = json!([{ "POSITION": moved }]);
    skinned.builder.json["nodes"][0]["weights"] = json!([0.5]);
    let imported = skinned.builder.import();
    for (corner, shown) in shown_points(&imported, 0).iter().enumerate() {
        let [x, y, z] = corner_of_square(corner);
        let expected = skinned.expected([x + 0.25, y - 0.5, z + 1.0], BOTH[corner]);
        assert!(DVec3::from_array(expected).distance(*shown) < 1e-4);
    }
}

#[test]
fn skinned_meshes_far_from_the_origin_keep_their_shape() {
    let mut skinned = Skinned::new();
    // Mesh and joints are under one node far away, as a georeferenced station is.
    let far = DMat4::from_rotation_translation(
        DQuat::from_rotation_y(0.3),
        DVec3::new(2_600_000.0, 450.0, -1_200_000.0),
    );
    let bare = skinned.builder.import();
    push(
        &mut skinned.builder.json["nodes"],
        json!({ "children": [0, 1], "matrix": far.to_cols_array() }),
    );
    skinned.builder.json["scenes"] = json!([{ "nodes": [4] }]);
    let imported = skinned.builder.import();
    let near = |imported: &ImportedModel| imported.model.meshes[0].positions.clone();
    for (far, near) in near(&imported).iter().zip(near(&bare)) {
        assert!(far.distance(near) < 1e-5, "{far} for {near}");
    }
}
