//! `sites --library LIB --out FILE.json` measures one viewer's plugin on one Mosquitto that
//! carries a hundred stations of 5,400 points: values a second that reach the tag table, their
//! latency, CPU and memory, beside a bare client on the same broker in the same run. `busbar`
//! must be beside it.
#![allow(clippy::print_stdout, reason = "what was measured is its output")]

mod bare_client;
mod generator;
mod payload;
mod reader;
mod usage;

use std::io::{BufRead, BufReader};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};
use clap::{Parser, Subcommand};
use report_writer::Series;
use serde::Serialize;

use crate::generator::Load;
use crate::payload::PayloadFormat;
use crate::reader::Reader;
use crate::usage::{Usage, cpu_seconds, plugin_process, usage};

const STATIONS: u32 = 100;
const POINTS: u32 = 5400;
/// Loads by payload format, points of all stations a second. The last of each is every point once a
/// second, except for texts, each of which is a message.
const LOADS: [(PayloadFormat, f64); 7] = [
    (PayloadFormat::Sparkplug, 108_000.0),
    (PayloadFormat::Sparkplug, 540_000.0),
    (PayloadFormat::Sparkplug, 1_080_000.0),
    (PayloadFormat::Json, 108_000.0),
    (PayloadFormat::Json, 540_000.0),
    (PayloadFormat::Text, 20_000.0),
    (PayloadFormat::Text, 50_000.0),
];
/// Duration of the measurement of one load, after the births.
const SECONDS: f64 = 15.0;
/// Time for messages in flight after the generator has ended.
const DRAINING: Duration = Duration::from_secs(2);
const BROKER: &str = "/usr/sbin/mosquitto";

#[derive(Parser)]
#[command(subcommand_negates_reqs = true)]
struct Arguments {
    /// Path of the plugin's library.
    #[arg(long, required = true)]
    library: Option<PathBuf>,
    /// Output file of the figures, JSON.
    #[arg(long, required = true)]
    out: Option<PathBuf>,
    /// Payload format to measure alone.
    #[arg(long, value_enum)]
    only: Option<PayloadFormat>,
    #[command(subcommand)]
    part: Option<Subprocess>,
}

#[derive(Subcommand)]
enum Subprocess {
    /// Load generator: publishes as all stations.
    Generate(Load),
    /// Peer client without Busbar.
    Bare {
        /// Port of the broker on this machine.
        port: u16,
    },
}

/// Figures of one load.
#[derive(Debug, Serialize)]
struct Figures {
    form: &'static str,
    /// Rate of all stations that was to be sent, points a second; the rate that was sent follows.
    wanted: f64,
    sent: f64,
    /// Rate of good values that reached the table, a second.
    reached: f64,
    /// Share of the sent values that reached the tag table.
    reached_share: f64,
    /// Number of values that were overtaken in the ring between the plugin's process and the host.
    overtaken: u64,
    /// Latency of values from publication to the table, milliseconds, a frame's wait of 16 ms
    /// included.
    latency_millis: Series,
    plugin: Usage,
    host: Usage,
    broker: Usage,
    bare: Usage,
    /// Rate of messages that the bare client received, a second.
    bare_messages: f64,
}

fn main() -> Result<()> {
    let Arguments { library, out, only, part } = Arguments::parse();
    match part {
        Some(Subprocess::Generate(load)) => {
            let (points, seconds) = generator::run(&load)?;
            println!("{points} {seconds}");
            return Ok(());
        }
        Some(Subprocess::Bare { port }) => return bare_client::run(port),
        None => {}
    }
    let library = library.context("which library?")?;
    let folder = tempfile::tempdir()?;
    let name = library.file_name().context("a library without a name")?;
    std::fs::copy(&library, folder.path().join(name)).context("was the plugin built?")?;
    let mut all = Vec::new();
    for (form, rate) in LOADS.into_iter().filter(|(form, _)| only.is_none_or(|only| only == *form))
    {
        let figures = measure(folder.path(), form, rate)?;
        print_figures(&figures);
        all.push(figures);
    }
    let out = out.context("where to?")?;
    std::fs::write(&out, serde_json::to_vec_pretty(&all)?)?;
    println!("{}", out.display());
    Ok(())
}

