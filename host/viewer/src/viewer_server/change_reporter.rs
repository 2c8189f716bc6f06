//! What a frame changed that a host program hears of.

use std::collections::HashMap;

use busbar_alarms::{AlarmFlags, AlarmHandle, State};
use busbar_plugin_host::Verdict;
use busbar_protocol::message::{
    AlarmSnapshot, CameraPose, EquipmentVerdict, TagOrigin, TagQuality, TagSnapshot,
    VerdictSnapshot, ViewerMessage,
};
use busbar_tags::{Origin, Quality, SourceTime};

use crate::Viewer;
use crate::alarms::action_to;

/// Changes of quality told a frame; those beyond come with the frames after.
const MAX_QUALITIES_A_FRAME: usize = 4096;
/// Changes of verdicts told a frame; those beyond come with the frames after.
const MAX_VERDICTS_A_FRAME: usize = 1024;

/// What was told last.
#[derive(Default)]
pub(super) struct ChangeReporter {
    is_ready: bool,
    hovered: Option<String>,
    pose: Option<CameraPose>,
    alarms: HashMap<AlarmHandle, AlarmFlags>,
    /// Of each tag, by handle.
    qualities: Vec<Option<(Quality, Origin)>>,
    /// Where the search for changed qualities goes on.
    next_tag: usize,
    /// Verdicts by overlay and equipment, with their reasons.
    verdicts: HashMap<String, Vec<Option<ReportedVerdict>>>,
    /// Position, counted over all overlays, where the search for changed verdicts goes on.
    next_verdict: usize,
    plugins: HashMap<String, String>,
}

/// Verdict as it was told, and its reason.
type ReportedVerdict = (EquipmentVerdict, bool, String);

impl ChangeReporter {
    /// What is otherwise than when it was told.
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
        let pose = viewer.pose();
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
        let Some(alarms) = viewer.alarm_service() else { return };
        let changed = alarms.changed_since(&mut self.alarms);
        events.extend(changed.into_iter().map(|(alarm, state, standing, since)| {
            ViewerMessage::Alarm(AlarmSnapshot {
                alarm,
                state: state_number(state),
                since: since.0,
                standing: serde_json::to_string(&standing).unwrap_or_default(),
            })
        }));
        for (alarm, action) in alarms.take_host_requests() {
            events.extend(
                action_to(action).map(|action| ViewerMessage::AlarmRequested { alarm, action }),
            );
        }
    }

    /// Tells verdicts that changed, or whose reasons did.
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
                let (is_assumed, reason) = (shown.is_assumed, shown.reason);
                let is_told = known.as_ref().is_some_and(|events| {
                    (events.0, events.1, events.2.as_str())
                        == (verdict, is_assumed, reason.as_ref())
                });
                if is_told {
                    continue;
                }
                room -= 1;
                *known = Some((verdict, is_assumed, reason.clone().into_owned()));
                events.push(ViewerMessage::Verdict(VerdictSnapshot {
                    equipment: id.clone(),
                    overlay: overlay.name.to_owned(),
                    verdict,
                    is_assumed,
                    reason: reason.into_owned(),
                }));
            }
        }
        self.next_verdict = 0;
    }

    /// What each tag is worth, freshness included.
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
                origins: origins(state.origin),
                quality: match state.quality {
                    Quality::Good => TagQuality::Good,
                    Quality::Uncertain(_) => TagQuality::Uncertain,
                    Quality::Bad(_) => TagQuality::Bad,
                },
                reason: state.quality.reason().map_or_else(String::new, |r| r.to_string()),
            }));
        }
        self.next_tag = 0;
    }
}

/// Lists the origins that are set.
fn origins(origin: Origin) -> Vec<TagOrigin> {
    let all = [
        (Origin::SUBSTITUTED, TagOrigin::Substituted),
        (Origin::TEST, TagOrigin::Test),
        (Origin::SIMULATED, TagOrigin::Simulated),
        (Origin::RECORDED, TagOrigin::Recorded),
        (Origin::HISTORICAL, TagOrigin::Historical),
    ];
    all.into_iter().filter_map(|(bit, events)| origin.contains(bit).then_some(events)).collect()
}

/// By its letter: 0 for A.
fn state_number(state: State) -> u8 {
    State::ALL.iter().position(|other| *other == state).unwrap_or(0) as u8
}

/// As a viewer before this one told them; what cannot be read is passed over.
pub(super) fn standings_of(alarms: &[AlarmSnapshot]) -> Vec<(String, AlarmFlags, SourceTime)> {
    let standing = |events: &AlarmSnapshot| {
        let standing = serde_json::from_str(&events.standing).ok()?;
        Some((events.alarm.clone(), standing, SourceTime(events.since)))
    };
    alarms.iter().filter_map(standing).collect()
}
