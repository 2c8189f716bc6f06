use busbar_plugin_sdk::{Quality, Reason, Text, Value};

use super::*;

fn update(point: usize, nanos: i64, value: f64) -> Update {
    Update { point, nanos, value: Some(Value::F64(value)), quality: Quality::Good }
}

fn state(nanos: i64, is_on: bool) -> Update {
    Update { value: Some(Value::Bool(is_on)), ..update(0, nanos, 0.0) }
}

#[test]
fn of_each_interval_the_last_value_is_left() {
    let (mut decimator, mut out) = (Decimator::new([false].into_iter(), Some(10)), Vec::new());
    for nanos in 0..35 {
        decimator.take(update(0, nanos, nanos as f64), &mut out);
        decimator.release(nanos, &mut out);
    }
    let times: Vec<_> = out.iter().map(|update| update.nanos).collect();
    assert_eq!(times, [0, 9, 19, 29]);
    decimator.release(39, &mut out);
    assert_eq!(out.len(), 4);
    decimator.release(40, &mut out);
    assert_eq!(out.last(), Some(&update(0, 34, 34.0)));
    decimator.release(99, &mut out);
    assert_eq!(out.len(), 5, "nothing is published twice");
}

#[test]
fn no_change_of_a_discrete_tag_is_lost() {
    let (mut decimator, mut out) = (Decimator::new([true].into_iter(), Some(1000)), Vec::new());
    let changes = [0, 3, 4, 5, 500, 999, 1000, 1001];
    let mut is_on = false;
    for nanos in 0..1500 {
        is_on ^= changes.contains(&nanos);
        decimator.take(state(nanos, is_on), &mut out);
    }
    let times: Vec<_> = out.iter().map(|update| update.nanos).collect();
    assert_eq!(times, changes);
    let bad = Update { quality: Quality::Bad(Reason::Sensor), ..state(1500, is_on) };
    decimator.take(bad.clone(), &mut out);
    assert_eq!(out.pop(), Some(bad), "quality is a change too");
}

#[test]
fn no_change_of_a_text_is_lost_and_one_that_stays_is_refreshed() {
    let (mut decimator, mut out) = (Decimator::new([true].into_iter(), Some(10)), Vec::new());
    let texts = ["AUTO", "AUTO", "HAND", "AUTO", "AUTO", "AUTO"];
    for (nanos, text) in [0, 1, 2, 3, 11, 25].into_iter().zip(texts) {
        let value = Some(Value::Text(Text::cut(text)));
        decimator.take(Update { value, ..update(0, nanos, 0.0) }, &mut out);
    }
    let times: Vec<_> = out.iter().map(|update| update.nanos).collect();
    assert_eq!(times, [0, 2, 3, 11]);
}

#[test]
fn a_discrete_tag_that_stays_is_refreshed() {
    let (mut decimator, mut out) = (Decimator::new([true].into_iter(), Some(10)), Vec::new());
    for nanos in 0..=40 {
        decimator.take(state(nanos, true), &mut out);
    }
    let times: Vec<_> = out.iter().map(|update| update.nanos).collect();
    assert_eq!(times, [0, 9, 19, 29, 39]);
}

#[test]
fn without_a_limit_all_is_let_through() {
    let (mut decimator, mut out) = (Decimator::new([false].into_iter(), None), Vec::new());
    (0..50).for_each(|nanos| decimator.take(update(0, nanos, 1.0), &mut out));
    decimator.close(&mut out);
    assert_eq!(out.len(), 50);
}

#[test]
fn what_is_held_back_comes_at_the_close() {
    let (mut decimator, mut out) =
        (Decimator::new([false, false].into_iter(), Some(10)), Vec::new());
    for point in [0, 1, 0, 1] {
        decimator.take(update(point, 5, 1.0), &mut out);
    }
    assert_eq!(out.len(), 2);
    decimator.close(&mut out);
    assert_eq!(out.len(), 4);
    decimator.take(update(0, 5, 1.0), &mut out);
    assert_eq!(out.len(), 5, "it begins anew");
}
