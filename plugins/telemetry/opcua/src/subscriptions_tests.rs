//! Message matrix: seeded sequences of faulty messages against an oracle that knows the
//! truth, and single cases.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use async_opcua::types::{DateTime, MonitoredItemNotification, SignedSoftwareCertificate, Variant};
use busbar_plugin_sdk::testing::{
    FaultGenerator, MessageFault, TruthMoment, TruthOracle, host, matrix_steps, tag_spec,
};
use busbar_plugin_sdk::{Reason, TagSpec, Text, Value, ValueKind};
use serde_json::json;

use super::*;
use crate::Settings;
use crate::points::Points;

/// Tags, each of an item of its own, and subscriptions that share them.
const TAGS: u32 = 6;
const SUBSCRIPTIONS: u32 = 2;
/// Time from one look of the server at its values to the next.
const STEP: Duration = Duration::from_millis(100);
/// Looks without a change after which there is a keep-alive.
const KEEP_ALIVE: u32 = 5;
/// Longest time that a value may be good after a sign that it is old.
const BOUND: Duration = Duration::from_millis(250);
/// Steps of one seed with faults, and steps without after which all is well.
const STEPS: usize = 400;
const CALM_STEPS: usize = 60;
/// Kinds of servers, and steps of all seeds of all of them where the environment says nothing.
const SERVERS: u64 = 5;
const SAMPLE: u64 = 18_400;
const TICKS_TO_1970: i64 = 116_444_736_000_000_000;

/// Number of a keep-alive, as servers count.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Counting {
    Standard,
    /// Keep-alives use up numbers of their own.
    Own,
    /// Keep-alives repeat the last notification's number.
    Last,
}

/// A server of which the truth is known.
struct Model {
    counting: Counting,
    /// True where the server keeps notifications for Republish.
    keeps: bool,
    values: [i64; TAGS as usize],
    published: [i64; TAGS as usize],
    subscriptions: Vec<ModelSubscription>,
}

#[derive(Default)]
struct ModelSubscription {
    next: u32,
    idle: u32,
    kept: BTreeMap<u32, NotificationMessage>,
    /// Numbers of lost notifications that no later message has revealed yet.
    lost: BTreeSet<u32>,
}

/// A message on its way.
#[derive(Clone)]
struct Sent {
    answer: PublishResponse,
    /// Tags whose present truth it has.
    tags: Vec<u32>,
    /// Instant at which it was sent.
    moment: TruthMoment,
}

fn tags() -> Vec<TagSpec> {
    let address = |tag| json!({ "node": format!("ns=2;s=N{tag}") });
    let kind = |tag| if is_text(tag) { ValueKind::Text } else { ValueKind::I64 };
    (0..TAGS).map(|tag| tag_spec(tag, &format!("N{tag}"), kind(tag), address(tag))).collect()
}

/// Reports whether a tag is a text: every other one.
fn is_text(tag: u32) -> bool {
    tag % 2 == 1
}

/// Returns the value that a tag has for a number of the model.
fn value_of(tag: u32, number: i64) -> Value {
    match is_text(tag) {
        true => Value::Text(Text::cut(&format!("mode {number}"))),
        false => Value::I64(number),
    }
}

fn items(subscription: u32) -> Range<usize> {
    let count = (TAGS / SUBSCRIPTIONS) as usize;
    let first = subscription as usize * count;
    first..first + count
}

fn data(handle: u32, value: i64) -> MonitoredItemNotification {
    let variant = match is_text(handle) {
        true => Variant::from(format!("mode {value}")),
        false => Variant::Int64(value),
    };
    let value = DataValue { value: Some(variant), ..DataValue::default() };
    MonitoredItemNotification { client_handle: handle, value }
}

fn changes(items: Vec<MonitoredItemNotification>) -> ExtensionObject {
    ExtensionObject::from_message(DataChangeNotification {
        monitored_items: Some(items),
        diagnostic_infos: None,
    })
}

fn message(number: u32, at: SystemTime, data: Option<Vec<ExtensionObject>>) -> NotificationMessage {
    let since = at.duration_since(SystemTime::UNIX_EPOCH).unwrap().as_nanos() / 100;
    NotificationMessage {
        sequence_number: number,
        publish_time: DateTime::from(i64::try_from(since).unwrap() + TICKS_TO_1970),
        notification_data: data,
    }
}

impl Model {
    fn new(counting: Counting, keeps: bool, values: [i64; TAGS as usize]) -> Self {
        let fresh = || ModelSubscription { next: 1, ..ModelSubscription::default() };
        let subscriptions = (0..SUBSCRIPTIONS).map(|_| fresh()).collect();
        // All values are reported first.
        Self { counting, keeps, values, published: [-1; TAGS as usize], subscriptions }
    }

