use super::*;
use crate::comtrade::writer::Recipe;
use crate::comtrade::{Sampling, Side};

const ALL: [(Revision, DataType); 9] = [
    (Revision::Of1991, DataType::Ascii),
    (Revision::Of1991, DataType::Binary),
    (Revision::Of1999, DataType::Ascii),
    (Revision::Of1999, DataType::Binary),
    (Revision::Of2013, DataType::Ascii),
    (Revision::Of2013, DataType::Binary),
    (Revision::Of2013, DataType::Binary32),
    (Revision::Of2013, DataType::Float32),
    (Revision::Of1999, DataType::Float32),
];

fn fault(text: &str) -> String {
    Cfg::parse(text.as_bytes()).unwrap_err().to_string()
}

fn recipe() -> String {
    Recipe::new(Revision::Of2013, DataType::Binary32).cfg()
}

#[test]
fn every_revision_and_type_is_read() {
    for (revision, data) in ALL {
        let recipe = Recipe::new(revision, data);
        let cfg = Cfg::parse(recipe.cfg().as_bytes()).unwrap();
        assert_eq!((cfg.revision, cfg.data), (revision, data));
        assert_eq!((cfg.station.as_str(), cfg.device.as_str()), ("Nord", "REC 7"));
        assert_eq!((cfg.analogs.len(), cfg.digitals.len(), cfg.samples), (2, 18, 1000));
        let voltage = &cfg.analogs[1];
        assert_eq!((voltage.id.as_str(), voltage.unit.as_str()), ("UA", "V"));
        assert_eq!((voltage.a, voltage.b, voltage.skew_nanos), (0.001_953_125, 0.0, 125_500));
        assert_eq!(voltage.range, Some(-30_000.0..=30_000.0));
        // 2024-02-29T13:14:15.25, as the recorder's clock showed it.
        assert_eq!(cfg.start.nanos, Some(1_709_212_455_250_000_000));
        assert_eq!(cfg.timestamp_nanos, 1000.0);
        assert_eq!(cfg.remarks, [""; 0]);
        let offset = (revision == Revision::Of2013).then_some(60);
        assert_eq!(cfg.clock.utc_offset_minutes, offset);
        if revision == Revision::Of1991 {
            assert!(cfg.analogs[0].factor_to(Side::Primary).is_err());
        } else {
            assert_eq!(cfg.analogs[0].factor_to(Side::Primary), Ok(1.0));
            assert_eq!(cfg.analogs[0].factor_to(Side::Secondary), Ok(1.0 / 120.0));
            assert_eq!(voltage.factor_to(Side::Primary), Ok(100.0));
        }
    }
}

#[test]
fn samples_follow_their_rates() {
    let recipe = Recipe::new(Revision::Of1999, DataType::Binary);
    let cfg = Cfg::parse(recipe.cfg().as_bytes()).unwrap();
    for sample in [1, 2, 499, 500, 501, 502, 1000, 2000] {
        let expected = (recipe.seconds(sample) * 1e9).round() as i64;
        assert!((cfg.nanos(sample, None).unwrap() - expected).abs() <= 1, "{sample}");
    }
    let recipe =
        Recipe { has_timestamps: true, is_nano: true, revision: Revision::Of2013, ..recipe };
    let cfg = Cfg::parse(recipe.cfg().as_bytes()).unwrap();
    assert_eq!(cfg.sampling, Sampling::Timestamps);
    assert_eq!(cfg.nanos(7, Some(250.0)), Some(250));
    assert_eq!(cfg.nanos(7, None), None);
    assert_eq!(cfg.nanos(7, Some(f64::MAX)), None);
}

#[test]
fn the_clock_says_zone_and_quality() {
    let of = |zone: &str, quality: &str| {
        let text = recipe().replace("+1,+1\r\n0,0", &format!("{zone}\r\n{quality}"));
        Cfg::parse(text.as_bytes()).map(|cfg| cfg.clock)
    };
    assert_eq!(
        of("-5h30,0", "b,1").unwrap(),
        Clock { utc_offset_minutes: Some(-330), quality: Some(11), leap_second: 1 }
    );
    let failed = of("x,x", "F,3").unwrap();
    assert!(failed.is_unreliable() && failed.utc_offset_minutes.is_none());
    // What is not known of the clock keeps nobody from playing the recording.
    for (zone, quality, part) in [
        ("15,0", "0,0", "'15' is no time code"),
        ("5h60,0", "0,0", "no time code"),
        ("h30,0", "0,0", "no time code"),
        ("0,0", "G,0", "'G' is no time quality"),
        ("0,0", "0,4", "leap second '4'"),
    ] {
        let text = recipe().replace("+1,+1\r\n0,0", &format!("{zone}\r\n{quality}"));
        let cfg = Cfg::parse(text.as_bytes()).unwrap();
        assert!(cfg.remarks[0].contains(part), "{:?}", cfg.remarks);
        assert_eq!(cfg.clock.utc_offset_minutes.is_none(), part.contains("time code"));
    }
}

