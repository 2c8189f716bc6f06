//! Reads of 125 holding registers, one at a time: by `modbus_adapter`, which makes 63
//! values of each and hands them to the host, and by pymodbus' asynchronous client.

use std::time::{Duration, Instant};

use anyhow::{Result, ensure};
use busbar_plugin_host::{SourcePolicy, TelemetryTag};
use busbar_plugin_process::RunningTelemetry;
use serde_json::{Value, json};

use super::peer::{Peer, number};
use super::wire::REGISTERS;
use super::{PATIENCE, Peers, ROUNDS, Rates, device, ensure_none_lost, free_port, good};
use crate::scene::{GeneratedScene, telemetry_tag};

const PLUGIN: &str = "modbus_adapter";
/// Number of 32-bit floats in a request; one value of 16 bits fills the rest.
const FLOATS: u32 = REGISTERS / 2;
const VALUES: u32 = FLOATS + 1;
/// Number of poll groups of the shortest period that the settings allow.
const GROUPS: u32 = 8;
const POLL_MILLIS: u32 = 50;
/// Duration of a round; until the first one, the adapter settles.
const ROUND: Duration = Duration::from_secs(3);
const SETTLING: Duration = Duration::from_millis(500);
/// Polling period of received values.
const PAUSE: Duration = Duration::from_millis(10);

/// Layout of the registers: units and blocks.
#[derive(Clone, Copy)]
struct Layout {
    units: u32,
    blocks: u32,
}

/// Layout whose reading takes longer than the period.
const SIMULATOR: Layout = Layout { units: 3, blocks: 500 };
const PYMODBUS: Layout = Layout { units: 1, blocks: 200 };

pub(crate) fn measure(site: &GeneratedScene, peers: &Peers) -> Result<Vec<Rates>> {
    let port = free_port()?;
    let device = device(site, PLUGIN, &settings(port), &tags(SIMULATOR))?;
    let simulator = alternate(site, peers, "busbar simulate", port, SIMULATOR)?;
    drop(device);
    let registers = vec![0; (PYMODBUS.blocks * REGISTERS) as usize];
    let values = json!({ "holding": { "0": registers } });
    let server = peers.start("pymodbus_server.py", &[values.to_string()])?;
    let port = server.greeting.parse()?;
    Ok(vec![simulator, alternate(site, peers, "pymodbus", port, PYMODBUS)?])
}

fn alternate(
    site: &GeneratedScene,
    peers: &Peers,
    server: &'static str,
    port: u16,
    layout: Layout,
) -> Result<Rates> {
    let arguments = [u32::from(port), layout.units, layout.blocks].map(|number| number.to_string());
    let mut client = peers.start("modbus_rate.py", &arguments)?;
    let round = ROUND / site.divisor as u32;
    let mut rates = Rates { server, ours: Vec::new(), peers: Vec::new() };
    for _ in 0..ROUNDS {
        rates.ours.push(adapter_rate(site, port, layout, round)?);
        rates.peers.push(peer_rate(&mut client, round)?);
    }
    Ok(rates)
}

fn adapter_rate(site: &GeneratedScene, port: u16, layout: Layout, round: Duration) -> Result<f64> {
    let plugin = site.plugin(PLUGIN, &settings(port))?;
    let telemetry = RunningTelemetry::start(&plugin, &tags(layout), SourcePolicy::default())?;
    let begun = Instant::now();
    while good(&telemetry) == 0 {
        ensure!(begun.elapsed() < PATIENCE, "no value came: {:?}", telemetry.link());
        std::thread::sleep(PAUSE);
    }
    read_for(&telemetry, SETTLING);
    let begun = Instant::now();
    let values = read_for(&telemetry, round);
    let rate = values as f64 / f64::from(VALUES) / begun.elapsed().as_secs_f64();
    ensure_none_lost(&telemetry)?;
    Ok(rate)
}

/// Counts the good values that arrive in this time.
fn read_for(telemetry: &RunningTelemetry, time: Duration) -> u64 {
    let (begun, mut count) = (Instant::now(), 0);
    while begun.elapsed() < time {
        std::thread::sleep(PAUSE);
        count += u64::from(good(telemetry));
    }
    count
}

fn peer_rate(client: &mut Peer, round: Duration) -> Result<f64> {
    let answer = client.ask(&json!({ "seconds": round.as_secs_f64() }))?;
    Ok(number(&answer, "requests")? / number(&answer, "seconds")?)
}

fn settings(port: u16) -> Value {
    let group =
        |group| (group_name(group), json!({ "poll_seconds": POLL_MILLIS as f64 / 1_000.0 }));
    let groups: serde_json::Map<_, _> = (0..GROUPS).map(group).collect();
    json!({ "host": "127.0.0.1", "port": port, "poll_groups": groups })
}

fn group_name(group: u32) -> String {
    format!("group {group}")
}

/// Returns tags that fill all registers.
fn tags(layout: Layout) -> Vec<TelemetryTag> {
    let mut tags = Vec::new();
    for unit in 1..=layout.units {
        for block in 0..layout.blocks {
            for value in 0..VALUES {
                let format = if value < FLOATS { "f32" } else { "u16" };
                let address = json!({
                    "table": "holding",
                    "register": block * REGISTERS + 2 * value,
                    "type": format,
                    "unit": unit,
                    "poll_group": group_name(block % GROUPS),
                });
                tags.push(telemetry_tag(tags.len() as u32, &address));
            }
        }
    }
    tags
}
