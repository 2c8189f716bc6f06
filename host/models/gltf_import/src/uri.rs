//! URIs as text: data URIs (RFC 2397) and relative paths (RFC 3986).

use std::path::{Component, Path, PathBuf};

/// Decodes the part after `data:`. Only base64, which glTF uses.
pub(crate) fn decode_data(data: &str) -> Result<Vec<u8>, &'static str> {
    let (kind, payload) = data.split_once(',').ok_or("a data URI without a comma")?;
    if !kind.ends_with(";base64") {
        return Err("a data URI that is not base64");
    }
    decode_base64(payload.as_bytes())
}

fn decode_base64(text: &[u8]) -> Result<Vec<u8>, &'static str> {
    const DAMAGED: &str = "its base64 is damaged";
    let padding = text.iter().rev().take(2).take_while(|&&c| c == b'=').count();
    let digits = &text[..text.len() - padding];
    if digits.len() % 4 == 1 {
        return Err(DAMAGED);
    }
    let mut bytes = Vec::with_capacity(digits.len() / 4 * 3 + 3);
    for group in digits.chunks(4) {
        let mut bits: u32 = 0;
        for &digit in group {
            bits = bits << 6 | u32::from(base64_value(digit).ok_or(DAMAGED)?);
        }
        bits <<= 6 * (4 - group.len());
        bytes.extend_from_slice(&bits.to_be_bytes()[1..group.len()]);
    }
    Ok(bytes)
}

fn base64_value(digit: u8) -> Option<u8> {
    Some(match digit {
        b'A'..=b'Z' => digit - b'A',
        b'a'..=b'z' => digit - b'a' + 26,
        b'0'..=b'9' => digit - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => return None,
    })
}

/// Checks that a relative path only goes down. An error says why it is refused.
pub(crate) fn relative_path(uri: &str) -> Result<PathBuf, &'static str> {
    if uri.is_empty() {
        return Err("it is empty");
    }
    // Checked on the raw text: an escaped colon is part of a name.
    if uri.split('/').next().is_some_and(|first| first.contains(':')) {
        return Err("it has a scheme or a drive, and only files beside the model are read");
    }
    let decoded = percent_decode(uri)?;
    if decoded.contains(['\\', '\0']) {
        return Err("it holds a backslash or a zero character");
    }
    let path = PathBuf::from(decoded);
    for component in path.components() {
        match component {
            Component::Normal(_) | Component::CurDir => {}
            Component::ParentDir => return Err("it leads up ('..')"),
            Component::RootDir | Component::Prefix(_) => return Err("it is absolute"),
        }
    }
    if path.file_name().is_none() || path == Path::new(".") {
        return Err("it names no file");
    }
    Ok(path)
}

fn percent_decode(uri: &str) -> Result<String, &'static str> {
    const DAMAGED: &str = "its percent-encoding is damaged";
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        if first != b'%' {
            bytes.push(first);
            rest = after;
            continue;
        }
        let [high, low, after @ ..] = after else {
            return Err(DAMAGED);
        };
        let digit = |c: u8| char::from(c).to_digit(16).ok_or(DAMAGED);
        bytes.push((digit(*high)? * 16 + digit(*low)?) as u8);
        rest = after;
    }
    String::from_utf8(bytes).map_err(|_| DAMAGED)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_decodes_with_and_without_padding() {
        for (text, expected) in [
            ("", &b""[..]),
            ("TQ==", b"M"),
            ("TQ", b"M"),
            ("TWE=", b"Ma"),
            ("TWFu", b"Man"),
            ("AP+/", &[0, 255, 191]),
        ] {
            assert_eq!(decode_data(&format!("x/y;base64,{text}")).unwrap(), expected, "{text}");
        }
        for bad in ["A", "TW!u", "TWFu=TWFu", "TWFuTW==="] {
            assert!(decode_data(&format!(";base64,{bad}")).is_err(), "{bad}");
        }
        assert!(decode_data("text/plain,abc").is_err());
        assert!(decode_data("no comma").is_err());
    }

    #[test]
    fn paths_only_go_down() {
        for (uri, expected) in [
            ("a.bin", "a.bin"),
            ("./sub/a%20b.png", "./sub/a b.png"),
            ("sub/%C3%A4.bin", "sub/ä.bin"),
            ("a%3Ab.bin", "a:b.bin"),
        ] {
            assert_eq!(relative_path(uri).unwrap(), Path::new(expected));
        }
        for bad in [
            "",
            ".",
            "./",
            "..",
            "../a",
            "a/../b",
            "%2e%2e/a",
            "/etc/passwd",
            "%2Fetc/passwd",
            "file:///etc/passwd",
            "http://host/a",
            "C:/a",
            "a\\b",
            "a%00b",
            "a%2",
            "a%zz",
            "%ff",
        ] {
            assert!(relative_path(bad).is_err(), "{bad}");
        }
    }
}
