use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Quality, Value};

use super::*;

const SECOND: i64 = 1_000_000_000;

/// A recording in memory: instants with one update each.
struct Instants {
    times: Vec<i64>,
    next: usize,
    mark: usize,
}

impl Recording for Instants {
    fn origin(&self) -> Option<i64> {
        None
    }

    fn read(&mut self, updates: &mut Vec<Update>, _: &mut Remarks) -> Result<Option<i64>, Fault> {
        let Some(&nanos) = self.times.get(self.next) else { return Ok(None) };
        self.next += 1;
        updates.push(Update {
            point: 0,
            nanos,
            value: Some(Value::I64(nanos)),
            quality: Quality::Good,
        });
        Ok(Some(nanos))
    }

    fn skip_to(&mut self, _: i64) -> Result<(), Fault> {
        Ok(())
    }

    fn rewind(&mut self) -> Result<(), Fault> {
        self.next = self.mark;
        Ok(())
    }

    fn mark(&mut self) {
        self.mark = self.next;
    }
}

fn player(times: Vec<i64>, start: i64, end: i64) -> Player {
    let recording = Box::new(Instants { times, next: 0, mark: 0 });
    Player::new(recording, vec![false], None, start, end).unwrap()
}

/// Plays up to `head`; returns the times from the start, and values.
fn advance(player: &mut Player, head: i64) -> (Progress, Vec<(i64, i64)>) {
    let mut remarks = Remarks::new(host(), String::new());
    let mut out = Vec::new();
    let progress = player.advance(head, &mut out, &mut remarks).unwrap();
    (progress, pairs(&out))
}

fn pairs(updates: &[Update]) -> Vec<(i64, i64)> {
    let value = |update: &Update| match &update.value {
        Some(Value::I64(value)) => *value,
        other => panic!("{other:?}"),
    };
    updates.iter().map(|update| (update.nanos, value(update))).collect()
}

#[test]
fn what_is_due_comes_in_order() {
    let mut player = player(vec![0, 10, 20, 25], 0, i64::MAX);
    assert_eq!(advance(&mut player, 9), (Progress::Waiting, vec![(0, 0)]));
    assert_eq!(advance(&mut player, 9), (Progress::Waiting, vec![]));
    assert_eq!(advance(&mut player, 20), (Progress::Waiting, vec![(10, 10), (20, 20)]));
    assert_eq!(advance(&mut player, 29), (Progress::Waiting, vec![(25, 25)]));
    assert_eq!(advance(&mut player, 30).0, Progress::Ended(30), "the last lasts a step");
    assert!(player.has_played());
}

#[test]
fn what_was_before_the_start_holds_there() {
    let mut player = player(vec![0, 10, 20, 30, 40], 15, 35);
    assert_eq!(advance(&mut player, 0), (Progress::Waiting, vec![(0, 10)]));
    assert_eq!(advance(&mut player, 15), (Progress::Waiting, vec![(5, 20), (15, 30)]));
    assert_eq!(advance(&mut player, 25).0, Progress::Ended(25));
    let mut out = Vec::new();
    player.rewind(&mut out).unwrap();
    assert_eq!(pairs(&out), [(0, 10)]);
    assert_eq!(advance(&mut player, 5), (Progress::Waiting, vec![(5, 20)]));
    assert_eq!(advance(&mut player, 25), (Progress::Ended(25), vec![(15, 30)]));
}

#[test]
fn a_start_after_the_end_plays_nothing() {
    let mut player = player(vec![0, 10], 11, i64::MAX);
    assert!(matches!(advance(&mut player, i64::MAX).0, Progress::Ended(_)));
    assert!(!player.has_played());
}

#[test]
fn one_instant_is_a_recording() {
    let mut player = player(vec![5], 0, i64::MAX);
    assert_eq!(advance(&mut player, 5), (Progress::Ended(5), vec![(5, 5)]));
}

#[test]
fn the_last_step_is_bounded() {
    let mut player = player(vec![0, 3600 * SECOND], 0, i64::MAX);
    assert_eq!(advance(&mut player, 3609 * SECOND).0, Progress::Waiting);
    assert_eq!(advance(&mut player, 3610 * SECOND).0, Progress::Ended(3610 * SECOND));
}

#[test]
fn much_that_is_due_comes_in_parts() {
    let count = 3 * MAX_UPDATES_AT_ONCE as i64;
    let mut player = player((0..count).collect(), 0, i64::MAX);
    let mut seen = 0;
    loop {
        let (progress, updates) = advance(&mut player, i64::MAX);
        assert!(updates.len() <= MAX_UPDATES_AT_ONCE);
        seen += updates.len() as i64;
        match progress {
            Progress::More(since) => assert_eq!(since, seen - 1),
            Progress::Ended(_) => break,
            Progress::Waiting => panic!("all is due"),
        }
    }
    assert_eq!(seen, count);
}
