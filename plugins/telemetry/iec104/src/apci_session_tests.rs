use proptest::prelude::*;

use super::*;

const SECOND: Duration = Duration::from_secs(1);

fn parameters() -> Parameters {
    Parameters { k: 3, w: 2, t1: 15 * SECOND, t2: 10 * SECOND, t3: 20 * SECOND }
}

/// The other end: numbers what it sends, as a well-behaved station.
struct Bench {
    session: Session,
    now: Instant,
    sent: u16,
    asdus: Vec<Vec<u8>>,
}

impl Bench {
    fn new() -> Self {
        let now = Instant::now();
        Self { session: Session::new(parameters(), now), now, sent: 0, asdus: Vec::new() }
    }

    fn started() -> Self {
        let mut bench = Self::new();
        bench.session.start(bench.now);
        assert_eq!(bench.output(), [frame(Frame::Unnumbered(Function::StartAct))]);
        bench.receive(Frame::Unnumbered(Function::StartCon)).unwrap();
        assert!(bench.session.is_started());
        bench
    }

    fn receive(&mut self, given: Frame<'_>) -> Result<(), SessionFault> {
        self.session.receive(&frame(given), self.now, |event| {
            if let Event::Asdu(asdu) = event {
                self.asdus.push(asdu.to_vec());
            }
        })
    }

    /// A data frame that acknowledges all before `receive`.
    fn data(&mut self, asdu: &[u8], receive: u16) -> Result<(), SessionFault> {
        let send = Sequence::new(self.sent);
        self.sent += 1;
        self.receive(Frame::Information { send, receive: Sequence::new(receive), asdu })
    }

    fn pass(&mut self, time: Duration) -> Result<(), SessionFault> {
        self.now += time;
        self.session.tick(self.now)
    }

    /// The frames that it sent since the last call.
    fn output(&mut self) -> Vec<Vec<u8>> {
        let bytes = self.session.take_output();
        let mut rest = &bytes[..];
        let mut frames = Vec::new();
        while let Some((_, taken)) = split_frame(rest).unwrap() {
            frames.push(rest[..taken].to_vec());
            rest = &rest[taken..];
        }
        assert!(rest.is_empty());
        frames
    }
}

fn frame(frame: Frame<'_>) -> Vec<u8> {
    let mut bytes = Vec::new();
    frame.write(&mut bytes);
    bytes
}

fn acknowledgement(receive: u16) -> Vec<u8> {
    frame(Frame::Supervisory(Sequence::new(receive)))
}

fn information(send: u16, receive: u16, asdu: &[u8]) -> Vec<u8> {
    let (send, receive) = (Sequence::new(send), Sequence::new(receive));
    frame(Frame::Information { send, receive, asdu })
}

#[test]
fn reception_is_acknowledged_after_w_frames_or_t2() {
    let mut bench = Bench::started();
    bench.data(&[1], 0).unwrap();
    assert_eq!(bench.output(), [] as [Vec<u8>; 0]);
    bench.data(&[2], 0).unwrap();
    assert_eq!(bench.output(), [acknowledgement(2)]);
    bench.data(&[3], 0).unwrap();
    bench.pass(9 * SECOND).unwrap();
    assert_eq!(bench.output(), [] as [Vec<u8>; 0]);
    bench.pass(SECOND).unwrap();
    assert_eq!(bench.output(), [acknowledgement(3)]);
    assert_eq!(bench.asdus, [[1], [2], [3]]);
}

#[test]
fn sending_waits_for_the_window_and_acknowledges() {
    let mut bench = Bench::started();
    bench.data(&[9], 0).unwrap();
    for asdu in 0..5 {
        bench.session.send(vec![asdu], bench.now).unwrap();
    }
    let sent = bench.output();
    assert_eq!(sent, [information(0, 1, &[0]), information(1, 1, &[1]), information(2, 1, &[2])]);
    // What they acknowledged needs no frame of its own.
    bench.pass(10 * SECOND).unwrap();
    assert_eq!(bench.output(), [] as [Vec<u8>; 0]);
    bench.receive(Frame::Supervisory(Sequence::new(2))).unwrap();
    assert_eq!(bench.output(), [information(3, 1, &[3]), information(4, 1, &[4])]);
    // The third, sent ten seconds ago, is the one that is late first.
    assert!(bench.pass(4 * SECOND).is_ok());
    let late = bench.pass(SECOND).unwrap_err();
    assert!(late.to_string().contains("no answer to a request within 15000 ms (t1)"), "{late}");
}

#[test]
fn requests_wait_for_the_start_and_do_not_pile_up() {
    let mut bench = Bench::new();
    for _ in 0..MAX_WAITING {
        bench.session.send(vec![1], bench.now).unwrap();
    }
    assert_eq!(bench.session.send(vec![1], bench.now), Err(SessionFault::Overrun));
    assert_eq!(bench.output(), [] as [Vec<u8>; 0]);
    bench.session.start(bench.now);
    bench.session.start(bench.now);
    assert_eq!(bench.output().len(), 1, "asked once");
    bench.receive(Frame::Unnumbered(Function::StartCon)).unwrap();
    assert_eq!(bench.output().len(), 3, "as many as k");
}

