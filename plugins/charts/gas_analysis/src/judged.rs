//! A sample with what it comes to.

use std::sync::Arc;

use dga::Sample;
use dga::c57_104::{self, Status};

use crate::history::{Page, Trend};
use crate::settings::Settings;
use crate::source::EXTRAS;
use crate::verdict::{self, Judgement};

/// A sample with what it comes to.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    /// Time of sampling, nanoseconds since 1970-01-01 UTC.
    pub(crate) unix_nanos: i64,
    pub(crate) sample: Sample,
    /// Quantities in the order of [`EXTRAS`]; NaN where the sample has none.
    pub(crate) extras: [f32; EXTRAS.len()],
    pub(crate) status: Option<Status>,
    /// Index of the legend's entry.
    pub(crate) state: u32,
    /// Reports whether a monitor measured it: hours before are no history by C57.104.
    pub(crate) is_online: bool,
    /// Reason why the sample is not judged.
    pub(crate) doubt: Option<Arc<str>>,
}

/// Judgement, trend and status of a sample.
pub(crate) struct Judging {
    pub(crate) judgement: Judgement,
    pub(crate) trend: Trend,
}

/// Judges a sample of a laboratory, by those before it.
pub(crate) fn of_laboratory(
    unix_nanos: i64,
    (sample, extras): (Sample, [f32; EXTRAS.len()]),
    page: &mut Page,
    settings: &Settings,
) -> Judged {
    let trend = page.add(unix_nanos, &sample);
    let judgement = verdict::judge(&sample, settings);
    let status = c57_104::status_with(&sample, settings.age.into(), &trend.history);
    let state = verdict::state(status, &judgement);
    Judged { unix_nanos, sample, extras, status, state, is_online: false, doubt: None }
}

/// Judges a sample of a monitor, by itself alone, at a status that is certain.
pub(crate) fn of_monitor(
    unix_nanos: i64,
    (sample, extras): (Sample, [f32; EXTRAS.len()]),
    status: Status,
    settings: &Settings,
) -> (Judged, Judgement) {
    let judgement = verdict::judge(&sample, settings);
    let status = Some(status);
    let state = verdict::state(status, &judgement);
    let judged = Judged { unix_nanos, sample, extras, status, state, is_online: true, doubt: None };
    (judged, judgement)
}

impl Judged {
    /// Judges the sample again, by those before it, the oldest first.
    pub(crate) fn again(&self, before: &[&Judged], settings: &Settings) -> Judging {
        let mut page = Page::default();
        let own = before.iter().filter(|one| !one.is_online && !self.is_online);
        for one in own {
            page.add(one.unix_nanos, &one.sample);
        }
        let trend = page.add(self.unix_nanos, &self.sample);
        Judging { judgement: verdict::judge(&self.sample, settings), trend }
    }
}
