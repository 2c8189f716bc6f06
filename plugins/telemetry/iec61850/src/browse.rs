//! `busbar import CONFIG --from INSTANCE`: the status and measured values of a server as a
//! point list, by the names and types that it tells (IEC 61850-8-1, 8 and 9).

#[cfg(test)]
mod tests;

use std::collections::{BTreeSet, VecDeque};
use std::io::Read;
use std::sync::Arc;
use std::time::Duration;

use busbar_link::{ByteStream, Dial, Endpoint, IoLoop, TcpDial, describe_io_error};
use busbar_plugin_sdk::{CommandExit, Error, LogLevel, Streams};
use iec61850_rs::proto::mms::typespec::TypeSpec;
use tokio::io::AsyncReadExt;
use tokio::time::{sleep, sleep_until, timeout};

use crate::link::{CHUNK_BYTES, LinkFault, now, parameters, send};
use crate::locate::VALUES;
use crate::scl::{MAX_ROWS, Row, write_rows};
use crate::service::{Answer, Name, Request};
use crate::session::{Event, Session};
use crate::settings::Config;

/// Data objects whose types are asked for.
const MAX_OBJECTS: usize = 100_000;
/// Greatest number of name answers.
const MAX_PAGES: usize = 10_000;
/// Levels of data objects in each other, and of structures in them.
const MAX_LEVELS: usize = 8;
/// Refusals that are named.
const MAX_NAMED: usize = 20;
/// Longest time of the whole search.
const MAX_TIME: Duration = Duration::from_secs(600);
/// Period at which the host is told of progress, and asked whether to stop.
const BEAT: Duration = Duration::from_millis(200);

/// Asks a server and writes the list, of the logical devices that the arguments name, or of
/// all.
///
/// # Errors
/// I/O errors of the streams and of TLS files, and where the host asks to stop.
pub(crate) fn run(
    config: &Config,
    devices: &[&str],
    streams: &Streams<'_>,
) -> Result<CommandExit, Error> {
    let dial = TcpDial { tls: crate::load_tls(config)? };
    let io_loop = IoLoop::new(1)
        .map_err(|error| Error::failed(format!("cannot start an I/O loop: {error}")))?;
    let beats = async {
        while streams.input().read(&mut [0]).is_ok() {
            sleep(BEAT).await;
        }
    };
    let mut browsed = None;
    let dial: Arc<dyn Dial> = Arc::new(dial);
    io_loop.run_until(beats, async { browsed = Some(any(&*dial, config, devices).await) });
    let Some(browsed) = browsed else { return Err(Error::cancelled()) };
    let found = match browsed {
        Ok(found) => found,
        Err(faults) => {
            faults.iter().for_each(|fault| streams.diagnose(LogLevel::Error, None, fault));
            return Ok(CommandExit::InputAtFault);
        }
    };
    found.remarks.iter().for_each(|remark| streams.diagnose(LogLevel::Warning, None, remark));
    if found.refused > MAX_NAMED {
        let text = format!("and {} more have no answer", found.refused - MAX_NAMED);
        streams.diagnose(LogLevel::Warning, None, &text);
    }
    if found.rows.is_empty() {
        let named = match devices {
            [] => "the server has no data of a kind that tags have".to_owned(),
            names => format!(
                "it has no data of a kind that tags have in {}; its logical devices are {}",
                names.join(", "),
                found.devices.join(", ")
            ),
        };
        streams.diagnose(LogLevel::Error, None, &named);
        return Ok(CommandExit::InputAtFault);
    }
    let text = format!("tags: {}; their units are in its SCL file alone", found.rows.len());
    streams.diagnose(LogLevel::Info, None, &text);
    let rows: Vec<_> = found.rows.into_iter().collect();
    let written = write_rows(&rows, &mut std::io::BufWriter::new(streams.output()));
    written.map_err(|error| Error::failed(error.to_string()))?;
    Ok(CommandExit::Done)
}

