//! Command-line arguments and subcommands (clap).

use std::ffi::OsString;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use busbar_point_import::{ListEncoding, PluginInstance};
use busbar_types::FaultKind;
use busbar_web::Origin;
use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::log::LogOptions;

/// 3D viewer of live power equipment.
///
/// Plugins offer further commands, which `busbar plugin list` names.
///
/// Exit codes: 0 done, 1 input or environment at fault, 2 wrong use, 3 Busbar at fault.
#[derive(Debug, Parser)]
#[command(version)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
    #[command(flatten)]
    pub(crate) log: LogOptions,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Show a configuration in a window
    View(ViewOptions),
    /// Draw a configuration into a PNG file, without a display
    Render(RenderOptions),
    /// Find every fault of a configuration and of what it names
    Check {
        /// Configuration file to check
        config: PathBuf,
    },
    /// Say what is wrong on this machine, why, and what helps
    Doctor(DoctorOptions),
    /// Measure what this machine can show: frames, detail, start and memory
    ///
    /// Without a configuration three generated scenes are measured: a bay, a yard, and a
    /// substation of a million triangles. Times are those of frames that nobody waits for: a
    /// window shows no more than its screen does. It takes some two minutes on a graphics card.
    Benchmark(BenchmarkOptions),
    /// Simplify one model by one optimizer plugin
    Optimize(OptimizeOptions),
    /// Simulate the devices of a configuration, so that it can be viewed without them
    Simulate(SimulateOptions),
    /// Make a scene from a model and a point list, or the point list from a device
    ///
    /// With --from the device of a configured plugin instance is asked what it has, with the
    /// instance's settings: `busbar import site.json --from plc --out points.csv` writes a point
    /// list, `--out tags.json` the tags as a configuration has them.
    Import(ImportOptions),
    /// Show a configuration as a web page, for the iframe of an HMI
    ///
    /// All pages share one view. The first that comes steers it, others look and can take over.
    /// Whoever looks must have the token: from --token-file, from the variable BUSBAR_TOKEN, or
    /// else made at random and printed with the address. Nothing is encrypted: for other
    /// machines, put a proxy with TLS before it.
    Serve(ServeOptions),
    /// Verify the audit log of alarms
    Log {
        #[command(subcommand)]
        command: LogCommand,
    },
    /// Rewrite a configuration with the present names
    Config {
        #[command(subcommand)]
        command: ConfigCommand,
    },
    /// Print the JSON Schema of configurations
    Schema,
    /// Inspect, check, make and sign plugins
    Plugin {
        #[command(subcommand)]
        command: PluginCommand,
    },
    /// Host one plugin for a viewer, which starts this itself
    #[command(hide = true)]
    PluginHost,
    /// Show the view of a host program, which starts this itself
    #[command(hide = true)]
    Embedded,
    /// Hatch the window of a viewer that hangs; `busbar view` starts this itself
    #[command(hide = true)]
    WatchWindow {
        /// X11 window to be covered
        window: u32,
    },
    /// A command that a plugin offers
    #[command(external_subcommand)]
    Offered(Vec<OsString>),
}

#[derive(Debug, Subcommand)]
pub(crate) enum LogCommand {
    /// Find records and files that were removed, reordered, changed or damaged
    ///
    /// Exit code 0 where nothing of the kind is found, 1 otherwise. A viewer may write the log
    /// meanwhile; nothing is written here.
    Verify {
        /// Folder of the log
        folder: PathBuf,
        /// Key of its hash chain, as in "log_key_file" of the configuration
        #[arg(long, value_name = "FILE")]
        key: Option<PathBuf>,
        /// Anchor of its newest record, as in "log_anchor_file"
        #[arg(long, value_name = "FILE")]
        anchor: Option<PathBuf>,
    },
}

#[derive(Debug, Subcommand)]
pub(crate) enum ConfigCommand {
    /// Write the present names of settings, in place
    ///
    /// Order and layout stay. Settings of plugins are renamed by the schemas of the plugins in
    /// the configured directories. A scenario is rewritten too.
    Upgrade {
        /// Configuration or scenario to rewrite
        file: PathBuf,
        /// Tell what would be renamed, and write nothing
        #[arg(long)]
        dry_run: bool,
    },
}

