use std::collections::HashMap;

use proptest::prelude::*;

use super::*;

fn quad_with_seam() -> RawPrimitive {
    // Two triangles that share an edge in space but not in the vertex array.
    let p = [(0., 0.), (1., 0.), (1., 1.), (0., 0.), (1., 1.), (0., 1.)];
    RawPrimitive {
        positions: p.iter().map(|&(x, y)| Vec3::new(x, y, -0.0)).collect(),
        normals: vec![Vec3::Z; 3].into_iter().chain(vec![Vec3::X; 3]).collect(),
        triangles: vec![[0, 1, 2], [3, 4, 5]],
        ..Default::default()
    }
}

#[test]
fn welds_positions_and_keeps_wedges_on_a_seam() {
    let (mesh, report) = weld(&[quad_with_seam()]).unwrap();
    assert_eq!(mesh.positions.len(), 4);
    assert_eq!(mesh.wedges.len(), 6);
    assert_eq!(report.vertices_in, 6);
    assert_eq!(mesh.topology().triangles, vec![[0, 1, 2], [0, 2, 3]]);
}

/// A fan around one point, whose corner there has another normal in each triangle.
#[test]
fn a_position_may_have_many_wedges_and_each_is_found_again() {
    let count = 4 * MAX_CHAIN;
    let ring = |i: usize| Vec3::new(1.0, i as f32, 0.0);
    let normal = |i: usize| Vec3::new(0.0, i as f32, 1.0);
    let twice = || (0..count).chain(0..count);
    let primitive = RawPrimitive {
        positions: twice().flat_map(|i| [Vec3::ZERO, ring(i), ring(i + 1)]).collect(),
        normals: twice().flat_map(|i| [normal(i), Vec3::Z, Vec3::Z]).collect(),
        triangles: (0..2 * count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..Default::default()
    };
    let (mesh, _) = weld(&[primitive]).unwrap();
    assert_eq!(mesh.positions.len(), 1 + count + 1);
    assert_eq!(mesh.wedges.len(), count + count + 1);
    let of_middle = mesh.triangles.iter().map(|&[middle, ..]| mesh.wedges.normal[middle as usize]);
    assert!(of_middle.eq(twice().map(normal)));
    assert_eq!(mesh.triangles[..count], mesh.triangles[count..]);
}

#[test]
fn negative_zero_and_zero_are_one_position() {
    let mut primitive = quad_with_seam();
    primitive.positions[3].x = -0.0;
    let (mesh, _) = weld(&[primitive]).unwrap();
    assert_eq!(mesh.positions.len(), 4);
}

#[test]
fn primitives_weld_to_each_other_but_keep_their_sections() {
    let mut second = quad_with_seam();
    second.material = Some(1);
    let (mesh, report) = weld(&[quad_with_seam(), second]).unwrap();
    assert_eq!(mesh.positions.len(), 4);
    assert_eq!(mesh.wedges.len(), 12);
    assert_eq!(mesh.sections.len(), 2);
    assert_eq!(mesh.sections[1].first_triangle, 2);
    assert_eq!(report.coincident_triangles, 0);
}

#[test]
fn features_do_not_weld_to_each_other() {
    let mut primitive = quad_with_seam();
    primitive.features = vec![3, 3, 3, 8, 8, 8];
    let (mesh, _) = weld(&[primitive]).unwrap();
    assert_eq!(mesh.positions.len(), 6);
    let features: Vec<_> = mesh.triangles.iter().map(|&t| mesh.feature(t)).collect();
    assert_eq!(features, vec![Some(3), Some(8)]);
}

#[test]
fn a_triangle_belongs_to_the_feature_of_its_first_corner() {
    let mut primitive = quad_with_seam();
    primitive.features = vec![3, 8, 8, 8, 3, 3];
    let (mesh, _) = weld(&[primitive, quad_with_seam()]).unwrap();
    let corners = mesh.triangles.iter().map(|&t| mesh.corner_positions(t));
    let features: Vec<_> = corners.map(|t| t.map(|p| mesh.features[p as usize])).collect();
    assert_eq!(features, vec![[3; 3], [8; 3], [NO_FEATURE; 3], [NO_FEATURE; 3]]);
    assert_eq!(mesh.feature(mesh.triangles[2]), None);
}

#[test]
fn coincident_corners_drop_the_triangle_and_are_counted() {
    let mut primitive = quad_with_seam();
    primitive.triangles.push([0, 3, 1]);
    let (mesh, report) = weld(&[primitive]).unwrap();
    assert_eq!(mesh.triangles.len(), 2);
    assert_eq!(report.coincident_triangles, 1);
}

#[test]
fn unreferenced_vertices_are_not_positions() {
    let mut primitive = quad_with_seam();
    primitive.positions.push(Vec3::splat(9.0));
    primitive.normals.push(Vec3::Z);
    let (mesh, _) = weld(&[primitive]).unwrap();
    assert_eq!(mesh.positions.len(), 4);
}

#[test]
fn missing_normals_become_flat_ones() {
    let mut primitive = quad_with_seam();
    primitive.normals.clear();
    let (mesh, _) = weld(&[primitive]).unwrap();
    assert!(mesh.wedges.normal.iter().all(|&n| n == Vec3::Z));
    assert_eq!(mesh.wedges.len(), 4);
}

#[test]
fn bad_input_is_named() {
    let mut primitive = quad_with_seam();
    primitive.triangles[1] = [0, 1, 99];
    assert!(matches!(
        weld(&[primitive]),
        Err(WeldError::IndexOutOfRange { triangle: 1, vertex: 99, count: 6, .. })
    ));
    let mut primitive = quad_with_seam();
    primitive.positions[2].y = f32::NAN;
    assert_eq!(weld(&[primitive]), Err(WeldError::NotFinite { primitive: 0, vertex: 2 }));
}

/// Welds by a plain map: expected positions, features and corners.
fn welded_one_by_one(primitives: &[RawPrimitive]) -> (Vec<Vec3>, Vec<u32>, Vec<[u32; 3]>) {
    let mut numbers: HashMap<([u32; 3], u32), u32> = HashMap::new();
    let (mut positions, mut features, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for primitive in primitives {
        for corners in &primitive.triangles {
            let points = corners.map(|v| primitive.positions[v as usize] + Vec3::ZERO);
            if (0..3).any(|i| points[i] == points[(i + 1) % 3]) {
                continue;
            }
            let feature = primitive.features.get(corners[0] as usize).copied();
            let feature = feature.unwrap_or(NO_FEATURE);
            triangles.push(points.map(|point| {
                let key = (point.to_array().map(f32::to_bits), feature);
                *numbers.entry(key).or_insert_with(|| {
                    positions.push(point);
                    features.push(feature);
                    positions.len() as u32 - 1
                })
            }));
        }
    }
    (positions, features, triangles)
}

fn primitives() -> impl Strategy<Value = Vec<RawPrimitive>> {
    let point = (0..4_i8, 0..4_i8, -1..2_i8);
    let primitive = (3..40_usize, any::<bool>()).prop_flat_map(move |(count, has_features)| {
        let points = prop::collection::vec(point.clone(), count);
        let features = prop::collection::vec(0..3_u32, if has_features { count } else { 0 });
        let corner = 0..count as u32;
        let triangles = prop::collection::vec([corner.clone(), corner.clone(), corner], 0..60);
        (points, features, triangles)
    });
    prop::collection::vec(primitive, 1..4).prop_map(|primitives| {
        let made = |(points, features, triangles): (Vec<(i8, i8, i8)>, Vec<u32>, _)| {
            let at = |&(x, y, z): &(i8, i8, i8)| Vec3::from([x, y, z].map(f32::from)) * -0.5;
            RawPrimitive {
                positions: points.iter().map(at).collect(),
                features,
                triangles,
                ..RawPrimitive::default()
            }
        };
        primitives.into_iter().map(made).collect()
    })
}

proptest! {
    #[test]
    fn positions_are_those_of_a_plain_map(primitives in primitives()) {
        let (mesh, _) = weld(&primitives).unwrap();
        let (positions, features, triangles) = welded_one_by_one(&primitives);
        prop_assert_eq!(mesh.positions.len(), positions.len());
        let bits = |points: &[Vec3]| -> Vec<[u32; 3]> {
            points.iter().map(|p| p.to_array().map(f32::to_bits)).collect()
        };
        prop_assert_eq!(bits(&mesh.positions), bits(&positions));
        let has_features = primitives.iter().any(|p| !p.features.is_empty());
        prop_assert_eq!(&mesh.features, if has_features { &features } else { &mesh.features });
        let corners: Vec<_> = mesh.triangles.iter().map(|&t| mesh.corner_positions(t)).collect();
        prop_assert_eq!(corners, triangles);
    }
}

/// More points than one pile takes, each met twice.
#[test]
fn points_of_many_piles_are_found_again() {
    let count = 40_000;
    let point = |i: usize| Vec3::new((i % 200) as f32, (i / 200) as f32 * 0.37, (i % 7) as f32);
    let primitive = RawPrimitive {
        positions: (0..count).chain(0..count).map(point).collect(),
        triangles: (0..2 * count as u32 - 2).map(|i| [i, i + 1, i + 2]).collect(),
        ..RawPrimitive::default()
    };
    let (mesh, _) = weld(std::slice::from_ref(&primitive)).unwrap();
    let (positions, _, triangles) = welded_one_by_one(&[primitive]);
    assert_eq!(mesh.positions, positions);
    let corners = mesh.triangles.iter().map(|&t| mesh.corner_positions(t));
    assert!(corners.eq(triangles));
}
