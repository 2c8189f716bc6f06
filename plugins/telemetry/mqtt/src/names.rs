//! Validation of topics, topic filters, JSON pointers and ids.

use rumqttc_v4::mqttbytes::{has_wildcards, valid_filter};

/// Longest topic, filter, name or id (MQTT 3.1.1, 1.5.3), bytes.
pub(crate) const MAX_TEXT: usize = 65_535;

/// Checks that a text is a topic filter (MQTT 3.1.1, 4.7).
pub(crate) fn check_filter(filter: &str) -> Result<(), String> {
    if filter.len() > MAX_TEXT || !valid_filter(filter) || filter.contains('\0') {
        return Err(format!(
            "'{filter}' is no topic filter: + stands for one level, # for the rest"
        ));
    }
    Ok(())
}

/// Checks that a text is a topic name without wildcards (MQTT 3.1.1, 4.7).
pub(crate) fn check_topic(topic: &str) -> Result<(), String> {
    if topic.is_empty() || topic.len() > MAX_TEXT || topic.contains('\0') {
        return Err(format!("a topic has 1 to {MAX_TEXT} bytes, none of them 0"));
    }
    if has_wildcards(topic) {
        return Err(format!(
            "'{topic}' has a wildcard: name one topic, and put the filter into the setting \
             subscriptions"
        ));
    }
    Ok(())
}

/// Checks that a text is a JSON pointer (RFC 6901).
pub(crate) fn check_pointer(pointer: Option<&str>) -> Result<(), String> {
    match pointer {
        Some(text) if !text.is_empty() && !text.starts_with('/') => {
            Err(format!("'{text}' is no JSON pointer: it begins with /, as in /value"))
        }
        _ => Ok(()),
    }
}

/// Checks that a text is one topic level, as ids of Sparkplug are (Sparkplug 3.0, 5.7).
pub(crate) fn check_name(place: &str, name: &str) -> Result<(), String> {
    const MAX_NAME: usize = 200;
    if name.is_empty() || name.len() > MAX_NAME || name.contains(['/', '+', '#', '\0']) {
        return Err(format!("{place}: give 1 to {MAX_NAME} bytes without /, + and #"));
    }
    Ok(())
}
