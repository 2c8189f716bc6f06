//! The web page in a real browser: an operator's hands, an HMI of another origin around it,
//! and ends of viewer, server and network that must not look live.
//!
//! `BUSBAR_PICTURES` names a folder for screenshots.

mod web_browser;

use std::time::Duration;

use e2e::{busbar, wait_for, workspace_path};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::{Value, json};
use web_browser::*;

const TRANSFORMER: &str = "=S12D1T1-TA1";
/// Bytes a second that a page costs where nothing changes: five beats, and words where a busy
/// machine makes the viewer late.
const MAX_REST: u64 = 400;
/// Longest time after a fault in which the picture passes for live, milliseconds.
const MAX_UNMARKED: u64 = 1000;

#[test]
#[allow(clippy::print_stderr)]
fn an_operator_sees_turns_and_comes_near() {
    let Some(mut browser) = Browser::start() else { return };
    let scene = scene();
    let (_server, address) = serve(&scene, "127.0.0.1:0", TOKEN, &[]);
    let refused = browser.ask("open", json!(address));
    assert_eq!(refused["status"], json!(401));
    assert!(refused["text"].as_str().is_some_and(|text| text.contains("token")), "{refused}");
    // The browser tells of the refusal; of nothing else from here on.
    let told = browser.ask("errors", Value::Null).to_string();
    assert!(told.contains("401"), "{told}");
    drop(browser);

    let Some(mut browser) = Browser::start() else { return };
    let opened = browser.ask("open", json!(format!("{address}?token={TOKEN}")));
    assert_eq!(opened["status"], json!(200));
    browser.until_live();
    let first = browser.until_calm();
    assert_eq!((&first["width"], &first["height"]), (&json!(1000), &json!(640)));
    assert!(first["colors"].as_u64().is_some_and(|colors| colors > 200), "{first}");
    let state = browser.ask("state", Value::Null);
    let shown = state["address"].as_str().expect("a text");
    assert!(!shown.contains(TOKEN), "whoever looks over a shoulder sees no token: {shown}");
    browser.shot("web_first");

    let drag =
        json!([["move", 500, 320], ["down"], ["move", 560, 330], ["move", 640, 340], ["up"]]);
    let turned = browser.turn("mouse", drag);
    assert_ne!(turned["sum"], first["sum"]);
    browser.turn("mouse", json!([["wheel", -400]]));
    browser.turn("key", json!("F5"));
    browser.shot("web_turned");
    // A finger turns, two move and pinch.
    browser.turn("touch", json!([[[0, 500, 320]], [[0, 530, 325]], [[0, 600, 330]], []]));
    browser.turn(
        "touch",
        json!([
            [[0, 450, 320]],
            [[0, 450, 320], [1, 550, 320]],
            [[0, 420, 330], [1, 600, 330]],
            [[0, 380, 330], [1, 660, 330]],
            [[0, 380, 330]],
            [],
        ]),
    );
    browser.shot("web_touched");

    let (before, time) = (browser.ask("received", Value::Null), Duration::from_secs(5));
    browser.ask("wait", json!(time.as_millis() as u64));
    let bytes = browser.ask("received", Value::Null).as_u64().unwrap_or(u64::MAX)
        - before.as_u64().unwrap_or(0);
    let rate = bytes / time.as_secs();
    eprintln!("at rest: {rate} bytes a second");
    assert!((20..=MAX_REST).contains(&rate), "{rate} bytes a second at rest");
    // The page is opened anew by its cookie.
    let anew = browser.ask("open", json!(address));
    assert_eq!(anew["status"], json!(200));
    browser.until_live();
    browser.expect_no_errors();
}

#[test]
fn an_hmi_of_another_origin_focuses_picks_and_hears() {
    let Some(mut browser) = Browser::start() else { return };
    let scene = scene();
    let origin = browser.ask("origin", json!(workspace_path("host/remote/web/examples")));
    let origin = origin.as_str().expect("a text").to_owned();
    let (_server, address) =
        serve(&scene, "127.0.0.1:0", TOKEN, &["--allow-origin", origin.as_str()]);
    let escaped = format!("{address}?token={TOKEN}").replace(':', "%3A").replace('?', "%3F");
    browser.ask("open", json!(format!("{origin}/hmi.html?view={escaped}")));
    browser.until_live();
    let hears = |browser: &mut Browser, id: &str, wanted: &str| {
        wait_for(wanted, PATIENCE, || {
            let texts = browser.ask("texts", json!([id]));
            texts[id].as_str().is_some_and(|text| text.starts_with(wanted)).then_some(())
        });
    };
    hears(&mut browser, "state", "live");
    hears(&mut browser, "alarms", "0");
    browser.until_calm();
    browser.ask("fill", json!(["equipment", TRANSFORMER]));
    browser.turn("click", json!("focus"));
    // The middle of the frame: 712 x 595 below the bar.
    browser.ask("mouse", json!([["move", 356, 342], ["down"], ["up"]]));
    hears(&mut browser, "picked", TRANSFORMER);
    browser.turn("fill", json!(["theta", "0.95"]));
    browser.shot("web_hmi");
    browser.ask("fill", json!(["equipment", "=NOT"]));
    browser.ask("click", json!("focus"));
    hears(&mut browser, "refused", "there is no equipment '=NOT'");
    browser.expect_no_errors();
    drop(browser);

    // Others may not embed it: the browser leaves the frame empty.
    let Some(mut browser) = Browser::start() else { return };
    let other = browser.ask("origin", json!(workspace_path("host/remote/web/examples")));
    let other = other.as_str().expect("a text").to_owned();
    let _ = browser.attempt("open", json!(format!("{other}/hmi.html?view={escaped}")));
    browser.ask("wait", json!(2000));
    assert_eq!(browser.ask("texts", json!(["state"]))["state"], json!("none"));
    let errors = browser.ask("errors", Value::Null).to_string();
    assert!(errors.contains("frame-ancestors"), "{errors}");
}

