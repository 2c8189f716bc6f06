//! A TCP line with a delay that grows: bytes come whole and in order, later and later.

use std::io::{Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Bytes that are passed on at once.
const PIECE_BYTES: usize = 1 << 16;
/// Period at which a line checks whether its delay was lifted.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// Delays of both directions.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Delays {
    /// From the server to the page, and from the page to the server.
    pub(crate) down: Delay,
    pub(crate) up: Delay,
}

/// Delay of one direction, which may grow.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Delay {
    /// Initial delay of the direction.
    pub(crate) at_first: Duration,
    /// Growth, seconds a second.
    pub(crate) growth: f64,
}

/// The line; its threads end with their connections.
pub(crate) struct DelayLine {
    pub(crate) address: SocketAddr,
    state: Arc<Mutex<(Delays, Instant)>>,
}

impl DelayLine {
    /// Carries connections to a server, without delay at first.
    pub(crate) fn start(server: SocketAddr) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("it is bound");
        let state = Arc::new(Mutex::new((Delays::default(), Instant::now())));
        let shared = state.clone();
        thread::spawn(move || {
            for page in listener.incoming().map_while(Result::ok) {
                let Ok(server) = TcpStream::connect(server) else { continue };
                let copy = |stream: &TcpStream| stream.try_clone().expect("a descriptor");
                let (down, up) = (shared.clone(), shared.clone());
                carry(copy(&page), copy(&server), move || delay(&up, |delays| delays.up));
                carry(server, page, move || delay(&down, |delays| delays.down));
            }
        });
        Self { address, state }
    }

    /// Sets the delays, which grow from now on.
    pub(crate) fn set(&self, delays: Delays) {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = (delays, Instant::now());
    }
}

fn delay(state: &Mutex<(Delays, Instant)>, of: impl Fn(&Delays) -> Delay) -> Duration {
    let (delays, since) = *state.lock().unwrap_or_else(PoisonError::into_inner);
    let Delay { at_first, growth } = of(&delays);
    at_first + since.elapsed().mul_f64(growth)
}

/// Carries one direction by two threads: one takes bytes, one hands them on when they are due.
fn carry(from: TcpStream, to: TcpStream, delay: impl Fn() -> Duration + Send + Clone + 'static) {
    let (sender, receiver) = channel();
    let at_entry = delay.clone();
    thread::spawn(move || take(from, &sender, at_entry));
    thread::spawn(move || hand_on(to, &receiver, delay));
}

type Piece = (Instant, Duration, Vec<u8>);

fn take(mut from: TcpStream, sender: &Sender<Piece>, delay: impl Fn() -> Duration) {
    let mut piece = vec![0; PIECE_BYTES];
    while let Ok(count @ 1..) = from.read(&mut piece) {
        if sender.send((Instant::now(), delay(), piece[..count].to_vec())).is_err() {
            break;
        }
    }
    // The end travels as slowly as all else: nothing here shuts the other side.
}

fn hand_on(mut to: TcpStream, receiver: &Receiver<Piece>, delay: impl Fn() -> Duration) {
    let _ = to.set_nodelay(true);
    for (came, wait, bytes) in receiver {
        // As long as it was when this came, or as short as it was made since.
        while came.elapsed() < wait.min(delay()) {
            thread::sleep(LOOK_PERIOD);
        }
        if to.write_all(&bytes).is_err() {
            break;
        }
    }
    let _ = to.shutdown(Shutdown::Both);
}
