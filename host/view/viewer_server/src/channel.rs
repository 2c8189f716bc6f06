//! The socket to the host program: a thread reads it, the frame writes without waiting.

use std::collections::VecDeque;
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use busbar_protocol::message::{
    Command, HostMessage, MAX_MESSAGE_BYTES, PROTOCOL_VERSION, StartParameters, ViewerMessage,
};
use busbar_protocol::pictures::PictureMemory;
use busbar_protocol::{framing, socket};
use rustix::net::SendFlags;

/// Largest number of commands waiting for a frame. Beyond it the socket waits, and the library
/// merges its queue.
const MAX_WAITING: usize = 1 << 14;
/// Bytes of events that wait for a host program that does not read; then it is as good as
/// gone.
const MAX_UNSENT_BYTES: usize = 64 << 20;
/// Grace period between the host program's end and the end of a view that hangs.
const END_GRACE: Duration = Duration::from_secs(2);
/// Longest time for sending the final events.
const FINAL_FLUSH_TIMEOUT: Duration = Duration::from_millis(500);

/// The host program's end.
pub(super) struct Channel {
    socket: UnixStream,
    inbox: Arc<Inbox>,
    unsent: VecDeque<u8>,
}

type Waker = Box<dyn Fn() + Send>;

#[derive(Default)]
struct Inbox {
    pending: Mutex<PendingCommands>,
    changed: Condvar,
    waker: Mutex<Option<Waker>>,
}

#[derive(Default)]
struct PendingCommands {
    commands: VecDeque<Command>,
    has_ended: bool,
}

impl Channel {
    /// Waits for the first message, and reads from then on.
    pub(super) fn accept() -> Result<(Self, StartParameters, PictureMemory), String> {
        let text = |error: std::io::Error| format!("no host program at standard input: {error}");
        let owned = rustix::stdio::stdin().as_fd().try_clone_to_owned().map_err(text)?;
        let socket = UnixStream::from(owned);
        socket.peer_addr().map_err(text)?;
        let first = socket::receive(&socket, MAX_MESSAGE_BYTES).map_err(text)?;
        let (bytes, files) = first.ok_or("the host program has gone")?;
        let begin = match framing::decode(&bytes) {
            Ok(HostMessage::Start(begin)) => begin,
            _ => {
                return Err(format!(
                    "the host program does not speak version {PROTOCOL_VERSION} of the protocol; \
                     install library and viewer from one release"
                ));
            }
        };
        HostMessage::Start(begin.clone()).check()?;
        let memory = files.first().ok_or("the host program sent no memory for pictures")?;
        let memory = PictureMemory::open(memory).map_err(text)?;
        let inbox = Arc::new(Inbox::default());
        let (reader, read) = (socket.try_clone().map_err(text)?, inbox.clone());
        std::thread::Builder::new()
            .name("host program".into())
            .spawn(move || read.fill(&reader))
            .map_err(text)?;
        Ok((Self { socket, inbox, unsent: VecDeque::new() }, begin, memory))
    }

    pub(super) fn set_waker(&self, wake: impl Fn() + Send + 'static) {
        *self.inbox.waker.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(wake));
    }

    /// Takes the commands since the last call; none once the host program is gone.
    pub(super) fn take(&self) -> Option<VecDeque<Command>> {
        let mut pending = self.inbox.pending();
        let commands = std::mem::take(&mut pending.commands);
        self.inbox.changed.notify_all();
        (!pending.has_ended).then_some(commands)
    }

    /// Waits until a command arrives, at most until an instant.
    pub(super) fn wait(&self, until: Instant) {
        let mut pending = self.inbox.pending();
        while pending.commands.is_empty() && !pending.has_ended {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return;
            }
            let waited = self.inbox.changed.wait_timeout(pending, left);
            pending = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Puts events behind those that wait.
    pub(super) fn queue(&mut self, events: impl IntoIterator<Item = ViewerMessage>) {
        for event in events {
            match framing::encode(&event, MAX_MESSAGE_BYTES) {
                Ok(bytes) => self.unsent.extend(bytes),
                Err(fault) => tracing::error!("{fault}"),
            }
        }
        if self.unsent.len() > MAX_UNSENT_BYTES {
            tracing::error!("the host program does not read what happens; the view ends");
            self.unsent.clear();
            self.inbox.end();
        }
    }

    /// Sends as much as the socket takes without waiting.
    pub(super) fn flush(&mut self) {
        while !self.unsent.is_empty() {
            let (bytes, _) = self.unsent.as_slices();
            let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
            match rustix::net::send(&self.socket, bytes, flags) {
                Ok(sent) => drop(self.unsent.drain(..sent)),
                // What waits goes later; the end is the reader's to notice.
                Err(_) => return,
            }
        }
    }

    /// Sends the remaining events before the process ends.
    pub(super) fn flush_last(&mut self) {
        let start = Instant::now();
        while !self.unsent.is_empty() && start.elapsed() < FINAL_FLUSH_TIMEOUT {
            self.flush();
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Inbox {
    fn pending(&self) -> MutexGuard<'_, PendingCommands> {
        self.pending.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads commands until the host program goes, and sees to it that the process follows.
    fn fill(&self, socket: &UnixStream) {
        while let Some(command) = receive_command(socket) {
            let mut pending = self.pending();
            while pending.commands.len() >= MAX_WAITING {
                pending = self.changed.wait(pending).unwrap_or_else(PoisonError::into_inner);
            }
            pending.commands.push_back(command);
            drop(pending);
            self.wake();
        }
        self.end();
        std::thread::sleep(END_GRACE);
        // The view hangs: nobody is left to see it.
        std::process::exit(0);
    }

    fn end(&self) {
        self.pending().has_ended = true;
        self.wake();
    }

    fn wake(&self) {
        self.changed.notify_all();
        if let Some(wake) = &*self.waker.lock().unwrap_or_else(PoisonError::into_inner) {
            wake();
        }
    }
}

/// Receives the next command; none at the end of the stream or after an invalid message.
fn receive_command(socket: &UnixStream) -> Option<Command> {
    let (bytes, _) = socket::receive(socket, MAX_MESSAGE_BYTES).ok()??;
    let command = match framing::decode(&bytes) {
        Ok(HostMessage::Command(command)) => command.check().map(|()| command),
        Ok(HostMessage::Start(_)) => Err("a second beginning".to_owned()),
        Err(fault) => Err(fault),
    };
    command
        .inspect_err(|fault| tracing::error!("the host program sent {fault}; the view ends"))
        .ok()
}
