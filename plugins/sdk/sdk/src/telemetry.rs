//! Capability `busbar.telemetry/2-draft`: samples of devices.

use std::sync::{Arc, PoisonError, RwLock};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use busbar_plugin_abi as abi;

use crate::{Error, Plugin, Quality, Reason, SampleFlags, Value, ValueKind};

/// Telemetry that brings values of devices into the tag table. Read-only by design.
pub trait Telemetry: Plugin {
    /// Origin of all samples of this plugin, such as
    /// [`SampleFlags::RECORDED`] for one that plays recordings.
    const ORIGIN: SampleFlags = SampleFlags::LIVE;

    /// Checks whether these tags could be served: reads addresses, connects to nothing. `busbar
    /// check` calls it.
    ///
    /// # Errors
    /// [`Error::settings`], naming every tag whose address can never work.
    fn check(&self, tags: &[TagSpec]) -> Result<(), Error> {
        let _ = tags;
        Ok(())
    }

    /// Starts to serve tags on threads of the plugin's own, and returns.
    ///
    /// # Errors
    /// [`Error::settings`] for addresses that can never work. A device that
    /// does not answer is no error, but [`Quality::Bad`].
    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error>;

    /// Ends all threads within two seconds.
    fn stop(&mut self);
}

/// Tag to be served.
#[derive(Clone, Debug)]
pub struct TagSpec {
    /// Handle that names the tag in samples.
    pub tag: u32,
    /// Type of the tag's values.
    pub kind: ValueKind,
    /// Freshness limit: the host calls an older value stale.
    pub freshness: Duration,
    /// Id of the tag, for messages.
    pub id: String,
    /// Address of the tag, as the configuration has it.
    pub address: serde_json::Value,
    /// Unit that samples must have; empty where the tag has none, or the host scales samples to it.
    pub unit: String,
}

impl TagSpec {
    /// Parses the address of the tag.
    ///
    /// # Errors
    /// [`Error::settings`] with tag, place and fault.
    pub fn parse_address<A: serde::de::DeserializeOwned>(&self) -> Result<A, Error> {
        serde_path_to_error::deserialize(&self.address).map_err(|error| {
            Error::settings(format!(
                "tag '{}': address, {}: {}",
                self.id,
                error.path(),
                error.inner()
            ))
        })
    }
}

impl TagSpec {
    /// Reads the addresses of all tags, each beside its tag.
    ///
    /// # Errors
    /// [`Error::settings`] that names every tag at fault.
    ///
    /// ```
    /// use busbar_plugin_sdk::testing::tag_spec;
    /// use busbar_plugin_sdk::{TagSpec, ValueKind};
    ///
    /// let tag = |id, address| tag_spec(0, id, ValueKind::F64, address);
    /// let good = TagSpec::parse_all::<String>(&[tag("Oil", "oil".into())])?;
    /// assert_eq!(good[0].0, "oil");
    /// let tags = [tag("Oil", 1.into()), tag("Load", "load".into()), tag("Tap", 2.into())];
    /// let fault = TagSpec::parse_all::<String>(&tags).unwrap_err();
    /// assert!(fault.message().contains("'Oil'") && fault.message().contains("'Tap'"));
    /// # Ok::<(), busbar_plugin_sdk::Error>(())
    /// ```
    pub fn parse_all<A: serde::de::DeserializeOwned>(
        tags: &[Self],
    ) -> Result<Vec<(A, Self)>, Error> {
        let (mut parsed, mut faults) = (Vec::with_capacity(tags.len()), Vec::new());
        for tag in tags {
            match tag.parse_address() {
                Ok(address) => parsed.push((address, tag.clone())),
                Err(fault) => faults.push(fault.message().to_owned()),
            }
        }
        if faults.is_empty() { Ok(parsed) } else { Err(Error::settings(faults.join("; "))) }
    }
}