    /// Looks at the values of a subscription; what is to be told of them.
    fn look(&mut self, index: u32, at: SystemTime, moment: TruthMoment) -> Option<Sent> {
        let changed: Vec<_> =
            items(index).filter(|&item| self.values[item] != self.published[item]).collect();
        let one = &mut self.subscriptions[index as usize];
        let is_first = one.next == 1 && one.idle == 0;
        one.idle += 1;
        let (data, number) = if changed.is_empty() {
            if !is_first && one.idle < KEEP_ALIVE {
                return None;
            }
            let number = match self.counting {
                Counting::Last if one.next > 1 => one.next - 1,
                _ => one.next,
            };
            one.next += u32::from(self.counting == Counting::Own);
            (None, number)
        } else {
            one.next += 1;
            let told = changed.iter().map(|&item| data(item as u32, self.values[item]));
            (Some(vec![changes(told.collect())]), one.next - 1)
        };
        one.idle = 0;
        changed.iter().for_each(|&item| self.published[item] = self.values[item]);
        let message = message(number, at, data);
        if self.keeps && message.notification_data.is_some() {
            one.kept.insert(number, message.clone());
        }
        let answer = PublishResponse {
            subscription_id: index,
            available_sequence_numbers: Some(one.kept.keys().copied().collect()),
            notification_message: message,
            ..PublishResponse::default()
        };
        Some(Sent { answer, tags: changed.into_iter().map(|item| item as u32).collect(), moment })
    }
}

/// A server, an adapter, and a judge of it.
struct Matrix {
    model: Model,
    set: SubscriptionSet,
    point_states: Rc<RefCell<PointStates>>,
    oracle: TruthOracle,
    faults: FaultGenerator,
    start: Instant,
    inquiries: Vec<Inquiry>,
    /// Comes after the next message.
    late: Option<Sent>,
    number: i64,
    sessions: u32,
}

impl Matrix {
    fn new(seed: u64, counting: Counting, keeps: bool, rarity: usize) -> Self {
        let tags = tags();
        let mut oracle = TruthOracle::new(seed, BOUND, &tags);
        let settings: Settings = serde_json::from_value(json!({"url": "opc.tcp://plc"})).unwrap();
        let config = settings.parse().unwrap();
        let points = Points::parse(&tags, &config).unwrap();
        let point_states =
            Rc::new(RefCell::new(PointStates::new(points, &config, oracle.sink(), host())));
        let values = std::array::from_fn(|index| index as i64);
        for tag in 0..TAGS {
            oracle.set_truth(tag, Some(value_of(tag, values[tag as usize])));
        }
        let set = SubscriptionSet::new(Rc::clone(&point_states), Vec::new());
        let mut matrix = Self {
            model: Model::new(counting, keeps, values),
            set,
            point_states,
            oracle,
            faults: FaultGenerator::new(seed).with_rarity(rarity),
            start: Instant::now(),
            inquiries: Vec::new(),
            late: None,
            number: 100,
            sessions: 0,
        };
        matrix.connect();
        matrix
    }

    fn moment(&self) -> Moment {
        Moment { now: self.start + self.oracle.now(), wall: self.oracle.wall_clock() }
    }

    /// Begins a session, in which all former values are bad.
    fn connect(&mut self) {
        self.sessions += 1;
        self.point_states.borrow_mut().lose(Reason::Communication);
        let (counting, keeps) = (self.model.counting, self.model.keeps);
        self.model = Model::new(counting, keeps, self.model.values);
        self.set = SubscriptionSet::new(Rc::clone(&self.point_states), Vec::new());
        let (due, silence) = (STEP * KEEP_ALIVE, Duration::from_secs(3600));
        for id in 0..SUBSCRIPTIONS {
            let now = self.moment().now;
            self.set.add(Subscription::new(id, items(id), due, silence, now));
        }
        (self.inquiries, self.late) = (Vec::new(), None);
    }

    fn change(&mut self) {
        while self.faults.one_in(3) {
            let tag = self.faults.below(TAGS as usize);
            self.number += 1;
            // Now and then it goes back to what it was.
            let value = match self.faults.one_in(4) {
                true => self.model.published[tag].max(0),
                false => self.number,
            };
            self.model.values[tag] = value;
            self.oracle.set_truth(tag as u32, Some(value_of(tag as u32, value)));
        }
    }

