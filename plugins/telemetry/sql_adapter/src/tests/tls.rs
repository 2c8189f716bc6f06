//! Encrypted connections, to PostgreSQL behind OpenSSL.

use std::path::PathBuf;

use rcgen::{CertificateParams, Issuer, KeyPair};

use super::cluster::Cluster;
use super::*;

/// Over TCP only who encrypts and has a certificate is asked for the password.
const ACCESS: &str = "local all all trust
hostssl all all 127.0.0.1/32 scram-sha-256 clientcert=verify-ca
hostnossl all all 127.0.0.1/32 reject
";

/// An authority that signs certificates, in a cluster's folder.
struct Authority {
    name: &'static str,
    issuer: Issuer<'static, KeyPair>,
    certificate: PathBuf,
}

impl Authority {
    fn new(cluster: &Cluster, name: &'static str) -> Self {
        let key = KeyPair::generate().unwrap();
        let mut params = CertificateParams::default();
        params.distinguished_name.push(rcgen::DnType::CommonName, name);
        params.is_ca = rcgen::IsCa::Ca(rcgen::BasicConstraints::Unconstrained);
        let signed = params.self_signed(&key).unwrap();
        let certificate = cluster.secret(&format!("{name}.pem"), &signed.pem());
        Self { name, issuer: Issuer::new(params, key), certificate }
    }

    /// Signs a certificate; its path and its key's.
    fn sign(&self, cluster: &Cluster, owner: &str, host: &str) -> (PathBuf, PathBuf) {
        let key = KeyPair::generate().unwrap();
        let params = CertificateParams::new(vec![host.to_owned()]).unwrap();
        let certificate = params.signed_by(&key, &self.issuer).unwrap();
        let path = |end| format!("{}_{owner}.{end}", self.name);
        let pem = cluster.secret(&path("pem"), &certificate.pem());
        (pem, cluster.secret(&path("key"), &key.serialize_pem()))
    }
}

#[test]
fn only_the_right_certificates_open_a_connection() {
    let mut made = None;
    let cluster = Cluster::start_with(ACCESS, |cluster| {
        let ours = Authority::new(cluster, "ours");
        let server = ours.sign(cluster, "server", "127.0.0.1");
        for path in [&server.0, &server.1, &ours.certificate] {
            cluster.own(path);
        }
        let option = |name: &str, path: &PathBuf| format!("{name}={}", path.display());
        let options = vec![
            "ssl=on".to_owned(),
            option("ssl_cert_file", &server.0),
            option("ssl_key_file", &server.1),
            option("ssl_ca_file", &ours.certificate),
        ];
        made = Some(ours);
        options
    });
    let (Some(cluster), Some(ours)) = (cluster, made) else { return };
    let theirs = Authority::new(&cluster, "theirs");
    let connect = |ca: &Authority, own: Option<&(PathBuf, PathBuf)>, server_name: &str| {
        let mut settings = cluster.settings(&[query(
            "q",
            "SELECT ssl::int AS v FROM pg_stat_ssl WHERE pid = pg_backend_pid()",
        )]);
        let mut tls = json!({"ca": ca.certificate, "server_name": server_name});
        if let Some((certificate, key)) = own {
            tls["certificate"] = json!(certificate);
            tls["key"] = json!(key);
        }
        settings["postgres"]["sslmode"] = json!("verify-full");
        settings["postgres"]["tls"] = tls;
        start(settings, vec![column(1, "q", "v", ValueKind::I64)])
    };
    let (good, bad) = (ours.sign(&cluster, "client", "v"), theirs.sign(&cluster, "client", "v"));
    connect(&ours, Some(&good), "127.0.0.1").wait_for(1, Value::I64(1));

    let refused = [
        (connect(&theirs, Some(&good), "127.0.0.1"), "UnknownIssuer"),
        (connect(&ours, Some(&good), "another.example"), "not valid for name"),
        (connect(&ours, None, "127.0.0.1"), ""),
        (connect(&ours, Some(&bad), "127.0.0.1"), ""),
    ];
    for (running, message) in &refused {
        running.wait_for_link(LinkState::Down, message);
        running.wait_for_bad(1, Reason::Communication);
        assert!(!running.has_good_samples());
    }
    // And without encryption the server lets nobody in.
    let settings = cluster.settings(&[query("q", "SELECT 1 AS v")]);
    let plain = start(settings, vec![column(1, "q", "v", ValueKind::I64)]);
    plain.wait_for_link(LinkState::Down, "pg_hba.conf");
    assert!(!plain.has_good_samples());
}

#[test]
fn a_server_without_encryption_is_not_talked_to() {
    let Some(cluster) = Cluster::start() else { return };
    let ours = Authority::new(&cluster, "ours");
    let mut settings = cluster.settings(&[query("q", "SELECT 1 AS v")]);
    settings["postgres"]["sslmode"] = json!("verify-full");
    settings["postgres"]["tls"] = json!({"ca": ours.certificate});
    let running = start(settings, vec![column(1, "q", "v", ValueKind::I64)]);
    running.wait_for_link(LinkState::Down, "server does not support TLS");
    assert!(!running.has_good_samples());
}

#[test]
fn files_that_cannot_be_used_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let garbage = folder.path().join("garbage.pem");
    std::fs::write(&garbage, "no certificate").unwrap();
    let missing = folder.path().join("missing.pem");
    for path in [&garbage, &missing] {
        let settings = json!({
            "postgres": {"host": "127.0.0.1", "database": "d", "user": "u", "tls": {"ca": path}},
            "queries": [query("q", "SELECT 1 AS v")],
        });
        let tags = vec![column(1, "q", "v", ValueKind::I64)];
        let fault = create(settings).start(tags, Recorder::new().sink()).unwrap_err();
        let expected = format!("postgres.tls: '{}': ", path.display());
        assert!(fault.message().starts_with(&expected), "{fault}");
    }
}
