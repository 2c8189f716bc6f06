//! Seeded walk of a live site: values, faults, gaps, hidden layers, reloads and killed processes.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_types::{DoublePoint, Quality, Reason, Value};
use busbar_viewer::reload::PreparedReload;
use busbar_viewer::{AlarmAction, AlarmState, HostTagValue, RendererOptions, Stats, Viewer};
use e2e::Scene;
use fastrand::Rng;
use rustix::process::{Pid, Signal, kill_process};

use crate::oracle::{Expected, PIECES, expected};
use crate::station::{
    FRESHNESS_SECONDS, Kind, OVERLAYS, TAGS, TagCase, Variant, alarm_of, configure,
};

const SIZE: [u32; 2] = [64, 48];
/// Longest wait for the verdicts that a step asks for: processes start anew meanwhile.
const PATIENCE: Duration = Duration::from_secs(30);
/// Pause between two frames.
const FRAME: Duration = Duration::from_millis(10);

/// Fault of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    Bad,
    Uncertain,
    /// Bad quality without a value.
    NoValue,
    NotFinite,
    /// Value of another type than the tag's.
    WrongKind,
    /// Good value that no plugin may believe.
    Implausible,
    /// Nothing is sent any more.
    Gap,
}

/// Input as it is sent.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sent {
    /// No value was sent yet.
    Nothing,
    Good(f64),
    Faulty(f64, Fault),
}

impl Sent {
    fn known(self) -> Option<f64> {
        match self {
            Self::Good(value) => Some(value),
            Self::Nothing | Self::Faulty(..) => None,
        }
    }
}

/// Verdicts that the walk asked for.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counts {
    pub(crate) normal: u64,
    pub(crate) abnormal: u64,
    pub(crate) unknown: u64,
}

/// Site with its inputs, and what the walk knows of it.
pub(crate) struct Walk {
    seed: u64,
    dice: Rng,
    scene: Scene,
    viewer: Viewer,
    variant: Variant,
    sent: Vec<Sent>,
    started: Instant,
    /// Last known verdict on each piece, abnormal or not.
    last_known: BTreeMap<(String, String), bool>,
    counts: Counts,
    /// Steps so far, for messages.
    log: Vec<String>,
}

impl Walk {
    /// Opens a site whose tags have no value yet.
    pub(crate) fn begin(seed: u64) -> Self {
        let mut scene = Scene::demo(1);
        OVERLAYS.iter().for_each(|overlay| scene.add_plugin(overlay));
        let variant = Variant::default();
        configure(&mut scene, variant);
        let loaded = LoadedScene::load(&scene.write(), &|_, _, _| {});
        let loaded = loaded.unwrap_or_else(|error| panic!("{error}"));
        let options = RendererOptions { samples: 1, ..RendererOptions::default() };
        let viewer = Viewer::new_offscreen(loaded, options, SIZE).expect("there is a device");
        Self {
            seed,
            dice: Rng::with_seed(seed),
            scene,
            viewer,
            variant,
            sent: vec![Sent::Nothing; TAGS.len()],
            started: Instant::now(),
            last_known: BTreeMap::new(),
            counts: Counts::default(),
            log: Vec::new(),
        }
    }

    /// Walks so many steps; returns what they asked for.
    pub(crate) fn run(mut self, steps: u64) -> Counts {
        self.settle();
        for _ in 0..steps {
            match self.dice.u32(..10) {
                0..4 => self.send_values(),
                4..6 => self.break_inputs(),
                6 => self.open_gap(),
                7 => self.toggle_layer(),
                8 => self.reload(),
                _ => self.kill(),
            }
            self.settle();
        }
        self.counts
    }

    /// Sends random good values for some tags.
    fn send_values(&mut self) {
        let mut text = "values".to_owned();
        for (tag, sent) in TAGS.iter().zip(&mut self.sent) {
            if *sent == Sent::Nothing || self.dice.u32(..3) == 0 {
                *sent = Sent::Good(self.dice.choice(tag.grid.iter().copied()).expect("a value"));
                text += &format!(" {}={sent:?}", tag.id);
            }
        }
        self.log.push(text);
        self.send();
    }

    /// Gives some tags a fault. Of what the host itself sees nothing is normal in the very frame.
    fn break_inputs(&mut self) {
        let faults =
            [Fault::Bad, Fault::Uncertain, Fault::NoValue, Fault::NotFinite, Fault::WrongKind];
        let mut text = "faults".to_owned();
        let mut is_seen_by_host = true;
        for (tag, sent) in TAGS.iter().zip(&mut self.sent) {
            if self.dice.u32(..6) > 0 {
                continue;
            }
            let value = match *sent {
                Sent::Nothing => tag.grid[0],
                Sent::Good(value) | Sent::Faulty(value, _) => value,
            };
            let fault = match tag.implausible {
                Some(_) if self.dice.u32(..4) == 0 => Fault::Implausible,
                _ => self.dice.choice(faults).expect("a fault"),
            };
            is_seen_by_host &= fault != Fault::Implausible;
            *sent = Sent::Faulty(value, fault);
            text += &format!(" {}={sent:?}", tag.id);
        }
        self.log.push(text);
        self.send();
        let stats = self.frame();
        if is_seen_by_host {
            self.assert_none_is_normal_without_cause(&stats, "in the very frame");
        }
    }