/// Returns the result of the first reachable address, or the faults of all.
async fn any(dial: &dyn Dial, config: &Config, devices: &[&str]) -> Result<Search, Vec<String>> {
    let mut faults = Vec::new();
    for endpoint in &config.endpoints {
        let late = || Err(LinkFault::Lost("it takes longer than 600 s".into()));
        let done = timeout(MAX_TIME, ask(dial, config, endpoint, devices)).await;
        match done.unwrap_or_else(|_| late()) {
            Ok(search) => return Ok(search),
            Err(fault) => faults.push(format!("{endpoint}: {fault}")),
        }
    }
    Err(faults)
}

async fn ask(
    dial: &dyn Dial,
    config: &Config,
    endpoint: &Endpoint,
    devices: &[&str],
) -> Result<Search, LinkFault> {
    let parameters = parameters(config)?;
    let stream = dial.dial(endpoint, config.connect_timeout).await?;
    let session = Session::new(&parameters, fastrand::u16(..), now());
    converse(stream, session, Search::with_devices(devices), config.timeout).await
}

/// Asks until nothing is left to ask.
async fn converse(
    mut stream: Box<dyn ByteStream>,
    mut session: Session<Question>,
    mut search: Search,
    limit: Duration,
) -> Result<Search, LinkFault> {
    session.start(now())?;
    let mut chunk = vec![0; CHUNK_BYTES];
    loop {
        session.tick(now())?;
        while session.has_room() {
            let Some(question) = search.queue.pop_front() else { break };
            session.send(question.request(), question, now())?;
            search.open += 1;
        }
        if session.has_room() && search.open == 0 {
            return Ok(search);
        }
        send(&mut stream, session.take_output(), limit).await?;
        tokio::select! {
            biased;
            read = stream.read(&mut chunk) => {
                let count = read.map_err(|error| LinkFault::Lost(describe_io_error(&error)))?;
                let bytes = chunk.get(..count).unwrap_or_default();
                if bytes.is_empty() {
                    return Err(LinkFault::Lost("the server closed the connection".into()));
                }
                session.receive(bytes, now(), |event| {
                    // No report was asked for.
                    if let Event::Answer(question, answer) = event {
                        search.take(question, answer);
                    }
                })?;
            }
            () = sleep_until(session.deadline().into()) => {}
        }
    }
}

/// Question to the server.
#[derive(Clone, Debug, PartialEq)]
enum Question {
    /// Names of the logical devices, or within one, after a name that came before.
    Names { device: Option<String>, after: Option<String> },
    /// Type of a data object.
    Type(Name),
}

impl Question {
    fn request(&self) -> Request {
        match self {
            Self::Names { device, after } => {
                Request::Names { device: device.clone(), after: after.clone() }
            }
            Self::Type(name) => Request::Type(name.clone()),
        }
    }
}

/// State of the search: questions and findings.
struct Search {
    /// Logical devices that are looked into; none for all.
    wanted: Vec<String>,
    queue: VecDeque<Question>,
    /// Questions without an answer so far.
    open: usize,
    pages: usize,
    objects: usize,
    devices: Vec<String>,
    rows: BTreeSet<Row>,
    remarks: Vec<String>,
    /// Questions that the server refused.
    refused: usize,
}

impl Search {
    fn with_devices(devices: &[&str]) -> Self {
        Self {
            wanted: devices.iter().map(|name| (*name).to_owned()).collect(),
            queue: [Question::Names { device: None, after: None }].into(),
            open: 0,
            pages: 0,
            objects: 0,
            devices: Vec::new(),
            rows: BTreeSet::new(),
            remarks: Vec::new(),
            refused: 0,
        }
    }

