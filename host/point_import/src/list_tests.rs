//! Lists as people save them, good and bad.

use serde_json::json;

use super::*;
use crate::PointType;

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
    assert_eq!(position.value_type, PointType::DoublePoint);
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
    let text = "tag,type,low,high,limit_low,limit_high,freshness_ms,scale,address\n\
                A,f64,1,2,,,,,1\n\
                ,f64,,,,,,,1\n\
                B,command,x,,,,10,,1\n\
                C,f64,5,5,,,,0,1\n\
                D,bool,,,,,,2,\n\
                A,f64,,,,,,,1\n\
                E,f64,,,,,,,1,2\n\
                F,f64,,,3,NaN,,,1";
    let expected = [
        "3:: the row has no tag",
        "4:type: 'command' is no type that is known",
        "4:low: 'x' is no number",
        "4:freshness_ms: '10' is no such time",
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
