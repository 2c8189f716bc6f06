use async_opcua::types::{DataChangeNotification, DateTime, ExtensionObject};
use proptest::prelude::*;

use super::*;

/// A sequence and what came of it.
#[derive(Default)]
struct Server {
    sequence: Sequence,
    time: i64,
}

/// Consequence of a message, in short.
#[derive(Debug, Default, PartialEq)]
struct Outcome {
    ready: Vec<u32>,
    is_lost: bool,
    has_gap: bool,
    republish: Option<u32>,
}

fn message(number: u32, time: i64, has_data: bool) -> NotificationMessage {
    let data = ExtensionObject::from_message(DataChangeNotification::default());
    NotificationMessage {
        sequence_number: number,
        publish_time: DateTime::from(time),
        notification_data: has_data.then(|| vec![data]),
    }
}

impl Server {
    fn outcome(&self, arrival: Arrival) -> Outcome {
        Outcome {
            ready: arrival.ready.iter().map(|message| message.sequence_number).collect(),
            is_lost: arrival.is_lost,
            has_gap: self.sequence.has_gap(),
            republish: arrival.republish,
        }
    }

    fn send(&mut self, number: u32, has_data: bool) -> Outcome {
        self.time += 1;
        let arrival = self.sequence.take(message(number, self.time, has_data), &[]);
        self.outcome(arrival)
    }

    fn data(&mut self, number: u32) -> Outcome {
        self.send(number, true)
    }

    fn keep_alive(&mut self, number: u32) -> Outcome {
        self.send(number, false)
    }

    fn republished(&mut self, number: u32, is_there: bool) -> Outcome {
        self.time += 1;
        let message = is_there.then(|| message(number, self.time, true));
        let arrival = self.sequence.take_republished(number, message);
        self.outcome(arrival)
    }
}

fn ready(numbers: &[u32]) -> Outcome {
    Outcome { ready: numbers.to_vec(), ..Outcome::default() }
}

fn gap(republish: Option<u32>) -> Outcome {
    Outcome { has_gap: true, republish, ..Outcome::default() }
}

fn lost(numbers: &[u32]) -> Outcome {
    Outcome { ready: numbers.to_vec(), is_lost: true, ..Outcome::default() }
}

#[test]
fn what_is_missing_is_asked_for_and_comes_before_what_waits() {
    let mut server = Server::default();
    assert_eq!(server.data(1), ready(&[1]));
    assert_eq!(server.keep_alive(2), ready(&[]));
    assert_eq!(server.data(4), gap(Some(2)));
    assert_eq!(server.keep_alive(5), gap(None), "it is asked for already");
    assert_eq!(server.republished(2, true), Outcome { ready: vec![2], ..gap(Some(3)) });
    let arrival = server.sequence.take_republished(3, Some(message(3, 9, true)));
    assert!(arrival.is_filled && !arrival.is_lost);
    assert_eq!(server.outcome(arrival), ready(&[3, 4]));
}

#[test]
fn a_number_that_a_keep_alive_announced_and_that_never_came_is_lost() {
    let mut server = Server::default();
    server.data(1);
    server.keep_alive(2);
    assert_eq!(server.data(3), gap(Some(2)));
    assert_eq!(server.keep_alive(4), gap(None));
    assert_eq!(server.republished(2, false), lost(&[3]));
    for _ in 0..3 {
        assert_eq!(server.keep_alive(4), ready(&[]));
    }
    assert_eq!(server.data(4), ready(&[4]));
}

#[test]
fn a_keep_alive_tells_of_what_was_lost_before_it() {
    let mut server = Server::default();
    server.data(1);
    assert_eq!(server.keep_alive(3), gap(Some(2)));
    assert_eq!(server.republished(2, false), lost(&[]));
    assert_eq!(server.data(3), ready(&[3]));
}

#[test]
fn a_subscription_begins_at_one() {
    assert_eq!(Server::default().data(1), ready(&[1]));
    assert_eq!(Server::default().keep_alive(1), ready(&[]));
    assert_eq!(Server::default().data(2), gap(Some(1)));
    assert_eq!(Server::default().keep_alive(2), gap(Some(1)));
    let mut server = Server::default();
    server.data(3);
    assert_eq!(server.republished(1, true), Outcome { ready: vec![1], ..gap(Some(2)) });
    assert_eq!(server.republished(2, false), lost(&[3]));
}

