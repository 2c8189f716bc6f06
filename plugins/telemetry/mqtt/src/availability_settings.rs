//! Availability settings: the topics of sources, the topics that they cover, and their words.

use std::collections::BTreeSet;

use busbar_link::SettingsFaults;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::availability::{Availability, OFFLINE, ONLINE, plain};
use crate::names::{check_filter, check_pointer, check_topic};

/// Words of one state of an availability.
const MAX_STATE_WORDS: usize = 20;

/// Availability topic, often a last will, which reports whether the source of other topics is
/// online.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct RawAvailability {
    /// Topic of the availability messages.
    topic: String,
    /// Filter of the topics of that source.
    covers: String,
    /// JSON pointer of the state in the payload; without it the payload is the state.
    #[serde(default)]
    pointer: Option<String>,
    /// Words of a source that is there, whatever their case; without them `online`, `true`,
    /// `1`, `up`, `connected`, `available`, `alive`, `on`, `yes`, `birth`.
    #[serde(default)]
    #[schemars(length(min = 1, max = 20))]
    online: Option<Vec<String>>,
    /// Words of a source that is gone, whatever their case; without them `offline`, `false`,
    /// `0`, `down`, `disconnected`, `unavailable` and the like. With any other word the source
    /// counts as gone too, and the log names the word.
    #[serde(default)]
    #[schemars(length(min = 1, max = 20))]
    offline: Option<Vec<String>>,
}

/// Checks the entries; every fault goes into `faults`.
pub(crate) fn parse_availability(
    list: Vec<RawAvailability>,
    faults: &mut SettingsFaults,
) -> Vec<Availability> {
    for (index, entry) in list.iter().enumerate() {
        let place = format!("availability[{index}]");
        check_topic(&entry.topic)
            .unwrap_or_else(|fault| faults.add(format!("{place}.topic: {fault}")));
        check_filter(&entry.covers)
            .unwrap_or_else(|fault| faults.add(format!("{place}.covers: {fault}")));
        check_pointer(entry.pointer.as_deref())
            .unwrap_or_else(|fault| faults.add(format!("{place}.pointer: {fault}")));
        if list[..index].iter().any(|other| other.topic == entry.topic) {
            faults.add(format!("{place}.topic: '{}' is named twice", entry.topic));
        }
    }
    let mut parsed = Vec::with_capacity(list.len());
    for (index, entry) in list.into_iter().enumerate() {
        let RawAvailability { topic, covers, pointer, online, offline } = entry;
        let place = format!("availability[{index}]");
        let mut words = |name, state, given: &Option<Vec<String>>, usual: &[&str]| {
            let given = given.as_deref();
            if given.is_some_and(<[_]>::is_empty) {
                faults.add(format!("{place}.{name}: name a state in which the source is {state}"));
            }
            if given.is_some_and(|given| given.len() > MAX_STATE_WORDS) {
                faults.add(format!("{place}.{name}: at most {MAX_STATE_WORDS} are allowed"));
            }
            let given = given.map(|given| given.iter().map(|word| plain(word)).collect());
            given.unwrap_or_else(|| usual.iter().map(|word| plain(word)).collect())
        };
        let mut there: BTreeSet<String> = words("online", "there", &online, &ONLINE);
        let mut gone: BTreeSet<String> = words("offline", "gone", &offline, &OFFLINE);
        match (online.is_some(), offline.is_some()) {
            (true, true) => {
                let both: Vec<_> = there.intersection(&gone).cloned().collect();
                if !both.is_empty() {
                    let both = both.join("', '");
                    faults.add(format!("{place}: '{both}' is in online and in offline"));
                }
            }
            // Words of the settings come before the usual ones.
            (false, true) => there.retain(|word| !gone.contains(word)),
            _ => gone.retain(|word| !there.contains(word)),
        }
        parsed.push(Availability { topic, covers, pointer, online: there, offline: gone });
    }
    parsed
}