/// Update of one tag.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Handle of the tag, from [`TagSpec`].
    pub tag: u32,
    /// Value; `None` sets the quality only. The host's doubt about the time of the last value
    /// stays until the next value.
    pub value: Option<Value>,
    /// Quality of the value at the source.
    pub quality: Quality,
    /// Source timestamp, if there is one. The host judges it: pass on what was read, and set
    /// [`SampleFlags::TIME_UNUSABLE`] where nothing could be.
    pub source_time: Option<SystemTime>,
    /// Flags: order of arrival or of source time, and origin.
    pub flags: SampleFlags,
}

impl Sample {
    /// Creates a good, live value without a source timestamp.
    pub fn good(tag: u32, value: Value) -> Self {
        let (quality, flags) = (Quality::Good, SampleFlags::LIVE);
        Self { tag, value: Some(value), quality, source_time: None, flags }
    }

    /// Creates a sample without a value, for a reason. The host keeps the last value and marks it.
    pub fn bad(tag: u32, reason: Reason) -> Self {
        let (quality, flags) = (Quality::Bad(reason), SampleFlags::LIVE);
        Self { tag, value: None, quality, source_time: None, flags }
    }

    /// Returns the sample with these flags added.
    #[must_use]
    pub fn with_flags(self, flags: SampleFlags) -> Self {
        Self { flags: self.flags | flags, ..self }
    }

    /// Lays the sample out for the host; valid as long as the sample is.
    fn to_abi(&self) -> abi::BusbarSample {
        let value = abi::ValueFields::new(self.value.as_ref());
        let (quality, reason) = self.quality.codes();
        let mut flags = self.flags;
        let source_time_unix_nanos = self.source_time.map_or(abi::BUSBAR_NO_TIME, |time| {
            unix_nanos(time).unwrap_or_else(|| {
                // Beyond counting: no device means the year 1600 or 2300.
                flags |= SampleFlags::TIME_UNUSABLE;
                abi::BUSBAR_NO_TIME
            })
        });
        abi::BusbarSample {
            tag: self.tag,
            kind: value.kind,
            quality,
            reason,
            flags: flags.bits(),
            number: value.number,
            integer: value.integer,
            source_time_unix_nanos,
            text: value.text,
        }
    }
}

/// Returns the nanoseconds from 1970-01-01 UTC to a time, negative before; `None` beyond some 292
/// years.
fn unix_nanos(time: SystemTime) -> Option<i64> {
    match time.duration_since(UNIX_EPOCH) {
        Ok(since) => i64::try_from(since.as_nanos()).ok(),
        Err(error) => i64::try_from(error.duration().as_nanos()).ok().map(|nanos| -nanos),
    }
}

/// State of the link to a device, for operators.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LinkState {
    /// Connecting, or waiting to try again.
    Connecting,
    /// Link that is connected.
    Up,
    /// Link that is down.
    Down,
}

/// Sink for samples and link reports. Clones share it; any thread may use it. After `stop` it takes
/// nothing more, so that a straggling thread does no harm.
#[derive(Clone)]
pub struct SampleSink {
    raw: Arc<RwLock<Option<RawSink>>>,
}

struct RawSink(*const abi::BusbarSampleSink);

// SAFETY: the ABI lets the sink be used from any thread until `stop` returns;
// `close` takes the pointer away before that.
unsafe impl Send for RawSink {}
// SAFETY: as above.
unsafe impl Sync for RawSink {}

impl SampleSink {
    /// Hands a batch to the host without blocking; returns how many samples it
    /// took. The rest were dropped and counted.
    pub fn publish(&self, samples: &[Sample]) -> usize {
        let batch: Vec<_> = samples.iter().map(Sample::to_abi).collect();
        self.with(|sink| {
            // SAFETY: context and function belong together; batch and texts outlive the call.
            let publish = |f: unsafe extern "C" fn(_, _, _) -> _| unsafe {
                f(sink.context, batch.as_ptr(), batch.len())
            };
            sink.publish.map_or(0, publish)
        })
        .unwrap_or(0)
    }

