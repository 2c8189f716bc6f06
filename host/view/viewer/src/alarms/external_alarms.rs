//! Alarms that other systems decide on, as plugins report them. They are shown, marked as
//! stale where their source is not heard of, and never changed here.

mod poller;

use std::collections::HashMap;
use std::time::{Duration, Instant};

use busbar_alarms::{AlarmHandle, Priority, SourceAlarm, SourceQuality};
use busbar_config::AlarmSourceConfig;
use busbar_scene::NodeIndex;
use busbar_ui::{AlarmSourceStatus, age_text};

use self::poller::{AlarmPoller, SourceHealth};
use busbar_scene_loader::LoadedScene;

/// Numbers of these alarms; those of configured ones are below.
const FIRST_NUMBER: u32 = 1 << 30;
const _: () = assert!(FIRST_NUMBER as usize > busbar_alarms::MAX_ALARMS);

/// All external alarm sources of a view.
#[derive(Default)]
pub(crate) struct ExternalSources {
    all: Vec<ExternalSource>,
    next_number: u32,
    /// Index of the source and the position in it of each alarm.
    places: HashMap<AlarmHandle, (usize, usize)>,
    /// Grows with whatever is to be listed otherwise.
    pub(super) revision: u64,
}

/// A plugin with alarms of another system.
pub(super) struct ExternalSource {
    config: AlarmSourceConfig,
    /// Polling thread; none if it could not be started, as the fault says.
    poller: Option<AlarmPoller>,
    health: SourceHealth,
    alarms: Vec<ExternalAlarm>,
    is_stale: bool,
    /// True once a warning about alarms without equipment in the scene was logged.
    has_warned_unknown_equipment: bool,
}

/// An alarm of a source.
pub(super) struct ExternalAlarm {
    pub(super) number: AlarmHandle,
    pub(super) alarm: SourceAlarm,
    pub(super) priority: Priority,
    pub(super) node: Option<NodeIndex>,
}

impl ExternalSources {
    /// Begins to read those of a scene.
    pub(super) fn start(scene: &LoadedScene) -> Self {
        let mut sources = Self::default();
        for config in &scene.config.alarm_handling.sources {
            let started = scene.instances.get(&config.plugin).map(AlarmPoller::start);
            let (poller, fault) = match started {
                Some(Ok(poller)) => (Some(poller), None),
                Some(Err(error)) => (None, Some(error.to_string())),
                None => (None, Some("its plugin is not there".to_owned())),
            };
            sources.all.push(ExternalSource {
                config: config.clone(),
                poller,
                health: SourceHealth { fault, ..SourceHealth::default() },
                alarms: Vec::new(),
                is_stale: true,
                has_warned_unknown_equipment: false,
            });
        }
        sources
    }

    /// Inherits the alarms of sources that existed before, until they are read again.
    pub(super) fn inherit(&mut self, before: Self, scene: &LoadedScene) {
        self.next_number = before.next_number;
        for mut old in before.all {
            let same = |source: &&mut ExternalSource| source.config.plugin == old.config.plugin;
            if let Some(source) = self.all.iter_mut().find(same) {
                source.health = SourceHealth { fault: source.health.fault.take(), ..old.health };
                for external in &mut old.alarms {
                    external.place(&source.config, scene);
                }
                source.alarms = old.alarms;
            }
        }
        self.index();
    }

    /// Takes the alarms that the pollers have read; reports whether any are new.
    pub(super) fn step(&mut self, scene: &LoadedScene) -> bool {
        let (mut is_new, now) = (false, Instant::now());
        for source in &mut self.all {
            if let Some((new_alarms, health)) = source.poller.as_ref().map(AlarmPoller::take) {
                // What was inherited was heard by another reader.
                let last_heard = health.last_heard.max(source.health.last_heard);
                source.health = SourceHealth { last_heard, ..health };
                if let Some(new_alarms) = new_alarms {
                    source.replace(new_alarms, &mut self.next_number, scene);
                    is_new = true;
                }
            }
            let why = source.stale_reason(now);
            if std::mem::replace(&mut source.is_stale, why.is_some()) != why.is_some() {
                self.revision += 1;
                if let Some(why) = why {
                    tracing::warn!(plugin = source.config.plugin, "its alarms are stale: {why}");
                }
            }
        }
        if is_new {
            self.index();
        }
        is_new
    }

    fn index(&mut self) {
        self.revision += 1;
        self.places.clear();
        for (at, source) in self.all.iter().enumerate() {
            let own = source.alarms.iter().enumerate();
            self.places.extend(own.map(|(place, external)| (external.number, (at, place))));
        }
    }

    /// Each alarm with its source.
    pub(super) fn iter(&self) -> impl Iterator<Item = (&ExternalSource, &ExternalAlarm)> {
        self.all.iter().flat_map(|source| source.alarms.iter().map(move |one| (source, one)))
    }

    /// An alarm by its number.
    pub(super) fn get(&self, alarm: AlarmHandle) -> Option<(&ExternalSource, &ExternalAlarm)> {
        let (source, place) = *self.places.get(&alarm)?;
        let source = self.all.get(source)?;
        Some((source, source.alarms.get(place)?))
    }