#[test]
fn a_silent_station_is_tested_and_then_given_up() {
    let mut bench = Bench::started();
    assert_eq!(bench.session.deadline(), bench.now + 20 * SECOND);
    bench.pass(20 * SECOND).unwrap();
    assert_eq!(bench.output(), [frame(Frame::Unnumbered(Function::TestAct))]);
    bench.receive(Frame::Unnumbered(Function::TestCon)).unwrap();
    bench.pass(19 * SECOND).unwrap();
    assert_eq!(bench.output(), [] as [Vec<u8>; 0]);
    bench.pass(SECOND).unwrap();
    assert_eq!(bench.output().len(), 1);
    assert_eq!(bench.session.deadline(), bench.now + 15 * SECOND);
    bench.pass(14 * SECOND).unwrap();
    // Data does not make up for the missing confirmation.
    bench.data(&[1], 0).unwrap();
    let late = bench.pass(SECOND).unwrap_err();
    assert!(late.to_string().contains("a test of the connection"), "{late}");
}

#[test]
fn a_start_that_is_not_confirmed_is_given_up() {
    let mut bench = Bench::new();
    bench.session.start(bench.now);
    let late = bench.pass(15 * SECOND).unwrap_err();
    assert!(late.to_string().contains("the start of data transfer"), "{late}");
}

#[test]
fn tests_by_the_station_are_confirmed() {
    let mut bench = Bench::new();
    bench.receive(Frame::Unnumbered(Function::TestAct)).unwrap();
    assert_eq!(bench.output(), [frame(Frame::Unnumbered(Function::TestCon))]);
}

#[test]
fn faults_of_the_station_are_named() {
    let mut bench = Bench::started();
    bench.sent = 1;
    let skipped = bench.data(&[1], 0);
    assert_eq!(skipped, Err(SessionFault::Sequence { found: 1, wanted: 0 }));

    let mut bench = Bench::started();
    let unsent = bench.receive(Frame::Supervisory(Sequence::new(1)));
    assert_eq!(unsent, Err(SessionFault::Acknowledgement(1)));

    let mut bench = Bench::new();
    assert_eq!(bench.data(&[1], 0), Err(SessionFault::NotStarted));
    assert_eq!(bench.asdus, [] as [Vec<u8>; 0]);

    let mut bench = Bench::started();
    let ended = bench.receive(Frame::Unnumbered(Function::StopCon));
    assert_eq!(ended, Err(SessionFault::Stopped));

    for function in [Function::StartAct, Function::StopAct] {
        let mut bench = Bench::started();
        let fault = bench.receive(Frame::Unnumbered(function));
        assert_eq!(fault, Err(SessionFault::Controlling));
    }
}

#[test]
fn sequence_numbers_go_on_past_their_end() {
    let mut bench = Bench::started();
    for index in 0..70_000_u32 {
        bench.data(&[1], (index % 32_768) as u16).unwrap();
        bench.sent %= 32_768;
        bench.session.send(vec![2], bench.now).unwrap();
        let next = ((index + 1) % 32_768) as u16;
        assert_eq!(bench.output(), [information((index % 32_768) as u16, next, &[2])]);
    }
    assert_eq!(bench.asdus.len(), 70_000);
}

proptest! {
    #[test]
    fn however_bytes_are_cut_the_data_are_the_same(
        asdus in prop::collection::vec(prop::collection::vec(any::<u8>(), 1..40), 1..20),
        cuts in prop::collection::vec(1_usize..50, 1..100),
    ) {
        let mut bytes = frame(Frame::Unnumbered(Function::StartCon));
        for (send, asdu) in (0..).zip(&asdus) {
            bytes.extend(information(send, 0, asdu));
        }
        let now = Instant::now();
        let mut session = Session::new(parameters(), now);
        session.start(now);
        let (mut rest, mut cuts, mut received) = (&bytes[..], cuts.into_iter().cycle(), Vec::new());
        while !rest.is_empty() {
            let (piece, after) = rest.split_at(cuts.next().unwrap().min(rest.len()));
            session.receive(piece, now, |event| {
                if let Event::Asdu(asdu) = event {
                    received.push(asdu.to_vec());
                }
            }).unwrap();
            rest = after;
        }
        prop_assert_eq!(received, asdus);
    }

    #[test]
    fn any_bytes_keep_memory_bounded(
        chunks in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..300), 0..20),
        is_start_byte_right: bool,
    ) {
        let now = Instant::now();
        let mut session = Session::new(parameters(), now);
        session.start(now);
        for mut chunk in chunks {
            if let (true, Some(first)) = (is_start_byte_right, chunk.first_mut()) {
                *first = 0x68;
            }
            if session.receive(&chunk, now, |_| {}).is_err() {
                break;
            }
            prop_assert!(session.input.len() < crate::codec::MAX_FRAME_BYTES);
        }
    }
}
