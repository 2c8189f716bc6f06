//! Certificates for tests of encrypted connections.

use std::path::{Path, PathBuf};

use rcgen::{BasicConstraints, CertificateParams, DnType, IsCa, Issuer, KeyPair};

/// Certificate authority whose certificates are files in a folder.
pub struct CertificateAuthority {
    name: &'static str,
    folder: PathBuf,
    issuer: Issuer<'static, KeyPair>,
}

impl CertificateAuthority {
    /// Creates an authority with a self-signed certificate.
    ///
    /// # Panics
    /// When the folder cannot be written to.
    pub fn new(folder: &Path, name: &'static str) -> Self {
        let key = KeyPair::generate().expect("a key can be made");
        let mut params = CertificateParams::default();
        params.distinguished_name.push(DnType::CommonName, name);
        params.is_ca = IsCa::Ca(BasicConstraints::Unconstrained);
        let certificate = params.self_signed(&key).expect("it can be signed");
        let authority = Self { name, folder: folder.to_owned(), issuer: Issuer::new(params, key) };
        std::fs::write(authority.certificate(), certificate.pem()).expect("it can be written");
        authority
    }

    /// Returns the path of the authority's own certificate.
    pub fn certificate(&self) -> PathBuf {
        self.folder.join(format!("{}.pem", self.name))
    }

    /// Signs a certificate for this host; returns its path and its key's.
    ///
    /// # Panics
    /// When the folder cannot be written to.
    pub fn sign(&self, owner: &str, host: &str) -> (PathBuf, PathBuf) {
        let key = KeyPair::generate().expect("a key can be made");
        let params = CertificateParams::new(vec![host.to_owned()]).expect("it is a host");
        let certificate = params.signed_by(&key, &self.issuer).expect("it can be signed");
        let path = |end| self.folder.join(format!("{}_{owner}.{end}", self.name));
        let paths = (path("pem"), path("key"));
        std::fs::write(&paths.0, certificate.pem()).expect("it can be written");
        std::fs::write(&paths.1, key.serialize_pem()).expect("it can be written");
        paths
    }
}