#[test]
fn a_server_whose_keep_alives_use_numbers_is_understood() {
    let mut server = Server::default();
    server.data(1);
    let mut losses = 0;
    for number in 2..100 {
        // Idle, but for a change now and then.
        let outcome = if number % 5 == 0 { server.data(number) } else { server.keep_alive(number) };
        if let Some(asked) = outcome.republish {
            losses += u32::from(server.republished(asked, false).is_lost);
        }
        assert!(!server.sequence.has_gap());
    }
    assert!((1..=KEEP_ALIVES_TO_LEARN).contains(&losses), "{losses}");
    // What is lost is noticed all the same, by data and by keep-alive.
    assert_eq!(server.data(101), gap(Some(100)));
    assert_eq!(server.republished(100, true), ready(&[100, 101]));
    assert_eq!(server.keep_alive(103), gap(Some(102)));
    assert_eq!(server.republished(102, false), lost(&[]));
    assert_eq!(server.keep_alive(104), ready(&[]));
    assert_eq!(server.data(105), ready(&[105]));
}

#[test]
fn a_keep_alive_whose_number_is_kept_is_asked_for() {
    let kept = |server: &mut Server, number: u32| {
        let kept: Vec<_> = (1..=number).collect();
        let arrival = server.sequence.take(message(number, number.into(), false), &kept);
        server.outcome(arrival)
    };
    // A server that keeps its keep-alives.
    let mut server = Server::default();
    server.data(1);
    assert_eq!(kept(&mut server, 2), gap(Some(2)));
    let arrival = server.sequence.take_republished(2, Some(message(2, 9, false)));
    assert!(arrival.is_filled);
    for number in 3..6 {
        assert_eq!(kept(&mut server, number), ready(&[]), "{number}");
    }
    assert_eq!(server.data(6), ready(&[6]));
    // One that repeats the last number, of a notification that is lost.
    let mut server = Server::default();
    server.data(1);
    assert_eq!(kept(&mut server, 2), gap(Some(2)));
    assert_eq!(server.republished(2, true), ready(&[2]));
    // One that answers with the keep-alive itself, later.
    let mut server = Server::default();
    server.data(1);
    server.keep_alive(2);
    assert_eq!(server.data(3), gap(Some(2)));
    let arrival = server.sequence.take_republished(2, Some(message(2, 9, false)));
    assert!(arrival.is_filled);
    assert_eq!(server.outcome(arrival), ready(&[3]));
}

#[test]
fn a_mistaken_belief_that_keep_alives_use_numbers_ends() {
    let mut server = Server::default();
    server.data(1);
    // Three losses in succession, each of a number that was announced.
    for number in 2..=5 {
        if let Some(asked) = server.keep_alive(number).republish {
            server.republished(asked, false);
        }
    }
    assert_eq!(server.sequence.counting, KeepAliveNumber::Own);
    let number = 5;
    assert!(server.keep_alive(number).is_lost, "the same number a second time");
    assert_eq!(server.sequence.counting, KeepAliveNumber::Next);
    assert_eq!(server.data(number), ready(&[number]));
    assert_eq!(server.keep_alive(number + 1), ready(&[]));
}

#[test]
fn a_server_that_repeats_the_last_number_hides_no_loss() {
    let mut server = Server::default();
    server.data(1);
    assert!(server.keep_alive(1).is_lost, "what was lost before nobody knows");
    assert_eq!(server.keep_alive(1), ready(&[]));
    assert_eq!(server.data(2), ready(&[2]));
    assert_eq!(server.keep_alive(2), ready(&[]));
    // 3 is lost.
    assert_eq!(server.keep_alive(3), gap(Some(3)));
    assert_eq!(server.republished(3, false), lost(&[]));
}

/// Keep-alives that their notification overtook must not count as those of a server that repeats
/// the last number. Otherwise the next notification would be given up before it was sent, and its
/// loss would go unnoticed.
#[test]
fn a_keep_alive_that_its_notification_overtook_changes_nothing() {
    let mut server = Server::default();
    server.data(1);
    server.data(2);
    let arrival = server.sequence.take(message(2, 1, false), &[]);
    assert!(arrival.is_duplicate);
    assert_eq!(server.outcome(arrival), ready(&[]));
    assert_eq!(server.keep_alive(3), ready(&[]));
    assert_eq!(server.keep_alive(4), gap(Some(3)), "the notification 3 is lost");
    // With a gap before it, too.
    let arrival = server.sequence.take(message(2, 1, false), &[]);
    assert_eq!(server.outcome(arrival), gap(None));
    assert_eq!(server.republished(3, true), ready(&[3]));
    // One that comes later than the notification repeats its number.
    assert_eq!(server.keep_alive(3), lost(&[]));
}

