//! Faults of connections, and the seeded script that chooses them.

use clap::ValueEnum;

/// Spreads the numbers of connections over all seeds (the golden ratio, 64 bits).
const SPREAD: u64 = 0x9E37_79B9_7F4A_7C15;

/// Fault of a connection. Faults that strike do so once some bytes have gone to the client.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ConnectionFault {
    /// Connection without a fault.
    None,
    /// Segments of a single byte, in both directions.
    Split,
    /// Delay of every piece from the server.
    Delay,
    /// Reset of the connection (RST).
    Reset,
    /// Close of the connection (FIN), perhaps in the middle of a message.
    Close,
    /// Half-open connection: nothing passes any more, and neither side is told.
    Vanish,
    /// Slow bytes of the server from the strike on.
    Trickle,
    /// Garbage: random bytes before a piece from the server.
    Garbage,
    /// Swapped answers: a piece from the server is kept, and the connection closed. The next
    /// connection gets the piece as the answer to its first request.
    Swap,
}

/// Script of faults for all connections of a proxy.
#[derive(Clone, Debug)]
pub struct FaultScript {
    /// Seed of all random decisions.
    pub seed: u64,
    /// Faults to choose from for each connection; none if empty.
    pub faults: Vec<ConnectionFault>,
    /// Greatest number of bytes to the client before a fault strikes.
    pub max_bytes: usize,
}

/// Plan for one connection.
#[derive(Clone, Debug)]
pub struct ConnectionPlan {
    /// Fault of this connection.
    pub fault: ConnectionFault,
    /// Number of bytes to the client before the fault strikes.
    pub strike_after: usize,
    /// Random number generator of this connection.
    pub(crate) random: fastrand::Rng,
}

impl FaultScript {
    /// Returns the plan for a connection by its number.
    pub fn plan(&self, index: u64) -> ConnectionPlan {
        let seed = self.seed ^ index.wrapping_add(1).wrapping_mul(SPREAD);
        let mut random = fastrand::Rng::with_seed(seed);
        let fault = random.choice(&self.faults).copied().unwrap_or(ConnectionFault::None);
        ConnectionPlan { fault, strike_after: random.usize(0..=self.max_bytes), random }
    }
}
