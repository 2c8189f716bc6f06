//! Monitors of dissolved gases: tags of any adapter, bound to transformers.
//!
//! What rests on a gas that is not good is not judged, and says so: a verdict never looks
//! better than its worst gas.

use std::collections::{HashMap, VecDeque};
use std::time::{Duration, Instant};

use busbar_plugin_sdk::{Binding, Canvas, Error, LegendEntry, Quality, Reason, Severity, TagValue};
use dga::{Concentration, Gas, Sample};

use crate::Settings;
use crate::axes;
use crate::judged::{Judged, of_monitor};
use crate::source::EXTRAS;
use crate::verdict::{self, NORMAL, NOT_JUDGED, WATCH};

/// Before the formula of a gas in lower case, the role of its tag: `gas_h2`, in ppm.
const ROLE: &str = "gas_";
/// Transformers with a monitor.
const MAX_MONITORS: usize = 10_000;
/// Samples that are kept of all monitors, and of one at most and at least; the oldest go.
const MAX_KEPT: usize = 200_000;
const MAX_KEPT_EACH: usize = 2_000;
const MIN_KEPT_EACH: usize = 4;
/// Samples of one monitor are no nearer to each other, nanoseconds: a gas at a limit would
/// fill the history otherwise.
const MIN_GAP: i64 = 1_000_000_000;
const NANOS_PER_MINUTE: f64 = 60e9;
/// Without a frame for so long, nothing is known of tags any more: the overlay is hidden.
const MAX_SILENCE: Duration = Duration::from_secs(5);

/// Transformers with a monitor, whose gases are bound to them in the roles `gas_h2`, `gas_ch4`,
/// `gas_c2h6`, `gas_c2h4`, `gas_c2h2`, `gas_co`, `gas_co2`, `gas_o2` and `gas_n2` (ppm), and
/// perhaps `gas_top_oil` (°C) and `gas_load` (per unit).
#[derive(Clone, Debug, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct MonitorSettings {
    /// Ids of the transformers.
    #[schemars(length(max = MAX_MONITORS))]
    pub(crate) equipment: Vec<String>,
    /// Minutes from one sample of the history to the next, where the verdict stays the same.
    #[serde(default = "default_minutes")]
    #[schemars(range(min = 0.01, max = 10_080.0))]
    pub(crate) record_minutes: f64,
}

/// Monitors measure a few times a day.
fn default_minutes() -> f64 {
    60.0
}

/// All monitors.
pub(crate) struct Monitors {
    settings: Settings,
    gap_nanos: i64,
    equipment: Vec<String>,
    histories: HashMap<String, VecDeque<Judged>>,
    list: Vec<Monitor>,
    /// The last frame, and its instant.
    drawn: Option<(Instant, i64)>,
    revision: u64,
    /// Samples that are kept of each.
    room: usize,
}

/// The tags of one transformer.
struct Monitor {
    id: String,
    node: u32,
    /// Among those described.
    place: usize,
    /// Binding of each gas.
    gases: Vec<(Gas, usize)>,
    /// Likewise of [`EXTRAS`].
    extras: [Option<usize>; EXTRAS.len()],
    /// What was judged last, and what is said of it.
    last: Option<(Judged, String)>,
}

impl Monitors {
    pub(crate) fn of(settings: &Settings) -> Result<Self, Error> {
        let monitors = settings.monitors.as_ref();
        let equipment = monitors.map_or_else(Vec::new, |monitors| monitors.equipment.clone());
        let minutes = monitors.map_or_else(default_minutes, |monitors| monitors.record_minutes);
        let is_usable = (0.01..=10_080.0).contains(&minutes) && equipment.len() <= MAX_MONITORS;
        if !is_usable {
            let text = "monitors: 0.01 to 10,080 minutes and at most 10,000 transformers";
            return Err(Error::settings(text.to_owned()));
        }
        Ok(Self {
            settings: settings.clone(),
            gap_nanos: (minutes * NANOS_PER_MINUTE) as i64,
            equipment,
            histories: HashMap::new(),
            list: Vec::new(),
            drawn: None,
            revision: 0,
            room: MAX_KEPT_EACH,
        })
    }

    /// Grows with every sample.
    pub(crate) fn revision(&self) -> u64 {
        self.revision
    }

    /// Ids of the transformers.
    pub(crate) fn equipment(&self) -> impl Iterator<Item = &str> {
        self.equipment.iter().map(String::as_str)
    }

    /// What the monitor of a transformer measured, the oldest first.
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

    pub(crate) fn configure(&mut self, bindings: &[Binding]) {
        self.list.clear();
        for (place, id) in self.equipment.iter().enumerate() {
            let own = || bindings.iter().enumerate().filter(|(_, one)| one.node_id == *id);
            let Some((_, first)) = own().next() else { continue };
            let in_role = |name: &str| {
                let is_it = |role: &str| {
                    role.strip_prefix(ROLE).is_some_and(|rest| rest.eq_ignore_ascii_case(name))
                };
                own().find(|(_, binding)| is_it(&binding.role)).map(|(index, _)| index)
            };
            let gases = Gas::ALL.into_iter();
            let gases: Vec<_> =
                gases.filter_map(|gas| Some((gas, in_role(gas.formula())?))).collect();
            if gases.is_empty() {
                continue;
            }
            let extras = EXTRAS.map(in_role);
            let (id, node) = (id.clone(), first.node);
            self.list.push(Monitor { id, node, place, gases, extras, last: None });
        }
        let room = MAX_KEPT / self.list.len().max(1);
        self.room = room.clamp(MIN_KEPT_EACH, MAX_KEPT_EACH);
    }

