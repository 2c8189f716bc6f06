//! Logging: to standard error, and on request into files that are rotated.
//!
//! Nothing here stops the program or lets it wait: a folder that cannot be written, a full
//! disk or a slow one cost lines of the log, which are counted and told.

mod file_rotation;
mod repeat_limit;

use std::io::{self, Stderr, Write};
use std::os::unix::fs::MetadataExt;
use std::path::PathBuf;

use busbar_config::{LogConfig, LogFormatConfig};
use clap::{Args, ValueEnum};
use tracing::{Level, Metadata};
use tracing_appender::non_blocking::{NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::fmt::format::debug_fn;
use tracing_subscriber::fmt::{FormatFields, MakeWriter};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::reload::{Handle, Layer as Reloaded};
use tracing_subscriber::util::SubscriberInitExt;
use tracing_subscriber::{EnvFilter, Layer, Registry, fmt};

use file_rotation::RotatingFile;
use repeat_limit::RepeatLimit;

/// Environment variable with directives of levels and targets.
const LEVEL_VARIABLE: &str = "BUSBAR_LOG";
/// Lines that wait for the disk; further ones are dropped and counted.
const MAX_WAITING_LINES: usize = 10_000;
const BYTES_PER_MEGABYTE: u64 = 1_000_000;
/// Largest size of a log file, in 10^6 bytes.
const MAX_MEGABYTES: u64 = 10_000;
const MAX_FILES: u64 = 1_000;

/// Log file besides standard error. `BUSBAR_LOG` sets levels, such as `warn` or
/// `busbar_viewer=debug,info`.
#[derive(Debug, Args)]
pub(crate) struct LogOptions {
    /// Write the log into this file too
    #[arg(long, global = true, value_name = "FILE")]
    pub(crate) log: Option<PathBuf>,
    /// Format of lines in the file
    #[arg(long, global = true, value_enum, default_value = "text")]
    pub(crate) log_format: LogFormat,
    /// Size at which the log begins a new file, in 10^6 bytes
    #[arg(long, global = true, value_name = "N", default_value = "16",
        value_parser = clap::value_parser!(u64).range(1..=MAX_MEGABYTES))]
    pub(crate) log_megabytes: u64,
    /// Number of log files kept: FILE, FILE.1 and so on
    #[arg(long, global = true, value_name = "N", default_value = "10",
        value_parser = clap::value_parser!(u64).range(1..=MAX_FILES))]
    pub(crate) log_files: u64,
}

/// Format of lines in a log file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogFormat {
    /// Text for people to read
    Text,
    /// JSON object for each line
    Json,
}

impl From<LogFormatConfig> for LogFormat {
    fn from(format: LogFormatConfig) -> Self {
        match format {
            LogFormatConfig::Text => Self::Text,
            LogFormatConfig::Json => Self::Json,
        }
    }
}

/// Log file with its format and limits.
#[derive(Clone, Debug, PartialEq, Eq)]
struct LogFile {
    path: PathBuf,
    format: LogFormat,
    megabytes: u64,
    files: u64,
}

type FileLayer = Option<Box<dyn Layer<Registry> + Send + Sync>>;

/// Log of this process. Lines that wait are written when it is dropped.
pub(crate) struct Log {
    is_by_arguments: bool,
    file: Option<LogFile>,
    layer: Handle<FileLayer, Registry>,
    guard: Option<WorkerGuard>,
}

impl Log {
    /// Starts the log, with a file where arguments name one.
    pub(crate) fn start(options: &LogOptions) -> Self {
        let file = options.log.as_ref().map(|path| LogFile {
            path: path.clone(),
            format: options.log_format,
            megabytes: options.log_megabytes,
            files: options.log_files,
        });
        let (layer, guard) = file.as_ref().map(LogFile::open).unzip();
        let (file_layer, layer) = Reloaded::new(layer);
        let stderr = io::stderr();
        let is_journal = is_journal();
        let terminal = fmt::layer().compact().with_writer(LeveledStderr { stderr, is_journal });
        let terminal = match is_journal {
            // The journal has time and level of its own.
            true => terminal.with_ansi(false).without_time().with_level(false).boxed(),
            false => terminal.boxed(),
        };
        let level = EnvFilter::try_from_env(LEVEL_VARIABLE).unwrap_or_else(|_| "info".into());
        tracing_subscriber::registry()
            .with(file_layer)
            .with(level)
            .with(RepeatLimit::default())
            .with(terminal)
            .init();
        Self { is_by_arguments: file.is_some(), file, layer, guard }
    }