#[derive(Debug, Subcommand)]
pub(crate) enum PluginCommand {
    /// List the plugins that can be used
    List {
        /// Configuration file whose plugin directories are searched [default: as for optimize]
        config: Option<PathBuf>,
        /// Print the JSON Schema of each plugin's settings too
        #[arg(long)]
        schema: bool,
    },
    /// Find what is wrong with a plugin library
    Check(PluginCheckOptions),
    /// Make the project of a new plugin
    New(PluginNewOptions),
    /// Run a command of a configured plugin instance, with the instance's settings
    ///
    /// `busbar plugin run site.json mail test-message` sends a test message, for example.
    Run(PluginRunOptions),
    /// Sign a plugin's library: writes LIBRARY.sig and prints the public key
    Sign {
        /// Plugin library to be signed
        library: PathBuf,
        /// Ed25519 key as PEM, made by `openssl genpkey -algorithm ed25519`
        #[arg(long, value_name = "FILE")]
        key: PathBuf,
    },
    /// Run one case of a check, in a process of its own
    #[command(hide = true)]
    RunCase {
        /// File with the case to run
        request: PathBuf,
    },
}

#[derive(Debug, Args)]
pub(crate) struct PluginCheckOptions {
    /// Plugin library, such as target/debug/libmine.so
    pub(crate) library: PathBuf,
    /// Settings and tags to check with: {"settings": {...}, "tags": [{"kind": "f64", "address": ...}]}
    #[arg(long, value_name = "F.json")]
    pub(crate) sample: Option<PathBuf>,
    /// Write the report here too
    #[arg(long, value_name = "F.json")]
    pub(crate) json: Option<PathBuf>,
    /// Run only this case, and those that it needs; may be given again
    #[arg(long, value_name = "CASE")]
    pub(crate) only: Vec<String>,
    /// The longest that one case may take, seconds
    #[arg(long, value_name = "S", value_parser = parse_limit, default_value = "30")]
    pub(crate) limit: Duration,
}

#[derive(Debug, Args)]
pub(crate) struct PluginRunOptions {
    /// Configuration file with the instance
    pub(crate) config: PathBuf,
    /// Name of the plugin instance
    pub(crate) instance: String,
    /// Name of the command
    pub(crate) command: String,
    /// Arguments of the command
    #[arg(last = true)]
    pub(crate) arguments: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct PluginNewOptions {
    /// Name of the plugin and of its folder: lower-case letters, digits and `_`
    pub(crate) name: String,
    /// Kind of plugin to make
    #[arg(long, value_enum)]
    pub(crate) kind: PluginKind,
    /// Language of the plugin
    #[arg(long, value_enum, default_value = "rust")]
    pub(crate) lang: PluginLanguage,
    /// Folder to make it in [default: the working directory]
    #[arg(long, value_name = "DIR")]
    pub(crate) path: Option<PathBuf>,
    /// Busbar's `plugins/sdk/sdk` [default: that of the sources this program was built from]
    #[arg(long, value_name = "DIR")]
    pub(crate) sdk: Option<PathBuf>,
}

/// Kind of a new plugin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PluginKind {
    /// Brings values from devices
    Telemetry,
    /// Shows values at the equipment
    Overlay,
    /// Simplifies meshes to levels of detail
    Optimizer,
}

/// Language of a new plugin.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PluginLanguage {
    /// Rust, with the SDK
    Rust,
    /// C, with the header alone
    C,
}

#[derive(Debug, Args)]
pub(crate) struct ViewOptions {
    /// Configuration file to show
    pub(crate) config: PathBuf,
    /// Close the window after this many seconds
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    pub(crate) seconds: Option<Duration>,
    /// Write statistics of the view here when the window closes
    #[arg(long, value_name = "F.json")]
    pub(crate) stats: Option<PathBuf>,
    /// Use the Vulkan validation layer; its messages are a failure
    #[arg(long)]
    pub(crate) validation: bool,
    /// Fill a screen, whatever becomes of it; Ctrl+Alt+Shift+Q ends it
    #[arg(long)]
    pub(crate) kiosk: bool,
    /// Monitor to fill, such as HDMI-1 [default: the primary one]
    #[arg(long, value_name = "NAME", requires = "kiosk")]
    pub(crate) monitor: Option<String>,
    /// Serve metrics for Prometheus here, such as 127.0.0.1:9187, at /metrics
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) metrics: Option<SocketAddr>,
    /// Serve the metrics to other machines too
    #[arg(long, requires = "metrics")]
    pub(crate) metrics_public: bool,
}