#[test]
fn what_is_wrong_is_named_with_its_line() {
    let check = |from: &str, to: &str, expected: &str| {
        let text = recipe();
        assert!(text.contains(from), "{from}");
        let fault = fault(&text.replacen(from, to, 1));
        assert!(fault.contains(expected), "{expected}: {fault}");
    };
    check("20,2A,18D", "20,2,18", "line 2: '20,2,18' is no number of channels");
    check("20,2A,18D", "99999999,99999981A,18D", "line 2: 99999999 channels; 1 to 65536");
    check("20,2A,18D", "0,0A,0D", "line 2: 0 channels");
    check("1,D1,,,0", "1", "line 5: digital channel 1 has no name");
    check("4800,500", "-1,500", "line 25: sample rate 1: -1 Hz");
    check("\r\n2\r\n4800", "\r\n5000\r\n4800", "line 24: 5000 sample rates; at most 1024");
    check(
        "BINARY32",
        "BINARY64",
        "line 29: 'BINARY64' is no type of data: ASCII, BINARY, BINARY32 or FLOAT32",
    );
    check("BINARY32\r\n1\r\n", "BINARY32\r\n-1\r\n", "line 30: a factor of time stamps of -1");
    assert_eq!(fault(""), "line 0: the station's name is missing: the file ends");
    assert!(fault("PNG").contains("line 1: station and recorder are not there"));
    assert!(fault("a,b,1999\n2,2A,0D\n1,IA").contains("analogue channel 2 is missing"));
    assert!(fault("a,b,1999\n2,2A,0D\n").contains("analogue channel 1 is missing: the file ends"));
    assert!(fault(&"x".repeat(MAX_CFG_BYTES + 1)).contains("16777216 at most"));
}

#[test]
fn what_is_odd_is_a_remark() {
    let remarks = |text: String| Cfg::parse(text.as_bytes()).unwrap().remarks;
    let old = Recipe::new(Revision::Of1991, DataType::Ascii).cfg();
    assert!(remarks(old.replace("02/29/24", "29/02/24"))[0].contains("the other order"));
    assert!(
        remarks(recipe().replace(",2013", ",2077"))[0]
            .contains("revision '2077' is not known: read as of 2013")
    );
    let cut = recipe();
    let end = cut.find("+1,+1").unwrap();
    assert_eq!(remarks(cut[..end].to_owned()), ["time code and time quality are missing"]);
    let end = cut.find("1\r\n+1,+1").unwrap();
    assert_eq!(remarks(cut[..end].to_owned()).len(), 2);
}

#[test]
fn names_are_read_in_either_encoding() {
    let name = |bytes: &[u8]| Cfg::parse(bytes).unwrap().station;
    let text = recipe().replace("Nord", "Söder");
    assert_eq!(name(text.as_bytes()), "Söder");
    assert_eq!(name(format!("\u{feff}{text}").as_bytes()), "Söder");
    let latin: Vec<u8> = text.chars().map(|c| u32::from(c) as u8).collect();
    assert_eq!(name(&latin), "Söder");
}

#[test]
fn a_channel_that_cannot_be_read_is_one_channels_fault() {
    for (from, to, expected) in [
        ("0.5", "zero", "line 3: analogue channel 1 ('IA'): multiplier a: 'zero' is no number"),
        ("0.5", "", "line 3: analogue channel 1 ('IA') has no multiplier a"),
        ("0.5", "NaN", "'NaN' is no number"),
        (",-3,", ",-3,,", "line 3: analogue channel 1 ('IA') has 14 fields instead of 13"),
    ] {
        let text = recipe();
        assert!(text.contains(from), "{from}");
        let cfg = Cfg::parse(text.replacen(from, to, 1).as_bytes()).unwrap();
        let fault = cfg.analogs[0].fault.clone().unwrap();
        assert!(fault.contains(expected), "{expected}: {fault}");
        assert_eq!(cfg.analogs[1].fault, None);
    }
    let cfg = Cfg::parse(recipe().replace("125.5", "1e9").as_bytes()).unwrap();
    let fault = cfg.analogs[1].fault.clone().unwrap();
    assert!(fault.contains("line 4: analogue channel 2 ('UA'): a skew of 1000000000"), "{fault}");
}