    /// Sends no value of a tag any more.
    fn open_gap(&mut self) {
        let index = self.dice.usize(..TAGS.len());
        if let Sent::Good(value) = self.sent[index] {
            self.log.push(format!("gap {}", TAGS[index].id));
            self.sent[index] = Sent::Faulty(value, Fault::Gap);
            let end = Instant::now() + Duration::from_secs_f64(FRESHNESS_SECONDS + 0.1);
            while Instant::now() < end {
                self.send();
                self.frame();
                std::thread::sleep(FRAME);
            }
            let stats = self.frame();
            self.assert_none_is_normal_without_cause(&stats, "after a gap");
        }
    }

    /// Hides or shows the layer of an overlay.
    fn toggle_layer(&mut self) {
        let overlay = self.dice.choice(OVERLAYS).expect("an overlay");
        let shows = self.dice.bool();
        self.log.push(format!("layer {overlay} {shows}"));
        assert!(self.viewer.set_layer_shown(overlay, shows), "{overlay} is a layer");
    }

    /// Loads a configuration with other settings, or with the same and other things around them.
    fn reload(&mut self) {
        let before = self.variant;
        match self.dice.u32(..4) {
            0 => self.variant.is_tolerant = !before.is_tolerant,
            1 => self.variant.has_more = !before.has_more,
            2 => {
                let other = self.dice.usize(..OVERLAYS.len());
                self.variant.in_process = Some(other).filter(|_| before.in_process.is_none());
            }
            _ => self.variant.size = 1 - before.size,
        }
        self.log.push(format!("reload {:?}", self.variant));
        configure(&mut self.scene, self.variant);
        let path = self.scene.write();
        let reload = PreparedReload::load(self.viewer.scene(), &path);
        let reload = reload.unwrap_or_else(|error| panic!("{error}")).expect("something changed");
        self.viewer.apply_reload(reload).expect("the device is there");
        let stats = self.frame();
        // Old thresholds may have let pass what the new ones do not, and hold no more.
        self.assert_none_is_normal_without_cause(&stats, "in the frame of a reload");
    }

    /// Kills the process of an overlay.
    fn kill(&mut self) {
        let overlay = self.dice.choice(OVERLAYS).expect("an overlay");
        let stats = self.viewer.stats();
        let pid = stats.plugins.iter().find(|plugin| plugin.name == overlay);
        let Some(pid) = pid.and_then(|plugin| plugin.pid) else { return };
        self.log.push(format!("kill {overlay}"));
        let pid = Pid::from_raw(pid.cast_signed()).expect("a process");
        // It may just have been started again.
        let _ = kill_process(pid, Signal::KILL);
    }

    /// Sends all inputs as they are, except for gaps.
    fn send(&mut self) {
        for (tag, sent) in TAGS.iter().zip(&self.sent) {
            let Some((value, quality)) = content(tag, *sent) else { continue };
            let value = HostTagValue { value, quality, source_time: None, waited: Duration::ZERO };
            self.viewer.set_tag(tag.id, value).expect("it is the host's tag");
        }
    }

    /// Draws a frame and checks what holds in every one.
    fn frame(&mut self) -> Stats {
        let input = self.viewer.headless_input(self.started.elapsed().as_secs_f64());
        self.viewer.frame(input).expect("a frame is drawn");
        let stats = self.viewer.stats();
        self.check_alarms(&stats);
        stats
    }

    /// Checks each alarm: active exactly while the last known verdict is abnormal.
    fn check_alarms(&mut self, stats: &Stats) {
        let states: BTreeMap<&str, AlarmState> =
            stats.alarms.iter().map(|alarm| (alarm.id.as_str(), alarm.state)).collect();
        for verdict in &stats.verdicts {
            let key = (verdict.overlay.clone(), verdict.equipment.clone());
            match verdict.verdict {
                "normal" => drop(self.last_known.insert(key.clone(), false)),
                "abnormal" => drop(self.last_known.insert(key.clone(), true)),
                _ => {}
            }
        }
        for ((overlay, equipment), is_abnormal) in &self.last_known {
            let id = format!("{}:{equipment}", alarm_of(overlay));
            let state = states.get(id.as_str()).copied().unwrap_or(AlarmState::Normal);
            let is_active = matches!(state, AlarmState::Unacknowledged | AlarmState::Acknowledged);
            assert_eq!(is_active, *is_abnormal, "alarm {id} is {state:?}: {}", self.story());
        }
        // An operator sees some of them.
        let unacknowledged = states.iter().find(|(_, state)| state.is_unacknowledged());
        if let Some((id, _)) = unacknowledged.filter(|_| self.dice.u32(..8) == 0) {
            let acknowledged =
                self.viewer.act_on_alarm(id, AlarmAction::Acknowledge, "A. Operator");
            acknowledged.expect("it waits for that");
        }
    }

