//! Context of a case: the plugin, the request, and the findings so far.

use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use busbar_plugin_abi as abi;

use crate::environment;
use crate::fake_host::FakeHost;
use crate::fake_sink::FakeSink;
use crate::finding::{Finding, Stop, skip};
use crate::journal::{Entry, Journal};
use crate::library;
use crate::request::Request;
use crate::schema;
use crate::text;

/// Findings that one case reports; more of them say nothing new.
const MAX_FINDINGS: usize = 16;

/// A case at work.
pub(crate) struct Probe {
    pub(crate) request: Request,
    pub(crate) journal: Journal,
    pub(crate) host: &'static FakeHost,
    /// The sink of brief uses.
    pub(crate) brief_sink: OnceLock<&'static FakeSink>,
    entry: OnceLock<&'static abi::BusbarPluginEntry>,
    found: Mutex<Vec<Finding>>,
    started: Instant,
}

/// The plugin that a case is about.
pub(crate) struct Subject {
    pub(crate) id: String,
    pub(crate) capabilities: Vec<String>,
    pub(crate) schema: Option<serde_json::Value>,
    /// Settings that it accepts, as JSON text.
    pub(crate) settings: String,
    pub(crate) factory: &'static abi::BusbarPluginFactory,
}

impl Probe {
    pub(crate) fn new(request: Request) -> Self {
        let journal = Journal::new(request.journal.clone());
        Self {
            request,
            journal,
            host: FakeHost::new(),
            brief_sink: OnceLock::new(),
            entry: OnceLock::new(),
            found: Mutex::default(),
            started: Instant::now(),
        }
    }

    /// Time that is left, less some for the end.
    pub(crate) fn time_left(&self) -> Duration {
        let limit = Duration::from_millis(self.request.limit_millis);
        (limit * 3 / 4).saturating_sub(self.started.elapsed())
    }

    /// Adds a finding and continues.
    pub(crate) fn find(&self, finding: Finding) {
        let mut found = self.found.lock().unwrap_or_else(PoisonError::into_inner);
        if found.len() < MAX_FINDINGS && !found.contains(&finding) {
            self.journal.note(Entry::Found(finding.clone()));
            found.push(finding);
        }
    }

    /// Adds a finding unless `holds`.
    pub(crate) fn expect(&self, holds: bool, fault: impl Into<String>, remedy: &str) {
        if !holds {
            self.find(Finding::new(fault, remedy));
        }
    }

