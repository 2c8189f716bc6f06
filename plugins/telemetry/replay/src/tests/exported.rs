//! CSV as programs export it: with the settings that a person would give each file has its value,
//! or a refusal that names fault, place and setting.

use busbar_plugin_sdk::Error;

use super::*;

/// A file, its settings, and the values of its tags at the end.
struct Case {
    name: &'static str,
    bytes: Vec<u8>,
    csv: serde_json::Value,
    /// Addresses and values; `None` is bad.
    tags: Vec<(ValueKind, serde_json::Value, Option<Value>)>,
}

const F64: ValueKind = ValueKind::F64;

fn number(
    address: serde_json::Value,
    value: f64,
) -> Vec<(ValueKind, serde_json::Value, Option<Value>)> {
    vec![(F64, address, Some(Value::F64(value)))]
}

fn oil() -> Vec<(ValueKind, serde_json::Value, Option<Value>)> {
    number(json!({"column": "Oil"}), 61.5)
}

fn run(
    name: &str,
    bytes: &[u8],
    csv: &serde_json::Value,
    tags: Vec<TagSpec>,
) -> (TempDir, Running) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join(name);
    std::fs::write(&file, bytes).unwrap();
    let settings = json!({"format": "csv", "csv": csv});
    (folder, start(&file, settings, tags))
}

