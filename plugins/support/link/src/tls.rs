//! TLS client: trusted authorities, client certificate, server name.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Deserialize;
use thiserror::Error;
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::{self, PemObject};
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer, ServerName};
use tokio_rustls::rustls::{self, ClientConfig, RootCertStore};

use crate::connect::describe_io_error;
use crate::{ConnectError, Endpoint, SettingsFaults};

/// Files in PEM form, by absolute paths. A key is a file that only its owner
/// should be able to read; its contents are never shown.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TlsSettings {
    /// Certificates of the trusted authorities for the device.
    ca: PathBuf,
    /// Certificate of this client, and those that lead to its authority.
    certificate: Option<PathBuf>,
    /// Private key of the client certificate.
    key: Option<PathBuf>,
    /// Name in the device's certificate, where it is not `host`.
    server_name: Option<String>,
}

/// Paths of certificates and keys; all are absolute.
#[derive(Clone, Debug)]
pub struct TlsFiles {
    ca: PathBuf,
    /// Client certificate and its key.
    own: Option<(PathBuf, PathBuf)>,
    server_name: Option<String>,
}

/// Error of a file or a name of the settings `tls`. It never shows the contents of a file.
#[derive(Debug, Error, PartialEq, Eq)]
#[error("tls: {0}")]
pub struct TlsError(String);

impl TlsSettings {
    /// Checks the setting `tls`, without reading the files.
    pub fn parse(self, faults: &mut SettingsFaults) -> TlsFiles {
        let own = match (self.certificate, self.key) {
            (Some(certificate), Some(key)) => Some((certificate, key)),
            (None, None) => None,
            _ => {
                faults.add("tls: certificate and key go together");
                None
            }
        };
        let own_paths = own.iter().flat_map(|(certificate, key)| [certificate, key]);
        for path in own_paths.chain([&self.ca]).filter(|path| !path.is_absolute()) {
            faults.add(format!("tls: '{}' is no absolute path", path.display()));
        }
        TlsFiles { ca: self.ca, own, server_name: self.server_name }
    }
}

impl TlsFiles {
    /// Returns the path of the trusted authorities.
    pub fn ca(&self) -> &Path {
        &self.ca
    }

    /// Returns the paths of the client certificate and its key.
    pub fn own(&self) -> Option<(&Path, &Path)> {
        self.own.as_ref().map(|(certificate, key)| (certificate.as_path(), key.as_path()))
    }

    /// Returns the name in the device's certificate, where it is not the host.
    pub fn server_name(&self) -> Option<&str> {
        self.server_name.as_deref()
    }
}

/// TLS configuration that all connections share.
#[derive(Clone)]
pub struct TlsClient {
    connector: TlsConnector,
    server_name: Option<String>,
}

impl TlsClient {
    /// Loads the certificates, for connections to these endpoints.
    ///
    /// # Errors
    /// The file or the name at fault.
    pub fn load<'a>(
        files: &TlsFiles,
        endpoints: impl IntoIterator<Item = &'a Endpoint>,
    ) -> Result<Self, TlsError> {
        let connector = TlsConnector::from(Arc::new(client(files)?));
        let tls = Self { connector, server_name: files.server_name.clone() };
        for endpoint in endpoints {
            tls.name_of(endpoint)?;
        }
        Ok(tls)
    }

    /// Encrypts a connection that was just made.
    ///
    /// # Errors
    /// A certificate or name that is refused.
    pub async fn handshake(
        &self,
        endpoint: &Endpoint,
        stream: TcpStream,
    ) -> Result<TlsStream<TcpStream>, ConnectError> {
        let name = self.name_of(endpoint).map_err(|fault| ConnectError::Insecure(fault.0))?;
        let connected = self.connector.connect(name, stream).await;
        connected.map_err(|error| ConnectError::Insecure(describe_io_error(&error)))
    }

    /// Returns the name that the device's certificate must have.
    fn name_of(&self, endpoint: &Endpoint) -> Result<ServerName<'static>, TlsError> {
        let name = self.server_name.as_ref().unwrap_or(&endpoint.host);
        ServerName::try_from(name.clone()).map_err(|_| {
            TlsError(format!(
                "'{name}' is no name that a certificate can have: set tls.server_name"
            ))
        })
    }
}

/// Reports whether encryption failed, rather than what is encrypted.
pub fn is_tls_error(error: &io::Error) -> bool {
    let inner = error.get_ref();
    // The end of a stream that was not announced is told by a text alone.
    inner.is_some_and(|inner| inner.is::<rustls::Error>())
        || error.kind() == io::ErrorKind::UnexpectedEof && error.to_string().contains("TLS")
}

fn client(files: &TlsFiles) -> Result<ClientConfig, TlsError> {
    let mut roots = RootCertStore::empty();
    for certificate in certificates(&files.ca)? {
        roots.add(certificate).map_err(|error| in_file(&files.ca, &error))?;
    }
    let builder = ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_safe_default_protocol_versions()
        .map_err(|error: rustls::Error| TlsError(error.to_string()))?
        .with_root_certificates(roots);
    let Some((certificate, key)) = &files.own else { return Ok(builder.with_no_client_auth()) };
    let chain = certificates(certificate)?;
    let key_bytes =
        PrivateKeyDer::from_pem_file(key).map_err(|error| in_file(key, &pem_fault(&error)))?;
    builder.with_client_auth_cert(chain, key_bytes).map_err(|error| in_file(key, &error))
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, TlsError> {
    let read = || CertificateDer::pem_file_iter(path)?.collect::<Result<Vec<_>, pem::Error>>();
    let certificates = read().map_err(|error| in_file(path, &pem_fault(&error)))?;
    if certificates.is_empty() {
        return Err(in_file(path, &"there is no certificate in it (PEM)"));
    }
    Ok(certificates)
}

fn pem_fault(error: &pem::Error) -> String {
    match error {
        pem::Error::Io(error) => error.to_string(),
        pem::Error::NoItemsFound => "what should be in it (PEM) is not there".into(),
        _ => "it is no PEM file".into(),
    }
}

fn in_file(path: &Path, what: &dyn Display) -> TlsError {
    TlsError(format!("'{}': {what}", path.display()))
}
