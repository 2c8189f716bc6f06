//! Certificates of the server and of the client, and the protection of messages.

use std::fs;
use std::path::Path;

use async_opcua::crypto::{
    PrivateKey, SecurityPolicy, X509, create_signature_data, verify_signature_data,
};
use async_opcua::types::{ByteString, DateTime, MessageSecurityMode};

use crate::settings::{Mode, Policy, SecurityFiles};

/// Certificates in a folder that are looked at.
const MAX_TRUSTED: usize = 1000;
/// Certificates of servers that were not trusted that are kept.
const MAX_REJECTED: usize = 16;
/// The largest file with a certificate or a key, bytes.
const MAX_FILE_BYTES: u64 = 64 * 1024;
/// Tag of a DER sequence, which a certificate is.
const DER_SEQUENCE: u8 = 0x30;

/// A certificate with its key.
#[derive(Clone)]
pub(crate) struct Own {
    pub(crate) certificate: X509,
    pub(crate) key: PrivateKey,
}

/// Security policy and mode that protect messages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Protection {
    pub(crate) policy: SecurityPolicy,
    pub(crate) mode: MessageSecurityMode,
}

impl Protection {
    pub(crate) const NONE: Self =
        Self { policy: SecurityPolicy::None, mode: MessageSecurityMode::None };

    pub(crate) fn from_files(files: Option<&SecurityFiles>) -> Self {
        let Some(files) = files else { return Self::NONE };
        Self {
            policy: match files.policy {
                Policy::Basic256Sha256 => SecurityPolicy::Basic256Sha256,
                Policy::Aes128Sha256RsaOaep => SecurityPolicy::Aes128Sha256RsaOaep,
                Policy::Aes256Sha256RsaPss => SecurityPolicy::Aes256Sha256RsaPss,
            },
            mode: match files.mode {
                Mode::Sign => MessageSecurityMode::Sign,
                Mode::SignAndEncrypt => MessageSecurityMode::SignAndEncrypt,
            },
        }
    }

    pub(crate) fn in_words(self) -> String {
        name_of(self.policy.to_uri(), self.mode)
    }
}

/// Formats a policy, given by its URI, and a mode as settings write them.
pub(crate) fn name_of(policy: &str, mode: MessageSecurityMode) -> String {
    match mode {
        MessageSecurityMode::None => "endpoint without security".into(),
        mode => format!("{} with {mode:?}", policy.rsplit('#').next().unwrap_or(policy)),
    }
}

impl Own {
    /// Reads a certificate and its key.
    ///
    /// # Errors
    /// The file at fault and the remedy; never the file's contents.
    pub(crate) fn load(certificate: &Path, key: &Path) -> Result<Self, String> {
        let own = Self { certificate: read_certificate(certificate)?, key: read_key(key)? };
        if !own.is_pair() {
            return Err(format!(
                "'{}' is not the key of '{}'",
                key.display(),
                certificate.display()
            ));
        }
        Ok(own)
    }

    /// Reports whether key and certificate are a pair, by a trial signature.
    fn is_pair(&self) -> bool {
        let (policy, nonce) = (SecurityPolicy::Basic256Sha256, ByteString::from(b"pair"));
        let signed = self.certificate.as_byte_string();
        create_signature_data(&self.key, policy, &signed, &nonce).is_ok_and(|signature| {
            let (ours, nonce) = (&self.certificate, nonce.as_ref());
            verify_signature_data(&signature, policy, ours, ours, nonce).is_ok()
        })
    }

    /// Checks that it suits a policy and names us.
    ///
    /// # Errors
    /// The mismatch, and the remedy.
    pub(crate) fn check(
        &self,
        policy: SecurityPolicy,
        application_uri: &str,
    ) -> Result<(), String> {
        check_certificate(&self.certificate, policy)
            .map_err(|what| format!("our certificate {what}"))?;
        self.certificate.is_application_uri_valid(application_uri).map_err(|_| {
            format!(
                "our certificate does not name '{application_uri}' as its first alternative \
                 name: make it so, or correct application_uri"
            )
        })
    }
}

/// Checks that a server's certificate is one of those that are trusted, and good.
///
/// # Errors
/// The certificate's owner, the reason of the distrust and the remedy.
pub(crate) fn check_server(
    files: &SecurityFiles,
    protection: Protection,
    certificate: &X509,
    application_uri: &str,
) -> Result<(), String> {
    let whose = format!(
        "the server's certificate ({}, SHA-1 {})",
        certificate.subject_name(),
        certificate.thumbprint().as_hex_string()
    );
    let der = certificate.as_byte_string();
    if !trusted(&files.trusted)?.contains(&der) {
        let kept = files.rejected.as_deref().map(|folder| keep_rejected(folder, certificate, &der));
        return Err(format!(
            "{whose} is not trusted: check at the server that it is its own, then put it to '{}'{}",
            files.trusted.display(),
            kept.unwrap_or_default()
        ));
    }
    check_certificate(certificate, protection.policy).map_err(|what| format!("{whose} {what}"))?;
    certificate.is_application_uri_valid(application_uri).map_err(|_| {
        format!("{whose} is not that of the application '{application_uri}', which the server says to be")
    })
}

