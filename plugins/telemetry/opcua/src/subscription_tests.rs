use super::*;

#[test]
fn silence_is_told_from_a_slow_sign_of_life() {
    let (due, silence) = (Duration::from_secs(30), Duration::from_secs(2));
    let subscription = Subscription::new(1, 0..1, due, silence, Instant::now());
    let heard = subscription.heard;
    assert!(!subscription.is_overdue(heard + due + silence));
    assert!(subscription.is_overdue(heard + due + silence + Duration::from_millis(1)));
}

#[test]
fn at_least_one_interval_passes() {
    let millis = Duration::from_millis;
    assert_eq!(count(millis(2500), millis(500)), 5);
    assert_eq!(count(millis(100), millis(500)), 1);
}