fn cases() -> Vec<Case> {
    let iso = "2026-01-02T03:04:05Z";
    let case = |name, text: &str, csv, tags| Case { name, bytes: text.into(), csv, tags };
    let timed = |name, time: &str, csv: serde_json::Value| {
        let mut csv = csv;
        csv["delimiter"] = json!(";");
        case(name, &format!("time;Oil\n{time};60\n{time};61.5\n"), csv, oil())
    };
    let column = |name: &str, value: f64| (F64, json!({"column": name}), Some(Value::F64(value)));
    let utc = |format: &str| json!({"time_format": format, "zone": "UTC"});
    let utf16 = |text: &str, to_bytes: fn(u16) -> [u8; 2]| -> Vec<u8> {
        "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(to_bytes).collect()
    };
    let short = format!("time,Oil\r\n{iso},60\r\n{iso},61.5\r\n");
    vec![
        case(
            "thousands of a decimal comma",
            &format!("time;P;Q\n{iso};1.234;1.234,5\n"),
            json!({"decimal": ",", "thousands": "."}),
            vec![column("P", 1234.0), column("Q", 1234.5)],
        ),
        case(
            "a decimal comma without thousands",
            &format!("time;P;Q\n{iso};1.234;1.234,5\n"),
            json!({"decimal": ","}),
            vec![(F64, json!({"column": "P"}), None), (F64, json!({"column": "Q"}), None)],
        ),
        case(
            "thousands of a decimal point",
            &format!("time,P,Q\n{iso},\"1,234.5\",\"1,234\"\n"),
            json!({"thousands": ","}),
            vec![column("P", 1234.5), column("Q", 1234.0)],
        ),
        Case {
            name: "UTF-16LE by its mark",
            bytes: utf16(&short, u16::to_le_bytes),
            csv: json!({}),
            tags: oil(),
        },
        Case {
            name: "UTF-16BE by its mark",
            bytes: utf16(&short, u16::to_be_bytes),
            csv: json!({}),
            tags: oil(),
        },
        Case {
            name: "a name in CP1252",
            bytes: [b"time;\xd6ltemp\n", iso.as_bytes(), b";61,5\n"].concat(),
            csv: json!({"encoding": "windows-1252", "decimal": ","}),
            tags: number(json!({"column": "Öltemp"}), 61.5),
        },
        Case {
            name: "a name in CP1252, by number",
            bytes: [b"time;\xd6ltemp\n", iso.as_bytes(), b";61,5\n"].concat(),
            csv: json!({"decimal": ",", "time": 1}),
            tags: number(json!({"column": 2}), 61.5),
        },
        Case {
            name: "a name in windows-1251",
            bytes: [b"time,\xcc\xe0\xf1\xeb\xee\n", iso.as_bytes(), b",61.5\n"].concat(),
            csv: json!({"encoding": "windows-1251"}),
            tags: number(json!({"column": "Масло"}), 61.5),
        },
        Case {
            name: "a name in GB18030",
            bytes: [b"time,\xd3\xcd\xce\xc2\n", iso.as_bytes(), b",61.5\n"].concat(),
            csv: json!({"encoding": "gb18030"}),
            tags: number(json!({"column": "油温"}), 61.5),
        },
        timed("day first", "02.01.2026 03:04:05", utc("%d.%m.%Y %H:%M:%S")),
        timed("AM and PM", "1/2/2026 3:04:05 PM", utc("%m/%d/%Y %I:%M:%S %p")),
        timed("ISO with a space", "2026-01-02 03:04:05", json!({"zone": "Europe/Berlin"})),
        timed("ISO without a zone", "2026-01-02T03:04:05", json!({"zone": "Asia/Shanghai"})),
        timed(
            "the name of a zone",
            "2026-01-02 03:04:05 CET",
            json!({"time_format": "%Y-%m-%d %H:%M:%S %Z", "zone": "Europe/Berlin"}),
        ),
        timed("PI", "02-Jan-26 03:04:05", utc("%d-%b-%y %H:%M:%S")),
        timed("serial days", "46024.127835", utc("excel")),
        timed("microseconds", "1767323045000000", json!({"time_format": "unix_micros"})),
        timed("nanoseconds", "1767323045000000000", json!({"time_format": "unix_nanos"})),
        case(
            "a row of units",
            &format!("time,Oil,Tap\n,°C,\n{iso},61.5,7\n"),
            json!({"units_row": true}),
            oil(),
        ),
        case(
            "a row of units that nothing told",
            &format!("time,Oil,Tap\n,[°C],\n{iso},61.5,7\n"),
            json!({}),
            oil(),
        ),
        case(
            "no header",
            &format!("{iso},61.5\n{iso},61.5\n"),
            json!({"time": 1, "header": false}),
            number(json!({"column": 2}), 61.5),
        ),
        case(
            "a line of the delimiter",
            &format!("sep=;\ntime;Oil\n{iso};61.5\n"),
            json!({}),
            oil(),
        ),
        case(
            "lines before the header",
            &format!("Report\nof today\ntime,Oil\n{iso},61.5\n"),
            json!({"skip_lines": 2}),
            oil(),
        ),
        case(
            "date and time in two columns",
            "Date,Time,Oil\n2026-01-02,03:04:05,61.5\n",
            json!({"date": "Date", "time": "Time", "zone": "UTC"}),
            oil(),
        ),
        case(
            "WinCC",
            "\"VarName\";\"TimeString\";\"VarValue\";\"Validity\";\"Time_ms\"\n\
             \"T1_Oil\";\"02.01.2026 03:04:05\";61,5;1;46024127835,648\n\
             \"T1_Load\";\"02.01.2026 03:04:06\";88,25;0;46024127847,222\n",
            json!({"form": "long", "time": "TimeString", "name": "VarName", "value": "VarValue",
                "time_format": "%d.%m.%Y %H:%M:%S", "zone": "Europe/Berlin", "decimal": ",",
                "quality": "Validity", "qualities": {"1": "good", "0": "bad"}}),
            number(json!({"name": "T1_Oil"}), 61.5),
        ),
        case(
            "WinCC by its serial days",
            "\"VarName\";\"TimeString\";\"VarValue\";\"Validity\";\"Time_ms\"\n\
             \"T1_Oil\";\"02.01.2026 03:04:05\";61,5;1;46024127835,648\n",
            json!({"form": "long", "time": "Time_ms", "name": "VarName", "value": "VarValue",
                "time_format": "wincc", "zone": "UTC", "decimal": ","}),
            number(json!({"name": "T1_Oil"}), 61.5),
        ),
        case(
            "InfluxDB",
            &format!(
                "#group,false,false,true\n#datatype,string,long,dateTime:RFC3339\n#default,_result,,\n\
                 ,result,table,_time,_value,_field\n,,0,{iso},60,oil\n\n\
                 #group,false,false,true\n,result,table,_time,_value,_field\n,,1,{iso},61.5,oil\n"
            ),
            json!({"comment": "#", "form": "long", "time": "_time", "name": "_field",
                "value": "_value"}),
            number(json!({"name": "oil"}), 61.5),
        ),
        case(
            "words for quality",
            &format!("time,Oil,q\n{iso},60,GOOD\n{iso},61.5,OK\n"),
            json!({"quality": "q"}),
            oil(),
        ),
        case(
            "words for quality by the settings",
            &format!("time,Oil,q\n{iso},60,gültig\n{iso},61.5,Gültig\n"),
            json!({"quality": "q", "qualities": {"GÜLTIG": "good"}}),
            oil(),
        ),
        case(
            "letters as states, in the first row after the header, beside a date of its own",
            "Date,Time,Feeder\n2026-01-02,03:04:05,A\n",
            json!({"date": "Date", "time": "Time", "zone": "UTC"}),
            vec![(
                ValueKind::Bool,
                json!({"column": "Feeder", "states": {"A": true, "B": false}}),
                Some(Value::Bool(true)),
            )],
        ),
        case(
            "thousands of zero, which are a fraction of another format",
            &format!("time;P;Q\n{iso};0.500;1.500\n"),
            json!({"decimal": ",", "thousands": "."}),
            vec![(F64, json!({"column": "P"}), None), column("Q", 1500.0)],
        ),
        case(
            "whole numbers with a fraction of zeros",
            &format!("time,A,B\n{iso},7.0,7.5\n"),
            json!({}),
            vec![
                (ValueKind::I64, json!({"column": "A"}), Some(Value::I64(7))),
                (ValueKind::I64, json!({"column": "B"}), None),
            ],
        ),
        case(
            "units in cells",
            &format!("time,A,B,C\n{iso},88.25 %,61.5 °C,5 kV\n"),
            json!({}),
            vec![
                column("A", 88.25),
                (F64, json!({"column": "B", "unit": "degC"}), Some(Value::F64(61.5))),
                (F64, json!({"column": "C", "unit": "V"}), None),
            ],
        ),
        case(
            "a unit that changes",
            &format!("time,A\n{iso},61.5 °C\n{iso},142 °F\n"),
            json!({}),
            vec![(F64, json!({"column": "A"}), None)],
        ),
        case(
            "words for no value",
            &format!("time,A,B,C,D\n{iso},1,2,3,4\n{iso},unknown,Unavailable,---,fehlt\n"),
            json!({"no_value": ["unknown", "unavailable", "---", "fehlt"]}),
            ["A", "B", "C", "D"].map(|name| (F64, json!({"column": name}), None)).into(),
        ),
        case(
            "words for states",
            &format!("time,Q,S,T\n{iso},ZU,1.0,TRUE\n"),
            json!({}),
            vec![
                (
                    ValueKind::DoublePoint,
                    json!({"column": "Q", "states": {"AUF": "off", "ZU": "on"}}),
                    Some(Value::DoublePoint(busbar_plugin_sdk::DoublePoint::On)),
                ),
                (ValueKind::Bool, json!({"column": "S"}), Some(Value::Bool(true))),
                (
                    ValueKind::Bool,
                    json!({"column": "T", "states": {"1": false, "0": true}}),
                    Some(Value::Bool(false)),
                ),
            ],
        ),
        case(
            "a recorder that stopped",
            &format!("time,name,value\n{iso},Oil,61.5\n2026-01-02T03:04:07Z,$RT_OFF$,0\n"),
            json!({"form": "long", "stop_names": ["$RT_OFF$"]}),
            vec![(F64, json!({"name": "Oil"}), None)],
        ),
    ]
}

