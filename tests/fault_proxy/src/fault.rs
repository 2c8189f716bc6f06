//! What is done to connections.

use clap::ValueEnum;

/// Spreads the numbers of connections over all seeds (the golden ratio, 64 bits).
const SPREAD: u64 = 0x9E37_79B9_7F4A_7C15;

/// What is done to a connection. Faults that strike do so once some bytes have gone
/// to the client.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ConnectionFault {
    /// Nothing.
    None,
    /// Every byte is a segment of its own, both ways.
    Split,
    /// Every piece from the server comes late.
    Delay,
    /// The connection is reset (RST).
    Reset,
    /// The connection is closed (FIN), perhaps in the middle of a message.
    Close,
    /// Nothing comes or goes any more, and nobody says so: the connection is half
    /// open.
    Vanish,
    /// From then on the bytes of the server dribble.
    Trickle,
    /// Random bytes come before a piece from the server.
    Garbage,
    /// A piece from the server is kept, and the connection closed; the next
    /// connection gets the piece as the answer to what it first says.
    Swap,
}

/// Which faults there are.
#[derive(Clone, Debug)]
pub struct FaultScript {
    /// Decides all that is random.
    pub seed: u64,
    /// One of these for each connection; without any, nothing is done.
    pub faults: Vec<ConnectionFault>,
    /// Most bytes that go to the client before a fault strikes.
    pub max_bytes: usize,
}

/// What is done to one connection.
#[derive(Clone, Debug)]
pub struct ConnectionPlan {
    /// The fault.
    pub fault: ConnectionFault,
    /// Bytes to the client before it strikes.
    pub strike_after: usize,
    /// For all that is random in it.
    pub(crate) random: fastrand::Rng,
}

impl FaultScript {
    /// What is done to a connection, by its number.
    pub fn plan(&self, index: u64) -> ConnectionPlan {
        let seed = self.seed ^ index.wrapping_add(1).wrapping_mul(SPREAD);
        let mut random = fastrand::Rng::with_seed(seed);
        let fault = random.choice(&self.faults).copied().unwrap_or(ConnectionFault::None);
        ConnectionPlan { fault, strike_after: random.usize(0..=self.max_bytes), random }
    }
}
