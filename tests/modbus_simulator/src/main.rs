//! A Modbus TCP device for demos and tests: one transformer bay whose values
//! move. README.md has its point map.

mod bank;
mod model;
mod points;
mod server;

use std::io::{Read, Write};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use clap::Parser;
use tokio::net::TcpListener;
use tokio::signal::unix::{SignalKind, signal};
use tokio::time::{MissedTickBehavior, interval};

use crate::bank::Bank;

/// A Modbus TCP device for demos and tests.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Address and port to listen on; port 0 takes a free one.
    #[arg(long, default_value = "127.0.0.1:1502")]
    listen: SocketAddr,
    /// Point map in JSON, instead of the built-in transformer bay.
    #[arg(long)]
    points: Option<PathBuf>,
    /// The same seed gives the same values.
    #[arg(long, default_value_t = 1)]
    seed: u64,
}

fn main() -> Result<()> {
    let arguments = Arguments::parse();
    let map = match &arguments.points {
        Some(path) => read_map(path)?,
        None => points::DEMO.to_owned(),
    };
    let bank = points::parse(&map).and_then(|points| Bank::new(points, arguments.seed));
    let bank = bank.with_context(|| match &arguments.points {
        Some(path) => path.display().to_string(),
        None => "built-in map".into(),
    })?;
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(run(arguments.listen, bank))
}

fn read_map(path: &Path) -> Result<String> {
    let read = || -> Result<String> {
        let mut text = String::new();
        let file = std::fs::File::open(path)?;
        file.take(points::MAX_FILE_BYTES + 1).read_to_string(&mut text)?;
        ensure!(
            text.len() as u64 <= points::MAX_FILE_BYTES,
            "larger than {} bytes",
            points::MAX_FILE_BYTES
        );
        Ok(text)
    };
    read().with_context(|| format!("cannot read {}", path.display()))
}

async fn run(listen: SocketAddr, bank: Bank) -> Result<()> {
    let mut terminate = signal(SignalKind::terminate())?;
    let mut interrupt = signal(SignalKind::interrupt())?;
    let listener = TcpListener::bind(listen).await.with_context(|| {
        format!("cannot listen on {listen}: is another program there? Try another --listen")
    })?;
    // No macro: a reader that went away is no reason to panic.
    let line = format!("listening on {}\n", listener.local_addr()?);
    let mut stdout = std::io::stdout();
    stdout.write_all(line.as_bytes())?;
    stdout.flush()?;
    let bank = Arc::new(Mutex::new(bank));
    tokio::select! {
        _ = terminate.recv() => Ok(()),
        _ = interrupt.recv() => Ok(()),
        () = live(Arc::clone(&bank)) => Ok(()),
        served = server::serve(listener, bank) => served.context("no more clients can be taken"),
    }
}

/// Moves the values for ever.
async fn live(bank: Arc<Mutex<Bank>>) {
    let mut beat = interval(Duration::from_secs_f64(model::STEP_SECONDS));
    beat.set_missed_tick_behavior(MissedTickBehavior::Skip);
    loop {
        beat.tick().await;
        bank.lock().unwrap_or_else(PoisonError::into_inner).step();
    }
}