#[derive(Debug, Args)]
pub(crate) struct DoctorOptions {
    /// Configuration file to examine too, with its plugins
    pub(crate) config: Option<PathBuf>,
    /// Seconds to listen to the configuration's sources, for links and clocks; 0 connects to none
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u64).range(..=3600))]
    pub(crate) listen_seconds: u64,
    /// Print the findings as JSON
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BenchmarkOptions {
    /// Configuration file to measure, instead of generated scenes
    pub(crate) config: Option<PathBuf>,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "1920x1080")]
    pub(crate) size: Size,
    /// Write the results as JSON here, too
    #[arg(long, value_name = "F.json")]
    pub(crate) json: Option<PathBuf>,
    /// Folder of plugin libraries for the generated scenes [default: that beside the program]
    #[arg(long, value_name = "DIR", conflicts_with = "config")]
    pub(crate) plugins: Option<PathBuf>,
    /// Id of the optimizer plugin of the generated scenes [default: the first one]
    #[arg(long, value_name = "ID", conflicts_with = "config")]
    pub(crate) optimizer: Option<String>,
    /// Id of the overlay plugin that shows values in the generated scenes [default: the first
    /// that can]
    #[arg(long, value_name = "ID", conflicts_with = "config")]
    pub(crate) overlay: Option<String>,
    /// Duration of each of the six parts of a measurement, seconds
    #[arg(long, value_name = "S", value_parser = parse_seconds, default_value = "3")]
    pub(crate) seconds: Duration,
    /// Use the Vulkan validation layer, which makes all slower; its messages are a failure
    #[arg(long)]
    pub(crate) validation: bool,
}

#[derive(Debug, Args)]
pub(crate) struct RenderOptions {
    /// Configuration file to draw
    pub(crate) config: PathBuf,
    /// Picture file (PNG) to write
    #[arg(long, value_name = "F.png")]
    pub(crate) out: PathBuf,
    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(crate) size: Option<Size>,
    /// Proportion of vertices simplified, for every model, 0 to 1
    #[arg(long, value_name = "X", value_parser = parse_theta)]
    pub(crate) theta: Option<f64>,
    /// Camera of the configuration
    #[arg(long, value_name = "NAME")]
    pub(crate) camera: Option<String>,
    /// Draw edges instead of surfaces
    #[arg(long)]
    pub(crate) wireframe: bool,
    /// Let telemetry run this long first
    #[arg(long, value_name = "S", value_parser = parse_seconds, default_value = "0")]
    pub(crate) seconds: Duration,
    /// Write statistics of the view here
    #[arg(long, value_name = "F.json")]
    pub(crate) stats: Option<PathBuf>,
    /// Name and highlight the equipment at this pixel
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel)]
    pub(crate) pick: Option<Pixel>,
    /// Use the Vulkan validation layer; its messages are a failure
    #[arg(long)]
    pub(crate) validation: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateOptions {
    /// Configuration file whose devices are simulated
    pub(crate) config: PathBuf,
    /// Seed of values and faults: the same seed repeats both
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// End after this many seconds [default: on Ctrl-C]
    #[arg(long, value_name = "S", value_parser = parse_seconds)]
    pub(crate) seconds: Option<Duration>,
    /// Simulate the device of this plugin instance alone
    #[arg(long, value_name = "INSTANCE")]
    pub(crate) plugin: Option<String>,
    /// Apply the events of this scenario file, counted from the start
    #[arg(long, value_name = "F.json")]
    pub(crate) scenario: Option<PathBuf>,
    /// Inject these faults from time to time: `all`, or some of link-loss, slow, half-open, reset,
    /// garbage, late, clock-jump
    #[arg(long, value_name = "NAME", value_delimiter = ',', value_parser = parse_fault)]
    pub(crate) fault: Vec<Faults>,
    /// Period in which one fault occurs, seconds
    #[arg(long, value_name = "S", value_parser = parse_period, default_value = "30")]
    pub(crate) fault_period: Duration,
    /// Longest duration of a fault, seconds; less than its period
    #[arg(long, value_name = "S", value_parser = parse_period, default_value = "8")]
    pub(crate) fault_seconds: Duration,
    /// Period in which devices with unsolicited messages check for changes, seconds
    #[arg(long, value_name = "S", value_parser = parse_period, default_value = "1")]
    pub(crate) update: Duration,
}

