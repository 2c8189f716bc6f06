use std::collections::BTreeMap;

use proptest::prelude::*;

use super::*;

fn block(unit: u8, table: Table, first: u16, count: u16) -> Block {
    Block { unit, table, first, count, points: vec![0] }
}

#[test]
fn a_late_answer_cannot_be_mistaken() {
    let (asked, like_it) = (block(1, Table::Holding, 0, 10), block(1, Table::Holding, 50, 10));
    let mut late = LateAnswers::default();
    late.note_request(&asked);
    // Of another unit, function or length: nothing to fear.
    for other in [
        block(2, Table::Holding, 0, 10),
        block(1, Table::Input, 0, 10),
        block(1, Table::Holding, 0, 11),
    ] {
        assert_eq!(late.unmistakable(&other), other);
    }
    let probe = late.unmistakable(&like_it);
    assert_eq!((probe.first, probe.count), (50, 9));
    late.note_request(&probe);
    assert_eq!(late.unmistakable(&like_it).count, 8, "that of the probe may be late too");
    late.note_answer(&probe);
    assert_eq!(late.unmistakable(&like_it), like_it);
}

#[test]
fn an_exception_may_be_of_the_oldest() {
    let (first, second) = (block(1, Table::Coil, 0, 8), block(1, Table::Coil, 0, 16));
    let mut late = LateAnswers::default();
    late.note_request(&first);
    late.note_request(&second);
    late.note_exception(&second);
    assert_eq!(late.unmistakable(&first), first);
    assert_ne!(late.unmistakable(&second), second);
}

#[test]
fn other_lengths_are_within_the_tables() {
    for (table, first, count) in [
        (Table::Holding, 65535, 1),
        (Table::Holding, 0, 125),
        (Table::Coil, 65535, 1),
        (Table::Coil, 65528, 8),
        (Table::Discrete, 0, 2000),
    ] {
        let asked = block(1, table, first, count);
        let mut late = LateAnswers::default();
        for _ in 0..20 {
            let next = late.unmistakable(&asked);
            assert!(next.count >= 1 && u32::from(next.first) + u32::from(next.count) <= 1 << 16);
            assert!(next.count <= if table.is_bits() { MAX_BITS } else { MAX_REGISTERS });
            let open = late.0.get(&1).cloned().unwrap_or_default();
            assert!(!open.contains(&Shape::from_block(&next)), "{next:?}");
            late.note_request(&next);
            assert!(late.0[&1].len() <= MAX_OPEN);
        }
    }
}

/// Behavior of a device for each request.
#[derive(Clone, Copy, Debug)]
enum Fate {
    Answered,
    Refused,
    Lost,
    /// Answer that comes this many requests later, with no later answer before it.
    Late(usize),
}

fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        3 => Just(Fate::Answered),
        1 => Just(Fate::Refused),
        1 => Just(Fate::Lost),
        2 => (1_usize..5).prop_map(Fate::Late),
    ]
}

proptest! {
    /// Whatever is lost or late, an answer is taken for the cells that it is of.
    #[test]
    fn no_answer_is_taken_for_another(
        fates in prop::collection::vec(fate(), 1..60),
        wanted in prop::collection::vec(0_u16..4, 60),
    ) {
        // Two blocks each of two lengths.
        let blocks = [(0, 4), (100, 4), (200, 3), (300, 3)]
            .map(|(first, count)| block(1, Table::Holding, first, count));
        let mut late = LateAnswers::default();
        // Answers under way: when they come, to which cells, and whether refused.
        let mut under_way: VecDeque<(usize, Block, bool)> = VecDeque::new();
        let mut taken = BTreeMap::new();
        for (now, (fate, wanted)) in fates.iter().zip(wanted).enumerate() {
            let asked = late.unmistakable(&blocks[usize::from(wanted)]);
            late.note_request(&asked);
            let after = under_way.back().map_or(0, |(at, ..)| *at);
            match *fate {
                Fate::Answered => under_way.push_back((now.max(after), asked.clone(), false)),
                Fate::Refused => under_way.push_back((now.max(after), asked.clone(), true)),
                Fate::Late(by) => under_way.push_back((after.max(now + by), asked.clone(), false)),
                Fate::Lost => {}
            }
            // The first that fits is taken; others come while nobody listens.
            let mut is_waiting = true;
            while under_way.front().is_some_and(|(at, ..)| *at <= now) {
                let Some((_, answered, is_refused)) = under_way.pop_front() else { break };
                if !is_waiting {
                    continue;
                }
                if is_refused {
                    late.note_exception(&asked);
                    is_waiting = false;
                } else if Shape::from_block(&answered) == Shape::from_block(&asked) {
                    prop_assert_eq!(&answered, &asked);
                    late.note_answer(&asked);
                    *taken.entry(asked.first).or_insert(0) += 1;
                    is_waiting = false;
                } else {
                    // It fits nothing: the request is given up.
                    is_waiting = false;
                }
            }
        }
    }
}