#[test]
fn every_export_has_its_value_with_the_settings_of_a_person() {
    for case in cases() {
        let tags =
            case.tags.iter().enumerate().map(|(index, (kind, address, _))| {
                tag_spec(index as u32, "T", *kind, address.clone())
            });
        let (_folder, running) = run("a.csv", &case.bytes, &case.csv, tags.collect());
        let samples = running.played();
        for (index, (_, _, expected)) in case.tags.iter().enumerate() {
            let last = of_tag(&samples, index as u32).pop().expect(case.name);
            assert_eq!(last.value, *expected, "{}: tag {index}", case.name);
            let is_good = last.quality == Quality::Good;
            assert_eq!(is_good, expected.is_some(), "{}: {:?}", case.name, last.quality);
        }
    }
}

#[test]
fn times_are_those_of_the_zone() {
    for (time, format, zone, unix) in [
        ("02.01.2026 03:04:05", "%d.%m.%Y %H:%M:%S", "Europe/Berlin", 1_767_319_445),
        ("2026-07-02 03:04:05", "rfc3339", "Europe/Berlin", 1_782_954_245),
        ("46024.127835648", "excel", "UTC", 1_767_323_045),
        ("1/2/2026 3:04:05 PM", "%m/%d/%Y %I:%M:%S %p", "America/New_York", 1_767_384_245),
    ] {
        let text = format!("time;Oil\n{time};61.5\n");
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.csv");
        std::fs::write(&file, text).unwrap();
        let csv = json!({"time_format": format, "zone": zone, "delimiter": "semicolon"});
        let settings = json!({"times": "original", "csv": csv});
        let tags = vec![tag_spec(0, "Oil", F64, json!({"column": "Oil"}))];
        let samples = start(&file, settings, tags).played();
        let found = samples[0].source_time.unwrap().duration_since(std::time::UNIX_EPOCH).unwrap();
        assert_eq!(found, Duration::from_secs(unix), "{time} {zone}");
    }
}