    fn expected(&self, piece: &str) -> Expected {
        let known = |tag: &str| {
            let index = TAGS.iter().position(|case| case.id == tag);
            self.sent[index.expect("there is such a tag")].known()
        };
        expected(piece, &known, self.variant)
    }

    fn assert_none_is_normal_without_cause(&self, stats: &Stats, when: &str) {
        for (overlay, piece) in PIECES {
            let (verdict, reason) = verdict(stats, overlay, piece);
            let expected = self.expected(piece);
            let is_silent = expected.forbids_normal() && verdict == "normal";
            assert!(!is_silent, "{piece} is normal ({reason}) {when}: {}", self.story());
        }
    }

    /// Draws frames until every piece has the verdict that its inputs ask for.
    fn settle(&mut self) {
        let start = Instant::now();
        loop {
            self.send();
            let stats = self.frame();
            let wrong = PIECES.into_iter().find_map(|(overlay, piece)| {
                let (verdict, reason) = verdict(&stats, overlay, piece);
                let expected = self.expected(piece);
                (!expected.allows(&verdict)).then(|| {
                    format!("{piece} of {overlay} is {verdict} ({reason}), and not {expected:?}")
                })
            });
            let Some(wrong) = wrong else { break };
            assert!(start.elapsed() < PATIENCE, "{wrong}: {}", self.story());
            std::thread::sleep(FRAME);
        }
        for (_, piece) in PIECES {
            match self.expected(piece) {
                Expected::Normal => self.counts.normal += 1,
                Expected::Abnormal => self.counts.abnormal += 1,
                Expected::Unknown => self.counts.unknown += 1,
                Expected::NotNormal | Expected::Any => {}
            }
        }
    }

    /// Tells the last steps, and the inputs as they are.
    fn story(&self) -> String {
        let from = self.log.len().saturating_sub(6);
        let inputs: Vec<String> =
            TAGS.iter().zip(&self.sent).map(|(tag, sent)| format!("{}={sent:?}", tag.id)).collect();
        format!(
            "seed {}, step {}\n{}\n{}",
            self.seed,
            self.log.len(),
            self.log[from..].join("\n"),
            inputs.join(" ")
        )
    }
}

/// Returns value and quality as a host program sends them; none in a gap.
fn content(tag: &TagCase, sent: Sent) -> Option<(Option<Value>, Quality)> {
    let of = |value: f64| match tag.kind {
        Kind::Number => Value::F64(value),
        Kind::Bool => Value::Bool(value > 0.0),
        Kind::DoublePoint => Value::DoublePoint(match value {
            1.0 => DoublePoint::Off,
            2.0 => DoublePoint::On,
            _ => DoublePoint::BadState,
        }),
    };
    let (value, fault) = match sent {
        Sent::Nothing => return None,
        Sent::Good(value) => return Some((Some(of(value)), Quality::Good)),
        Sent::Faulty(value, fault) => (value, fault),
    };
    Some(match fault {
        Fault::Gap => return None,
        Fault::Bad => (Some(of(value)), Quality::Bad(Reason::Sensor)),
        Fault::Uncertain => (Some(of(value)), Quality::Uncertain(Reason::Sensor)),
        Fault::NoValue => (None, Quality::Bad(Reason::Communication)),
        Fault::NotFinite => (Some(Value::F64(f64::NAN)), Quality::Good),
        Fault::WrongKind => {
            let other = match tag.kind {
                Kind::Number => Value::Bool(true),
                Kind::Bool | Kind::DoublePoint => Value::F64(0.5),
            };
            (Some(other), Quality::Good)
        }
        Fault::Implausible => (tag.implausible.map(of), Quality::Good),
    })
}

/// Returns the verdict on a piece and its reason; a piece without any is unknown.
fn verdict(stats: &Stats, overlay: &str, piece: &str) -> (String, String) {
    let found = stats.verdicts.iter().find(|of| of.overlay == overlay && of.equipment == piece);
    found.map_or_else(
        || ("unknown".to_owned(), "not described".to_owned()),
        |of| (of.verdict.to_owned(), of.reason.clone()),
    )
}
