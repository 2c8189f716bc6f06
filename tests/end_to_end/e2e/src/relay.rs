//! TCP relay between the program and a server, which counts answers: so a test knows that values
//! arrived before it stops the server.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use crate::process::MAX_START;
use crate::wait_for;

/// Greatest length of a message that is passed on at once, bytes.
const MAX_MESSAGE_BYTES: usize = 4096;

/// Running relay; its threads end with the connections, its listener with the test.
pub struct Relay {
    /// Port that the relay listens at.
    pub port: u16,
    answers: Arc<AtomicUsize>,
}

impl Relay {
    /// Relays connections to a local port.
    ///
    /// # Panics
    /// When no port is free.
    pub fn start(server_port: u16) -> Self {
        let listener = TcpListener::bind(("127.0.0.1", 0)).expect("a port is free");
        let port = listener.local_addr().expect("it is bound").port();
        let answers = Arc::new(AtomicUsize::new(0));
        let counter = answers.clone();
        thread::spawn(move || {
            for client in listener.incoming().map_while(Result::ok) {
                // Without a server the client is hung up on.
                if let Ok(server) = TcpStream::connect(("127.0.0.1", server_port)) {
                    relay(&client, &server, &counter);
                }
            }
        });
        Self { port, answers }
    }

    /// Waits until the server has sent `count` answers.
    ///
    /// # Panics
    /// When it does not within [`MAX_START`].
    pub fn wait_for_answers(&self, count: usize) {
        wait_for("answers of the server", MAX_START, || {
            (self.answers.load(Ordering::Relaxed) >= count).then_some(())
        });
    }
}

fn relay(client: &TcpStream, server: &TcpStream, answers: &Arc<AtomicUsize>) {
    let requests = Arc::new(AtomicUsize::new(0));
    for (from, to, counter) in [(client, server, &requests), (server, client, answers)] {
        if let (Ok(from), Ok(to)) = (from.try_clone(), to.try_clone()) {
            let counter = counter.clone();
            thread::spawn(move || pass_on(from, to, &counter));
        }
    }
}

fn pass_on(mut from: TcpStream, mut to: TcpStream, counter: &AtomicUsize) {
    let mut buffer = [0; MAX_MESSAGE_BYTES];
    while let Ok(count @ 1..) = from.read(&mut buffer) {
        if to.write_all(&buffer[..count]).is_err() {
            break;
        }
        counter.fetch_add(1, Ordering::Relaxed);
    }
    // Whoever is still there learns that the other has gone.
    let _ = from.shutdown(Shutdown::Both);
    let _ = to.shutdown(Shutdown::Both);
}