/// Faults that one word names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Faults(pub(crate) Vec<FaultKind>);

#[derive(Debug, Args)]
pub(crate) struct ServeOptions {
    /// Configuration file to serve
    pub(crate) config: PathBuf,
    /// Address and port to listen at; port 0 takes a free one
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8080")]
    pub(crate) listen: SocketAddr,
    /// File with the token alone: 16 to 256 letters, digits, `-` and `_`
    #[arg(long, value_name = "FILE")]
    pub(crate) token_file: Option<PathBuf>,
    /// Origin of a page that may embed the view and speak to it, such as
    /// https://hmi.example; may be given again
    #[arg(long, value_name = "ORIGIN")]
    #[allow(rustdoc::bare_urls, reason = "the help shows this text as it is")]
    pub(crate) allow_origin: Vec<Origin>,
    /// Let other machines reach the server, though nothing is encrypted
    #[arg(long)]
    pub(crate) insecure_remote: bool,
    /// Greatest number of pages at the same time
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub(crate) clients: usize,
    /// Show panels beside the scene
    #[arg(long)]
    pub(crate) panels: bool,
    /// Operator who acts on alarms, for the audit log
    #[arg(long, value_name = "NAME")]
    pub(crate) operator: Option<String>,
}

#[derive(Debug, Args)]
pub(crate) struct OptimizeOptions {
    /// Model file, .glb or .gltf
    pub(crate) model: PathBuf,
    /// Id of the optimizer plugin
    #[arg(long, value_name = "ID")]
    pub(crate) plugin: String,
    /// Setting of the plugin; V is JSON, or else text
    #[arg(long, value_name = "K=V", value_parser = parse_setting)]
    pub(crate) set: Vec<(String, serde_json::Value)>,
    /// Proportion of vertices simplified, 0 to 1
    #[arg(long, value_name = "X", value_parser = parse_theta)]
    pub(crate) theta: f64,
    /// Write the simplified model here
    #[arg(long, value_name = "F.glb")]
    pub(crate) out: Option<PathBuf>,
    /// Walk this many random thetas and back, comparing every byte
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) round_trip: u64,
    /// Write counts and times here
    #[arg(long, value_name = "F.json")]
    pub(crate) stats: Option<PathBuf>,
    /// Directory that holds plugins [default: `plugins` beside this program, or the program's own]
    #[arg(long, value_name = "DIR")]
    pub(crate) plugin_directory: Vec<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ImportOptions {
    /// Model file, .glb or .gltf; with --from a configuration
    #[arg(value_name = "MODEL|CONFIG")]
    pub(crate) source: PathBuf,
    /// Point list, CSV: a column `tag`, columns `address.…`, others as they are there
    #[arg(required_unless_present = "from")]
    pub(crate) points: Option<PathBuf>,
    /// Scene to write, with reports beside it; with --from a point list, .csv, or tags, .json
    /// [default with --from: a list to standard output]
    #[arg(long, value_name = "F", required_unless_present = "from")]
    pub(crate) out: Option<PathBuf>,
    /// Ask the device of this plugin instance for its points, and make no scene
    #[arg(
        long,
        value_name = "INSTANCE",
        conflicts_with_all = [
            "points", "encoding", "plugin", "overlay", "optimizer", "plugins", "id",
            "skip_bad_rows"
        ]
    )]
    pub(crate) from: Option<String>,
    /// Plugin that brings tags: name in the scene, its id, its settings; V is JSON, or else text
    #[arg(long, value_name = "NAME=ID[,K=V...]", value_parser = parse_instance)]
    pub(crate) plugin: Vec<PluginInstance>,
    /// Id of a plugin that shows values; may be given again
    #[arg(long, value_name = "ID")]
    pub(crate) overlay: Vec<String>,
    /// Id of the plugin that simplifies the model
    #[arg(long, value_name = "ID")]
    pub(crate) optimizer: Option<String>,
    /// Directory that holds plugins [default: `plugins` beside the scene, or as for optimize]
    #[arg(long, value_name = "DIR")]
    pub(crate) plugins: Vec<PathBuf>,
    /// Equipment id of the model [default: the name of its file]
    #[arg(long, value_name = "ID")]
    pub(crate) id: Option<String>,
    /// Encoding of the point list, such as windows-1251 [default: by its mark or characters]
    #[arg(long, value_name = "NAME")]
    pub(crate) encoding: Option<ListEncoding>,
    /// Leave out rows that have faults, and report them
    #[arg(long)]
    pub(crate) skip_bad_rows: bool,
    /// Overwrite existing output files
    #[arg(long)]
    pub(crate) force: bool,
    /// Further arguments for the plugin, such as nodes to begin at
    #[arg(last = true, requires = "from")]
    pub(crate) arguments: Vec<String>,
}

