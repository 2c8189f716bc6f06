//! End-to-end tests of a view: events, pictures, commands and their effects.

#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "each call is as the header says: an open view, texts that end, structs with sizes"
)]

mod common;

use std::collections::BTreeSet;
use std::ffi::{CStr, CString};
use std::time::Duration;

use busbar::abi::*;
use busbar::calls::*;
use busbar::commands::*;
use common::*;

#[test]
fn a_program_gets_pictures_events_and_what_it_asks() {
    let scene = scene();
    let mut host = Host::open(&scene);
    let ready = host.wait_for(BusbarViewEventKind::Ready);
    assert!(!ready.text.is_empty(), "the device has a name");
    host.wait("good tag", |e| {
        e.kind == BusbarViewEventKind::Quality
            && e.id == TOP_OIL
            && e.quality == BusbarViewQuality::Good
    });
    let calm = host.wait_for_calm();
    assert_eq!((calm.size, calm.liveness), ([640, 360], BusbarViewLiveness::Live));
    let colors: BTreeSet<_> = calm.pixels.chunks(4).map(<[u8]>::to_vec).collect();
    assert!(colors.len() > 100, "a scene has more than {} colours", colors.len());
    assert!(!looks_dead(&calm));

    // Picks.
    assert_eq!(
        host.call(|view| unsafe {
            busbar_view_focus(view, CString::new(TRANSFORMER).unwrap().as_ptr())
        }),
        BusbarStatus::Ok
    );
    host.wait_for_calm();
    assert_eq!(host.call(|view| unsafe { busbar_view_pick(view, 320, 180) }), BusbarStatus::Ok);
    let picked = host.wait_for(BusbarViewEventKind::Picked);
    assert!(picked.id.starts_with(TRANSFORMER), "{picked:?}");
    assert_eq!(host.call(|view| unsafe { busbar_view_pick(view, 1, 1) }), BusbarStatus::Ok);
    assert_eq!(host.wait_for(BusbarViewEventKind::Picked).id, "", "the sky");

    // The pointer names what it is over, and a click picks as well.
    let point = |host: &mut Host, what| {
        let status =
            host.call(|view| unsafe { busbar_view_point(view, what, 320.0, 180.0, 1, 0.0) });
        assert_eq!(status, BusbarStatus::Ok);
    };
    point(&mut host, BusbarViewPointer::Moved as u32);
    host.wait("hover", |e| e.kind == BusbarViewEventKind::Hovered && e.id.starts_with(TRANSFORMER));
    for what in [BusbarViewPointer::Pressed as u32, BusbarViewPointer::Released as u32] {
        point(&mut host, what);
        for _ in 0..20 {
            host.turn();
        }
    }
    assert!(host.wait_for(BusbarViewEventKind::Picked).id.starts_with(TRANSFORMER));

    // Camera and size.
    let (eye, target) = ([30.0, 20.0, 30.0], [0.0, 2.0, 0.0]);
    assert_eq!(
        host.call(|view| unsafe { busbar_view_look(view, eye.as_ptr(), target.as_ptr()) }),
        BusbarStatus::Ok
    );
    let near = |a: [f64; 3]| a.iter().zip(eye).all(|(a, b)| (a - b).abs() < 1e-3);
    host.wait("camera", |e| e.kind == BusbarViewEventKind::Camera && near(e.eye));
    assert_eq!(host.call(|view| unsafe { busbar_view_resize(view, 500, 300) }), BusbarStatus::Ok);
    let resized = host.wait_for_frame("of the new size", |f| f.size == [500, 300]);
    assert_eq!(resized.damage, [0, 0, 500, 300]);

    // What cannot be done is told.
    assert_eq!(
        host.call(|view| unsafe { busbar_view_focus(view, c"=NOT".as_ptr()) }),
        BusbarStatus::Ok
    );
    let error = host.wait_for(BusbarViewEventKind::Error);
    assert!(error.text.contains("'=NOT'"), "{error:?}");
}

