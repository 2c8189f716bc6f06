//! The plugin and its station in simulated time: a year in which everything fails, and a
//! day in which nothing does.

use busbar_link::Dial;
use busbar_plugin_sdk::simulation::{FaultPlan, SignalShape};
use busbar_plugin_sdk::testing::host;
use busbar_plugin_sdk::{SampleSink, SimulatedTag, ValueKind};
use serde_json::{Value as Json, json};
use simulated_year::{
    DAY, FaultSchedule, HOUR, Rig, SignalParameters, SimulatedTime, run, serve_clients,
};
use tokio::sync::mpsc;

use super::*;
use crate::Settings;
use crate::link::World;

const SEED: u64 = 104;
/// N(S) and N(R) have 15 bits (IEC 60870-5-104, 5.1).
const SEQUENCE_NUMBERS: u64 = 1 << 15;

/// A redundancy group of two connections.
struct TwoConnections {
    config: Config,
    tags: Vec<SimulatedTag>,
    /// Between two looks of the station for changes.
    update: Duration,
}

impl TwoConnections {
    fn new(update: Duration, interrogation: Duration) -> Self {
        let settings = json!({
            "host": "a.example",
            "redundancy": [{"host": "b.example"}],
            "t0_seconds": 5,
            "t3_seconds": 300,
            "interrogation_period_seconds": interrogation.as_secs_f64(),
            "counter_period_seconds": 3600,
            "clock_sync_period_seconds": 3600,
            "utc_offset_minutes": 60,
        });
        let config = serde_json::from_value::<Settings>(settings).unwrap().parse().unwrap();
        Self { config, tags: tags(), update }
    }

    fn simulation(&self) -> Simulation {
        let (tags, update) = (self.tags.clone(), self.update);
        Simulation { tags, faults: FaultPlan::none(), update, seed: SEED }
    }
}

/// All kinds, on two common addresses.
fn tags() -> Vec<SimulatedTag> {
    let sine = |base| (ValueKind::F64, json!({}), (SignalShape::Sine, base, 20.0, DAY));
    let all: [(ValueKind, Json, SignalParameters); 10] = [
        sine(0.0),
        sine(100.0),
        sine(200.0),
        sine(300.0),
        (ValueKind::I64, json!({}), (SignalShape::Counter, 0.0, 30_000.0, HOUR)),
        (ValueKind::I64, json!({"type": "counter"}), (SignalShape::Counter, 0.0, 1e6, 4.0 * HOUR)),
        (ValueKind::I64, json!({"type": "step"}), (SignalShape::Steps, 0.0, 20.0, 2.0 * HOUR)),
        (ValueKind::Bool, json!({}), (SignalShape::Steps, 0.0, 0.0, HOUR)),
        (ValueKind::Bool, json!({"bit": 9}), (SignalShape::Steps, 0.0, 0.0, 3.0 * HOUR)),
        (ValueKind::DoublePoint, json!({}), (SignalShape::Steps, 0.0, 0.0, HOUR)),
    ];
    let placed = (0_u32..).zip(all).map(|(tag, (kind, mut address, moves))| {
        address["ioa"] = json!(tag + 1);
        address["common_address"] = json!(1 + tag % 2);
        (kind, address, moves)
    });
    simulated_year::tags(SEED, placed)
}

impl Rig for TwoConnections {
    const DEADLINE: Duration = Duration::from_secs(15);
    /// The next interrogation, which is not acknowledged in time.
    const NOTICED_AFTER: Duration = Duration::from_secs(900 + 15 + 25);
    /// The longest delay, on both connections, and the start of data transfer.
    const WELL_AFTER: Duration = Duration::from_secs(100);
    const MAX_AGE: Duration = Duration::from_secs(305);
    /// Two a connection: its bytes, and its protocol.
    const TASKS: usize = 4;

    fn tags(&self) -> &[SimulatedTag] {
        &self.tags
    }

    fn run_adapter(
        &self,
        sink: SampleSink,
        dial: Arc<dyn Dial>,
    ) -> impl Future<Output = ()> + 'static {
        let points = Points::parse(&self.simulation().specs(), &self.config).unwrap();
        let world = World { dial, wall_clock: SimulatedTime::of_adapter };
        crate::serve(self.config.clone(), points, sink, host(), world)
    }

    fn run_device(
        &self,
        clients: mpsc::Receiver<DuplexStream>,
        link: FaultyLink,
    ) -> impl Future<Output = ()> + 'static {
        let shared = lay_out(&self.config, &self.simulation(), &host()).unwrap();
        let update = self.update;
        serve_clients(clients, link, move |client, link| {
            let shared = Arc::clone(&shared);
            async move { serve_client(client, &link, shared, update).await }
        })
    }
}

fn paused() -> tokio::runtime::Runtime {
    tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build().unwrap()
}

#[test]
fn a_year_of_failures_leaves_nothing_behind() {
    let rig = TwoConnections::new(Duration::from_secs(300), Duration::from_secs(900));
    let year = run(rig, SEED, 365, FaultSchedule::Daily, &paused());
    eprintln!("{year:?}");
    assert!(year.duration >= Duration::from_secs(365 * 86_400));
    assert!(year.faults > 1200 && year.outages > 200 && year.reloads > 200, "{year:?}");
    assert!(year.quiet_points > 30_000 && year.dead_points > 500, "{year:?}");
    assert!(year.timed_samples > 100_000 && year.untimed_samples > 100_000, "{year:?}");
    assert!(year.shortest_gap.unwrap() >= Duration::from_secs(1), "{year:?}");
    // A task that is left behind holds some hundred bytes, a connection 128 KiB.
    assert!(year.heap_growth < 4096, "{year:?}");
    assert!(year.heap_peak < 4 << 20, "{year:?}");
}

#[test]
fn a_seed_gives_the_same_days_again() {
    let days = |seed| {
        let rig = TwoConnections::new(Duration::from_secs(300), Duration::from_secs(900));
        run(rig, seed, 5, FaultSchedule::Daily, &paused()).trace
    };
    assert_eq!(days(1), days(1));
    assert_ne!(days(1), days(2));
}

#[test]
fn sequence_numbers_begin_anew_on_a_connection_that_lasts() {
    let second = Duration::from_secs(1);
    let day = run(TwoConnections::new(second, second), SEED, 1, FaultSchedule::Empty, &paused());
    eprintln!("{day:?}");
    assert_eq!(day.dials, 2, "no connection was lost");
    // A request brings the ten tags but the counter; each look at least the sines.
    let requests = day.untimed_samples / 9;
    let looks = day.timed_samples / 10;
    assert!(requests > 2 * SEQUENCE_NUMBERS && looks > SEQUENCE_NUMBERS / 2, "{day:?}");
}
