use std::io::Cursor;

use super::*;

fn all(text: &[u8]) -> Vec<(Line, Vec<u8>, u64)> {
    let mut lines = Lines::from(Cursor::new(text.to_vec()), 0, 1).unwrap();
    let (mut line, mut found) = (Vec::new(), Vec::new());
    loop {
        let offset = lines.offset();
        match lines.read(&mut line).unwrap() {
            Line::End => return found,
            kind => found.push((kind, line.clone(), offset)),
        }
    }
}

#[test]
fn lines_end_in_either_way_and_the_last_without() {
    let found = all(b"a\r\nb\n\nc");
    let whole = |text: &[u8], offset| (Line::Whole, text.to_vec(), offset);
    assert_eq!(found, [whole(b"a", 0), whole(b"b", 3), whole(b"", 5), whole(b"c", 6)]);
    assert_eq!(all(b"a\n\x1a").len(), 1);
    assert_eq!(all(b""), []);
}

#[test]
fn a_line_that_is_too_long_is_passed_over() {
    let text = [&b"a\n"[..], &vec![b'x'; MAX_LINE_BYTES + 1], b"\nb\n"].concat();
    let kinds: Vec<_> = all(&text).into_iter().map(|(kind, line, _)| (kind, line.len())).collect();
    assert_eq!(kinds[0], (Line::Whole, 1));
    assert_eq!(kinds[1].0, Line::TooLong);
    assert!(kinds[1].1 <= MAX_LINE_BYTES);
    assert_eq!(kinds[2], (Line::Whole, 1));
}

#[test]
fn reading_goes_on_from_any_line() {
    let mut lines = Lines::from(Cursor::new(b"ab\ncd\nef\n".to_vec()), 3, 2).unwrap();
    let mut line = Vec::new();
    lines.read(&mut line).unwrap();
    assert_eq!((&line[..], lines.number(), lines.offset()), (&b"cd"[..], 3, 6));
    lines.go_to(0, 1).unwrap();
    lines.read(&mut line).unwrap();
    assert_eq!((&line[..], lines.number()), (&b"ab"[..], 2));
}

#[test]
fn a_line_feed_of_utf_16_has_two_bytes() {
    // U+0A05 and U+050A have the byte of a line feed.
    for (name, to_bytes) in
        [("utf-16le", u16::to_le_bytes as fn(u16) -> [u8; 2]), ("utf-16be", u16::to_be_bytes)]
    {
        let encoding = TextEncoding::from_name(name).unwrap();
        let text = "a\u{a05}\u{50a}\r\n\nb";
        let bytes: Vec<u8> = text.encode_utf16().flat_map(to_bytes).collect();
        let mut lines = Lines::of_encoding(Cursor::new(bytes), encoding, 0, 1).unwrap();
        let (mut line, mut found) = (Vec::new(), Vec::new());
        while lines.read(&mut line).unwrap() != Line::End {
            found.push(encoding.decode(&line).into_owned());
        }
        assert_eq!(found, ["a\u{a05}\u{50a}\r", "", "b"], "{name}");
        assert_eq!((lines.offset(), lines.number()), (14, 4));
    }
}
