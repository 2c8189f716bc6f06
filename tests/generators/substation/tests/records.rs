//! Records of the station: the same by the same seed, and of equipment that is there.

use std::collections::BTreeSet;
use std::path::Path;

use substation::{Placement, Station, StationRecords};

#[test]
fn records_follow_their_seed_and_belong_to_equipment_of_the_station() {
    let station = Station::generate(1).expect("it is made");
    let records = StationRecords::generate(&station, 1);
    assert_eq!(records, StationRecords::generate(&station, 1));
    assert_ne!(records, StationRecords::generate(&station, 2));
    let devices: BTreeSet<String> = station.placements.iter().map(Placement::device_id).collect();
    assert!(records.assets.len() > 100 && records.work.len() > 100);
    assert!(records.assets.iter().all(|asset| devices.contains(&asset.equipment)));
    assert!(records.dispatch.keys().all(|equipment| devices.contains(equipment)));
    let numbers: BTreeSet<&str> = records.dispatch.values().map(String::as_str).collect();
    assert_eq!(numbers.len(), records.dispatch.len(), "each number is one breaker's");
    let is_known = |id: &str| devices.contains(id) || numbers.contains(id);
    assert!(records.work.iter().all(|row| is_known(&row.equipment)));
    let open = records.work.iter().filter(|row| row.status != "closed");
    assert!(open.clone().count() > 10 && open.clone().any(|row| row.priority == "1"));
    assert!(records.work.iter().all(|row| row.reported.as_str() <= "2026-11-20"));
}

#[test]
fn what_is_added_to_the_configuration_is_valid_and_used() {
    let station = Station::generate(1).expect("it is made");
    let mut live = station.live_configuration(|switch| switch.closed);
    StationRecords::generate(&station, 1).add_to(&mut live, Path::new("/somewhere"));
    let config = busbar_config::parse(&live.to_string()).expect("it is valid");
    assert_eq!(config.warnings, []);
    assert_eq!(config.records.len(), 2);
}
