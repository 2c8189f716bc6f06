//! JSON pointers (RFC 6901).

use std::borrow::Cow;

/// The pointer of the child `token` of the value at `pointer`.
///
/// `token` is a key or an index as it is; this escapes it.
pub fn join_pointer(pointer: &str, token: impl std::fmt::Display) -> String {
    let mut joined = pointer.to_owned();
    push_token(&mut joined, token);
    joined
}

/// Appends a key or an index, as it is, to a pointer.
pub(crate) fn push_token(pointer: &mut String, token: impl std::fmt::Display) {
    let token = token.to_string();
    pointer.reserve(1 + token.len());
    pointer.push('/');
    for letter in token.chars() {
        match letter {
            '~' => pointer.push_str("~0"),
            '/' => pointer.push_str("~1"),
            other => pointer.push(other),
        }
    }
}

/// The keys and indices of a pointer, unescaped.
pub(crate) fn tokens(pointer: &str) -> impl Iterator<Item = Cow<'_, str>> {
    pointer.split('/').skip(1).map(|token| {
        if token.contains('~') {
            Cow::Owned(token.replace("~1", "/").replace("~0", "~"))
        } else {
            Cow::Borrowed(token)
        }
    })
}

/// The last key or index of a pointer, unescaped; empty for the root.
pub(crate) fn last_token(pointer: &str) -> Cow<'_, str> {
    tokens(pointer).last().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_survive_the_way_into_a_pointer_and_back() {
        let pointer = join_pointer(&join_pointer("", "a/b"), "~1~");
        assert_eq!(pointer, "/a~1b/~01~0");
        assert_eq!(tokens(&pointer).collect::<Vec<_>>(), ["a/b", "~1~"]);
        assert_eq!(last_token(&pointer), "~1~");
        assert_eq!(tokens("").count(), 0);
    }
}
