//! A session with a server in memory that sends given bytes: for fuzzing.

use std::cell::RefCell;
use std::future::poll_fn;
use std::pin::Pin;
use std::rc::Rc;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::Poll;
use std::time::{Duration, SystemTime};

use busbar_link::{ByteStream, ConnectError, Dial, DialFuture, Endpoint, IoLoop};
use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{Error, SampleSink, TagSpec};
use tokio::io::{AsyncRead, AsyncWriteExt, DuplexStream, ReadBuf, duplex};
use tokio::task::yield_now;

use crate::import::of_any;
use crate::link::Link;
use crate::point_states::PointStates;
use crate::points::Points;
use crate::settings::Settings;
use crate::world::World;

/// Capacity of the pipe between the two ends, bytes.
const PIPE_BYTES: usize = 64 * 1024;
/// Turns of the event loop without a request after which the server sends the next frame anyway.
const IDLE_TURNS: usize = 8;
/// Most requests of one session.
const MAX_REQUESTS: usize = 200;
/// Length of a header: type, kind of chunk, size (OPC 10000-6, 7.1.2.2), bytes.
const HEADER_BYTES: usize = 8;

/// Runs one session with a server that answers each request with the next frame. The first bytes
/// are for the discovery of endpoints, the second ones for the session. Samples go to the sink; the
/// reason of the end is returned.
///
/// # Errors
/// Faults of the settings and addresses.
pub fn converse(
    settings: Settings,
    tags: &[TagSpec],
    sink: &SampleSink,
    connections: [&[u8]; 2],
) -> Result<String, Error> {
    let config = settings.parse()?;
    let points = Points::parse(tags, &config)?;
    let (_stop, stopped) = tokio::sync::watch::channel(false);
    let world = world(connections);
    let point_states = PointStates::new(points, &config, sink.clone(), host());
    let point_states = Rc::new(RefCell::new(point_states));
    let sink = sink.clone();
    let link = Link {
        config,
        point_states,
        sink,
        host: host(),
        world,
        stop: stopped,
        namespaces: RefCell::default(),
    };
    let io_loop = IoLoop::new(1).map_err(|error| Error::failed(error.to_string()))?;
    let mut said = String::new();
    io_loop.run_until(std::future::pending(), async { said = link.serve_once().await });
    Ok(said)
}

/// Browses such a server and returns the point list.
///
/// # Errors
/// The reason for which there is no list, in words.
pub fn browse(settings: Settings, connections: [&[u8]; 2]) -> Result<Vec<u8>, String> {
    let config = settings.parse().map_err(|error| error.to_string())?;
    let io_loop = IoLoop::new(1).map_err(|error| error.to_string())?;
    let (world, mut listed) = (world(connections), Err(Vec::new()));
    io_loop.run_until(std::future::pending(), async {
        listed = of_any(&world, &config, &[]).await;
    });
    let listing = listed.map_err(|faults| faults.join("; "))?;
    let mut list = Vec::new();
    listing.write(&mut list).map_err(|error| error.to_string())?;
    Ok(list)
}

fn world(connections: [&[u8]; 2]) -> World {
    let [first, second] = connections.map(<[u8]>::to_vec);
    World {
        dial: Arc::new(Memory(Mutex::new(vec![second, first]))),
        wall_clock: || SystemTime::UNIX_EPOCH + Duration::from_secs(1_767_323_045),
    }
}

/// The bytes of connections to come, the next one last.
struct Memory(Mutex<Vec<Vec<u8>>>);

impl Dial for Memory {
    fn dial<'a>(&'a self, _: &'a Endpoint, _: Duration) -> DialFuture<'a> {
        let bytes = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        Box::pin(async move {
            let bytes = bytes.ok_or(ConnectError::NoAddress)?;
            let (client, server) = duplex(PIPE_BYTES);
            tokio::task::spawn_local(serve(server, bytes));
            Ok(Box::new(client) as Box<dyn ByteStream>)
        })
    }
}

async fn serve(mut stream: DuplexStream, bytes: Vec<u8>) {
    let mut rest = bytes.as_slice();
    for _ in 0..MAX_REQUESTS {
        for _ in 0..IDLE_TURNS {
            if take_request(&mut stream).await {
                break;
            }
            yield_now().await;
        }
        if rest.is_empty() {
            return;
        }
        let (frame, others) = rest.split_at(frame_length(rest));
        rest = others;
        if stream.write_all(frame).await.is_err() {
            return;
        }
    }
}

/// Reads the bytes of a request without waiting; reports whether any came.
async fn take_request(stream: &mut DuplexStream) -> bool {
    let mut bytes = vec![0; PIPE_BYTES];
    poll_fn(|context| {
        let mut buffer = ReadBuf::new(&mut bytes);
        let read = Pin::new(&mut *stream).poll_read(context, &mut buffer);
        Poll::Ready(read.is_ready() && !buffer.filled().is_empty())
    })
    .await
}

/// Returns the length of the first frame, or of all bytes where they hold none.
fn frame_length(bytes: &[u8]) -> usize {
    let size = bytes.get(4..HEADER_BYTES).and_then(|size| size.try_into().ok());
    let size = size.map_or(usize::MAX, |size| u32::from_le_bytes(size) as usize);
    if size < HEADER_BYTES { bytes.len() } else { size.min(bytes.len()) }
}
