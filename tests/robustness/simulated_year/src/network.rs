//! A network of one device, in memory.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use busbar_link::{ByteStream, ConnectError, Dial, DialFuture, Endpoint};
use tokio::io::DuplexStream;
use tokio::sync::mpsc;
use tokio::time::{Instant, sleep};

/// Capacity of each direction of a connection, bytes, about that of sockets.
const QUEUE_BYTES: usize = 1 << 16;
/// Greatest number of connections that wait for the device.
const MAX_WAITING: usize = 16;

/// In-memory network that connects dial attempts to the listening device. Clones share it.
#[derive(Clone, Debug, Default)]
pub(crate) struct MemoryNetwork(Arc<Mutex<State>>);

#[derive(Debug, Default)]
struct State {
    response: DialResponse,
    dials: u64,
    last_dials: BTreeMap<String, Instant>,
    shortest_gap: Option<Duration>,
}

/// Response of the network to a dial attempt.
#[derive(Clone, Debug, Default)]
enum DialResponse {
    #[default]
    Refused,
    Silence,
    Device(mpsc::Sender<DuplexStream>),
}

impl MemoryNetwork {
    /// Lets a device listen, in the place of a former one; returns its clients.
    pub(crate) fn listen(&self) -> mpsc::Receiver<DuplexStream> {
        let (device, clients) = mpsc::channel(MAX_WAITING);
        self.lock().response = DialResponse::Device(device);
        clients
    }

    /// Refuses all further dial attempts.
    pub(crate) fn refuse_dials(&self) {
        self.lock().response = DialResponse::Refused;
    }

    /// Makes all further dial attempts time out without an answer.
    pub(crate) fn ignore_dials(&self) {
        self.lock().response = DialResponse::Silence;
    }

    /// Forgets the endpoints that were dialled, so that the next attempt counts as the first.
    pub(crate) fn forget_dials(&self) {
        self.lock().last_dials.clear();
    }

    /// Returns the number of dial attempts, and the shortest time between two attempts at one
    /// endpoint.
    pub(crate) fn dials(&self) -> (u64, Option<Duration>) {
        let state = self.lock();
        (state.dials, state.shortest_gap)
    }

    fn record_dial(&self, endpoint: &Endpoint) -> DialResponse {
        let now = Instant::now();
        let mut state = self.lock();
        state.dials += 1;
        if let Some(last) = state.last_dials.insert(endpoint.to_string(), now) {
            let gap = now - last;
            state.shortest_gap = Some(state.shortest_gap.map_or(gap, |least| least.min(gap)));
        }
        state.response.clone()
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Dial for MemoryNetwork {
    fn dial<'a>(&'a self, endpoint: &'a Endpoint, limit: Duration) -> DialFuture<'a> {
        Box::pin(async move {
            let refused = || ConnectError::System("connection refused".into());
            match self.record_dial(endpoint) {
                DialResponse::Refused => Err(refused()),
                DialResponse::Silence => {
                    sleep(limit).await;
                    Err(ConnectError::Timeout(limit))
                }
                DialResponse::Device(device) => {
                    let (ours, theirs) = tokio::io::duplex(QUEUE_BYTES);
                    device.send(theirs).await.map_err(|_| refused())?;
                    Ok(Box::new(ours) as Box<dyn ByteStream>)
                }
            }
        })
    }
}
