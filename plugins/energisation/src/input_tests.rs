//! Inputs of operators, machines and instrument transformers, through the overlay itself.

use std::time::Duration;

use busbar_plugin_sdk::testing::{draw_at, host};
use busbar_plugin_sdk::{
    Binding, DoublePoint, Overlay, Plugin, Quality, Reason, TagValue, Value, ValueKind,
};
use serde_json::{Value as Json, json};

use crate::*;

const OPEN: Value = Value::DoublePoint(DoublePoint::Off);
const CLOSED: Value = Value::DoublePoint(DoublePoint::On);
const MOVING: Value = Value::DoublePoint(DoublePoint::Intermediate);
const YES: Value = Value::Bool(true);
const NO: Value = Value::Bool(false);

/// A tag: equipment, role, unit, value and quality.
struct Tag(&'static str, &'static str, &'static str, Option<Value>, Quality);

fn tag(id: &'static str, role: &'static str, value: Value) -> Tag {
    Tag(id, role, "", Some(value), Quality::Good)
}

fn reading(id: &'static str, role: &'static str, unit: &'static str, value: f64) -> Tag {
    Tag(id, role, unit, Some(Value::F64(value)), Quality::Good)
}

fn bad(Tag(id, role, unit, value, _): Tag) -> Tag {
    Tag(id, role, unit, value, Quality::Bad(Reason::Communication))
}

/// An overlay with its tags.
struct Station {
    overlay: EnergisationOverlay,
    bindings: Vec<(String, String)>,
}

impl Station {
    fn new(settings: &Json, tags: &[Tag]) -> Self {
        let settings = serde_json::from_value(settings.clone()).unwrap();
        let mut overlay = EnergisationOverlay::create(settings, host()).unwrap();
        let binding = |Tag(id, role, unit, value, _): &Tag| Binding {
            node: 0,
            kind: value.map_or(ValueKind::F64, Value::kind),
            limit_low: None,
            limit_high: None,
            tag_id: format!("{id}.{role}"),
            tag_name: String::new(),
            unit: (*unit).into(),
            node_id: (*id).into(),
            role: (*role).into(),
        };
        overlay.configure(tags.iter().map(binding).collect()).unwrap();
        let bindings = tags.iter().map(|tag| (tag.0.to_owned(), tag.1.to_owned())).collect();
        Self { overlay, bindings }
    }

    fn draw(&mut self, tags: &[Tag]) {
        let value = |Tag(_, _, _, value, quality): &Tag| TagValue {
            value: *value,
            quality: *quality,
            age: Duration::ZERO,
        };
        let values: Vec<TagValue> = tags.iter().map(value).collect();
        draw_at(&mut self.overlay, None, &values, 0).unwrap();
    }

    fn judgment(&self, id: &str) -> &PieceJudgment {
        let equipment = self.overlay.describe().equipment;
        let piece = equipment.iter().position(|of| of == id).unwrap();
        self.overlay.judgments().pieces[piece].as_ref().unwrap()
    }

    fn state(&self, id: &str) -> PieceState {
        self.judgment(id).state
    }

    /// Tags that a judgment rests on, as equipment and role.
    fn basis(&self, id: &str) -> Vec<String> {
        let basis = self.judgment(id).basis.clone();
        let name = |&binding: &usize| {
            let (id, role) = &self.bindings[binding];
            format!("{id}.{role}")
        };
        self.overlay.judgments().basis()[basis].iter().map(name).collect()
    }
}

fn station(settings: &Json, tags: &[Tag]) -> Station {
    let mut station = Station::new(settings, tags);
    station.draw(tags);
    station
}

/// A line feeds a busbar over a breaker; a transformer with a breaker on its low side
/// feeds another busbar; each side of the transformer has an earth switch.
fn two_levels() -> Json {
    json!({
        "levels": [
            { "name": "110 kV", "color": "#aa2200" },
            { "name": "20 kV", "color": "#2200aa" },
        ],
        "nodes": [
            { "id": "line", "level": "110 kV", "equipment": ["LINE"] },
            { "id": "high", "level": "110 kV", "equipment": ["HIGH", "VT"] },
            { "id": "low", "level": "20 kV", "equipment": ["LOW"] },
            { "id": "bus", "level": "20 kV", "equipment": ["BUS"] },
        ],
        "branches": [
            { "equipment": "QA1", "between": ["line", "high"], "switch": true },
            { "equipment": "T1", "between": ["high", "low"] },
            { "equipment": "QA2", "between": ["low", "bus"], "kind": "breaker" },
        ],
        "earths": [
            { "equipment": "QC1", "node": "high" },
            { "equipment": "QC2", "node": "low" },
        ],
        "sources": [{ "node": "line" }],
    })
}

fn switches(qa1: Value, qa2: Value, qc1: Value, qc2: Value) -> Vec<Tag> {
    let values = [("QA1", qa1), ("QA2", qa2), ("QC1", qc1), ("QC2", qc2)];
    values.map(|(id, value)| tag(id, "position", value)).into()
}

#[test]
fn no_earth_passes_a_winding() {
    let with_earth = station(&two_levels(), &switches(OPEN, CLOSED, CLOSED, OPEN));
    assert_eq!(with_earth.state("HIGH"), PieceState::Earthed);
    for dead in ["LOW", "BUS", "T1"] {
        assert_eq!(with_earth.state(dead), PieceState::Dead, "{dead}");
    }
    // Feeding passes it, whichever way.
    let fed = station(&two_levels(), &switches(CLOSED, CLOSED, OPEN, OPEN));
    assert_eq!(fed.state("BUS"), PieceState::Energised);
}

#[test]
fn no_earth_passes_a_kind_with_windings_within_a_level() {
    let kinds = [
        ("transformer", PieceState::Dead),
        ("auto_transformer", PieceState::Dead),
        ("autotransformer", PieceState::Dead),
        ("auxiliary_transformer", PieceState::Dead),
        ("earthing_transformer", PieceState::Dead),
        ("instrument_transformer", PieceState::Dead),
        ("voltage_transformer", PieceState::Dead),
        ("reactor", PieceState::Dead),
        ("series_reactor", PieceState::Dead),
        ("arc_suppression_coil", PieceState::Dead),
        ("resistor", PieceState::Dead),
        ("capacitor", PieceState::Dead),
        ("current_transformer", PieceState::Earthed),
        ("line", PieceState::Earthed),
        ("cable", PieceState::Earthed),
        ("busbar", PieceState::Earthed),
        ("fuse", PieceState::Earthed),
    ];
    for (kind, expected) in kinds {
        let mut settings = two_levels();
        for node in 0..4 {
            settings["nodes"][node]["level"] = "110 kV".into();
        }
        settings["branches"][1]["kind"] = kind.into();
        let earthed = station(&settings, &switches(OPEN, OPEN, CLOSED, OPEN));
        assert_eq!(earthed.state("LOW"), expected, "{kind}");
        let fed = station(&settings, &switches(CLOSED, OPEN, OPEN, OPEN));
        assert_eq!(fed.state("LOW"), PieceState::Energised, "{kind} is a way of back-feed");
    }
    let mut wrong = two_levels();
    wrong["branches"][1]["kind"] = "transfomer".into();
    let fault = serde_json::from_value::<Settings>(wrong).unwrap_err().to_string();
    assert!(fault.contains("transfomer") && fault.contains("transformer"), "{fault}");
    let mut wrong = two_levels();
    wrong["branches"][2]["switch"] = false.into();
    let fault = Topology::new(&serde_json::from_value(wrong).unwrap()).unwrap_err();
    assert!(fault.to_string().contains("'QA2' is a switch by its 'kind'"), "{fault}");
}

#[test]
fn the_earthing_of_a_star_point_is_no_working_earth() {
    for kind in ["star_point", "solid", "resistor", "coil", "zig_zag", "neutral"] {
        let mut settings = two_levels();
        settings["earths"][0]["kind"] = kind.into();
        let tags = switches(OPEN, OPEN, CLOSED, OPEN);
        let dead = station(&settings, &tags);
        assert_eq!(dead.state("HIGH"), PieceState::Dead, "{kind}");
        let fed = station(&settings, &switches(CLOSED, OPEN, CLOSED, OPEN));
        assert_eq!(fed.state("HIGH"), PieceState::Energised, "{kind} is no contradiction");
    }
}

#[test]
fn a_dead_bus_rests_on_all_its_feeders() {
    let feeders = 200;
    let id = |feeder: usize| -> &'static str { format!("Q{feeder}").leak() };
    let mut settings = two_levels();
    settings["nodes"] = (0..feeders)
        .map(|feeder| json!({ "id": format!("f{feeder}"), "level": "110 kV" }))
        .chain([json!({ "id": "bus", "level": "110 kV", "equipment": ["BUS"] })])
        .collect();
    settings["branches"] = (0..feeders)
        .map(|feeder| {
            let between = ["bus".to_owned(), format!("f{feeder}")];
            json!({ "equipment": id(feeder), "between": between, "switch": true })
        })
        .collect();
    settings["earths"] = json!([]);
    settings["sources"] = (0..feeders).map(|of| json!({ "node": format!("f{of}") })).collect();
    let tags: Vec<Tag> = (0..feeders).map(|of| tag(id(of), "position", OPEN)).collect();
    let mut dead = Station::new(&settings, &tags);
    dead.overlay.update(&values(&tags));
    assert_eq!(dead.state("BUS"), PieceState::Dead);
    assert_eq!(dead.judgment("BUS").basis.len(), feeders);
    // Feeders that lead to no source need not be watched.
    settings["sources"] = json!([{ "node": "f7" }]);
    let dead = station(&settings, &tags);
    assert_eq!(dead.basis("BUS"), ["Q7.position"]);
    // One that is not good is named.
    settings["sources"] = (0..feeders).map(|of| json!({ "node": format!("f{of}") })).collect();
    let mut tags = tags;
    tags[150] = bad(tag(id(150), "position", OPEN));
    let unknown = station(&settings, &tags);
    assert_eq!(unknown.state("BUS"), PieceState::Unknown);
    assert_eq!(unknown.judgment("BUS").reason, "Q150 has no good position");
}

fn values(tags: &[Tag]) -> Vec<TagValue> {
    let value = |Tag(_, _, _, value, quality): &Tag| TagValue {
        value: *value,
        quality: *quality,
        age: Duration::ZERO,
    };
    tags.iter().map(value).collect()
}

#[test]
fn a_contradiction_is_told_where_it_is() {
    let mut station = station(&two_levels(), &switches(CLOSED, OPEN, CLOSED, OPEN));
    let reason = "source line and earth QC1 are surely connected: line - QA1 - QC1";
    for id in ["LINE", "QA1", "HIGH", "T1", "QC1"] {
        let judgment = station.judgment(id);
        assert_eq!(judgment.state, PieceState::Contradiction, "{id}");
        assert_eq!((judgment.standing, &*judgment.reason), (Standing::Unknown, reason), "{id}");
    }
    // Beyond the winding the rest stays.
    assert_eq!(station.state("LOW"), PieceState::Energised);
    assert_eq!(station.state("BUS"), PieceState::Dead);
    assert_eq!(station.basis("HIGH"), ["QA1.position", "QC1.position"]);
    // An earth beyond a winding contradicts the feeding through it, there.
    station.draw(&switches(CLOSED, CLOSED, OPEN, CLOSED));
    assert_eq!(station.state("HIGH"), PieceState::Energised);
    assert_eq!(station.state("BUS"), PieceState::Contradiction);
    assert_eq!(
        station.judgment("BUS").reason,
        "source line and earth QC2 are surely connected: line - QA1 - T1 - QC2"
    );
}

#[test]
fn poles_that_disagree_are_told() {
    let poles = |l1, l2, l3| {
        let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
        let poles = ["position_l1", "position_l2", "position_l3"];
        tags.extend(poles.into_iter().zip([l1, l2, l3]).map(|(role, of)| tag("QA2", role, of)));
        tags.remove(1);
        tags
    };
    let all_closed = station(&two_levels(), &poles(CLOSED, CLOSED, CLOSED));
    assert_eq!(all_closed.state("BUS"), PieceState::Energised);
    let one_open = station(&two_levels(), &poles(CLOSED, OPEN, CLOSED));
    assert_eq!(one_open.state("QA2"), PieceState::PolesDisagree);
    assert_eq!(one_open.state("BUS"), PieceState::Unknown);
    let reason = "poles of QA2 disagree: open at L2, closed at L1";
    assert_eq!(one_open.judgment("BUS").reason, reason);
    assert_eq!(one_open.judgment("QA2").standing, Standing::Abnormal);
    // A pole that moves, or that is not good, is none that disagrees.
    let moving = station(&two_levels(), &poles(OPEN, MOVING, OPEN));
    assert_eq!(moving.state("QA2"), PieceState::InMotion);
    assert_eq!(moving.state("BUS"), PieceState::Unknown, "dead only once it settled");
    let mut tags = poles(OPEN, OPEN, OPEN);
    tags[5] = bad(tag("QA2", "position_l3", OPEN));
    let not_good = station(&two_levels(), &tags);
    assert_eq!(not_good.judgment("BUS").reason, "QA2 has no good position");
    tags.pop();
    let missing = station(&two_levels(), &tags);
    assert_eq!(missing.judgment("BUS").reason, "QA2 has no tag in the role 'position_l3'");
    assert!(missing.overlay.findings()[0].contains("position_l3"));
    // Two tags of one switch are as good as two poles.
    let mut tags = switches(CLOSED, CLOSED, OPEN, OPEN);
    tags.push(tag("QA2", "position", OPEN));
    let two = station(&two_levels(), &tags);
    assert_eq!(two.state("QA2"), PieceState::PolesDisagree);
    assert_eq!(
        two.judgment("QA2").reason,
        "QA2 is open by one tag and closed by another; energised at an end"
    );
}

#[test]
fn an_earth_whose_poles_disagree_earths_nothing_for_certain() {
    let mut tags = switches(OPEN, OPEN, CLOSED, OPEN);
    tags.push(tag("QC1", "position_l1", OPEN));
    let station = station(&two_levels(), &tags);
    assert_eq!(station.state("HIGH"), PieceState::Dead);
    let reason = &station.judgment("HIGH").reason;
    assert!(reason.starts_with("perhaps earthed: poles of QC1 disagree"), "{reason}");
}

#[test]
fn a_racked_out_breaker_is_open_whatever_it_reports() {
    let with = |position, racked_out: Tag| {
        let mut tags = switches(CLOSED, position, OPEN, OPEN);
        tags.push(racked_out);
        tags
    };
    let racked = |value| tag("QA2", "racked_out", value);
    let out = station(&two_levels(), &with(CLOSED, racked(YES)));
    assert_eq!((out.state("BUS"), out.state("QA2")), (PieceState::Dead, PieceState::RackedOut));
    assert_eq!(out.basis("BUS"), ["QA2.racked_out"]);
    let reason = "QA2 is racked out; energised at an end";
    assert_eq!(out.judgment("QA2").reason, reason);
    let moving = station(&two_levels(), &with(MOVING, racked(CLOSED)));
    assert_eq!(moving.state("BUS"), PieceState::Dead);
    let back = station(&two_levels(), &with(CLOSED, racked(NO)));
    assert_eq!(back.state("BUS"), PieceState::Energised);
    assert_eq!(back.basis("BUS"), ["QA1.position", "QA2.position", "QA2.racked_out"]);
    // Not known: a closed one may join nothing, an open one does not.
    let unsure = station(&two_levels(), &with(CLOSED, bad(racked(NO))));
    assert_eq!(unsure.state("BUS"), PieceState::Unknown);
    let reason = "the tag in the role 'racked_out' of QA2 is not good";
    assert_eq!(unsure.judgment("BUS").reason, reason);
    let open = station(&two_levels(), &with(OPEN, bad(racked(NO))));
    assert_eq!(open.state("BUS"), PieceState::Dead);
}

#[test]
fn a_position_set_by_hand_is_used_and_marked() {
    let with = |position: Tag, hand: Tag| {
        let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
        tags[1] = position;
        tags.push(hand);
        tags
    };
    let qa2 = |value| tag("QA2", "position", value);
    let hand = |value| tag("QA2", "hand_dressed", value);
    // The position itself, in place of one that is not good.
    let station_1 = station(&two_levels(), &with(bad(qa2(OPEN)), hand(CLOSED)));
    assert_eq!(station_1.state("BUS"), PieceState::Energised);
    assert_eq!(station_1.state("QA2"), PieceState::HandDressed);
    assert_eq!(station_1.judgment("BUS").reason, "the position of QA2 is set by hand");
    assert_eq!(station_1.basis("BUS"), ["QA1.position", "QA2.hand_dressed"]);
    // A flag at a position that the device says is substituted.
    let Tag(id, role, unit, value, _) = qa2(CLOSED);
    let substituted = Tag(id, role, unit, value, Quality::Uncertain(Reason::Unknown));
    let flagged = station(&two_levels(), &with(substituted, hand(YES)));
    assert_eq!(flagged.state("BUS"), PieceState::Energised);
    assert_eq!(flagged.basis("BUS"), ["QA1.position", "QA2.hand_dressed"]);
    // No longer set: as reported.
    let taken_back = station(&two_levels(), &with(qa2(OPEN), hand(MOVING)));
    assert_eq!(taken_back.state("BUS"), PieceState::Dead);
    assert_eq!(taken_back.state("QA2"), PieceState::Energised);
    // A position by hand that is not good may be any.
    let unsure = station(&two_levels(), &with(qa2(OPEN), bad(hand(CLOSED))));
    assert_eq!(unsure.state("BUS"), PieceState::Unknown);
}

#[test]
fn a_portable_earth_earths_where_it_is_placed() {
    let with = |earth: Tag| {
        let mut tags = switches(OPEN, OPEN, OPEN, OPEN);
        tags.push(earth);
        tags
    };
    let at_high = |value| tag("HIGH", "portable_earth", value);
    let placed = station(&two_levels(), &with(at_high(YES)));
    assert_eq!(placed.state("HIGH"), PieceState::PortableEarth);
    assert_eq!(placed.state("VT"), PieceState::Earthed);
    assert_eq!(placed.state("LOW"), PieceState::Dead);
    assert_eq!(placed.basis("VT"), ["QA1.position", "HIGH.portable_earth"]);
    let removed = station(&two_levels(), &with(at_high(NO)));
    assert_eq!(removed.state("HIGH"), PieceState::Dead);
    let unsure = station(&two_levels(), &with(bad(at_high(YES))));
    assert_eq!(unsure.state("HIGH"), PieceState::Dead);
    // At a switch nobody knows at which end.
    let at_switch = station(&two_levels(), &with(tag("QA2", "portable_earth", YES)));
    assert_eq!(at_switch.state("LOW"), PieceState::Dead);
    let reason = &at_switch.judgment("LOW").reason;
    assert_eq!(reason, "perhaps earthed: a portable earth is placed at QA2");
    // With feeding it is a contradiction like any other.
    let mut tags = with(at_high(YES));
    tags[0] = tag("QA1", "position", CLOSED);
    let live = station(&two_levels(), &tags);
    assert_eq!(live.state("HIGH"), PieceState::Contradiction);
    // And where feeding is possible, it must not look safe.
    tags[0] = tag("QA1", "position", MOVING);
    let maybe = station(&two_levels(), &tags);
    assert_eq!(maybe.state("HIGH"), PieceState::Unknown);
}

#[test]
fn placements_of_the_settings_are_kept() {
    let mut settings = two_levels();
    settings["placements"] = json!([
        { "kind": "portable_earth", "equipment": "BUS", "by": "M. Weber", "since": "7 May, 08:10" },
        { "kind": "racked_out", "equipment": "QA2" },
        { "kind": "hand_dressed", "equipment": "QA1", "position": "closed" },
    ]);
    // Nothing is known of the two breakers.
    let tags = [tag("QC1", "position", OPEN), tag("QC2", "position", OPEN)];
    let station = station(&settings, &tags);
    assert_eq!(station.state("HIGH"), PieceState::Energised);
    assert_eq!(station.state("QA1"), PieceState::HandDressed);
    assert_eq!(station.state("QA2"), PieceState::RackedOut);
    assert_eq!(station.state("BUS"), PieceState::PortableEarth);
    assert!(station.overlay.findings().is_empty(), "{:?}", station.overlay.findings());
    for (placement, words) in [
        (json!({ "kind": "racked_out", "equipment": "QA9" }), "is not in the network"),
        (json!({ "kind": "racked_out", "equipment": "BUS" }), "the equipment is none"),
        (json!({ "kind": "hand_dressed", "equipment": "QA1" }), "give 'position'"),
        (json!({ "kind": "portable_earth", "equipment": "BUS", "node": "bas" }), "a node"),
        (json!({ "kind": "racked_out", "equipment": "QA1", "position": "open" }), "nothing needs"),
    ] {
        settings["placements"] = json!([placement]);
        let settings = serde_json::from_value(settings.clone()).unwrap();
        let Err(fault) = EnergisationOverlay::create(settings, host()) else {
            panic!("{placement} is taken")
        };
        assert!(fault.to_string().contains(words), "{fault}");
    }
}

#[test]
fn placements_are_logged_once_each_time() {
    let mut log = placement_log::PlacementLog::default();
    let mut settings: Settings = serde_json::from_value(two_levels()).unwrap();
    settings.placements.clear();
    let topology = Topology::new(&settings).unwrap();
    let readings = |condition| {
        let reading =
            |condition| SwitchReading { position: Position::Open, condition, basis: Vec::new() };
        let mut switches = vec![reading(SwitchCondition::Settled); topology.switches.len()];
        switches[0] = reading(condition);
        Readings { switches, ..Readings::default() }
    };
    let mut told = |condition| log.changes(&topology, &readings(condition));
    assert_eq!(told(SwitchCondition::Settled), [""; 0]);
    assert_eq!(told(SwitchCondition::RackedOut), ["QA1 is racked out"]);
    assert_eq!(told(SwitchCondition::RackedOut), [""; 0]);
    // A tag that is not good tells nothing.
    assert_eq!(told(SwitchCondition::NotGood { role: "racked_out" }), [""; 0]);
    assert_eq!(told(SwitchCondition::Settled), ["no longer so: QA1 is racked out"]);
}

fn generator() -> Json {
    let mut settings = two_levels();
    settings["sources"] = json!([{ "node": "line", "equipment": "G1", "rating_mva": 100.0 }]);
    settings
}

#[test]
fn a_machine_feeds_by_the_magnitude_of_its_power() {
    let with = |machine: Vec<Tag>| {
        let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
        tags.extend(machine);
        station(&generator(), &tags)
    };
    let p = |value| reading("G1", "active_power", "MW", value);
    let q = |value| reading("G1", "reactive_power", "Mvar", value);
    let source = |unit, value| reading("G1", "source", unit, value);
    let (fed, unknown) = (PieceState::Energised, PieceState::Unknown);
    for (tags, expected, what) in [
        (vec![p(50.0)], fed, "generating"),
        (vec![p(-50.0)], fed, "the other sign convention"),
        (vec![p(0.0)], unknown, "spinning without load"),
        (vec![p(0.4)], unknown, "below 1 % of the rating"),
        (vec![p(0.0), q(-20.0)], fed, "reactive power alone"),
        (vec![bad(p(50.0))], unknown, "no good value"),
        (vec![bad(p(50.0)), q(20.0)], fed, "the other one is good"),
        (vec![p(f64::NAN)], unknown, "no number"),
        (vec![], unknown, "nothing is known"),
        (vec![source("MW", -50.0)], fed, "power in the role source"),
        (vec![source("kW", 500.0)], unknown, "0.5 of 100 MVA"),
        (vec![source("", 0.0)], unknown, "a number at zero proves nothing"),
        (vec![source("kV", 0.02)], unknown, "0.02 of 110 kV"),
        (vec![source("kV", 30.0)], unknown, "27 % of nominal"),
        (vec![source("kV", 60.0)], fed, "55 % of nominal"),
        (vec![source("V", 60_000.0)], fed, "the same in volts"),
        (vec![tag("G1", "source", YES)], fed, "told"),
        (vec![tag("G1", "source", MOVING)], unknown, "neither on nor off"),
        (vec![tag("G1", "source", NO)], PieceState::Dead, "told to be off"),
        (vec![tag("G1", "source", NO), p(0.0)], PieceState::Dead, "off, and no power"),
        (vec![tag("G1", "source", NO), p(-40.0)], unknown, "off, and yet power flows"),
        (vec![tag("G1", "source", YES), p(0.0)], fed, "on, without load"),
    ] {
        let station = with(tags);
        assert_eq!(station.state("HIGH"), expected, "{what}");
        let judgment = station.judgment("HIGH");
        assert!(expected != unknown || !judgment.reason.is_empty(), "{what}");
        // Behind an open breaker it feeds nothing, whatever it does.
    }
    assert_eq!(
        with(vec![]).judgment("HIGH").reason,
        "nothing is known of the source G1: it may feed"
    );
    // Without a rating any power counts, by a default that is told.
    let mut settings = generator();
    settings["sources"][0].as_object_mut().unwrap().remove("rating_mva");
    let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
    tags.push(p(-0.1));
    let assumed = station(&settings, &tags);
    assert_eq!(assumed.state("HIGH"), fed);
    assert!(assumed.judgment("HIGH").assumption.contains("G1"));
    assert!(assumed.judgment("BUS").assumption.is_empty());
}

#[test]
fn a_machine_behind_an_open_breaker_feeds_nothing() {
    let mut tags = switches(OPEN, OPEN, OPEN, OPEN);
    tags.push(reading("G1", "active_power", "MW", 0.0));
    let station = station(&generator(), &tags);
    assert_eq!(station.state("HIGH"), PieceState::Dead);
    assert_eq!(station.state("LINE"), PieceState::Unknown);
}

fn voltages(values: [f64; 3]) -> Vec<Tag> {
    let roles = ["voltage_l1", "voltage_l2", "voltage_l3"];
    roles.into_iter().zip(values).map(|(role, value)| reading("VT", role, "kV", value)).collect()
}

/// Phase to earth at 100 % of 110 kV.
const FULL: f64 = 63.5;

#[test]
fn voltage_alone_makes_nothing_energised_or_dead() {
    let with = |qa1, values: [f64; 3]| {
        let mut tags = switches(qa1, OPEN, OPEN, OPEN);
        tags.extend(voltages(values));
        station(&two_levels(), &tags)
    };
    // Where no source reaches, voltage is a contradiction that is told.
    let live = with(OPEN, [FULL, 0.0, 0.0]);
    let judgment = live.judgment("HIGH");
    assert_eq!((judgment.state, judgment.standing), (PieceState::Contradiction, Standing::Unknown));
    assert_eq!(judgment.reason, "VT measures voltage, though no source reaches it");
    assert_eq!(live.basis("HIGH"), ["QA1.position", "VT.voltage_l1"]);
    // What it surely reaches over the winding is in doubt too, and no more.
    assert_eq!(live.state("LOW"), PieceState::Contradiction);
    assert_eq!(live.state("BUS"), PieceState::Dead);
    // Below what is present it makes nothing.
    for share in [0.0, 0.05, 0.2, 0.44] {
        assert_eq!(with(OPEN, [FULL * share; 3]).state("HIGH"), PieceState::Dead, "{share}");
        let fed = with(CLOSED, [FULL * share; 3]);
        let judgment = fed.judgment("HIGH");
        assert_eq!(judgment.state, PieceState::Energised, "{share}");
        assert_eq!(judgment.standing, Standing::Abnormal, "{share}: {}", judgment.reason);
    }
    assert_eq!(
        with(CLOSED, [0.0; 3]).judgment("HIGH").reason,
        "fed by the topology, but VT measures no voltage in any phase"
    );
    assert_eq!(
        with(CLOSED, [FULL, 0.0, FULL]).judgment("HIGH").reason,
        "fed by the topology, but VT measures no voltage: L2"
    );
    assert_eq!(
        with(CLOSED, [FULL, 20.0, FULL]).judgment("HIGH").reason,
        "fed by the topology, but VT: L2 is between 10 and 45 % of nominal"
    );
    let confirmed = with(CLOSED, [FULL; 3]);
    assert_eq!(confirmed.judgment("HIGH").standing, Standing::Normal);
    // Unknown stays unknown, with voltage and without.
    for share in [0.0, 1.0] {
        assert_eq!(with(MOVING, [FULL * share; 3]).state("HIGH"), PieceState::Unknown);
    }
}

#[test]
fn voltage_spreads_doubt_over_what_may_be_joined() {
    let mut tags = switches(OPEN, MOVING, OPEN, OPEN);
    tags.extend(voltages([FULL; 3]));
    let station = station(&two_levels(), &tags);
    assert_eq!(station.state("LOW"), PieceState::Contradiction);
    assert_eq!(station.state("BUS"), PieceState::Unknown);
    let reason = "perhaps joined to VT, which measures voltage without a source";
    assert_eq!(station.judgment("BUS").reason, reason);
}

#[test]
fn a_fuse_that_blew_explains_a_voltage_that_is_missing() {
    for role in ["fuse_fault", "mcb_tripped"] {
        let with = |fault: Tag| {
            let mut tags = switches(CLOSED, OPEN, OPEN, OPEN);
            tags.extend(voltages([0.0; 3]));
            tags.push(fault);
            station(&two_levels(), &tags).judgment("HIGH").standing
        };
        assert_eq!(with(tag("VT", role, YES)), Standing::Normal, "{role}");
        assert_eq!(with(bad(tag("VT", role, NO))), Standing::Normal, "{role}");
        assert_eq!(with(tag("VT", role, NO)), Standing::Abnormal, "{role}");
    }
}

#[test]
fn a_doubt_stays_when_the_voltage_is_not_good_any_more() {
    let frame = |share: f64, is_good: bool| {
        let mut tags = switches(OPEN, OPEN, OPEN, OPEN);
        let voltages = voltages([FULL * share; 3]).into_iter();
        tags.extend(voltages.map(|tag| if is_good { tag } else { bad(tag) }));
        tags
    };
    let mut station = station(&two_levels(), &frame(1.0, false));
    assert_eq!(station.state("HIGH"), PieceState::Dead, "nothing was ever measured");
    station.draw(&frame(1.0, true));
    assert_eq!(station.state("HIGH"), PieceState::Contradiction);
    station.draw(&frame(0.0, false));
    let judgment = station.judgment("HIGH");
    assert_eq!((judgment.state, judgment.standing), (PieceState::Unknown, Standing::Unknown));
    assert!(judgment.reason.contains("when it was last good"), "{}", judgment.reason);
    station.draw(&frame(0.0, true));
    assert_eq!(station.state("HIGH"), PieceState::Dead);
}

#[test]
fn bands_of_voltage_have_hysteresis() {
    use VoltageBand::{Between, Low, Present};
    let mut memory = VoltageMemory::default();
    for (share, expected) in [
        (0.44, Some(Between)),
        (0.45, Some(Present)),
        (0.44, Some(Present)),
        (0.42, Some(Between)),
        (0.44, Some(Between)),
        (0.10, Some(Between)),
        (0.09, Some(Low)),
        (0.10, Some(Between)),
        (0.09, Some(Between)),
        (0.07, Some(Low)),
        (1.73, Some(Present)),
        (2.1, None),
        (-0.1, None),
        (f64::NAN, None),
        (0.44, Some(Present)),
        (0.09, Some(Low)),
    ] {
        assert_eq!(memory.classify(share), expected, "{share}");
    }
}

#[test]
fn units_and_nominal_voltages_are_taken_or_told() {
    let with = |unit: &'static str, value: f64, level: &str| {
        let mut settings = two_levels();
        settings["levels"][0]["name"] = level.into();
        for node in 0..2 {
            settings["nodes"][node]["level"] = level.into();
        }
        let mut tags = switches(OPEN, OPEN, OPEN, OPEN);
        tags.push(reading("VT", "voltage", unit, value));
        let station = station(&settings, &tags);
        (station.state("HIGH"), station.overlay.findings().join("; "))
    };
    let live = PieceState::Contradiction;
    for (unit, value) in
        [("kV", 60.0), ("V", 60_000.0), ("%", 55.0), ("p.u.", 0.55), ("MV", 0.06), ("", 60.0)]
    {
        assert_eq!(with(unit, value, "110 kV"), (live, String::new()), "{unit}");
    }
    for level in ["110kV", "110,0 kV", "110000 V", "110 kV, yard 2"] {
        assert_eq!(with("kV", 60.0, level).0, live, "{level}");
    }
    let (state, findings) = with("kV", 60.0, "yard");
    assert_eq!(state, PieceState::Dead);
    assert!(findings.contains("set 'nominal_kv'"), "{findings}");
    let (state, findings) = with("A", 600.0, "110 kV");
    assert_eq!(state, PieceState::Dead);
    assert!(findings.contains("has the unit 'A'"), "{findings}");
}

