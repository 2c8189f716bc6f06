//! Monitors of dissolved gases: tags of any adapter, bound to transformers.
//!
//! What rests on a gas that is not good is not judged, and says so: a verdict never looks
//! better than its worst gas.

use std::collections::{HashMap, HashSet, VecDeque};
use std::time::{Duration, Instant};

use busbar_plugin_sdk::{
    Binding, Canvas, Error, Judgment, LegendEntry, Severity, TagValue, VerdictSeverity,
};
use dga::Sample;
use dga::c57_104::Status;

use crate::axes;
use crate::judged::Judged;
use crate::monitor::{Monitor, MonitorJudgment, not_judged};
use crate::settings::{MAX_MONITORS, Settings, default_minutes};
use crate::verdict::{NORMAL, NOT_JUDGED, WATCH};

/// Samples that are kept of all monitors, and of one at most and at least; the oldest go.
const MAX_KEPT: usize = 200_000;
const MAX_KEPT_EACH: usize = 2_000;
const MIN_KEPT_EACH: usize = 4;
/// Samples of one monitor are no nearer to each other, nanoseconds: a gas at a limit would
/// fill the history otherwise.
const MIN_GAP: i64 = 1_000_000_000;
const NANOS_PER_MINUTE: f64 = 60e9;
/// Without a frame for so long, nothing is known of tags any more.
const MAX_SILENCE: Duration = Duration::from_secs(5);

/// Monitors of all transformers.
pub(crate) struct Monitors {
    settings: Settings,
    gap_nanos: i64,
    equipment: Vec<String>,
    histories: HashMap<String, VecDeque<Judged>>,
    /// One for each of the equipment.
    list: Vec<Monitor>,
    findings: Vec<String>,
    /// The last frame, and its instant.
    drawn: Option<(Instant, i64)>,
    revision: u64,
    /// Samples that are kept of each.
    room: usize,
}

impl Monitors {
    pub(crate) fn from_settings(settings: &Settings) -> Result<Self, Error> {
        let monitors = settings.monitors.as_ref();
        let mut equipment = monitors.map_or_else(Vec::new, |monitors| monitors.equipment.clone());
        let mut known = HashSet::new();
        equipment.retain(|id| known.insert(id.clone()));
        let minutes = monitors.map_or_else(default_minutes, |monitors| monitors.record_minutes);
        let is_usable = (0.01..=10_080.0).contains(&minutes) && equipment.len() <= MAX_MONITORS;
        if !is_usable {
            let text = "monitors: 0.01 to 10,080 minutes and at most 10,000 transformers";
            return Err(Error::settings(text.to_owned()));
        }
        let mut own = Self {
            settings: settings.clone(),
            gap_nanos: (minutes * NANOS_PER_MINUTE) as i64,
            equipment,
            histories: HashMap::new(),
            list: Vec::new(),
            findings: Vec::new(),
            drawn: None,
            revision: 0,
            room: MAX_KEPT_EACH,
        };
        own.configure(&[]);
        own.findings.clear();
        Ok(own)
    }

    /// Grows with every sample.
    pub(crate) fn revision(&self) -> u64 {
        self.revision
    }

    /// Ids of the transformers.
    pub(crate) fn equipment(&self) -> impl Iterator<Item = &str> {
        self.equipment.iter().map(String::as_str)
    }

    /// Returns the samples that the monitor of a transformer measured, the oldest first.
    pub(crate) fn history(&self, equipment: &str) -> impl DoubleEndedIterator<Item = &Judged> {
        self.histories.get(equipment).into_iter().flatten()
    }

    /// The legend, as an overlay has it.
    pub(crate) fn legend(&self) -> Vec<LegendEntry> {
        let entry = |state: busbar_plugin_sdk::ChartState| LegendEntry {
            name: state.name,
            color: state.color,
            pattern: state.pattern,
        };
        axes::legend().into_iter().map(entry).collect()
    }

    /// Returns the findings about the bindings, for `busbar check`.
    pub(crate) fn findings(&self) -> &[String] {
        &self.findings
    }

