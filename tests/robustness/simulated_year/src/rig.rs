//! Building blocks of rigs: tags with simulated signals, and a server for clients.

use std::time::Duration;

use busbar_plugin_sdk::simulation::{Behavior, Signal, SignalShape};
use busbar_plugin_sdk::testing::tag_spec;
use busbar_plugin_sdk::{SimulatedTag, ValueKind};
use device_server::FaultyLink;
use serde_json::Value as Json;
use tokio::io::DuplexStream;
use tokio::sync::mpsc;
use tokio::task::JoinSet;

/// Length of an hour, seconds.
pub const HOUR: f64 = 3600.0;
/// Length of a day, seconds.
pub const DAY: f64 = 24.0 * HOUR;

/// Shape, base, amplitude and period in seconds of a signal.
pub type SignalParameters = (SignalShape, f64, f64, f64);

/// Creates tags with handles from 0 on, each with a kind, an address and a signal.
///
/// # Panics
/// When the parameters of a signal are invalid.
pub fn tags(
    seed: u64,
    all: impl IntoIterator<Item = (ValueKind, Json, SignalParameters)>,
) -> Vec<SimulatedTag> {
    let tag = |(tag, (kind, address, (shape, base, amplitude, period_seconds)))| {
        let spec = tag_spec(tag, &format!("tag{tag}"), kind, address);
        let period = Duration::from_secs_f64(period_seconds);
        let behaviour = Behavior::new(shape, base, amplitude, period).expect("it can move so");
        let signal = Signal::new(seed, &spec.id, kind, behaviour).expect("it can move so");
        SimulatedTag { spec, signal }
    };
    (0_u32..).zip(all).map(tag).collect()
}

/// Serves each client that the link admits, in a task of its own, until this is dropped.
pub async fn serve_clients<F: Future<Output: Send> + Send + 'static>(
    mut clients: mpsc::Receiver<DuplexStream>,
    link: FaultyLink,
    mut serve: impl FnMut(DuplexStream, FaultyLink) -> F,
) {
    let mut serving = JoinSet::new();
    while let Some(stream) = clients.recv().await {
        while serving.try_join_next().is_some() {}
        if let Some(client) = link.admit(stream) {
            let serving_it = serve(client, link.clone());
            serving.spawn(async move { drop(serving_it.await) });
        }
    }
}
