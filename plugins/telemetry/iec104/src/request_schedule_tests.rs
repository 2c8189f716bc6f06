use serde_json::json;

use super::*;
use crate::Settings;

const SECOND: Duration = Duration::from_secs(1);
/// The default of t1.
const CONFIRM_LIMIT: Duration = Duration::from_secs(15);

fn requests(settings: serde_json::Value) -> RequestSchedule {
    let mut all = json!({"host": "a"});
    all.as_object_mut().unwrap().extend(settings.as_object().unwrap().clone());
    let config = serde_json::from_value::<Settings>(all).unwrap().parse().unwrap();
    RequestSchedule::new(&config, vec![3, 5])
}

fn answer(common_address: u16, cause: u8, is_negative: bool) -> Header {
    Header {
        type_id: 100,
        is_sequence: false,
        count: 1,
        cause,
        is_negative,
        is_test: false,
        originator: 0,
        common_address,
    }
}

fn job(kind: RequestKind, common_address: u16) -> ScheduledRequest {
    ScheduledRequest { kind, common_address }
}

#[test]
fn one_request_at_a_time_the_clock_first() {
    use RequestKind::{ClockSync, Counters, Interrogation};
    let mut requests =
        requests(json!({"counter_period_seconds": 1, "clock_sync_period_seconds": 1}));
    let now = Instant::now();
    assert_eq!(requests.next(now), None, "nothing before data transfer starts");
    requests.begin(now);
    for kind in [ClockSync, Interrogation, Counters] {
        for common_address in [3, 5] {
            let job = job(kind, common_address);
            assert_eq!(requests.next(now), Some(job));
            assert_eq!(requests.next(now), None, "{job:?} is open");
            let confirmed = answer(common_address, cause::ACTIVATION_CONFIRMED, false);
            let outcome = requests.handle_answer(kind, &confirmed, now);
            if kind == ClockSync {
                assert_eq!(outcome, Some((job, Outcome::Done)));
                continue;
            }
            assert_eq!(outcome, None);
            let of_another = answer(9, cause::ACTIVATION_TERMINATED, false);
            assert_eq!(requests.handle_answer(kind, &of_another, now), None);
            let ended = answer(common_address, cause::ACTIVATION_TERMINATED, false);
            assert_eq!(requests.handle_answer(kind, &ended, now), Some((job, Outcome::Done)));
        }
    }
    assert_eq!(requests.next(now), None);
    assert_eq!(requests.deadline(), Some(now + SECOND));
    assert_eq!(requests.next(now + SECOND), Some(job(ClockSync, 3)));
}

#[test]
fn an_interrogation_is_asked_for_at_the_start_or_in_its_period() {
    let start = Instant::now();
    let asked = |settings: serde_json::Value| {
        let mut requests = requests(settings);
        requests.begin(start);
        let mut times = Vec::new();
        for second in 0..10 {
            let now = start + second * SECOND;
            while let Some(job) = requests.next(now) {
                let ended = answer(job.common_address, cause::ACTIVATION_TERMINATED, false);
                requests.handle_answer(job.kind, &ended, now);
                if job.common_address == 3 {
                    times.push(second);
                }
            }
        }
        times
    };
    assert_eq!(asked(json!({})), [0]);
    assert_eq!(asked(json!({"interrogate_on_start": false})), [] as [u32; 0]);
    let period = |start| json!({"interrogate_on_start": start, "interrogation_period_seconds": 3});
    assert_eq!(asked(period(true)), [0, 3, 6, 9]);
    assert_eq!(asked(period(false)), [3, 6, 9]);
}

