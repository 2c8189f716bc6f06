use std::time::Duration;

use iec61850_rs::ber::Cursor;
use iec61850_rs::proto::mms::{
    AccessResult, ConfirmedResponse, ObjectName, Unconfirmed, VariableAccess, association,
};

use super::*;

const TIMEOUT: Duration = Duration::from_secs(5);
const TEST: Duration = Duration::from_secs(10);

fn parameters() -> Parameters {
    let both = association::Selectors::defaults();
    let selectors = addressing::Selectors { remote: both.clone(), local: both };
    Parameters { selectors, password: None, timeout: TIMEOUT, test: TEST }
}

/// Creates both ends of a connection.
fn pair(key: u16, now: Instant) -> (Session<u32>, Association) {
    let mut session = Session::new(&parameters(), key, now);
    let mut server = Association::server(AssociationConfig::default());
    session.start(now).unwrap();
    let mut is_up = false;
    for _ in 0..4 {
        exchange(&mut session, &mut server, now, |event| is_up |= event == Event::Up);
    }
    assert!(is_up && session.has_room());
    (session, server)
}

fn exchange(
    session: &mut Session<u32>,
    server: &mut Association,
    now: Instant,
    mut handle: impl FnMut(Event<u32>),
) {
    server.on_bytes(iec61850_rs::Instant::ZERO, &session.take_output());
    while let Some(bytes) = server.poll_transmit() {
        session.receive(bytes, now, &mut handle).unwrap();
    }
}

fn requests(server: &mut Association) -> Vec<i64> {
    std::iter::from_fn(|| server.poll_event())
        .filter_map(|event| match event {
            AssociationEvent::Request { invoke_id, .. } => Some(invoke_id),
            _ => None,
        })
        .collect()
}

#[test]
fn answers_find_their_requests_and_those_of_other_connections_none() {
    let now = Instant::now();
    let (mut session, mut server) = pair(5, now);
    session.send(Request::Identify, 1, now).unwrap();
    session.send(Request::Identify, 2, now).unwrap();
    exchange(&mut session, &mut server, now, |_| {});
    let ids = requests(&mut server);
    assert_eq!(ids, [5 << 16 | 1, 5 << 16 | 2]);
    let identify = || ConfirmedResponse::Identify { vendor: "v", model: "m", revision: "r" };
    let mut answered = Vec::new();
    for id in [4 << 16 | 1, ids[1], ids[0], ids[0]] {
        server.respond(id, &identify()).unwrap();
        exchange(&mut session, &mut server, now, |event| match event {
            Event::Answer(job, Answer::Identified) => answered.push(job),
            other => panic!("{other:?}"),
        });
    }
    assert_eq!(answered, [2, 1]);
}

/// Latin-1 in a VisibleString, as a member of a report.
#[test]
fn a_report_with_a_text_that_is_none_does_not_end_the_connection() {
    let now = Instant::now();
    let (mut session, mut server) = pair(0, now);
    let text = Cursor::new(b"\x8A\x02S\xFC").next_required().unwrap();
    let results = vec![AccessResult::Success(text)];
    let access = VariableAccess::VariableListName(ObjectName::VmdSpecific("RPT"));
    let report = Mms::Unconfirmed(Unconfirmed::InformationReport { access, results });
    server.send(&report).unwrap();
    let mut events = Vec::new();
    exchange(&mut session, &mut server, now, |event| events.push(event));
    let is_told = matches!(
        &events[..],
        [Event::Unusable(Unusable { report_id: None, why })] if why.contains("is not ASCII")
    );
    assert!(is_told && session.has_room(), "{events:?}");
}

#[test]
fn silence_is_found_out_in_time() {
    let now = Instant::now();
    let (mut session, _) = pair(0, now);
    assert!(!session.is_idle(now + TEST - Duration::from_millis(1)));
    assert_eq!(session.deadline(), now + TEST);
    assert!(session.is_idle(now + TEST));
    let asked = now + TEST;
    session.send(Request::Identify, 1, asked).unwrap();
    assert_eq!(session.deadline(), asked + TIMEOUT);
    assert_eq!(session.tick(asked + TIMEOUT - Duration::from_millis(1)), Ok(()));
    let fault = session.tick(asked + TIMEOUT).unwrap_err();
    assert_eq!(fault.to_string(), "no answer to a test of the connection within 5000 ms");
}

#[test]
fn an_association_that_does_not_come_about_is_given_up() {
    let now = Instant::now();
    let mut session = Session::<u32>::new(&parameters(), 0, now);
    session.start(now).unwrap();
    assert_eq!(session.deadline(), now + TIMEOUT);
    assert!(!session.has_room());
    assert_eq!(session.tick(now + TIMEOUT), Err(SessionFault::NoAssociation(TIMEOUT)));
}

#[test]
fn no_more_requests_are_under_way_than_agreed() {
    let now = Instant::now();
    let (mut session, _) = pair(0, now);
    let mut sent = 0;
    while session.has_room() {
        session.send(Request::Identify, sent, now).unwrap();
        sent += 1;
    }
    assert_eq!(sent as usize, MAX_IN_FLIGHT);
}
