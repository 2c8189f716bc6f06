//! Simulated link with planned faults: state shared by all connections of a device.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use busbar_plugin_sdk::SimulationStatus;
use busbar_plugin_sdk::simulation::{ActiveFault, FaultKind, FaultPlan};
use tokio::io::DuplexStream;
use tokio::time::Instant;

use crate::relay;
use crate::socket::Socket;

/// Greatest number of clients at a time; more are refused.
pub const MAX_CLIENTS: u32 = 64;
/// Bytes between socket and protocol, in each direction.
const QUEUE_BYTES: usize = 1 << 16;
/// Longest delay of a slow answer.
const MAX_SLOW: Duration = Duration::from_secs(1);

/// Link between a simulated device and its clients, with planned faults. Clones share it.
#[derive(Clone, Debug)]
pub struct FaultyLink(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    plan: FaultPlan,
    seed: u64,
    deadline: Duration,
    started: Instant,
    wall_clock: fn() -> SystemTime,
    clients: AtomicU32,
    connections: AtomicU64,
    messages: AtomicU64,
}

impl FaultyLink {
    /// Creates a link that fails by a plan, from now on. `deadline` is the protocol's for answers:
    /// slow ones keep it, late ones do not.
    pub fn new(plan: FaultPlan, seed: u64, deadline: Duration) -> Self {
        Self::with_clock(plan, seed, deadline, SystemTime::now)
    }

    /// Creates a link with another wall clock than the system's, for simulated time.
    pub fn with_clock(
        plan: FaultPlan,
        seed: u64,
        deadline: Duration,
        wall_clock: fn() -> SystemTime,
    ) -> Self {
        Self(Arc::new(Shared {
            plan,
            seed,
            deadline,
            started: Instant::now(),
            wall_clock,
            clients: AtomicU32::new(0),
            connections: AtomicU64::new(0),
            messages: AtomicU64::new(0),
        }))
    }

    /// Returns the device's clock, which a fault may set wrong, and the true one.
    pub fn now(&self) -> (SystemTime, SystemTime) {
        let true_time = (self.0.wall_clock)();
        let ahead = self.fault().map_or(0, |fault| fault.clock_ahead_seconds);
        let distance = Duration::from_secs(ahead.unsigned_abs());
        let said = match ahead {
            0 => Some(true_time),
            1.. => true_time.checked_add(distance),
            _ => true_time.checked_sub(distance),
        };
        (said.unwrap_or(true_time), true_time)
    }

    /// Counts answers to requests, and messages without one.
    pub fn count_messages(&self, count: u64) {
        self.0.messages.fetch_add(count, Ordering::Relaxed);
    }

    /// Accepts a connection, and returns the stream to its client, faults included; none where the
    /// client is refused. Needs a runtime, which moves the bytes.
    pub fn admit(&self, socket: impl Socket) -> Option<DuplexStream> {
        if self.fault_kind() == Some(FaultKind::LinkLoss) {
            return None;
        }
        let client = ClientSlot::acquire(self)?;
        let number = self.0.connections.fetch_add(1, Ordering::Relaxed);
        let random = fastrand::Rng::with_seed(self.0.seed ^ number.wrapping_mul(0x9E37_79B9));
        let (ours, protocol) = tokio::io::duplex(QUEUE_BYTES);
        tokio::spawn(async move {
            relay::run(socket, ours, &client, random).await;
            drop(client);
        });
        Some(protocol)
    }

    pub(crate) fn status(&self, endpoint: String) -> SimulationStatus {
        SimulationStatus {
            endpoint,
            fault: self.fault_kind(),
            clients: self.0.clients.load(Ordering::Relaxed),
            connections: self.0.connections.load(Ordering::Relaxed),
            messages: self.0.messages.load(Ordering::Relaxed),
        }
    }

    fn fault(&self) -> Option<ActiveFault> {
        self.0.plan.at(self.0.started.elapsed())
    }

    pub(crate) fn fault_kind(&self) -> Option<FaultKind> {
        self.fault().map(|fault| fault.kind)
    }

    /// Waits until the next fault begins or ends; for ever where none does.
    pub(crate) async fn changed(&self) {
        match self.0.plan.next_change(self.0.started.elapsed()) {
            Some(change) => tokio::time::sleep_until(self.0.started + change).await,
            None => std::future::pending().await,
        }
    }

    /// Returns the delay of an answer.
    pub(crate) fn delay(&self) -> Duration {
        match self.fault_kind() {
            Some(FaultKind::Slow) => (self.0.deadline / 4).min(MAX_SLOW),
            Some(FaultKind::Late) => self.0.deadline * 3 / 2,
            _ => Duration::ZERO,
        }
    }
}

/// Slot of a connected client.
pub(crate) struct ClientSlot(FaultyLink);

impl ClientSlot {
    fn acquire(link: &FaultyLink) -> Option<Self> {
        let count = |clients| (clients < MAX_CLIENTS).then_some(clients + 1);
        link.0.clients.fetch_update(Ordering::Relaxed, Ordering::Relaxed, count).ok()?;
        Some(Self(link.clone()))
    }
}

impl std::ops::Deref for ClientSlot {
    type Target = FaultyLink;

    fn deref(&self) -> &FaultyLink {
        &self.0
    }
}

impl Drop for ClientSlot {
    fn drop(&mut self) {
        self.0.0.clients.fetch_sub(1, Ordering::Relaxed);
    }
}
