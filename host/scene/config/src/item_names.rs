//! Names of items, the pointers to them and references to them: checks that several rules share.

use serde_json::{Map, Value};

use crate::report::Report;
use crate::{MAX_NAME_BYTES, join_pointer, suggestions};

/// Reports a name that is none of `known`.
pub(crate) fn check_reference(
    name: &Value,
    known: Option<&Map<String, Value>>,
    parent_pointer: &str,
    key: impl std::fmt::Display,
    what: &str,
    report: &mut Report<'_>,
) {
    let Some(name) = name.as_str() else { return };
    if known.is_some_and(|known| known.contains_key(name)) {
        return;
    }
    report.error_with(&join_pointer(parent_pointer, key), || {
        let names = known.into_iter().flat_map(|known| known.keys().map(String::as_str));
        let define = || format!("add a {what} of that name under /{what}s");
        let cause = format!("there is no {what} '{}'", suggestions::shown(name));
        (cause, suggestions::remedy(name, names, define))
    });
}

/// Checks a name beyond the schema's limit of 1 to [`MAX_NAME_BYTES`] *characters*; returns cause
/// and remedy.
pub(crate) fn name_fault(name: &str, what: &str) -> Option<(String, String)> {
    let characters = name.chars().count();
    if name.len() > MAX_NAME_BYTES && characters <= MAX_NAME_BYTES {
        let cause = format!("the {what} has {} bytes; at most {MAX_NAME_BYTES}", name.len());
        return Some((cause, "shorten it".to_owned()));
    }
    name.chars().any(char::is_control).then(|| {
        let cause = format!("the {what} '{}' has a control character", suggestions::shown(name));
        (cause, "write it with printable characters".to_owned())
    })
}

/// Checks a name that is a key, which the schema does not limit.
pub(crate) fn check_name_key(name: &str, pointer: &str, what: &str, report: &mut Report<'_>) {
    let fault = if name.is_empty() {
        Some((format!("the {what} has an empty name"), "give it a name".to_owned()))
    } else if name.len() > MAX_NAME_BYTES {
        let cause = format!("the {what} name has {} bytes; at most {MAX_NAME_BYTES}", name.len());
        Some((cause, "shorten it".to_owned()))
    } else {
        name_fault(name, &format!("{what} name"))
    };
    if let Some((cause, remedy)) = fault {
        report.key_error(pointer, cause, remedy);
    }
}

/// The members of the object `key` of the document.
pub(crate) fn named<'d>(
    document: &'d Value,
    key: &str,
) -> impl Iterator<Item = (&'d String, &'d Value)> {
    document[key].as_object().into_iter().flatten()
}

pub(crate) fn item_pointer(key: &str, name: &str) -> String {
    join_pointer(&join_pointer("", key), name)
}
