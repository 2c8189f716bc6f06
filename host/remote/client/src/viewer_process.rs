//! Viewer process: start, socket, shared memory of its pictures, end.

use std::ffi::OsStr;
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::Duration;

use busbar_protocol::message::{HostMessage, MAX_MESSAGE_BYTES, ViewerMessage};
use busbar_protocol::pictures::{PictureMemory, PictureReader};
use busbar_protocol::{framing, socket};
use rustix::net::{RecvFlags, SendFlags};

use crate::desired_state::DesiredState;

/// The program's command for this.
const COMMAND: &str = "embedded";
/// The longest that the first message may take: it is read at once, or by no viewer of ours.
const FIRST_MESSAGE: Duration = Duration::from_millis(500);
/// Bytes read at once, and how often in a row.
const PIECE_BYTES: usize = 1 << 16;
const MAX_PIECES: usize = 64;

/// A viewer that runs.
pub(crate) struct ViewerProcess {
    child: Child,
    socket: UnixStream,
    memory: PictureMemory,
    decoder: framing::Decoder,
    unsent: Vec<u8>,
    sent: usize,
}

impl ViewerProcess {
    /// Starts one, and says what it is to show.
    ///
    /// # Errors
    /// In words: no such program, or no memory or descriptors for it.
    pub(crate) fn start(
        program: &OsStr,
        desired: &DesiredState,
    ) -> Result<(Self, PictureReader), String> {
        let shown = program.to_string_lossy().into_owned();
        let text = |error: io::Error| format!("no viewer '{shown}' can be started: {error}");
        let (socket, theirs) = UnixStream::pair().map_err(text)?;
        socket.set_write_timeout(Some(FIRST_MESSAGE)).map_err(text)?;
        let (file, memory) = PictureMemory::create().map_err(text)?;
        let mut command = Command::new(program);
        command.arg(COMMAND).stdin(OwnedFd::from(theirs)).stdout(Stdio::null());
        // Signals of a terminal are for the program; the viewer ends with its socket.
        let child = command.process_group(0).spawn().map_err(text)?;
        let reader = PictureReader::new(memory.clone());
        let decoder = framing::Decoder::new(MAX_MESSAGE_BYTES);
        let mut viewer = Self { child, socket, memory, decoder, unsent: Vec::new(), sent: 0 };
        let begin =
            framing::encode(&HostMessage::Start(desired.start_parameters()), MAX_MESSAGE_BYTES);
        let begun = begin
            .and_then(|begin| socket::send(&viewer.socket, &begin, &[file.as_fd()]).map_err(text));
        match begun {
            Ok(()) => Ok((viewer, reader)),
            Err(error) => {
                viewer.kill();
                let _ = viewer.child.wait();
                Err(error)
            }
        }
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Returns the socket, to poll it for messages and for room.
    pub(crate) fn socket(&self) -> &UnixStream {
        &self.socket
    }

    pub(crate) fn memory(&self) -> &PictureMemory {
        &self.memory
    }

    /// Reports whether bytes of a message wait to be sent.
    pub(crate) fn has_unsent(&self) -> bool {
        self.sent < self.unsent.len()
    }

    /// Sends what waits, and then commands, as far as the socket takes them at once.
    pub(crate) fn send(&mut self, mut next: impl FnMut() -> Option<HostMessage>) {
        loop {
            if !self.has_unsent() {
                let Some(message) = next() else { return };
                self.sent = 0;
                // One that is too long was refused when it was given.
                self.unsent = framing::encode(&message, MAX_MESSAGE_BYTES).unwrap_or_default();
                continue;
            }
            let flags = SendFlags::DONTWAIT | SendFlags::NOSIGNAL;
            match rustix::net::send(&self.socket, &self.unsent[self.sent..], flags) {
                Ok(sent) => self.sent += sent,
                // The end is noticed by reading.
                Err(_) => return,
            }
        }
    }

    /// Receives the messages that arrived, and hands them to `each`.
    ///
    /// # Errors
    /// In words, when it has gone or sends what is no message.
    pub(crate) fn receive(&mut self, mut each: impl FnMut(ViewerMessage)) -> Result<(), String> {
        let mut piece = [0; PIECE_BYTES];
        for _ in 0..MAX_PIECES {
            let received = rustix::net::recv(&self.socket, &mut piece[..], RecvFlags::DONTWAIT);
            match received {
                Ok((0, _)) => return Err("it has ended".to_owned()),
                Ok((count, _)) => self.decoder.push(&piece[..count]),
                Err(rustix::io::Errno::AGAIN | rustix::io::Errno::INTR) => return Ok(()),
                Err(error) => return Err(format!("its socket fails: {error}")),
            }
            while let Some(message) = self.decoder.message()? {
                each(message);
            }
        }
        Ok(())
    }

    pub(crate) fn kill(&mut self) {
        // Not there any more is as good.
        let _ = self.child.kill();
    }

    /// Detaches from the process, which ends by itself without the program; returns it to be waited
    /// for.
    pub(crate) fn detach(self) -> Child {
        self.child
    }

    /// Kills the process and returns it, to be waited for; its pictures stay mapped by their
    /// readers.
    pub(crate) fn into_child(mut self) -> Child {
        self.kill();
        self.child
    }
}

/// Describes how a process ended, in words.
pub(crate) fn ending(status: ExitStatus) -> String {
    match (status.signal(), status.code()) {
        (Some(signal), _) => format!("ended by signal {signal}"),
        (None, Some(code)) => format!("ended with exit code {code}"),
        (None, None) => "ended".to_owned(),
    }
}