fn check_certificate(certificate: &X509, policy: SecurityPolicy) -> Result<(), String> {
    let length = certificate.key_length().map_err(|_| "has no RSA key".to_owned())?;
    if !policy.is_valid_keylength(length) {
        return Err(format!("has a key of {length} bits, which {policy} does not allow"));
    }
    certificate
        .is_time_valid(&DateTime::now().as_chrono())
        .map_err(|error| format!("is not valid now: {error}"))
}

/// Reads the trusted certificates anew, since an operator may have added one.
fn trusted(path: &Path) -> Result<Vec<ByteString>, String> {
    let fault = |error: std::io::Error| format!("'{}': {error}", path.display());
    if !fs::metadata(path).map_err(fault)?.is_dir() {
        return Ok(vec![read_certificate(path)?.as_byte_string()]);
    }
    let mut found = Vec::new();
    for entry in fs::read_dir(path).map_err(fault)?.take(MAX_TRUSTED) {
        // What is no certificate may lie there: a list of revoked ones, a note.
        found.extend(read_certificate(&entry.map_err(fault)?.path()).map(|it| it.as_byte_string()));
    }
    Ok(found)
}

/// Writes a rejected certificate to the folder for an operator's inspection; returns a sentence
/// that says so.
fn keep_rejected(folder: &Path, certificate: &X509, der: &ByteString) -> String {
    let path = folder.join(format!("{}.der", certificate.thumbprint().as_hex_string()));
    let kept = || -> std::io::Result<bool> {
        if path.exists() {
            return Ok(true);
        }
        if fs::read_dir(folder)?.count() >= MAX_REJECTED {
            return Ok(false);
        }
        fs::write(&path, der.as_ref()).map(|()| true)
    };
    match kept() {
        Ok(true) => format!("; it lies in '{}'", path.display()),
        Ok(false) => format!("; '{}' is full and got no copy", folder.display()),
        Err(error) => format!("; '{}' got no copy: {error}", folder.display()),
    }
}

/// Returns the first certificate of a chain, the server's own.
///
/// # Errors
/// When there is none.
pub(crate) fn leaf(chain: &ByteString) -> Result<X509, String> {
    let bytes = chain.as_ref();
    let length = der_length(bytes).filter(|length| *length <= bytes.len());
    length
        .and_then(|length| X509::from_der(&bytes[..length]).ok())
        .ok_or_else(|| "the server has no certificate that can be read".into())
}

/// Bytes of the DER sequence that these begin with (X.690, 8.1.3).
fn der_length(bytes: &[u8]) -> Option<usize> {
    let (&first, rest) = bytes.strip_prefix(&[DER_SEQUENCE])?.split_first()?;
    if first < 0x80 {
        return Some(2 + usize::from(first));
    }
    let count = usize::from(first & 0x7F);
    let digits = rest.get(..count).filter(|_| (1..=3).contains(&count))?;
    let length = digits.iter().fold(0, |length, digit| length << 8 | usize::from(*digit));
    Some(2 + count + length)
}

fn read_certificate(path: &Path) -> Result<X509, String> {
    let bytes = read(path)?;
    let parsed = X509::from_der(&bytes).or_else(|_| X509::from_pem(&bytes));
    parsed.map_err(|_| format!("'{}' is no certificate in DER or PEM form", path.display()))
}

fn read_key(path: &Path) -> Result<PrivateKey, String> {
    PrivateKey::from_pem(&read(path)?)
        .map_err(|_| format!("'{}' is no RSA key in PEM form without a passphrase", path.display()))
}

fn read(path: &Path) -> Result<Vec<u8>, String> {
    let fault = |what: &dyn std::fmt::Display| format!("'{}': {what}", path.display());
    let metadata = fs::metadata(path).map_err(|error| fault(&error))?;
    if !metadata.is_file() || metadata.len() > MAX_FILE_BYTES {
        return Err(fault(&format!("it is no plain file of at most {MAX_FILE_BYTES} bytes")));
    }
    fs::read(path).map_err(|error| fault(&error))
}

#[cfg(test)]
#[path = "security_tests.rs"]
mod tests;
