//! Against servers that break the protocol in every way we know.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::*;

/// What the server does with the bytes of each request: the answer's pieces,
/// with pauses between them, or `None` to close.
type Answer = fn(&[u8]) -> Option<Vec<(Duration, Vec<u8>)>>;

/// Longest life of a connection that the peer left open.
const MAX_CONNECTION_LIFE: Duration = Duration::from_secs(20);

struct Server {
    port: u16,
    accepted: Arc<Mutex<Vec<Instant>>>,
}

impl Server {
    /// Serves until the test's process ends.
    fn start(answer: Answer) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let accepted = Arc::new(Mutex::new(Vec::new()));
        let times = Arc::clone(&accepted);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                times.lock().unwrap().push(Instant::now());
                std::thread::spawn(move || serve(stream, answer));
            }
        });
        Self { port, accepted }
    }

    /// When each connection came, after the first, in milliseconds.
    fn gaps_millis(&self) -> Vec<u128> {
        let times = self.accepted.lock().unwrap();
        times.windows(2).map(|pair| (pair[1] - pair[0]).as_millis()).collect()
    }
}

fn serve(mut stream: TcpStream, answer: Answer) {
    stream.set_read_timeout(Some(MAX_CONNECTION_LIFE)).unwrap();
    let mut request = [0; 12];
    while stream.read_exact(&mut request).is_ok() {
        let Some(pieces) = answer(&request) else {
            return;
        };
        for (pause, bytes) in pieces {
            std::thread::sleep(pause);
            if stream.write_all(&bytes).is_err() {
                return;
            }
        }
    }
}

/// The right answer: every register is 0xDEAD.
fn right(request: &[u8]) -> Vec<u8> {
    let count = usize::from(request[11]);
    let mut answer = request[..4].to_vec();
    answer.extend(((3 + 2 * count) as u16).to_be_bytes());
    answer.extend([request[6], request[7], (2 * count) as u8]);
    answer.extend([0xDE, 0xAD].repeat(count));
    answer
}

fn at_once(bytes: Vec<u8>) -> Option<Vec<(Duration, Vec<u8>)>> {
    Some(vec![(Duration::ZERO, bytes)])
}

/// No value may come of it, tags are bad in time, and tries thin out.
fn check(answer: Answer, message: &str) {
    let server = Server::start(answer);
    let started = Instant::now();
    let running =
        start(server.port, json!({"timeout_millis": 100}), vec![holding(1, 0), holding(2, 1)]);
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