#[test]
fn what_recorders_write_is_read_with_a_remark() {
    for (from, to, remark) in [
        ("20,2A,18D", "20,2A,18D,", ""),
        ("20,2A,18D", "21,2A,18D", "line 2: 2 analogue and 18 digital channels are not 21"),
        ("1200,1000", "1200,500", "sample rate 2: its last sample, 500, does not come after"),
        ("20,2A,18D", "20A,2A,18D", "line 2: 2 analogue and 18 digital channels are not 20A"),
        ("4800,500", "4800,500,", ""),
        ("\r\n1200,1000", "", "1 sample rates of 2 are there"),
        ("\r\n1200,1000", "\r\n1200,1000\r\n1200,1000", "1 sample rates more than the file says"),
        ("29/02/2024,13:14:15.250000", ",", "there is no date and no time: taken as unknown"),
        ("29/02/2024,13:14:15.250000", "", "there is no date and no time: taken as unknown"),
        ("29/02/2024", "31/02/2024", "'31/02/2024' is no date dd/mm/yyyy"),
        ("29/02/2024", "2024-02-29", "'2024-02-29' has the year first"),
        ("29/02/2024,13:14:15.250000", "2024-02-29T13:14:15.25Z", "has the year first"),
        ("29/02/2024,13:14:15.250000", "2024/02/29 13:14:15.25", "has the year first"),
        ("BINARY32\r\n1\r\n", "BINARY32\r\n0\r\n", "the factor of time stamps is 0"),
        ("BINARY32\r\n1\r\n", "BINARY32,\r\n1,\r\n", ""),
    ] {
        let text = recipe();
        assert!(text.contains(from), "{from}");
        let cfg = Cfg::parse(text.replacen(from, to, 1).as_bytes()).unwrap();
        let remarks = cfg.remarks.join("; ");
        assert!(
            remarks.contains(remark) && (remark.is_empty() == remarks.is_empty()),
            "{to}: {remarks}"
        );
        let is_known = !remark.contains("no date");
        let expected = is_known.then_some(1_709_212_455_250_000_000);
        assert_eq!(cfg.start.nanos, expected, "{to}");
    }
}

#[test]
fn only_2013_has_nanoseconds() {
    for revision in [Revision::Of1991, Revision::Of1999, Revision::Of2013] {
        let recipe = Recipe { is_nano: true, ..Recipe::new(revision, DataType::Ascii) };
        let cfg = Cfg::parse(recipe.cfg().as_bytes()).unwrap();
        let has_nanos = revision == Revision::Of2013;
        assert_eq!(cfg.timestamp_nanos, if has_nanos { 1.0 } else { 1000.0 }, "{revision:?}");
        assert_eq!(cfg.remarks.iter().any(|r| r.contains("nanoseconds")), !has_nanos);
    }
}

#[test]
fn names_are_read_in_the_encoding_that_is_named_or_marked() {
    let station = |bytes: &[u8], name: &str| {
        let encoding = TextEncoding::from_name(name).ok();
        Cfg::parse_encoded(bytes, encoding).unwrap().station
    };
    let text = |station: &[u8]| {
        let text = recipe();
        [station, text.strip_prefix("Nord").unwrap().as_bytes()].concat()
    };
    assert_eq!(station(&text(b"\xd6\xf7\xb1\xe4"), "gb18030"), "主变");
    assert_eq!(station(&text(b"\xcf\xd1 1"), "windows-1251"), "ПС 1");
    let wide = format!("\u{feff}{}", recipe().replace("Nord", "变电站"));
    let little: Vec<u8> = wide.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let big: Vec<u8> = wide.encode_utf16().flat_map(u16::to_be_bytes).collect();
    assert_eq!(station(&little, ""), "变电站");
    assert_eq!(station(&big, "windows-1252"), "变电站");
    let cfg = Cfg::parse(&text(b"S\x96T")).unwrap();
    assert_eq!(cfg.station, "S–T");
    assert!(cfg.remarks[0].contains("windows-1252"), "{:?}", cfg.remarks);
}

#[test]
fn a_stations_name_may_have_commas() {
    let cfg = Cfg::parse(recipe().replace("Nord,", "Nord, bay 1, E01,").as_bytes()).unwrap();
    assert_eq!((cfg.station.as_str(), cfg.device.as_str()), ("Nord,bay 1,E01", "REC 7"));
    assert_eq!(cfg.revision, Revision::Of2013);
    assert_eq!(cfg.remarks, ["the station's name has commas"]);
    let cfg = Cfg::parse(recipe().replace(",2013", ",2013,,").as_bytes()).unwrap();
    assert_eq!((cfg.revision, cfg.remarks.len()), (Revision::Of2013, 0));
}
