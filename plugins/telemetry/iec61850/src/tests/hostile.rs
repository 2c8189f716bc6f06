//! Against servers that are none, and servers that answer what was not asked.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Instant;

use iec61850_rs::Limits;
use iec61850_rs::proto::mms::association::{Association, AssociationConfig, AssociationEvent};
use iec61850_rs::proto::mms::{ConfirmedRequest, ConfirmedResponse, Mms};

use super::*;

fn quick() -> serde_json::Value {
    json!({"connect_seconds": 0.5, "timeout_seconds": 0.3, "test_seconds": 0.2})
}

/// A server for one client after the other; `serve` is what it does with each.
fn server(serve: impl Fn(TcpStream) + Send + 'static) -> u16 {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    thread::spawn(move || {
        // Clients that have gone are no fault here; the test ends the process.
        for client in listener.incoming().map_while(Result::ok) {
            serve(client);
        }
    });
    port
}

/// No value may come of it, and tags are bad in time.
#[track_caller]
fn check(port: u16, message: &str) {
    let started = Instant::now();
    let running = start(port, quick(), vec![tag(1, ValueKind::F64, "MMXU1.TotW", "MX")]);
    running.wait_for_bad(1, Reason::Communication);
    assert!(started.elapsed() < Duration::from_millis(1500), "{:?}", started.elapsed());
    running.wait_for_link(LinkState::Down, message);
    assert!(!running.has_good_samples());
}

/// Answers whatever comes with these bytes.
fn answering(bytes: &'static [u8]) -> u16 {
    server(move |mut client| {
        let mut buffer = [0; 4096];
        while let Ok(1..) = client.read(&mut buffer) {
            if client.write_all(bytes).is_err() {
                return;
            }
        }
    })
}

#[test]
fn is_no_mms_server() {
    check(answering(b"HTTP/1.1 400 Bad Request\r\n\r\n"), "is not MMS");
}

#[test]
fn never_answers() {
    check(answering(b""), "no association within 300 ms");
}

#[test]
fn closes_at_once() {
    check(server(drop), "closed the connection");
}

/// A COTP disconnect request, with the class as its reason.
#[test]
fn refuses_the_transport() {
    check(answering(&[3, 0, 0, 11, 6, 0x80, 0, 1, 0, 0, 0]), "the server ended the association");
}

/// A proper association, in which each request is answered by `answer`.
fn associated(
    answer: fn(i64, &ConfirmedRequest<'_>) -> Option<Mms<'static>>,
) -> (u16, Arc<AtomicBool>) {
    let is_asked = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&is_asked);
    let port = server(move |mut client| {
        let mut end = Association::server(AssociationConfig::default());
        let (mut buffer, clock) = ([0; 4096], iec61850_rs::Instant::ZERO);
        while let Ok(count @ 1..) = client.read(&mut buffer) {
            end.on_bytes(clock, &buffer[..count]);
            while let Some(event) = end.poll_event() {
                let AssociationEvent::Request { invoke_id, pdu } = event else { continue };
                told.store(true, Ordering::Relaxed);
                let Ok(Mms::ConfirmedRequest { service, .. }) = Mms::parse(&pdu, &Limits::DEFAULT)
                else {
                    panic!("no request: {pdu:?}");
                };
                if let Some(answer) = answer(invoke_id, &service) {
                    end.send(&answer).unwrap();
                }
            }
            while let Some(bytes) = end.poll_transmit() {
                if client.write_all(bytes).is_err() {
                    return;
                }
            }
        }
    });
    (port, is_asked)
}

#[test]
fn answers_another_service() {
    let (port, is_asked) = associated(|invoke_id, _| {
        let service = ConfirmedResponse::FileDelete;
        Some(Mms::ConfirmedResponse { invoke_id, service })
    });
    check(port, "it answers another service");
    assert!(is_asked.load(Ordering::Relaxed));
}

/// Sends an answer that matches no request, as one of a former connection would.
#[test]
fn answers_a_request_that_was_never_made() {
    let (port, is_asked) = associated(|invoke_id, _| {
        let service = ConfirmedResponse::FileDelete;
        Some(Mms::ConfirmedResponse { invoke_id: invoke_id ^ 0x10_0000, service })
    });
    check(port, "no answer to the question what a variable is made of within 300 ms");
    assert!(is_asked.load(Ordering::Relaxed));
}

#[test]
fn stops_answering_after_the_association() {
    let (port, _) = associated(|_, _| None);
    check(port, "no answer to the question what a variable is made of within 300 ms");
}

#[test]
fn ends_the_association() {
    let (port, _) = associated(|_, _| Some(Mms::ConcludeRequest));
    check(port, "the server ended the association");
}
