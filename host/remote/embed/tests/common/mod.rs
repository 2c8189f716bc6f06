//! A program that embeds the demo and sets its tags itself.
#![allow(dead_code)]

pub(crate) mod judge;

use std::ffi::{CStr, CString};
use std::fs::Permissions;
use std::mem::size_of;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;
use std::ptr::{null, null_mut};
use std::time::{Duration, Instant};

use busbar::abi::*;
use busbar::calls::*;
use busbar::commands::*;
use e2e::{Scene, built, built_folder};
use serde_json::{Value, json};

/// The longest that anything is waited for: this machine may be busy.
pub(crate) const PATIENCE: Duration = Duration::from_secs(60);
/// The longest that any call may take: one that waited for the viewer would take seconds, and a
/// busy machine that draws in software lets any thread wait for some time slices.
pub(crate) const MAX_CALL: Duration = Duration::from_millis(250);
/// Time without a change after which a picture counts as settled.
const CALM: Duration = Duration::from_millis(1200);
/// Period at which the program sets its tags again.
const TAG_PERIOD: Duration = Duration::from_millis(300);

/// The equipment and the tag of the tests.
pub(crate) const TRANSFORMER: &str = "=S12D1T1-TA1";
pub(crate) const TOP_OIL: &str = "T1.TopOil";
pub(crate) const ALARM: &str = "T1.TopOil.High";

/// The demo: all that a device would bring, the program sets.
pub(crate) fn scene() -> Scene {
    let mut scene = Scene::demo(1);
    let config = &mut scene.config;
    config["plugins"].as_object_mut().expect("an object").remove("bay");
    for tag in config["tags"].as_object_mut().expect("an object").values_mut() {
        let tag = tag.as_object_mut().expect("an object");
        if tag.remove("source").is_some() {
            tag.insert("set_by_host".into(), json!(true));
            tag.remove("scale");
            tag.remove("simulate");
        }
    }
    config["alarms"] = json!({
        ALARM: {
            "tag": TOP_OIL, "condition": { "high": 95 }, "priority": "high",
            "message": "Top oil hot", "equipment": TRANSFORMER,
        }
    });
    config["camera"]["transition_seconds"] = json!(0);
    scene
}

/// The demo with one label. Labels keep the places to which others drove them: this one stands
/// where it stood, whatever was written on it meanwhile.
pub(crate) fn scene_of_one_label() -> Scene {
    let mut scene = scene();
    let bindings = scene.config["bindings"].as_array_mut().expect("an array");
    let node = bindings.iter().find(|binding| binding["tag"] == TOP_OIL).expect("it is bound");
    let node = node["node"].clone();
    bindings.retain(|binding| binding["node"] == node);
    scene
}

/// A view, whose every call is timed.
pub(crate) struct Host {
    pub(crate) view: *mut BusbarView,
    /// Tags that the program keeps saying, with their values.
    tags: Vec<(CString, f64, u32)>,
    said: Option<Instant>,
    pub(crate) longest_call: Duration,
    pub(crate) events: Vec<Happened>,
}

/// Copy of an event.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Happened {
    pub(crate) kind: BusbarViewEventKind,
    pub(crate) liveness: BusbarViewLiveness,
    pub(crate) alarm_state: BusbarViewAlarmState,
    pub(crate) alarm_action: BusbarViewAlarmAction,
    pub(crate) quality: BusbarViewQuality,
    pub(crate) id: String,
    pub(crate) text: String,
    pub(crate) origins: u32,
    pub(crate) verdict: BusbarViewVerdict,
    pub(crate) eye: [f64; 3],
    pub(crate) dropped: u32,
    pub(crate) at: Instant,
}

/// Copy of a frame.
#[derive(Clone)]
pub(crate) struct Shown {
    pub(crate) is_new: bool,
    pub(crate) liveness: BusbarViewLiveness,
    pub(crate) size: [u32; 2],
    pub(crate) damage: [u32; 4],
    pub(crate) age: Duration,
    pub(crate) sequence: u64,
    pub(crate) pixels: Vec<u8>,
}

pub(crate) type BusbarView = busbar::BusbarView;

impl Host {
    /// Opens a view of 640 x 360 pixels offscreen.
    pub(crate) fn open(scene: &Scene) -> Self {
        Self::open_with(scene, |_| {})
    }

