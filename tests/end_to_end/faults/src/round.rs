//! Round of fault injection: one life of a scene, from its loading to its end, with every fault in
//! it once.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use busbar_scene_loader::LoadedScene;
use busbar_viewer::{PluginStats, RendererOptions, Stats, Viewer};
use fault_injector::Fault;

use crate::injection::{
    Outcome, Phase, Record, Role, all, class_of, must_die, needs_restart, place,
};
use crate::process::children;
use crate::scene::{FaultScene, HEALTHY, TAGS, tag_of};
use crate::subject::{PluginObservation, Subject};

/// Period of frames where the machine keeps up.
const FRAME_PERIOD: Duration = Duration::from_millis(10);
const PICTURE: [u32; 2] = [64, 64];
/// Longest time from the loaded scene until every plugin has correct data.
const MAX_TO_READY: Duration = Duration::from_secs(30);
/// Longest time that closing takes: plugins that hang have 2.5 s each, side by side, and then are
/// killed.
const MAX_TO_CLOSE: Duration = Duration::from_secs(15);

/// Results of one round.
#[derive(Default)]
pub(crate) struct Round {
    pub(crate) records: Vec<Record>,
    /// Milliseconds between the ends of frames.
    pub(crate) gaps_millis: Vec<f64>,
    pub(crate) load_millis: f64,
    pub(crate) close_millis: f64,
}

/// Runs the round of this number.
pub(crate) fn run(site: &FaultScene, number: usize) -> Result<Round> {
    let mut round = Round::default();
    let mut subjects = assign_faults(site, number)?;
    let mut view = round.load(site, &mut subjects)?;
    view.wait_until_ready(&subjects)?;
    view.strike(&mut subjects, &mut round)?;
    round.close(view, &subjects, site)?;
    Ok(round)
}

/// Assigns every fault to a plugin, to another one in each round.
fn assign_faults(site: &FaultScene, number: usize) -> Result<Vec<Subject>> {
    let mut subjects: Vec<_> = site.plugins.iter().cloned().map(Subject::new).collect();
    let mut dealt: BTreeMap<(usize, bool), usize> = BTreeMap::new();
    for fault in all() {
        let (phase, roles) = place(fault);
        let fit: Vec<_> =
            (0..subjects.len()).filter(|&i| roles.contains(&subjects[i].plugin.role)).collect();
        let once = matches!(phase, Phase::Load | Phase::End);
        // Load and end have a place each at every plugin; the others queue.
        let count = dealt.entry((phase as usize, roles[0] == Role::Telemetry)).or_default();
        ensure!(!once || *count < fit.len(), "too few plugins for what strikes at {phase:?}");
        subjects[fit[(*count + number) % fit.len()]].queue.push_back(fault);
        *count += 1;
    }
    Ok(subjects)
}

fn take_phase(subject: &mut Subject, phase: Phase) -> Option<Fault> {
    let index = subject.queue.iter().position(|&fault| place(fault).0 == phase)?;
    subject.queue.remove(index)
}

impl Round {
    /// Loads the scene while faults strike.
    fn load(&mut self, site: &FaultScene, subjects: &mut [Subject]) -> Result<View> {
        let mut armed = Vec::new();
        for subject in &mut *subjects {
            let fault = take_phase(subject, Phase::Load);
            fault.map_or(Ok(()), |fault| subject.plugin.arm(fault))?;
            armed.push(fault);
        }
        let start = Instant::now();
        let scene = LoadedScene::load(&site.config(), &|_, _, _| ())?;
        self.load_millis = start.elapsed().as_secs_f64() * 1e3;
        let remarks = scene.remarks(&site.config());
        let options = RendererOptions { samples: 1, ..Default::default() };
        let mut viewer = Viewer::new_headless(scene, options, PICTURE)?;
        viewer.set_settles(false);
        let stats = viewer.stats();
        for (subject, fault) in subjects.iter().zip(armed) {
            let Some(fault) = fault else { continue };
            let name = &subject.plugin.name;
            ensure!(subject.plugin.struck().is_some(), "{name}: {fault:?} did not strike");
            let plugin = plugin(&stats, name)?;
            let remarked = remarks.iter().any(|remark| remark.contains(&plugin.plugin));
            let outcome = match &plugin.last_death {
                Some(reason) => Outcome::Died(class_of(reason)),
                None if remarked => Outcome::Refused,
                None => Outcome::Harmless,
            };
            let (died, harmless) = (plugin.deaths > 0, outcome == Outcome::Harmless);
            ensure!(died || !must_die(fault), "{name}: {fault:?} ended as {outcome:?}");
            ensure!(remarked || harmless, "{name}: nothing was said of {fault:?}, {outcome:?}");
            subject.plugin.disarm()?;
            self.record(fault, outcome);
        }
        Ok(View { viewer, last_frame: None })
    }