#[test]
fn duplicates_are_known_and_a_server_that_counts_anew_is_no_duplicate() {
    let mut server = Server::default();
    for number in 1..=3 {
        server.data(number);
    }
    let arrival = server.sequence.take(message(2, 2, true), &[]);
    assert!(arrival.is_duplicate && arrival.ready.is_empty() && !arrival.is_lost);
    // Another message with a number that was used: what it has must be read.
    assert_eq!(server.data(1), lost(&[]));
    assert_eq!(server.data(2), lost(&[]), "it counts anew");
    assert_eq!(server.data(3), ready(&[3]));
    assert_eq!(server.keep_alive(4), ready(&[]));
}

#[test]
fn another_message_of_the_same_number_and_time_is_no_duplicate() {
    let of = |handle| {
        let change = async_opcua::types::MonitoredItemNotification {
            client_handle: handle,
            ..Default::default()
        };
        let changes = DataChangeNotification {
            monitored_items: Some(vec![change]),
            ..DataChangeNotification::default()
        };
        let data = Some(vec![ExtensionObject::from_message(changes)]);
        NotificationMessage { notification_data: data, ..message(1, 7, true) }
    };
    let mut server = Server::default();
    server.sequence.take(of(1), &[]);
    assert!(server.sequence.take(of(1), &[]).is_duplicate);
    assert!(server.sequence.take(of(2), &[]).is_lost);
    // Two that wait, with one number.
    let mut server = Server::default();
    assert_eq!(server.data(3), gap(Some(1)));
    assert_eq!(server.data(3), Outcome { is_lost: true, ..gap(None) });
    assert_eq!(server.republished(1, true), Outcome { ready: vec![1], ..gap(Some(2)) });
    assert_eq!(server.republished(2, true), Outcome { ready: vec![2], ..gap(Some(3)) });
    assert_eq!(server.republished(3, false), lost(&[]));
}

#[test]
fn numbers_begin_anew_at_one() {
    let mut server = Server::default();
    (server.sequence.next, server.sequence.end) = (u32::MAX, u32::MAX);
    assert_eq!(server.data(u32::MAX), ready(&[u32::MAX]));
    assert_eq!(server.keep_alive(1), ready(&[]));
    assert_eq!(server.data(2), gap(Some(1)));
    assert_eq!(server.republished(1, true), ready(&[1, 2]));
}

#[test]
fn long_gaps_and_floods_are_bounded() {
    let mut server = Server::default();
    assert_eq!(server.data(1_000_000), lost(&[1_000_000]), "read at once");
    for number in (1_000_002..).take(MAX_HELD + 3) {
        server.data(number);
        assert!(server.sequence.held.len() <= MAX_HELD);
    }
    assert!(!server.sequence.has_gap());
    for number in 0..1000 {
        server.keep_alive(2_000_000_u32 + number);
        server.data(7 * number);
    }
    assert!(server.sequence.announced.len() <= MAX_HELD && server.sequence.seen.len() <= MAX_SEEN);
}

#[test]
fn an_answer_that_nobody_asked_for_changes_nothing() {
    let mut server = Server::default();
    server.data(1);
    assert_eq!(server.republished(1, true), ready(&[]));
    assert_eq!(server.data(3), gap(Some(2)));
    assert_eq!(server.republished(3, true), gap(None));
    assert_eq!(server.data(2), ready(&[2, 3]), "it came by itself");
    assert_eq!(server.republished(2, false), ready(&[]));
}

proptest! {
    #[test]
    fn nothing_comes_twice_out_of_order_or_after_a_silent_loss(
        steps in prop::collection::vec((0_u32..8, any::<bool>(), 0_u8..4), 1..200),
    ) {
        // Numbers that jump a little, with Republish that works or not.
        let (mut server, mut number, mut last) = (Server::default(), 1_u32, 0_u32);
        let mut is_told = false;
        for (jump, has_data, answer) in steps {
            number = number.saturating_add(jump).saturating_sub(2).max(1);
            let mut outcome = server.send(number, has_data);
            loop {
                is_told |= outcome.is_lost;
                for &ready in &outcome.ready {
                    let is_next = ready == last.wrapping_add(1);
                    let is_own = server.sequence.counting == KeepAliveNumber::Own;
                    prop_assert!(is_next || is_told || is_own, "{ready} after {last}");
                    (last, is_told) = (ready, false);
                }
                let Some(asked) = outcome.republish.filter(|_| answer > 0) else { break };
                outcome = server.republished(asked, answer > 1);
            }
        }
    }
}