    /// Switches to the file of a configuration, unless arguments name one.
    pub(crate) fn follow(&mut self, wanted: Option<(PathBuf, &LogConfig)>) {
        let wanted = wanted.map(|(path, log)| LogFile {
            path,
            format: log.format.into(),
            megabytes: u64::from(log.megabytes),
            files: u64::from(log.files),
        });
        if self.is_by_arguments || wanted == self.file {
            return;
        }
        let (layer, guard) = wanted.as_ref().map(LogFile::open).unzip();
        match self.layer.reload(layer) {
            // Lines that wait for the file before are written now.
            Ok(()) => (self.file, self.guard) = (wanted, guard),
            Err(error) => tracing::error!("the log goes where it went before: {error}"),
        }
    }
}

impl LogFile {
    /// Opens the file's layer, which writes by a thread of its own.
    fn open(&self) -> (Box<dyn Layer<Registry> + Send + Sync>, WorkerGuard) {
        let limit = self.megabytes * BYTES_PER_MEGABYTE;
        let file = RotatingFile::new(self.path.clone(), limit, self.files as usize);
        let (writer, guard) = NonBlockingBuilder::default()
            .lossy(true)
            .buffered_lines_limit(MAX_WAITING_LINES)
            .thread_name("log")
            .finish(file);
        let layer = fmt::layer().with_ansi(false).with_writer(writer);
        let layer = match self.format {
            LogFormat::Text => layer.boxed(),
            LogFormat::Json => layer.json().flatten_event(true).boxed(),
        };
        (layer, guard)
    }
}

/// Starts the log of a plugin's process: the viewer reads level and message, and adds the rest.
pub(crate) fn start_of_plugin() {
    let filter = EnvFilter::try_from_env(LEVEL_VARIABLE).unwrap_or_else(|_| "info".into());
    tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(false)
        .without_time()
        .with_target(false)
        .fmt_fields(message_only())
        .init();
}

/// Writes the message of a log line and none of its fields.
fn message_only() -> impl for<'w> FormatFields<'w> + 'static {
    debug_fn(|writer, field, value| match field.name() {
        "message" => write!(writer, "{value:?}"),
        _ => Ok(()),
    })
}

/// Reports whether standard error leads to systemd's journal, as `JOURNAL_STREAM` says
/// (systemd.exec(5)).
fn is_journal() -> bool {
    let Ok(stream) = std::env::var("JOURNAL_STREAM") else { return false };
    let stderr = std::fs::metadata("/proc/self/fd/2");
    stderr.is_ok_and(|file| stream == format!("{}:{}", file.dev(), file.ino()))
}

/// Writer to standard error; in the journal each line has its level before it (sd-daemon(3)).
struct LeveledStderr {
    stderr: Stderr,
    is_journal: bool,
}

impl<'a> MakeWriter<'a> for LeveledStderr {
    type Writer = LeveledLine<'a>;

    fn make_writer(&'a self) -> Self::Writer {
        LeveledLine { stderr: &self.stderr, prefix: "" }
    }

    fn make_writer_for(&'a self, of: &Metadata<'_>) -> Self::Writer {
        let prefix = match *of.level() {
            _ if !self.is_journal => "",
            Level::ERROR => "<3>",
            Level::WARN => "<4>",
            Level::INFO => "<6>",
            _ => "<7>",
        };
        LeveledLine { stderr: &self.stderr, prefix }
    }
}

struct LeveledLine<'a> {
    stderr: &'a Stderr,
    prefix: &'static str,
}

impl Write for LeveledLine<'_> {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let mut stderr = self.stderr.lock();
        stderr.write_all(self.prefix.as_bytes())?;
        stderr.write(line)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stderr.lock().flush()
    }
}