fn measure(libraries: &Path, form: PayloadFormat, rate: f64) -> Result<Figures> {
    let (broker, port) = broker()?;
    let bare = BareClient::start(port)?;
    let tags = form.tags(STATIONS, POINTS);
    let mut reader = Reader::start(libraries.to_owned(), form, port, &tags)?;
    let mut generator = ChildGuard(generator_of(port, form, rate)?);
    // Births are not values of the measurement.
    let births = Instant::now();
    while births.elapsed() < Duration::from_secs(2) {
        reader.frame();
    }
    reader.taken = reader::ReceivedValues::default();
    let plugin = plugin_process()?;
    let processes = [plugin, std::process::id(), broker.0.id(), bare.child.0.id()];
    let before: Vec<f64> = processes.into_iter().map(cpu_seconds).collect::<Result<_>>()?;
    let (start, bare_before) = (Instant::now(), bare.messages());
    while generator.0.try_wait()?.is_none() {
        reader.frame();
    }
    let seconds = start.elapsed().as_secs_f64();
    let bare_messages = (bare.messages() - bare_before) as f64 / seconds;
    let draining = Instant::now();
    while draining.elapsed() < DRAINING {
        reader.frame();
    }
    let mut used = Vec::new();
    for (process, before) in processes.into_iter().zip(before) {
        used.push(usage(process, before, seconds + DRAINING.as_secs_f64())?);
    }
    let [plugin, host, broker, bare] = used[..] else { anyhow::bail!("processes are missing") };
    let mut line = String::new();
    BufReader::new(generator.0.stdout.take().context("no output")?).read_line(&mut line)?;
    let (points, sending) = line.trim().split_once(' ').context("the generator failed")?;
    let (points, sending): (f64, f64) = (points.parse()?, sending.parse()?);
    Ok(Figures {
        form: form.name(),
        wanted: rate,
        sent: points / sending,
        reached: reader.taken.values as f64 / sending,
        reached_share: reader.taken.values as f64 / points,
        overtaken: reader.lost(),
        latency_millis: Series::from_values(std::mem::take(&mut reader.taken.latencies)),
        plugin,
        host,
        broker,
        bare,
        bare_messages,
    })
}

fn print_figures(figures: &Figures) {
    let Figures { form, wanted, sent, reached, reached_share, latency_millis, .. } = figures;
    println!(
        "{form:9} {wanted:9.0} wanted {sent:9.0} sent {reached:9.0} reached a second ({:.2} %), \
         latency p50 {:.1} ms, p99 {:.1} ms",
        100.0 * reached_share,
        latency_millis.p50,
        latency_millis.p99
    );
    for (name, used) in [
        ("plugin", figures.plugin),
        ("host", figures.host),
        ("broker", figures.broker),
        ("bare", figures.bare),
    ] {
        let Usage { cores, mib, peak_mib } = used;
        println!("          {name:6} {cores:5.2} cores, {mib:5.0} MiB, at most {peak_mib:5.0}");
    }
    println!("          bare client: {:.0} messages a second", figures.bare_messages);
}

/// Guard that kills a process when dropped.
struct ChildGuard(Child);

impl Drop for ChildGuard {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts Mosquitto with its default settings, on a free port.
fn broker() -> Result<(ChildGuard, u16)> {
    let port = TcpListener::bind("127.0.0.1:0")?.local_addr()?.port();
    let mut command = Command::new(BROKER);
    command.args(["-p", &port.to_string()]).stdout(Stdio::null()).stderr(Stdio::null());
    let child = ChildGuard(command.spawn().context("no mosquitto: install the package mosquitto")?);
    let start = Instant::now();
    while TcpStream::connect(("127.0.0.1", port)).is_err() {
        ensure!(start.elapsed() < Duration::from_secs(10), "mosquitto does not listen");
        std::thread::sleep(Duration::from_millis(10));
    }
    Ok((child, port))
}

fn generator_of(port: u16, form: PayloadFormat, rate: f64) -> Result<Child> {
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("generate").args(["--port", &port.to_string()]).args(["--form", form.name()]);
    command.args(["--stations", &STATIONS.to_string()]).args(["--points", &POINTS.to_string()]);
    command.args(["--rate", &rate.to_string()]).args(["--seconds", &SECONDS.to_string()]);
    Ok(command.stdout(Stdio::piped()).spawn()?)
}

/// Process of the peer client, with its counts.
struct BareClient {
    child: ChildGuard,
    messages: Arc<Mutex<u64>>,
}

impl BareClient {
    fn start(port: u16) -> Result<Self> {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(["bare", &port.to_string()]).stdout(Stdio::piped());
        let mut child = ChildGuard(command.spawn()?);
        let output = BufReader::new(child.0.stdout.take().context("no output")?);
        let messages = Arc::new(Mutex::new(0));
        let told = Arc::clone(&messages);
        std::thread::spawn(move || {
            for line in output.lines().map_while(Result::ok) {
                let count = line.split(' ').next().and_then(|count| count.parse().ok());
                *told.lock().unwrap_or_else(PoisonError::into_inner) = count.unwrap_or_default();
            }
        });
        Ok(Self { child, messages })
    }

    fn messages(&self) -> u64 {
        *self.messages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
