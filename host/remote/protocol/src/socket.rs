//! Messages with descriptors over the socket between two processes.

use std::fs::File;
use std::io::{self, IoSlice, IoSliceMut, Write};
use std::mem::MaybeUninit;
use std::os::fd::BorrowedFd;
use std::os::unix::net::UnixStream;

use rustix::net::{
    RecvAncillaryBuffer, RecvAncillaryMessage, RecvFlags, SendAncillaryBuffer,
    SendAncillaryMessage, SendFlags, recvmsg, sendmsg,
};

use crate::framing;

/// Descriptors that go with one message.
pub const MAX_DESCRIPTORS: usize = 2;

/// Sends a whole message; its descriptors go with its first byte.
///
/// # Errors
/// The socket's.
pub fn send(
    mut socket: &UnixStream,
    bytes: &[u8],
    descriptors: &[BorrowedFd<'_>],
) -> io::Result<()> {
    let mut sent = 0;
    if !descriptors.is_empty() {
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(MAX_DESCRIPTORS))];
        let mut ancillary = SendAncillaryBuffer::new(&mut space);
        if !ancillary.push(SendAncillaryMessage::ScmRights(descriptors)) {
            return Err(io::Error::other("too many descriptors for one message"));
        }
        let slices = [IoSlice::new(bytes)];
        sent = sendmsg(socket, &slices, &mut ancillary, SendFlags::NOSIGNAL)?;
    }
    socket.write_all(&bytes[sent..])
}

/// Waits for a whole message with its descriptors; none at the end.
///
/// # Errors
/// The socket's; a message longer than `limit` bytes.
pub fn receive(socket: &UnixStream, limit: usize) -> io::Result<Option<(Vec<u8>, Vec<File>)>> {
    let mut files = Vec::new();
    let mut head = [0; framing::LENGTH_BYTES];
    if !fill(socket, &mut head, &mut files)? {
        return Ok(None);
    }
    let mut body = vec![0; framing::length(head, limit).map_err(io::Error::other)?];
    Ok(fill(socket, &mut body, &mut files)?.then_some((body, files)))
}

/// Fills a buffer; false if the other side is gone.
fn fill(socket: &UnixStream, buffer: &mut [u8], files: &mut Vec<File>) -> io::Result<bool> {
    let mut filled = 0;
    while filled < buffer.len() {
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(MAX_DESCRIPTORS))];
        let mut ancillary = RecvAncillaryBuffer::new(&mut space);
        let slices = &mut [IoSliceMut::new(&mut buffer[filled..])];
        let received = match recvmsg(socket, slices, &mut ancillary, RecvFlags::CMSG_CLOEXEC) {
            Err(rustix::io::Errno::INTR) => continue,
            received => received?,
        };
        for message in ancillary.drain() {
            if let RecvAncillaryMessage::ScmRights(descriptors) = message {
                files.extend(descriptors.map(File::from));
            }
        }
        if received.bytes == 0 {
            return Ok(false);
        }
        filled += received.bytes;
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use std::os::fd::AsFd;
    use std::os::unix::fs::FileExt;

    use super::*;
    use crate::memory;

    const LIMIT: usize = 2 << 20;

    #[test]
    fn a_message_arrives_with_its_descriptors() {
        let (here, there) = UnixStream::pair().unwrap();
        let memory = memory::zeroed("test", 8).unwrap();
        memory.write_all_at(b"12345678", 0).unwrap();
        let long = "x".repeat(1 << 20);
        let sending = std::thread::spawn(move || {
            send(&here, &framing::encode(&1_u32, LIMIT).unwrap(), &[]).unwrap();
            let bytes = framing::encode(&long, LIMIT).unwrap();
            send(&here, &bytes, &[memory.as_fd(), memory.as_fd()]).unwrap();
        });
        let (first, files) = receive(&there, LIMIT).unwrap().unwrap();
        assert_eq!((framing::decode(&first), files.len()), (Ok(1_u32), 0));
        let (second, files) = receive(&there, LIMIT).unwrap().unwrap();
        assert_eq!(framing::decode::<String>(&second).unwrap().len(), 1 << 20);
        let mut bytes = [0; 8];
        files[1].read_exact_at(&mut bytes, 0).unwrap();
        assert_eq!(&bytes, b"12345678");
        sending.join().unwrap();
        assert!(receive(&there, LIMIT).unwrap().is_none(), "the end");
    }
}
