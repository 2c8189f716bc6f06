//! Servers that send anything but answers.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::thread;

use super::*;

/// Serves a number of connections each with these bytes, after the client's first ones.
fn server(bytes: Vec<u8>) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || {
        for stream in listener.incoming().take(3) {
            let Ok(mut stream) = stream else { return };
            let mut hello = [0; 64];
            let _ = stream.read(&mut hello);
            let _ = stream.write_all(&bytes);
            thread::sleep(Duration::from_millis(1500));
        }
    });
    port
}

fn chunk(kind: &[u8], size: u32, rest: &[u8]) -> Vec<u8> {
    [kind, b"F", &size.to_le_bytes(), rest].concat()
}

#[track_caller]
fn check(bytes: Vec<u8>, message: &str) {
    let port = server(bytes);
    let settings = json!({"connect_timeout_seconds": 1});
    let running = start(port, &settings, vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for_link(LinkState::Down, message);
    running.wait_for_bad(1, Reason::Communication);
    assert!(!running.has_good_samples());
}

#[test]
fn another_protocol_is_named() {
    check(b"HTTP/1.1 400 Bad Request\r\n\r\n".to_vec(), "no OPC UA over TCP; is the port right?");
}

#[test]
fn a_chunk_of_gigabytes_is_refused() {
    check(chunk(b"MSG", u32::MAX, &[0; 100]), "a chunk of 4294967295 bytes");
}

#[test]
fn silence_has_a_limit() {
    check(Vec::new(), "did not answer within 1000 ms");
}

#[test]
fn an_error_of_the_server_is_repeated() {
    let reason = b"go away";
    let mut body = 0x807D_0000_u32.to_le_bytes().to_vec();
    body.extend((reason.len() as u32).to_le_bytes());
    body.extend(reason);
    let size = 8 + body.len() as u32;
    check(chunk(b"ERR", size, &body), "go away");
}

#[test]
fn an_answer_of_nonsense_ends_the_connection() {
    // An acknowledgement of Hello that is good, then a message that nobody asked for.
    let mut bytes = chunk(b"ACK", 28, &[]);
    for field in [0_u32, 65_536, 65_536, 0, 0] {
        bytes.extend(field.to_le_bytes());
    }
    bytes.extend(chunk(b"OPN", 60, &[0xFF; 52]));
    check(bytes, "next try in");
}

#[test]
fn nobody_listens() {
    let port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let running = start(port, &json!({}), vec![tag(1, ValueKind::F64, "A")]);
    running.wait_for_link(LinkState::Down, "connection refused");
    running.wait_for_bad(1, Reason::Communication);
}