    fn deliver(&mut self, sent: &Sent, has_present_truth: bool) {
        let id = sent.answer.subscription_id;
        let tags = || items(id).map(|item| item as u32);
        let message = &sent.answer.notification_message;
        let repeats = self.model.counting == Counting::Last && message.notification_data.is_none();
        let end = message.sequence_number + u32::from(repeats);
        if let Some(one) = self.model.subscriptions.get_mut(id as usize)
            && one.lost.first().is_some_and(|lost| *lost < end)
        {
            one.lost.retain(|lost| *lost >= end);
            // A late message tells what was lost until it was sent, and nothing of since.
            self.oracle.note_late_sign(tags(), "a gap", sent.moment);
        }
        if has_present_truth {
            sent.tags.iter().for_each(|tag| self.oracle.note_message(*tag));
        }
        let at = self.moment();
        self.set.take(sent.answer.clone(), at).unwrap();
    }

    fn note_lost(&mut self, sent: &Sent) {
        if !sent.tags.is_empty() {
            let number = sent.answer.notification_message.sequence_number;
            let one = &mut self.model.subscriptions[sent.answer.subscription_id as usize];
            one.lost.insert(number);
        }
    }

    /// Sends a message with a fault, or without.
    fn send(&mut self, mut sent: Sent, fault: Option<MessageFault>) {
        let id = sent.answer.subscription_id;
        let has_data = !sent.tags.is_empty();
        let all = 0..TAGS;
        let own = items(id).map(|item| item as u32);
        let data = &mut sent.answer.notification_message.notification_data;
        match fault {
            None => self.deliver(&sent, true),
            Some(MessageFault::Lost) => {
                self.note_lost(&sent);
            }
            Some(MessageFault::Oversized) => {
                // The library gives the connection up.
                self.oracle.note_sign(all, "an oversized message");
                self.connect();
            }
            Some(MessageFault::Cut) if has_data => {
                *data = Some(vec![ExtensionObject::null()]);
                self.oracle.note_sign(own, "a cut notification");
                self.deliver(&sent, false);
            }
            Some(MessageFault::Unknown) if has_data => {
                let unknown = ExtensionObject::from_message(SignedSoftwareCertificate::default());
                *data = Some(vec![unknown]);
                self.oracle.note_sign(own, "a notification of an unknown type");
                self.deliver(&sent, false);
            }
            Some(MessageFault::Misassigned) if has_data => {
                if self.faults.one_in(2) {
                    self.note_lost(&sent);
                    sent.answer.subscription_id = SUBSCRIPTIONS + 7;
                    self.oracle.note_sign(all, "a subscription that there is not");
                } else {
                    let handle = self.faults.number() as u32 | 0x8000;
                    *data = Some(vec![changes(vec![self::data(handle, 1)])]);
                    self.oracle.note_sign(own, "a handle that nobody has");
                }
                self.deliver(&sent, false);
            }
            Some(MessageFault::Duplicated) => {
                self.deliver(&sent, true);
                self.deliver(&sent, false);
            }
            Some(MessageFault::Reordered) if self.late.is_none() => self.late = Some(sent),
            Some(_) => self.deliver(&sent, true),
        }
    }

    /// Answers the requests of the step before.
    fn answer(&mut self) {
        for inquiry in std::mem::take(&mut self.inquiries) {
            let at = self.moment();
            match inquiry {
                Inquiry::Republish { subscription, number } => {
                    let one = &mut self.model.subscriptions[subscription as usize];
                    let message = one.kept.get(&number).cloned();
                    if message.is_some() {
                        // It may be asked for before a message tells that it is lost.
                        one.lost.remove(&number);
                    }
                    self.set.take_republished(subscription, number, message, at).unwrap();
                }
                Inquiry::Read { subscription, epoch, items } => {
                    let values = items.into_iter().map(|item| {
                        let value = data(item as u32, self.model.values[item]).value;
                        (item, value)
                    });
                    let values: Vec<_> = values.collect();
                    self.set.take_read(subscription, epoch, values, at);
                }
                Inquiry::Refresh => unreachable!("there are no conditions"),
            }
        }
    }

    fn step(&mut self, is_faulty: bool) {
        self.change();
        if self.faults.one_in(2) {
            self.answer();
            // Between a reading and the next look.
            self.change();
        }
        let at = self.oracle.wall_clock();
        for id in 0..SUBSCRIPTIONS {
            let moment = self.oracle.moment();
            let Some(sent) = self.model.look(id, at, moment) else { continue };
            let fault = if is_faulty { self.faults.next_fault() } else { None };
            let (late, sessions) = (self.late.take(), self.sessions);
            self.send(sent, fault);
            // A session that ended sends nothing more.
            if let Some(late) = late.filter(|_| sessions == self.sessions) {
                self.deliver(&late, false);
            }
        }
        for one in &mut self.model.subscriptions {
            while one.kept.len() > 20 {
                one.kept.pop_first();
            }
        }
        let now = self.moment().now;
        self.inquiries.extend(self.set.inquire(now));
        self.oracle.check();
        self.oracle.advance(STEP);
        self.oracle.check();
    }

