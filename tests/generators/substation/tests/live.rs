//! The live station: every point a tag, and scenarios that its configuration bears.

use std::collections::HashMap;
use std::sync::LazyLock;

use busbar_config::Config;
use busbar_types::SignalShape;
use serde_json::Value;
use substation::{Station, points, scenarios};

static LIVE: LazyLock<Value> = LazyLock::new(|| {
    Station::generate(1).expect("a station").live_configuration(|switch| switch.closed)
});
static CONFIG: LazyLock<Config> = LazyLock::new(|| {
    busbar_config::parse(&LIVE.to_string()).unwrap_or_else(|faults| panic!("{faults:#?}"))
});

#[test]
fn every_point_is_a_tag_at_its_equipment() {
    let points = points();
    assert_eq!(CONFIG.tags.len(), points.len());
    let bound: HashMap<&str, &str> =
        CONFIG.bindings.iter().map(|of| (of.tag.as_str(), of.node.as_str())).collect();
    for point in points.iter().filter(|point| point.role != "environment") {
        assert_eq!(bound.get(point.id.as_str()), Some(&point.equipment.as_str()), "{}", point.id);
    }
    assert!(CONFIG.warnings.is_empty(), "{:?}", CONFIG.warnings);
}

#[test]
fn no_two_points_lie_in_the_same_cells() {
    let mut taken: HashMap<(String, u64, String, u64), String> = HashMap::new();
    for (id, tag) in LIVE["tags"].as_object().expect("tags") {
        let (source, address) = (&tag["source"], &tag["source"]["address"]);
        let table = address["table"].as_str().expect("a table");
        let cells = if table == "holding" || tag["type"] == "double_point" { 2 } else { 1 };
        let first = address["register"].as_u64().expect("a register");
        for cell in first..first + cells {
            let plugin = source["instance"].as_str().expect("an instance").to_owned();
            let unit = address["unit"].as_u64().expect("a unit");
            let place = (plugin, unit, table.to_owned(), cell);
            let other = taken.insert(place, id.clone());
            assert_eq!(other, None, "{id} lies there too");
        }
    }
}

#[test]
fn values_that_are_usual_are_within_limits() {
    for (id, tag) in &CONFIG.tags {
        let base = tag.simulate.base;
        let moves = tag.simulate.shape != SignalShape::Constant;
        let amplitude = if moves { tag.simulate.amplitude } else { 0.0 };
        if tag.unit != "MWh" {
            for value in [base - amplitude, base + amplitude] {
                assert!(tag.limits.contains(value), "{id}: {value} is an alarm");
                assert!(tag.range.contains(value), "{id}: {value} cannot be");
            }
        }
    }
}

#[test]
fn scenarios_are_of_tags_that_are_there() {
    let scenarios = scenarios();
    assert_eq!(scenarios.len(), 6);
    for scenario in scenarios {
        let text = scenario.events.to_string();
        let read = busbar_config::parse_scenario(&text, &CONFIG);
        let read = read.unwrap_or_else(|faults| panic!("{}: {faults:#?}", scenario.name));
        assert!(read.events.len() + read.link_faults.len() > 0 && !read.description.is_empty());
    }
}
