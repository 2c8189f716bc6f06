//! Pictures of a real viewer at a page: flow control, none at rest, and never an old one marked
//! live.

mod common;

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use common::*;
use e2e::Scene;
use serde_json::json;

const SIZE: [u32; 2] = [480, 300];
/// Bytes a second that a page costs where nothing changes: five beats, and words where a busy
/// machine makes the viewer late.
const MAX_REST: usize = 400;
/// A line of 1 Mbit/s, and a page that is large for it.
const SLOW_LINE: usize = 125_000;
const LARGE: [u32; 2] = [1000, 640];
/// Pictures that a test of a slow line waits for.
const ENOUGH: usize = 8;
/// A page takes a server for silent after a second; a busy machine adds its turns.
const MAX_GAP: Duration = Duration::from_millis(1300);
/// Longest time from a viewer's end until pages are told, on a busy machine.
const MAX_UNNOTICED: Duration = Duration::from_millis(1600);

/// Greatest mean difference, of 255: the camera comes back to where it was, but for rounding.
const MAX_DIFFERENCE: f64 = 1.0;

fn mean_difference(one: &[u8], other: &[u8]) -> f64 {
    assert_eq!(one.len(), other.len());
    let sum: u64 = one.iter().zip(other).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
    sum as f64 / one.len() as f64
}

/// A scene in which nothing changes by itself.
fn scene() -> Scene {
    let mut scene = Scene::without_tags();
    scene.config["camera"]["transition_seconds"] = json!(0);
    scene
}

async fn calm_page(server: &busbar_web::Server) -> Page {
    let mut page = Page::open(server).await;
    page.view(SIZE, true).await;
    page.until("picture of its size", |page| page.size == SIZE).await;
    page.until_calm().await;
    page
}

#[tokio::test]
#[allow(clippy::print_stderr)]
async fn a_picture_comes_without_loss_and_rests_for_nothing() {
    let scene = scene();
    let server = start(&showing(&scene));
    let mut page = calm_page(&server).await;
    let colors: BTreeSet<_> = page.pixels.chunks(3).map(<[u8]>::to_vec).collect();
    assert!(colors.len() > 100, "a scene has more than {} colours", colors.len());
    assert!(page.kinds.contains(&0) && page.kinds.last() == Some(&1), "quick, then sharp");
    // Another page, whatever it was sent, shows the same to the last bit.
    let mut other = Page::open(&server).await;
    other.until_calm().await;
    assert_eq!(other.size, SIZE, "that of the page that steers");
    assert!(other.pixels == page.pixels, "two pages show different pictures");
    let (before, time) = (page.bytes, Duration::from_secs(4));
    page.listen_for(time).await;
    let rate = (page.bytes - before) / time.as_secs() as usize;
    eprintln!("at rest: {rate} bytes a second");
    assert!(rate <= MAX_REST, "{rate} bytes a second at rest");
    assert_eq!(page.condition(), "live");
}

#[tokio::test]
async fn who_shows_nothing_is_sent_nothing_and_told_that_it_is_behind() {
    let scene = scene();
    let server = start(&showing(&scene));
    let mut page = calm_page(&server).await;
    let before = page.pixels.clone();
    page.answers = false;
    let shown = page.pictures;
    page.drag([200.0, 150.0], [120.0, 20.0]).await;
    page.until("beat that it is behind", |page| page.condition() == "behind").await;
    assert_eq!(page.pictures, shown + 1, "one at a time");
    page.listen_for(Duration::from_secs(1)).await;
    assert_eq!((page.pictures, page.condition()), (shown + 1, "behind"));
    page.answers = true;
    page.say(json!({"shown": page.number})).await;
    page.until("live beat", |page| page.condition() == "live").await;
    page.until_calm().await;
    assert!(page.pixels != before, "it turned");
    // One that nobody sees is sent nothing, and catches up once it is seen.
    page.view(SIZE, false).await;
    page.listen_for(Duration::from_millis(500)).await;
    let shown = page.pictures;
    page.drag([200.0, 150.0], [-90.0, 10.0]).await;
    page.listen_for(Duration::from_secs(2)).await;
    assert_eq!(page.pictures, shown);
    // Nothing is drawn for nobody: its picture is behind what was asked for, or of values of before.
    assert!(["behind", "late"].contains(&page.condition()), "{}", page.condition());
    page.view(SIZE, true).await;
    page.until("picture", |page| page.pictures > shown).await;
    page.until("live beat", |page| page.condition() == "live").await;
}