    /// Publishes of every tag that it has no usable value now, for a reason.
    pub fn publish_bad(&self, tags: impl IntoIterator<Item = u32>, reason: Reason) -> usize {
        let samples: Vec<_> = tags.into_iter().map(|tag| Sample::bad(tag, reason)).collect();
        self.publish(&samples)
    }

    /// Reports the state of the link to operators, with a sentence.
    pub fn report_link(&self, state: LinkState, message: &str) {
        let state = match state {
            LinkState::Connecting => abi::BUSBAR_LINK_STATE_CONNECTING,
            LinkState::Up => abi::BUSBAR_LINK_STATE_UP,
            LinkState::Down => abi::BUSBAR_LINK_STATE_DOWN,
        };
        self.with(|sink| {
            if let Some(report) = sink.report_link {
                // SAFETY: context and function belong together; the text outlives the call.
                unsafe { report(sink.context, state, abi::BusbarStr::from_borrowed(message)) }
            }
        });
    }

    /// Sets the scene time of the values published from now on, nanoseconds since 1970-01-01 UTC.
    /// For recordings, whose time is not now; overlays calculate by it. `None` returns to the wall
    /// clock.
    pub fn report_scene_time(&self, unix_nanos: Option<i64>) {
        let unix_nanos = unix_nanos.unwrap_or(abi::BUSBAR_NO_TIME);
        self.with(|sink| {
            if let Some(report) = sink.report_scene_time {
                // SAFETY: context and function belong together.
                unsafe { report(sink.context, unix_nanos) }
            }
        });
    }

    fn with<T>(&self, call: impl FnOnce(&abi::BusbarSampleSink) -> T) -> Option<T> {
        let guard = self.raw.read().unwrap_or_else(PoisonError::into_inner);
        let raw = guard.as_ref()?;
        // SAFETY: the host keeps the sink until `stop` returns, and `close`,
        // which waits for this guard, ran before that.
        Some(call(unsafe { &*raw.0 }))
    }

    /// # Safety
    /// `raw` stays valid until [`SampleSink::close`] returned.
    pub(crate) unsafe fn open(raw: *const abi::BusbarSampleSink) -> Self {
        Self { raw: Arc::new(RwLock::new(Some(RawSink(raw)))) }
    }

    pub(crate) fn close(&self) {
        *self.raw.write().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

/// # Safety
/// Pointers are null or valid as the ABI's `start` demands.
pub(crate) unsafe fn read_specs(
    tags: *const abi::BusbarTagSpec,
    count: usize,
) -> Result<Vec<TagSpec>, Error> {
    // SAFETY: the host gives `count` elements.
    let tags = unsafe { crate::boundary::slice(tags, count)? };
    // SAFETY: the host's texts are valid for the call.
    tags.iter().map(|raw| unsafe { read_spec(raw) }).collect()
}

/// # Safety
/// The texts are valid for the call.
pub(crate) unsafe fn read_spec(raw: &abi::BusbarTagSpec) -> Result<TagSpec, Error> {
    // SAFETY: the caller vouches for the texts.
    let [id, address, unit] = unsafe {
        [
            crate::boundary::text(raw.id)?,
            crate::boundary::text(raw.address_json)?,
            crate::boundary::text(raw.unit)?,
        ]
    };
    let kind = ValueKind::from_code(raw.kind)
        .ok_or_else(|| Error::argument(format!("tag '{id}': unknown kind {}", raw.kind)))?;
    let address = serde_json::from_str(address)
        .map_err(|error| Error::argument(format!("tag '{id}': address: {error}")))?;
    let freshness = Duration::from_millis(raw.freshness_millis);
    let (id, unit) = (id.to_owned(), unit.to_owned());
    Ok(TagSpec { tag: raw.tag, kind, freshness, id, address, unit })
}
