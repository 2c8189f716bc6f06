//! Site signatures: who vouches for a library.
//!
//! `LIBRARY.sig` beside a library holds an Ed25519 signature (RFC 8032) as 128
//! hexadecimal digits. What is signed is a prefix, so that the signature serves
//! for nothing else, and the SHA-256 of the library.

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

use ed25519_dalek::pkcs8::DecodePrivateKey;
use ed25519_dalek::{Signature, Signer, SigningKey, VerifyingKey};

use crate::Digest;
use crate::digest::{from_hex, to_hex};
use crate::trust::LibraryFile;

/// Domain separation prefix of the signed text, before the digest.
const PREFIX: &[u8] = b"busbar plugin library\0";
/// The largest signature or key file that is read.
const MAX_FILE_BYTES: u64 = 4096;
/// A key that others than its owner may read or write is none.
const OTHERS: u32 = 0o077;

/// A site's public key; as text, 64 hexadecimal digits.
#[derive(Clone, Debug, PartialEq)]
pub struct PublicKey(VerifyingKey);

impl PublicKey {
    /// Reads 64 hexadecimal digits.
    ///
    /// # Errors
    /// What is wrong with them.
    pub fn parse(text: &str) -> Result<Self, String> {
        let bytes = from_hex(text)?;
        VerifyingKey::from_bytes(&bytes)
            .map(Self)
            .map_err(|_| "it is no Ed25519 public key; `busbar plugin sign` prints yours".into())
    }
}

impl fmt::Display for PublicKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&to_hex(self.0.as_bytes()))
    }
}

/// Signs a library with the key of a PEM file (PKCS #8, as `openssl genpkey
/// -algorithm ed25519` makes it). Gives the text of the signature file, its
/// path and the public key.
///
/// # Errors
/// What cannot be read or used, with its remedy.
pub fn sign_library(library: &Path, key: &Path) -> Result<(PathBuf, String, PublicKey), String> {
    let file = File::open(library)
        .map_err(|error| format!("cannot read the library {}: {error}", library.display()))?;
    let digest = LibraryFile::trusted(library.to_owned(), file)
        .digest()
        .map_err(|error| format!("{}: {error}", library.display()))?;
    let key = read_key(key).map_err(|error| format!("the key {}: {error}", key.display()))?;
    let signature = key.sign(&message(digest));
    let text = format!("{}\n", to_hex(&signature.to_bytes()));
    Ok((signature_path(library), text, PublicKey(key.verifying_key())))
}

/// Verifies the signature file beside a library against the digest and the key.
pub(crate) fn verify(library: &Path, digest: Digest, key: &PublicKey) -> Result<(), String> {
    let path = signature_path(library);
    let remedy = "sign it with `busbar plugin sign`, or get it from whoever signs for this site";
    let text = read_text(&path).map_err(|error| {
        format!("its signature {} is missing: {error}; {remedy}", path.display())
    })?;
    let bytes = from_hex::<64>(text.trim())
        .map_err(|error| format!("its signature {}: {error}; {remedy}", path.display()))?;
    key.0.verify_strict(&message(digest), &Signature::from_bytes(&bytes)).map_err(|_| {
        format!("its signature is not that of the configured public key over this file; {remedy}")
    })
}

fn message(digest: Digest) -> Vec<u8> {
    [PREFIX, &digest.0].concat()
}

fn signature_path(library: &Path) -> PathBuf {
    let mut path = library.as_os_str().to_owned();
    path.push(".sig");
    path.into()
}

fn read_key(path: &Path) -> Result<SigningKey, String> {
    let metadata = path.metadata().map_err(|error| format!("cannot read it: {error}"))?;
    if metadata.mode() & OTHERS != 0 {
        return Err("others may use it; make it yours alone with `chmod 600`".into());
    }
    let text = read_text(path).map_err(|error| format!("cannot read it: {error}"))?;
    SigningKey::from_pkcs8_pem(&text).map_err(|_| {
        "it is no Ed25519 key in PEM; make one with `openssl genpkey -algorithm ed25519`".into()
    })
}

fn read_text(path: &Path) -> std::io::Result<String> {
    let mut text = String::new();
    File::open(path)?.take(MAX_FILE_BYTES).read_to_string(&mut text)?;
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::fs::{self, Permissions};
    use std::os::unix::fs::PermissionsExt;

    use super::*;
    use crate::trust::{LoadRules, libraries};

    /// Test key: the same byte throughout.
    const KEY: &str = "-----BEGIN PRIVATE KEY-----\n\
        MC4CAQAwBQYDK2VwBCIEIGhoaGhoaGhoaGhoaGhoaGhoaGhoaGhoaGhoaGhoaGho\n\
        -----END PRIVATE KEY-----\n";

    #[test]
    fn a_signed_library_is_loaded_and_another_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let (library, key) = (folder.path().join("liba.so"), folder.path().join("site.pem"));
        fs::write(&library, "library").unwrap();
        fs::write(&key, KEY).unwrap();
        fs::set_permissions(&key, Permissions::from_mode(0o644)).unwrap();
        assert!(sign_library(&library, &key).unwrap_err().contains("chmod 600"));
        fs::set_permissions(&key, Permissions::from_mode(0o600)).unwrap();
        let (path, text, public) = sign_library(&library, &key).unwrap();
        assert_eq!(PublicKey::parse(&public.to_string()), Ok(public.clone()));

        let rules = LoadRules { only: None, signed_by: Some(public) };
        let look = || libraries(&[folder.path().to_owned()], &rules);
        assert!(look().1[0].reason.contains("is missing"), "{:?}", look().1);
        fs::write(&path, &text).unwrap();
        assert_eq!(look().0.len(), 1, "{:?}", look().1);
        fs::write(&library, "another").unwrap();
        assert!(look().1[0].reason.contains("is not that of"), "{:?}", look().1);
        fs::write(&path, "no signature").unwrap();
        assert!(look().1[0].reason.contains("128 hexadecimal"), "{:?}", look().1);
    }

    #[test]
    fn keys_that_are_none_are_refused() {
        let y_off_the_curve = format!("02{}", "0".repeat(62));
        for text in ["", "00", &y_off_the_curve] {
            assert!(PublicKey::parse(text).is_err(), "{text}");
        }
    }
}
