//! Alarms that other systems decide on, as plugins report them. They are shown, marked as
//! stale where their source is not heard of, and never changed here.

mod poller;

use std::collections::HashMap;
use std::time::{Duration, Instant};

use busbar_alarms::{AlarmHandle, SourceAlarm};
use busbar_config::AlarmSourceConfig;
use busbar_types::{Priority, QualityLevel};

use self::poller::{PolledAlarms, SourceHealth, take_alarms};
use crate::definition::SiteDefinition;
use crate::equipment::{EquipmentDirectory, EquipmentNumber};
use crate::plugin_poller::PluginPoller;

/// Numbers of these alarms; those of configured ones are below.
const FIRST_NUMBER: u32 = 1 << 30;
const _: () = assert!(FIRST_NUMBER as usize > busbar_alarms::MAX_ALARMS);

/// All external alarm sources of a site.
#[derive(Default)]
pub struct ExternalSources {
    all: Vec<ExternalSource>,
    next_number: u32,
    /// Index of the source and the position in it of each alarm.
    places: HashMap<AlarmHandle, (usize, usize)>,
    /// Grows with whatever is to be listed otherwise.
    pub(super) revision: u64,
}

/// Plugin with alarms of another system.
pub struct ExternalSource {
    config: AlarmSourceConfig,
    /// Polling thread; none if it could not be started, as the fault says.
    poller: Option<PluginPoller<PolledAlarms>>,
    health: SourceHealth,
    alarms: Vec<ExternalAlarm>,
    is_stale: bool,
    /// True once a warning about alarms without equipment in the scene was logged.
    has_warned_unknown_equipment: bool,
}

/// Alarm that another system decides on.
pub struct ExternalAlarm {
    /// Handle, above those of configured alarms.
    pub number: AlarmHandle,
    /// Alarm as its source reported it.
    pub alarm: SourceAlarm,
    /// Priority by the severity rules of the configuration.
    pub priority: Priority,
    /// Equipment by the rules of the configuration; none if the directory lacks it.
    pub equipment: Option<EquipmentNumber>,
}

