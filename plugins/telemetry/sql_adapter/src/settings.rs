//! Settings as typed, and the valid configuration made from them.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use busbar_link::{ReconnectBounds, ReconnectSettings, SettingsFaults};
use busbar_plugin_sdk::{Error, Secret};
use schemars::JsonSchema;
use serde::Deserialize;
use text_table::{NumberFormat, TimeFormat, TimeReader, Zone};

use crate::convert::TimeRules;

/// Queries and channels of one instance.
const MAX_QUERIES: usize = 256;
const MAX_CHANNELS: usize = 64;
/// The longest query, bytes.
const MAX_SQL_BYTES: usize = 65_536;
/// The longest name of a query, user, database or host, bytes.
const MAX_NAME_BYTES: usize = 253;
/// The longest name of a channel, bytes (PostgreSQL's NAMEDATALEN - 1).
const MAX_CHANNEL_BYTES: usize = 63;
/// The shortest and the longest period, milliseconds.
const PERIODS: std::ops::RangeInclusive<u64> = 100..=86_400_000;
/// Range of deadlines, milliseconds.
const DEADLINES: std::ops::RangeInclusive<u64> = 100..=600_000;

/// A database, and what is asked of it. Give `postgres` or `sqlite`.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Server of a PostgreSQL database.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "RawPostgres")]
    postgres: Option<RawPostgres>,
    /// File of an SQLite database.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "RawSqlite")]
    sqlite: Option<RawSqlite>,
    /// Queries, and their periods.
    #[schemars(length(min = 1, max = 256), example = example_queries())]
    queries: Vec<RawQuery>,
    /// Channels on which a PostgreSQL server tells of new values.
    #[serde(default)]
    #[schemars(length(max = 64))]
    listen: Vec<RawListen>,
    /// The longest that a query may take, seconds.
    #[serde(default = "default_timeout")]
    #[schemars(range(min = 0.1, max = 600.0))]
    #[schemars(extend("x-busbar-formerly" = ["timeout_millis"]))]
    timeout_seconds: f64,
    /// Delay between tries to connect.
    #[serde(default)]
    reconnect: ReconnectSettings,
    /// Zone of times that name none: `Europe/Berlin`, `UTC` or `+05:30`. Without it those of SQLite
    /// are UTC, and those of PostgreSQL are refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String", length(min = 1, max = 64), example = &"Europe/Berlin")]
    zone: Option<String>,
    /// Format of times that are texts or numbers: `rfc3339` (numbers are Unix seconds),
    /// `unix_millis`, `unix_micros`, `unix_nanos`, `excel`, or a pattern of strftime such as
    /// `%d.%m.%Y %H:%M:%S`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String", length(min = 1, max = 100), example = &"%d.%m.%Y %H:%M:%S")]
    time_format: Option<String>,
}

/// A PostgreSQL server, and who we are there.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawPostgres {
    /// Host name or address; with a `/` first the folder of a Unix socket.
    #[schemars(length(min = 1, max = 253))]
    host: String,
    /// TCP port, or number of the socket.
    #[serde(default = "default_port")]
    #[schemars(range(min = 1))]
    port: u16,
    /// Name of the database.
    #[schemars(length(min = 1, max = 253))]
    database: String,
    /// Name of the role; one that may only read.
    #[schemars(length(min = 1, max = 253))]
    user: String,
    /// Password of the user.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Secret")]
    password: Option<Secret>,
    /// Encryption of the connection; nothing weaker is ever tried. Over TCP the default is
    /// `verify-full`, over a Unix socket only `disable` is possible.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "SslMode")]
    sslmode: Option<SslMode>,
    /// Certificates for the mode `verify-full`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "RawTls")]
    tls: Option<RawTls>,
    /// Deadline of connecting, name lookup and authentication included, seconds.
    #[serde(default = "default_timeout")]
    #[schemars(range(min = 0.1, max = 600.0))]
    #[schemars(extend("x-busbar-formerly" = ["connect_millis"]))]
    connect_seconds: f64,
    /// Silence after which the server is asked whether it lives, seconds.
    #[serde(default = "default_keep_alive")]
    #[schemars(range(min = 0.1, max = 86_400.0))]
    #[schemars(extend("x-busbar-formerly" = ["keepalive_millis"]))]
    keep_alive_seconds: f64,
}

