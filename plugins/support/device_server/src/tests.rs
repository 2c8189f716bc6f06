//! Tests of each fault against real sockets, with an echo protocol.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};

use busbar_plugin_sdk::simulation::{FaultKind, FaultPlan};
use busbar_plugin_sdk::testing::host;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

use super::*;

/// Longest wait on a loaded machine; a test that passes does not wait for it.
const PATIENCE: Duration = Duration::from_secs(20);
/// Deadline of the echo's answers.
const DEADLINE: Duration = Duration::from_millis(400);
/// Period of faults: one of 4 to 8 seconds begins between the first and the third second.
const PERIOD: Duration = Duration::from_secs(12);
const LONGEST: Duration = Duration::from_secs(8);
const PING: &[u8] = b"ping, and some more than that";

struct Echo {
    server: DeviceServer,
    address: SocketAddr,
}

impl Echo {
    fn start(faults: FaultPlan) -> Self {
        let link = FaultyLink::new(faults, 1, DEADLINE);
        let endpoints = [("127.0.0.1".to_owned(), 0)];
        let server = DeviceServer::start("echo", &endpoints, link, &host(), serve).unwrap();
        let endpoint = server.status().endpoint;
        let address = endpoint.strip_prefix("listens at ").unwrap().parse().unwrap();
        Self { server, address }
    }

    fn failing(kind: FaultKind) -> Self {
        Self::start(FaultPlan::new(3, &[kind], PERIOD, LONGEST).unwrap())
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        stream
    }

