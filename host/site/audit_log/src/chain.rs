//! Keyed hash chain (HMAC-SHA-256, RFC 2104) over lines, and digests (SHA-256) of files.

use std::fmt;
use std::fs::OpenOptions;
use std::io::{self, Read};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::str::FromStr;

use data_encoding::HEXLOWER;
use hmac::{Hmac, KeyInit, Mac};
use rustix::fs::OFlags;
use sha2::{Digest, Sha256};

/// The shortest key, in bytes.
pub const MIN_KEY_BYTES: usize = 16;
/// The longest key, in bytes.
pub const MAX_KEY_BYTES: usize = 4_096;

const DIGEST_BYTES: usize = 32;
/// Digits by which a key is named: they say which key it is, and nothing about it.
const KEY_ID_DIGITS: usize = 16;
const KEY_ID_MARK: u8 = b'k';
const KEY_ID_TEXT: &[u8] = b"busbar audit log";

/// A value of 32 bytes, as hexadecimal text: of the chain after a line, or of a file.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub(crate) struct Digest256([u8; DIGEST_BYTES]);

impl fmt::Display for Digest256 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        HEXLOWER.encode_display(&self.0).fmt(f)
    }
}

impl fmt::Debug for Digest256 {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl FromStr for Digest256 {
    type Err = ();

    /// Parses 64 lower-case hexadecimal digits and nothing else: each value has one text.
    fn from_str(text: &str) -> Result<Self, ()> {
        let mut bytes = [0; DIGEST_BYTES];
        if text.len() != 2 * DIGEST_BYTES {
            return Err(());
        }
        HEXLOWER.decode_mut(text.as_bytes(), &mut bytes).map_err(|_| ())?;
        Ok(Self(bytes))
    }
}

/// A running SHA-256 over the bytes of a file.
#[derive(Clone, Debug, Default)]
pub(crate) struct FileHasher(Sha256);

impl FileHasher {
    pub(crate) fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    pub(crate) fn digest(&self) -> Digest256 {
        Digest256(self.0.clone().finalize().into())
    }
}

/// The key of a chain. The empty key makes a chain too, which anybody can make again.
#[derive(Clone)]
pub(crate) struct ChainKey {
    mac: Hmac<Sha256>,
    id: String,
}

impl fmt::Debug for ChainKey {
    /// Shows the id of the key, never the key.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ChainKey({:?})", self.id)
    }
}

impl Default for ChainKey {
    fn default() -> Self {
        Self::new(&[])
    }
}

impl ChainKey {
    pub(crate) fn new(key: &[u8]) -> Self {
        let mac = Hmac::new_from_slice(key).expect("HMAC takes keys of any length");
        let mut made = Self { mac, id: String::new() };
        if !key.is_empty() {
            let digest = made.link(&Digest256::default(), KEY_ID_MARK, KEY_ID_TEXT);
            made.id = digest.to_string()[..KEY_ID_DIGITS].to_owned();
        }
        made
    }

    /// Reads a key: all bytes of a file but an end of line after them.
    ///
    /// # Errors
    /// A file that cannot be read, is no regular file, or has too few or too many bytes.
    pub(crate) fn read(path: &Path) -> io::Result<Self> {
        // A pipe must not keep anybody waiting. Links are followed: secrets are mounted so.
        let flags = OFlags::NONBLOCK.bits() as i32;
        let file = OpenOptions::new().read(true).custom_flags(flags).open(path)?;
        if !file.metadata()?.is_file() {
            return Err(io::Error::other("it is no regular file"));
        }
        let mut bytes = Vec::new();
        file.take(MAX_KEY_BYTES as u64 + 2).read_to_end(&mut bytes)?;
        let key = bytes.strip_suffix(b"\n").unwrap_or(&bytes);
        let key = key.strip_suffix(b"\r").unwrap_or(key);
        if !(MIN_KEY_BYTES..=MAX_KEY_BYTES).contains(&key.len()) {
            let sizes = format!("{MIN_KEY_BYTES} to {MAX_KEY_BYTES} bytes");
            return Err(io::Error::other(format!("a key has {sizes}, this one {}", key.len())));
        }
        Ok(Self::new(key))
    }

    /// Names the key; empty for the empty key.
    pub(crate) fn id(&self) -> &str {
        &self.id
    }

    /// Chain value after a line: HMAC over the value before, the mark of the line, its text.
    pub(crate) fn link(&self, before: &Digest256, mark: u8, text: &[u8]) -> Digest256 {
        let mac = self.mac.clone().chain_update(before.0).chain_update([mark]).chain_update(text);
        Digest256(mac.finalize().into_bytes().into())
    }
}

/// The keys that a reader has: the one that is configured, and the empty one.
#[derive(Clone, Debug, Default)]
pub(crate) struct KeyRing {
    configured: Option<ChainKey>,
    empty: ChainKey,
}

impl KeyRing {
    pub(crate) fn new(configured: Option<ChainKey>) -> Self {
        Self { configured, empty: ChainKey::default() }
    }

    /// The key of this name, if the reader has it.
    pub(crate) fn find(&self, id: &str) -> Option<&ChainKey> {
        self.configured.iter().chain([&self.empty]).find(|key| key.id() == id)
    }

    /// The key that new lines are chained by.
    pub(crate) fn current(&self) -> &ChainKey {
        self.configured.as_ref().unwrap_or(&self.empty)
    }

    pub(crate) fn is_keyed(&self) -> bool {
        self.configured.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chain_is_hmac_sha_256_as_rfc_4231_has_it() {
        // Test case 2 of RFC 4231: the data is what follows the value before and the mark.
        let key = ChainKey::new(b"Jefe");
        let mac = key.mac.clone().chain_update(b"what do ya want for nothing?").finalize();
        let digest = Digest256(mac.into_bytes().into());
        let expected = "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843";
        assert_eq!(digest.to_string(), expected);
        assert_eq!(expected.parse(), Ok(digest));
        for wrong in [&expected[1..], &expected.to_uppercase(), ""] {
            assert_eq!(wrong.parse::<Digest256>(), Err(()));
        }
    }

    #[test]
    fn keys_have_a_length_and_lose_the_end_of_a_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("key");
        let read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            ChainKey::read(&path).map(|key| key.id().to_owned())
        };
        let id = read(b"0123456789abcdef").unwrap();
        assert_eq!(id.len(), KEY_ID_DIGITS);
        assert_eq!(read(b"0123456789abcdef\n").unwrap(), id);
        assert_eq!(read(b"0123456789abcdef\r\n").unwrap(), id);
        assert_ne!(read(b"0123456789abcdeg").unwrap(), id);
        assert!(read(b"0123456789abcde\n").is_err());
        assert!(read(&[7; MAX_KEY_BYTES]).is_ok());
        assert!(read(&[7; MAX_KEY_BYTES + 1]).is_err());
        assert!(ChainKey::read(folder.path()).is_err());
        assert!(ChainKey::read(&folder.path().join("absent")).is_err());
        assert!(!format!("{:?}", ChainKey::new(b"Jefe")).contains("Jefe"));
    }
}
