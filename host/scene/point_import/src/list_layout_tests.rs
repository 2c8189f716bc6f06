use super::*;

#[track_caller]
fn check(text: &str, delimiter: u8, line: u64) {
    let layout = layout_of(text);
    assert_eq!(
        (layout.delimiter as char, layout.lines_before + 1),
        (delimiter as char, line),
        "{text}"
    );
}

#[test]
fn the_header_is_found_below_titles() {
    check("tag,address\nA,1", b',', 1);
    check("Signal list;;\nStation North, rev. 3;;\n\nTag;Type;Address\nA;f64;1", b';', 4);
    check("sep=;\nTag;Type;Address\n", b';', 2);
    check("SEP=|\r\nTag|Address\r\n", b'|', 2);
    check("\"sep=,\"\nTag,Address\n", b',', 2);
    check("sep=\t\nTag\tAddress\n", b'\t', 2);
    check("sep=;\n\nTitle\nTag;Address\n", b';', 4);
    check("Name;Station North\nTag;Address\nA;1", b';', 2);
    check("\"Tag\nname\";\"Unit\n(EU)\";Address\nA;kV;1", b';', 1);
    check("Tag|Unit|Address\n", b'|', 1);
    // None: the first line, with the delimiter that it has most of.
    check("a;b;c\n1;2;3", b';', 1);
    check("tag\nA", b',', 1);
    check("", b',', 1);
    check("sep=;\nx;y\n", b';', 2);
    check("sep=;", b';', 1);
}

#[test]
fn cells_without_a_value_are_known() {
    for cell in ["", "-", "--", "N/A", "#N/A", "—"] {
        assert!(is_no_value(cell), "{cell}");
    }
    assert!(!is_no_value("0") && !is_no_value("none"));
    assert_eq!(
        (cell_text("=\"007\""), cell_text("=S12D1"), cell_text("=\"")),
        ("007", "=S12D1", "=\"")
    );
}