#[test]
fn an_hour_that_was_twice_is_uncertain_and_one_that_never_was_is_bad() {
    let rows = |times: &[&str]| -> String {
        times.iter().enumerate().map(|(row, time)| format!("{time},{row}\n")).collect()
    };
    let zone = json!({"zone": "Europe/Berlin"});
    let tags = || vec![tag_spec(0, "A", F64, json!({"column": "A"}))];
    // 25 October 2026: 02:30 of summer, then of winter.
    let twice = [
        "2026-10-25 01:30",
        "2026-10-25 02:30",
        "2026-10-25 02:30:01",
        "2026-10-25 02:00",
        "2026-10-25 03:30",
    ];
    let text = format!("time,A\n{}", rows(&twice));
    let (_folder, running) = run("a.csv", text.as_bytes(), &zone, tags());
    let samples = running.played();
    let uncertain = Quality::Uncertain(Reason::SourceTime);
    let found: Vec<_> = samples.into_iter().map(|sample| (sample.value, sample.quality)).collect();
    let value = |row: usize| Some(Value::F64(row as f64));
    assert_eq!(
        found,
        [
            (value(0), Quality::Good),
            (value(1), uncertain),
            (value(2), uncertain),
            (value(3), uncertain),
            (value(4), Quality::Good),
        ]
    );
    let text =
        format!("time,A\n{}", rows(&["2026-03-29 01:30", "2026-03-29 02:30", "2026-03-29 03:30"]));
    let (_folder, running) = run("a.csv", text.as_bytes(), &zone, tags());
    let found: Vec<_> = running.played().into_iter().map(|sample| sample.value).collect();
    assert_eq!(found, [value(0), None, value(2)]);
}

#[test]
fn what_is_refused_names_fault_place_and_setting_and_never_the_view() {
    let iso = "2026-01-02T03:04:05Z";
    for (text, csv, address, part) in [
        (
            "time,Oil\n1767323045000,61.5\n1767323046000,62.5\n".to_owned(),
            json!({"time_format": "unix_seconds"}),
            json!({"column": "Oil"}),
            "line 2: '1767323045000' as a number of seconds would be out of reach; as a number of \
             milliseconds it is of 2026: is csv.time_format right?",
        ),
        (
            "time,Oil\n1767323045,61.5\n".to_owned(),
            json!({"time_format": "unix_millis"}),
            json!({"column": "Oil"}),
            "would be of the year 1970",
        ),
        (
            "time,Oil\n2026-01-02 03:04:05,61.5\n".to_owned(),
            json!({}),
            json!({"column": "Oil"}),
            "it has no zone: set `zone`, such as UTC or Europe/Berlin",
        ),
        (
            format!("time;Oil\n{iso};61.5\n"),
            json!({}),
            json!({"column": "Oil"}),
            "set csv.delimiter",
        ),
        (
            format!("{iso},61.5\n"),
            json!({}),
            json!({"column": "Oil"}),
            "without a header columns have numbers alone",
        ),
        (
            format!("time,Gas\n{iso},61.5\n"),
            json!({}),
            json!({"column": "Oil"}),
            "tag 'T': there is no column 'Oil'; there are 'time', 'Gas'",
        ),
        (
            format!("zeit,Oil\n{iso},61.5\n"),
            json!({}),
            json!({"column": "Oil"}),
            "csv.time: there is no column 'time'",
        ),
        (
            format!("time,Oil\n,°F\n{iso},142\n"),
            json!({}),
            json!({"column": "Oil", "unit": "°C"}),
            "its column is in °F, and °C is wanted: correct the tag's unit, or give it a `scale`",
        ),
        (
            format!("time,Oil\n{iso},1\nOil,time\n61.5,{iso}\n"),
            json!({}),
            json!({"column": "Oil"}),
            "line 3: another header with other columns",
        ),
    ] {
        let tags = vec![tag_spec(0, "T", F64, address)];
        let (folder, running) = run("a.csv", text.as_bytes(), &csv, tags.clone());
        running.wait_for_link(LinkState::Down, part);
        let settings = json!({"csv": csv});
        let checked = create(&folder.path().join("a.csv"), settings).check(&tags);
        // The rows are read when they are played.
        let is_of_rows = part.starts_with("line 3");
        let message = checked.as_ref().err().map(Error::message);
        assert_eq!(message.is_none(), is_of_rows, "{part}: {checked:?}");
        if let Some(message) = message {
            assert!(message.contains(part), "{message}");
            assert_eq!(checked, Err(Error::failed(message)), "no view is kept from opening");
        }
    }
    let bytes = [b"time,\xd6l\n", iso.as_bytes(), b",1\n"].concat();
    let tags = vec![tag_spec(0, "T", F64, json!({"column": "Öl"}))];
    let (_folder, running) = run("a.csv", &bytes, &json!({}), tags);
    running.wait_for_link(LinkState::Down, "it is no text in UTF-8: set csv.encoding");
}

