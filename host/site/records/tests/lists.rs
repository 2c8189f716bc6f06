//! Rows are found by what equipment is called, the urgent first; nothing breaks the rules.

use busbar_records::{Column, Description, Kind, List, ListInfo, MAX_TEXT_BYTES, Record, RowError};
use busbar_types::DefectSeverity;

fn info(kind: Kind) -> ListInfo {
    ListInfo {
        title: "Work orders".into(),
        kind,
        source: "orders.csv".into(),
        columns: vec![Column { name: "Text".into(), ..Column::default() }],
        ..ListInfo::default()
    }
}

fn row(equipment: &str, text: &str, day: Option<i64>, is_open: bool) -> Record {
    Record {
        equipment: equipment.into(),
        cells: vec![text.into()],
        unix_nanos: day,
        severity: None,
        is_open,
    }
}

fn texts<'a>(rows: &[(usize, &'a Record)]) -> Vec<&'a str> {
    rows.iter().map(|(_, row)| row.cells[0].as_str()).collect()
}

#[test]
fn the_open_come_first_then_the_newest_by_any_id() {
    let mut list = List::new(info(Kind::Business));
    let severe =
        Record { severity: Some(DefectSeverity::Serious), ..row("=Q1", "f", Some(5), true) };
    list.append(vec![
        row("=Q1", "a", Some(9), false),
        row("2211", "b", Some(3), true),
        row("=Q1", "c", None, true),
        row("=Q2", "d", Some(7), true),
        row("=Q1", "e", Some(5), true),
        severe,
    ])
    .expect("they keep the rules");
    let ids = ["=Q1".to_owned(), "2211".to_owned()];
    let found = list.rows_of(&ids);
    assert_eq!(texts(&found), ["f", "e", "b", "c", "a"]);
    assert_eq!(found[2].0, 1, "by its alias");
    assert!(list.rows_of(&["=Q9".to_owned()]).is_empty());
    let mut register = List::new(info(Kind::Asset));
    let rows = vec![row("2211", "b", Some(1), false), row("=Q1", "a", Some(9), false)];
    register.append(rows).expect("they keep the rules");
    assert_eq!(texts(&register.rows_of(&ids)), ["a", "b"], "in the order of ids");
}

#[test]
fn what_breaks_a_rule_is_refused_in_words() {
    let long = "x".repeat(MAX_TEXT_BYTES + 1);
    for (bad, words) in [
        (row("", "a", None, true), "the equipment of a row is empty"),
        (row("a\nb", "a", None, true), "not one line"),
        (row(&long, "a", None, true), "too long"),
        (row("=Q1", &long, None, true), "a cell has more than 1024 bytes"),
        (Record { cells: Vec::new(), ..row("=Q1", "", None, true) }, "0 cells for 1 columns"),
    ] {
        let fault = List::new(info(Kind::Business)).append(vec![bad]).unwrap_err();
        assert!(fault.to_string().contains(words), "{fault}");
    }
    let fault = |reason: &str| RowError { row: 3, reason: reason.into() };
    let good = ListInfo { left_out: 1, faults: vec![fault("no date")], ..info(Kind::Asset) };
    assert_eq!(Description { lists: vec![good.clone()] }.check(), Ok(()));
    for (bad, words) in [
        (ListInfo { title: String::new(), ..good.clone() }, "title"),
        (ListInfo { source: "a\nb".into(), ..good.clone() }, "source"),
        (ListInfo { columns: Vec::new(), ..good.clone() }, "no column"),
        (ListInfo { columns: vec![Column::default()], ..good.clone() }, "name or unit"),
        (ListInfo { fault: Some(String::new()), ..good.clone() }, "its fault"),
        (ListInfo { left_out: 0, ..good.clone() }, "more rows left out"),
        (ListInfo { faults: vec![fault("")], ..good.clone() }, "why a row"),
    ] {
        let fault = Description { lists: vec![bad] }.check().unwrap_err().to_string();
        assert!(fault.starts_with("list 0 of records: ") && fault.contains(words), "{fault}");
    }
    assert!(Description { lists: vec![good; 17] }.check().is_err());
}

/// A list that is as full as it may be takes no more, whatever rows it is given.
#[test]
fn memory_is_bounded() {
    let mut list = List::new(info(Kind::Business));
    let text = "y".repeat(MAX_TEXT_BYTES);
    let fault = (0..).find_map(|n: u32| {
        list.append(vec![row(&format!("=Q{}", n % 7), &text, None, true)]).err()
    });
    assert!(fault.is_some_and(|fault| fault.to_string().contains("67108864 bytes")));
    assert!(list.bytes() <= busbar_records::MAX_BYTES + 2 * MAX_TEXT_BYTES && list.len() > 50_000);
}
