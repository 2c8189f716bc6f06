//! Interrogations, each to its end before the next: by `iec104`, which hands the values
//! to the host, and by c104's client.

use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use busbar_plugin_host::{SourcePolicy, TelemetryTag};
use busbar_plugin_process::RunningTelemetry;
use serde::Serialize;
use serde_json::{Value, json};

use super::peer::{Peer, number};
use super::{PATIENCE, Peers, ROUNDS, Rates, device, ensure_none_lost, free_port, good};
use crate::scene::{GeneratedScene, telemetry_tag};

const PLUGIN: &str = "iec104";
/// Number of points of a common address, and of an interrogation.
pub(crate) const POINTS: u32 = 5000;
/// Number of common addresses, as many as the plugin's limit of tags allows.
const ADDRESSES: u32 = 20;
/// Shortest interrogation period that the settings allow, milliseconds; then all common addresses
/// are asked, one after the other.
const PERIOD_MILLIS: u32 = 1000;
/// Polling period of received values.
const PAUSE: Duration = Duration::from_micros(500);

/// Milliseconds of one interrogation of [`POINTS`], one for each round.
#[derive(Debug, Serialize)]
pub(crate) struct Interrogations {
    pub(crate) server: &'static str,
    /// Seconds from the plugin's start, with connecting and the start of data transfer, until the
    /// host has all values.
    pub(crate) ours: Vec<f64>,
    /// Seconds from the request to its end, on an open connection.
    pub(crate) peers: Vec<f64>,
}

pub(crate) fn measure(
    site: &GeneratedScene,
    peers: &Peers,
) -> Result<(Vec<Rates>, Vec<Interrogations>)> {
    let port = free_port()?;
    let device = device(site, PLUGIN, &settings(port), &tags(ADDRESSES))?;
    let (rates, interrogations) = alternate(site, peers, "busbar simulate", port)?;
    drop(device);
    let floats = json!({ "floats": { "common_addresses": ADDRESSES, "points": POINTS } });
    let server = peers.start("iec104_c104.py", &[floats.to_string()])?;
    let port = server.greeting.parse()?;
    let (more_rates, more_interrogations) = alternate(site, peers, "c104", port)?;
    Ok((vec![rates, more_rates], vec![interrogations, more_interrogations]))
}

fn alternate(
    site: &GeneratedScene,
    peers: &Peers,
    server: &'static str,
    port: u16,
) -> Result<(Rates, Interrogations)> {
    let arguments = [u32::from(port), ADDRESSES].map(|number| number.to_string());
    let mut client = peers.start("iec104_rate.py", &arguments)?;
    let mut rates = Rates { server, ours: Vec::new(), peers: Vec::new() };
    let mut interrogations = Interrogations { server, ours: Vec::new(), peers: Vec::new() };
    for _ in 0..ROUNDS {
        rates.ours.push(points_per_second(site, port)?);
        let seconds = peer_seconds(&mut client, ADDRESSES)?;
        rates.peers.push(f64::from(ADDRESSES * POINTS) / seconds);
        interrogations.ours.push(first_interrogation(site, port)?.as_secs_f64() * 1e3);
        interrogations.peers.push(peer_seconds(&mut client, 1)? * 1e3);
    }
    Ok((rates, interrogations))
}

/// Measures points a second in the second interrogation of all common addresses, from the first to
/// the last of their values: in the first one all is new to the plugin.
fn points_per_second(site: &GeneratedScene, port: u16) -> Result<f64> {
    let all = ADDRESSES * POINTS;
    let plugin = site.plugin(PLUGIN, &settings(port))?;
    let telemetry = RunningTelemetry::start(&plugin, &tags(ADDRESSES), SourcePolicy::default())?;
    take(&telemetry, all)?;
    let mut first = 0;
    let waiting = Instant::now();
    while first == 0 {
        ensure!(waiting.elapsed() < PATIENCE, "no second interrogation");
        std::thread::sleep(PAUSE);
        first = good(&telemetry);
    }
    let begun = Instant::now();
    let rest = all.saturating_sub(first);
    take(&telemetry, rest)?;
    ensure_none_lost(&telemetry)?;
    Ok(f64::from(rest) / begun.elapsed().as_secs_f64())
}

fn first_interrogation(site: &GeneratedScene, port: u16) -> Result<Duration> {
    let plugin = site.plugin(PLUGIN, &settings(port))?;
    let tags = tags(1);
    let begun = Instant::now();
    let telemetry = RunningTelemetry::start(&plugin, &tags, SourcePolicy::default())?;
    take(&telemetry, POINTS)?;
    Ok(begun.elapsed())
}

/// Waits for so many good values.
fn take(telemetry: &RunningTelemetry, count: u32) -> Result<()> {
    let (begun, mut found) = (Instant::now(), 0);
    while found < count {
        ensure!(begun.elapsed() < PATIENCE, "{found} of {count} values: {:?}", telemetry.link());
        std::thread::sleep(PAUSE);
        found += good(telemetry);
    }
    Ok(())
}

/// Runs one interrogation by the peer; returns its seconds.
fn peer_seconds(client: &mut Peer, addresses: u32) -> Result<f64> {
    let answer = client.ask(&json!({ "addresses": addresses }))?;
    let points = number(&answer, "points")?;
    ensure!(points == f64::from(addresses * POINTS), "the peer has {points} points");
    number(&answer, "seconds")
}

fn settings(port: u16) -> Value {
    json!({ "host": "127.0.0.1", "port": port, "interrogation_period_seconds": PERIOD_MILLIS as f64 / 1_000.0 })
}

fn tags(addresses: u32) -> Vec<TelemetryTag> {
    let tag = |tag: u32| {
        let (address, point) = (1 + tag / POINTS, 1 + tag % POINTS);
        telemetry_tag(tag, &json!({ "common_address": address, "ioa": point }))
    };
    (0..addresses * POINTS).map(tag).collect()
}