/// Exit codes: 0 done, perhaps without some of the input, 1 input or environment at fault,
/// 2 wrong use, 3 Busbar at fault.
#[derive(Debug, Parser)]
pub(crate) struct OfferedOptions {
    /// Input file of the command
    pub(crate) file: PathBuf,
    /// Write the result here [default: standard output]
    #[arg(long, value_name = "F")]
    pub(crate) out: Option<PathBuf>,
    /// Setting of the plugin; V is JSON, or else text
    #[arg(long, value_name = "K=V", value_parser = parse_setting)]
    pub(crate) set: Vec<(String, serde_json::Value)>,
    /// Directory that holds plugins [default: as for optimize]
    #[arg(long, value_name = "DIR")]
    pub(crate) plugin_directory: Vec<PathBuf>,
    /// Further arguments for the command
    #[arg(last = true)]
    pub(crate) arguments: Vec<String>,
}

/// Width and height, pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Size(pub(crate) [u32; 2]);

/// Column and row from the top left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pixel(pub(crate) [u32; 2]);

fn parse_pair(text: &str, separator: char, form: &str) -> Result<[u32; 2], String> {
    let parsed = text
        .split_once(separator)
        .and_then(|(a, b)| Some([a.trim().parse().ok()?, b.trim().parse().ok()?]));
    parsed.ok_or_else(|| format!("write it as {form}"))
}

fn parse_size(text: &str) -> Result<Size, String> {
    let size = parse_pair(text, 'x', "1280x720")?;
    if size.iter().any(|side| !(16..=16384).contains(side)) {
        return Err("each side is 16 to 16384 pixels".into());
    }
    Ok(Size(size))
}

fn parse_pixel(text: &str) -> Result<Pixel, String> {
    parse_pair(text, ',', "640,360").map(Pixel)
}

fn parse_theta(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(theta) if (0.0..=1.0).contains(&theta) => Ok(theta),
        _ => Err("a number from 0 to 1".into()),
    }
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.parse().map_err(|_| "a number of seconds")?;
    Duration::try_from_secs_f64(seconds).map_err(|_| "a number of seconds from 0".into())
}

/// Greatest time limit of one case of a check, seconds.
const MAX_CASE_SECONDS: f64 = 3600.0;

fn parse_limit(text: &str) -> Result<Duration, String> {
    match text.parse() {
        Ok(seconds) if (0.1..=MAX_CASE_SECONDS).contains(&seconds) => {
            Ok(Duration::from_secs_f64(seconds))
        }
        _ => Err(format!("a number of seconds from 0.1 to {MAX_CASE_SECONDS}")),
    }
}

/// Shortest and longest period of a simulation, seconds.
const PERIOD_SECONDS: std::ops::RangeInclusive<f64> = 0.01..=86_400.0;

fn parse_period(text: &str) -> Result<Duration, String> {
    match text.parse() {
        Ok(seconds) if PERIOD_SECONDS.contains(&seconds) => Ok(Duration::from_secs_f64(seconds)),
        _ => {
            let (least, most) = (PERIOD_SECONDS.start(), PERIOD_SECONDS.end());
            Err(format!("a number of seconds from {least} to {most}"))
        }
    }
}

