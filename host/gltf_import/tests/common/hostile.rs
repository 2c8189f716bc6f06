//! Hostile files: bytes, and what the error must say.

mod data;
mod floods;
mod structure;

use serde_json::Value;

use super::Builder;

pub struct Case {
    pub name: &'static str,
    pub bytes: Vec<u8>,
    /// Where and what: all of these are in the message.
    pub expected: &'static [&'static str],
}

/// Every file here is refused.
pub fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    data::numbers(&mut cases);
    data::values(&mut cases);
    structure::structure(&mut cases);
    structure::text(&mut cases);
    structure::containers(&mut cases);
    floods::images(&mut cases);
    floods::floods(&mut cases);
    cases
}

type Cases = Vec<Case>;

fn add(cases: &mut Cases, name: &'static str, bytes: Vec<u8>, expected: &'static [&'static str]) {
    cases.push(Case { name, bytes, expected });
}

/// A square with one value changed, after its data are embedded.
fn changed(
    cases: &mut Cases,
    name: &'static str,
    change: impl FnOnce(&mut Value),
    expected: &'static [&'static str],
) {
    let mut document = Builder::square().document();
    change(&mut document);
    add(cases, name, serde_json::to_vec(&document).unwrap(), expected);
}
