use super::*;

const KEEP_ALIVE: Duration = Duration::from_secs(10);
const ANSWER: Duration = Duration::from_secs(3);

/// CONNACK packet that reports success.
const ACCEPTED: [u8; 4] = [0x20, 2, 0, 0];
const PONG: [u8; 2] = [0xD0, 0];
const PING: [u8; 2] = [0xC0, 0];

fn parameters() -> Parameters {
    Parameters {
        version: Version::V4,
        client_id: "a".into(),
        login: None,
        will: None,
        keep_alive: KEEP_ALIVE,
        answer_timeout: ANSWER,
        qos: 1,
        max_payload: 100,
    }
}

/// Session under test and a log of its events, in words.
struct Client {
    session: Session,
    now: Instant,
    told: Vec<String>,
}

impl Client {
    fn new(filters: usize) -> Self {
        Self::of_version(Version::V4, filters)
    }

    fn of_version(version: Version, filters: usize) -> Self {
        let now = Instant::now();
        let filters = (0..filters).map(|index| format!("t/{index}")).collect();
        let parameters = Parameters { version, ..parameters() };
        let session = Session::new(&parameters, filters, now).unwrap();
        Self { session, now, told: Vec::new() }
    }

    /// Creates a client that is connected and has subscribed to one filter.
    fn subscribed() -> Self {
        let mut client = Self::new(1);
        client.hear(&ACCEPTED).unwrap();
        client.hear(&[0x90, 3, 0, 1, 1]).unwrap();
        assert_eq!(client.told, ["connected", "subscribed"]);
        client.told.clear();
        client.session.take_output();
        client
    }

    fn hear(&mut self, bytes: &[u8]) -> Result<(), SessionFault> {
        self.session.input().extend_from_slice(bytes);
        self.advance()
    }

    fn advance(&mut self) -> Result<(), SessionFault> {
        let told = &mut self.told;
        self.session.advance(self.now, |event| {
            told.push(match event {
                Event::Connected => "connected".into(),
                Event::Subscribed => "subscribed".into(),
                Event::Refused(index, _) => format!("refused {index}"),
                Event::TooLong { topic, bytes, is_retained } => {
                    format!("{topic}: {bytes} bytes {is_retained}")
                }
                Event::Message { topic, payload, is_retained } => {
                    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
                    format!("{}={} {is_retained}", text(topic), text(payload))
                }
            });
        })?;
        self.session.tick(self.now)
    }

    fn wait(&mut self, time: Duration) -> Result<(), SessionFault> {
        self.now += time;
        self.advance()
    }
}

#[test]
fn nobody_is_asked_for_more_filters_at_once_than_go_into_a_packet() {
    let mut client = Client::new(250);
    client.session.take_output();
    client.hear(&ACCEPTED).unwrap();
    for (id, count) in [(1_u8, 100), (2, 100), (3, 50)] {
        let output = client.session.take_output();
        assert_eq!((output[0], output[4]), (0x82, id), "SUBSCRIBE {id}");
        assert!(!client.session.is_subscribed());
        // The last filter of each packet is refused.
        let mut answer = vec![0x90, 2 + count, 0, id];
        answer.extend(std::iter::repeat_n(1, usize::from(count) - 1).chain([0x80]));
        client.hear(&answer).unwrap();
    }
    let told = ["connected", "refused 99", "refused 199", "refused 249", "subscribed"];
    assert_eq!(client.told, told);
}

#[test]
fn messages_are_confirmed_as_their_quality_of_service_demands() {
    let mut client = Client::subscribed();
    client.hear(&[0x31, 4, 0, 1, b'a', b'x']).unwrap();
    assert!(client.session.take_output().is_empty());
    client.hear(&[0x32, 6, 0, 1, b'a', 0, 7, b'y']).unwrap();
    assert_eq!(&client.session.take_output()[..], [0x40, 2, 0, 7]);
    client.hear(&[0x34, 6, 0, 1, b'a', 0, 8, b'z']).unwrap();
    assert_eq!(&client.session.take_output()[..], [0x50, 2, 0, 8]);
    client.hear(&[0x62, 2, 0, 8]).unwrap();
    assert_eq!(&client.session.take_output()[..], [0x70, 2, 0, 8]);
    assert_eq!(client.told, ["a=x true", "a=y false", "a=z false"]);
}

#[test]
fn a_silent_broker_is_asked_and_then_given_up() {
    let mut client = Client::subscribed();
    client.wait(KEEP_ALIVE / 2).unwrap();
    assert_eq!(&client.session.take_output()[..], PING);
    client.hear(&PONG).unwrap();
    client.wait(KEEP_ALIVE / 2).unwrap();
    assert_eq!(&client.session.take_output()[..], PING);
    // Half a packet is no sign of life once it has come.
    client.hear(&[0x30, 4, 0]).unwrap();
    client.wait(KEEP_ALIVE / 2).unwrap();
    let silent = client.wait(KEEP_ALIVE / 2);
    assert_eq!(silent, Err(SessionFault::Silent(KEEP_ALIVE)));
}

