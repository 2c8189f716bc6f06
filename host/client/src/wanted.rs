//! What a viewer must be told to be as the one before it.

use std::collections::BTreeMap;

use busbar_protocol::message::{
    AlarmStanding, Begin, CameraPose, Command, MAX_TAGS_A_MESSAGE, PROTOCOL_VERSION, TagUpdate,
    Target,
};

/// Tags whose last value is kept for the next viewer.
pub(crate) const MAX_TAGS: usize = 100_000;
/// Alarms and layers that are kept likewise.
pub(crate) const MAX_NAMES: usize = 1 << 17;

/// All that outlives a viewer.
#[derive(Clone, Debug)]
pub(crate) struct Wanted {
    /// The last one that was shown, or the first.
    pub(crate) config: String,
    pub(crate) target: Target,
    pub(crate) size: [u32; 2],
    pub(crate) panels: bool,
    pub(crate) operator: String,
    is_visible: bool,
    /// What the program asked of the camera last, until the viewer says where it is.
    camera: Option<Command>,
    theta: Option<f64>,
    layers: BTreeMap<String, bool>,
    time: Option<i64>,
    tags: BTreeMap<String, TagUpdate>,
    mirrored: BTreeMap<String, u8>,
    alarms: BTreeMap<String, AlarmStanding>,
}

impl Wanted {
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
            Command::UseCamera(_) | Command::Focus(_) | Command::Look(_) => {
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
            | Command::Point(_)
            | Command::Type(_) => {}
        }
        true
    }

    fn note_tags(&mut self, tags: &[TagUpdate]) -> bool {
        let new = tags.iter().filter(|tag| !self.tags.contains_key(&tag.tag)).count();
        if self.tags.len() + new > MAX_TAGS {
            return false;
        }
        for tag in tags {
            match (self.tags.get_mut(&tag.tag), tag.value) {
                // What is said of quality alone leaves the value as old as it is.
                (Some(known), None) => known.quality = tag.quality,
                _ => drop(self.tags.insert(tag.tag.clone(), tag.clone())),
            }
        }
        true
    }

    /// Notes where the viewer says the camera is.
    pub(crate) fn note_pose(&mut self, pose: CameraPose) {
        self.camera = Some(Command::Look(pose));
    }

    /// Notes how the viewer says an alarm stands.
    pub(crate) fn note_alarm(&mut self, standing: &AlarmStanding) {
        match standing.state {
            0 => drop(self.alarms.remove(&standing.alarm)),
            _ => drop(put(&mut self.alarms, &standing.alarm, standing.clone(), MAX_NAMES)),
        }
    }

    /// The first message to a viewer.
    pub(crate) fn begin(&self) -> Begin {
        Begin {
            version: PROTOCOL_VERSION,
            config: self.config.clone(),
            target: self.target,
            size: self.size,
            panels: self.panels,
            operator: self.operator.clone(),
            alarms: self.alarms.values().cloned().collect(),
        }
    }

    /// What is to be told after that.
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
        let mirrored = |(alarm, state): (&String, &u8)| Command::MirrorAlarm {
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
    use busbar_protocol::message::{TagQuality, TagValue};

    use super::*;

    fn wanted() -> Wanted {
        Wanted::new("/a.json".into(), Target::Offscreen, [4, 4])
    }

    fn tag(id: &str, value: Option<f64>, said_at: u64) -> TagUpdate {
        TagUpdate {
            tag: id.into(),
            value: value.map(TagValue::F64),
            quality: if value.is_some() { TagQuality::Good } else { TagQuality::Bad },
            source_time: None,
            said_at,
        }
    }

    #[test]
    fn the_next_viewer_is_told_what_the_last_one_was() {
        let mut wanted = wanted();
        let pose = CameraPose { eye: [1.0; 3], target: [0.0; 3], is_orthographic: true };
        wanted.note(&Command::UseCamera("bay".into()));
        assert_eq!(wanted.commands(), [Command::UseCamera("bay".into())]);
        wanted.note_pose(pose);
        wanted.note(&Command::SetTheta(Some(0.5)));
        wanted.note(&Command::Pick([1, 1]));
        let told = wanted.commands();
        assert_eq!(told, [Command::Look(pose), Command::SetTheta(Some(0.5))]);
        let standing =
            |state| AlarmStanding { alarm: "A".into(), state, since: 1, standing: "{}".into() };
        wanted.note_alarm(&standing(6));
        assert_eq!(wanted.begin().alarms, [standing(6)]);
        wanted.note_alarm(&standing(0));
        assert_eq!(wanted.begin().alarms, []);
    }

    #[test]
    fn a_tag_is_as_old_for_the_next_viewer_as_it_was() {
        let mut wanted = wanted();
        wanted.note(&Command::SetTags(vec![tag("T", Some(1.0), 10)]));
        wanted.note(&Command::SetTags(vec![tag("T", None, 20)]));
        let known = TagUpdate { quality: TagQuality::Bad, ..tag("T", Some(1.0), 10) };
        assert_eq!(wanted.commands(), [Command::SetTags(vec![known])]);
    }

    #[test]
    fn more_tags_than_there_is_room_for_are_refused_whole() {
        let mut wanted = wanted();
        let set = |range: std::ops::Range<usize>| {
            Command::SetTags(range.map(|n| tag(&n.to_string(), Some(0.0), 1)).collect())
        };
        assert!(wanted.note(&set(0..MAX_TAGS)));
        assert!(!wanted.note(&set(MAX_TAGS - 1..MAX_TAGS + 1)));
        assert!(wanted.note(&set(0..10)), "those that are known");
        let told = wanted.commands();
        assert_eq!(told.len(), MAX_TAGS.div_ceil(MAX_TAGS_A_MESSAGE));
    }
}
