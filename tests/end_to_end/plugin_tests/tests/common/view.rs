//! View of faulty plugins.
#![allow(dead_code, reason = "each test program uses its part of it")]

use std::time::{Duration, Instant};

use busbar_scene_loader::LoadedScene;
use busbar_viewer::{PluginStats, RendererOptions, Viewer};
use e2e::faulty_plugins::FaultyPluginScene;
use e2e::wait_for;
use rustix::process::Pid;

/// Longest time from the death of a plugin until all its tags are bad.
pub(crate) const MAX_TO_BAD: Duration = Duration::from_secs(1);
/// Longest time from there until the plugin has values again, a loaded machine included.
pub(crate) const MAX_TO_GOOD: Duration = Duration::from_secs(10);
/// The longest frame of a window's kind while a plugin misbehaves. Without other load it
/// is 100 ms, which `cargo xtask faults` measures; tests run where two cores build and
/// draw at once, and a thread may wait for some hundred milliseconds for its turn.
pub(crate) const MAX_FRAME: Duration = Duration::from_millis(400);

/// View without a window that paces frames like one in a window.
pub(crate) struct View {
    pub(crate) viewer: Viewer,
    /// Duration of the longest frame so far.
    pub(crate) longest: Duration,
    _trouble: FaultyPluginScene,
}

impl View {
    pub(crate) fn open(trouble: FaultyPluginScene) -> Self {
        let loaded = LoadedScene::load(&trouble.write(), &|_, _, _| ());
        let scene = loaded.unwrap_or_else(|error| panic!("{error}"));
        let options = RendererOptions { samples: 1, ..Default::default() };
        let mut viewer = Viewer::new_headless(scene, options, [64, 64]).expect("there is a device");
        viewer.set_settles(false);
        Self { viewer, longest: Duration::ZERO, _trouble: trouble }
    }

    pub(crate) fn frame(&mut self) {
        let start = Instant::now();
        let input = self.viewer.headless_input(0.0);
        self.viewer.frame(input).expect("a frame can be drawn");
        self.longest = self.longest.max(start.elapsed());
    }

    pub(crate) fn plugin(&self, name: &str) -> PluginStats {
        let plugins = self.viewer.stats().plugins;
        plugins.into_iter().find(|plugin| plugin.name == name).expect("it is configured")
    }

    pub(crate) fn pid(&self, name: &str) -> Pid {
        let pid = self.plugin(name).pid.expect("it has a process");
        Pid::from_raw(pid as i32).expect("no process has the number 0")
    }

    /// Draws until all tags are of this quality; returns the time that took.
    #[track_caller]
    pub(crate) fn wait_for_quality(&mut self, quality: &str, limit: Duration) -> Duration {
        self.wait_for(quality, limit, |view| {
            view.viewer.stats().tags.iter().all(|tag| tag.quality == quality)
        })
    }

    #[track_caller]
    pub(crate) fn wait_for_state(&mut self, state: &str, limit: Duration) -> Duration {
        self.wait_for(state, limit, |view| view.plugin("trouble").state == state)
    }

    #[track_caller]
    pub(crate) fn wait_for(
        &mut self,
        what: &str,
        limit: Duration,
        is: impl Fn(&Self) -> bool,
    ) -> Duration {
        let start = Instant::now();
        wait_for(what, limit, || {
            self.frame();
            is(self).then_some(())
        });
        start.elapsed()
    }
}
