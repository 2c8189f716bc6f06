//! Texts on alarms that other systems decide on.

use std::time::Instant;

use busbar_alarms::SourceAlarm;
use busbar_site::{ExternalSource, ExternalSources};
use busbar_types::QualityLevel;
use busbar_ui::{AlarmSourceStatus, age_text};

/// Returns the status of each source.
pub(super) fn statuses(sources: &ExternalSources) -> Vec<AlarmSourceStatus> {
    let now = Instant::now();
    let status = |source: &ExternalSource| AlarmSourceStatus {
        name: source.name().to_owned(),
        alarms: source.alarms().len(),
        left_out: source.left_out(),
        uncertainty: source
            .stale_reason(now)
            .map(|why| format!("{}: {why}", staleness_text(source, now))),
    };
    sources.all().iter().map(status).collect()
}

fn staleness_text(source: &ExternalSource, now: Instant) -> String {
    match source.silence(now) {
        Some(silence) => format!("stale {}", age_text(silence)),
        None => "not read yet".to_owned(),
    }
}

/// Returns the short reason why an alarm's state is uncertain.
pub(super) fn short_uncertainty(source: &ExternalSource, alarm: &SourceAlarm) -> Option<String> {
    if source.is_stale() {
        return Some(staleness_text(source, Instant::now()));
    }
    match alarm.quality {
        QualityLevel::Good => None,
        QualityLevel::Uncertain => Some("uncertain at its source".to_owned()),
        QualityLevel::Bad => Some("bad at its source".to_owned()),
    }
}

/// Returns the long reason why an alarm's state is uncertain.
pub(super) fn long_uncertainty(source: &ExternalSource, alarm: &SourceAlarm) -> Option<String> {
    let uncertainty = short_uncertainty(source, alarm)?;
    let why = source.stale_reason(Instant::now());
    Some(why.map_or_else(|| uncertainty.clone(), |why| format!("{uncertainty}: {why}")))
}
