//! Transformer with its state over the scene's time, seen and unseen.

use std::borrow::Cow;
use std::ops::Range;

use busbar_plugin_sdk::{Origin, StoredState, TagValue};

use crate::ageing::Paper;
use crate::assessment::Estimate;
use crate::inputs::Inputs;
use crate::interval::Interval;
use crate::loss_of_life::LossOfLife;
use crate::operating_point::{OperatingPoint, Plausible, Reader};
use crate::settings::{Settings, TransformerSettings};
use crate::temperature_band::{CoolingStage, Drive, TemperatureBand};

const NANOS_A_MINUTE: f64 = 60e9;

/// State that is kept across restarts.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct State {
    /// Scene time of the state, nanoseconds since 1970-01-01 UTC.
    pub(crate) unix_nanos: i64,
    pub(crate) band: TemperatureBand,
    /// Hot spot as it was last estimated, degrees Celsius.
    pub(crate) hot_spot: Interval,
    /// Last load that was known, per unit.
    pub(crate) last_load: Option<f64>,
    /// Origins of its values that are of another plant than the real one.
    #[serde(default)]
    pub(crate) unreal: u8,
    pub(crate) life: LossOfLife,
}

/// State of a transformer, and the parameters that it belongs to.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Entry {
    pub(crate) parameters: String,
    pub(crate) state: State,
}

impl StoredState for Entry {
    fn is_plausible(&self) -> bool {
        self.state.is_plausible()
    }
}

impl State {
    /// Reports whether the numbers can be those of a transformer.
    pub(crate) fn is_plausible(&self) -> bool {
        let Interval { low, high } = self.hot_spot;
        let is_ordered = low <= high && low > -1e3 && high < 1e4;
        let is_load = self.last_load.is_none_or(|load| (0.0..=10.0).contains(&load));
        is_ordered && is_load && self.band.is_plausible() && self.life.is_plausible()
    }
}

/// Transformer with its model.
pub(crate) struct Transformer {
    pub(crate) inputs: Inputs,
    /// Defaults of ours that its verdicts rest on, in words; empty for none.
    assumption: String,
    pub(crate) paper: Paper,
    stages: Vec<CoolingStage>,
    plausible: Plausible,
    longest_step: f64,
    pub(crate) state: Option<State>,
    before: Option<OperatingPoint>,
    /// Reports whether time up to the next frame was not seen.
    is_resumed: bool,
    /// Origins of the values used last that are of another plant than the real one.
    unreal: u8,
    /// Words for the input that was unknown last.
    pub(crate) last_doubt: String,
}

impl Transformer {
    pub(crate) fn new(settings: &TransformerSettings, all: &Settings) -> Self {
        let [low, high] = all.plausible_ambient;
        let (fixed_ambient, _) = all.fixed_ambient();
        Self {
            inputs: Inputs::default(),
            assumption: String::new(),
            paper: settings.paper(),
            stages: settings.cooling_stages(),
            plausible: Plausible {
                load: settings.plausible_load(),
                ambient: Interval::new(low, high),
                fixed_ambient,
            },
            longest_step: all.longest_step_seconds / 60.0,
            state: None,
            before: None,
            is_resumed: true,
            unreal: 0,
            last_doubt: "its load before the first value was not seen".to_owned(),
        }
    }

    /// Takes the tags that it is bound to; what it was is kept.
    pub(crate) fn bind(&mut self, inputs: Inputs, assumptions: &[String]) {
        self.inputs = inputs;
        self.assumption = assumptions.join(", ");
        self.before = None;
        self.is_resumed = true;
    }

