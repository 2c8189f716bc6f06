//! Very many configurations by hot reload, good and bad ones: the view stays, with live
//! plugins, and leaves nothing behind. `BUSBAR_RELOADS` asks for more of them,
//! `BUSBAR_RELOAD_SEED` for others.

mod mutator;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use busbar_plugin_check::heap_bytes;
use busbar_process_heap::release_freed_memory;
use busbar_scene_loader::LoadedScene;
use busbar_viewer::reload::{ReloadOutcome, Reloader};
use busbar_viewer::{AlarmAction, Picture, Viewer, renderer_options};
use e2e::peer::{Peer, normal_values};
use e2e::{Scene, wait_for};
use serde_json::json;

use mutator::{Random, mutated};

/// Overlay with the values; places of labels depend on their former ones.
const LABELS: &str = "values";
const SIZE: [u32; 2] = [320, 180];
/// Number of reloads in a test; `cargo xtask soak --reload` has 10,000.
const RELOADS: usize = 120;
const RELOADS_VARIABLE: &str = "BUSBAR_RELOADS";
const SEED_VARIABLE: &str = "BUSBAR_RELOAD_SEED";
/// Number of reloads after which the good configuration is restored, and the picture must be the
/// first one again.
const BETWEEN_LOOKS: usize = 20;
/// Number of reloads after which the resources are printed.
const BETWEEN_REPORTS: usize = 500;
/// Number of checks after which nothing may grow any more.
const WARM: usize = 4;
const MAX_WAIT: Duration = Duration::from_secs(120);
/// Allowed growth of descriptors between checks: a thread of the last plugin may still be ending.
const MAX_MORE_DESCRIPTORS: usize = 16;
const MAX_MORE_THREADS: usize = 8;
/// Allowed variation of the heap between two checks, as caches fill, bytes.
const HEAP_VARIES: usize = 1_000_000;
/// Greatest heap growth for each configuration, bytes; a real leak exceeds it.
const MAX_MORE_HEAP_EACH: usize = 400;
/// Greatest memory between allocations that the heap cannot return although it is free, bytes.
const MAX_MORE_MEMORY: u64 = 150_000_000;

fn asked(variable: &str) -> Option<u64> {
    std::env::var(variable).ok().map(|text| text.parse().expect("a number"))
}

/// Resources of this process.
#[derive(Clone, Copy, Debug)]
struct Holdings {
    descriptors: usize,
    threads: usize,
    children: usize,
    /// Allocated heap, that of the graphics driver included, bytes.
    heap: usize,
    /// Resident memory of the process, bytes.
    memory: u64,
}

impl Holdings {
    fn now() -> Self {
        release_freed_memory();
        let entries = |path: &str| fs::read_dir(path).expect("it is there").count();
        let status = fs::read_to_string("/proc/self/status").expect("it is there");
        let resident = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kilobytes =
            resident.and_then(|text| text.split_whitespace().next()?.parse::<u64>().ok());
        let tasks = fs::read_dir("/proc/self/task").expect("it is there").flatten();
        let children = tasks.map(|task| {
            let children = fs::read_to_string(task.path().join("children")).unwrap_or_default();
            children.split_whitespace().count()
        });
        Self {
            descriptors: entries("/proc/self/fd"),
            threads: entries("/proc/self/task"),
            children: children.sum(),
            heap: heap_bytes(),
            memory: kilobytes.expect("it says so") * 1024,
        }
    }

    fn is_bounded_by(self, warm: Self, reloads: usize) -> bool {
        self.heap <= warm.heap + HEAP_VARIES + reloads * MAX_MORE_HEAP_EACH
            && self.descriptors <= warm.descriptors + MAX_MORE_DESCRIPTORS
            && self.threads <= warm.threads + MAX_MORE_THREADS
            && self.children <= warm.children
            && self.memory <= warm.memory + MAX_MORE_MEMORY
    }
}

struct View {
    viewer: Viewer,
    reloader: Reloader,
    started: Instant,
}

impl View {
    fn open(path: &Path) -> Self {
        let scene = LoadedScene::load(path, &|_, _, _| {}).unwrap_or_else(|e| panic!("{e}"));
        let options = renderer_options(&scene);
        let viewer = Viewer::new_offscreen(scene, options, SIZE).expect("there is a device");
        let reloader = Reloader::start(path, || {}).expect("a file can be watched");
        Self { viewer, reloader, started: Instant::now() }
    }