/// Encryption of a connection.
#[derive(Clone, Copy, Debug, Deserialize, JsonSchema, PartialEq, Eq)]
#[serde(rename_all = "kebab-case")]
enum SslMode {
    /// Connection without any encryption.
    Disable,
    /// By TLS, to a server whose certificate an authority of `tls.ca` vouches for and
    /// whose name it has.
    VerifyFull,
}

/// Files in PEM form, by absolute paths.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawTls {
    /// Certificates of the authorities that may vouch for the server.
    ca: PathBuf,
    /// Our certificate, and those that lead to its authority.
    certificate: Option<PathBuf>,
    /// The key of our certificate.
    key: Option<PathBuf>,
    /// The name in the server's certificate, where it is not `host`.
    server_name: Option<String>,
}

/// An SQLite file; it is only read.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawSqlite {
    /// Absolute path of the file.
    path: PathBuf,
}

/// Query of the database.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawQuery {
    /// Name, for the addresses of tags.
    #[schemars(length(min = 1, max = 253))]
    name: String,
    /// One statement that only reads: one row with a column a tag, or rows with the
    /// columns key and value, and quality and time where there are any.
    #[schemars(length(min = 1, max = 65_536))]
    sql: String,
    /// Period, seconds. Without one the query runs when the connection is made, and
    /// a channel of `listen` brings what changes.
    #[serde(default)]
    #[schemars(range(min = 0.1, max = 86_400.0))]
    #[schemars(extend("x-busbar-formerly" = ["poll_millis"]))]
    poll_seconds: Option<f64>,
}

/// A channel on which a server tells of new values (NOTIFY).
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawListen {
    /// Name of the channel.
    #[schemars(length(min = 1, max = 63))]
    channel: String,
    /// The query whose keys its payloads have; it gives all values when a connection
    /// is made.
    #[schemars(length(min = 1, max = 253))]
    query: String,
}

fn default_port() -> u16 {
    5432
}

fn default_timeout() -> f64 {
    5.0
}

fn default_keep_alive() -> f64 {
    5.0
}

fn example_queries() -> serde_json::Value {
    serde_json::json!([{ "name": "oil", "sql": "SELECT top_oil FROM t1", "poll_seconds": 1 }])
}

/// Settings that have been checked.
#[derive(Clone, Debug)]
pub(crate) struct Config {
    pub(crate) database: Database,
    pub(crate) queries: Vec<QueryConfig>,
    pub(crate) channels: Vec<Channel>,
    pub(crate) timeout: Duration,
    pub(crate) reconnect: ReconnectBounds,
    pub(crate) times: TimeRules,
}

/// Database to connect to.
#[derive(Clone, Debug)]
pub(crate) enum Database {
    Postgres(Box<Postgres>),
    Sqlite(PathBuf),
}

/// A server, and who we are there.
#[derive(Clone, Debug)]
pub(crate) struct Postgres {
    pub(crate) host: String,
    pub(crate) port: u16,
    pub(crate) database: String,
    pub(crate) user: String,
    pub(crate) password: Option<Secret>,
    /// Certificates; `None` where nothing is encrypted.
    pub(crate) tls: Option<TlsFiles>,
    pub(crate) connect_timeout: Duration,
    pub(crate) keepalive: Duration,
}