#[test]
fn a_value_that_nobody_repeats_goes_stale_and_an_alarm_is_told() {
    let mut scene = scene();
    for tag in scene.config["tags"].as_object_mut().unwrap().values_mut() {
        if tag["set_by_host"] == true {
            tag["freshness_seconds"] = 1.5.into();
        }
    }
    let mut host = Host::open(&scene);
    let live = host.look_around();
    host.set_tag(TOP_OIL, 120.0);
    let of_alarm = |state| {
        move |e: &Happened| {
            e.kind == BusbarViewEventKind::Alarm && e.id == ALARM && e.alarm_state == state
        }
    };
    host.wait("unacknowledged alarm", of_alarm(BusbarViewAlarmState::Unacknowledged));
    let alarm = CString::new(ALARM).unwrap();
    let act = |view, action| unsafe {
        busbar_view_act_on_alarm(view, alarm.as_ptr(), action, 600, std::ptr::null())
    };
    assert_eq!(
        host.call(|view| act(view, BusbarViewAlarmAction::Acknowledge as u32)),
        BusbarStatus::Ok
    );
    host.wait("acknowledged alarm", of_alarm(BusbarViewAlarmState::Acknowledged));
    assert_eq!(host.call(|view| act(view, BusbarViewAlarmAction::Shelve as u32)), BusbarStatus::Ok);
    host.wait("shelved alarm", of_alarm(BusbarViewAlarmState::Shelved));
    host.fall_silent();
    let stale = host.wait("stale tag", |e| {
        e.kind == BusbarViewEventKind::Quality
            && e.id == TOP_OIL
            && e.quality == BusbarViewQuality::Bad
    });
    assert_eq!(stale.text, "stale");
    let after = host.wait_for_frame("that shows it", |f| f.pixels != live.pixels);
    assert_eq!(after.liveness, BusbarViewLiveness::Live, "the picture lives, the value does not");
}

#[test]
fn the_origin_of_a_value_is_told_with_its_quality() {
    let mut scene = scene();
    scene.add_plugin("sample_generator");
    scene.config["plugins"]["generator"] = serde_json::json!({ "plugin": "sample_generator" });
    scene.config["tags"]["made"] = serde_json::json!({
        "type": "f64", "source": { "instance": "generator", "address": {} },
    });
    let mut host = Host::open(&scene);
    let is_good = |id: &'static str| {
        move |e: &Happened| {
            e.kind == BusbarViewEventKind::Quality
                && e.id == id
                && e.quality == BusbarViewQuality::Good
        }
    };
    let made = host.wait("good tag of a simulator", is_good("made"));
    assert_eq!(made.origins, BUSBAR_VIEW_ORIGIN_SIMULATED);
    host.set_tag(TOP_OIL, f64::NAN);
    let own = host.wait("tag of the program", |e| {
        e.kind == BusbarViewEventKind::Quality
            && e.id == TOP_OIL
            && e.quality != BusbarViewQuality::Good
    });
    assert_eq!(own.origins, 0);
}

/// Piece of the demo beside the transformer.
const BREAKER: &str = "=S12D1Q1-QA1-L1";

#[test]
fn the_origin_of_a_verdict_is_that_of_the_values_it_rests_on() {
    let mut scene = scene();
    scene.add_plugin("sample_generator");
    scene.add_plugin("condition");
    let config = &mut scene.config;
    config["plugins"]["generator"] = serde_json::json!({ "plugin": "sample_generator" });
    config["plugins"]["judged"] = serde_json::json!({
        "plugin": "condition",
        "settings": {
            "quantities": [{
                "name": "Oil", "role": "oil", "unit": "°C", "attention": 1e9, "alarm": 1e12,
            }],
            "equipment": [TRANSFORMER, BREAKER],
        },
    });
    config["tags"]["made"] = serde_json::json!({
        "type": "f64", "unit": "°C", "source": { "instance": "generator", "address": {} },
    });
    let list = |value: &mut serde_json::Value, more| value.as_array_mut().unwrap().push(more);
    list(&mut config["overlays"], serde_json::json!("judged"));
    for (tag, node) in [("made", TRANSFORMER), (TOP_OIL, BREAKER)] {
        let binding = serde_json::json!({ "tag": tag, "node": node, "role": "oil" });
        list(&mut config["bindings"], binding);
    }
    let mut host = Host::open(&scene);
    let is_normal = |e: &Happened| {
        e.kind == BusbarViewEventKind::Verdict
            && [TRANSFORMER, BREAKER].contains(&e.id.as_str())
            && e.verdict == BusbarViewVerdict::Normal
    };
    // They come in any order.
    let mut origins = std::collections::BTreeMap::new();
    while origins.len() < 2 {
        let verdict = host.wait("normal verdict", is_normal);
        origins.insert(verdict.id, verdict.origins);
    }
    assert_eq!(origins[TRANSFORMER], BUSBAR_VIEW_ORIGIN_SIMULATED);
    assert_eq!(origins[BREAKER], 0);
}

