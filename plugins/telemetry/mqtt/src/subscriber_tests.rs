use busbar_plugin_sdk::testing::{Recorder, host, tag_spec};
use busbar_plugin_sdk::{Quality, ValueKind};
use serde_json::json;

use super::*;
use crate::points;
use crate::settings::Settings;

fn plan(settings: serde_json::Value, addresses: &[serde_json::Value]) -> Result<Plan, Error> {
    let config = config(settings);
    let spec = |(tag, address): (u32, &serde_json::Value)| {
        tag_spec(tag, "t", ValueKind::F64, address.clone())
    };
    let tags: Vec<_> = (0..).zip(addresses).map(spec).collect();
    Plan::new(points::parse(tags.iter()).unwrap(), &config)
}

fn config(settings: serde_json::Value) -> Config {
    serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap()
}

#[test]
fn a_filter_that_is_refused_makes_its_tags_bad() {
    let addresses = [
        json!({"topic": "a/1"}),
        json!({"topic": "a/2"}),
        json!({"topic": "b"}),
        json!({"group": "g", "edge_node": "e", "metric": "m"}),
    ];
    let settings = json!({"host": "h", "subscriptions": ["a/#"]});
    let plan = plan(settings.clone(), &addresses).unwrap();
    assert_eq!(plan.filters, ["a/#", "b", "spBv1.0/g/+/e", "spBv1.0/g/+/e/+"]);
    let (recorder, now) = (Recorder::new(), Instant::now());
    let mut subscriber = Subscriber::new(plan, &config(settings), recorder.sink(), host());
    subscriber.note(Event::Connected, now);
    for filter in [0, 3] {
        subscriber.note(Event::Refused(filter, "it may not"), now);
    }
    subscriber.note(Event::Subscribed, now);
    subscriber.flush();
    let quality = |tag: u32| recorder.latest(tag).unwrap().quality;
    let refused = Quality::Bad(Reason::Configuration);
    assert_eq!(
        [0, 1, 2, 3].map(quality),
        [refused, refused, Quality::Bad(Reason::NotConnected), refused]
    );
    let links = recorder.recording().links;
    assert!(links.back().unwrap().1.contains("refuses 2 of 4 topic filters"), "{links:?}");
}

#[test]
fn topics_without_a_filter_are_bounded() {
    let addresses: Vec<_> =
        (0..=MAX_FILTERS).map(|index| json!({ "topic": format!("a/{index}") })).collect();
    let fault = plan(json!({"host": "h"}), &addresses).err().unwrap();
    assert!(fault.message().contains("set subscriptions to filters"), "{fault}");
    assert!(plan(json!({"host": "h", "subscriptions": ["a/+"]}), &addresses).is_ok());
}
