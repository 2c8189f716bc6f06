//! Mapping of state names to the values of a tag.

use std::collections::BTreeMap;

/// Names of switch positions, as tags' addresses and servers have them, in lower case.
const POSITIONS: [(&str, &[&str]); 4] = [
    ("off", &["off", "open", "opened"]),
    ("on", &["on", "closed", "close"]),
    ("intermediate", &["intermediate", "intermediate-state", "in transit", "moving", "travelling"]),
    ("bad_state", &["bad_state", "bad-state", "bad state", "bad", "fault", "faulty", "invalid"]),
];

/// Returns the address's `states` where the names are the positions of a switch (Dbpos of IEC
/// 61850-7-3). Off and on each occur once, and no name is anything else.
pub(super) fn positions<K: ToString>(names: &[(K, String)]) -> Option<BTreeMap<String, String>> {
    let position = |name: &str| {
        let name = name.trim().to_lowercase();
        let found = POSITIONS.iter().find(|(_, words)| words.contains(&name.as_str()));
        found.map(|(position, _)| (*position).to_owned())
    };
    let states: Option<BTreeMap<_, _>> =
        names.iter().map(|(key, name)| Some((key.to_string(), position(name)?))).collect();
    let states = states?;
    let is_once = |wanted: &str| states.values().filter(|state| *state == wanted).count() == 1;
    (is_once("off") && is_once("on")).then_some(states)
}

/// `0 Manual, 1 Automatic`.
pub(super) fn listed<K: ToString>(names: &[(K, String)]) -> String {
    let named = names.iter().map(|(key, name)| format!("{} {name}", key.to_string()));
    named.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(names: &[&str], expected: Option<&[&str]>) {
        let names: Vec<_> = (0..).zip(names.iter().map(|name| (*name).to_owned())).collect();
        let names: Vec<(i64, String)> = names;
        let states = positions(&names).map(|states| states.into_values().collect::<Vec<_>>());
        assert_eq!(states, expected.map(|e| e.iter().map(|s| (*s).to_owned()).collect()));
    }

    #[test]
    fn only_whole_sets_of_positions_are_positions() {
        check(&["OPEN", "Closed "], Some(&["off", "on"]));
        let dbpos = ["intermediate-state", "off", "on", "bad-state"];
        check(&dbpos, Some(&["intermediate", "off", "on", "bad_state"]));
        check(&["Off", "On", "Tripped"], None);
        check(&["Open", "Off", "On"], None);
        check(&["On"], None);
        check(&[], None);
        assert_eq!(listed(&[(0, "Manual".to_owned()), (1, "Auto".to_owned())]), "0 Manual, 1 Auto");
    }
}
