//! Lists as people save them, good and bad.

use busbar_types::ValueKind;
use serde_json::json;

use super::*;

#[track_caller]
fn faults(text: &str) -> Vec<String> {
    let list = PointList::parse(text.as_bytes());
    let told = |f: &ListFault| format!("{}:{}: {}", f.line, f.column, f.cause);
    list.faults.iter().map(told).collect()
}

#[test]
fn a_list_of_a_spreadsheet_is_read() {
    let text = "\u{feff}TAG;Description;Type;Unit;Low;High;address.register;address.table;Address.Swap;x\r\n\
                T1.TopOil;\"Top oil; upper\";AI;°C;-40;150;100;holding;TRUE;y\r\n\
                ;;;;;;;;;\r\n\
                Q1.Pos;;DP;;0;3;0;discrete;;\r\n";
    let list = PointList::parse(text.as_bytes());
    assert_eq!(list.faults, []);
    assert_eq!(list.unused, ["x"]);
    let [oil, position] = list.points.as_slice() else { panic!("{:?}", list.points) };
    assert_eq!((oil.line, oil.description.as_str()), (2, "Top oil; upper"));
    assert_eq!(oil.range, [Some(-40.0), Some(150.0)]);
    assert_eq!(oil.address, json!({"register": 100, "table": "holding", "Swap": true}));
    assert_eq!(position.value_type, ValueKind::DoublePoint);
    assert_eq!((position.line, position.range), (4, [None, None]), "a state has no range");
}

#[test]
fn addresses_come_as_json_or_text_or_both() {
    let text = "name\taddress\taddress.ioa\nA\t{\"ca\": 1}\t7\nB\tns=2;s=Oil\t\nC\t40001\t";
    let list = PointList::parse(text.as_bytes());
    let addresses: Vec<_> = list.points.iter().map(|point| point.address.clone()).collect();
    assert_eq!(addresses, [json!({"ca": 1, "ioa": 7}), json!("ns=2;s=Oil"), json!(40001)]);
}

#[test]
fn an_address_nests_no_deeper_than_a_configuration_can() {
    let nested = |depth| format!("{}1{}", "[".repeat(depth), "]".repeat(depth));
    let whole = |depth| faults(&format!("tag,address\nA,\"{}\"", nested(depth)));
    assert_eq!(whole(32), [""; 0]);
    assert_eq!(whole(33), ["2:: its address is nested more than 32 deep"]);
    let field = format!("tag,address.x\nA,{}", nested(32));
    assert_eq!(faults(&field), ["2:: its address is nested more than 32 deep"]);
}

#[test]
fn every_fault_of_a_list_is_told_at_once_and_no_row_is_lost() {
    let text = "tag,type,low,high,limit_low,limit_high,freshness_seconds,scale,address\n\
                A,f64,1,2,,,,,1\n\
                ,f64,,,,,,,1\n\
                B,command,x,,,,0.01,,1\n\
                C,f64,5,5,,,,0,1\n\
                D,bool,,,,,,2,\n\
                A,f64,,,,,,,1\n\
                E,f64,,,,,,,1,2\n\
                F,f64,,,3,NaN,,,1";
    let expected = [
        "3:: the row has no tag",
        "4:type: 'command' is no type that is known",
        "4:low: 'x' is no number",
        "4:freshness_seconds: '0.01' is no such time",
        "5:low: low, 5, is not less than high, 5",
        "5:scale: the factor is 0",
        "6:scale: a tag of type 'bool' has no scale",
        "6:: the tag has no address",
        "7:: the tag 'A' is in line 2 already",
        "8:: it has 10 fields, the header 9",
        "9:limit_high: 'NaN' is no number",
    ];
    assert_eq!(faults(text), expected);
    assert_eq!(PointList::parse(text.as_bytes()).points.len(), 1);
}