    /// Defaults that a verdict rests on: where the history is not known well and the settings
    /// tell no plausible load, that is one of them.
    pub(crate) fn assumption(&self, is_history_settled: bool) -> Cow<'_, str> {
        if is_history_settled {
            return Cow::Borrowed(&self.assumption);
        }
        let Interval { low, high } = self.plausible.load;
        let load = format!("load not seen {low} to {high} p.u.");
        match self.assumption.is_empty() {
            true => Cow::Owned(load),
            false => Cow::Owned(format!("{load}, {}", self.assumption)),
        }
    }

    /// Identifies the parameters that a state belongs to.
    pub(crate) fn fingerprint(&self) -> String {
        let stage = |of: &CoolingStage| format!("{:?} {}", of.parameters, of.rated_share);
        let stages: Vec<_> = self.stages.iter().map(stage).collect();
        stages.join("; ")
    }

    /// Moves on to the instant of a frame, and estimates the temperatures then.
    pub(crate) fn advance(
        &mut self,
        now: i64,
        settings: &TransformerSettings,
        values: &[TagValue],
    ) -> (OperatingPoint, Estimate) {
        let last_load = self.state.and_then(|state| state.last_load);
        let reader = Reader { settings, inputs: &self.inputs, values, plausible: self.plausible };
        let point = reader.read(last_load);
        self.restart_after_other_origin(&point, values);
        let (mut state, is_seen) = self.state_at(now, &point);
        let estimate = Estimate::new(&mut state.band, &point, settings.disagreement);
        state.life.count(now, &self.paper, [state.hot_spot, estimate.hot_spot], is_seen);
        state.hot_spot = estimate.hot_spot;
        if point.is_load_measured {
            state.last_load = Some(point.load.high);
        }
        if let Some(doubt) = point.doubts.first() {
            self.last_doubt.clone_from(doubt);
        }
        self.state = Some(state);
        self.before = Some(point.clone());
        self.is_resumed = false;
        (point, estimate)
    }

    /// Begins the history anew where live values follow simulated, recorded or test ones, or the
    /// other way round: it is one of another plant.
    fn restart_after_other_origin(&mut self, point: &OperatingPoint, values: &[TagValue]) {
        let origins = point.used.iter().filter_map(|binding| values.get(*binding));
        let origins = origins.map(|value| value.origin.unreal()).reduce(Origin::union);
        let Some(unreal) = origins.map(Origin::bits).filter(|unreal| *unreal != self.unreal) else {
            return;
        };
        self.unreal = unreal;
        if self.state.is_some_and(|state| state.unreal != unreal) {
            self.state = None;
            self.before = None;
            self.last_doubt = "its history is of values of another origin".to_owned();
        }
    }

    /// State at an instant, and whether the time up to it was seen.
    fn state_at(&mut self, now: i64, point: &OperatingPoint) -> (State, bool) {
        let unseen = self.unseen();
        let Some(mut state) = self.state else {
            let band = unseen.steady();
            let life = LossOfLife::new(now);
            let hot_spot = band.hot_spot();
            let unreal = self.unreal;
            let state = State { unix_nanos: now, band, hot_spot, last_load: None, unreal, life };
            return (state, false);
        };
        let minutes = (now as f64 - state.unix_nanos as f64) / NANOS_A_MINUTE;
        state.unix_nanos = now;
        let is_seen = !self.is_resumed && (0.0..=self.longest_step).contains(&minutes);
        let doubt = if minutes < 0.0 {
            // The clock was set back: no time has passed, or it is a time before.
            state.band = state.band.before(-minutes, &unseen);
            if -minutes > self.longest_step {
                state.life = LossOfLife::new(now);
            }
            Some("the clock was set back".to_owned())
        } else if is_seen {
            let (load, ambient, stages) = point.since(self.before.as_ref());
            let drive = Drive { load, ambient, stages: self.stages_in(stages) };
            state.band = state.band.after(minutes, &drive);
            None
        } else {
            state.band = state.band.after(minutes, &unseen);
            Some(format!("{minutes:.0} minutes were not seen"))
        };
        if let Some(doubt) = doubt.filter(|_| minutes.abs() > self.longest_step) {
            self.last_doubt = doubt;
        }
        (state, is_seen)
    }

    /// Inputs in time that nobody saw.
    fn unseen(&self) -> Drive<'_> {
        let Plausible { load, ambient, fixed_ambient } = self.plausible;
        let last_load = self.state.and_then(|state| state.last_load).unwrap_or(load.high);
        let ambient = match self.inputs.ambient {
            Some(_) => ambient,
            None => Interval::point(fixed_ambient),
        };
        Drive {
            load: Interval::new(load.low, load.high.max(last_load)),
            ambient,
            stages: &self.stages,
        }
    }

    fn stages_in(&self, range: Range<usize>) -> &[CoolingStage] {
        self.stages.get(range).unwrap_or(&self.stages)
    }
}
