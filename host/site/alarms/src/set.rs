//! Set of all alarms of a scene, indexed by the tags that they use.

use std::collections::HashMap;

use busbar_tags::{TagHandle, TagSet};

use crate::{AlarmHandle, AlarmSource, AlarmSpec, MAX_ALARMS, MAX_DELAY};

/// Validated alarms: their tags exist and have the types that their conditions need.
#[derive(Debug, Default)]
pub struct AlarmSet {
    specs: Vec<AlarmSpec>,
    by_id: HashMap<String, AlarmHandle>,
    /// Start index of each tag's users; those of the last one end with the list.
    first_users: Vec<u32>,
    users: Vec<User>,
    /// The group of each alarm, by number; and how many groups there are.
    groups: Vec<Option<u32>>,
    group_count: u32,
}

/// Alarm that uses a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct User {
    pub(crate) alarm: AlarmHandle,
    /// True where the tag suppresses the alarm and does not raise it.
    pub(crate) suppresses: bool,
}

/// An alarm that cannot be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("alarm '{id}': {cause}; {remedy}")]
pub struct AlarmSpecError {
    /// Id of the alarm.
    pub id: String,
    /// Cause of the error.
    pub cause: String,
    /// Remedy for the user.
    pub remedy: String,
}

impl AlarmSet {
    /// Builds the set; an alarm's handle is its index.
    ///
    /// # Errors
    /// Every alarm whose id another has, whose tag is not of `tags` or cannot have what its
    /// condition looks at, or whose delays are longer than [`MAX_DELAY`]; the first one of
    /// more than [`MAX_ALARMS`].
    pub fn new(specs: Vec<AlarmSpec>, tags: &TagSet) -> Result<Self, Vec<AlarmSpecError>> {
        let mut faults = Vec::new();
        let mut by_id = HashMap::with_capacity(specs.len());
        let mut uses: Vec<(TagHandle, User)> = Vec::new();
        let mut numbers: HashMap<String, u32> = HashMap::new();
        let mut groups = Vec::with_capacity(specs.len());
        for (spec, index) in specs.iter().zip(0..) {
            let fault = |cause: String, remedy: &str| AlarmSpecError {
                id: spec.id.clone(),
                cause,
                remedy: remedy.to_owned(),
            };
            if index as usize == MAX_ALARMS {
                faults.push(fault(format!("there are more than {MAX_ALARMS}"), "leave some out"));
                break;
            }
            let alarm = AlarmHandle(index);
            if by_id.insert(spec.id.clone(), alarm).is_some() {
                faults.push(fault("another alarm has this id".into(), "give it another one"));
            }
            let next = numbers.len() as u32;
            let number = |name: &String| *numbers.entry(name.clone()).or_insert(next);
            groups.push(spec.group.as_ref().map(number));
            if spec.source.delays().into_iter().any(|delay| delay > MAX_DELAY) {
                let cause = format!("a delay is longer than {} s", MAX_DELAY.as_secs());
                faults.push(fault(cause, "shorten it"));
            }
            let trigger = match &spec.source {
                AlarmSource::Tag { trigger, .. } => Some(trigger),
                AlarmSource::Verdict { .. } | AlarmSource::Mirrored => None,
            };
            let suppressed_by = spec.source.suppressed_by();
            let watches = [trigger.map(|by| (by, false)), suppressed_by.map(|by| (by, true))];
            for (watch, suppresses) in watches.into_iter().flatten() {
                let (tag, condition) = (watch.tag, &watch.condition);
                match tags.spec(tag).map(|spec| condition.fault(spec.kind)) {
                    None => faults.push(fault(format!("there is no tag {}", tag.0), "add it")),
                    Some(Some((cause, remedy))) => faults.push(fault(cause, remedy)),
                    Some(None) => uses.push((tag, User { alarm, suppresses })),
                }
            }
        }
        if !faults.is_empty() {
            return Err(faults);
        }
        uses.sort_by_key(|(tag, user)| (*tag, user.alarm, user.suppresses));
        let first_user = |tag: u32| uses.partition_point(|(used, _)| used.0 < tag) as u32;
        Ok(Self {
            first_users: (0..tags.specs().len() as u32).map(first_user).collect(),
            users: uses.into_iter().map(|(_, user)| user).collect(),
            group_count: numbers.len() as u32,
            specs,
            by_id,
            groups,
        })
    }

    /// Returns the set with further alarms behind its own, whose handles stay.
    ///
    /// # Errors
    /// Those of [`AlarmSet::new`].
    pub fn extended(
        &self,
        more: impl IntoIterator<Item = AlarmSpec>,
        tags: &TagSet,
    ) -> Result<Self, Vec<AlarmSpecError>> {
        Self::new(self.specs.iter().cloned().chain(more).collect(), tags)
    }

    /// Returns the definitions of all alarms, by handle.
    pub fn specs(&self) -> &[AlarmSpec] {
        &self.specs
    }

    /// Returns the definition of an alarm.
    pub fn spec(&self, alarm: AlarmHandle) -> Option<&AlarmSpec> {
        self.specs.get(alarm.0 as usize)
    }

    /// The alarm that has an id.
    pub fn find(&self, id: &str) -> Option<AlarmHandle> {
        self.by_id.get(id).copied()
    }

    /// Iterates over all handles.
    pub fn handles(&self) -> impl ExactSizeIterator<Item = AlarmHandle> + use<> {
        (0..self.specs.len() as u32).map(AlarmHandle)
    }

    /// The alarms that look at a tag.
    #[inline]
    pub(crate) fn users(&self, tag: TagHandle) -> &[User] {
        let index = tag.0 as usize;
        let Some(&first) = self.first_users.get(index) else { return &[] };
        let end = self.first_users.get(index + 1).map_or(self.users.len(), |end| *end as usize);
        &self.users[first as usize..end]
    }

    pub(crate) fn group(&self, alarm: AlarmHandle) -> Option<u32> {
        self.groups[alarm.0 as usize]
    }

    pub(crate) fn group_count(&self) -> u32 {
        self.group_count
    }
}