    pub(crate) fn open_with(scene: &Scene, change: impl FnOnce(&mut BusbarViewOptions)) -> Self {
        let config = CString::new(scene.write().into_os_string().into_encoded_bytes())
            .expect("no zero byte in it");
        let program = built(built_folder().join("busbar"));
        let program = CString::new(program.into_os_string().into_encoded_bytes())
            .expect("no zero byte in it");
        let mut options = BusbarViewOptions {
            struct_size: size_of::<BusbarViewOptions>() as u32,
            flags: 0,
            width: 640,
            height: 360,
            window_system: BusbarViewWindowSystem::None as u32,
            silent_millis: 0,
            hung_millis: 0,
            max_restart_millis: 0,
            window: 0,
            config: config.as_ptr(),
            program: program.as_ptr(),
            operator_name: c"operator 1".as_ptr(),
        };
        change(&mut options);
        let mut host = Self::open_options(&options);
        let tags = scene.config["tags"].as_object().expect("an object");
        let set = |(id, tag): (&String, &Value)| {
            let kind = match tag["type"].as_str() {
                Some("bool") => BusbarViewValueKind::Bool as u32,
                Some("i64") => BusbarViewValueKind::I64 as u32,
                Some("double_point") => BusbarViewValueKind::DoublePoint as u32,
                _ => BusbarViewValueKind::F64 as u32,
            };
            let id = CString::new(id.as_str()).expect("no zero byte in it");
            // Tests of texts set theirs themselves.
            let is_number = tag["set_by_host"] == true && tag["type"] != "text";
            is_number.then_some((id, usual(tag), kind))
        };
        host.tags = tags.iter().filter_map(set).collect();
        host
    }

    /// Opens a view offscreen, without tags, whose viewer is another program.
    pub(crate) fn open_program(config: &CStr, program: &CStr, [width, height]: [u32; 2]) -> Self {
        Self::open_options(&BusbarViewOptions {
            struct_size: size_of::<BusbarViewOptions>() as u32,
            flags: 0,
            width,
            height,
            window_system: BusbarViewWindowSystem::None as u32,
            silent_millis: 0,
            hung_millis: 0,
            max_restart_millis: 0,
            window: 0,
            config: config.as_ptr(),
            program: program.as_ptr(),
            operator_name: null(),
        })
    }

    fn open_options(options: &BusbarViewOptions) -> Self {
        let mut view = null_mut();
        // SAFETY: as the header says.
        let status = unsafe { busbar_view_open(options, &mut view) };
        assert_eq!(status, BusbarStatus::Ok);
        let (tags, events) = (Vec::new(), Vec::new());
        Self { view, tags, said: None, longest_call: Duration::ZERO, events }
    }

    /// Makes a call, and notes how long it takes, less what others had the processor.
    pub(crate) fn call<T>(&mut self, call: impl FnOnce(*const BusbarView) -> T) -> T {
        let (start, waited) = (Instant::now(), waited_for_processor());
        let result = call(self.view);
        let waited = waited_for_processor() - waited;
        self.longest_call = self.longest_call.max(start.elapsed().saturating_sub(waited));
        result
    }

    /// Changes the value of a tag from now on.
    pub(crate) fn set_tag(&mut self, id: &str, value: f64) {
        let tag = self.tags.iter_mut().find(|(tag, ..)| tag.to_str() == Ok(id));
        tag.expect("the scene has it").1 = value;
        self.say_tags();
    }

    /// Stops setting tags from now on.
    pub(crate) fn fall_silent(&mut self) {
        self.tags.clear();
    }

    fn say_tags(&mut self) {
        let tag = |(id, value, kind): &(CString, f64, u32)| BusbarViewTag {
            id: id.as_ptr(),
            kind: *kind,
            quality: BusbarViewQuality::Good as u32,
            source_unix_nanos: BUSBAR_VIEW_NO_TIME,
            number: *value,
            integer: if *kind == BusbarViewValueKind::DoublePoint as u32 {
                2
            } else {
                *value as i64
            },
            text: null(),
        };
        let tags: Vec<_> = self.tags.iter().map(tag).collect();
        // SAFETY: as the header says.
        let status =
            self.call(|view| unsafe { busbar_view_set_tags(view, tags.as_ptr(), tags.len()) });
        assert_eq!(status, BusbarStatus::Ok);
        self.said = Some(Instant::now());
    }

    /// Runs one turn of the program's event loop: sets tags, takes events.
    pub(crate) fn turn(&mut self) {
        if self.said.is_none_or(|said| said.elapsed() >= TAG_PERIOD) && !self.tags.is_empty() {
            self.say_tags();
        }
        loop {
            let mut event = no_event();
            // SAFETY: as the header says.
            if self.call(|view| unsafe { busbar_view_next_event(view, &mut event) }) != 1 {
                break;
            }
            self.events.push(Happened::from_event(&event));
        }
        std::thread::sleep(Duration::from_millis(2));
    }

    /// Waits for an event that satisfies a condition.
    #[track_caller]
    pub(crate) fn wait(&mut self, what: &str, wanted: impl Fn(&Happened) -> bool) -> Happened {
        let start = Instant::now();
        loop {
            if let Some(place) = self.events.iter().position(&wanted) {
                return self.events.drain(..=place).next_back().expect("it is there");
            }
            assert!(start.elapsed() < PATIENCE, "no {what}; there were {:#?}", self.events);
            self.turn();
        }
    }