#[test]
#[allow(clippy::print_stderr)]
fn nothing_old_passes_for_live() {
    let Some(mut browser) = Browser::start() else { return };
    let scene = scene();
    let (server, address) = serve(&scene, "127.0.0.1:0", TOKEN, &[]);
    browser.ask("open", json!(format!("{address}?token={TOKEN}")));
    browser.until_live();
    let before = browser.until_calm();
    let marked = |browser: &mut Browser, what: &str, words: &str, strike: &dyn Fn()| {
        browser.watch();
        let struck = wall_millis();
        strike();
        browser.until("dead", |state| state["dead"] == json!(true));
        let first = browser.live_spans().first().map_or(struck, |[_, end]| *end);
        let took = first.saturating_sub(struck);
        eprintln!("{what}: marked after {took} ms");
        assert!(took <= MAX_UNMARKED, "{what}: marked after {took} ms");
        browser.until_dead(words)
    };

    let viewer = Pid::from_raw(viewer_of(&server) as i32).expect("a process");
    let kill = || kill_process(viewer, Signal::KILL).expect("it is there");
    let lost = marked(&mut browser, "viewer killed", "Viewer lost", &kill);
    // The system may take a while to end a process: no frame comes from it before.
    let whys = ["ended", "no frame for", "silent for"];
    let why = lost["why"].as_str().expect("a text");
    assert!(why.is_empty() || whys.iter().any(|words| why.contains(words)), "{lost}");
    browser.shot("web_lost");
    browser.until_live();
    let back = browser.until_calm();
    assert_eq!([&back["width"], &back["height"]], [&before["width"], &before["height"]]);

    let silent = marked(&mut browser, "server stopped", "The server is silent", &|| {
        server.signal(Signal::STOP)
    });
    let age = silent["age"].as_str().and_then(|age| age.split(' ').nth(1)?.parse::<f64>().ok());
    // Silence is seen within `MAX_UNMARKED`, so the age begins below a second.
    assert!(age.is_some_and(|age| (0.3..5.0).contains(&age)), "{silent}");
    browser.shot("web_silent");
    server.signal(Signal::CONT);
    browser.until_live();

    let listen = address.trim_start_matches("http://").trim_end_matches('/').to_owned();
    marked(&mut browser, "server killed", "No connection", &|| server.signal(Signal::KILL));
    drop(server);
    let (server, _) = serve(&scene, &listen, TOKEN, &[]);
    browser.until_live();
    assert_eq!(browser.until_calm(), before, "as before");

    server.signal(Signal::KILL);
    drop(server);
    let _server = serve(&scene, &listen, "another_token_0123456789", &[]);
    browser.until_dead("the server refuses this page's token");
    browser.shot("web_refused");
}

#[test]
fn faults_of_a_start_are_told_with_a_remedy() {
    let scene = scene();
    let config = scene.write();
    let fault = |arguments: &[&str], token: Option<&str>| {
        let mut command = busbar();
        command.arg("serve").arg(&config).args(arguments).env_remove("BUSBAR_TOKEN");
        command.envs(token.map(|token| ("BUSBAR_TOKEN", token)));
        let output = e2e::finish(&mut command);
        assert!(matches!(output.code, Some(1 | 2)), "{output:?}");
        output.stderr
    };
    let taken = std::net::TcpListener::bind("127.0.0.1:0").expect("a free port");
    let taken = taken.local_addr().expect("it has one").to_string();
    let file = scene.path("token");
    std::fs::write(&file, "short\n").expect("it can be written");
    let file = file.to_str().expect("UTF-8");
    for (arguments, token, words) in [
        (&["--listen", taken.as_str()][..], None, &["cannot listen", "--listen"][..]),
        (&["--listen", "0.0.0.0:0"], None, &["--insecure-remote", "TLS"]),
        (&["--listen", "here"], None, &["--listen"]),
        (&["--token-file", "/no/such/file"], None, &["/no/such/file", "remedy"]),
        (&["--token-file", file], None, &["5 characters", "at least 16", "chmod 600"]),
        (&[], Some("with space in it, and long"), &["BUSBAR_TOKEN", "letters"]),
        (&["--allow-origin", "hmi.example"], None, &["https://hmi.example"]),
        (&["--clients", "99"], None, &["1 to 16"]),
    ] {
        let said = fault(arguments, token);
        assert!(words.iter().all(|word| said.contains(word)), "{arguments:?}: {said}");
    }
    // A scene that cannot be shown ends the server, for whoever started it to see.
    let mut broken = scene;
    broken.config["scene"] = json!([{ "id": "x", "model": "none" }]);
    broken.write();
    let said = fault(&["--listen", "127.0.0.1:0"], None);
    assert!(said.contains("'none'"), "{said}");
}