fn parse_fault(text: &str) -> Result<Faults, String> {
    if text == "all" {
        return Ok(Faults(FaultKind::ALL.to_vec()));
    }
    let named = FaultKind::ALL.into_iter().find(|fault| fault.name() == text);
    named.map(|fault| Faults(vec![fault])).ok_or_else(|| {
        let names: Vec<_> = FaultKind::ALL.iter().map(|fault| fault.name()).collect();
        format!("write `all`, or some of {}", names.join(", "))
    })
}

fn parse_setting(text: &str) -> Result<(String, serde_json::Value), String> {
    let (key, value) = text.split_once('=').ok_or("write it as key=value")?;
    let value = serde_json::from_str(value).unwrap_or_else(|_| value.into());
    Ok((key.to_owned(), value))
}

/// Parses `NAME=ID,KEY=VALUE,...`; commas within brackets and quotes do not separate.
fn parse_instance(text: &str) -> Result<PluginInstance, String> {
    const FORM: &str = "write it as NAME=PLUGIN_ID,KEY=VALUE";
    let (name, rest) = text.split_once('=').ok_or(FORM)?;
    let mut parts = split_at_commas(rest).into_iter();
    let plugin = parts.next().unwrap_or_default();
    if name.is_empty() || plugin.is_empty() || plugin.contains('=') {
        return Err(FORM.into());
    }
    let settings = parts.map(parse_setting).collect::<Result<_, _>>()?;
    Ok(PluginInstance { name: name.to_owned(), plugin: plugin.to_owned(), settings })
}

fn split_at_commas(text: &str) -> Vec<&str> {
    let (mut depth, mut is_quoted, mut start) = (0_i32, false, 0);
    let mut parts = Vec::new();
    for (i, c) in text.char_indices() {
        match c {
            '"' => is_quoted = !is_quoted,
            '[' | '{' if !is_quoted => depth += 1,
            ']' | '}' if !is_quoted => depth -= 1,
            ',' if !is_quoted && depth <= 0 => {
                parts.push(&text[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.push(&text[start..]);
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_parsed_and_checked() {
        assert_eq!(parse_size("320x200"), Ok(Size([320, 200])));
        assert!(parse_size("320").is_err());
        assert!(parse_size("1x200").is_err());
        assert_eq!(parse_pixel("3, 4"), Ok(Pixel([3, 4])));
        assert!(parse_theta("1.01").is_err());
        assert!(parse_theta("NaN").is_err());
        assert_eq!(parse_seconds("1.5"), Ok(Duration::from_millis(1500)));
        assert_eq!(parse_limit("0.5"), Ok(Duration::from_millis(500)));
        assert!(["NaN", "inf", "0"].iter().all(|text| parse_limit(text).is_err()));
        assert!(["NaN", "inf", "-1"].iter().all(|text| parse_seconds(text).is_err()));
        assert_eq!(parse_setting("a=true"), Ok(("a".into(), true.into())));
        assert_eq!(parse_period("0.25"), Ok(Duration::from_millis(250)));
        assert!(["NaN", "0", "1e9"].iter().all(|text| parse_period(text).is_err()));
        assert_eq!(parse_fault("all"), Ok(Faults(FaultKind::ALL.to_vec())));
        assert_eq!(parse_fault("half-open"), Ok(Faults(vec![FaultKind::HalfOpen])));
        assert!(parse_fault("half_open").is_err_and(|remedy| remedy.contains("half-open")));
        assert_eq!(parse_setting("a=b=c"), Ok(("a".into(), "b=c".into())));
        let plugin = parse_instance("plc=example,host=10.0.0.5,port=502,g={\"a\":[1,2]}");
        let plugin = plugin.expect("it is well formed");
        assert_eq!((plugin.name.as_str(), plugin.plugin.as_str()), ("plc", "example"));
        let settings = serde_json::json!({"host": "10.0.0.5", "port": 502, "g": {"a": [1, 2]}});
        assert_eq!(serde_json::Value::Object(plugin.settings), settings);
        assert!(
            ["plc", "plc=", "=a", "plc=a=b", "plc=a,b"].iter().all(|t| parse_instance(t).is_err())
        );
    }
}