#[test]
fn a_tag_whose_first_row_is_bad_is_not_read_from_a_later_one() {
    // Bad by a value, by its number of fields, by a missing address, by an unknown type.
    let tag = "A";
    for bad in ["A,f64,x,1,", "A,f64,1,2,3,4,5", "A,f64,,,", "A,command,,1,"] {
        let good = format!("{tag},f64,,40002,");
        let text = |rows: &[&str]| format!("tag,type,low,address,high\n{}", rows.join("\n"));
        let told = format!("the tag '{tag}' is in line 2 already");
        let list = PointList::parse(text(&[bad, &good, "B,f64,,1,", &good]).as_bytes());
        let tags: Vec<_> = list.points.iter().map(|point| point.tag.as_str()).collect();
        assert_eq!(tags, ["B"], "{bad}");
        assert!(!list.is_unreadable && list.faults.iter().any(|fault| fault.line == 2));
        for line in [3, 5] {
            let fault = list.faults.iter().rfind(|fault| fault.line == line);
            let cause = &fault.expect("the later row is named").cause;
            assert!(cause.starts_with(&told) && cause.contains("neither is read"), "{cause}");
        }
        // The other way round the first one counts; a row with faults is told by those.
        for (rows, read) in [([good.as_str(), bad], 1), ([bad, bad], 0)] {
            let list = PointList::parse(text(&rows).as_bytes());
            assert_eq!(list.points.len(), read, "{bad}");
            assert!(list.faults.iter().any(|fault| fault.line == 3), "{:?}", list.faults);
        }
    }
}

#[test]
fn equal_rows_are_read_once_and_told() {
    let list = PointList::parse(b"tag,address\nA,1\nA,1\nA,1\n,2\n,3");
    assert_eq!(list.points.len(), 1);
    let lines: Vec<_> =
        list.faults.iter().map(|fault| (fault.line, fault.cause.as_str())).collect();
    let told = "the tag 'A' is in line 2 already";
    let none = "the row has no tag";
    assert_eq!(lines, [(3, told), (4, told), (5, none), (6, none)]);
}

#[test]
fn duplicates_are_found_in_any_order_of_good_and_bad_rows() {
    let mut noise: u64 = 11;
    let mut dice = |sides: u64| {
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (noise >> 33) % sides
    };
    for _ in 0..500 {
        let rows: Vec<(u64, bool)> = (0..dice(12) + 1).map(|_| (dice(4), dice(2) == 0)).collect();
        let row = |(register, (tag, is_bad)): (usize, &(u64, bool))| {
            format!("T{tag},{},{register}", if *is_bad { "command" } else { "f64" })
        };
        let lines: Vec<_> = rows.iter().enumerate().map(row).collect();
        let list = PointList::parse(format!("tag,type,address\n{}", lines.join("\n")).as_bytes());
        // The truth: a tag comes from its first row, if that is good, and else not at all.
        let firsts = rows.iter().enumerate().filter(|(index, (tag, is_bad))| {
            !is_bad && !rows[..*index].iter().any(|(other, _)| other == tag)
        });
        let expected: Vec<_> =
            firsts.map(|(index, (tag, _))| (format!("T{tag}"), json!(index))).collect();
        let read: Vec<_> =
            list.points.iter().map(|point| (point.tag.clone(), point.address.clone())).collect();
        assert_eq!(read, expected, "{lines:?}");
        // Each row that is left out is named.
        for index in 0..rows.len() {
            let line = index as u64 + 2;
            let is_read = list.points.iter().any(|point| point.line == line);
            assert_ne!(is_read, list.faults.iter().any(|fault| fault.line == line), "{lines:?}");
        }
    }
}

#[test]
fn what_is_no_list_is_refused_as_a_whole() {
    let cases: [(&[u8], &str); 5] = [
        (b"", "no column holds"),
        (b"a,b\n1,2", "no column holds"),
        (b"tag,address\nx\xff,1", "UTF-8"),
        (b"tag,address\n", "no points"),
        (b"tag,unit,unit\nA,1,2", "two columns"),
    ];
    for (bytes, cause) in cases {
        let list = PointList::parse(bytes);
        assert!(list.is_unreadable);
        assert!(list.faults[0].cause.contains(cause), "{:?}", list.faults);
    }
    assert_eq!(PointList::parse(b"tag,address\n\nx\xff,1").faults[0].line, 3);
}

#[test]
fn faults_are_bounded() {
    let text = "tag,type,address\n".to_owned() + &"A,?,1\n".repeat(5_000);
    let found = faults(&text);
    assert_eq!(found.len(), MAX_FAULTS + 1);
    assert!(found[MAX_FAULTS].contains("4000 more"), "{}", found[MAX_FAULTS]);
}

#[test]
fn a_quote_that_never_ends_and_noise_are_no_panic() {
    let mut noise: u64 = 7;
    let bytes: Vec<u8> = (0..20_000)
        .map(|_| {
            noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            b"a1,;\"\n\t.-\xc3\xa9"[(noise >> 33) as usize % 11]
        })
        .collect();
    let _ = PointList::parse(&bytes);
    let with_header = [b"tag,address\n\"".as_slice(), &bytes].concat();
    let _ = PointList::parse(&with_header);
}