    fn take(&mut self, question: Question, answer: Answer) {
        self.open = self.open.saturating_sub(1);
        match (question, answer) {
            (Question::Names { device, .. }, Answer::Names { names, more_follow }) => {
                self.pages += 1;
                let after = names.last().cloned().filter(|_| more_follow);
                for name in names {
                    self.take_name(device.as_deref(), name);
                }
                if after.is_some() && self.pages >= MAX_PAGES {
                    self.remarks.push("it has names without end; the rest is left out".into());
                } else if after.is_some() {
                    // The names of one list come together.
                    self.queue.push_front(Question::Names { device, after });
                }
            }
            (Question::Type(name), Answer::Type(spec)) => self.take_type(&name, &spec),
            (question, Answer::Refused(why)) => {
                self.refused += 1;
                if self.refused <= MAX_NAMED {
                    let what = match question {
                        Question::Type(name) => name.to_string(),
                        Question::Names { device, .. } => device.unwrap_or_else(|| "names".into()),
                    };
                    self.remarks.push(format!("{what}: {why}"));
                }
            }
            // Sessions hand on answers of the service that was asked for alone.
            _ => {}
        }
    }

    fn take_name(&mut self, device: Option<&str>, name: String) {
        let Some(device) = device else {
            if self.wanted.is_empty() || self.wanted.contains(&name) {
                self.queue.push_back(Question::Names { device: Some(name.clone()), after: None });
            }
            self.devices.push(name);
            return;
        };
        let parts: Vec<_> = name.split('$').collect();
        if let [_, "ST" | "MX", _] = parts[..] {
            self.objects += 1;
            if self.objects == MAX_OBJECTS + 1 {
                let text = format!("more than {MAX_OBJECTS} data objects; the rest is left out");
                self.remarks.push(text);
            }
            if self.objects <= MAX_OBJECTS {
                self.queue
                    .push_back(Question::Type(Name { domain: device.to_owned(), item: name }));
            }
        }
    }

    fn take_type(&mut self, name: &Name, spec: &TypeSpec) {
        let parts: Vec<_> = name.item.split('$').collect();
        let [node, constraint, object] = parts[..] else { return };
        let constraint = if constraint == "MX" { "MX" } else { "ST" };
        let reference = format!("{}/{node}.{object}", name.domain);
        self.add_object(reference, constraint, spec, MAX_LEVELS);
    }

    /// Adds a data object and those in it.
    fn add_object(
        &mut self,
        reference: String,
        constraint: &'static str,
        spec: &TypeSpec,
        levels: usize,
    ) {
        let TypeSpec::Structure { components, .. } = spec else { return };
        if levels == 0 || self.rows.len() >= MAX_ROWS {
            return;
        }
        for component in components {
            let Some(name) = component.name.as_deref() else { continue };
            if !VALUES.contains(&name) {
                let below = format!("{reference}.{name}");
                self.add_object(below, constraint, &component.type_spec, levels - 1);
            }
        }
        if let Some(kind) = value_kind(spec, MAX_LEVELS) {
            self.rows.insert(Row { reference, constraint, kind, unit: String::new() });
        }
    }
}

/// The kind of tag for what stands for the value of a data object.
fn value_kind(spec: &TypeSpec, levels: usize) -> Option<&'static str> {
    let TypeSpec::Structure { components, .. } = spec else { return None };
    let named = |name: &&str| components.iter().find(|part| part.name.as_deref() == Some(*name));
    match &VALUES.iter().find_map(named)?.type_spec {
        TypeSpec::Boolean => Some("bool"),
        // Dbpos (IEC 61850-8-1, 8.1.3.6).
        TypeSpec::BitString(2 | -2) => Some("double_point"),
        TypeSpec::FloatingPoint { .. } => Some("f64"),
        TypeSpec::Integer(_) | TypeSpec::Unsigned(_) => Some("i64"),
        TypeSpec::VisibleString(_) | TypeSpec::MmsString(_) => Some("text"),
        below @ TypeSpec::Structure { .. } if levels > 0 => value_kind(below, levels - 1),
        _ => None,
    }
}
