use proptest::prelude::*;

use super::*;
use crate::plane::distance;

/// Outline of all zones together.
const OUTLINE: [Point; 10] = [
    [0.0, 40.0],
    [38.0, 12.4],
    [32.0, -6.1],
    [24.3, -30.0],
    [23.5, -32.4],
    [1.0, -32.4],
    [-22.5, -32.4],
    [-23.5, -32.4],
    [-35.0, 3.1],
    [-38.0, 12.4],
];

fn area(polygon: &[Point]) -> f64 {
    edges(polygon).map(|[a, b]| (a[0] * b[1] - b[0] * a[1]) / 2.0).sum::<f64>().abs()
}

#[test]
fn zones_fill_the_pentagon_without_gap_or_overlap() {
    for pentagon in [&PENTAGON_1, &PENTAGON_2] {
        let total: f64 = pentagon.zones.iter().map(|(_, polygon, _)| area(polygon)).sum();
        assert!((total - area(&OUTLINE)).abs() < 1e-9, "{total} of {}", area(&OUTLINE));
    }
}

#[test]
fn borders_are_the_edges_that_are_not_outside() {
    let lies_on = |[a, b]: Segment, segment: Segment| {
        distance(a, segment) < 1e-9 && distance(b, segment) < 1e-9
    };
    for pentagon in [&PENTAGON_1, &PENTAGON_2] {
        for edge in pentagon.zones.iter().flat_map(|(_, polygon, _)| edges(polygon)) {
            let inner = pentagon.borders.iter().any(|&border| lies_on(edge, border));
            let outer = edges(&OUTLINE).any(|outer| lies_on(edge, outer));
            // The bottom is split at other places in pentagon 2.
            let bottom = edge[0][1] == -32.4 && edge[1][1] == -32.4;
            assert!(inner != (outer || bottom), "{edge:?}");
        }
        for &[a, b] in pentagon.borders {
            let middle = [a[0] + 0.47 * (b[0] - a[0]), a[1] + 0.47 * (b[1] - a[1])];
            let across = [(b[1] - a[1]) * 1e-6, (a[0] - b[0]) * 1e-6];
            let beside = |by: f64| [middle[0] + by * across[0], middle[1] + by * across[1]];
            assert_ne!(pentagon.zone_at(beside(1.0)).0, pentagon.zone_at(beside(-1.0)).0);
        }
    }
}

#[test]
fn each_zone_has_its_middle_and_the_first_of_two_has_their_border() {
    for pentagon in [&PENTAGON_1, &PENTAGON_2] {
        for (i, (zone, polygon, _)) in pentagon.zones.iter().enumerate() {
            for [a, b] in edges(polygon) {
                let middle = [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0];
                let has = |polygon: &[Point]| nearest(middle, edges(polygon)) < 1e-9;
                let first = pentagon.zones.iter().position(|(_, polygon, _)| has(polygon));
                let expected = pentagon.zones[first.unwrap()].0;
                assert_eq!(pentagon.zone_at(middle).0, expected, "{zone} ({i}) at {middle:?}");
            }
        }
    }
}

#[test]
fn the_published_example() {
    // Duval & Lamarre 2014: (-17.3, -9.1).
    let sample = Sample::of_five([31.0, 192.0, 130.0, 31.0, 0.0]).unwrap();
    let [x, y] = point(&sample).unwrap();
    assert!((x + 17.301).abs() < 1e-3 && (y + 9.096).abs() < 1e-3, "{x} {y}");
    assert_eq!(PENTAGON_1.zone(&sample), Zone::Thermal1);
    assert_eq!(PENTAGON_2.zone(&sample), Zone::Overheating);
}

#[test]
fn single_gases_and_opposite_pairs_have_places() {
    for (i, gas) in Gas::FIVE.into_iter().enumerate() {
        let mut ppm = [0.0; 5];
        ppm[i] = 7.0;
        let [x, y] = point(&Sample::of_five(ppm).unwrap()).unwrap();
        let axis = AXES.iter().find(|(other, _)| *other == gas).unwrap().1;
        let third = 100.0 / 3.0;
        assert!((x - third * axis[0]).abs() < 1e-5 && (y - third * axis[1]).abs() < 1e-5);
    }
    // H2 and CH4 alike, nothing between: on the line between their axes.
    let [x, y] = point(&Sample::of_five([5.0, 5.0, 0.0, 0.0, 0.0]).unwrap()).unwrap();
    assert!(x.is_finite() && y.is_finite() && x < 0.0);
    assert_eq!(point(&Sample::of_five([0.0; 5]).unwrap()), None);
    let absent = Sample::new().with(Gas::H2, crate::Concentration::measured(1.0).unwrap());
    assert_eq!((point(&absent), PENTAGON_1.zone(&absent)), (None, Zone::NotApplicable));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    #[test]
    fn centroids_are_where_zones_are(ppm in prop::array::uniform5(0.0..1.0_f64), powers in prop::array::uniform5(0..9_i32)) {
        let ppm = std::array::from_fn(|i| ppm[i] * 10.0_f64.powi(powers[i] - 3));
        let sample = Sample::of_five(ppm).unwrap();
        if let Some(point) = point(&sample) {
            prop_assert!(has_inside(&OUTLINE, point), "{point:?}");
        }
    }

    #[test]
    fn scale_changes_nothing(ppm in prop::array::uniform5(0.0..1000.0_f64), power in -8..8_i32) {
        // A power of two scales exactly.
        let by = 2.0_f64.powi(power);
        let (one, other) = (Sample::of_five(ppm).unwrap(), Sample::of_five(ppm.map(|p| p * by)).unwrap());
        prop_assert_eq!(point(&one), point(&other));
    }

    #[test]
    fn turning_the_gases_turns_the_point(ppm in prop::array::uniform5(0.1..1000.0_f64)) {
        // In the order of the axes; each gas takes the place of the next.
        let at = |ppm: [f64; 5]| {
            let mut sample = Sample::new();
            for ((gas, _), ppm) in AXES.into_iter().zip(ppm) {
                sample = sample.with(gas, crate::Concentration::measured(ppm).unwrap());
            }
            point(&sample).unwrap()
        };
        let [x, y] = at(ppm);
        let mut turned = ppm;
        turned.rotate_right(1);
        let (sin, cos) = 72.0_f64.to_radians().sin_cos();
        let [tx, ty] = at(turned);
        prop_assert!((tx - (x * cos - y * sin)).abs() < 1e-9);
        prop_assert!((ty - (x * sin + y * cos)).abs() < 1e-9);
    }
}
