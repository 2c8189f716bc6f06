//! Metrics for Prometheus (OpenMetrics), on request, at an address of this machine.

use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use axum::Router;
use axum::http::header::CONTENT_TYPE;
use axum::routing::get;
use busbar_config::MetricsConfig;
use busbar_viewer::{ViewHealth, Viewer};
use prometheus_client::encoding::text::encode;
use prometheus_client::metrics::counter::Counter;
use prometheus_client::metrics::family::Family;
use prometheus_client::metrics::gauge::Gauge;
use prometheus_client::metrics::histogram::Histogram;
use prometheus_client::registry::{Registry, Unit};
use tokio::sync::oneshot;

/// Period of metrics that are expensive to collect.
const PERIOD: Duration = Duration::from_secs(1);
/// Bounds of the histogram of frame times, seconds.
const FRAME_SECONDS: [f64; 9] = [0.004, 0.008, 0.016, 0.033, 0.066, 0.125, 0.25, 0.5, 1.0];
/// Content type of the answer (OpenMetrics 1.0).
const FORMAT: &str = "application/openmetrics-text; version=1.0.0; charset=utf-8";

type Labels = Vec<(&'static str, String)>;
type Gauges = Family<Labels, Gauge>;
type Counters = Family<Labels, Counter<u64, AtomicU64>>;

/// Metrics server, configured by arguments or else by the configuration.
#[derive(Default)]
pub(crate) struct ServedMetrics {
    is_by_arguments: bool,
    served: Option<(SocketAddr, Metrics)>,
}

impl ServedMetrics {
    /// Serves metrics if the arguments request it.
    ///
    /// # Errors
    /// Returns the errors of [`Metrics::serve`].
    pub(crate) fn start(address: Option<SocketAddr>, public: bool) -> anyhow::Result<Self> {
        let serve = |address| anyhow::Ok((address, Metrics::serve(address, public)?));
        let served = address.map(serve).transpose()?;
        Ok(Self { is_by_arguments: served.is_some(), served })
    }

    /// Serves metrics if a configuration requests it. On failure, all stays as it was: a view is
    /// worth more than its metrics.
    pub(crate) fn follow(&mut self, wanted: Option<MetricsConfig>) {
        let address = wanted.map(|wanted| wanted.address);
        if self.is_by_arguments || address == self.served.as_ref().map(|(served, _)| *served) {
            return;
        }
        let serve = |wanted: MetricsConfig| {
            anyhow::Ok((wanted.address, Metrics::serve(wanted.address, wanted.public)?))
        };
        match wanted.map(serve).transpose() {
            Ok(served) => self.served = served,
            Err(error) => tracing::error!("{error:#}"),
        }
    }

    /// Records the metrics of a turn of the view, in which a frame was drawn or none.
    pub(crate) fn note(&mut self, viewer: &Viewer, is_drawn: bool) {
        if let Some((_, metrics)) = &mut self.served {
            metrics.note(viewer, is_drawn);
        }
    }
}

/// Metrics of a view, served until this is dropped.
#[derive(Default)]
struct Metrics {
    frame_seconds: Option<Histogram>,
    frames: Counter<u64, AtomicU64>,
    tags: Gauges,
    alarms: Gauges,
    plugin_up: Gauges,
    plugin_memory: Gauges,
    plugin_deaths: Counters,
    samples_dropped: Counters,
    samples_rejected: Counters,
    reloads: Counters,
    faulty: Gauge,
    memory: Gauge,
    looked_at: Option<Instant>,
    /// Sender whose drop ends serving.
    _serves: Option<oneshot::Sender<()>>,
}

impl Metrics {
    /// Serves metrics at an address; unless `public`, of this machine alone.
    fn serve(address: SocketAddr, public: bool) -> anyhow::Result<Self> {
        if !address.ip().is_loopback() && !public {
            bail!(
                "{address} can be reached from other machines\n  remedy: serve metrics at \
                 127.0.0.1, or add --metrics-public"
            );
        }
        let listener = TcpListener::bind(address).with_context(|| {
            format!("metrics cannot be served at {address}; choose another port")
        })?;
        listener.set_nonblocking(true)?;
        let (serves, ended) = oneshot::channel();
        let metrics = Self {
            frame_seconds: Some(Histogram::new(FRAME_SECONDS)),
            _serves: Some(serves),
            ..Self::default()
        };
        let registry = Arc::new(metrics.registry());
        let page = move || {
            let registry = Arc::clone(&registry);
            async move {
                let mut text = String::new();
                // Text takes whatever is written.
                let _ = encode(&mut text, &registry);
                ([(CONTENT_TYPE, FORMAT)], text)
            }
        };
        let serve = move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
            let served = runtime.and_then(|runtime| {
                runtime.block_on(async {
                    let listener = tokio::net::TcpListener::from_std(listener)?;
                    let served = axum::serve(listener, Router::new().route("/metrics", get(page)));
                    tokio::select! {
                        served = served => served,
                        _ = ended => Ok(()),
                    }
                })
            });
            if let Err(error) = served {
                tracing::error!("metrics are served no longer: {error}");
            }
        };
        std::thread::Builder::new().name("metrics".into()).spawn(serve)?;
        Ok(metrics)
    }

    fn registry(&self) -> Registry {
        let mut all = Registry::with_prefix("busbar");
        if let Some(histogram) = &self.frame_seconds {
            let help = "What a frame took the processor until it was handed to the device";
            all.register_with_unit("frame", help, Unit::Seconds, histogram.clone());
        }
        all.register("frames", "Frames drawn", self.frames.clone());
        all.register("tags", "Tags by the quality of their values", self.tags.clone());
        all.register("alarms", "Alarms by their state, letters of IEC 62682", self.alarms.clone());
        all.register("plugin_up", "Whether a plugin runs", self.plugin_up.clone());
        let help = "Memory of a plugin's process in RAM";
        all.register_with_unit(
            "plugin_resident_memory",
            help,
            Unit::Bytes,
            self.plugin_memory.clone(),
        );
        all.register("plugin_deaths", "Ends of a plugin's process", self.plugin_deaths.clone());
        let help = "Samples that later ones overtook because too many waited";
        all.register("samples_dropped", help, self.samples_dropped.clone());
        let help = "Samples that named no tag of their plugin or made no sense";
        all.register("samples_rejected", help, self.samples_rejected.clone());
        let help = "Configurations that were loaded again, by what became of them";
        all.register("reloads", help, self.reloads.clone());
        let help = "Whether the configuration on the disk has faults, and is not what is shown";
        all.register("configuration_faulty", help, self.faulty.clone());
        let help = "Memory of this process in RAM";
        all.register_with_unit("resident_memory", help, Unit::Bytes, self.memory.clone());
        all
    }

    /// Records the metrics of a turn of the view, in which a frame was drawn or none.
    fn note(&mut self, viewer: &Viewer, is_drawn: bool) {
        if is_drawn {
            if let Some(histogram) = &self.frame_seconds {
                histogram.observe(viewer.frame_time().as_secs_f64());
            }
            self.frames.inc();
        }
        if self.looked_at.is_some_and(|at| at.elapsed() < PERIOD) {
            return;
        }
        self.looked_at = Some(Instant::now());
        self.look(&viewer.health());
    }

    fn look(&self, health: &ViewHealth) {
        let quality = &health.quality;
        for (name, count) in
            [("good", quality.good), ("uncertain", quality.uncertain), ("bad", quality.bad)]
        {
            self.tags.get_or_create(&vec![("quality", name.to_owned())]).set(count as i64);
        }
        for (state, count) in &health.alarms {
            self.alarms
                .get_or_create(&vec![("state", state.letter().to_string())])
                .set(*count as i64);
        }
        // Some may be gone.
        self.plugin_up.clear();
        self.plugin_memory.clear();
        let count = |all: &Counters, labels: &Labels, value: u64| {
            all.get_or_create(labels).inner().store(value, Ordering::Relaxed);
        };
        for plugin in &health.plugins {
            let labels = vec![("plugin", plugin.name.clone())];
            let is_up = matches!(plugin.state, "running" | "in process");
            self.plugin_up.get_or_create(&labels).set(i64::from(is_up));
            let memory = plugin.memory_bytes.unwrap_or_default();
            self.plugin_memory.get_or_create(&labels).set(memory as i64);
            count(&self.plugin_deaths, &labels, plugin.deaths);
            count(&self.samples_dropped, &labels, plugin.dropped);
            count(&self.samples_rejected, &labels, plugin.rejected);
        }
        for (outcome, value) in [("good", health.reloads.good), ("bad", health.reloads.bad)] {
            count(&self.reloads, &vec![("outcome", outcome.to_owned())], value);
        }
        self.faulty.set(i64::from(health.reloads.fault.is_some()));
        self.memory.set(resident_bytes().unwrap_or_default() as i64);
    }
}

/// Returns the memory of this process in RAM, bytes.
fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    Some(line.split_whitespace().next()?.parse::<u64>().ok()? * 1024)
}
