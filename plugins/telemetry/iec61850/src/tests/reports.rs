//! Values by reports: buffered and unbuffered, whole data objects and their parts.

use busbar_link::testing::CertificateAuthority;

use super::*;

/// Returns the tags of a whole report.
fn whole() -> Vec<TagSpec> {
    vec![
        tag(1, ValueKind::F64, "MMXU1.TotW", "MX"),
        tag(2, ValueKind::F64, "MMXU1.PhV.phsA", "MX"),
        tag(3, ValueKind::DoublePoint, "XCBR1.Pos", "ST"),
        tag(4, ValueKind::Bool, "GGIO1.Ind1", "ST"),
    ]
}

/// So seldom polled that values cannot come by it.
fn by(rcb: &str) -> serde_json::Value {
    json!({
        "poll_seconds": 3600,
        "reports": [{"rcb": format!("IED1LD0/LLN0.{rcb}")}]
    })
}

fn set(object: &str, values: &serde_json::Value) -> serde_json::Value {
    json!({"object": format!("LD0/{object}"), "values": values, "time_millis": TIME_MILLIS})
}

#[test]
fn changes_come_by_reports_of_either_kind() {
    for block in ["BR.brcbA01", "RP.urcbA01"] {
        let Some(mut peer) = peer::start(&json!({})) else { return };
        let running = start(peer.port, by(block), whole());
        // The answer to the general interrogation.
        running.wait_for(1, Value::F64(0.0));
        running.wait_for(4, Value::Bool(false));
        // A buffer that begins says that it ran over: its block is read after the answer.
        let is_read = |seen: &Recording| {
            let good = seen.samples.iter().filter(|s| s.tag == 4 && s.quality.is_good());
            good.count() > usize::from(block.starts_with("BR"))
        };
        assert!(running.recorder.wait_until(PATIENCE, is_read), "{block}");
        let changes = [
            ("MMXU1.TotW", json!({"mag.f": 12.5}), 1, Value::F64(12.5)),
            ("MMXU1.PhV.phsA", json!({"cVal.mag.f": 63.5}), 2, Value::F64(63.5)),
            ("XCBR1.Pos", json!({"stVal": {"dbpos": 1}}), 3, Value::DoublePoint(DoublePoint::Off)),
            ("GGIO1.Ind1", json!({"stVal": true}), 4, Value::Bool(true)),
        ];
        for (object, values, number, value) in changes {
            peer.command(&set(object, &values));
            running.wait_for(number, value);
            let sample = running.recorder.latest(number).unwrap();
            assert_eq!(
                sample.source_time.map(to_second),
                at(TIME_MILLIS).map(to_second),
                "{block}"
            );
        }
        peer.command(&json!({"object": "LD0/XCBR1.Pos", "quality": 0b10}));
        running.wait_for_bad(3, Reason::Sensor);
    }
}

fn to_second(time: SystemTime) -> u64 {
    time.duration_since(UNIX_EPOCH).unwrap().as_secs()
}

#[test]
fn parts_of_data_objects_are_put_together() {
    let Some(mut peer) = peer::start(&json!({})) else { return };
    let tags = vec![
        tag(1, ValueKind::Bool, "GGIO1.Ind2", "ST"),
        // The data set has its value without its quality, so it is polled.
        tag(2, ValueKind::I64, "MMXU1.TotVAr", "MX"),
    ];
    let mut settings = by("RP.urcbB01");
    settings["poll_seconds"] = json!(0.1);
    let running = start(peer.port, settings, tags);
    running.wait_for(1, Value::Bool(false));
    running.wait_for(2, Value::I64(0));
    peer.command(&json!({"object": "LD0/GGIO1.Ind2", "values": {"stVal": true}}));
    running.wait_for(1, Value::Bool(true));
    // Without `t` in the data set, the time is the report's.
    let time = running.recorder.latest(1).unwrap().source_time.unwrap();
    let age = SystemTime::now().duration_since(time).unwrap_or_default();
    assert!(age < PATIENCE, "{age:?}");
    peer.command(&json!({"object": "LD0/GGIO1.Ind2", "quality": 0b11 | 8}));
    running.wait("quality", 1, |sample| {
        sample.quality == Quality::Uncertain(Reason::OutOfRange)
            && sample.value == Some(Value::Bool(true))
    });
    peer.command(&json!({
        "object": "LD0/MMXU1.TotVAr", "values": {"mag.i": 7}, "quality": 2048
    }));
    running.wait("test", 2, |sample| {
        sample.quality == Quality::Bad(Reason::Unknown) && sample.value == Some(Value::I64(7))
    });
}

#[test]
fn integrity_reports_repeat_what_did_not_change() {
    let Some(peer) = peer::start(&json!({})) else { return };
    let mut settings = by("RP.urcbA01");
    settings["reports"][0]["integrity_seconds"] = json!(0.2);
    let running = start(peer.port, settings, whole());
    let repeated = running.recorder.wait_until(PATIENCE, |seen| {
        seen.samples.iter().filter(|sample| sample.tag == 4 && sample.quality.is_good()).count() > 4
    });
    assert!(repeated, "{:?}", running.samples(4));
    // What is repeated is as it is now.
    assert!(running.samples(4).iter().all(|sample| sample.source_time.is_none()));
}

