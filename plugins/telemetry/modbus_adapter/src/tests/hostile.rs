//! Against servers that break the protocol in every way we know.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use super::server::{Pieces, Server, at_once, right};
use super::*;

/// No value may come of it, tags are bad in time, and tries thin out.
fn check(answer: fn(&[u8]) -> Option<Pieces>, message: &str) {
    let server = Server::start(answer);
    let started = Instant::now();
    let running =
        start(server.port, json!({"timeout_seconds": 0.1}), vec![holding(1, 0), holding(2, 1)]);
    running.wait_for_bad(1, Reason::Communication);
    running.wait_for_bad(2, Reason::Communication);
    assert!(
        started.elapsed() < Duration::from_millis(1100),
        "bad only after {:?}",
        started.elapsed()
    );
    let enough = Instant::now() + PATIENCE;
    while server.gaps_millis().len() < 4 && Instant::now() < enough {
        std::thread::sleep(Duration::from_millis(10));
    }
    let gaps = server.gaps_millis();
    assert!(gaps.len() >= 4, "{gaps:?}");
    // Delays are at least 100 ms, then 200 each; the sum bears an accept that
    // comes late on a loaded machine.
    let sum: u128 = gaps[..4].iter().sum();
    assert!(sum >= 650, "{gaps:?}");
    assert!(!running.has_good_samples());
    let links = running.recorder.recording().links;
    assert!(links.iter().any(|(_, text)| text.contains(message)), "{links:?}");
}

#[test]
fn never_answers() {
    check(|_| Some(Vec::new()), "no answer within 100 ms");
}

#[test]
fn closes_at_once() {
    check(|_| None, "closed the connection");
}

#[test]
fn answers_garbage() {
    // As many bytes as the garbage claims to have.
    check(|_| at_once(vec![0xA5; 6 + 0xA5A5]), "cannot be used");
}

#[test]
fn answers_garbage_that_claims_more() {
    check(|_| at_once(vec![0xA5; 300]), "no answer within 100 ms");
}

#[test]
fn answers_an_empty_frame() {
    check(|r| at_once([&r[..4], &[0, 0, 1, 3]].concat()), "cannot be used");
}

#[test]
fn answers_another_transaction() {
    let wrong = |r: &[u8]| {
        let mut answer = right(r);
        answer[1] ^= 0x40;
        at_once(answer)
    };
    check(wrong, "another request or unit");
}

#[test]
fn answers_what_another_connection_asked() {
    // The first request of each connection is the same, but for what is ours.
    let kept = Mutex::new(None);
    let swap = move |r: &[u8]| {
        let former = kept.lock().unwrap().replace(right(r));
        former.and_then(at_once)
    };
    let server = Server::start(swap);
    let running = start(server.port, json!({"timeout_seconds": 0.1}), vec![holding(1, 0)]);
    running.wait_for_link(LinkState::Down, "another request or unit");
    assert!(!running.has_good_samples());
}

#[test]
fn answers_for_another_unit() {
    let wrong = |r: &[u8]| {
        let mut answer = right(r);
        answer[6] = 77;
        at_once(answer)
    };
    check(wrong, "another request or unit");
}

#[test]
fn answers_another_function() {
    let wrong = |r: &[u8]| {
        let mut answer = right(r);
        answer[7] = 4;
        at_once(answer)
    };
    check(wrong, "another function");
}

#[test]
fn answers_too_few_registers() {
    let wrong = |r: &[u8]| {
        let mut short = r.to_vec();
        short[11] -= 1;
        at_once(right(&short))
    };
    check(wrong, "holds 1 where 2 were asked for");
}

#[test]
fn answers_too_many_registers() {
    let wrong = |r: &[u8]| {
        let mut long = r.to_vec();
        long[11] += 1;
        at_once(right(&long))
    };
    check(wrong, "holds 3 where 2 were asked for");
}

#[test]
fn claims_more_bytes_than_it_sends() {
    let wrong = |r: &[u8]| {
        let mut answer = right(r);
        answer[8] = 250;
        at_once(answer)
    };
    check(wrong, "cannot be used");
}

#[test]
fn stops_halfway() {
    check(|r| at_once(right(r)[..10].to_vec()), "no answer within 100 ms");
}

#[test]
fn answers_too_late() {
    // The answer itself is right, but by then nobody waits for it.
    let late = |r: &[u8]| Some(vec![(Duration::from_millis(300), right(r))]);
    check(late, "no answer within 100 ms");
}

#[test]
fn dribbles_one_byte_at_a_time() {
    let slow = |r: &[u8]| {
        let bytes = right(r).into_iter();
        Some(bytes.map(|b| (Duration::from_millis(30), vec![b])).collect())
    };
    check(slow, "no answer within 100 ms");
}

#[test]
fn a_proper_answer_is_taken() {
    // Shows that the cases above fail for their fault, not for the server.
    let server = Server::start(|r| at_once(right(r)));
    let running = start(server.port, json!({}), vec![holding(1, 0)]);
    running.wait_for(1, Value::F64(f64::from(0xDEAD)));
}

/// Returns the reconnection delays that the adapter reported, in seconds, after at least `count`
/// failures.
fn delays(running: &Running, count: usize) -> Vec<f64> {
    let delays = |seen: &busbar_plugin_sdk::testing::Recording| -> Vec<f64> {
        let delay =
            |text: &str| text.rsplit_once("next try in ")?.1.strip_suffix(" s")?.parse().ok();
        seen.links.iter().filter_map(|(_, text)| delay(text)).collect()
    };
    let has_failed = |seen: &_| delays(seen).len() >= count;
    assert!(running.recorder.wait_until(PATIENCE, has_failed));
    delays(&running.recorder.recording())
}

/// Starts an adapter whose delays grow for long.
fn start_patient(port: u16, tags: Vec<TagSpec>) -> Running {
    let delays = ReconnectBounds { max: Duration::from_secs(3), ..QUICK };
    start_with(json!({"host": "127.0.0.1", "port": port}), delays, tags)
}

#[test]
fn tries_thin_out_when_it_answers_once_and_closes() {
    // The second request is for register 500.
    let server = Server::start(|r| if r[8..10] == [0, 0] { at_once(right(r)) } else { None });
    let running = start_patient(server.port, vec![holding(1, 0), holding(2, 500)]);
    let delays = delays(&running, 4);
    // At least 100, 200, 400 and 800 ms.
    assert!(delays[2] >= 0.4 && delays[3] >= 0.8, "{delays:?}");
    let links = running.recorder.recording().links;
    assert!(links.iter().any(|(state, _)| *state == LinkState::Up), "{links:?}");
}

#[test]
fn tries_start_over_after_a_whole_cycle() {
    let requests = AtomicUsize::new(0);
    let third_closes = move |r: &[u8]| {
        let is_third = requests.fetch_add(1, Ordering::SeqCst) % 3 == 2;
        if is_third { None } else { at_once(right(r)) }
    };
    let server = Server::start(third_closes);
    let running = start_patient(server.port, vec![holding(1, 0), holding(2, 500)]);
    let delays = delays(&running, 4);
    assert!(delays.iter().all(|delay| *delay <= 0.2), "{delays:?}");
}