    pub(crate) fn configure(&mut self, bindings: &[Binding]) {
        let mut own: HashMap<&str, Vec<usize>> = HashMap::new();
        for (index, binding) in bindings.iter().enumerate() {
            own.entry(&binding.node_id).or_default().push(index);
        }
        let untelemetered = self.settings.monitors.iter().flat_map(|of| &of.untelemetered);
        let untelemetered: HashSet<&String> = untelemetered.collect();
        let mut findings = Vec::new();
        let monitor = |id: &String| {
            let own = own.get(id.as_str()).map_or(&[][..], Vec::as_slice);
            Monitor::new(id, untelemetered.contains(id), (bindings, own), &mut findings)
        };
        self.list = self.equipment.iter().map(monitor).collect();
        self.findings = findings;
        let bound = self.list.iter().filter(|monitor| monitor.node.is_some()).count();
        self.room = (MAX_KEPT / bound.max(1)).clamp(MIN_KEPT_EACH, MAX_KEPT_EACH);
    }

    /// Ends the judgment of the last samples where no frame came for long.
    pub(crate) fn note_silence(&mut self, now: Instant) {
        let Some((drawn, unix_nanos)) = self.drawn else { return };
        let silent = now.saturating_duration_since(drawn);
        if silent < MAX_SILENCE {
            return;
        }
        self.drawn = None;
        let nanos = i64::try_from(silent.as_nanos()).unwrap_or(i64::MAX);
        let doubt = "not judged: no frames came";
        for monitor in self.list.iter_mut().filter(|monitor| monitor.node.is_some()) {
            monitor.last = None;
            let now = not_judged(unix_nanos.saturating_add(nanos), Sample::new(), doubt);
            keep(self.histories.entry(monitor.id.clone()).or_default(), now, self.room);
            self.revision += 1;
        }
    }

    /// Judges what the tags say now, keeps it, and shows it.
    pub(crate) fn draw(
        &mut self,
        values: &[TagValue],
        unix_nanos: i64,
        canvas: &mut Canvas<'_>,
    ) -> Result<(), Error> {
        self.drawn = Some((Instant::now(), unix_nanos));
        for (place, monitor) in self.list.iter_mut().enumerate() {
            let of = monitor.judge(values, unix_nanos, &self.settings);
            let basis = canvas.basis(of.basis.iter().copied())?;
            let MonitorJudgment { verdict, reason, assumption, .. } = &of;
            let severity =
                VerdictSeverity::from_bounds(of.least == Status::Three, of.most == Status::Three);
            let judgment = Judgment { verdict: *verdict, severity, reason, assumption };
            canvas.judge(place, basis, &judgment)?;
            let (Some(node), Some(binding)) = (monitor.node, of.line_binding) else { continue };
            let now = of.judged;
            let severity = match (now.state, of.least) {
                (NOT_JUDGED, Status::Three) => Severity::Alarm,
                (NORMAL, _) => Severity::Normal,
                (NOT_JUDGED | WATCH, _) => Severity::Warning,
                _ => Severity::Alarm,
            };
            canvas.state_on(of.state_basis, place, now.state as usize)?;
            canvas.line(binding, node, severity, "Gases in oil", &of.told)?;
            let history = self.histories.entry(monitor.id.clone()).or_default();
            if is_news(history.back(), &now, self.gap_nanos) {
                keep(history, now, self.room);
                self.revision += 1;
            }
        }
        Ok(())
    }
}

fn keep(history: &mut VecDeque<Judged>, judged: Judged, room: usize) {
    while history.len() >= room {
        history.pop_front();
    }
    history.push_back(judged);
}

/// Reports whether a sample goes into the history after the last one there. A clock that was set
/// back adds nothing until it is where it was.
fn is_news(last: Option<&Judged>, now: &Judged, gap_nanos: i64) -> bool {
    let Some(last) = last else { return true };
    let since = now.unix_nanos.saturating_sub(last.unix_nanos);
    let is_other = now.sample != last.sample || now.doubt.is_some() != last.doubt.is_some();
    is_other && since >= if now.state == last.state { gap_nanos } else { MIN_GAP }
}
