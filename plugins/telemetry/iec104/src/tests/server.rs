//! A station that does as a test wants, byte by byte.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Reaction of the station to a frame: bytes to send, or `None` to close.
type Answer = dyn Fn(&[u8]) -> Option<Vec<u8>> + Send + Sync;

/// Longest silence of a connection that the peer left open.
const MAX_CONNECTION_LIFE: Duration = Duration::from_secs(20);

pub(super) const START_CON: [u8; 6] = [0x68, 4, 0x0B, 0, 0, 0];

pub(super) struct Server {
    pub(super) port: u16,
    accepted: Arc<Mutex<Vec<Instant>>>,
    received: Arc<Mutex<Vec<Vec<u8>>>>,
}

impl Server {
    /// Serves until the test's process ends.
    pub(super) fn start(answer: impl Fn(&[u8]) -> Option<Vec<u8>> + Send + Sync + 'static) -> Self {
        let answer: Arc<Answer> = Arc::new(answer);
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let (accepted, received) = (Arc::new(Mutex::new(Vec::new())), Arc::default());
        let server = Self { port, accepted: Arc::clone(&accepted), received };
        let received = Arc::clone(&server.received);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                accepted.lock().unwrap().push(Instant::now());
                let (answer, received) = (Arc::clone(&answer), Arc::clone(&received));
                std::thread::spawn(move || serve(stream, &*answer, &received));
            }
        });
        server
    }

    /// Between connections, in milliseconds.
    pub(super) fn gaps_millis(&self) -> Vec<u128> {
        let times = self.accepted.lock().unwrap();
        times.windows(2).map(|pair| (pair[1] - pair[0]).as_millis()).collect()
    }

    /// All frames that came.
    pub(super) fn received(&self) -> Vec<Vec<u8>> {
        self.received.lock().unwrap().clone()
    }
}

fn serve(mut stream: TcpStream, answer: &Answer, received: &Mutex<Vec<Vec<u8>>>) {
    stream.set_read_timeout(Some(MAX_CONNECTION_LIFE)).unwrap();
    loop {
        let mut prefix = [0; 2];
        if stream.read_exact(&mut prefix).is_err() {
            return;
        }
        let mut frame = prefix.to_vec();
        frame.resize(2 + usize::from(prefix[1]), 0);
        if stream.read_exact(&mut frame[2..]).is_err() {
            return;
        }
        received.lock().unwrap().push(frame.clone());
        let Some(bytes) = answer(&frame) else { return };
        if stream.write_all(&bytes).is_err() {
            return;
        }
    }
}

/// A data frame with this number.
pub(super) fn data(send: u16, asdu: &[u8]) -> Vec<u8> {
    let [s0, s1] = (send << 1).to_le_bytes();
    [&[0x68, 4 + asdu.len() as u8, s0, s1, 0, 0], asdu].concat()
}
