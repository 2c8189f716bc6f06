//! A hundred thousand tags and ten thousand nodes.

use std::time::Instant;

use busbar_point_import::{Catalogue, MAX_LISTED, NodeName, TagName, propose};

const BAYS: u32 = 90;
/// Devices of a bay, each of three poles.
const DEVICES: [&str; 12] =
    ["QA1", "QB1", "QB2", "QB9", "QC1", "QC2", "QC9", "BC1", "BC2", "BV1", "FA1", "UP1"];
const SIGNALS: [&str; 11] = [
    "Status",
    "Alarm",
    "Temp",
    "Trip",
    "Health.stVal",
    "Value",
    "Warning",
    "Fault",
    "Mx.mag",
    "Cnt",
    "Blocked",
];
const LEVELS: [(&str, &str); 3] = [("D1", "220kV"), ("E1", "110kV"), ("H1", "35kV")];

#[test]
#[allow(clippy::print_stdout)]
fn a_large_list_is_matched_in_seconds() {
    let mut ids = Vec::new();
    let mut names = Vec::new();
    for (level, voltage) in LEVELS {
        for bay in 1..=BAYS {
            for device in DEVICES {
                for phase in 1..=3 {
                    ids.push(format!("=S12{level}Q{bay}-{device}-L{phase}"));
                    names.push(format!("{voltage}_Bay{bay:02}_{device}_L{phase}"));
                }
            }
        }
    }
    let mut nodes = vec![NodeName { id: "yard", name: "yard", parent: None }];
    nodes.extend(ids.iter().map(|id| NodeName { id, name: id, parent: Some(0) }));
    let tags: Vec<(String, usize)> = SIGNALS
        .iter()
        .flat_map(|signal| names.iter().enumerate().map(move |(i, n)| (format!("{n}.{signal}"), i)))
        .collect();
    let start = Instant::now();
    let model = Catalogue::new(&nodes).expect("they are few enough");
    let tag = |(id, _): &(String, usize)| id.clone();
    let owned: Vec<_> = tags.iter().map(tag).collect();
    let tag_names: Vec<_> =
        owned.iter().map(|id| TagName { id, is_state: true, ..TagName::default() }).collect();
    let proposals = propose(&tag_names, &model);
    println!("{} tags, {} nodes: {:?}", tags.len(), nodes.len(), start.elapsed());
    for ((id, node), proposal) in tags.iter().zip(&proposals) {
        assert_eq!(proposal.node.as_ref(), Some(&ids[*node]), "{id}: {}", proposal.reason);
        assert!(proposal.candidates.len() <= MAX_LISTED);
    }
}

/// A name that fits thousands of nodes is in doubt, and soon.
#[test]
fn a_name_that_says_nothing_fits_too_many() {
    let ids: Vec<_> = (1..=5_000).map(|i| format!("Bay {i} CB")).collect();
    let mut nodes = vec![NodeName { id: "yard", name: "yard", parent: None }];
    nodes.extend(ids.iter().map(|id| NodeName { id, name: id, parent: Some(0) }));
    let model = Catalogue::new(&nodes).expect("they are few enough");
    let tags = vec![TagName { id: "CB.Pos", is_position: true, ..TagName::default() }; 1_000];
    for proposal in propose(&tags, &model) {
        assert_eq!(proposal.node, None);
        assert!(proposal.reason.contains("more than"), "{}", proposal.reason);
    }
}
