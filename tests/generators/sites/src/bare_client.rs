//! Peer client: rumqttc's own event loop, which receives the same messages without decoding any.

use std::io::Write;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use anyhow::Result;
use rumqttc_v4::{AsyncClient, Event, MqttOptions, Packet, QoS};

/// Longest accepted message, bytes.
const MAX_BYTES: usize = 16 * 1024 * 1024;
/// Time between two reports.
const PERIOD: Duration = Duration::from_millis(200);

static MESSAGES: AtomicU64 = AtomicU64::new(0);
static BYTES: AtomicU64 = AtomicU64::new(0);

/// Subscribes to all topics and prints, for ever, the messages and bytes received so far.
pub(crate) fn run(port: u16) -> Result<()> {
    std::thread::spawn(|| {
        loop {
            std::thread::sleep(PERIOD);
            let (messages, bytes) =
                (MESSAGES.load(Ordering::Relaxed), BYTES.load(Ordering::Relaxed));
            let mut out = std::io::stdout().lock();
            if writeln!(out, "{messages} {bytes}").and_then(|()| out.flush()).is_err() {
                std::process::exit(0);
            }
        }
    });
    tokio::runtime::Builder::new_current_thread().enable_all().build()?.block_on(async {
        let mut options = MqttOptions::new("bare", ("127.0.0.1", port));
        options.set_max_packet_size(MAX_BYTES, MAX_BYTES).set_keep_alive(600);
        let (client, mut events) = AsyncClient::builder(options).capacity(10).build();
        client.subscribe("#", QoS::AtMostOnce).await?;
        loop {
            if let Event::Incoming(Packet::Publish(message)) = events.poll().await? {
                MESSAGES.fetch_add(1, Ordering::Relaxed);
                BYTES.fetch_add(message.payload.len() as u64, Ordering::Relaxed);
            }
        }
    })
}
