//! The controlled station that the plugin reads, simulated: every tag at its address.

mod map;
pub(crate) mod probe;
mod session;
mod station;

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use busbar_plugin_sdk::{Error, Host, LogLevel, Simulation};
use device_server::{ACCEPT_PAUSE, DeviceServer, FaultyLink};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::net::TcpListener;
use tokio::task::JoinSet;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep, sleep_until};

use crate::points::Points;
use crate::settings::Config;
use map::StationMap;
use station::{Shared, Station, Times};

/// Bytes read at once.
const PIECE_BYTES: usize = 4096;

/// Starts a station at the hosts and ports of the settings.
pub(crate) fn start(
    config: &Config,
    simulation: Simulation,
    host: &Host,
) -> Result<DeviceServer, Error> {
    if config.tls.is_some() {
        return Err(Error::settings(
            "settings, tls: a simulated station has no certificate: leave \"tls\" away to simulate",
        ));
    }
    let shared = lay_out(config, &simulation, host)?;
    let link = FaultyLink::new(simulation.faults, simulation.seed, config.parameters.t1);
    let endpoints: Vec<_> =
        config.endpoints.iter().map(|endpoint| (endpoint.host.clone(), endpoint.port)).collect();
    let name = format!("iec104-sim:{}", config.endpoints[0].port);
    let update = simulation.update;
    DeviceServer::start(&name, &endpoints, link, host, move |listeners, link| {
        serve(listeners, link, shared, update)
    })
}

/// The objects of the tags, for all clients.
fn lay_out(config: &Config, simulation: &Simulation, host: &Host) -> Result<Arc<Shared>, Error> {
    let (shared, remark) = share(config, simulation)?;
    if let Some(remark) = remark {
        host.log(LogLevel::Warning, &remark);
    }
    Ok(Arc::new(shared))
}

/// Creates the state that all clients of a simulated station share, and a remark on its objects.
fn share(config: &Config, simulation: &Simulation) -> Result<(Shared, Option<String>), Error> {
    let points = Points::parse(&simulation.specs(), config)?;
    let signal_of = |tag| {
        // Tags are in the order of their handles, mostly.
        let at = simulation.tags.binary_search_by_key(&tag, |simulated| simulated.spec.tag);
        let found = at.ok().and_then(|index| simulation.tags.get(index));
        let slow = || simulation.tags.iter().find(|simulated| simulated.spec.tag == tag);
        found.or_else(slow).map(|simulated| simulated.signal.clone())
    };
    let (map, remark) = StationMap::new(&points, signal_of)?;
    let shared = Shared {
        map,
        zone: config.zone,
        parameters: config.parameters,
        has_sent_start: AtomicBool::new(false),
    };
    Ok((shared, remark))
}

async fn serve(
    listeners: Vec<TcpListener>,
    link: FaultyLink,
    shared: Arc<Shared>,
    update: Duration,
) {
    let mut accepting = JoinSet::new();
    for listener in listeners {
        accepting.spawn(accept(listener, link.clone(), Arc::clone(&shared), update));
    }
    while accepting.join_next().await.is_some() {}
}

async fn accept(listener: TcpListener, link: FaultyLink, shared: Arc<Shared>, update: Duration) {
    loop {
        let Ok((stream, _)) = listener.accept().await else {
            sleep(ACCEPT_PAUSE).await;
            continue;
        };
        if let Some(client) = link.admit(stream) {
            let (link, shared) = (link.clone(), Arc::clone(&shared));
            tokio::spawn(async move {
                // However it ends, the client alone is concerned.
                let _ = serve_client(client, &link, shared, update).await;
            });
        }
    }
}

/// Until the client is gone or breaks the protocol.
async fn serve_client(
    mut client: DuplexStream,
    link: &FaultyLink,
    shared: Arc<Shared>,
    update: Duration,
) -> io::Result<()> {
    let mut station = Station::new(shared, Instant::now().into_std());
    // Not at once: what a client asks for comes before what has changed.
    let mut looking = interval_at(Instant::now() + update, update);
    looking.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        // In this order, so that a busy client does not hold up what is due.
        let outcome = tokio::select! {
            biased;
            () = sleep_until(station.deadline().into()) => station.tick(times(link)),
            _ = looking.tick() => {
                station.look_for_changes(times(link));
                Ok(())
            }
            read = client.read(&mut piece) => match read? {
                0 => return Ok(()),
                count => station.receive(&piece[..count], times(link)),
            },
        };
        let (bytes, count) = station.take_output();
        client.write_all(&bytes).await?;
        link.count_messages(count);
        if outcome.is_err() {
            return Ok(());
        }
    }
}

fn times(link: &FaultyLink) -> Times {
    let (station_time, true_time) = link.now();
    Times { now: Instant::now().into_std(), true_time, station_time }
}

#[cfg(test)]
#[path = "year_tests.rs"]
mod tests;
