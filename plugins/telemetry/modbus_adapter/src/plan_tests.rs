use proptest::prelude::*;

use super::*;
use crate::address::Decoding;

fn point(unit: u8, table: Table, group: usize, first: u16, count: u16) -> Point {
    Point { tag: 0, id: String::new(), unit, table, group, first, count, decoding: Decoding::Bit }
}

/// Holding registers of one unit: (first, count) of points -> of blocks.
fn check(points: &[(u16, u16)], blocks: &[(u16, u16)]) {
    let points: Vec<_> =
        points.iter().map(|&(first, count)| point(1, Table::Holding, 0, first, count)).collect();
    let planned: Vec<_> = plan(&points, 0).iter().map(|b| (b.first, b.count)).collect();
    assert_eq!(planned, blocks);
}

#[test]
fn neighbours_join_whatever_their_order() {
    check(&[(4, 2), (0, 2), (2, 2)], &[(0, 6)]);
    check(&[(10, 4), (10, 1), (11, 2)], &[(10, 4)]);
    check(&[], &[]);
}

#[test]
fn gaps_join_up_to_the_limit() {
    check(&[(0, 1), (17, 1)], &[(0, 18)]);
    check(&[(0, 1), (18, 1)], &[(0, 1), (18, 1)]);
}

#[test]
fn a_value_at_the_limit_is_not_torn() {
    let points: Vec<_> = (0..62).map(|i| (2 * i, 2)).chain([(124, 2)]).collect();
    check(&points, &[(0, 124), (124, 2)]);
    check(&[(65531, 1), (65532, 4)], &[(65531, 5)]);
}

#[test]
fn a_split_prefers_the_widest_gap() {
    let points: Vec<_> = [0, 1, 2, 9, 10].map(|first| point(1, Table::Holding, 0, first, 1)).into();
    let (left, right) = plan(&points, 0)[0].split(&points).unwrap();
    assert_eq!((left.first, left.count, right.first, right.count), (0, 3, 9, 2));
}

#[test]
fn points_of_the_same_cells_stay_together() {
    let points = vec![point(1, Table::Holding, 0, 7, 1); 16];
    assert_eq!(plan(&points, 0)[0].split(&points), None);
}

fn any_points() -> impl Strategy<Value = Vec<Point>> {
    let table = prop_oneof![
        Just(Table::Coil),
        Just(Table::Discrete),
        Just(Table::Holding),
        Just(Table::Input)
    ];
    // Dense at both ends of the range, so that joins, gaps and limits occur.
    let first = prop_oneof![0_u16..600, 64_900..=65_535_u16, any::<u16>()];
    let count = prop_oneof![Just(1_u16), Just(2), Just(4)];
    let one = (1_u8..3, table, 0_usize..3, first, count);
    prop::collection::vec(one, 0..300).prop_map(|all| {
        all.into_iter()
            .map(|(unit, table, group, first, count)| {
                point(unit, table, group, first.min(u16::MAX - count + 1), count)
            })
            .collect()
    })
}

fn assert_valid(points: &[Point], block: &Block) {
    let max = if block.table.is_bits() { MAX_BITS } else { MAX_REGISTERS };
    assert!(block.count >= 1 && block.count <= max, "{block:?}");
    assert!(block.end() <= 1 << 16, "{block:?}");
    let ends: Vec<_> = block.points.iter().map(|&i| points[i].end()).collect();
    assert_eq!(ends.iter().max(), Some(&block.end()), "no cell too many");
    for &index in &block.points {
        let point = &points[index];
        assert_eq!((point.unit, point.table), (block.unit, block.table));
        assert!(block.first <= point.first && point.end() <= block.end(), "torn");
    }
}

proptest! {
    #[test]
    fn every_point_is_read_once_and_whole(points in any_points()) {
        let mut seen = vec![0; points.len()];
        for group in 0..3 {
            for block in plan(&points, group) {
                assert_valid(&points, &block);
                for &index in &block.points {
                    prop_assert_eq!(points[index].group, group);
                    seen[index] += 1;
                }
            }
        }
        prop_assert!(seen.iter().all(|&n| n == 1), "{:?}", seen);
    }

    #[test]
    fn splitting_ends_at_single_cells_and_loses_nothing(points in any_points()) {
        for block in plan(&points, 0) {
            let mut all = block.points.clone();
            let mut queue = vec![block];
            let mut leaves = Vec::new();
            while let Some(block) = queue.pop() {
                assert_valid(&points, &block);
                match block.split(&points) {
                    Some((left, right)) => queue.extend([left, right]),
                    None => {
                        let cells = |i: usize| (points[i].first, points[i].count);
                        let first = cells(block.points[0]);
                        prop_assert!(block.points.iter().all(|&i| cells(i) == first));
                        leaves.extend(block.points);
                    }
                }
            }
            all.sort_unstable();
            leaves.sort_unstable();
            prop_assert_eq!(all, leaves);
        }
    }
}
