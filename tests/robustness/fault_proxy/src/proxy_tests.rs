use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use super::*;

/// Longest wait for events that are immediate on an idle machine.
const PATIENCE: Duration = Duration::from_secs(10);
/// Answer of the server to any request.
const ANSWER: &[u8] = b"twenty bytes, always";

/// Starts a server that sends the answer for each piece that it receives.
fn server() -> SocketAddr {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let address = listener.local_addr().unwrap();
    thread::spawn(move || {
        for mut client in listener.incoming().flatten() {
            thread::spawn(move || {
                let mut heard = [0; 64];
                while client.read(&mut heard).is_ok_and(|count| count > 0) {
                    if client.write_all(ANSWER).is_err() {
                        break;
                    }
                }
            });
        }
    });
    address
}

fn proxy(fault: ConnectionFault, max_bytes: usize) -> FaultProxy {
    FaultProxy::start(server(), FaultScript { seed: 5, faults: vec![fault], max_bytes }).unwrap()
}

fn connect(proxy: &FaultProxy) -> TcpStream {
    let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, proxy.port())).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

fn ask(stream: &mut TcpStream, bytes: usize) -> std::io::Result<Vec<u8>> {
    stream.write_all(b"?")?;
    let mut answer = vec![0; bytes];
    stream.read_exact(&mut answer).map(|()| answer)
}

#[test]
fn what_is_not_to_be_broken_is_whole() {
    for fault in [ConnectionFault::None, ConnectionFault::Split, ConnectionFault::Delay] {
        let proxy = proxy(fault, 0);
        let mut stream = connect(&proxy);
        for _ in 0..5 {
            assert_eq!(ask(&mut stream, ANSWER.len()).unwrap(), ANSWER, "{fault:?}");
        }
        assert_eq!((proxy.connections(), proxy.strikes()), (1, 0));
    }
}

#[test]
fn a_connection_is_reset_or_closed_where_the_seed_says() {
    for (fault, expected) in [
        (ConnectionFault::Reset, ErrorKind::ConnectionReset),
        (ConnectionFault::Close, ErrorKind::UnexpectedEof),
    ] {
        let proxy = proxy(fault, 19);
        let script = FaultScript { seed: 5, faults: vec![fault], max_bytes: 19 };
        for index in 0..20 {
            let mut stream = connect(&proxy);
            stream.write_all(b"?").unwrap();
            let mut heard = Vec::new();
            let ended = stream.read_to_end(&mut heard);
            // A reset may throw away what came before it.
            let sent = script.plan(index).strike_after;
            if fault == ConnectionFault::Reset {
                assert_eq!(ended.unwrap_err().kind(), expected);
                assert!(heard.len() <= sent);
            } else {
                assert_eq!(heard, ANSWER[..sent], "{index}");
            }
        }
        assert_eq!((proxy.connections(), proxy.strikes()), (20, 20));
    }
}

#[test]
fn who_vanishes_says_nothing() {
    let proxy = proxy(ConnectionFault::Vanish, 0);
    let mut stream = connect(&proxy);
    stream.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    for _ in 0..2 {
        let kind = ask(&mut stream, 1).unwrap_err().kind();
        assert!(matches!(kind, ErrorKind::WouldBlock | ErrorKind::TimedOut), "{kind:?}");
    }
}

#[test]
fn bytes_dribble() {
    let proxy = proxy(ConnectionFault::Trickle, 0);
    let mut stream = connect(&proxy);
    let started = Instant::now();
    assert_eq!(ask(&mut stream, 4).unwrap(), ANSWER[..4]);
    assert!(started.elapsed() >= Duration::from_millis(300), "{:?}", started.elapsed());
}

#[test]
fn garbage_comes_before_the_answer() {
    let proxy = proxy(ConnectionFault::Garbage, 0);
    let mut stream = connect(&proxy);
    stream.write_all(b"?").unwrap();
    let mut heard = Vec::new();
    let mut chunk = [0; 64];
    while !heard.ends_with(ANSWER) {
        let count = stream.read(&mut chunk).unwrap();
        heard.extend_from_slice(&chunk[..count]);
    }
    assert!(heard.len() > ANSWER.len());
}

#[test]
fn an_old_answer_comes_to_the_next_connection() {
    let proxy = proxy(ConnectionFault::Swap, 0);
    assert_eq!(ask(&mut connect(&proxy), 1).unwrap_err().kind(), ErrorKind::UnexpectedEof);
    // Two answers to one question: the old one, and then the fault strikes again.
    let mut stream = connect(&proxy);
    assert_eq!(ask(&mut stream, ANSWER.len()).unwrap(), ANSWER);
    assert_eq!(stream.read(&mut [0; 1]).unwrap(), 0);
}

#[test]
fn a_seed_decides_it_all() {
    let plans = |seed| {
        let faults = vec![ConnectionFault::Reset, ConnectionFault::Close, ConnectionFault::Swap];
        let script = FaultScript { seed, faults, max_bytes: 1000 };
        (0..100)
            .map(|index| script.plan(index))
            .map(|plan| (plan.fault, plan.strike_after))
            .collect::<Vec<_>>()
    };
    assert_eq!(plans(1), plans(1));
    assert_ne!(plans(1), plans(2));
    for fault in [ConnectionFault::Reset, ConnectionFault::Close, ConnectionFault::Swap] {
        assert!(plans(1).iter().any(|(found, _)| *found == fault), "{fault:?}");
    }
}

#[test]
fn without_a_server_the_client_is_hung_up_on() {
    let nobody = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap().local_addr().unwrap();
    let script = FaultScript { seed: 0, faults: Vec::new(), max_bytes: 0 };
    let proxy = FaultProxy::start(nobody, script).unwrap();
    assert!(ask(&mut connect(&proxy), 1).is_err());
}

#[test]
fn all_can_be_hung_up_on() {
    let proxy = proxy(ConnectionFault::None, 0);
    let mut stream = connect(&proxy);
    ask(&mut stream, ANSWER.len()).unwrap();
    proxy.hang_up();
    assert_eq!(stream.read(&mut [0; 1]).unwrap(), 0);
    ask(&mut connect(&proxy), ANSWER.len()).unwrap();
}

#[test]
fn a_dropped_proxy_leaves_nothing_open() {
    let proxy = proxy(ConnectionFault::None, 0);
    let mut stream = connect(&proxy);
    ask(&mut stream, ANSWER.len()).unwrap();
    let port = proxy.port();
    drop(proxy);
    assert!(ask(&mut stream, 1).is_err());
    assert!(TcpStream::connect((Ipv4Addr::LOCALHOST, port)).is_err());
}