#[test]
fn a_code_of_more_than_eight_bits_is_no_quality_of_opc() {
    // 500 is stale to Sparkplug and Ignition; its lowest eight bits are those of good.
    let text = "time,Oil,q\n2026-01-02T03:04:05Z,60,192\n2026-01-02T03:04:06Z,61.5,500\n";
    let tags = vec![tag_spec(0, "T", F64, json!({"column": "Oil"}))];
    let (_folder, running) = run("a.csv", text.as_bytes(), &json!({"quality": "q"}), tags);
    let found: Vec<_> = running.played().iter().map(|sample| sample.quality).collect();
    assert_eq!(found, [Quality::Good, Quality::Bad(Reason::Unknown)]);
}

/// A value in another unit than its tag's never shows as one of the tag's unit.
#[test]
fn a_unit_of_the_file_that_is_not_the_tags_is_refused() {
    let iso = "2026-01-02T03:04:05Z";
    let tag_in = |unit: &str| {
        vec![TagSpec { unit: unit.into(), ..tag_spec(0, "T", F64, json!({"column": "A"})) }]
    };
    for (wanted, found) in [
        ("°C", "°F"),
        ("MW", "kW"),
        ("kV", "V"),
        ("A", "kA"),
        ("bar", "MPa"),
        ("%", "p.u."),
        ("°C", "K"),
    ] {
        let text = format!("time,A\n,{found}\n{iso},142\n");
        let (_folder, running) = run("a.csv", text.as_bytes(), &json!({}), tag_in(wanted));
        let part = format!("its column is in {found}, and {wanted} is wanted");
        running.wait_for_link(LinkState::Down, &part);
        let text = format!("time,A\n{iso},1\n{iso},142 {found}\n");
        let (_folder, running) = run("a.csv", text.as_bytes(), &json!({}), tag_in(wanted));
        let last = running.played().pop().unwrap();
        assert_eq!((last.value, last.quality), (None, Quality::Bad(Reason::Sensor)), "{found}");
        // Without a unit of the tag, as where the host scales samples, the file's counts.
        let (_folder, running) = run("a.csv", text.as_bytes(), &json!({}), tag_in(""));
        assert_eq!(running.played().last().unwrap().value, Some(Value::F64(142.0)), "{found}");
    }
    for (wanted, found) in [("°C", "degC"), ("MW", "MW"), ("apples", "kV"), ("kvar", "kVAr")] {
        let text = format!("time,A\n,{found}\n{iso},142\n");
        let (_folder, running) = run("a.csv", text.as_bytes(), &json!({}), tag_in(wanted));
        assert_eq!(running.played().last().unwrap().value, Some(Value::F64(142.0)), "{found}");
    }
}

