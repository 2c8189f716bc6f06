//! Samples of all transformers as records of a chart: those of a file, and those of monitors.

use std::collections::{BTreeMap, BTreeSet};
use std::time::{Duration, SystemTime};

use busbar_plugin_sdk::{ChartDescription, ChartRecord, ChartRecords, Error, Host, LogLevel};

use crate::axes;
use crate::explain::MAX_TRAIL;
use crate::judged::Judged;
use crate::loading::{Loaded, Loading};
use crate::monitors::Monitors;
use crate::settings::Settings;
use crate::source;

/// The longest that the first call waits for a file: most are read by then.
const FIRST_PATIENCE: Duration = Duration::from_secs(4);
/// Days that a sample speaks for its transformer where no file says otherwise.
const MONITORED_DAYS: u32 = 400;

/// Samples of all transformers.
pub(crate) struct Fleet {
    host: Host,
    settings: Settings,
    /// Version of the file when reading it began.
    version: Option<(SystemTime, u64)>,
    loading: Option<Loading>,
    has_begun: bool,
    /// Reason why the file could not be read the last time.
    fault: Option<String>,
    /// Samples of the file, by transformer.
    laboratory: BTreeMap<String, Vec<Judged>>,
    /// Revision of the monitors when their samples were listed.
    monitored: u64,
    revision: u64,
    equipment: Vec<String>,
    records: Vec<ChartRecord>,
    values: Vec<f32>,
}

impl Fleet {
    /// Nothing is read yet.
    pub(crate) fn from_settings(settings: &Settings, host: Host) -> Result<Self, Error> {
        if let Some(fleet) = settings.fleet.as_ref().filter(|fleet| !fleet.file.is_absolute()) {
            let path = fleet.file.display();
            return Err(Error::settings(format!(
                "fleet.file: '{path}' is no absolute path; ${{folder}}/ before it is the folder of \
                 the configuration"
            )));
        }
        Ok(Self {
            host,
            settings: settings.clone(),
            version: None,
            loading: None,
            has_begun: false,
            fault: None,
            laboratory: BTreeMap::new(),
            monitored: 0,
            revision: 0,
            equipment: Vec::new(),
            records: Vec::new(),
            values: Vec::new(),
        })
    }

    /// Takes what was read of the file, which is read again whenever it is another one, and
    /// what monitors measured. A file that cannot be read leaves the samples as they were,
    /// and is told.
    pub(crate) fn refresh(&mut self, monitors: &Monitors) {
        let is_first = !self.has_begun;
        self.begin_loading();
        let patience = if is_first { FIRST_PATIENCE } else { Duration::ZERO };
        let taken = self.loading.as_mut().and_then(|loading| loading.take(patience));
        let is_other = taken.is_some() || self.monitored != monitors.revision() || is_first;
        if let Some(taken) = taken {
            self.loading = None;
            self.fault = match taken {
                Err(fault) => Some(fault),
                Ok(loaded) => self.take(loaded).err(),
            };
            if let Some(fault) = &self.fault {
                self.host.log(LogLevel::Error, fault);
            }
        }
        if is_other {
            self.monitored = monitors.revision();
            self.list(monitors);
        }
    }

    fn begin_loading(&mut self) {
        let Some(fleet) = self.settings.fleet.as_ref().filter(|_| self.loading.is_none()) else {
            self.has_begun = true;
            return;
        };
        let version = source::version(&fleet.file);
        if self.has_begun && version == self.version {
            return;
        }
        // Also after a fault: it is told once.
        (self.version, self.has_begun) = (version, true);
        match Loading::begin(fleet.clone(), self.settings.clone()) {
            Ok(loading) => self.loading = Some(loading),
            Err(fault) => self.host.log(LogLevel::Error, &fault),
        }
    }

    fn take(&mut self, loaded: Loaded) -> Result<(), String> {
        let place = self.settings.fleet.as_ref().map(|fleet| fleet.file.display().to_string());
        let place = place.unwrap_or_default();
        for fault in &loaded.faults {
            self.host.log(LogLevel::Warning, &format!("{place}: {fault}"));
        }
        let more = loaded.left_out.saturating_sub(loaded.faults.len());
        if more > 0 {
            self.host.log(LogLevel::Warning, &format!("{place}: {more} more rows are left out"));
        }
        if loaded.histories.is_empty() && loaded.left_out > 0 {
            return Err(format!("{place}: none of {} rows is a sample", loaded.left_out));
        }
        self.laboratory = loaded.histories;
        Ok(())
    }

    fn list(&mut self, monitors: &Monitors) {
        let ids: BTreeSet<&str> =
            self.laboratory.keys().map(String::as_str).chain(monitors.equipment()).collect();
        self.equipment = ids.iter().map(|id| (*id).to_owned()).collect();
        (self.records, self.values) = (Vec::new(), Vec::new());
        for (id, equipment) in ids.iter().zip(0..) {
            let mut add = |judged: &Judged| {
                let Judged { unix_nanos, state, .. } = *judged;
                self.records.push(ChartRecord { unix_nanos, equipment, state });
                self.values.extend(axes::values(&judged.sample, judged.extras));
            };
            let laboratory = self.laboratory.get(*id).map_or(&[][..], Vec::as_slice);
            let mut left = laboratory;
            for measured in monitors.history(id) {
                let earlier = left.partition_point(|one| one.unix_nanos <= measured.unix_nanos);
                let (before, after) = left.split_at(earlier);
                before.iter().for_each(&mut add);
                add(measured);
                left = after;
            }
            left.iter().for_each(add);
        }
        self.revision += 1;
    }

    /// Returns the reason why the file could not be read the last time.
    pub(crate) fn fault(&self) -> Option<&str> {
        self.fault.as_deref()
    }

    /// Returns the records that are read now.
    pub(crate) fn records(&self) -> ChartRecords<'_> {
        let Self { revision, records, values, .. } = self;
        ChartRecords { revision: *revision, records, values }
    }

    /// The last samples of a transformer that are not after an instant, the oldest first.
    pub(crate) fn recent<'a>(
        &'a self,
        monitors: &'a Monitors,
        equipment: &str,
        unix_nanos: i64,
    ) -> Vec<&'a Judged> {
        let own = self.laboratory.get(equipment).map_or(&[][..], Vec::as_slice);
        let known = own.partition_point(|judged| judged.unix_nanos <= unix_nanos);
        let measured = monitors.history(equipment).rev();
        let measured = measured.filter(|judged| judged.unix_nanos <= unix_nanos);
        let mut recent: Vec<&Judged> = own[..known]
            .iter()
            .rev()
            .take(MAX_TRAIL + 1)
            .chain(measured.take(MAX_TRAIL + 1))
            .collect();
        recent.sort_by_key(|judged| judged.unix_nanos);
        recent.split_off(recent.len().saturating_sub(MAX_TRAIL + 1))
    }

    /// Axes, legend and transformers.
    pub(crate) fn describe(&self) -> ChartDescription {
        let fleet = self.settings.fleet.as_ref();
        let days = fleet.map_or(MONITORED_DAYS, |fleet| fleet.valid_days);
        ChartDescription {
            name: "Dissolved gases".into(),
            axes: axes::axes(self.settings.age.into()),
            legend: axes::legend(),
            equipment: self.equipment.clone(),
            valid_seconds: u64::from(days) * 86_400,
        }
    }
}
