//! `busbar import CONFIG --from INSTANCE`: the variables of a server as a point list.

mod attributes;
mod browse;
mod data_type;
mod list;
mod references;
mod states;
#[cfg(test)]
pub(crate) mod tests;
mod variable;

use std::io::{self, Read, Write};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

use async_opcua::types::{NodeId, ObjectId};
use busbar_link::{IoLoop, TcpDial};
use busbar_plugin_sdk::{CommandExit, Error, LogLevel, Streams};
use tokio::time::{sleep, timeout};

use crate::client::Client;
use crate::fault::Fault;
use crate::import::attributes::Reader;
use crate::import::browse::variables_below;
use crate::import::list::Listing;
use crate::import::references::Browser;
use crate::link::{CLOSE_LIMIT, CatchPanic};
use crate::node::NodeAddress;
use crate::session;
use crate::settings::Config;
use crate::url::Url;
use crate::world::World;

/// Most nodes at which browsing begins.
const MAX_ROOTS: usize = 64;
/// Time limit of the whole import.
const MAX_TIME: Duration = Duration::from_secs(600);
/// Period of the progress reports to the host, which may then stop the import.
const BEAT: Duration = Duration::from_millis(200);
const USAGE: &str = "busbar import CONFIG --from INSTANCE [--out POINTS.csv|TAGS.json] -- [NODE...]: \
                     each NODE, such as nsu=urn:plc;s=Station, is browsed instead of the folder Objects";

/// Browses a server and writes the list.
///
/// # Errors
/// Errors of the streams, or a cancellation by the host.
pub(crate) fn run(
    config: &Config,
    arguments: &[&str],
    streams: &Streams<'_>,
) -> Result<CommandExit, Error> {
    let roots: Result<Vec<_>, _> = arguments.iter().map(|text| NodeAddress::parse(text)).collect();
    let roots = match roots {
        Ok(roots) if roots.len() <= MAX_ROOTS => roots,
        Ok(_) => {
            streams.diagnose(LogLevel::Error, None, &format!("at most {MAX_ROOTS} nodes"));
            return Ok(CommandExit::WrongUse);
        }
        Err(what) => {
            streams.diagnose(LogLevel::Error, None, &format!("{what}\n  {USAGE}"));
            return Ok(CommandExit::WrongUse);
        }
    };
    let io_loop = IoLoop::new(config.servers.len())
        .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
    let world = World { dial: Arc::new(TcpDial { tls: None }), wall_clock: SystemTime::now };
    let mut listed = None;
    let beats = async {
        while streams.input().read(&mut [0]).is_ok() {
            sleep(BEAT).await;
        }
    };
    io_loop.run_until(beats, async { listed = Some(of_any(&world, config, &roots).await) });
    let Some(listed) = listed else { return Err(Error::cancelled()) };
    let listing = match listed {
        Ok(listing) => listing,
        Err(faults) => {
            faults.iter().for_each(|fault| streams.diagnose(LogLevel::Error, None, fault));
            return Ok(CommandExit::InputAtFault);
        }
    };
    tell(&listing, streams);
    if listing.rows.is_empty() {
        streams.diagnose(LogLevel::Error, None, "no variable was found that can be a tag");
        return Ok(CommandExit::InputAtFault);
    }
    let mut output = io::BufWriter::new(streams.output());
    let written = listing.write(&mut output).and_then(|()| output.flush());
    written.map_err(|error| Error::failed(error.to_string()))?;
    Ok(CommandExit::Done)
}

fn tell(listing: &Listing, streams: &Streams<'_>) {
    for remark in &listing.remarks {
        streams.diagnose(LogLevel::Warning, None, remark);
    }
    let (tags, others) = (listing.rows.len(), listing.refused.len());
    let text = format!("tags: {tags}; variables that cannot be tags: {others}");
    streams.diagnose(LogLevel::Info, None, &text);
    for (path, reason) in &listing.refused {
        streams.diagnose(LogLevel::Info, None, &format!("no tag: {path}: {reason}"));
    }
}

/// Lists the first server that answers; otherwise returns the fault of each.
pub(crate) async fn of_any(
    world: &World,
    config: &Config,
    roots: &[NodeAddress],
) -> Result<Listing, Vec<String>> {
    let mut faults = Vec::new();
    for server in &config.servers {
        let work = CatchPanic(Box::pin(of_server(world, config, server, roots)));
        let done = timeout(MAX_TIME, work).await;
        let late = || Err(Fault::Server("browsing it takes longer than 600 s; begin further down"));
        match done.unwrap_or_else(|_| late()) {
            Ok(listing) => return Ok(listing),
            Err(fault) => faults.push(format!("{server}: {fault}")),
        }
    }
    Err(faults)
}

async fn of_server(
    world: &World,
    config: &Config,
    server: &Url,
    roots: &[NodeAddress],
) -> Result<Listing, Fault> {
    let (client, mut driver) = session::open(world, config, server).await?;
    let listed = driver.during(of_session(&client, roots)).await;
    let close = async {
        session::close(&client, CLOSE_LIMIT).await;
        Ok(())
    };
    // The answer does not matter any more.
    let _ = timeout(CLOSE_LIMIT, driver.during(close)).await;
    listed.map_err(|fault| match fault {
        // It did answer before.
        Fault::NoAnswer(limit) => Fault::Silent(limit),
        fault => fault,
    })
}

async fn of_session(client: &Client, roots: &[NodeAddress]) -> Result<Listing, Fault> {
    let server = session::describe(client).await?;
    let namespaces = server.namespaces.as_slice();
    let (mut reader, limit) = Reader::within_limits(client).await?;
    let mut browser = Browser::new(client, namespaces, limit);
    let mut starts = Vec::new();
    for root in roots {
        let node = root.resolve(namespaces);
        starts.push(node.ok_or_else(|| {
            Fault::Lost(format!("it has no namespace of {root}; it has {}", namespaces.join(", ")))
        })?);
    }
    let begins_at_objects = starts.is_empty();
    if begins_at_objects {
        starts.push(NodeId::from(ObjectId::ObjectsFolder));
    }
    let found = variables_below(&mut browser, &starts, begins_at_objects).await?;
    list::list_variables(found, &mut browser, &mut reader).await
}
