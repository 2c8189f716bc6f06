//! Fuzzing of point lists: any bytes are a list or faults with their lines. What is read can be
//! bound to the nodes of a model and makes a scene that the configuration takes.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use busbar_point_import::{
    Catalogue, ListFault, MAX_FAULTS, MAX_LISTED, NodeName, PluginInstance, Point, PointList,
    Proposal, SceneParts, assign_plugins, place, report, scene,
};

/// Nodes of the model: id, name, and index of the parent.
const NODES: [(&str, &str, Option<usize>); 9] = [
    ("S1", "S1", None),
    ("S1/E01", "E01", Some(0)),
    ("S1/E01 Q0", "Q0", Some(1)),
    ("S1/E01 Q1", "Q1", Some(1)),
    ("S1/E01 T1", "T1", Some(1)),
    ("S1/bushing 1U", "bushing 1U", Some(4)),
    ("S1/bushing 1V", "bushing 1V", Some(4)),
    ("S1/E02", "E02", Some(0)),
    ("S1/E02 Q0", "Q0", Some(7)),
];

/// Runs one input; reports whether the point list is accepted.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let list = PointList::parse(bytes);
    check_faults(&list.faults, bytes);
    let mut points = list.points;
    assert!(!list.is_unreadable || !list.faults.is_empty());
    points.iter().for_each(check_point);
    let tags: BTreeSet<_> = points.iter().map(|point| &point.tag).collect();
    assert_eq!(tags.len(), points.len(), "tags that are there twice");
    let plugins = ["device", "other"].map(|name| PluginInstance {
        name: name.into(),
        plugin: "example.telemetry".into(),
        settings: Default::default(),
    });
    let read = points.len();
    let mut faults = assign_plugins(&mut points, &plugins[..1 + bytes.len() % 2]);
    let (proposals, unknown) = place(&mut points, catalogue());
    faults.extend(unknown);
    assert_eq!(points.len() + faults.len(), read, "each point is kept or has a fault");
    check_proposals(&points, &proposals);
    let parts = SceneParts {
        id: "S1".into(),
        model: "s1.glb".into(),
        plugin_directories: vec!["plugins".into()],
        plugins: plugins.into(),
        ..Default::default()
    };
    let text = scene(&parts, &points, &proposals).to_string();
    if let Err(faults) = busbar_config::parse(&text) {
        panic!("the scene is no configuration: {faults:?}\n{text}");
    }
    check_report(&points, &proposals);
    !points.is_empty()
}

fn catalogue() -> &'static Catalogue {
    static CATALOGUE: OnceLock<Catalogue> = OnceLock::new();
    CATALOGUE.get_or_init(|| {
        let nodes = NODES.map(|(id, name, parent)| NodeName { id, name, parent });
        Catalogue::new(&nodes).expect("it is small")
    })
}

fn check_faults(faults: &[ListFault], bytes: &[u8]) {
    assert!(faults.len() <= MAX_FAULTS + 1);
    // Lines end in LF, CR LF or CR.
    let ends = bytes.iter().filter(|byte| b"\r\n".contains(byte)).count() as u64;
    for fault in faults {
        assert!((1..=ends + 1).contains(&fault.line), "{fault}");
        assert!(!fault.cause.is_empty() && !fault.remedy.is_empty(), "{fault}");
    }
}

fn check_point(point: &Point) {
    assert!(!point.tag.is_empty());
    for [low, high] in [point.range, point.limits] {
        assert!(low.into_iter().chain(high).all(f64::is_finite));
        assert!(low.zip(high).is_none_or(|(low, high)| low < high), "{point:?}");
    }
    assert!(point.scale.is_none_or(|[factor, offset]| {
        factor.is_finite() && factor != 0.0 && offset.is_finite()
    }));
}

fn check_proposals(points: &[Point], proposals: &[Proposal]) {
    assert_eq!(points.len(), proposals.len());
    for proposal in proposals {
        assert!(proposal.candidates.len() <= MAX_LISTED && !proposal.reason.is_empty());
        let named = proposal.candidates.iter().map(|candidate| &candidate.node);
        for node in named.chain(&proposal.node) {
            assert!(NODES.iter().any(|(id, ..)| id == node), "no node '{node}'");
        }
        let confidences = proposal.candidates.iter().map(|candidate| candidate.confidence);
        assert!(confidences.into_iter().all(|confidence| (0.0..=1.0).contains(&confidence)));
    }
}

/// Checks that the report has every tag, unchanged.
fn check_report(points: &[Point], proposals: &[Proposal]) {
    assert!(!report::markdown(points, proposals).is_empty());
    let text = report::csv(points, proposals);
    let mut rows = csv::Reader::from_reader(text.as_bytes());
    let tags: Vec<_> = rows
        .records()
        .map(|row| row.expect("the report is CSV").get(0).unwrap_or_default().to_owned())
        .collect();
    assert!(points.iter().map(|point| &point.tag).eq(&tags), "{tags:?}");
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("point_list", fuzz_one);
}
