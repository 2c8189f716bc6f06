//! The adapter and its device in simulated time: a year in which everything fails, and a
//! day in which nothing does.

use std::time::Duration;

use busbar_link::Dial;
use busbar_plugin_sdk::simulation::{FaultPlan, SignalShape};
use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{SampleSink, SimulatedTag, ValueKind};
use serde_json::{Value as Json, json};
use simulated_year::{DAY, FaultSchedule, HOUR, Rig, SignalParameters, run, serve_clients};
use tokio::io::{AsyncReadExt, AsyncWriteExt, DuplexStream};
use tokio::sync::mpsc;
use tokio_modbus::bytes::Bytes;

use super::*;
use crate::Settings;
use crate::session::Session;

const SEED: u64 = 502;
/// Transaction numbers have 16 bits (Modbus Messaging on TCP/IP V1.0b, 3.1.3).
const TRANSACTIONS: u64 = 1 << 16;

struct OneDevice {
    config: Config,
    tags: Vec<SimulatedTag>,
}

impl OneDevice {
    /// Half of its tags are polled in one period, half in another.
    fn new(poll_millis: u64, other_poll_millis: u64) -> Self {
        let settings = json!({
            "host": "device.example",
            "poll_seconds": poll_millis as f64 / 1_000.0,
            "poll_groups": {"other": {"poll_seconds": other_poll_millis as f64 / 1_000.0}},
        });
        let config = serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap();
        Self { config, tags: tags() }
    }

    fn simulation(&self) -> Simulation {
        let (tags, update) = (self.tags.clone(), Duration::from_secs(1));
        Simulation { tags, faults: FaultPlan::none(), update, seed: SEED }
    }
}

/// Creates tags of all kinds, in all tables.
fn tags() -> Vec<SimulatedTag> {
    let holding = |register: u16, format: &str, group: &str| {
        let mut address = json!({"table": "holding", "register": register, "type": format});
        if !group.is_empty() {
            address["poll_group"] = json!(group);
        }
        address
    };
    let bit = |table: &str, register: u16| json!({"table": table, "register": register});
    let sine = |base: f64| (SignalShape::Sine, base, 20.0, DAY);
    let counter = (SignalShape::Counter, 0.0, 50_000.0, HOUR);
    let steps = (SignalShape::Steps, 0.0, 0.0, HOUR);
    let text = json!({"table": "holding", "register": 300, "length": 12});
    let all: [(ValueKind, Json, SignalParameters); 9] = [
        (ValueKind::F64, holding(0, "f32", ""), sine(0.0)),
        (ValueKind::F64, holding(2, "f32", "other"), sine(100.0)),
        (ValueKind::F64, holding(100, "f64", ""), sine(200.0)),
        (ValueKind::F64, holding(200, "f32", "other"), sine(300.0)),
        (ValueKind::I64, holding(4, "u16", ""), counter),
        (ValueKind::Bool, bit("coil", 3), steps),
        (ValueKind::Bool, bit("discrete", 30), steps),
        (ValueKind::DoublePoint, bit("discrete", 10), steps),
        (ValueKind::Text, text, (SignalShape::Steps, 50.0, 50.0, HOUR)),
    ];
    simulated_year::tags(SEED, all)
}

impl Rig for OneDevice {
    const DEADLINE: Duration = Duration::from_secs(1);
    /// The next poll, which is not answered in time.
    const NOTICED_AFTER: Duration = Duration::from_secs(300 + 3);
    /// Time of the next poll, which notices the loss, and the longest delay after it.
    const WELL_AFTER: Duration = Duration::from_secs(300 + 40);
    const MAX_AGE: Duration = Duration::from_secs(602);
    /// The bytes of the connection, and its protocol.
    const TASKS: usize = 2;

    fn tags(&self) -> &[SimulatedTag] {
        &self.tags
    }

