//! Reports of changes to the host program after each frame.

use std::collections::HashMap;

use busbar_alarms::{AlarmFlags, AlarmHandle};
use busbar_protocol::message::{
    AlarmSnapshot, CameraPose, EquipmentVerdict, TagSnapshot, VerdictSnapshot, ViewerMessage,
};
use busbar_tags::SourceTime;
use busbar_types::{Origin, Quality, Verdict};

use busbar_viewer::{ChangedAlarm, Viewer};

use crate::wire_types::{alarm_request, camera_pose_message};

/// Largest number of quality changes reported a frame; further ones follow in later frames.
const MAX_QUALITIES_A_FRAME: usize = 4096;
/// Largest number of verdict changes reported a frame; further ones follow in later frames.
const MAX_VERDICTS_A_FRAME: usize = 1024;

/// State as it was last reported.
#[derive(Default)]
pub(super) struct ChangeReporter {
    is_ready: bool,
    hovered: Option<String>,
    pose: Option<CameraPose>,
    alarms: HashMap<AlarmHandle, (AlarmFlags, Origin)>,
    /// Quality and origin of each tag, by handle.
    qualities: Vec<Option<(Quality, Origin)>>,
    /// Tag index at which the search for changed qualities continues.
    next_tag: usize,
    /// Verdicts by overlay and equipment, with their reasons.
    verdicts: HashMap<String, Vec<Option<ReportedVerdict>>>,
    /// Position over all overlays at which the search for changed verdicts continues.
    next_verdict: usize,
    plugins: HashMap<String, String>,
}

/// Verdict as reported: an assumption, the origins, and the reason.
type ReportedVerdict = (EquipmentVerdict, bool, Origin, String);

impl ChangeReporter {
    /// Returns the events for everything that has changed since the last report.
    pub(super) fn collect_changes(&mut self, viewer: &mut Viewer) -> Vec<ViewerMessage> {
        let mut events = Vec::new();
        if !std::mem::replace(&mut self.is_ready, true) {
            events.push(ViewerMessage::Ready { device: viewer.device_name().to_owned() });
        }
        events.extend(viewer.take_host_picks().into_iter().map(ViewerMessage::Picked));
        let hovered = viewer.hovered();
        if hovered != self.hovered {
            self.hovered.clone_from(&hovered);
            events.push(ViewerMessage::Hovered(hovered));
        }
        let pose = camera_pose_message(&viewer.camera_pose());
        if self.pose.replace(pose) != Some(pose) {
            events.push(ViewerMessage::CameraMoved(pose));
        }
        self.collect_alarms(viewer, &mut events);
        self.collect_tags(viewer, &mut events);
        self.collect_verdicts(viewer, &mut events);
        for (plugin, state) in viewer.plugin_states() {
            if self.plugins.get(&plugin) != Some(&state) {
                self.plugins.insert(plugin.clone(), state.clone());
                events.push(ViewerMessage::Plugin { plugin, state });
            }
        }
        events
    }

    fn collect_alarms(&mut self, viewer: &mut Viewer, events: &mut Vec<ViewerMessage>) {
        let changed = viewer.alarms_changed_since(&mut self.alarms).into_iter();
        events.extend(changed.map(|changed| {
            let ChangedAlarm { alarm, state, standing, since, origin, reason } = changed;
            ViewerMessage::Alarm(AlarmSnapshot {
                alarm,
                state,
                since: since.0,
                standing: serde_json::to_string(&standing).unwrap_or_default(),
                origin,
                reason,
            })
        }));
        for (alarm, action) in viewer.take_alarm_requests() {
            events.extend(
                alarm_request(action).map(|action| ViewerMessage::AlarmRequested { alarm, action }),
            );
        }
    }

    /// Collects verdicts that changed, or whose reasons did.
    fn collect_verdicts(&mut self, viewer: &Viewer, events: &mut Vec<ViewerMessage>) {
        let mut room = MAX_VERDICTS_A_FRAME;
        let mut position = 0;
        for overlay in viewer.overlay_verdicts() {
            let known = self.verdicts.entry(overlay.name.to_owned()).or_default();
            if known.len() != overlay.equipment.len() {
                *known = vec![None; overlay.equipment.len()];
            }
            let skipped = self.next_verdict.saturating_sub(position).min(known.len());
            let start = position;
            position += known.len();
            let all = overlay.equipment.iter().zip(known).enumerate();
            for (index, (id, known)) in all.skip(skipped) {
                if room == 0 {
                    self.next_verdict = start + index;
                    return;
                }
                let shown = overlay.verdict(index);
                let verdict = match (shown.verdict, shown.was_abnormal) {
                    (Verdict::Normal, _) => EquipmentVerdict::Normal,
                    (Verdict::Abnormal, _) => EquipmentVerdict::Abnormal,
                    (Verdict::Unknown, false) => EquipmentVerdict::Unknown,
                    (Verdict::Unknown, true) => EquipmentVerdict::UnknownAfterAbnormal,
                };
                let (is_assumed, origin, reason) = (shown.is_assumed, shown.origin, shown.reason);
                let is_told = known.as_ref().is_some_and(|known| {
                    (known.0, known.1, known.2, known.3.as_str())
                        == (verdict, is_assumed, origin, reason.as_ref())
                });
                if is_told {
                    continue;
                }
                room -= 1;
                *known = Some((verdict, is_assumed, origin, reason.clone().into_owned()));
                events.push(ViewerMessage::Verdict(VerdictSnapshot {
                    equipment: id.clone(),
                    overlay: overlay.name.to_owned(),
                    verdict,
                    is_assumed,
                    origin,
                    reason: reason.into_owned(),
                }));
            }
        }
        self.next_verdict = 0;
    }

    /// Collects changed qualities and origins of tags, staleness included.
    fn collect_tags(&mut self, viewer: &Viewer, events: &mut Vec<ViewerMessage>) {
        let snapshot = viewer.tags();
        let states = snapshot.states();
        self.qualities.resize(states.len(), None);
        let known = &mut self.qualities;
        let mut room = MAX_QUALITIES_A_FRAME;
        for (index, state) in states.enumerate().skip(self.next_tag) {
            if known[index] == Some((state.quality, state.origin)) {
                continue;
            }
            if room == 0 {
                self.next_tag = index;
                return;
            }
            room -= 1;
            known[index] = Some((state.quality, state.origin));
            let id = viewer.tag_id(busbar_tags::TagHandle(index as u32)).unwrap_or_default();
            events.push(ViewerMessage::Quality(TagSnapshot {
                tag: id.to_owned(),
                origin: state.origin,
                quality: state.quality.level(),
                reason: state.quality.reason().map_or_else(String::new, |r| r.to_string()),
            }));
        }
        self.next_tag = 0;
    }
}

/// Parses the standings that a previous viewer reported; unreadable ones are skipped.
pub(super) fn standings_of(alarms: &[AlarmSnapshot]) -> Vec<(String, AlarmFlags, SourceTime)> {
    let standing = |report: &AlarmSnapshot| {
        let standing = serde_json::from_str(&report.standing).ok()?;
        Some((report.alarm.clone(), standing, SourceTime(report.since)))
    };
    alarms.iter().filter_map(standing).collect()
}