    fn wait_for(&self, fault: Option<FaultKind>) {
        let begun = Instant::now();
        while self.server.status().fault != fault {
            assert!(begun.elapsed() < PATIENCE, "{fault:?} does not come");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

async fn serve(listeners: Vec<tokio::net::TcpListener>, link: FaultyLink) {
    for listener in listeners {
        while let Ok((stream, _)) = listener.accept().await {
            let Some(mut client) = link.admit(stream) else { continue };
            let link = link.clone();
            tokio::spawn(async move {
                let mut bytes = [0; 256];
                while let Ok(count @ 1..) = client.read(&mut bytes).await {
                    link.count_messages(1);
                    if client.write_all(&bytes[..count]).await.is_err() {
                        return;
                    }
                }
            });
        }
    }
}

/// Sends the ping; returns the bytes received, at most as many.
fn ping(stream: &mut TcpStream) -> std::io::Result<Vec<u8>> {
    stream.write_all(PING)?;
    let mut answer = vec![0; PING.len()];
    let count = stream.read(&mut answer)?;
    answer.truncate(count);
    Ok(answer)
}

fn is_reset(error: &std::io::Error) -> bool {
    matches!(error.kind(), ErrorKind::ConnectionReset | ErrorKind::BrokenPipe)
}

#[test]
fn a_healthy_link_hands_on_and_counts() {
    let echo = Echo::start(FaultPlan::none());
    let mut streams = [echo.connect(), echo.connect()];
    for stream in &mut streams {
        assert_eq!(ping(stream).unwrap(), PING);
    }
    let status = echo.server.status();
    assert_eq!((status.clients, status.connections, status.messages), (2, 2, 2));
    assert_eq!(status.fault, None);
    drop(streams);
    let begun = Instant::now();
    while echo.server.status().clients > 0 {
        assert!(begun.elapsed() < PATIENCE, "clients that are gone have no place");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn more_clients_than_allowed_are_turned_away() {
    let echo = Echo::start(FaultPlan::none());
    let mut streams: Vec<_> = (0..MAX_CLIENTS).map(|_| echo.connect()).collect();
    assert!(streams.iter_mut().all(|stream| ping(stream).unwrap() == PING));
    let turned_away = ping(&mut echo.connect());
    assert!(turned_away.is_err() || turned_away.is_ok_and(|answer| answer.is_empty()));
}

#[test]
fn a_place_that_is_taken_is_named_with_the_remedy() {
    let echo = Echo::start(FaultPlan::none());
    let taken = [("127.0.0.1".to_owned(), echo.address.port())];
    let link = FaultyLink::new(FaultPlan::none(), 1, DEADLINE);
    let refused = DeviceServer::start("second", &taken, link, &host(), serve);
    let message = refused.err().map(|error| error.message().to_owned()).unwrap();
    assert!(message.contains(&echo.address.port().to_string()), "{message}");
    assert!(message.contains("nobody else has"), "{message}");
}

#[test]
fn a_lost_link_ends_connections_and_takes_none() {
    let echo = Echo::failing(FaultKind::LinkLoss);
    let mut before = echo.connect();
    assert_eq!(ping(&mut before).unwrap(), PING);
    echo.wait_for(Some(FaultKind::LinkLoss));
    let mut byte = [0];
    assert!(before.read(&mut byte).map_or_else(|error| is_reset(&error), |count| count == 0));
    let refused = ping(&mut echo.connect());
    assert!(refused.is_err() || refused.is_ok_and(|answer| answer.is_empty()));
    echo.wait_for(None);
    assert_eq!(ping(&mut echo.connect()).unwrap(), PING);
}

#[test]
fn a_half_open_link_is_silent_and_then_reset() {
    let echo = Echo::failing(FaultKind::HalfOpen);
    let mut stream = echo.connect();
    assert_eq!(ping(&mut stream).unwrap(), PING);
    echo.wait_for(Some(FaultKind::HalfOpen));
    // Nothing comes until the fault is over, and then no answer.
    let ended = ping(&mut stream);
    assert!(ended.as_ref().is_err_and(is_reset), "{ended:?}");
    assert_eq!(echo.server.status().fault, None);
    assert_eq!(ping(&mut echo.connect()).unwrap(), PING);
}

#[test]
fn resets_end_every_connection() {
    let echo = Echo::failing(FaultKind::Reset);
    let mut before = echo.connect();
    echo.wait_for(Some(FaultKind::Reset));
    let mut byte = [0];
    assert!(before.read(&mut byte).is_err_and(|error| is_reset(&error)));
    let ended = echo.connect().read(&mut byte);
    assert!(ended.as_ref().is_err_and(is_reset), "{ended:?}");
    echo.wait_for(None);
    assert_eq!(ping(&mut echo.connect()).unwrap(), PING);
}

#[test]
fn garbage_comes_instead_of_answers() {
    let echo = Echo::failing(FaultKind::Garbage);
    let mut stream = echo.connect();
    assert_eq!(ping(&mut stream).unwrap(), PING);
    echo.wait_for(Some(FaultKind::Garbage));
    let garbage = ping(&mut stream).unwrap();
    assert!(!garbage.is_empty() && !PING.starts_with(&garbage), "{garbage:?}");
    let mut rest = Vec::new();
    assert!(stream.read_to_end(&mut rest).is_err_and(|error| is_reset(&error)));
    assert_eq!(ping(&mut echo.connect()).unwrap(), PING);
}

#[test]
fn slow_answers_keep_the_deadline_and_late_ones_do_not() {
    for (kind, least) in [(FaultKind::Slow, DEADLINE / 4), (FaultKind::Late, DEADLINE * 3 / 2)] {
        let echo = Echo::failing(kind);
        let mut stream = echo.connect();
        assert_eq!(ping(&mut stream).unwrap(), PING);
        echo.wait_for(Some(kind));
        let begun = Instant::now();
        assert_eq!(ping(&mut stream).unwrap(), PING);
        assert!(begun.elapsed() >= least, "{kind:?}: {:?}", begun.elapsed());
    }
}

#[test]
fn only_a_clock_jump_sets_the_clock_wrong() {
    let plan = |kind| FaultPlan::new(3, &[kind], PERIOD, LONGEST).unwrap();
    for (kind, is_wrong) in [(FaultKind::ClockJump, true), (FaultKind::Slow, false)] {
        let link = FaultyLink::new(plan(kind), 1, DEADLINE);
        let begun = Instant::now();
        while link.fault_kind() != Some(kind) {
            assert!(begun.elapsed() < PATIENCE, "{kind:?} does not come");
            std::thread::sleep(Duration::from_millis(5));
        }
        let (said, is) = link.now();
        let distance = said.duration_since(is).unwrap_or_else(|behind| behind.duration());
        assert_eq!(distance >= Duration::from_secs(600), is_wrong, "{kind:?}");
    }
}

#[test]
fn dropping_it_frees_the_port() {
    let echo = Echo::start(FaultPlan::none());
    let mut stream = echo.connect();
    assert_eq!(ping(&mut stream).unwrap(), PING);
    let address = echo.address;
    drop(echo);
    assert!(stream.read(&mut [0]).map_or(true, |count| count == 0));
    drop(std::net::TcpListener::bind(address).unwrap());
}
