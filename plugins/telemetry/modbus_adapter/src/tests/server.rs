//! A server that answers as a test wants.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Reply rule for the bytes of each request: pieces with pauses between them, or `None` to close
/// the connection.
type Answer = dyn Fn(&[u8]) -> Option<Pieces> + Send + Sync;
pub(crate) type Pieces = Vec<(Duration, Vec<u8>)>;

/// Longest life of a connection that the peer left open.
const MAX_CONNECTION_LIFE: Duration = Duration::from_secs(20);

pub(crate) struct Server {
    pub(crate) port: u16,
    accepted: Arc<Mutex<Vec<Instant>>>,
}

impl Server {
    /// Serves until the test's process ends.
    pub(crate) fn start(answer: impl Fn(&[u8]) -> Option<Pieces> + Send + Sync + 'static) -> Self {
        let answer: Arc<Answer> = Arc::new(answer);
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let accepted = Arc::new(Mutex::new(Vec::new()));
        let times = Arc::clone(&accepted);
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                times.lock().unwrap().push(Instant::now());
                let answer = Arc::clone(&answer);
                std::thread::spawn(move || serve(stream, &*answer));
            }
        });
        Self { port, accepted }
    }

    /// When each connection came, after the first, in milliseconds.
    pub(crate) fn gaps_millis(&self) -> Vec<u128> {
        let times = self.accepted.lock().unwrap();
        times.windows(2).map(|pair| (pair[1] - pair[0]).as_millis()).collect()
    }
}

fn serve(mut stream: TcpStream, answer: &Answer) {
    stream.set_read_timeout(Some(MAX_CONNECTION_LIFE)).unwrap();
    let mut request = [0; 12];
    while stream.read_exact(&mut request).is_ok() {
        let Some(pieces) = answer(&request) else {
            return;
        };
        for (pause, bytes) in pieces {
            std::thread::sleep(pause);
            if stream.write_all(&bytes).is_err() {
                return;
            }
        }
    }
}

/// Builds the right answer, in which every register is 0xDEAD.
pub(crate) fn right(request: &[u8]) -> Vec<u8> {
    let count = usize::from(request[11]);
    let mut answer = request[..4].to_vec();
    answer.extend(((3 + 2 * count) as u16).to_be_bytes());
    answer.extend([request[6], request[7], (2 * count) as u8]);
    answer.extend([0xDE, 0xAD].repeat(count));
    answer
}

pub(crate) fn at_once(bytes: Vec<u8>) -> Option<Pieces> {
    Some(vec![(Duration::ZERO, bytes)])
}

/// Builds the exception of a device that refuses the cells.
pub(crate) fn illegal_address(request: &[u8]) -> Vec<u8> {
    [&request[..4], &[0, 3, request[6], request[7] | 0x80, 2]].concat()
}