#[test]
fn a_buffer_is_read_from_where_it_was_left() {
    let Some(mut peer) = peer::start(&json!({})) else { return };
    let proxy = fault_proxy::FaultProxy::start(
        ([127, 0, 0, 1], peer.port).into(),
        fault_proxy::FaultScript {
            seed: 1,
            faults: vec![fault_proxy::ConnectionFault::None],
            max_bytes: 1,
        },
    )
    .unwrap();
    // Long enough to change something meanwhile.
    let delays = ReconnectBounds { min: Duration::from_secs(2), max: Duration::from_secs(2) };
    let running = start_with(proxy.port(), by("BR.brcbA01"), delays, whole());
    running.wait_for(4, Value::Bool(false));
    let change = |peer: &mut Peer, is_on: bool, second: u64| {
        peer.command(&json!({
            "object": "LD0/GGIO1.Ind1", "values": {"stVal": is_on},
            "time_millis": TIME_MILLIS + 1000 * second
        }));
    };
    change(&mut peer, true, 1);
    running.wait_for(4, Value::Bool(true));
    // A buffer that begins says that it ran over: its block is read within a second.
    std::thread::sleep(Duration::from_millis(1500));
    running.recorder.clear();
    proxy.hang_up();
    running.wait_for_bad(4, Reason::Communication);
    peer.command(&json!({"connections": 0}));
    for (is_on, second) in [(false, 2), (true, 3), (false, 4)] {
        change(&mut peer, is_on, second);
    }
    running.wait("the present", 4, |sample| {
        sample.value == Some(Value::Bool(false)) && sample.source_time.is_none()
    });
    let missed: Vec<_> = running
        .samples(4)
        .into_iter()
        .filter_map(|s| Some((s.value?, to_second(s.source_time?) - TIME_MILLIS / 1000)))
        .collect();
    let expected = [(false, 2), (true, 3), (false, 4)].map(|(is, s)| (Value::Bool(is), s));
    assert_eq!(missed, expected, "each change once, none that was known");
}

/// 900 members of three phases, 28 bytes each, do not fit into one message of 65,000.
#[test]
fn long_reports_come_in_segments_and_are_joined() {
    let folder = tempfile::tempdir().unwrap();
    let authority = CertificateAuthority::new(folder.path(), "authority");
    let sign = |owner: &str| {
        let (certificate, key) = authority.sign(owner, "127.0.0.1");
        json!({"ca": authority.certificate(), "certificate": certificate, "key": key})
    };
    let spec = json!({"extra": 900, "tls": sign("server"), "report_bytes": 1_000_000});
    let Some(mut peer) = peer::start(&spec) else { return };
    let tags = (1..=900).map(|n| tag(n, ValueKind::F64, &format!("MMXU2.Val{n}.phsA"), "MX"));
    let mut settings = by("RP.urcbM01");
    settings["tls"] = sign("client");
    let running = start(peer.port, settings, tags.collect());
    for number in [1, 500, 900] {
        running.wait_for(number, Value::F64(0.0));
        let object = format!("MMXU2.Val{number}.phsA");
        let value = f64::from(number);
        peer.command(&set(&object, &json!({"cVal.mag.f": value})));
        running.wait_for(number, Value::F64(value));
    }
}

#[test]
fn a_block_that_another_client_has_is_made_up_for_by_polling() {
    let Some(peer) = peer::start(&json!({})) else { return };
    let first = start(peer.port, by("RP.urcbA01"), whole());
    first.wait_for(1, Value::F64(0.0));
    for block in ["RP.urcbA01", "RP.urcbN01", "RP.none"] {
        let mut settings = by(block);
        settings["poll_seconds"] = json!(0.1);
        let second = start(peer.port, settings, whole());
        let several = |seen: &Recording| {
            seen.samples.iter().filter(|s| s.tag == 1 && s.quality.is_good()).count() > 3
        };
        assert!(second.recorder.wait_until(PATIENCE, several), "{block}");
    }
    // And a block without a data set takes the one that is named.
    let mut settings = by("RP.urcbN01");
    settings["reports"][0]["data_set"] = json!("IED1LD0/LLN0.dsWhole");
    start(peer.port, settings, whole()).wait_for(1, Value::F64(0.0));
}

/// libiec61850 has no room for so long a report, and says nothing of it.
#[test]
fn what_an_interrogation_does_not_bring_is_read() {
    let Some(peer) = peer::start(&json!({"extra": 900})) else { return };
    let mut settings = by("RP.urcbM01");
    settings["timeout_seconds"] = json!(1);
    let running = start(peer.port, settings, vec![tag(1, ValueKind::F64, "MMXU2.Val1.phsA", "MX")]);
    running.wait_for(1, Value::F64(0.0));
}