    #[track_caller]
    pub(crate) fn wait_for(&mut self, kind: BusbarViewEventKind) -> Happened {
        self.wait(&format!("event of kind {kind:?}"), |event| event.kind == kind)
    }

    /// Returns the present picture; none before the first.
    pub(crate) fn frame(&mut self) -> Option<Shown> {
        let mut frame = BusbarViewFrame {
            struct_size: size_of::<BusbarViewFrame>() as u32,
            liveness: BusbarViewLiveness::Live,
            width: 0,
            height: 0,
            stride: 0,
            damage_x: 0,
            damage_y: 0,
            damage_width: 0,
            damage_height: 0,
            age_millis: 0,
            sequence: 0,
            pixels: null(),
        };
        // SAFETY: as the header says.
        let status = self.call(|view| unsafe { busbar_view_frame(view, &mut frame) });
        assert!(status >= 0, "{status}");
        if frame.pixels.is_null() {
            assert_eq!((status, frame.width), (0, 0));
            return None;
        }
        assert_eq!(frame.stride, frame.width * 4);
        let bytes = frame.stride as usize * frame.height as usize;
        // SAFETY: as the header says: they stay until the next call.
        let pixels = unsafe { std::slice::from_raw_parts(frame.pixels, bytes) }.to_vec();
        Some(Shown {
            is_new: status == 1,
            liveness: frame.liveness,
            size: [frame.width, frame.height],
            damage: [frame.damage_x, frame.damage_y, frame.damage_width, frame.damage_height],
            age: Duration::from_millis(u64::from(frame.age_millis)),
            sequence: frame.sequence,
            pixels,
        })
    }

    /// Waits for a picture that satisfies a condition.
    #[track_caller]
    pub(crate) fn wait_for_frame(&mut self, what: &str, wanted: impl Fn(&Shown) -> bool) -> Shown {
        let start = Instant::now();
        loop {
            if let Some(frame) = self.frame().filter(&wanted) {
                return frame;
            }
            assert!(start.elapsed() < PATIENCE, "no picture {what}");
            self.turn();
        }
    }

    /// Waits until the picture stays as it is for a while.
    #[track_caller]
    pub(crate) fn wait_for_calm(&mut self) -> Shown {
        let mut last: Option<(Shown, Instant)> = None;
        let start = Instant::now();
        loop {
            self.turn();
            assert!(start.elapsed() < PATIENCE, "no live picture");
            // One that is late is hatched, and says nothing of the scene.
            let frame = self.frame().filter(|frame| frame.liveness == BusbarViewLiveness::Live);
            let Some(frame) = frame else { continue };
            match &last {
                Some((before, since)) if before.pixels == frame.pixels => {
                    if since.elapsed() > CALM {
                        return frame;
                    }
                }
                _ => {
                    let before = last.replace((frame, Instant::now()));
                    if let Some((before, _)) = before.filter(|_| start.elapsed() > PATIENCE / 2) {
                        save(&before, "calm_before");
                        save(&last.as_ref().expect("it was put there").0, "calm_after");
                        panic!("the picture changes and changes");
                    }
                }
            }
        }
    }

    /// Waits until all tags have values, and until nothing moves in the picture of a place.
    #[track_caller]
    pub(crate) fn look_around(&mut self) -> Shown {
        self.wait("good tag", |e| {
            e.kind == BusbarViewEventKind::Quality
                && e.id == TOP_OIL
                && e.quality == BusbarViewQuality::Good
        });
        self.arrive()
    }

    /// Moves to a place, which has labels placed anew, and waits until nothing moves there.
    #[track_caller]
    pub(crate) fn arrive(&mut self) -> Shown {
        let (eye, target) = ([40.0_f64, 25.0, 30.0], [0.0_f64, 3.0, 0.0]);
        // SAFETY: an open view and three numbers each.
        let look = |view| unsafe { busbar_view_look(view, eye.as_ptr(), target.as_ptr()) };
        assert_eq!(self.call(look), BusbarStatus::Ok);
        self.wait_for_calm()
    }

    /// Returns the process id of the viewer.
    pub(crate) fn viewer(&self) -> u32 {
        // SAFETY: as the header says.
        unsafe { busbar_view_process(self.view) }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let start = Instant::now();
        // SAFETY: nobody uses it any more.
        unsafe { busbar_view_close(self.view) };
        let took = start.elapsed();
        if !std::thread::panicking() {
            assert!(took < MAX_CALL, "closing took {took:?}");
            assert!(self.longest_call < MAX_CALL, "a call took {:?}", self.longest_call);
        }
    }
}