    fn run_adapter(
        &self,
        sink: SampleSink,
        dial: Arc<dyn Dial>,
    ) -> impl Future<Output = ()> + 'static {
        let points = address::parse(&self.simulation().specs(), &self.config).unwrap();
        Session::new(self.config.clone(), dial, points, sink, host()).run()
    }

    fn run_device(
        &self,
        clients: mpsc::Receiver<DuplexStream>,
        link: FaultyLink,
    ) -> impl Future<Output = ()> + 'static {
        let (bank, remark) = bank(&self.config, &self.simulation()).unwrap();
        assert_eq!(remark, None);
        let bank = Arc::new(bank);
        serve_clients(clients, link, move |stream, link| {
            serve_client(stream, Client { bank: Arc::clone(&bank), link })
        })
    }
}

/// The library serves sockets alone; here are its frames through memory.
async fn serve_client(mut stream: DuplexStream, client: Client) -> std::io::Result<()> {
    loop {
        let mut header = [0; 7];
        stream.read_exact(&mut header).await?;
        let length = u16::from_be_bytes([header[4], header[5]]);
        let mut request = vec![0; usize::from(length) - 1];
        stream.read_exact(&mut request).await?;
        let function = request[0];
        let request = Request::try_from(Bytes::from(request))?;
        let response = client.call(SlaveRequest { slave: header[6], request }).await;
        let rest = response.map_or_else(|code| vec![function | 0x80, code.into()], to_bytes);
        let length = u16::try_from(rest.len() + 1).unwrap().to_be_bytes();
        header[4..6].copy_from_slice(&length);
        stream.write_all(&[&header, &rest[..]].concat()).await?;
    }
}

fn to_bytes(response: Response) -> Vec<u8> {
    let (function, cells) = match response {
        Response::ReadCoils(bits) => (1, packed(&bits)),
        Response::ReadDiscreteInputs(bits) => (2, packed(&bits)),
        Response::ReadHoldingRegisters(registers) => {
            (3, registers.iter().flat_map(|register| register.to_be_bytes()).collect())
        }
        Response::ReadInputRegisters(registers) => {
            (4, registers.iter().flat_map(|register| register.to_be_bytes()).collect())
        }
        other => panic!("the device does not answer so: {other:?}"),
    };
    [&[function, u8::try_from(cells.len()).unwrap()], &cells[..]].concat()
}

/// The first bit is the lowest.
fn packed(bits: &[bool]) -> Vec<u8> {
    let byte = |bits: &[bool]| bits.iter().rev().fold(0, |all, &bit| all << 1 | u8::from(bit));
    bits.chunks(8).map(byte).collect()
}

fn paused() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build().unwrap()
}

#[test]
fn a_year_of_failures_leaves_nothing_behind() {
    let year = run(OneDevice::new(300_000, 600_000), SEED, 365, FaultSchedule::Daily, &paused());
    eprintln!("{year:?}");
    assert!(year.duration >= Duration::from_secs(365 * 86_400));
    assert!(year.faults > 1200 && year.outages > 200 && year.reloads > 200, "{year:?}");
    assert!(year.quiet_points > 30_000 && year.dead_points > 500, "{year:?}");
    assert!(year.untimed_samples > 500_000 && year.timed_samples == 0, "{year:?}");
    assert!(year.shortest_gap.unwrap() >= Duration::from_secs(1), "{year:?}");
    // A task that is left behind holds some hundred bytes, a connection 128 KiB.
    assert!(year.heap_growth < 4096, "{year:?}");
    assert!(year.heap_peak < 4 << 20, "{year:?}");
}

#[test]
fn a_seed_gives_the_same_days_again() {
    let days = |seed| {
        let rig = OneDevice::new(300_000, 600_000);
        run(rig, seed, 5, FaultSchedule::Daily, &paused()).trace
    };
    assert_eq!(days(1), days(1));
    assert_ne!(days(1), days(2));
}

#[test]
fn transaction_numbers_begin_anew_on_a_connection_that_lasts() {
    let day = run(OneDevice::new(5000, 4000), SEED, 1, FaultSchedule::Empty, &paused());
    eprintln!("{day:?}");
    assert_eq!(day.dials, 1, "the connection was not lost");
    // Every poll of the default group takes four requests, each of the other two.
    let requests = 86_400 / 5 * 4 + 86_400 / 4 * 2;
    assert!(requests > TRANSACTIONS, "{requests}");
    assert!(day.untimed_samples >= 86_400 / 5 * 6 + 86_400 / 4 * 2, "{day:?}");
}
