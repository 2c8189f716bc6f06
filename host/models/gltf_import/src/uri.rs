//! URIs as text: data URIs (RFC 2397) and relative paths (RFC 3986).

use std::path::{Component, Path, PathBuf};
use std::sync::LazyLock;

use data_encoding::{BASE64_NOPAD, Encoding};
use percent_encoding::percent_decode_str;

/// Base64 as exporters write it: bits beyond the last byte may be set.
static UNPADDED: LazyLock<Encoding> = LazyLock::new(|| {
    let mut specification = BASE64_NOPAD.specification();
    specification.check_trailing_bits = false;
    specification.encoding().unwrap_or(BASE64_NOPAD)
});

/// Decodes the part after `data:`. Only base64, which glTF uses.
pub(crate) fn decode_data(data: &str) -> Result<Vec<u8>, &'static str> {
    let (kind, payload) = data.split_once(',').ok_or("a data URI without a comma")?;
    if !kind.ends_with(";base64") {
        return Err("a data URI that is not base64");
    }
    decode_base64(payload.as_bytes())
}

/// Decodes base64 with and without padding; bits beyond the last byte are ignored.
fn decode_base64(text: &[u8]) -> Result<Vec<u8>, &'static str> {
    let padding = text.iter().rev().take(2).take_while(|&&c| c == b'=').count();
    UNPADDED.decode(&text[..text.len() - padding]).map_err(|_| "its base64 is damaged")
}

/// Returns the part of a data URI after `data:`; schemes are written in any case.
pub(crate) fn data_of(uri: &str) -> Option<&str> {
    let (scheme, data) = uri.split_once(':')?;
    scheme.eq_ignore_ascii_case("data").then_some(data)
}

/// Returns the paths that a relative URI may mean, the likeliest first: with its escapes decoded,
/// then as it stands. They only go down. An error says why the URI is refused.
pub(crate) fn relative_paths(uri: &str) -> Result<Vec<PathBuf>, &'static str> {
    // Exporters on Windows write its separators.
    let slashed = uri.replace('\\', "/");
    if has_scheme(&slashed) {
        return Err("it has a scheme or a drive, and only files beside the model are read");
    }
    let literal = relative_path(&slashed);
    let Ok(decoded) = percent_decode_str(&slashed).decode_utf8() else {
        return Ok(vec![literal?]);
    };
    let decoded = relative_path(&decoded)?;
    Ok(match literal {
        Ok(literal) if literal != decoded => vec![decoded, literal],
        _ => vec![decoded],
    })
}

/// Reports whether a URI begins with a scheme or a drive. Other colons are parts of names.
fn has_scheme(uri: &str) -> bool {
    let Some((scheme, rest)) = uri.split_once(':') else { return false };
    let is_scheme = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
        && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
    is_scheme && rest.starts_with('/')
}

/// Checks that a path only goes down. An error says why it is refused.
fn relative_path(text: &str) -> Result<PathBuf, &'static str> {
    if text.is_empty() {
        return Err("it is empty");
    }
    if text.contains(['\\', '\0']) {
        return Err("it holds an escaped backslash or a zero character");
    }
    let path = PathBuf::from(text);
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
            ("a%2", "a%2"),
            ("100%.png", "100%.png"),
            ("%ff.png", "%ff.png"),
            ("sub\\a.png", "sub/a.png"),
            ("t:1.png", "t:1.png"),
            ("a:b/c.png", "a:b/c.png"),
        ] {
            assert_eq!(relative_paths(uri).unwrap()[0], Path::new(expected));
        }
        let both = relative_paths("x%20y.png").unwrap();
        assert_eq!(both, [Path::new("x y.png"), Path::new("x%20y.png")]);
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
            "C:\\a",
            "..\\a",
            "\\\\server\\a",
            "a%5Cb",
            "a%00b",
        ] {
            assert!(relative_paths(bad).is_err(), "{bad}");
        }
    }
}