#[test]
fn what_is_not_answered_does_not_hold_up_the_rest() {
    let mut requests = requests(json!({}));
    let now = Instant::now();
    requests.begin(now);
    let first = requests.next(now).unwrap();
    assert_eq!(requests.take_late(now + CONFIRM_LIMIT - SECOND), None);
    assert_eq!(requests.deadline(), Some(now + CONFIRM_LIMIT));
    assert_eq!(requests.take_late(now + CONFIRM_LIMIT), Some(first));
    let second = requests.next(now).unwrap();
    assert_eq!(second.common_address, 5);
    let confirmed = answer(5, cause::ACTIVATION_CONFIRMED, false);
    requests.handle_answer(RequestKind::Interrogation, &confirmed, now);
    assert_eq!(requests.take_late(now + ANSWER_LIMIT - SECOND), None);
    assert_eq!(requests.take_late(now + ANSWER_LIMIT), Some(second));
}

#[test]
fn refusals_are_told_apart() {
    let cases = [
        (cause::UNKNOWN_COMMON_ADDRESS, true, Outcome::UnknownCommonAddress),
        (cause::UNKNOWN_TYPE, true, Outcome::Refused(44)),
        (cause::UNKNOWN_CAUSE, false, Outcome::Refused(45)),
        (cause::ACTIVATION_CONFIRMED, true, Outcome::Refused(7)),
    ];
    for (cause, is_negative, outcome) in cases {
        let mut requests = requests(json!({}));
        let now = Instant::now();
        requests.begin(now);
        let job = requests.next(now).unwrap();
        let header = answer(3, cause, is_negative);
        assert_eq!(
            requests.handle_answer(RequestKind::Interrogation, &header, now),
            Some((job, outcome))
        );
    }
}

#[test]
fn an_unknown_common_address_is_heard_even_after_a_refusal() {
    let mut requests = requests(json!({}));
    let now = Instant::now();
    requests.begin(now);
    let job = requests.next(now).unwrap();
    requests.handle_answer(
        RequestKind::Interrogation,
        &answer(3, cause::ACTIVATION_CONFIRMED, true),
        now,
    );
    let unknown = |common_address| answer(common_address, cause::UNKNOWN_COMMON_ADDRESS, false);
    let heard = requests.handle_answer(RequestKind::Interrogation, &unknown(3), now);
    assert_eq!(heard, Some((job, Outcome::UnknownCommonAddress)));
    assert_eq!(
        requests.handle_answer(RequestKind::Interrogation, &unknown(4), now),
        None,
        "none of ours"
    );
}

#[test]
fn a_demand_waits_its_time_and_once() {
    let mut requests = requests(json!({"interrogate_on_start": false}));
    let start = Instant::now();
    requests.begin(start);
    let mut asked = Vec::new();
    for second in 0..12 {
        let now = start + second * SECOND;
        for _ in 0..1000 {
            requests.demand(5);
        }
        while let Some(job) = requests.next(now) {
            asked.push((job.common_address, second));
            let ended = answer(job.common_address, cause::ACTIVATION_TERMINATED, false);
            requests.handle_answer(job.kind, &ended, now);
        }
        assert!(requests.queue.is_empty());
    }
    assert_eq!(asked, [(5, 0), (5, 5), (5, 10)]);
    assert_eq!(requests.deadline(), Some(start + 15 * SECOND));
}

#[test]
fn a_demand_while_the_same_is_asked_for_comes_after_it() {
    let mut requests = requests(json!({"counter_period_seconds": 3600}));
    let now = Instant::now();
    requests.begin(now);
    assert_eq!(requests.next(now), Some(job(RequestKind::Interrogation, 3)));
    requests.demand(3);
    let mut asked = Vec::new();
    let end = |requests: &mut RequestSchedule, job: ScheduledRequest| {
        let ended = answer(job.common_address, cause::ACTIVATION_TERMINATED, false);
        requests.handle_answer(job.kind, &ended, now)
    };
    end(&mut requests, job(RequestKind::Interrogation, 3));
    while let Some(job) = requests.next(now) {
        asked.push(job);
        end(&mut requests, job);
    }
    let again = job(RequestKind::Interrogation, 3);
    assert!(asked.contains(&again) && asked.contains(&job(RequestKind::Counters, 3)), "{asked:?}");
    assert_eq!(asked.len(), 4, "{asked:?}");
}