#[tokio::test]
async fn a_probe_is_echoed_with_the_age_of_what_the_page_shows() {
    let scene = scene();
    let server = start(&showing(&scene));
    let mut page = calm_page(&server).await;
    for number in [7, 8, 4_294_967_295_u32] {
        page.say(json!({ "probe": number })).await;
        let is_echoed = |page: &Page| page.beat().is_some_and(|beat| beat[3] == json!(number));
        page.until("echo", is_echoed).await;
    }
    // The newest true picture is not the page's until the page shows it.
    page.answers = false;
    page.drag([200.0, 150.0], [120.0, 20.0]).await;
    let shown_until = Instant::now();
    page.until("beat that it is behind", |page| page.condition() == "behind").await;
    page.listen_for(Duration::from_secs(1)).await;
    let before = shown_until.elapsed();
    page.heard.clear();
    page.say(json!({ "probe": 9 })).await;
    page.until("echo", |page| page.beat().is_some_and(|beat| beat[3] == json!(9))).await;
    let age = page.beat().and_then(|beat| beat[1].as_u64()).expect("an age");
    assert!(u128::from(age) >= before.as_millis(), "{age} ms after {before:?}");
}

#[tokio::test]
async fn one_page_steers_and_what_it_picks_is_told_to_all() {
    let scene = scene();
    let server = start(&showing(&scene));
    let mut first = calm_page(&server).await;
    let mut second = Page::open(&server).await;
    second.until_calm().await;
    let before = second.pixels.clone();
    second.drag([200.0, 150.0], [120.0, 20.0]).await;
    second.say(json!({"focus": "=S12D1T1-TA1"})).await;
    second.until("refusal", |page| page.was_told("refused").is_some()).await;
    second.until_calm().await;
    assert!(second.pixels == before, "a page that looks turned the view");
    first.say(json!({"focus": "=S12D1T1-TA1"})).await;
    first.listen_for(Duration::from_secs(1)).await;
    first.until_calm().await;
    first.say(json!({"pick": [SIZE[0] / 2, SIZE[1] / 2]})).await;
    let picked = |page: &Page| {
        page.was_told("picked").and_then(|id| id.as_str()).is_some_and(|id| id.starts_with("=S12"))
    };
    first.until("pick", picked).await;
    second.until("pick", picked).await;
    second.say(json!("steer")).await;
    second.until("control", |page| page.was_told("steers") == Some(&json!(true))).await;
    first.until("loss of it", |page| page.was_told("steers") == Some(&json!(false))).await;
    second.view([320, 200], true).await;
    first.until("the other's size", |page| page.size == [320, 200]).await;
    let before = second.pixels.clone();
    second.say(json!({"key": {"key": "F5", "pressed": true}})).await;
    second.say(json!({"key": {"key": "F5", "pressed": false}})).await;
    second.until("view from above", |page| page.pixels != before).await;
}

#[tokio::test]
#[allow(clippy::print_stderr)]
async fn a_viewer_that_dies_is_told_of_and_comes_back() {
    let scene = scene();
    let server = start(&showing(&scene));
    let mut page = calm_page(&server).await;
    let before = page.pixels.clone();
    for signal in [rustix::process::Signal::KILL, rustix::process::Signal::STOP] {
        let viewer = server.viewer().expect("one runs");
        let pid = rustix::process::Pid::from_raw(viewer as i32).expect("a process");
        page.heard.clear();
        rustix::process::kill_process(pid, signal).expect("it is there");
        let struck = Instant::now();
        page.until("beat that it is lost", |page| page.condition() == "lost").await;
        let noticed = struck.elapsed();
        eprintln!("{signal:?}: told after {} ms", noticed.as_millis());
        assert!(noticed < MAX_UNNOTICED, "{signal:?}: live for {noticed:?}");
        page.until("live beat", |page| page.condition() == "live").await;
        assert_ne!(server.viewer(), Some(viewer), "it is another process");
        page.until_calm().await;
        let difference = mean_difference(&page.pixels, &before);
        assert!(difference < MAX_DIFFERENCE, "it differs by {difference} of 255 in the mean");
    }
}

#[tokio::test]
#[allow(clippy::print_stderr)]
async fn a_slow_line_gets_worse_pictures_and_hears_beats_all_the_while() {
    let scene = scene();
    let server = start(&showing(&scene));
    let mut page = Page::open_slowly(&server, SLOW_LINE).await;
    page.view(LARGE, true).await;
    page.until("picture of its size", |page| page.size == LARGE).await;
    page.until_calm().await;
    (page.longest_gap, page.kinds) = (Duration::ZERO, Vec::new());
    let (before, started) = (page.pictures, Instant::now());
    let mut by = 200.0;
    while page.pictures < before + ENOUGH {
        assert!(started.elapsed() < PATIENCE, "it does not move");
        page.drag([300.0, 300.0], [by, 10.0]).await;
        by = -by;
    }
    let (pictures, took) = (page.pictures - before, started.elapsed().as_secs_f64());
    page.until_calm().await;
    eprintln!(
        "{pictures} pictures in {took:.1} s over {SLOW_LINE} bytes a second, silent for at most {} ms",
        page.longest_gap.as_millis()
    );
    assert!(page.longest_gap < MAX_GAP, "silent for {:?}", page.longest_gap);
    // However it came here, it is what a page on a good line has.
    let mut other = Page::open(&server).await;
    other.until_calm().await;
    assert!(other.pixels == page.pixels, "two pages show different pictures");
}