#[test]
fn bindings_that_lack_a_tag_are_told() {
    let tags = [tag("QA1", "position", CLOSED)];
    let mut settings = generator();
    let station_1 = station(&settings, &tags);
    let findings = station_1.overlay.findings().join("\n");
    for id in ["QA2", "QC1", "QC2", "G1"] {
        assert!(findings.contains(&format!("'{id}' has no tag")), "{id}: {findings}");
    }
    assert_eq!(station_1.judgment("QC1").standing, Standing::Unknown);
    assert_eq!(
        station_1.judgment("QC1").reason,
        "QC1 has no tag for its position; nothing is known of the source G1: it may feed"
    );
    // What the settings declare is unknown, and no fault.
    settings["branches"][2]["untelemetered"] = true.into();
    settings["earths"][0]["untelemetered"] = true.into();
    settings["earths"][1]["untelemetered"] = true.into();
    settings["sources"][0]["untelemetered"] = true.into();
    let declared = station(&settings, &tags);
    assert!(declared.overlay.findings().is_empty(), "{:?}", declared.overlay.findings());
    assert_eq!(declared.state("BUS"), PieceState::Unknown);
}

#[test]
fn the_legend_says_that_it_is_no_permit_to_work() {
    let settings: Settings = serde_json::from_value(two_levels()).unwrap();
    let legend = settings.legend();
    let names: Vec<&str> = legend.iter().map(|entry| entry.name.as_str()).collect();
    assert!(names.contains(&"these are indications, not a permit to work"), "{names:?}");
    assert!(names.iter().all(|name| name.len() <= 64), "{names:?}");
    for state in [PieceState::PolesDisagree, PieceState::InMotion, PieceState::RackedOut] {
        assert!(settings.legend_entry(state, 0) >= settings.levels.len());
    }
}