#[test]
fn with_columns_by_number_no_row_is_lost_to_a_header_that_is_none() {
    let rows = |header: &str| format!("{header}0,1\n1,2\n2,3\n");
    let tags = || vec![tag_spec(0, "A", F64, json!({"column": 2}))];
    for (header, set, count) in [
        ("", json!(null), 3),
        ("", json!(false), 3),
        ("time,A\n", json!(null), 3),
        ("time,A\n", json!(true), 3),
        // Who says that there is one is believed, and told.
        ("", json!(true), 2),
    ] {
        let csv = json!({"time": 1, "time_format": "seconds", "header": set});
        let (_folder, running) = run("a.csv", rows(header).as_bytes(), &csv, tags());
        assert_eq!(running.played().len(), count, "{header:?} {set}");
    }
}

/// Writes a table of known values in a dialect, and reads it by the settings of that dialect.
#[test]
fn what_is_written_in_any_dialect_is_read_in_it() {
    let mut random = fastrand::Rng::with_seed(2026);
    for round in 0..60 {
        let decimal = [".", ","][random.usize(0..2)];
        let others: Vec<Option<&str>> = [None, Some("."), Some(","), Some("'"), Some(" ")]
            .into_iter()
            .filter(|c| *c != Some(decimal))
            .collect();
        let thousands = others[random.usize(0..others.len())];
        let delimiter = [",", ";", "\t", "|"][random.usize(0..4)];
        let (format, written) = [
            ("%d.%m.%Y %H:%M:%S", "02.01.2026 03:04:"),
            ("%m/%d/%Y %H:%M:%S", "01/02/2026 03:04:"),
            ("rfc3339", "2026-01-02 03:04:"),
        ][random.usize(0..3)];
        let encoding = ["utf-8", "windows-1252", "utf-16le", "gb18030"][random.usize(0..4)];
        let skip = random.usize(0..3);
        let has_units = random.bool();
        let name = if encoding == "gb18030" { "油温" } else { "Öl" };
        let mut text = "x\n".repeat(skip);
        text += &format!("time{delimiter}{name}\r\n");
        if has_units {
            text += &format!("{delimiter}°C\r\n");
        }
        let mut values = Vec::new();
        for row in 0..20 {
            let (whole, cents) = (random.i64(-2_000_000..2_000_000), random.u32(0..100));
            let digits = whole.unsigned_abs().to_string();
            let mut grouped = String::new();
            for (place, digit) in digits.chars().enumerate() {
                if place > 0 && (digits.len() - place) % 3 == 0 {
                    grouped += thousands.unwrap_or("");
                }
                grouped.push(digit);
            }
            let sign = if whole < 0 { "-" } else { "" };
            let unit = ["", " °C", "°C"][random.usize(0..3)];
            text += &format!(
                "{written}{row:02}{delimiter}\"{sign}{grouped}{decimal}{cents:02}{unit}\"\r\n"
            );
            values.push(format!("{sign}{digits}.{cents:02}").parse::<f64>().unwrap());
        }
        let bytes = match encoding {
            "utf-16le" => text.encode_utf16().flat_map(u16::to_le_bytes).collect(),
            "windows-1252" => text.chars().map(|c| c as u32 as u8).collect(),
            "gb18030" => {
                // These characters and those of ASCII are all that there is.
                text.replace("油温", "\u{1}")
                    .replace('°', "\u{2}")
                    .bytes()
                    .flat_map(|byte| match byte {
                        1 => vec![0xd3, 0xcd, 0xce, 0xc2],
                        2 => vec![0xa1, 0xe3],
                        other => vec![other],
                    })
                    .collect()
            }
            _ => text.clone().into_bytes(),
        };
        let mut csv = json!({"delimiter": delimiter, "decimal": decimal, "encoding": encoding,
            "skip_lines": skip, "time_format": format, "zone": "Europe/Berlin"});
        if let Some(thousands) = thousands {
            csv["thousands"] = json!(thousands);
        }
        let tags = vec![tag_spec(0, "A", F64, json!({"column": name, "unit": "°C"}))];
        let (_folder, running) = run("a.csv", &bytes, &csv, tags);
        let found: Vec<_> = running.played().into_iter().map(|sample| sample.value).collect();
        let expected: Vec<_> = values.into_iter().map(|value| Some(Value::F64(value))).collect();
        assert_eq!(found, expected, "round {round}: {csv}\n{text}");
    }
}
