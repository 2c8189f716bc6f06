//! PostgreSQL itself: a cluster of its own for each test, in a temporary folder. The
//! end-to-end tests include this file too.

use std::fs::{Permissions, read_dir, read_to_string, set_permissions, write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::fs::{MetadataExt, PermissionsExt, chown};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

use serde_json::json;

use super::{PATIENCE, available};

/// Folder in which Debian installs the programs of each version.
const VERSIONS: &str = "/usr/lib/postgresql";
/// The server refuses to run as root, and then runs as this user.
const UNPRIVILEGED: &str = "postgres";
pub(super) const PASSWORD: &str = "pa55word of viewer";
/// A role that may read everything.
pub(super) const USER: &str = "viewer";
const ADMINISTRATOR: &str = "administrator";
/// Whoever comes over the socket is let in: the folder is the test's alone.
const ACCESS: &str = "local all all trust\nhost all all 127.0.0.1/32 scram-sha-256\n";

pub(super) struct Cluster {
    folder: TempDir,
    programs: PathBuf,
    pub(super) port: u16,
    server: Option<Child>,
    options: Vec<String>,
}

impl Cluster {
    /// Makes and starts one; none, said aloud, where there is no PostgreSQL.
    pub(super) fn start() -> Option<Self> {
        Self::start_with(ACCESS, |_| Vec::new())
    }

    /// Starts a cluster with a pg_hba.conf and options that may name files in the folder.
    pub(super) fn start_with(
        access: &str,
        options: impl FnOnce(&Self) -> Vec<String>,
    ) -> Option<Self> {
        let programs = programs();
        let remedy = "no PostgreSQL: install the package postgresql, or run `cargo xtask test`";
        if !available(programs.is_some(), remedy) {
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        let mut cluster =
            Self { folder, programs: programs?, port: 0, server: None, options: Vec::new() };
        cluster.own(cluster.folder.path());
        let mut initdb = cluster.command("initdb");
        initdb.args(["--no-sync", "--locale=C", "--encoding=UTF8", "--auth=trust"]);
        initdb.args(["--username", ADMINISTRATOR, "--pgdata"]).arg(cluster.data());
        run(&mut initdb);
        write(cluster.data().join("pg_hba.conf"), access).unwrap();
        cluster.options = options(&cluster);
        cluster.port = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        cluster.restart();
        cluster.sql(&format!(
            "CREATE ROLE {USER} LOGIN PASSWORD '{PASSWORD}'; GRANT pg_read_all_data TO {USER}"
        ));
        Some(cluster)
    }

    /// Starts the server, again if need be, and waits until it takes connections.
    pub(super) fn restart(&mut self) {
        self.signal("QUIT");
        self.reap();
        let mut command = self.command("postgres");
        command.arg("-D").arg(self.data()).args(["-p", &self.port.to_string()]);
        command.args(["-c", "listen_addresses=127.0.0.1", "-c", "fsync=off"]);
        command.arg("-c").arg(format!("unix_socket_directories={}", self.folder.path().display()));
        for option in &self.options {
            command.args(["-c", option]);
        }
        let log = std::fs::File::create(self.folder.path().join("log")).unwrap();
        command.stdout(Stdio::null()).stderr(log).stdin(Stdio::null());
        self.server = Some(command.spawn().unwrap());
        let started = Instant::now();
        while !self.psql("SELECT 1").output().unwrap().status.success() {
            assert!(started.elapsed() < PATIENCE, "no server:\n{}", self.log());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Runs commands as the administrator.
    #[track_caller]
    pub(super) fn sql(&self, commands: &str) -> String {
        run(&mut self.psql(commands))
    }

    fn psql(&self, commands: &str) -> Command {
        let mut psql = self.command("psql");
        psql.args(["-X", "-q", "-t", "-A", "-v", "ON_ERROR_STOP=1", "-U", ADMINISTRATOR]);
        psql.arg("-h").arg(self.folder.path()).args(["-p", &self.port.to_string()]);
        psql.args(["-d", "postgres", "-c", commands]).stderr(Stdio::piped());
        psql
    }

    /// Settings that lead here, without encryption, with these queries.
    pub(super) fn settings(&self, queries: &[serde_json::Value]) -> serde_json::Value {
        json!({
            "postgres": {
                "host": "127.0.0.1", "port": self.port, "database": "postgres", "user": USER,
                "password": {"file": self.secret("password", PASSWORD)}, "sslmode": "disable",
                "keep_alive_seconds": 0.5,
            },
            "queries": queries,
            "timeout_seconds": 2,
        })
    }

    /// A file with a credential that only its owner can read.
    pub(super) fn secret(&self, name: &str, content: &str) -> PathBuf {
        let path = self.folder.path().join(name);
        write(&path, content).unwrap();
        set_permissions(&path, Permissions::from_mode(0o600)).unwrap();
        path
    }

    pub(super) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Gives a file to whom the server runs as.
    pub(super) fn own(&self, path: &Path) {
        if is_root() {
            let id = |flag| run(Command::new("id").args([flag, UNPRIVILEGED]));
            let [user, group] = ["-u", "-g"].map(|flag| Some(id(flag).trim().parse().unwrap()));
            chown(path, user, group).unwrap();
        }
    }

    /// Sends a signal to the server and all its processes.
    pub(super) fn signal(&self, signal: &str) {
        let Some(server) = &self.server else { return };
        let mut ids = vec![server.id().to_string()];
        ids.extend(children(server.id()));
        let _ = Command::new("kill").args(["-s", signal]).args(ids).stderr(Stdio::null()).status();
    }

    /// Ends the server in an orderly way, without waiting for its sessions to end.
    pub(super) fn shut_down(&mut self) {
        self.signal("INT");
        self.reap();
    }

    pub(super) fn kill(&mut self) {
        self.signal("KILL");
        self.reap();
    }

    pub(super) fn log(&self) -> String {
        read_to_string(self.folder.path().join("log")).unwrap_or_default()
    }

    fn reap(&mut self) {
        if let Some(mut server) = self.server.take() {
            let _ = server.wait();
        }
    }

    fn data(&self) -> PathBuf {
        self.folder.path().join("data")
    }

    /// A program of PostgreSQL, as a user whom the server runs for.
    fn command(&self, program: &str) -> Command {
        let path = self.programs.join(program);
        let mut command = if is_root() {
            let mut setpriv = Command::new("setpriv");
            let [user, group] = ["--reuid", "--regid"].map(|flag| format!("{flag}={UNPRIVILEGED}"));
            setpriv.args([&user, &group, "--clear-groups"]).arg(path);
            setpriv
        } else {
            Command::new(path)
        };
        command.current_dir(self.folder.path()).env_remove("PGPASSWORD");
        command
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        // One that was stopped could not end.
        self.signal("CONT");
        self.signal("QUIT");
        self.reap();
    }
}

/// The programs of the newest version that is installed.
fn programs() -> Option<PathBuf> {
    let versions = read_dir(VERSIONS).ok()?.flatten();
    let numbered = versions.filter_map(|entry| {
        let number: u32 = entry.file_name().to_str()?.parse().ok()?;
        Some((number, entry.path().join("bin"))).filter(|(_, bin)| bin.join("postgres").exists())
    });
    numbered.max().map(|(_, bin)| bin)
}

fn is_root() -> bool {
    std::fs::metadata("/proc/self").unwrap().uid() == 0
}

fn children(parent: u32) -> Vec<String> {
    let parent = parent.to_string();
    let numbers = read_dir("/proc").unwrap().flatten();
    let numbers = numbers.filter_map(|entry| entry.file_name().into_string().ok());
    let is_child = |pid: &String| {
        let stat = read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
        let after_name = stat.rsplit(')').next().unwrap_or_default();
        after_name.split_whitespace().nth(1) == Some(&parent)
    };
    numbers.filter(|pid| pid.bytes().all(|b| b.is_ascii_digit())).filter(is_child).collect()
}

#[track_caller]
fn run(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {said}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Reports whether nobody listens at a port any more.
pub(super) fn is_free(port: u16) -> bool {
    TcpStream::connect(("127.0.0.1", port)).is_err()
}