#[test]
fn theta_and_layers_are_the_programs_too() {
    let scene = scene();
    let mut host = Host::open(&scene);
    let before = host.look_around();
    assert_eq!(host.call(|view| unsafe { busbar_view_set_theta(view, 0.95) }), BusbarStatus::Ok);
    let coarse = host.wait_for_frame("of coarse models", |f| f.pixels != before.pixels);
    assert_eq!(host.call(|view| unsafe { busbar_view_set_theta(view, -1.0) }), BusbarStatus::Ok);
    host.arrive();
    host.wait_for_frame("as before", |f| f.pixels == before.pixels);
    // Labels, which are bright, are an overlay's.
    let hide = |view| unsafe { busbar_view_set_layer(view, c"values".as_ptr(), 0) };
    assert_eq!(host.call(hide), BusbarStatus::Ok);
    let bare = host.wait_for_frame("without labels", |f| {
        f.pixels != before.pixels && f.pixels != coarse.pixels
    });
    assert!(bare.damage[2] > 0, "what changed is told");
    assert_eq!(host.call(|view| unsafe { busbar_view_set_visible(view, 0) }), BusbarStatus::Ok);
    std::thread::sleep(Duration::from_secs(1));
    // A picture that is not drawn grows old, and says so; its viewer is not dead.
    let hidden = host.frame().expect("there is one").liveness;
    assert!(matches!(hidden, BusbarViewLiveness::Live | BusbarViewLiveness::Late), "{hidden:?}");
    assert_eq!(host.call(|view| unsafe { busbar_view_set_visible(view, 1) }), BusbarStatus::Ok);
    host.wait_for_frame("that is live again", |f| f.liveness == BusbarViewLiveness::Live);
}

#[test]
fn a_faulty_configuration_never_replaces_the_scene() {
    let mut scene = scene();
    let mut host = Host::open(&scene);
    let before = host.look_around();
    let good = scene.config.clone();
    scene.config["scene"] = serde_json::json!([{ "id": "x", "model": "none" }]);
    let path = scene.write();
    let null = std::ptr::null();
    assert_eq!(host.call(|view| unsafe { busbar_view_reload(view, null) }), BusbarStatus::Ok);
    let error = host.wait_for(BusbarViewEventKind::Error);
    assert!(
        error.text.contains("the scene before stays") && error.text.contains("'none'"),
        "{error:?}"
    );
    let after = host.wait_for_calm();
    save(&before, "before");
    save(&after, "after");
    assert!(after.pixels == before.pixels, "the picture is another");
    scene.config = good;
    scene.config["theme"]["background"] = serde_json::json!("#204060");
    scene.write();
    assert_eq!(host.call(|view| unsafe { busbar_view_reload(view, null) }), BusbarStatus::Ok);
    let reloaded = host.wait_for(BusbarViewEventKind::Reloaded);
    assert_eq!(reloaded.id, path.to_str().unwrap());
    host.wait_for_frame("of the new scene", |f| {
        f.liveness == BusbarViewLiveness::Live && f.pixels != before.pixels
    });
}