    fn run(&mut self) {
        for _ in 0..STEPS {
            self.step(true);
        }
        for _ in 0..CALM_STEPS {
            self.step(false);
        }
    }
}

/// A notification of one item, published so many seconds after the first.
fn notification(subscription: u32, number: u32, seconds: u64, value: i64) -> PublishResponse {
    let at = SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000 + seconds);
    PublishResponse {
        subscription_id: subscription,
        notification_message: message(number, at, Some(vec![changes(vec![data(0, value)])])),
        ..PublishResponse::default()
    }
}

impl Matrix {
    /// Takes a notification of tag 0; the tag's value, and whether it is good.
    fn shown_after(&mut self, answer: PublishResponse) -> (Option<Value>, bool) {
        let at = self.moment();
        self.set.take(answer, at).unwrap();
        (self.oracle.shown(0).value(), self.oracle.is_good(0))
    }

    /// Has the values read that are asked for.
    fn read(&mut self, value: i64) {
        let at = self.moment();
        for inquiry in self.set.inquire(at.now + READ_INTERVAL) {
            let Inquiry::Read { subscription, epoch, items } = inquiry else { continue };
            let values = items.into_iter().map(|item| (item, data(0, value).value));
            self.set.take_read(subscription, epoch, values, at);
        }
    }
}

#[test]
fn a_notification_from_before_one_of_no_subscription_is_not_good() {
    let mut matrix = Matrix::new(0, Counting::Standard, true, 1);
    let value = |value| Some(Value::I64(value));
    assert_eq!(matrix.shown_after(notification(0, 1, 0, 1)), (value(1), true));
    assert_eq!(matrix.shown_after(notification(9, 1, 2, 3)), (value(1), false));
    // It was overtaken by the one of no subscription, which may have a newer value.
    assert_eq!(matrix.shown_after(notification(0, 2, 1, 2)), (value(2), false));
    // A later one has the newest, whatever was lost.
    assert_eq!(matrix.shown_after(notification(0, 3, 3, 4)), (value(4), true));
    assert_eq!(matrix.shown_after(notification(0, 4, 3, 5)), (value(5), true));
}

#[test]
fn a_server_whose_clock_is_set_back_is_not_doubted_for_ever() {
    let mut matrix = Matrix::new(0, Counting::Standard, true, 1);
    matrix.shown_after(notification(9, 1, 3600, 0));
    let goods = (1..100_u32).map(|number| {
        let answer = notification(0, number, number.into(), number.into());
        matrix.shown_after(answer).1
    });
    assert_eq!(goods.filter(|is_good| !is_good).count(), 64);
    assert!(matrix.oracle.is_good(0));
}

#[test]
fn values_that_are_read_end_the_doubt_of_a_server_without_publish_times() {
    let mut matrix = Matrix::new(0, Counting::Standard, true, 1);
    let value = |value| Some(Value::I64(value));
    let untimed = |subscription, number, value| {
        let mut answer = notification(subscription, number, 0, value);
        answer.notification_message.publish_time = DateTime::null();
        answer
    };
    assert_eq!(matrix.shown_after(untimed(0, 1, 1)), (value(1), true));
    assert_eq!(matrix.shown_after(untimed(9, 1, 2)), (value(1), false));
    assert_eq!(matrix.shown_after(untimed(0, 2, 3)), (value(3), false));
    matrix.read(3);
    assert!(matrix.oracle.is_good(0));
    assert_eq!(matrix.shown_after(untimed(0, 3, 4)), (value(4), true));
}

#[test]
fn no_wrong_or_old_value_is_good_whatever_messages_do() {
    let seeds = matrix_steps(SAMPLE).div_ceil(SERVERS * (STEPS + CALM_STEPS) as u64);
    let mut judged = 0;
    for counting in [Counting::Standard, Counting::Own, Counting::Last] {
        for keeps in [true, false] {
            // Without them nothing tells a loss from a server that repeats the last number.
            if counting == Counting::Last && !keeps {
                continue;
            }
            for seed in 0..seeds {
                let rarity = [3, 6, 20, 80][seed as usize % 4];
                let mut matrix = Matrix::new(seed, counting, keeps, rarity);
                matrix.run();
                let counts = matrix.oracle.counts();
                assert!(counts.good * 10 > counts.judged, "{counting:?}, {keeps}: {counts:?}");
                judged += counts.judged;
            }
        }
    }
    assert!(judged > seeds * 12_500, "{judged}");
}
