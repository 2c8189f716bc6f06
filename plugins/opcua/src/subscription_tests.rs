use async_opcua::types::{DataChangeNotification, DateTime};

use super::*;

fn message(sequence_number: u32, has_data: bool) -> NotificationMessage {
    let data = ExtensionObject::from_message(DataChangeNotification::default());
    NotificationMessage {
        sequence_number,
        publish_time: DateTime::null(),
        notification_data: has_data.then(|| vec![data]),
    }
}

fn subscription() -> Subscription {
    Subscription {
        id: 1,
        items: 0..1,
        limit: Duration::from_secs(2),
        heard: Instant::now(),
        next: None,
        held: BTreeMap::new(),
    }
}

fn take(subscription: &mut Subscription, number: u32, has_data: bool) -> Option<Vec<u32>> {
    let ready = subscription.take(message(number, has_data), Instant::now()).ok()?;
    Some(ready.into_iter().map(|message| message.sequence_number).collect())
}

#[test]
fn notifications_come_in_their_order() {
    let mut subscription = subscription();
    assert_eq!(take(&mut subscription, 1, true), Some(vec![1]));
    assert_eq!(take(&mut subscription, 3, true), Some(vec![]));
    assert_eq!(take(&mut subscription, 4, true), Some(vec![]));
    assert_eq!(take(&mut subscription, 2, true), Some(vec![2, 3, 4]));
    assert_eq!(take(&mut subscription, 2, true), Some(vec![]), "it came before");
    assert_eq!(take(&mut subscription, 5, false), Some(vec![]), "a sign of life");
    assert_eq!(take(&mut subscription, 5, true), Some(vec![5]));
}

#[test]
fn a_lost_notification_is_noticed() {
    let mut subscription = subscription();
    take(&mut subscription, 1, true);
    assert_eq!(take(&mut subscription, 3, false), None);
    let mut subscription = self::subscription();
    take(&mut subscription, 1, true);
    let lost = (3..).take(MAX_HELD + 1).any(|n| take(&mut subscription, n, true).is_none());
    assert!(lost);
}

#[test]
fn numbers_begin_anew() {
    let mut subscription = subscription();
    assert_eq!(take(&mut subscription, u32::MAX, true), Some(vec![u32::MAX]));
    assert_eq!(take(&mut subscription, 1, true), Some(vec![1]));
}

#[test]
fn silence_has_a_limit() {
    let subscription = subscription();
    let heard = subscription.heard;
    assert!(!subscription.is_overdue(heard + Duration::from_secs(2)));
    assert!(subscription.is_overdue(heard + Duration::from_millis(2001)));
}

#[test]
fn at_least_one_interval_passes() {
    let millis = Duration::from_millis;
    assert_eq!(count(millis(2500), millis(500)), 5);
    assert_eq!(count(millis(100), millis(500)), 1);
}