    /// The mapped library's entry, its version and size checked.
    pub(crate) fn entry(&self) -> Result<&'static abi::BusbarPluginEntry, Stop> {
        if let Some(entry) = self.entry.get() {
            return Ok(entry);
        }
        self.journal.note(Entry::Calling("the library's initialisers".into()));
        let entry = library::entry(library::load(&self.request.library)?)?;
        Ok(self.entry.get_or_init(|| entry))
    }

    /// The library after `init`.
    pub(crate) fn initialised(&self) -> Result<&'static abi::BusbarPluginFactory, Stop> {
        let entry = self.entry()?;
        if let Some(init) = entry.init {
            let mut error = abi::BusbarError::empty();
            let status = self.init(init, &mut error);
            self.expect_ok("init", status, &error)?;
        }
        self.factory()
    }

    /// The factory of a library that is initialised.
    pub(crate) fn factory(&self) -> Result<&'static abi::BusbarPluginFactory, Stop> {
        let missing = || Finding::new("the entry has no `get_factory`", "set it");
        let get_factory = self.entry()?.get_factory.ok_or_else(missing)?;
        let id = abi::BusbarStr::from_static(abi::PLUGIN_FACTORY_ID);
        let factory = self.get_factory(get_factory, id).cast();
        Ok(library::sized(factory, "BusbarPluginFactory")?)
    }

    /// The plugin of this case, in an initialised library.
    pub(crate) fn subject(&self) -> Result<Subject, Stop> {
        let factory = self.initialised()?;
        let missing = || Finding::new("the factory lacks `descriptor`", "set it");
        let descriptor = factory.descriptor.ok_or_else(missing)?;
        let raw = self.descriptor(descriptor, self.request.plugin);
        let raw = library::sized(raw, "BusbarPluginDescriptor")?;
        let read = |text, what: &str| {
            let fault = |fault| Finding::new(format!("the {what} of the descriptor {fault}"), "");
            text::read(text).map_err(fault)
        };
        let id = read(raw.id, "id")?;
        let mut capabilities = Vec::new();
        for index in 0..raw.capability_count.min(64) as usize {
            if raw.capabilities.is_null() || !raw.capabilities.is_aligned() {
                break;
            }
            // SAFETY: within the list that the descriptor gives.
            let text = unsafe { raw.capabilities.add(index).read() };
            capabilities.push(read(text, "capability id")?);
        }
        let schema = match read(raw.settings_schema, "settings schema")?.as_str() {
            "" => None,
            text => serde_json::from_str(text).ok(),
        };
        let given = self.request.sample.settings.clone();
        let settings = given.unwrap_or_else(|| schema::least(schema.as_ref()));
        Ok(Subject { id, capabilities, schema, settings: settings.to_string(), factory })
    }

    /// The plugin of this case, if it has a capability.
    pub(crate) fn subject_with(&self, capability: &str) -> Result<Subject, Stop> {
        let subject = self.subject()?;
        if subject.capabilities.iter().any(|id| id == capability) {
            return Ok(subject);
        }
        skip(format!("the plugin has no {capability}"))
    }

    /// A call that must succeed.
    pub(crate) fn expect_ok(
        &self,
        call: &str,
        status: abi::BusbarStatusNumber,
        error: &abi::BusbarError,
    ) -> Result<(), Stop> {
        if status == abi::BUSBAR_OK {
            return Ok(());
        }
        let message = text::message_of(error).unwrap_or_else(|what| format!("(its text {what})"));
        let status = text::status_name(status);
        let fault = format!("`{call}` failed where it must not: {status}, \"{message}\"");
        let remedy = "mend it; if it needs a device, settings or tags of its own, give them in a \
                      sample (--sample)";
        Err(Finding::new(fault, remedy).into())
    }

    /// Expects that a call was refused with one of these statuses and a message, or succeeded
    /// where `allowed` has BUSBAR_OK.
    pub(crate) fn expect_refused(
        &self,
        case: &str,
        status: abi::BusbarStatusNumber,
        error: &abi::BusbarError,
        allowed: &[abi::BusbarStatusNumber],
    ) {
        let as_wanted = self.expect_status(case, status, error, allowed);
        if as_wanted && status != abi::BUSBAR_OK {
            self.expect_message(case, error);
        }
    }

    /// Expects one of these statuses, without regard to the message; returns whether it was one.
    pub(crate) fn expect_status(
        &self,
        case: &str,
        status: abi::BusbarStatusNumber,
        error: &abi::BusbarError,
        allowed: &[abi::BusbarStatusNumber],
    ) -> bool {
        if status == abi::BUSBAR_INTERNAL {
            let message = text::message_of(error).unwrap_or_default();
            self.find(Finding::new(
                format!("{case}: a fault of the plugin's own, BUSBAR_INTERNAL: \"{message}\""),
                "mend what panicked; check arguments before using them",
            ));
            return false;
        }
        let names: Vec<_> = allowed.iter().map(|&status| text::status_name(status)).collect();
        let (got, wanted) = (text::status_name(status), names.join(" or "));
        let remedy = "check every argument before using it, and return the status of the header";
        let as_wanted = allowed.contains(&status);
        self.expect(as_wanted, format!("{case}: {got} instead of {wanted}"), remedy);
        as_wanted
    }

    /// Expects a readable message of a failure.
    pub(crate) fn expect_message(&self, case: &str, error: &abi::BusbarError) {
        match text::message_of(error) {
            Err(what) => self.find(Finding::new(
                format!("{case}: the message of the error {what}"),
                "write UTF-8 and its length in bytes, at most BUSBAR_ERROR_CAPACITY",
            )),
            Ok(message) if message.trim().is_empty() => self.find(Finding::new(
                format!("{case}: it failed without a word"),
                "write fault, place and remedy into the error's message",
            )),
            Ok(_) => {}
        }
    }

    /// Checks what shows only at the end: closed foreign descriptors, and wrong calls to the
    /// host.
    pub(crate) fn check_environment(&self, sentinels: &environment::Sentinels) {
        let lost = sentinels.lost();
        self.expect(
            lost == 0,
            format!("it closed {lost} descriptors that it had not opened"),
            "close only what you opened, and only once",
        );
        self.host.findings().into_iter().for_each(|finding| self.find(finding));
    }

    /// Reports whether the case has findings.
    pub(crate) fn has_findings(&self) -> bool {
        !self.found.lock().unwrap_or_else(PoisonError::into_inner).is_empty()
    }
}