impl Happened {
    pub(crate) fn from_event(event: &BusbarViewEvent) -> Self {
        // SAFETY: never null, and ended by zero, as the header says.
        let text = |text| unsafe { CStr::from_ptr(text) }.to_str().expect("it is UTF-8").to_owned();
        Self {
            kind: event.kind,
            liveness: event.liveness,
            alarm_state: event.alarm_state,
            alarm_action: event.alarm_action,
            quality: event.quality,
            id: text(event.id),
            text: text(event.text),
            origins: event.origins,
            verdict: event.verdict,
            eye: event.eye,
            dropped: event.dropped,
            at: Instant::now(),
        }
    }
}

pub(crate) fn no_event() -> BusbarViewEvent {
    BusbarViewEvent {
        struct_size: size_of::<BusbarViewEvent>() as u32,
        kind: BusbarViewEventKind::Ready,
        dropped: 0,
        liveness: BusbarViewLiveness::Live,
        alarm_state: BusbarViewAlarmState::None,
        alarm_action: BusbarViewAlarmAction::None,
        shelve_seconds: 0,
        quality: BusbarViewQuality::Good,
        origins: 0,
        verdict: BusbarViewVerdict::Normal,
        is_assumed: 0,
        reserved: 0,
        unix_nanos: 0,
        eye: [0.0; 3],
        target: [0.0; 3],
        id: null(),
        overlay: null(),
        text: null(),
    }
}

/// Reports whether a picture has no colour and hatching on most of it, as a dead one must.
pub(crate) fn looks_dead(shown: &Shown) -> bool {
    let is_grey = shown.pixels.chunks(4).all(|p| p[0] == p[1] && p[1] == p[2]);
    let width = shown.size[0] as usize;
    // Along a row, dark and light take turns with the stripes' period.
    let row = &shown.pixels[..width * 4];
    let jumps = row.chunks(4).zip(row.chunks(4).skip(1));
    let jumps = jumps.filter(|(a, b)| a[0].abs_diff(b[0]) > 60).count();
    is_grey && jumps >= width / 24
}

/// Returns a script that starts the program with more variables in its environment.
pub(crate) fn program_with(scene: &Scene, environment: &Command) -> CString {
    let program = built(built_folder().join("busbar"));
    let mut script = String::from("#!/bin/sh\n");
    for (name, value) in environment.get_envs() {
        let value = value.expect("it is set").to_str().expect("it is UTF-8");
        script += &format!("export {}='{value}'\n", name.to_str().expect("it is UTF-8"));
    }
    script += &format!("exec '{}' \"$@\"\n", program.display());
    let path = scene.path("busbar");
    std::fs::write(&path, script).expect("the folder can be written");
    std::fs::set_permissions(&path, Permissions::from_mode(0o700)).expect("it is ours");
    CString::new(path.into_os_string().into_encoded_bytes()).expect("no zero byte in it")
}

/// Returns a usual value of a tag, within all limits.
fn usual(tag: &Value) -> f64 {
    let bound = |band: &str, end: &str| tag[band][end].as_f64();
    let low = bound("limits", "low").or(bound("range", "low")).unwrap_or(0.0);
    let high = bound("limits", "high").or(bound("range", "high"));
    high.map_or(0.0, |high| ((low + high) / 2.0).round())
}

/// Keeps a picture where `BUSBAR_PICTURES` says, if it does.
pub(crate) fn save(shown: &Shown, name: &str) {
    let Some(folder) = std::env::var_os("BUSBAR_PICTURES") else { return };
    let mut rgba = shown.pixels.clone();
    rgba.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
    let [width, height] = shown.size;
    let path = std::path::Path::new(&folder).join(format!("{name}.png"));
    image::save_buffer(path, &rgba, width, height, image::ColorType::Rgba8).expect("it is written");
}

/// Returns a percentile of durations, after sorting them.
pub(crate) fn percentile(durations: &mut [Duration], share: f64) -> Duration {
    durations.sort_unstable();
    durations[((durations.len() - 1) as f64 * share).round() as usize]
}

/// Returns the time that this thread was ready to run and did not.
fn waited_for_processor() -> Duration {
    let numbers = std::fs::read_to_string("/proc/thread-self/schedstat").expect("Linux has it");
    let nanos = numbers.split(' ').nth(1).expect("the second number");
    Duration::from_nanos(nanos.parse().expect("it is a number"))
}

/// Open descriptors of this process, and its memory in RAM, bytes.
pub(crate) fn own_use() -> (usize, u64) {
    let descriptors = std::fs::read_dir("/proc/self/fd").expect("Linux has it").count();
    let statm = std::fs::read_to_string("/proc/self/statm").expect("it is UTF-8");
    // Without shared pages: those are the pictures'.
    let numbers: Vec<u64> =
        statm.split(' ').take(3).map(|n| n.parse().expect("it is a number")).collect();
    (descriptors, (numbers[1] - numbers[2]) * 4096)
}
