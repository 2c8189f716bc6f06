//! Text to a JSON value, strictly, with the place of each value.

use jsonc_parser::errors::{ParseError, ParseErrorKind};
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use serde_json::Value;

use crate::json_index;
use crate::{Diagnostic, MAX_CONFIG_BYTES, MAX_NESTING_DEPTH, Positions, Severity};

/// Parsed document of a JSON text.
pub(crate) struct Document {
    /// Value of the document; of members with one name, the last.
    pub(crate) value: Value,
    /// Positions of its parts.
    pub(crate) positions: Positions,
    /// Keys given twice; at most [`crate::MAX_DIAGNOSTICS`].
    pub(crate) duplicate_keys: Vec<Diagnostic>,
    /// Number of further duplicate keys.
    pub(crate) more_duplicate_keys: usize,
}

/// Reads a text as strict JSON (RFC 8259): no comments, no trailing commas.
pub(crate) fn read(text: &str) -> Result<Document, Vec<Diagnostic>> {
    refuse_unreadable(text)?;
    let value = serde_json::from_str(text).map_err(|error| vec![explain(text, &error)])?;
    let index = json_index::index(text);
    let positions = Positions::new(text, index.places);
    if let Some((offset, pointer)) = index.too_deep {
        let cause = format!("arrays and objects are nested more than {MAX_NESTING_DEPTH} deep");
        let remedy = "nest less deeply".to_owned();
        return Err(vec![positions.at_offset(Severity::Error, offset, pointer, cause, remedy)]);
    }
    let duplicate_keys = index.duplicates.into_iter().map(|d| d.diagnostic(&positions)).collect();
    let more_duplicate_keys = index.more_duplicates;
    Ok(Document { value, positions, duplicate_keys, more_duplicate_keys })
}

/// Returns the diagnostic of a text that is no JSON. The parser of JSON with comments gives the
/// best explanation. A few faults it accepts, such as raw control characters in strings; for
/// these the strict parser's error is used.
fn explain(text: &str, error: &serde_json::Error) -> Diagnostic {
    match parse_to_ast(text, &CollectOptions::default(), &strict()) {
        Err(error) => relaxed_diagnostic(text, &error),
        Ok(_) => strict_diagnostic(text, error),
    }
}

fn strict_diagnostic(text: &str, error: &serde_json::Error) -> Diagnostic {
    let positions = Positions::new(text, Vec::new());
    let mut offset = positions.offset(error.line(), error.column());
    let message = error.to_string();
    let cause = message.split(" at line ").next().unwrap_or_default();
    let remedy = match cause {
        "number out of range" => {
            let before = &text[..offset as usize];
            offset = before.trim_end_matches(|c| "+-.eE0123456789".contains(c)).len() as u32;
            "write a smaller number"
        }
        "recursion limit exceeded" => "nest less deeply",
        _ => "correct the text here",
    };
    let cause = format!("not valid JSON: {cause}");
    positions.at_offset(Severity::Error, offset, String::new(), cause, remedy.to_owned())
}

fn refuse_unreadable(text: &str) -> Result<(), Vec<Diagnostic>> {
    if text.len() > MAX_CONFIG_BYTES {
        return Err(vec![whole_text(
            &format!(
                "the configuration has {} bytes; at most {MAX_CONFIG_BYTES} are read",
                text.len()
            ),
            "shorten it, or split the plant over several viewers",
        )]);
    }
    if text.trim().is_empty() {
        return Err(vec![whole_text(
            "the configuration is empty",
            "write an object with at least \"version\" and \"scene\"",
        )]);
    }
    if text.starts_with('\u{feff}') {
        return Err(vec![whole_text(
            "the configuration starts with a byte order mark",
            "save it as UTF-8 without byte order mark",
        )]);
    }
    Ok(())
}

fn strict() -> ParseOptions {
    ParseOptions {
        allow_comments: false,
        allow_loose_object_property_names: false,
        allow_trailing_commas: false,
        allow_missing_commas: false,
        allow_single_quoted_strings: false,
        allow_hexadecimal_numbers: false,
        allow_unary_plus_numbers: false,
        allow_bare_decimal_point_numbers: false,
        allow_non_finite_numbers: false,
        allow_extended_string_escapes: false,
    }
}

fn whole_text(cause: &str, remedy: &str) -> Diagnostic {
    Diagnostic {
        severity: Severity::Error,
        line: 1,
        column: 1,
        pointer: String::new(),
        cause: cause.to_owned(),
        remedy: remedy.to_owned(),
    }
}

fn relaxed_diagnostic(text: &str, error: &ParseError) -> Diagnostic {
    let remedy = match error.kind() {
        ParseErrorKind::CommentsNotAllowed => "remove the comment: the text is plain JSON",
        ParseErrorKind::TrailingCommasNotAllowed => "remove the comma",
        ParseErrorKind::ExpectedComma => "put a comma between the two values",
        ParseErrorKind::ExpectedColonAfterObjectKey => "put a colon between key and value",
        ParseErrorKind::ExpectedStringObjectProperty
        | ParseErrorKind::SingleQuotedStringsNotAllowed => "put it in double quotes",
        ParseErrorKind::MultipleRootJsonValues => "remove what follows the first value",
        ParseErrorKind::NestingDepthExceeded => "nest less deeply",
        ParseErrorKind::UnterminatedObject => "close this object with '}'",
        ParseErrorKind::UnterminatedArray => "close this array with ']'",
        _ => "correct the text here",
    };
    let cause = format!("not valid JSON: {}", lower_first(&error.kind().to_string()));
    let positions = Positions::new(text, Vec::new());
    let offset = error.range().start as u32;
    positions.at_offset(Severity::Error, offset, String::new(), cause, remedy.to_owned())
}

fn lower_first(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_lowercase().chain(letters).collect())
}
