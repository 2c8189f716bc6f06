//! Desired state of the viewer, replayed to each new viewer process.

use std::collections::BTreeMap;

use busbar_protocol::message::{
    AlarmSnapshot, CameraPose, Command, MAX_TAGS_A_MESSAGE, PROTOCOL_VERSION, StartParameters,
    TagUpdate, Target,
};
use busbar_types::AlarmState;

/// Tags whose last value is kept for the next viewer.
pub(crate) const MAX_TAGS: usize = 100_000;
/// Alarms and layers whose last state is kept for the next viewer.
pub(crate) const MAX_NAMES: usize = 1 << 17;

/// Desired state of a view, which outlives each viewer.
#[derive(Clone, Debug)]
pub(crate) struct DesiredState {
    /// Path of the configuration that was shown last, or of the first.
    pub(crate) config: String,
    pub(crate) target: Target,
    pub(crate) size: [u32; 2],
    pub(crate) panels: bool,
    pub(crate) operator: String,
    pub(crate) is_visible: bool,
    /// Last camera command of the program, until the viewer reports its pose.
    camera: Option<Command>,
    theta: Option<f64>,
    layers: BTreeMap<String, bool>,
    time: Option<i64>,
    tags: BTreeMap<String, TagUpdate>,
    mirrored: BTreeMap<String, AlarmState>,
    alarms: BTreeMap<String, AlarmSnapshot>,
}

impl DesiredState {
    pub(crate) fn new(config: String, target: Target, size: [u32; 2]) -> Self {
        Self {
            config,
            target,
            size,
            panels: false,
            operator: String::new(),
            is_visible: true,
            camera: None,
            theta: None,
            layers: BTreeMap::new(),
            time: None,
            tags: BTreeMap::new(),
            mirrored: BTreeMap::new(),
            alarms: BTreeMap::new(),
        }
    }

    /// Notes a command whose effect is to outlive the viewer; whether there is room.
    pub(crate) fn note(&mut self, command: &Command) -> bool {
        match command {
            Command::Resize(size) => self.size = *size,
            Command::SetVisible(is_visible) => self.is_visible = *is_visible,
            Command::UseCamera(_) | Command::Focus(_) | Command::SetCamera(_) => {
                self.camera = Some(command.clone());
            }
            Command::SetTheta(theta) => self.theta = *theta,
            Command::SetTime(time) => self.time = *time,
            Command::SetLayer { layer, shown } => {
                return put(&mut self.layers, layer, *shown, MAX_NAMES);
            }
            Command::MirrorAlarm { alarm, state } => {
                return put(&mut self.mirrored, alarm, *state, MAX_NAMES);
            }
            Command::SetTags(tags) => return self.note_tags(tags),
            Command::ActOnAlarm { .. }
            | Command::Reload(_)
            | Command::Pick(_)
            | Command::Pointer(_)
            | Command::Key(_) => {}
        }
        true
    }

    fn note_tags(&mut self, tags: &[TagUpdate]) -> bool {
        let new = tags.iter().filter(|tag| !self.tags.contains_key(&tag.tag)).count();
        if self.tags.len() + new > MAX_TAGS {
            return false;
        }
        for tag in tags {
            match (self.tags.get_mut(&tag.tag), &tag.value) {
                // What is said of quality alone leaves the value as old as it is.
                (Some(known), None) => known.quality = tag.quality,
                _ => drop(self.tags.insert(tag.tag.clone(), tag.clone())),
            }
        }
        true
    }

    /// Notes where the viewer says the camera is.
    pub(crate) fn note_pose(&mut self, pose: CameraPose) {
        self.camera = Some(Command::SetCamera(pose));
    }

    /// Notes how the viewer says an alarm stands.
    pub(crate) fn note_alarm(&mut self, snapshot: &AlarmSnapshot) {
        match snapshot.state {
            AlarmState::Normal => drop(self.alarms.remove(&snapshot.alarm)),
            _ => drop(put(&mut self.alarms, &snapshot.alarm, snapshot.clone(), MAX_NAMES)),
        }
    }

    /// The first message to a viewer.
    pub(crate) fn start_parameters(&self) -> StartParameters {
        StartParameters {
            version: PROTOCOL_VERSION,
            config: self.config.clone(),
            target: self.target,
            size: self.size,
            panels: self.panels,
            operator: self.operator.clone(),
            alarms: self.alarms.values().cloned().collect(),
        }
    }

