//! Ways over made-up stations.

use proptest::prelude::*;

use super::*;

/// Places looked at along a way.
const STEPS: usize = 1500;

fn boxed(at: [f32; 3], size: [f32; 3]) -> Bounds {
    Bounds { min: at.into(), max: Vec3::from(at) + Vec3::from(size) }
}

fn first_violation(path: &CameraPath, equipment: &[Bounds], ends: [Vec3; 2]) -> Option<Vec3> {
    let grown = equipment
        .iter()
        .map(|bounds| Bounds { min: bounds.min - CLEARANCE, max: bounds.max + CLEARANCE });
    let passed: Vec<Bounds> =
        grown.filter(|bounds| !ends.iter().any(|end| holds(bounds, *end))).collect();
    let places = (0..=STEPS).map(|step| path.at(step as f32 / STEPS as f32));
    // Less than what rounding costs so far from the origin.
    let within = |bounds: &Bounds, place: Vec3| {
        holds(&Bounds { min: bounds.min + 1e-3, max: bounds.max - 1e-3 }, place)
    };
    let mut places = places;
    places.find(|place| passed.iter().any(|bounds| within(bounds, *place)))
}

#[test]
fn an_unobstructed_path_is_straight() {
    let path = CameraPath::between(Vec3::ZERO, Vec3::X * 10.0, &[]).unwrap();
    assert_eq!(path.at(0.5), Vec3::X * 5.0);
    assert_eq!([path.at(0.0), path.at(1.0)], [Vec3::ZERO, Vec3::X * 10.0]);
}

#[test]
fn a_path_rises_over_obstacles_in_between_only() {
    let wall = boxed([4.0, -5.0, -50.0], [2.0, 15.0, 100.0]);
    let tower = boxed([4.0, 0.0, 100.0], [2.0, 90.0, 5.0]);
    let (from, to) = (Vec3::ZERO, Vec3::X * 10.0);
    let path = CameraPath::between(from, to, &[wall, tower]).unwrap();
    assert_eq!(first_violation(&path, &[wall, tower], [from, to]), None);
    let highest = (0..=100).map(|step| path.at(step as f32 / 100.0).y).fold(0.0, f32::max);
    assert!((11.0..12.0).contains(&highest), "{highest}");
}

#[test]
fn a_path_from_under_a_roof_leaves_sideways_first() {
    let roof = boxed([-5.0, 3.0, -5.0], [10.0, 1.0, 10.0]);
    let wall = boxed([15.0, -5.0, -50.0], [2.0, 15.0, 100.0]);
    let (from, to) = (Vec3::ZERO, Vec3::X * 30.0);
    let path = CameraPath::between(from, to, &[roof, wall]).unwrap();
    assert_eq!(first_violation(&path, &[roof, wall], [from, to]), None);
}

#[test]
fn a_closed_room_has_no_path_out() {
    let side = 40.0;
    let walls = [
        boxed([-side, 8.0, -side], [2.0 * side, 1.0, 2.0 * side]),
        boxed([-side, -9.0, -side], [2.0 * side, 1.0, 2.0 * side]),
        boxed([-side, -9.0, -side], [1.0, 18.0, 2.0 * side]),
        boxed([side, -9.0, -side], [1.0, 18.0, 2.0 * side]),
        boxed([-side, -9.0, -side], [2.0 * side, 18.0, 1.0]),
        boxed([-side, -9.0, side], [2.0 * side, 18.0, 1.0]),
    ];
    assert_eq!(CameraPath::between(Vec3::ZERO, Vec3::X * 200.0, &walls), None);
}

prop_compose! {
    fn any_box()(
        x in -60.0_f32..60.0, y in 0.0_f32..12.0, z in -60.0_f32..60.0,
        width in 0.1_f32..20.0, height in 0.1_f32..15.0, depth in 0.1_f32..20.0,
    ) -> Bounds {
        boxed([x, y, z], [width, height, depth])
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Random scenes and pairs of cameras.
    #[test]
    fn a_path_keeps_one_metre_from_equipment_that_contains_neither_end(
        equipment in prop::collection::vec(any_box(), 0..60),
        from in (-90.0_f32..90.0, 0.0_f32..40.0, -90.0_f32..90.0),
        to in (-90.0_f32..90.0, 0.0_f32..40.0, -90.0_f32..90.0),
    ) {
        let ends = [Vec3::from(from), Vec3::from(to)];
        if let Some(path) = CameraPath::between(ends[0], ends[1], &equipment) {
            prop_assert_eq!(first_violation(&path, &equipment, ends), None);
            prop_assert!(path.at(0.0).distance(ends[0]) < 1e-3);
            prop_assert!(path.at(1.0).distance(ends[1]) < 1e-3);
        }
    }
}

/// Prints what a way costs on a hundred stations; a loaded machine in a debug build is
/// slow, so the bound is loose.
#[test]
fn a_path_among_a_hundred_thousand_pieces_is_found_within_the_time_limit() {
    let equipment: Vec<Bounds> = (0..100_000)
        .map(|index| {
            let (x, z) = ((index % 400) as f32 * 5.0, (index / 400) as f32 * 5.0);
            boxed([x, 0.0, z], [2.5, 3.0 + (index % 7) as f32 * 2.0, 2.5])
        })
        .collect();
    let (from, to) = (vec3(4.0, 1.7, 3.7), vec3(1503.7, 2.0, 1004.0));
    let start = std::time::Instant::now();
    let path = CameraPath::between(from, to, &equipment).unwrap();
    let elapsed = start.elapsed();
    println!("100000 pieces: {elapsed:?}");
    assert_eq!(path.at(1.0), to);
    assert!(elapsed < std::time::Duration::from_millis(500), "{elapsed:?}");
}

/// Else the property above would say little.
#[test]
fn a_path_is_nearly_always_found_in_equipment_scenes() {
    let mut state = 7_u32;
    let mut random = |limit: f32| {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32 * limit
    };
    let mut found = 0;
    for _ in 0..200 {
        let equipment: Vec<Bounds> = (0..60)
            .map(|_| {
                let at = [random(120.0), random(4.0), random(120.0)];
                boxed(at, [random(12.0), random(9.0), random(12.0)])
            })
            .collect();
        let mut place = || vec3(random(120.0), 1.7 + random(20.0), random(120.0));
        let (from, to) = (place(), place());
        found += usize::from(CameraPath::between(from, to, &equipment).is_some());
    }
    assert!(found >= 195, "{found} of 200");
}