impl ExternalSources {
    /// Begins to read all configured sources.
    pub(super) fn start(site: &SiteDefinition) -> Self {
        let mut sources = Self::default();
        for config in &site.config.alarm_handling.sources {
            let started = site.plugins.get(&config.plugin).map(PluginPoller::start);
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
    pub(super) fn inherit(&mut self, before: Self, directory: &dyn EquipmentDirectory) {
        self.next_number = before.next_number;
        for mut old in before.all {
            let same = |source: &&mut ExternalSource| source.config.plugin == old.config.plugin;
            if let Some(source) = self.all.iter_mut().find(same) {
                source.health = SourceHealth { fault: source.health.fault.take(), ..old.health };
                for external in &mut old.alarms {
                    external.place(&source.config, directory);
                }
                source.alarms = old.alarms;
            }
        }
        self.index();
    }

    /// Takes the alarms that the pollers have read.
    pub(super) fn step(&mut self, directory: &dyn EquipmentDirectory) {
        let (mut is_new, now) = (false, Instant::now());
        for source in &mut self.all {
            if let Some((new_alarms, health)) = source.poller.as_ref().map(take_alarms) {
                // What was inherited was heard by another reader.
                let last_heard = health.last_heard.max(source.health.last_heard);
                source.health = SourceHealth { last_heard, ..health };
                if let Some(new_alarms) = new_alarms {
                    source.replace(new_alarms, &mut self.next_number, directory);
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
    }

    fn index(&mut self) {
        self.revision += 1;
        self.places.clear();
        for (at, source) in self.all.iter().enumerate() {
            let own = source.alarms.iter().enumerate();
            self.places.extend(own.map(|(place, external)| (external.number, (at, place))));
        }
    }

    /// Returns all sources in the order of the configuration.
    pub fn all(&self) -> &[ExternalSource] {
        &self.all
    }

    /// Returns each alarm with its source.
    pub fn iter(&self) -> impl Iterator<Item = (&ExternalSource, &ExternalAlarm)> {
        self.all.iter().flat_map(|source| source.alarms.iter().map(move |one| (source, one)))
    }

    /// Returns an alarm and its source, by the alarm's handle.
    pub fn get(&self, alarm: AlarmHandle) -> Option<(&ExternalSource, &ExternalAlarm)> {
        let (source, place) = *self.places.get(&alarm)?;
        let source = self.all.get(source)?;
        Some((source, source.alarms.get(place)?))
    }
}

impl ExternalSource {
    /// Returns the name of the plugin instance.
    pub fn name(&self) -> &str {
        &self.config.plugin
    }

    /// Returns the alarms as last reported.
    pub fn alarms(&self) -> &[ExternalAlarm] {
        &self.alarms
    }

    /// Reports whether the source was ever heard of.
    pub(super) fn was_heard(&self) -> bool {
        self.health.last_heard.is_some()
    }

    /// Returns the number of alarms that the source has beyond those reported.
    pub fn left_out(&self) -> u64 {
        self.health.left_out
    }

    /// Reports whether the alarms were outdated in the last step.
    pub fn is_stale(&self) -> bool {
        self.is_stale
    }

    /// Returns the reason why the alarms are outdated; none while they are current.
    pub fn stale_reason(&self, now: Instant) -> Option<String> {
        if let Some(fault) = &self.health.fault {
            return Some(fault.clone());
        }
        let limit = Duration::from_secs(self.config.stale_after_seconds.into());
        let is_silent = self.silence(now).is_none_or(|silence| silence > limit);
        is_silent.then(|| "its source is silent".to_owned())
    }

    /// Returns the time since the source's last sign of life; none before the first.
    pub fn silence(&self, now: Instant) -> Option<Duration> {
        self.health.last_heard.map(|last_heard| now.saturating_duration_since(last_heard))
    }

    /// Replaces the alarms; those that remain keep their numbers.
    fn replace(
        &mut self,
        new_alarms: Vec<SourceAlarm>,
        next: &mut u32,
        directory: &dyn EquipmentDirectory,
    ) {
        let old = std::mem::take(&mut self.alarms);
        let numbers: HashMap<String, AlarmHandle> =
            old.into_iter().map(|external| (external.alarm.id, external.number)).collect();
        for alarm in new_alarms {
            let number = numbers.get(&alarm.id).copied().unwrap_or_else(|| {
                *next = next.wrapping_add(1) % FIRST_NUMBER;
                AlarmHandle(FIRST_NUMBER + *next)
            });
            let mut external =
                ExternalAlarm { number, alarm, priority: Priority::Low, equipment: None };
            external.place(&self.config, directory);
            self.alarms.push(external);
        }
        self.warn_unknown_equipment();
    }

    /// Warns once of alarms without equipment in the scene.
    fn warn_unknown_equipment(&mut self) {
        let absent = || self.alarms.iter().filter(|external| external.equipment.is_none());
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
    fn place(&mut self, config: &AlarmSourceConfig, directory: &dyn EquipmentDirectory) {
        let reached = |least: &u16| self.alarm.severity >= *least;
        let rank = config.severities.iter().position(reached).unwrap_or(Priority::ALL.len() - 1);
        self.priority = Priority::ALL[rank];
        let source = &self.alarm.source;
        let by_rule = config.equipment_of(source);
        let id = by_rule.unwrap_or(source);
        self.equipment = directory.find(id);
    }

    /// Reports whether the alarm is current and of good quality.
    pub fn is_certain(&self, source: &ExternalSource) -> bool {
        !source.is_stale && self.alarm.quality == QualityLevel::Good
    }

    /// Returns the alarm's id, unique among all sources.
    pub fn id(&self, source: &ExternalSource) -> String {
        format!("{}:{}", source.name(), self.alarm.id)
    }

    /// Returns the message of the source, or else the alarm's name or id.
    pub fn message(&self) -> &str {
        let SourceAlarm { message, name, id, .. } = &self.alarm;
        [message, name, id].into_iter().find(|text| !text.is_empty()).map_or("", String::as_str)
    }
}