/// Paths of certificates and keys; all are absolute.
#[derive(Clone, Debug)]
pub(crate) struct TlsFiles {
    pub(crate) ca: PathBuf,
    /// Our certificate and its key.
    pub(crate) own: Option<(PathBuf, PathBuf)>,
    /// The name that the server's certificate must have.
    pub(crate) server_name: String,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct QueryConfig {
    pub(crate) name: String,
    pub(crate) sql: String,
    pub(crate) period: Option<Duration>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channel {
    pub(crate) name: String,
    /// Index of the query whose keys its payloads have.
    pub(crate) query: usize,
}

impl Config {
    /// The database, for people.
    pub(crate) fn label(&self) -> String {
        match &self.database {
            Database::Postgres(postgres) => {
                let Postgres { host, port, database, .. } = &**postgres;
                let host = if host.contains(':') { format!("[{host}]") } else { host.clone() };
                format!("{host}:{port}/{database}")
            }
            Database::Sqlite(path) => path.display().to_string(),
        }
    }
}

impl Settings {
    /// Checks all of it.
    ///
    /// # Errors
    /// [`Error::settings`] with each fault and what is allowed.
    pub(crate) fn parse(self) -> Result<Config, Error> {
        let mut faults = SettingsFaults::default();
        let database = match (self.postgres, self.sqlite) {
            (Some(postgres), None) => {
                Some(Database::Postgres(Box::new(postgres.parse(&mut faults))))
            }
            (None, Some(sqlite)) => {
                if !sqlite.path.is_absolute() {
                    let path = sqlite.path.display();
                    faults.add(format!("sqlite.path: '{path}' is no absolute path"));
                }
                if !self.listen.is_empty() {
                    faults.add("listen: SQLite tells of nothing; give the queries poll_seconds");
                }
                Some(Database::Sqlite(sqlite.path))
            }
            _ => {
                faults.add("give \"postgres\" or \"sqlite\", one of them");
                None
            }
        };
        let queries = parse_queries(self.queries, &mut faults);
        let channels = parse_channels(self.listen, &queries, &mut faults);
        for (index, query) in queries.iter().enumerate() {
            if query.period.is_none() && channels.iter().all(|channel| channel.query != index) {
                faults.add(format!(
                    "queries: '{}' has no poll_seconds, and no channel of `listen` brings what \
                     changes: give it one",
                    query.name
                ));
            }
        }
        let timeout = faults.seconds("timeout_seconds", self.timeout_seconds, DEADLINES);
        let reconnect = self.reconnect.parse(&mut faults);
        let mut zone = self.zone.as_deref().map(Zone::parse).transpose().unwrap_or_else(|fault| {
            faults.add(format!("zone: {fault}"));
            None
        });
        if zone.is_none() && matches!(database, Some(Database::Sqlite(_))) {
            // As SQLite's own functions give them.
            zone = Some(Zone::utc());
        }
        let format = self.time_format.as_deref().map_or(Ok(TimeFormat::Iso), TimeFormat::parse);
        let format = format.unwrap_or_else(|fault| {
            faults.add(format!("time_format: {fault}"));
            TimeFormat::Iso
        });
        if format.is_relative() {
            faults.add("time_format: seconds from any start are no time of a value");
        }
        let invalid = |faults| Error::settings(format!("settings: {faults}"));
        faults.into_result().map_err(invalid)?;
        // Without a fault there is a database.
        let database = database.ok_or_else(|| Error::settings("settings: no database is named"))?;
        let times = Arc::new(TimeReader { format, zone, numbers: NumberFormat::default() });
        Ok(Config { database, queries, channels, timeout, reconnect, times })
    }
}

impl RawPostgres {
    fn parse(self, faults: &mut SettingsFaults) -> Postgres {
        let host = check_name(faults, "postgres.host", self.host.trim().to_owned());
        let is_socket = host.starts_with('/');
        let tls = match (self.sslmode, self.tls) {
            (None | Some(SslMode::VerifyFull), Some(tls)) if !is_socket => tls.parse(&host, faults),
            (None, None) if is_socket => None,
            (Some(SslMode::Disable), None) => None,
            (Some(SslMode::Disable), Some(_)) => {
                faults
                    .add("postgres: sslmode is disable, so tls has no effect: remove one of them");
                None
            }
            (_, _) if is_socket => {
                faults.add("postgres: a Unix socket is not encrypted: remove sslmode and tls");
                None
            }
            (_, _) => {
                faults.add(
                    "postgres: sslmode is verify-full (the default), which needs tls.ca; only in \
                     a network that nobody else can reach write \"sslmode\": \"disable\"",
                );
                None
            }
        };
        Postgres {
            host,
            port: faults.check("postgres.port", self.port, 1..=u16::MAX),
            database: check_name(faults, "postgres.database", self.database),
            user: check_name(faults, "postgres.user", self.user),
            password: self.password,
            tls,
            connect_timeout: faults.seconds(
                "postgres.connect_seconds",
                self.connect_seconds,
                DEADLINES,
            ),
            keepalive: faults.seconds(
                "postgres.keep_alive_seconds",
                self.keep_alive_seconds,
                PERIODS,
            ),
        }
    }
}

impl RawTls {
    fn parse(self, host: &str, faults: &mut SettingsFaults) -> Option<TlsFiles> {
        let own = match (self.certificate, self.key) {
            (Some(certificate), Some(key)) => Some((certificate, key)),
            (None, None) => None,
            _ => {
                faults.add("postgres.tls: certificate and key go together");
                None
            }
        };
        let own_paths = own.iter().flat_map(|(certificate, key)| [certificate, key]);
        for path in own_paths.chain([&self.ca]).filter(|path| !path.is_absolute()) {
            faults.add(format!("postgres.tls: '{}' is no absolute path", path.display()));
        }
        let server_name = self.server_name.unwrap_or_else(|| host.to_owned());
        Some(TlsFiles { ca: self.ca, own, server_name })
    }
}

fn parse_queries(raw: Vec<RawQuery>, faults: &mut SettingsFaults) -> Vec<QueryConfig> {
    if raw.is_empty() || raw.len() > MAX_QUERIES {
        faults.add(format!("queries: {}; give 1 to {MAX_QUERIES}", raw.len()));
    }
    let mut queries: Vec<QueryConfig> = Vec::new();
    for RawQuery { name, sql, poll_seconds } in raw {
        let name = check_name(faults, "queries: name", name);
        if queries.iter().any(|query| query.name == name) {
            faults.add(format!("queries: there are two of the name '{name}'"));
        }
        if sql.trim().is_empty() || sql.len() > MAX_SQL_BYTES || sql.contains('\0') {
            faults.add(format!(
                "queries: the sql of '{name}' has to have 1 to {MAX_SQL_BYTES} bytes, none zero"
            ));
        }
        let period = poll_seconds
            .map(|period| faults.seconds(&format!("poll_seconds of '{name}'"), period, PERIODS));
        queries.push(QueryConfig { name, sql, period });
    }
    queries
}

fn parse_channels(
    raw: Vec<RawListen>,
    queries: &[QueryConfig],
    faults: &mut SettingsFaults,
) -> Vec<Channel> {
    if raw.len() > MAX_CHANNELS {
        faults.add(format!("listen: {} channels; at most {MAX_CHANNELS} are allowed", raw.len()));
    }
    let mut channels: Vec<Channel> = Vec::new();
    for RawListen { channel, query } in raw {
        if channel.is_empty() || channel.len() > MAX_CHANNEL_BYTES || channel.contains('\0') {
            faults.add(format!("listen: a channel has to have 1 to {MAX_CHANNEL_BYTES} bytes"));
        }
        if channels.iter().any(|other| other.name == channel) {
            faults.add(format!("listen: there are two channels '{channel}'"));
        }
        match queries.iter().position(|other| other.name == query) {
            Some(query) => channels.push(Channel { name: channel, query }),
            None => faults.add(format!("listen: '{channel}': there is no query '{query}'")),
        }
    }
    channels
}

fn check_name(faults: &mut SettingsFaults, place: &str, name: String) -> String {
    if name.is_empty() || name.len() > MAX_NAME_BYTES || name.contains('\0') {
        faults.add(format!("{place}: give 1 to {MAX_NAME_BYTES} bytes"));
    }
    name
}

#[cfg(test)]
#[path = "settings_tests.rs"]
mod tests;
