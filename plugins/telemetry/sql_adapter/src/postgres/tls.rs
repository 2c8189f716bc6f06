//! Encrypted connections: who may be the server, and who we are.

use std::path::Path;
use std::sync::Arc;

use busbar_plugin_sdk::Error;
use tokio_postgres_rustls::MakeRustlsConnect;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use tokio_rustls::rustls::{self, ClientConfig, RootCertStore};

use crate::settings::TlsFiles;

/// TLS configuration that all connections share.
#[derive(Clone)]
pub(crate) struct Tls {
    pub(crate) connector: MakeRustlsConnect,
    pub(crate) server_name: String,
}

impl Tls {
    /// Loads the certificates and keys.
    ///
    /// # Errors
    /// [`Error::settings`] that names the file and its fault, never its contents.
    pub(crate) fn load(files: &TlsFiles) -> Result<Self, Error> {
        let server_name = files.server_name.clone();
        if ServerName::try_from(server_name.as_str()).is_err() {
            return Err(Error::settings(format!(
                "postgres.tls: '{server_name}' is no name that a certificate can have: set \
                 tls.server_name"
            )));
        }
        Ok(Self { connector: MakeRustlsConnect::new(client(files)?), server_name })
    }
}

fn client(files: &TlsFiles) -> Result<ClientConfig, Error> {
    let mut roots = RootCertStore::empty();
    for certificate in certificates(&files.ca)? {
        roots.add(certificate).map_err(|error| in_file(&files.ca, &error))?;
    }
    let unusable = |error: rustls::Error| Error::settings(format!("postgres.tls: {error}"));
    let builder = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(unusable)?
        .with_root_certificates(roots);
    let Some((certificate, key)) = &files.own else { return Ok(builder.with_no_client_auth()) };
    let chain = certificates(certificate)?;
    let key_bytes =
        PrivateKeyDer::from_pem_file(key).map_err(|error| in_file(key, &in_words(&error)))?;
    builder.with_client_auth_cert(chain, key_bytes).map_err(|error| in_file(key, &error))
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, Error> {
    let read = || CertificateDer::pem_file_iter(path)?.collect::<Result<Vec<_>, pem::Error>>();
    let certificates = read().map_err(|error| in_file(path, &in_words(&error)))?;
    if certificates.is_empty() {
        return Err(in_file(path, &"there is no certificate in it (PEM)"));
    }
    Ok(certificates)
}

fn in_words(error: &pem::Error) -> String {
    match error {
        pem::Error::Io(error) => error.to_string(),
        pem::Error::NoItemsFound => "what should be in it (PEM) is not there".into(),
        _ => "it is no PEM file".into(),
    }
}

fn in_file(path: &Path, what: &dyn std::fmt::Display) -> Error {
    Error::settings(format!("postgres.tls: '{}': {what}", path.display()))
}