    /// Returns the status of each source.
    pub(super) fn statuses(&self) -> Vec<AlarmSourceStatus> {
        let now = Instant::now();
        let status = |source: &ExternalSource| AlarmSourceStatus {
            name: source.config.plugin.clone(),
            alarms: source.alarms.len(),
            left_out: source.health.left_out,
            uncertainty: source
                .stale_reason(now)
                .map(|why| format!("{}: {why}", source.staleness_text(now))),
        };
        self.all.iter().map(status).collect()
    }
}

impl ExternalSource {
    pub(super) fn name(&self) -> &str {
        &self.config.plugin
    }

    /// Returns the reason why the source's alarms may be outdated.
    fn stale_reason(&self, now: Instant) -> Option<String> {
        if let Some(fault) = &self.health.fault {
            return Some(fault.clone());
        }
        let limit = Duration::from_secs(self.config.stale_after_seconds.into());
        let is_silent = self.silence(now).is_none_or(|silence| silence > limit);
        is_silent.then(|| "its source is silent".to_owned())
    }

    fn silence(&self, now: Instant) -> Option<Duration> {
        self.health.last_heard.map(|last_heard| now.saturating_duration_since(last_heard))
    }

    fn staleness_text(&self, now: Instant) -> String {
        match self.silence(now) {
            Some(silence) => format!("stale {}", age_text(silence)),
            None => "not read yet".to_owned(),
        }
    }

    /// Returns the short reason why an alarm's state is uncertain.
    pub(super) fn short_uncertainty(&self, alarm: &SourceAlarm) -> Option<String> {
        if self.is_stale {
            return Some(self.staleness_text(Instant::now()));
        }
        match alarm.quality {
            SourceQuality::Good => None,
            SourceQuality::Uncertain => Some("uncertain at its source".to_owned()),
            SourceQuality::Bad => Some("bad at its source".to_owned()),
        }
    }

    /// Returns the long reason why an alarm's state is uncertain.
    pub(super) fn long_uncertainty(&self, alarm: &SourceAlarm) -> Option<String> {
        let uncertainty = self.short_uncertainty(alarm)?;
        let why = self.stale_reason(Instant::now());
        Some(why.map_or_else(|| uncertainty.clone(), |why| format!("{uncertainty}: {why}")))
    }

    /// Replaces the alarms; those that remain keep their numbers.
    fn replace(&mut self, new_alarms: Vec<SourceAlarm>, next: &mut u32, scene: &LoadedScene) {
        let old = std::mem::take(&mut self.alarms);
        let numbers: HashMap<String, AlarmHandle> =
            old.into_iter().map(|external| (external.alarm.id, external.number)).collect();
        for alarm in new_alarms {
            let number = numbers.get(&alarm.id).copied().unwrap_or_else(|| {
                *next = next.wrapping_add(1) % FIRST_NUMBER;
                AlarmHandle(FIRST_NUMBER + *next)
            });
            let mut external = ExternalAlarm { number, alarm, priority: Priority::Low, node: None };
            external.place(&self.config, scene);
            self.alarms.push(external);
        }
        self.warn_unknown_equipment();
    }

    /// Warns once of alarms without equipment in the scene.
    fn warn_unknown_equipment(&mut self) {
        let absent = || self.alarms.iter().filter(|external| external.node.is_none());
        if let Some(first) = absent().next().filter(|_| !self.has_warned_unknown_equipment) {
            let (count, plugin) = (absent().count(), &self.config.plugin);
            tracing::warn!(
                "{count} alarms of '{plugin}' are at no equipment of the scene, such as those of \
                 '{}': add a rule to \"equipment\" of that source, or an alias to \"equipment\"",
                first.alarm.source
            );
            self.has_warned_unknown_equipment = true;
        }
    }
}

impl ExternalAlarm {
    /// Finds its priority and its equipment.
    fn place(&mut self, config: &AlarmSourceConfig, scene: &LoadedScene) {
        let reached = |least: &u16| self.alarm.severity >= *least;
        let rank = config.severities.iter().position(reached).unwrap_or(Priority::ALL.len() - 1);
        self.priority = Priority::ALL[rank];
        let source = &self.alarm.source;
        let by_rule = config.equipment_of(source);
        let id = by_rule.unwrap_or(source);
        self.node = scene.equipment.find(&scene.graph, id);
    }

    /// Reports whether the alarm is current and of good quality.
    pub(super) fn is_certain(&self, source: &ExternalSource) -> bool {
        !source.is_stale && self.alarm.quality == SourceQuality::Good
    }

    /// Returns the alarm's id, unique among all sources.
    pub(super) fn id(&self, source: &ExternalSource) -> String {
        format!("{}:{}", source.name(), self.alarm.id)
    }

    /// Returns the message of the source, or else the alarm's name or id.
    pub(super) fn message(&self) -> &str {
        let SourceAlarm { message, name, id, .. } = &self.alarm;
        [message, name, id].into_iter().find(|text| !text.is_empty()).map_or("", String::as_str)
    }
}