#[test]
fn a_broker_that_never_falls_silent_is_asked_too() {
    let mut client = Client::subscribed();
    let mut pings = 0;
    for _ in 0..100 {
        client.now += Duration::from_secs(1);
        client.hear(&[0x30, 4, 0, 1, b'a', b'x']).unwrap();
        pings += usize::from(client.session.take_output()[..] == PING);
    }
    assert_eq!(pings, 20);
}

#[test]
fn answers_have_a_deadline() {
    let mut client = Client::new(1);
    assert_eq!(client.wait(ANSWER), Err(SessionFault::NoAnswer(ANSWER)));
    let mut client = Client::new(1);
    client.hear(&ACCEPTED).unwrap();
    assert_eq!(client.wait(ANSWER), Err(SessionFault::NoSubscription(ANSWER)));
    let mut client = Client::new(1);
    let early = client.hear(&[0x30, 4, 0, 1, b'a', b'x']);
    assert_eq!(early, Err(SessionFault::OutOfOrder));
}

/// Builds a PUBLISH packet on `a` with a payload of this length.
fn message(version: Version, qos: u8, properties: &[u8], payload: usize) -> Vec<u8> {
    let id: &[u8] = if qos > 0 { &[0, 9] } else { &[] };
    let mut body = [&[0, 1, b'a'][..], id].concat();
    if version == Version::V5 {
        assert!(properties.len() < 16_384);
        body.extend([properties.len() as u8 & 0x7F | 0x80, (properties.len() >> 7) as u8]);
        body.extend_from_slice(properties);
    }
    body.extend(std::iter::repeat_n(b'x', payload));
    let length = body.len();
    let digits =
        [length as u8 & 0x7F | 0x80, (length >> 7) as u8 & 0x7F | 0x80, (length >> 14) as u8];
    [vec![0x30 | qos << 1], digits.to_vec(), body].concat()
}

#[test]
fn the_limit_of_a_payload_holds_to_the_byte() {
    let accepted: [(Version, &[u8], &[u8]); 2] =
        [(Version::V4, &ACCEPTED, &[]), (Version::V5, &[0x20, 3, 0, 0, 0], &[1, 1])];
    for ((version, accepted, properties), qos) in
        accepted.iter().flat_map(|version| (0..=2).map(move |qos| (version, qos)))
    {
        let mut client = Client::of_version(*version, 0);
        client.hear(accepted).unwrap();
        client.told.clear();
        client.session.take_output();
        let limit = parameters().max_payload;
        let replies: [&[u8]; 3] = [&[], &[0x40, 2, 0, 9], &[0x50, 2, 0, 9]];
        for (bytes, is_taken) in
            [(limit, true), (limit + 1, false), (400_000, false), (limit, true)]
        {
            for piece in message(*version, qos, properties, bytes).chunks(1 + bytes / 50) {
                client.hear(piece).unwrap();
                assert!(client.session.input().len() < 300, "what is left out is not kept");
            }
            let told = match is_taken {
                true => format!("a={} false", "x".repeat(bytes)),
                false => format!("a: {bytes} bytes false"),
            };
            assert_eq!(client.told, [told], "{version:?} {qos} {bytes}");
            client.told.clear();
            let output = client.session.take_output();
            assert_eq!(&output[..], replies[usize::from(qos)], "{version:?} {qos} {bytes}");
        }
    }
}

#[test]
fn messages_that_belong_to_no_topic_end_the_connection() {
    // An empty topic and one that is not UTF-8, short and too long.
    let long = |topic: u8| [&[0x30, 0x80 | 100, 7, 0, 1, topic][..], &[b'x'; 1000]].concat();
    let mut empty = long(b'a');
    empty[3..6].copy_from_slice(&[0, 0, b'x']);
    for bytes in [vec![0x30, 4, 0, 1, 0xFF, b'x'], long(0xFF), empty] {
        let outcome = Client::subscribed().hear(&bytes);
        assert!(matches!(outcome, Err(SessionFault::Malformed(_))), "{outcome:?}");
    }
    let mut client = Client::of_version(Version::V5, 0);
    client.hear(&[0x20, 3, 0, 0, 0]).unwrap();
    // A topic alias, which was not offered.
    let outcome = client.hear(&[0x30, 7, 0, 0, 3, 0x23, 0, 1, b'x']);
    assert!(matches!(outcome, Err(SessionFault::Malformed(_))), "{outcome:?}");
}

#[test]
fn an_answer_to_a_subscription_is_one_to_each_filter() {
    let mut client = Client::new(2);
    client.hear(&ACCEPTED).unwrap();
    let outcome = client.hear(&[0x90, 3, 0, 1, 1]);
    assert!(matches!(outcome, Err(SessionFault::Malformed(_))), "{outcome:?}");
}