    /// Closes the scene while faults strike.
    fn close(&mut self, view: View, subjects: &[Subject], site: &FaultScene) -> Result<()> {
        let mut armed = Vec::new();
        for subject in subjects {
            for &fault in subject.queue.iter().filter(|&&fault| place(fault).0 == Phase::End) {
                subject.plugin.arm(fault)?;
                armed.push((subject, fault));
            }
        }
        let start = Instant::now();
        drop(view);
        let took = start.elapsed();
        ensure!(took < MAX_TO_CLOSE, "closing took {took:?}");
        self.close_millis = took.as_secs_f64() * 1e3;
        for (subject, fault) in armed {
            let name = &subject.plugin.name;
            ensure!(subject.plugin.struck().is_some(), "{name}: {fault:?} did not strike");
            self.record(fault, Outcome::Closed);
        }
        site.plugins.iter().try_for_each(|plugin| plugin.disarm())?;
        let left = children();
        ensure!(left.is_empty(), "processes {left:?} outlive the scene");
        Ok(())
    }

    fn record(&mut self, fault: Fault, outcome: Outcome) {
        let Fault { kind, at, .. } = fault;
        let (to_bad_millis, to_good_millis) = (None, None);
        self.records.push(Record { kind, at, outcome, to_bad_millis, to_good_millis });
    }
}

/// View without a window that waits between frames like one in a window.
struct View {
    viewer: Viewer,
    last_frame: Option<Instant>,
}

impl View {
    /// Draws a frame; returns the plugins before it, the tags after it, and its end.
    fn frame(&mut self) -> Result<(Stats, Stats, Instant)> {
        if let Some(last) = self.last_frame {
            std::thread::sleep(FRAME_PERIOD.saturating_sub(last.elapsed()));
        }
        let before = self.viewer.stats();
        let input = self.viewer.headless_input(0.0);
        self.viewer.frame(input)?;
        let now = Instant::now();
        self.last_frame = Some(now);
        Ok((before, self.viewer.stats(), now))
    }

    fn wait_until_ready(&mut self, subjects: &[Subject]) -> Result<()> {
        let start = Instant::now();
        loop {
            let (before, after, now) = self.frame()?;
            let mut ill = Vec::new();
            for Subject { plugin: installed, .. } in subjects {
                let is_good = is_good(&after, &installed.name, installed.role)?;
                let before = plugin(&before, &installed.name)?;
                if !(PluginObservation { before, is_good, now }).is_well() {
                    ill.push(&installed.name);
                }
            }
            if ill.is_empty() && is_good(&after, HEALTHY, Role::Telemetry)? {
                return Ok(());
            }
            ensure!(start.elapsed() < MAX_TO_READY, "not ready: {ill:?}");
        }
    }

    /// Draws until every fault has struck and every plugin is well again.
    fn strike(&mut self, subjects: &mut [Subject], round: &mut Round) -> Result<()> {
        let mut ends = Vec::new();
        for subject in &mut *subjects {
            let end = take_phase(subject, Phase::End);
            let (now, later): (Option<_>, Option<_>) = match end {
                Some(fault) if needs_restart(fault) => (Some(fault), None),
                end => (None, end),
            };
            subject.queue.extend(now);
            ends.push(later);
        }
        let mut last: Option<Instant> = None;
        while !subjects.iter().all(Subject::is_done) {
            let (before, after, now) = self.frame()?;
            if let Some(last) = last.replace(now) {
                round.gaps_millis.push((now - last).as_secs_f64() * 1e3);
            }
            let healthy = plugin(&after, HEALTHY)?;
            ensure!(
                is_good(&after, HEALTHY, Role::Telemetry)? && healthy.deaths == 0,
                "the healthy plugin suffers: {healthy:?}"
            );
            for subject in &mut *subjects {
                let is_good = is_good(&after, &subject.plugin.name, subject.plugin.role)?;
                let before = plugin(&before, &subject.plugin.name)?;
                round.records.extend(subject.step(&PluginObservation { before, is_good, now })?);
            }
        }
        for (subject, end) in subjects.iter_mut().zip(ends) {
            subject.queue.extend(end);
        }
        Ok(())
    }
}

/// Reports whether a frame shows a plugin's correct data.
fn is_good(stats: &Stats, name: &str, role: Role) -> Result<bool> {
    Ok(match role {
        Role::Telemetry => (0..TAGS).all(|index| {
            let id = tag_of(name, index);
            stats.tags.iter().any(|tag| tag.id == id && tag.quality == "good")
        }),
        Role::Overlay => plugin(stats, name)?.fault.is_none(),
        Role::Optimizer => true,
    })
}

fn plugin<'a>(stats: &'a Stats, name: &str) -> Result<&'a PluginStats> {
    let found = stats.plugins.iter().find(|plugin| plugin.name == name);
    found.with_context(|| format!("the view has no plugin '{name}'"))
}
