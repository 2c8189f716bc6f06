//! Encrypted connections (IEC 62351-3): who may be the station, and who we are.

use std::path::Path;
use std::sync::Arc;

use busbar_plugin_sdk::Error;
use tokio_rustls::TlsConnector;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use tokio_rustls::rustls::{self, ClientConfig, RootCertStore};

use crate::settings::{Config, Endpoint, TlsFiles};

/// What every encrypted connection needs.
#[derive(Clone)]
pub(crate) struct Tls {
    connector: TlsConnector,
    server_name: Option<String>,
}

impl Tls {
    /// Reads the certificates, if the settings have any.
    ///
    /// # Errors
    /// [`Error::settings`] that names the file and its fault, never its contents.
    pub(crate) fn load(config: &Config) -> Result<Option<Self>, Error> {
        let Some(files) = &config.tls else { return Ok(None) };
        let tls = Self {
            connector: TlsConnector::from(Arc::new(client(files)?)),
            server_name: files.server_name.clone(),
        };
        for endpoint in &config.endpoints {
            tls.server_name(endpoint)?;
        }
        Ok(Some(tls))
    }

    pub(crate) fn connector(&self) -> &TlsConnector {
        &self.connector
    }

    /// The name that the station's certificate must have.
    pub(crate) fn server_name(&self, endpoint: &Endpoint) -> Result<ServerName<'static>, Error> {
        let name = self.server_name.clone().unwrap_or_else(|| endpoint.host.clone());
        ServerName::try_from(name.clone()).map_err(|_| {
            Error::settings(format!(
                "tls: '{name}' is no name that a certificate can have: set tls.server_name"
            ))
        })
    }
}

fn client(files: &TlsFiles) -> Result<ClientConfig, Error> {
    let mut roots = RootCertStore::empty();
    for certificate in certificates(&files.ca)? {
        roots.add(certificate).map_err(|error| in_file(&files.ca, &error))?;
    }
    let unusable = |error: rustls::Error| Error::settings(format!("tls: {error}"));
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
    Error::settings(format!("tls: '{}': {what}", path.display()))
}