    fn frame(&mut self) {
        let input = self.viewer.headless_input(self.started.elapsed().as_secs_f64());
        self.viewer.frame(input).expect("a frame is drawn");
    }

    fn outcome(&mut self) -> ReloadOutcome {
        wait_for("the file to be read again", MAX_WAIT, || {
            self.frame();
            self.reloader.step(&mut self.viewer)
        })
    }

    /// Acknowledges the alarms that edits created, so that they end.
    fn acknowledge_all(&mut self) {
        for alarm in self.viewer.stats().alarms {
            // One that is acknowledged needs nothing.
            let _ = self.viewer.act_on_alarm(&alarm.id, AlarmAction::Acknowledge, "A. Operator");
        }
    }

    /// Returns the picture once all values are good.
    fn good_picture(&mut self) -> Picture {
        self.viewer.set_layer_shown(LABELS, false);
        wait_for("all values", MAX_WAIT, || {
            self.frame();
            (self.viewer.stats().quality.bad == 0).then_some(())
        });
        self.viewer.read_picture().expect("a frame was drawn")
    }
}

#[test]
fn the_scene_outlives_whatever_is_written() {
    let Some(peer) = Peer::start(&normal_values()) else { return };
    let mut scene = Scene::demo(peer.port);
    scene.config["alarms"] = json!({
        "Oil": { "tag": "T1.TopOil", "condition": { "high": 90 }, "message": "Top oil hot" }
    });
    scene.config["alarm_handling"] = json!({ "log_directory": "log" });
    scene.config["graphics"] = json!({ "samples": 1, "quality": "low", "morph_seconds": 0 });
    scene.config["window"] = json!({ "size": SIZE });
    scene.config["camera"] = json!({ "start": "bay" });
    let path = scene.write();
    let good = fs::read_to_string(&path).expect("it was written");
    let mut view = View::open(&path);
    let first = view.good_picture();
    let reloads = asked(RELOADS_VARIABLE).map_or(RELOADS, |count| count as usize);
    let mut random = Random::new(asked(SEED_VARIABLE).unwrap_or(1));
    let (mut shown, mut refused, mut same) = (0, 0, 0);
    let (mut warm, mut last) = (None, good.clone());
    for number in 1..=reloads {
        let text = mutated(&scene.config, &mut random);
        if text == last {
            continue;
        }
        scene.write_text(&text);
        match view.outcome() {
            ReloadOutcome::Shown => shown += 1,
            ReloadOutcome::Refused(fault) => {
                refused += 1;
                assert!(!fault.is_empty());
            }
            ReloadOutcome::Same => same += 1,
        }
        last = text;
        if number % BETWEEN_LOOKS != 0 && number != reloads {
            continue;
        }
        scene.write_text(&good);
        view.outcome();
        last.clone_from(&good);
        wait_for("the first picture", MAX_WAIT, || {
            view.acknowledge_all();
            let picture = view.good_picture();
            (picture.rgba8 == first.rgba8).then_some(())
        });
        let bound = *warm.get_or_insert_with(Holdings::now);
        if number == BETWEEN_LOOKS * WARM {
            warm = Some(Holdings::now());
        }
        // What was replaced ends beside the frames.
        let until = Instant::now() + MAX_WAIT;
        loop {
            // A rasterizer keeps the memory of its last picture, of whatever configuration, until
            // it draws the next one.
            view.viewer.forget_picture();
            view.frame();
            let now = Holdings::now();
            if number <= BETWEEN_LOOKS * WARM || now.is_bounded_by(bound, number) {
                break;
            }
            assert!(Instant::now() < until, "{now:?} after {number}, and at first {bound:?}");
        }
        if number % BETWEEN_REPORTS == 0 {
            println!("{number}: {:?}", Holdings::now());
        }
    }
    let seconds = view.started.elapsed().as_secs();
    println!(
        "{reloads} configurations in {seconds} s: {shown} shown, {refused} refused, {same} alike; \
         at first {warm:?}, at last {:?}",
        Holdings::now()
    );
    assert!(shown > 0 && refused > 0);
    let deaths = view.viewer.stats().plugins.iter().map(|plugin| plugin.deaths).sum::<u64>();
    assert_eq!(deaths, 0, "plugins are ended, and none dies");
}
