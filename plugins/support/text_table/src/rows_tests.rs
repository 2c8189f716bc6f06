use std::io::Cursor;

use super::*;

const LIMITS: RowLimits = RowLimits { bytes: 4096, cells: 100 };

/// All rows of a table, each with its line.
fn read(bytes: &[u8], dialect: &Dialect) -> (Vec<(u64, Vec<String>)>, Vec<String>) {
    let (mut rows, remarks) = Rows::open(Cursor::new(bytes.to_vec()), dialect, LIMITS).unwrap();
    let mut found = Vec::new();
    loop {
        match rows.read().unwrap() {
            NextRow::End => return (found, remarks),
            NextRow::TooLong(_) => found.push((rows.line(), Vec::new())),
            NextRow::Row => {
                let cells = rows.cells().iter().map(str::to_owned).collect();
                found.push((rows.line(), cells));
            }
        }
    }
}

fn lines(found: &[(u64, Vec<String>)]) -> Vec<(u64, Vec<&str>)> {
    found.iter().map(|(line, cells)| (*line, cells.iter().map(String::as_str).collect())).collect()
}

#[test]
fn a_sep_line_names_the_delimiter() {
    let (found, remarks) = read(b"sep=;\r\na;b\r\n1;2\r\n", &Dialect::default());
    assert_eq!(lines(&found), [(2, vec!["a", "b"]), (3, vec!["1", "2"])]);
    assert!(remarks.is_empty());
    let (found, _) = read(b"\xef\xbb\xbfSEP=\t\na\tb\n", &Dialect::default());
    assert_eq!(lines(&found), [(2, vec!["a", "b"])]);
    let set = Dialect::parse(Some("semicolon"), None, 0, None).unwrap();
    let (found, remarks) = read(b"sep=,\na;b\n", &set);
    assert_eq!(lines(&found), [(2, vec!["a", "b"])]);
    assert!(remarks[0].contains("sep= says ',', the settings ';'"), "{remarks:?}");
    // Who counts the line as one to skip is right too.
    let skipping = Dialect::parse(None, None, 1, None).unwrap();
    assert_eq!(lines(&read(b"sep=;\na;b\n", &skipping).0), [(2, vec!["a", "b"])]);
}

#[test]
fn lines_before_the_header_and_comments_are_skipped() {
    let dialect = Dialect::parse(None, None, 2, Some("#")).unwrap();
    let (found, _) = read(b"Report\nof today\na,b\n# 1,2\n\n\"#x\",1\n3,4\n", &dialect);
    assert_eq!(lines(&found), [(3, vec!["a", "b"]), (7, vec!["3", "4"])]);
    let beyond = Dialect::parse(None, None, 9, None).unwrap();
    assert!(read(b"a\nb\n", &beyond).0.is_empty());
}

#[test]
fn encodings_are_read_by_mark_and_by_name() {
    let text = "Öl|x\r\n1|2\r\n";
    let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let marked = [&b"\xff\xfe"[..], &wide].concat();
    let dialect = |encoding: Option<&str>| Dialect::parse(Some("|"), encoding, 0, None).unwrap();
    let expected = [(1, vec!["Öl", "x"]), (2, vec!["1", "2"])];
    assert_eq!(lines(&read(&marked, &dialect(None)).0), expected);
    assert_eq!(lines(&read(&wide, &dialect(Some("utf-16le"))).0), expected);
    let (found, remarks) = read(&marked, &dialect(Some("windows-1252")));
    assert_eq!(lines(&found), expected);
    assert!(remarks[0].contains("UTF-16LE"), "{remarks:?}");
    let (found, _) = read(b"\xd6l|x\n1|2\n", &dialect(Some("cp1252")));
    assert_eq!(lines(&found), expected);
    // The second byte of this character of GB18030 is that of the delimiter.
    let chinese = dialect(Some("gb18030"));
    assert_eq!(lines(&read(b"\x81\x7c|2\n", &chinese).0), [(1, vec!["亅", "2"])]);
}

#[test]
fn a_quoted_cell_has_lines_and_a_quote_that_is_not_closed_ends_with_its_line() {
    let (found, _) = read(b"a,\"b\nc\"\r\n1,2\n", &Dialect::default());
    assert_eq!(lines(&found), [(1, vec!["a", "b\nc"]), (3, vec!["1", "2"])]);
    let (found, _) = read(b"a,\"b\n1,2\n3,4\n", &Dialect::default());
    assert_eq!(lines(&found), [(1, vec!["a", "b"]), (2, vec!["1", "2"]), (3, vec!["3", "4"])]);
    let many = format!("a,\"b\n{}", "1,2\n".repeat(500));
    assert_eq!(read(many.as_bytes(), &Dialect::default()).0.len(), 501);
}

#[test]
fn a_carriage_return_alone_ends_a_line_where_there_is_no_line_feed() {
    let (found, _) = read(b"a,b\r1,2\r", &Dialect::default());
    assert_eq!(lines(&found), [(1, vec!["a", "b"]), (2, vec!["1", "2"])]);
    let wide: Vec<u8> = "\u{feff}a,b\r1,2".encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(
        lines(&read(&wide, &Dialect::default()).0),
        [(1, vec!["a", "b"]), (2, vec!["1", "2"])]
    );
    assert_eq!(
        lines(&read(b"a\r\n1\r\n\x1a", &Dialect::default()).0),
        [(1, vec!["a"]), (2, vec!["1"])]
    );
}

#[test]
fn rows_are_bounded() {
    let long = format!("{}\n1\n", "x".repeat(LIMITS.bytes + 1));
    assert_eq!(lines(&read(long.as_bytes(), &Dialect::default()).0), [(1, vec![]), (2, vec!["1"])]);
    let wide = format!("{}\n1\n", ",".repeat(LIMITS.cells));
    assert_eq!(lines(&read(wide.as_bytes(), &Dialect::default()).0), [(1, vec![]), (2, vec!["1"])]);
}

#[test]
fn a_delimiter_is_a_character_or_its_name() {
    for (text, byte) in [(",", b','), ("semicolon", b';'), ("\t", b'\t'), ("tab", b'\t')] {
        assert_eq!(Delimiter::parse(text).unwrap().byte(), byte);
    }
    let faults = Dialect::parse(Some("x"), Some("y"), 99_999, Some("")).unwrap_err();
    let joined = faults.join("; ");
    for name in ["delimiter: 'x'", "encoding: 'y'", "skip_lines: 99999", "comment: give"] {
        assert!(joined.contains(name), "{joined}");
    }
}

#[test]
fn any_bytes_are_read_to_their_end() {
    let mut random = fastrand::Rng::with_seed(39);
    let alphabet = b"a1,;\"\r\n\t #=.\xff\xfe\0\xd6|";
    for _ in 0..20_000 {
        let length = random.usize(0..80);
        let bytes: Vec<u8> =
            (0..length).map(|_| alphabet[random.usize(0..alphabet.len())]).collect();
        let encoding = ["utf-8", "utf-16le", "utf-16be", "gb18030", "cp1252"][random.usize(0..5)];
        let comment = random.bool().then_some("#");
        let dialect = Dialect::parse(None, Some(encoding), random.u32(0..3), comment).unwrap();
        let (found, _) = read(&bytes, &dialect);
        assert!(found.len() <= length + 1);
        assert!(found.is_sorted_by_key(|(line, _)| *line));
    }
}
