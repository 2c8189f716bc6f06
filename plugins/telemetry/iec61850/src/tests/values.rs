//! All types of data, quality and time, read by polling.

use super::*;

/// A data object under its constraint, the part that is written, a value for it, the tag's
/// kind, and what the tag then has.
type Case = (&'static str, &'static str, &'static str, serde_json::Value, ValueKind, Value);

fn cases() -> Vec<Case> {
    let position = |code: u8, state| {
        (json!({ "dbpos": code }), ValueKind::DoublePoint, Value::DoublePoint(state))
    };
    let of = |object, fc, part, (written, kind, value): (serde_json::Value, ValueKind, Value)| {
        (object, fc, part, written, kind, value)
    };
    let float = |value: f64| (json!(value), ValueKind::F64, Value::F64(value));
    let integer = |value: i64| (json!(value), ValueKind::I64, Value::I64(value));
    let large = 1_i64 << 40;
    vec![
        of("MMXU1.TotW", "MX", "mag.f", float(-1.5)),
        of("MMXU1.TotVAr", "MX", "mag.i", integer(-70_000)),
        of("MMXU1.PhV.phsA", "MX", "cVal.mag.f", float(127.25)),
        of("MMXU1.PhV.phsB", "MX", "cVal.mag.f", float(0.5)),
        of("XCBR1.Pos", "ST", "stVal", position(2, DoublePoint::On)),
        of("GGIO1.Ind1", "ST", "stVal", (json!(true), ValueKind::Bool, Value::Bool(true))),
        of("GGIO1.IntIn1", "ST", "stVal", integer(-5)),
        of("GGIO1.IntIn2", "ST", "stVal", (json!(-70_000), ValueKind::Text, text("-70000"))),
        of(
            "XCBR1.OpCnt",
            "ST",
            "actVal",
            (json!({"int64": large}), ValueKind::I64, Value::I64(large)),
        ),
        of("ATCC1.TapChg", "ST", "valWTr.posVal", integer(-7)),
        of("PTOC1.Op", "ST", "general", (json!(true), ValueKind::Bool, Value::Bool(true))),
        of("PTOC1.Str", "SP", "setVal", (json!(true), ValueKind::Bool, Value::Bool(true))),
        of("PTOC1.StrVal", "SP", "setMag.f", float(2.5)),
    ]
}

fn text(text: &str) -> Value {
    Value::Text(Text::cut(text))
}

#[test]
fn every_type_is_read_as_the_server_has_it() {
    let Some(mut peer) = peer::start(&json!({})) else { return };
    let cases = cases();
    // Each by its data object, and by the full reference of its value.
    let tags = (1..).zip(&cases).flat_map(|(number, (object, fc, part, _, kind, _))| {
        let whole = tag(number, *kind, object, fc);
        [whole, tag(number + 100, *kind, &format!("{object}.{part}"), fc)]
    });
    let running = start(peer.port, json!({}), tags.collect());
    running.wait_for(1, Value::F64(0.0));
    for (number, (object, _, part, written, _, value)) in (1..).zip(&cases) {
        peer.command(&json!({"object": format!("LD0/{object}"), "values": {*part: written}}));
        running.wait_for(number, value.clone());
        running.wait_for(number + 100, value.clone());
    }
    let links = running.recorder.recording().links;
    let states: Vec<_> = links.iter().map(|(state, _)| *state).collect();
    assert_eq!(states, [LinkState::Connecting, LinkState::Up], "{links:?}");
    // An integer is a number, too; scaled.
    let mut scaled = tag(1, ValueKind::F64, "GGIO1.IntIn1", "ST");
    (scaled.address["scale"], scaled.address["offset"]) = (json!(0.5), json!(1.0));
    start(peer.port, json!({}), vec![scaled]).wait_for(1, Value::F64(-1.5));
}

#[test]
fn texts_are_read_as_the_server_has_them() {
    let Some(mut peer) = peer::start(&json!({ "texts": true })) else { return };
    let tags = vec![
        tag(1, ValueKind::Text, "GGIO1.Mode", "ST"),
        tag(2, ValueKind::Text, "LLN0.NamPlt.vendor", "DC"),
        tag(3, ValueKind::F64, "MMXU1.TotW", "MX"),
    ];
    let running = start(peer.port, json!({}), tags);
    running.wait_for(3, Value::F64(0.0));
    let longest = "x".repeat(255);
    for word in ["AUTO", "Süd", "", &longest, "MANUAL"] {
        for (tag, object, part) in
            [(1, "LD0/GGIO1.Mode", "stVal"), (2, "LD0/LLN0.NamPlt", "vendor")]
        {
            peer.command(&json!({"object": object, "values": {part: word}}));
            running.wait_for(tag, text(word));
        }
    }
    let links = running.recorder.recording().links;
    assert!(links.iter().all(|(state, _)| *state != LinkState::Down), "{links:?}");
}

#[test]
fn quality_is_carried_over() {
    let Some(mut peer) = peer::start(&json!({})) else { return };
    let running = start(peer.port, json!({}), vec![tag(1, ValueKind::F64, "MMXU1.TotW", "MX")]);
    running.wait_for(1, Value::F64(0.0));
    let (bad, uncertain) = (Quality::Bad, Quality::Uncertain);
    // Bits as libiec61850 has them, which are not in the order of the standard.
    let cases = [
        (0b01, bad(Reason::Unknown)),
        (0b10, bad(Reason::Sensor)),
        (0b11, uncertain(Reason::Unknown)),
        (0b10 | 4, bad(Reason::OutOfRange)),
        (0b11 | 8, uncertain(Reason::OutOfRange)),
        (0b11 | 16, uncertain(Reason::Unknown)),
        (0b11 | 32, uncertain(Reason::Unknown)),
        (0b10 | 64, bad(Reason::Sensor)),
        (0b11 | 128, bad(Reason::Communication)),
        (0b11 | 256, uncertain(Reason::Unknown)),
        (0b11 | 512, uncertain(Reason::Unknown)),
        (1024, uncertain(Reason::Unknown)),
        (2048, bad(Reason::Unknown)),
        (4096, uncertain(Reason::Unknown)),
        (0, Quality::Good),
    ];
    for (bits, quality) in cases {
        let value = f64::from(bits) + 0.5;
        let values = json!({ "mag.f": value });
        peer.command(&json!({"object": "LD0/MMXU1.TotW", "values": values, "quality": bits}));
        running.wait(&format!("quality {bits}"), 1, |sample| {
            let flags = match bits {
                1024 => SampleFlags::SUBSTITUTED,
                2048 => SampleFlags::TEST,
                _ => SampleFlags::LIVE,
            };
            (&sample.value, sample.quality, sample.flags)
                == (&Some(Value::F64(value)), quality, flags)
        });
    }
}

#[test]
fn times_are_carried_over_where_they_can_be_relied_on() {
    let Some(mut peer) = peer::start(&json!({})) else { return };
    let change = |peer: &mut Peer, value: f64, millis: u64, clock: &str| {
        let values = json!({ "mag.f": value });
        let object = "LD0/MMXU1.TotW";
        peer.command(
            &json!({"object": object, "values": values, "time_millis": millis, "clock": clock}),
        );
    };
    change(&mut peer, 1.0, TIME_MILLIS, "");
    let running = start(peer.port, json!({}), vec![tag(1, ValueKind::F64, "MMXU1.TotW", "MX")]);
    // It may have changed long ago and is as it is now all the same.
    running.wait_for(1, Value::F64(1.0));
    assert!(running.samples(1).iter().all(|sample| sample.source_time.is_none()));
    change(&mut peer, 2.0, TIME_MILLIS + 1500, "");
    running.wait("time", 1, |sample| sample.value == Some(Value::F64(2.0)));
    let times: Vec<_> = running
        .samples(1)
        .into_iter()
        .filter(|sample| sample.value == Some(Value::F64(2.0)))
        .map(|sample| sample.source_time)
        .collect();
    assert_eq!(times[0].map(to_millis), at(TIME_MILLIS + 1500).map(to_millis), "{times:?}");
    for (value, clock) in [(3.0, "failed"), (4.0, "unsynchronised")] {
        change(&mut peer, value, TIME_MILLIS + 5000, clock);
        running.wait_for(1, Value::F64(value));
        let of_value = running.samples(1);
        let of_value = of_value.iter().filter(|sample| sample.value == Some(Value::F64(value)));
        assert!(of_value.clone().all(|sample| sample.source_time.is_none()), "{clock}");
        // A clock that has failed says nothing; one that runs freely does no harm to what
        // is told as it is now.
        let has_failed = clock == "failed";
        let is_flagged = |sample: &Sample| sample.flags == SampleFlags::TIME_UNUSABLE;
        assert!(of_value.clone().all(|sample| is_flagged(sample) == has_failed), "{clock}");
    }
}

/// To the nearest millisecond: on the wire it is a binary fraction.
fn to_millis(time: SystemTime) -> u128 {
    (time.duration_since(UNIX_EPOCH).unwrap().as_micros() + 500) / 1000
}

#[test]
fn what_does_not_fit_is_bad_and_the_rest_is_read() {
    let Some(peer) = peer::start(&json!({})) else { return };
    let tags = vec![
        tag(1, ValueKind::F64, "MMXU1.TotW", "MX"),
        tag(2, ValueKind::F64, "MMXU9.TotW", "MX"),
        tag(3, ValueKind::F64, "MMXU1.TotW.mag.none", "MX"),
        tag(4, ValueKind::Bool, "MMXU1.TotW", "MX"),
        tag(5, ValueKind::DoublePoint, "GGIO1.Ind1", "ST"),
        tag(6, ValueKind::F64, "MMXU1.PhV", "MX"),
        tag(7, ValueKind::Text, "MMXU1.TotW", "MX"),
        tag(8, ValueKind::Text, "GGIO1.Ind1", "ST"),
        tag(9, ValueKind::Text, "XCBR1.Pos", "ST"),
    ];
    let running = start(peer.port, json!({}), tags);
    running.wait_for(1, Value::F64(0.0));
    for number in 2..=9 {
        running.wait_for_bad(number, Reason::Configuration);
    }
}

#[test]
fn many_variables_are_read_in_pieces() {
    let Some(mut peer) = peer::start(&json!({"extra": 300})) else { return };
    let tags = (1..=300).map(|n| tag(n, ValueKind::F64, &format!("MMXU2.Val{n}.phsA"), "MX"));
    let running = start(peer.port, json!({}), tags.collect());
    for number in [1, 150, 300] {
        let object = format!("LD0/MMXU2.Val{number}.phsA");
        let value = f64::from(number);
        peer.command(&json!({"object": object, "values": {"cVal.mag.f": value}}));
        running.wait_for(number, Value::F64(value));
    }
}

#[test]
fn a_value_in_another_unit_than_its_tag_is_never_good() {
    // SIUnit and multiplier as the server has them; the tag's unit.
    let cases = [
        (38, 6, "MW", true),
        (38, 3, "MW", false),
        (62, 6, "MW", true),
        (6, 0, "°C", false),
        (23, 0, "°C", true),
        (0, 0, "MW", true),
        (47, 0, "MW", true),
        (63, 6, "MW", false),
    ];
    let units: Vec<_> = cases.iter().map(|(unit, power, ..)| json!([unit, power])).collect();
    let Some(mut peer) = peer::start(&json!({ "units": units })) else { return };
    let of = |number: u32, reference: &str, unit: &str| TagSpec {
        unit: unit.into(),
        ..tag(number, ValueKind::F64, reference, "MX")
    };
    let mut tags: Vec<_> = (1..)
        .zip(&cases)
        .map(|(number, (_, _, unit, _))| of(number, &format!("MMXU3.Val{number}"), unit))
        .collect();
    // The parts of a vector, of which the angle is in no such unit; and a scaled value.
    tags.push(of(50, "MMXU3.Phs.phsA", "kV"));
    tags.push(of(51, "MMXU3.Phs.phsA.cVal.mag.f", "V"));
    tags.push(of(52, "MMXU3.Phs.phsB", "V"));
    let mut scaled = of(53, "MMXU3.Val1", "kW");
    scaled.address["scale"] = json!(1000.0);
    tags.push(scaled);
    for settings in [json!({}), json!({"reports": [{"rcb": "IED1LD0/LLN0.RP.urcbU01"}]})] {
        let running = start(peer.port, settings, tags.clone());
        running.wait_for_bad(50, Reason::Configuration);
        for number in [51, 52, 53] {
            running.wait_for_quality(number, Quality::Good);
        }
        for value in [2.5, 3.5] {
            for (number, (.., is_good)) in (1..).zip(&cases) {
                let object = format!("LD0/MMXU3.Val{number}");
                peer.command(&json!({"object": object, "values": {"mag.f": value}}));
                if *is_good {
                    running.wait_for(number, Value::F64(value));
                } else {
                    running.wait_for_bad(number, Reason::Configuration);
                }
            }
        }
        for (number, (.., is_good)) in (1..).zip(&cases) {
            let has_good = running.samples(number).iter().any(|sample| sample.quality.is_good());
            assert_eq!(has_good, *is_good, "{number}");
        }
        assert!(running.samples(50).iter().all(|sample| !sample.quality.is_good()));
    }
}
