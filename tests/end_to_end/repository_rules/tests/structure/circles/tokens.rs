//! Lexer for Rust sources: words and punctuation without comments, literals and test items.

use std::iter::Peekable;
use std::str::Chars;

/// Keywords that begin an item which ends with a brace or a semicolon.
const ITEM_KEYWORDS: [&str; 13] = [
    "async",
    "const",
    "enum",
    "extern",
    "fn",
    "impl",
    "macro_rules",
    "mod",
    "pub",
    "static",
    "struct",
    "trait",
    "type",
];

/// Tokens of a source: words, `::`, and single characters of punctuation.
pub(super) fn tokens(source: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut chars = source.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '/' if chars.peek() == Some(&'/') => skip_line(&mut chars),
            '/' if chars.peek() == Some(&'*') => skip_block_comment(&mut chars),
            '"' => skip_string(&mut chars),
            '\'' => skip_character_or_lifetime(&mut chars),
            ':' if chars.next_if_eq(&':').is_some() => found.push("::".to_owned()),
            c if is_of_word(c) => {
                let mut word = String::from(c);
                while let Some(c) = chars.next_if(|c| is_of_word(*c)) {
                    word.push(c);
                }
                let is_raw = matches!(word.as_str(), "r" | "br" | "cr");
                if !(is_raw && skip_raw_string(&mut chars)) {
                    found.push(word);
                }
            }
            c if c.is_whitespace() => {}
            c => found.push(c.to_string()),
        }
    }
    without_test_items(&found)
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn skip_line(chars: &mut Peekable<Chars>) {
    while chars.next_if(|c| *c != '\n').is_some() {}
}

/// Skips a comment whose `/` is read, with those inside it.
fn skip_block_comment(chars: &mut Peekable<Chars>) {
    let mut depth = 0;
    let mut before = '/';
    for c in chars.by_ref() {
        match (before, c) {
            ('/', '*') => depth += 1,
            ('*', '/') => depth -= 1,
            _ => {
                before = c;
                continue;
            }
        }
        before = ' ';
        if depth == 0 {
            return;
        }
    }
}

/// Skips the rest of a string literal whose quote is read.
fn skip_string(chars: &mut Peekable<Chars>) {
    while let Some(c) = chars.next() {
        match c {
            '\\' => drop(chars.next()),
            '"' => return,
            _ => {}
        }
    }
}

/// Skips a raw string after its `r`; reports whether there was one.
fn skip_raw_string(chars: &mut Peekable<Chars>) -> bool {
    let mut ahead = chars.clone();
    let mut hashes = 0;
    while ahead.next_if_eq(&'#').is_some() {
        hashes += 1;
    }
    if ahead.next() != Some('"') {
        return false;
    }
    *chars = ahead;
    while let Some(c) = chars.next() {
        if c != '"' {
            continue;
        }
        let mut closing = 0;
        while closing < hashes && chars.next_if_eq(&'#').is_some() {
            closing += 1;
        }
        if closing == hashes {
            break;
        }
    }
    true
}

/// Skips a character literal, or the apostrophe of a lifetime alone.
fn skip_character_or_lifetime(chars: &mut Peekable<Chars>) {
    let mut ahead = chars.clone();
    match ahead.next() {
        Some('\\') => {
            // The character after the backslash may be an apostrophe.
            ahead.next();
            while ahead.next_if(|c| *c != '\'').is_some() {}
            ahead.next();
            *chars = ahead;
        }
        Some(_) if ahead.next() == Some('\'') => *chars = ahead,
        _ => {}
    }
}

/// Cuts out each item, field or statement that follows `#[cfg(test)]`.
fn without_test_items(tokens: &[String]) -> Vec<String> {
    const ATTRIBUTE: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    let mut kept = Vec::new();
    let mut rest = tokens;
    while let [first, after @ ..] = rest {
        if rest.len() >= ATTRIBUTE.len() && rest.iter().zip(ATTRIBUTE).all(|(a, b)| a == b) {
            rest = after_item(&rest[ATTRIBUTE.len()..]);
        } else {
            kept.push(first.clone());
            rest = after;
        }
    }
    kept
}

/// Tokens after the item that begins here, its other attributes included.
fn after_item(tokens: &[String]) -> &[String] {
    let mut depth = 0_usize;
    let mut first = None;
    for (index, token) in tokens.iter().enumerate() {
        let token = token.as_str();
        let is_word = token.starts_with(is_of_word);
        if depth == 0 && is_word && first.is_none() {
            first = Some(token);
        }
        let is_import = first == Some("use");
        let is_item = is_import || first.is_some_and(|word| ITEM_KEYWORDS.contains(&word));
        match token {
            "(" | "[" | "{" => depth += 1,
            ")" | "]" | "}" => {
                // The end of the block that the last field or statement is in.
                let Some(less) = depth.checked_sub(1) else { return &tokens[index..] };
                depth = less;
                if depth == 0 && token == "}" && !is_import {
                    return &tokens[index + 1..];
                }
            }
            ";" if depth == 0 => return &tokens[index + 1..],
            "," if depth == 0 && !is_item => return &tokens[index + 1..],
            _ => {}
        }
    }
    &[]
}

#[test]
fn comments_literals_and_tests_are_no_tokens() {
    let source = "use a::b; // crate::x\n/* crate::y /* */ crate::z */ \"crate::s \\\" t\" 'c' '\\'' &'l \
                  r#\"crate::\"r\"# b\"w\"\n#[cfg(test)]\nmod tests { use q; }\n#[cfg(test)]\n#[path = \"p\"]\n\
                  mod u;\n#[cfg(test)] use v::{w}; struct S { #[cfg(test)] x: T, y: U }";
    let found = tokens(source).join(" ");
    assert_eq!(found, "use a :: b ; & l b struct S { y : U }");
}