    /// Where no frame came for long, what was measured last does not go on being judged.
    pub(crate) fn note_silence(&mut self, now: Instant) {
        let Some((drawn, unix_nanos)) = self.drawn else { return };
        let silent = now.saturating_duration_since(drawn);
        if silent < MAX_SILENCE {
            return;
        }
        self.drawn = None;
        let nanos = i64::try_from(silent.as_nanos()).unwrap_or(i64::MAX);
        let doubt = "not judged: its overlay is not shown";
        for monitor in &mut self.list {
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
        for monitor in &mut self.list {
            let (now, binding, told) = monitor.judge(values, unix_nanos, &self.settings);
            let severity = match now.state {
                NORMAL => Severity::Normal,
                NOT_JUDGED | WATCH => Severity::Warning,
                _ => Severity::Alarm,
            };
            let rests_on = monitor.gases.iter().map(|(_, binding)| *binding);
            canvas.state_on(rests_on, monitor.place, now.state as usize)?;
            canvas.line(binding, monitor.node, severity, "Gases in oil", &told)?;
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

fn not_judged(unix_nanos: i64, sample: Sample, doubt: &str) -> Judged {
    Judged {
        unix_nanos,
        sample,
        extras: [f32::NAN; EXTRAS.len()],
        status: None,
        state: NOT_JUDGED,
        is_online: true,
        doubt: Some(doubt.into()),
    }
}

/// Whether a sample goes into the history after the last one there. A clock that was set
/// back adds nothing until it is where it was.
fn is_news(last: Option<&Judged>, now: &Judged, gap_nanos: i64) -> bool {
    let Some(last) = last else { return true };
    let since = now.unix_nanos.saturating_sub(last.unix_nanos);
    let is_other = now.sample != last.sample || now.doubt.is_some() != last.doubt.is_some();
    is_other && since >= if now.state == last.state { gap_nanos } else { MIN_GAP }
}

impl Monitor {
    /// What the tags say now, the binding that it is told at, and what is told.
    fn judge(
        &mut self,
        values: &[TagValue],
        unix_nanos: i64,
        settings: &Settings,
    ) -> (Judged, usize, String) {
        let mut sample = Sample::new();
        let mut doubts = Vec::new();
        for &(gas, binding) in &self.gases {
            match measured(&values[binding]) {
                Ok(concentration) => sample = sample.with(gas, concentration),
                Err(why) => doubts.push((gas, binding, why)),
            }
        }
        let good = |binding: Option<usize>| binding.and_then(|at| values[at].good_number());
        let extras = self.extras.map(|binding| good(binding).map_or(f32::NAN, |n| n as f32));
        if let Some((gas, binding, why)) = doubts.first() {
            let more = match doubts.len() {
                1 => String::new(),
                count => format!(" and {} more", count - 1),
            };
            let told = format!("not judged: {} {why}{more}", gas.formula());
            self.last = None;
            let judged = Judged { extras, ..not_judged(unix_nanos, sample, &told) };
            return (judged, *binding, told);
        }
        let binding = self.gases[0].1;
        match &self.last {
            // Most frames bring the values of the frame before.
            Some((judged, told)) if judged.sample == sample => {
                (Judged { unix_nanos, extras, ..judged.clone() }, binding, told.clone())
            }
            _ => {
                let (judged, judgement) = of_monitor(unix_nanos, (sample, extras), settings);
                let told = verdict::in_short(judged.status, &judgement);
                self.last = Some((judged.clone(), told.clone()));
                (judged, binding, told)
            }
        }
    }
}

/// A gas as its tag has it, or why it does not count.
fn measured(value: &TagValue) -> Result<Concentration, String> {
    let age = in_words(value.age);
    match value.quality {
        Quality::Good => {
            let ppm = value.good_number().ok_or("is no finite number")?;
            Concentration::measured(ppm).map_err(|error| error.to_string())
        }
        _ if value.value.is_none() => Err("has no value yet".into()),
        Quality::Bad(Reason::Stale) => Err(format!("stale for {age}")),
        Quality::Uncertain(_) => Err(format!("uncertain, {age} old")),
        Quality::Bad(_) => Err(format!("bad, last good {age} ago")),
    }
}

fn in_words(age: Duration) -> String {
    match age.as_secs() {
        seconds if seconds < 120 => format!("{seconds} s"),
        seconds if seconds < 7200 => format!("{} min", seconds / 60),
        seconds if seconds < 172_800 => format!("{} h", seconds / 3600),
        seconds => format!("{} d", seconds / 86_400),
    }
}