#[test]
fn wrong_use_is_refused_and_touches_nothing() {
    let scene = scene();
    let path = CString::new(scene.write().into_os_string().into_encoded_bytes()).unwrap();
    let options = BusbarViewOptions {
        struct_size: size_of::<BusbarViewOptions>() as u32,
        flags: 0,
        width: 64,
        height: 64,
        window_system: BusbarViewWindowSystem::None as u32,
        silent_millis: 0,
        hung_millis: 0,
        max_restart_millis: 0,
        window: 0,
        config: path.as_ptr(),
        program: c"/no/such/program".as_ptr(),
        operator_name: std::ptr::null(),
    };
    for wrong in [
        BusbarViewOptions { struct_size: 8, ..options },
        BusbarViewOptions { flags: 8, ..options },
        BusbarViewOptions { width: 0, ..options },
        BusbarViewOptions { width: 8192, height: 8192, ..options },
        BusbarViewOptions { silent_millis: 1, ..options },
        BusbarViewOptions { silent_millis: 2000, hung_millis: 1000, ..options },
        BusbarViewOptions { window: 1, ..options },
        BusbarViewOptions { window_system: BusbarViewWindowSystem::X11 as u32, ..options },
        BusbarViewOptions { window_system: 99, window: 1, ..options },
        BusbarViewOptions { config: std::ptr::null(), ..options },
        BusbarViewOptions { config: c"\xff".as_ptr(), ..options },
    ] {
        let mut view = std::ptr::dangling_mut();
        assert_eq!(unsafe { busbar_view_open(&wrong, &mut view) }, BusbarStatus::Invalid);
        assert!(view.is_null());
    }
    let mut view = std::ptr::null_mut();
    assert_eq!(unsafe { busbar_view_open(&options, &mut view) }, BusbarStatus::Ok);
    unsafe {
        let null = std::ptr::null();
        assert_eq!(busbar_view_pick(null, 1, 1), BusbarStatus::Invalid);
        assert_eq!(busbar_view_set_theta(view, 1.5), BusbarStatus::Invalid);
        assert_eq!(busbar_view_set_theta(view, f64::NAN), BusbarStatus::Invalid);
        assert_eq!(
            busbar_view_look(view, [f64::NAN; 3].as_ptr(), [0.0; 3].as_ptr()),
            BusbarStatus::Invalid
        );
        assert_eq!(busbar_view_use_camera(view, null.cast()), BusbarStatus::Invalid);
        assert_eq!(busbar_view_resize(view, 9000, 10), BusbarStatus::Invalid);
        assert_eq!(
            busbar_view_mirror_alarm(view, c"a".as_ptr(), b'Z'.into()),
            BusbarStatus::Invalid
        );
        assert_eq!(
            busbar_view_next_event(view, std::ptr::null_mut()),
            BusbarStatus::Invalid as i32
        );
        let wrong = BusbarViewTag { kind: 99, ..tag() };
        assert_eq!(busbar_view_set_tags(view, &wrong, 1), BusbarStatus::Invalid);
        let wrong = BusbarViewTag { quality: 3, ..tag() };
        assert_eq!(busbar_view_set_tags(view, &wrong, 1), BusbarStatus::Invalid);
        let nobody = std::ptr::null();
        assert_eq!(
            busbar_view_act_on_alarm(view, c"a".as_ptr(), 0, 0, nobody),
            BusbarStatus::Invalid
        );
        assert_eq!(busbar_view_point(view, 0, 0.0, 0.0, 1, 0.0), BusbarStatus::Invalid);
        // A viewer that cannot be started is an error, told again and again, and no end.
        let mut event = no_event();
        let start = std::time::Instant::now();
        while busbar_view_next_event(view, &mut event) != 1 {
            assert!(start.elapsed() < PATIENCE);
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!(event.kind, BusbarViewEventKind::Error);
        assert!(Happened::from_event(&event).text.contains("/no/such/program"));
        // What waits has a limit, and callers hear of it.
        let full = (0..100_000).find(|_| busbar_view_pick(view, 1, 1) == BusbarStatus::Full);
        assert_eq!(full, Some(4096));
        busbar_view_close(view);
        busbar_view_close(std::ptr::null_mut());
    }
}

fn tag() -> BusbarViewTag {
    BusbarViewTag {
        id: c"tag".as_ptr(),
        kind: BusbarViewValueKind::F64 as u32,
        quality: BusbarViewQuality::Good as u32,
        source_unix_nanos: BUSBAR_VIEW_NO_TIME,
        number: 1.0,
        integer: 0,
        text: std::ptr::null(),
    }
}

#[test]
fn texts_of_the_program_raise_alarms_and_are_marked_where_they_are_cut() {
    let mut scene = scene();
    scene.config["tags"]["Mode"] =
        serde_json::json!({ "type": "text", "set_by_host": true, "freshness_seconds": 600 });
    scene.config["alarms"]["By hand"] = serde_json::json!({
        "tag": "Mode", "condition": { "equals": "MANUAL" }, "message": "The bay is run by hand",
    });
    let mut host = Host::open(&scene);
    let set = |host: &mut Host, text: &CStr| {
        let (kind, text) = (BusbarViewValueKind::Text as u32, text.as_ptr());
        let update = BusbarViewTag { id: c"Mode".as_ptr(), kind, text, ..tag() };
        // SAFETY: one tag, whose texts live for the call.
        host.call(|view| unsafe { busbar_view_set_tags(view, &raw const update, 1) })
    };
    let quality = |wanted| {
        move |e: &Happened| {
            e.kind == BusbarViewEventKind::Quality && e.id == "Mode" && e.quality == wanted
        }
    };
    let alarm = |wanted| {
        move |e: &Happened| {
            e.kind == BusbarViewEventKind::Alarm && e.id == "By hand" && e.alarm_state == wanted
        }
    };
    assert_eq!(set(&mut host, c"MANUAL"), BusbarStatus::Ok);
    // Alarms are told before qualities.
    host.wait("alarm of the text", alarm(BusbarViewAlarmState::Unacknowledged));
    host.wait("good text", quality(BusbarViewQuality::Good));
    assert_eq!(set(&mut host, c"AUTO"), BusbarStatus::Ok);
    host.wait("end of the alarm", alarm(BusbarViewAlarmState::ReturnedUnacknowledged));
    let long = CString::new("x".repeat(300)).unwrap();
    for partial in [long.as_c_str(), c"AUT\xff"] {
        assert_eq!(set(&mut host, partial), BusbarStatus::Ok);
        host.wait("text of which a part is taken", quality(BusbarViewQuality::Uncertain));
        assert_eq!(set(&mut host, c"AUTO"), BusbarStatus::Ok);
        host.wait("whole text", quality(BusbarViewQuality::Good));
    }
    let without =
        BusbarViewTag { id: c"Mode".as_ptr(), kind: BusbarViewValueKind::Text as u32, ..tag() };
    // SAFETY: as above.
    let status = host.call(|view| unsafe { busbar_view_set_tags(view, &raw const without, 1) });
    assert_eq!(status, BusbarStatus::Invalid);
}

#[test]
fn every_status_has_a_text() {
    let text = |status: i32| unsafe { CStr::from_ptr(busbar_status_text(status)) };
    let texts: BTreeSet<_> = (-5..=0).map(text).collect();
    assert_eq!(texts.len(), 6, "{texts:?}");
    assert_eq!(text(BusbarStatus::Ok as i32), c"success");
    assert_eq!(text(i32::MIN), text(7));
}

extern "C" fn note(context: *mut std::ffi::c_void, event: *const BusbarViewEvent) {
    // SAFETY: the test's list, which outlives the view.
    let list = unsafe {
        &*context.cast::<std::sync::Mutex<Vec<(BusbarViewEventKind, std::thread::ThreadId)>>>()
    };
    // SAFETY: as the header says.
    let kind = unsafe { (*event).kind };
    list.lock().expect("nobody panicked").push((kind, std::thread::current().id()));
}

#[test]
fn callbacks_run_where_the_program_says() {
    let scene = scene();
    for on_own_thread in [0, 1] {
        let list = Box::new(std::sync::Mutex::new(Vec::<(
            BusbarViewEventKind,
            std::thread::ThreadId,
        )>::new()));
        let mut host = Host::open(&scene);
        let context = (&raw const *list).cast_mut().cast();
        let set =
            |view| unsafe { busbar_view_set_callback(view, Some(note), context, on_own_thread) };
        assert_eq!(host.call(set), BusbarStatus::Ok);
        let start = std::time::Instant::now();
        while !list.lock().unwrap().iter().any(|(kind, _)| *kind == BusbarViewEventKind::Ready) {
            assert!(start.elapsed() < PATIENCE);
            std::thread::sleep(Duration::from_millis(20));
            if on_own_thread == 0 {
                assert!(host.call(|view| unsafe { busbar_view_dispatch(view) }) >= 0);
            }
        }
        let here = std::thread::current().id();
        let threads: BTreeSet<_> = list.lock().unwrap().iter().map(|(_, id)| *id == here).collect();
        assert_eq!(threads, BTreeSet::from([on_own_thread == 0]));
        drop(host);
        let count = list.lock().unwrap().len();
        std::thread::sleep(Duration::from_millis(300));
        assert_eq!(list.lock().unwrap().len(), count, "none after the end");
    }
}