    /// Returns the commands that bring a viewer from its start parameters to the desired state.
    pub(crate) fn commands(&self) -> Vec<Command> {
        let mut commands = Vec::new();
        if !self.is_visible {
            commands.push(Command::SetVisible(false));
        }
        commands.extend(self.camera.clone());
        commands.extend(self.theta.map(|theta| Command::SetTheta(Some(theta))));
        let layer = |(layer, shown): (&String, &bool)| Command::SetLayer {
            layer: layer.clone(),
            shown: *shown,
        };
        commands.extend(self.layers.iter().map(layer));
        commands.extend(self.time.map(|time| Command::SetTime(Some(time))));
        let tags: Vec<_> = self.tags.values().cloned().collect();
        commands.extend(tags.chunks(MAX_TAGS_A_MESSAGE).map(|tags| Command::SetTags(tags.into())));
        let mirrored = |(alarm, state): (&String, &AlarmState)| Command::MirrorAlarm {
            alarm: alarm.clone(),
            state: *state,
        };
        commands.extend(self.mirrored.iter().map(mirrored));
        commands
    }
}

fn put<T>(map: &mut BTreeMap<String, T>, key: &str, value: T, limit: usize) -> bool {
    if map.len() >= limit && !map.contains_key(key) {
        return false;
    }
    map.insert(key.to_owned(), value);
    true
}

#[cfg(test)]
mod tests {
    use busbar_types::{Origin, QualityLevel, Value};

    use super::*;

    fn desired() -> DesiredState {
        DesiredState::new("/a.json".into(), Target::Offscreen, [4, 4])
    }

    fn tag(id: &str, value: Option<f64>, sent_at: u64) -> TagUpdate {
        TagUpdate {
            tag: id.into(),
            value: value.map(Value::F64),
            quality: if value.is_some() { QualityLevel::Good } else { QualityLevel::Bad },
            source_time: None,
            sent_at,
        }
    }

    #[test]
    fn the_next_viewer_is_told_what_the_last_one_was() {
        let mut desired = desired();
        let pose = CameraPose { eye: [1.0; 3], target: [0.0; 3], is_orthographic: true };
        desired.note(&Command::UseCamera("bay".into()));
        assert_eq!(desired.commands(), [Command::UseCamera("bay".into())]);
        desired.note_pose(pose);
        desired.note(&Command::SetTheta(Some(0.5)));
        desired.note(&Command::Pick([1, 1]));
        let reported = desired.commands();
        assert_eq!(reported, [Command::SetCamera(pose), Command::SetTheta(Some(0.5))]);
        let snapshot = |state| AlarmSnapshot {
            alarm: "A".into(),
            state,
            since: 1,
            standing: "{}".into(),
            origin: Origin::LIVE,
            reason: String::new(),
        };
        desired.note_alarm(&snapshot(AlarmState::Shelved));
        assert_eq!(desired.start_parameters().alarms, [snapshot(AlarmState::Shelved)]);
        desired.note_alarm(&snapshot(AlarmState::Normal));
        assert_eq!(desired.start_parameters().alarms, []);
    }

    #[test]
    fn a_tag_is_as_old_for_the_next_viewer_as_it_was() {
        let mut desired = desired();
        desired.note(&Command::SetTags(vec![tag("T", Some(1.0), 10)]));
        desired.note(&Command::SetTags(vec![tag("T", None, 20)]));
        let known = TagUpdate { quality: QualityLevel::Bad, ..tag("T", Some(1.0), 10) };
        assert_eq!(desired.commands(), [Command::SetTags(vec![known])]);
    }

    #[test]
    fn more_tags_than_there_is_room_for_are_refused_whole() {
        let mut desired = desired();
        let set = |range: std::ops::Range<usize>| {
            Command::SetTags(range.map(|n| tag(&n.to_string(), Some(0.0), 1)).collect())
        };
        assert!(desired.note(&set(0..MAX_TAGS)));
        assert!(!desired.note(&set(MAX_TAGS - 1..MAX_TAGS + 1)));
        assert!(desired.note(&set(0..10)), "those that are known");
        let reported = desired.commands();
        assert_eq!(reported.len(), MAX_TAGS.div_ceil(MAX_TAGS_A_MESSAGE));
    }
}
