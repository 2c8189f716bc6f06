use super::*;

const PARAMETERS: Parameters = Parameters {
    k: 3,
    w: 2,
    t1: Duration::from_secs(15),
    t2: Duration::from_secs(10),
    t3: Duration::from_secs(20),
};
const REQUEST: [u8; 10] = [100, 1, 6, 0, 1, 0, 0, 0, 0, 20];

struct Trial {
    session: Session,
    now: Instant,
    events: Vec<String>,
}

impl Trial {
    fn new() -> Self {
        let now = Instant::now();
        Self { session: Session::new(PARAMETERS, now), now, events: Vec::new() }
    }

    fn started() -> Self {
        let mut trial = Self::new();
        trial.take(Frame::Unnumbered(Function::StartAct)).unwrap();
        assert_eq!(trial.said(), [0x68, 4, 0x0B, 0, 0, 0]);
        trial
    }

    fn take(&mut self, frame: Frame<'_>) -> Result<(), CloseReason> {
        let mut bytes = Vec::new();
        frame.write(&mut bytes);
        let events = &mut self.events;
        // One byte at a time: frames come in any pieces.
        for byte in bytes {
            self.session.receive(&[byte], self.now, |event| events.push(format!("{event:?}")))?;
        }
        Ok(())
    }

    fn request(&mut self, number: u16, acknowledged: u16) -> Result<(), CloseReason> {
        let (send, receive) = (Sequence::new(number), Sequence::new(acknowledged));
        self.take(Frame::Information { send, receive, asdu: &REQUEST })
    }

    fn said(&mut self) -> Vec<u8> {
        self.session.take_output()
    }

    fn pass(&mut self, seconds: u64) -> Result<(), CloseReason> {
        self.now += Duration::from_secs(seconds);
        self.session.tick(self.now)
    }
}

#[test]
fn data_flow_between_start_and_stop_alone() {
    let mut trial = Trial::new();
    assert!(!trial.session.can_send());
    assert_eq!(trial.request(0, 0), Err(CloseReason::NotStarted));
    let mut trial = Trial::started();
    assert_eq!(trial.events, ["Started"]);
    trial.request(0, 0).unwrap();
    assert!(trial.events[1].starts_with("Asdu([100, 1, 6"));
    assert!(trial.session.can_send());
    trial.session.send(&[1, 2], trial.now);
    // N(R) 1 goes along with the data.
    assert_eq!(trial.said(), [0x68, 6, 0, 0, 2, 0, 1, 2]);
    trial.take(Frame::Unnumbered(Function::StopAct)).unwrap();
    assert_eq!(trial.events[2], "Stopped");
    assert!(!trial.session.can_send());
    assert_eq!(trial.said(), [0_u8; 0], "not confirmed while data are not");
    trial.take(Frame::Supervisory(Sequence::new(1))).unwrap();
    assert_eq!(trial.said(), [0x68, 4, 0x23, 0, 0, 0]);
    trial.take(Frame::Unnumbered(Function::StartAct)).unwrap();
    assert_eq!(trial.events[3], "Started");
}

#[test]
fn the_window_is_kept_and_opened() {
    let mut trial = Trial::started();
    for _ in 0..PARAMETERS.k {
        assert!(trial.session.can_send());
        trial.session.send(&[1], trial.now);
    }
    assert!(!trial.session.can_send());
    trial.take(Frame::Supervisory(Sequence::new(1))).unwrap();
    assert!(trial.session.can_send());
    assert_eq!(
        trial.take(Frame::Supervisory(Sequence::new(4))),
        Err(CloseReason::Acknowledgement(4))
    );
}

#[test]
fn requests_are_acknowledged_after_w_or_t2() {
    let mut trial = Trial::started();
    trial.request(0, 0).unwrap();
    assert_eq!(trial.said(), [0_u8; 0]);
    trial.request(1, 0).unwrap();
    assert_eq!(trial.said(), [0x68, 4, 1, 0, 4, 0]);
    trial.request(2, 0).unwrap();
    trial.pass(9).unwrap();
    assert_eq!(trial.said(), [0_u8; 0]);
    trial.pass(1).unwrap();
    assert_eq!(trial.said(), [0x68, 4, 1, 0, 6, 0]);
    assert_eq!(trial.request(4, 0), Err(CloseReason::Sequence { found: 4, wanted: 3 }));
}

#[test]
fn silence_is_tested_and_not_borne() {
    let mut trial = Trial::started();
    assert_eq!(trial.session.deadline(), trial.now + PARAMETERS.t3);
    trial.pass(20).unwrap();
    assert_eq!(trial.said(), [0x68, 4, 0x43, 0, 0, 0]);
    trial.pass(14).unwrap();
    trial.take(Frame::Unnumbered(Function::TestCon)).unwrap();
    trial.pass(20).unwrap();
    assert_eq!(trial.said(), [0x68, 4, 0x43, 0, 0, 0]);
    assert_eq!(trial.pass(15), Err(CloseReason::Timeout(PARAMETERS.t1)));
    let mut trial = Trial::started();
    trial.session.send(&[1], trial.now);
    assert_eq!(trial.pass(15), Err(CloseReason::Timeout(PARAMETERS.t1)));
    let mut trial = Trial::started();
    trial.take(Frame::Unnumbered(Function::TestAct)).unwrap();
    assert_eq!(trial.said(), [0x68, 4, 0x83, 0, 0, 0]);
}

#[test]
fn what_a_controlling_station_never_says_is_a_fault() {
    let mut trial = Trial::started();
    assert_eq!(trial.take(Frame::Unnumbered(Function::StartCon)), Err(CloseReason::Controlled));
    let garbage = trial.session.receive(&[0xE8, 1, 2], trial.now, |_| {});
    assert_eq!(garbage, Err(CloseReason::Frame(FrameError::Start(0xE8))));
}
