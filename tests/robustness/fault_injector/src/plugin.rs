//! Well-behaved plugin with every capability, which injects faults where it is told to.

use std::collections::HashMap;
use std::time::Duration;

use busbar_plugin_sdk::export::{Capability, Descriptor, Exported};
use busbar_plugin_sdk::{
    Binding, Canvas, Collapse, CollapseList, Command, CommandExit, CommandInfo, Description,
    DoublePoint, Error, Host, Judgment, LinkState, Mesh, MeshOptimizer, Overlay, OverlayFrame,
    Plugin, Progress, RecordList, Sample, SampleSink, Severity, Simulation, SimulationStatus,
    Simulator, StopToken, Streams, TagSpec, TagValue, Telemetry, Value, ValueKind, Worker, export,
    text_value,
};

use crate::armed_fault::PLUGIN_ID;
use crate::data_sources;
use crate::fault::{CallSite, Fault, Misbehavior, set};
use crate::injection::inject;

/// Time between two batches.
pub const PUBLISH_PERIOD: Duration = Duration::from_millis(10);
/// Collapses between two reports of progress.
const REPORT_EVERY: usize = 1024;
/// Handle that no tag has.
const NO_TAG: u32 = u32::MAX - 7;

/// Settings of the plugin: a fault, or none.
#[derive(Debug, Default, serde::Deserialize, schemars::JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Misbehaviour in the call; none for no fault.
    kind: Option<Misbehavior>,
    /// Call site of the fault.
    at: Option<CallSite>,
    /// Number of calls there that succeed before.
    after_calls: u64,
}

/// Plugin that injects faults.
pub struct FaultInjector {
    host: Host,
    worker: Option<Worker>,
    bindings: Vec<Binding>,
    /// Equipment that bindings name, each with its bindings.
    equipment: Vec<(String, Vec<usize>)>,
    pub(crate) lists: Vec<RecordList>,
}

impl Plugin for FaultInjector {
    const ID: &'static str = PLUGIN_ID;
    const NAME: &'static str = "Fault injector";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const DESCRIPTION: &'static str = "Misbehaves as it is told to.";
    type Settings = Settings;

    fn create(settings: Settings, host: Host) -> Result<Self, Error> {
        let after_calls = settings.after_calls;
        match (settings.kind, settings.at) {
            (None, None) => set(None),
            (Some(kind), Some(at)) if kind.reaches(at) => {
                set(Some(Fault { kind, at, after_calls }));
            }
            (Some(kind), Some(at)) => {
                let text = format!("settings: {kind:?} cannot happen at {at:?}; choose another");
                return Err(Error::settings(text));
            }
            _ => return Err(Error::settings("settings: give `kind` and `at`, or neither")),
        }
        inject(CallSite::Create);
        Ok(Self {
            host,
            worker: None,
            bindings: Vec::new(),
            equipment: Vec::new(),
            lists: data_sources::lists(),
        })
    }
}

impl Drop for FaultInjector {
    fn drop(&mut self) {
        self.worker = None;
        inject(CallSite::Destroy);
    }
}

impl Telemetry for FaultInjector {
    fn check(&self, _tags: &[TagSpec]) -> Result<(), Error> {
        inject(CallSite::Check);
        Ok(())
    }

    fn start(&mut self, tags: Vec<TagSpec>, sink: SampleSink) -> Result<(), Error> {
        inject(CallSite::Start);
        let work = move |running: &StopToken| publish(&tags, &sink, running);
        self.worker = Some(Worker::start(&self.host, "fault_injector", work)?);
        Ok(())
    }

    fn stop(&mut self) {
        self.worker = None;
        inject(CallSite::Stop);
    }
}

/// Publishes a ramp of every tag until it is told to stop.
fn publish(tags: &[TagSpec], sink: &SampleSink, running: &StopToken) {
    for step in 0_u32.. {
        let kind = inject(CallSite::Publish);
        let mut batch: Vec<_> =
            tags.iter().map(|tag| Sample::good(tag.tag, value_of(tag.kind, step))).collect();
        for sample in &mut batch {
            match kind {
                Some(Misbehavior::NotFinite) => sample.value = Some(Value::F64(f64::NAN)),
                Some(Misbehavior::OutOfRange) => sample.tag = NO_TAG,
                _ => {}
            }
        }
        if !batch.is_empty() {
            sink.publish(&batch);
        }
        if step == 0 && !batch.is_empty() {
            sink.report_link(LinkState::Up, "a ramp");
        }
        let flood = kind == Some(Misbehavior::Flood);
        if !running.wait(if flood { Duration::ZERO } else { PUBLISH_PERIOD }) {
            return;
        }
    }
}

fn value_of(kind: ValueKind, step: u32) -> Value {
    match kind {
        ValueKind::F64 => Value::F64(f64::from(step)),
        ValueKind::I64 => Value::I64(i64::from(step)),
        ValueKind::Bool => Value::Bool(step % 2 == 1),
        ValueKind::DoublePoint => Value::DoublePoint(DoublePoint::from_bits(u64::from(step))),
        ValueKind::Text => text_value(&format!("Text {step}")).0,
    }
}

/// Simulated device that nobody can connect to.
impl Simulator for FaultInjector {
    fn start_simulation(&mut self, _simulation: Simulation) -> Result<(), Error> {
        inject(CallSite::Simulate);
        Ok(())
    }

    fn stop_simulation(&mut self) {
        inject(CallSite::StopSimulation);
    }

    fn simulation_status(&self) -> SimulationStatus {
        inject(CallSite::SimulationStatus);
        SimulationStatus { endpoint: "listens nowhere".into(), ..SimulationStatus::default() }
    }
}

/// Command that copies its input to its output.
impl Command for FaultInjector {
    const COMMANDS: &'static [CommandInfo] =
        &[CommandInfo { name: "inject-faults", help: "copy the input, and misbehave as told to" }];

    fn run(
        &self,
        _name: &str,
        _arguments: &[&str],
        streams: &Streams<'_>,
    ) -> Result<CommandExit, Error> {
        inject(CallSite::RunCommand);
        let copied = std::io::copy(&mut streams.input(), &mut streams.output());
        copied.map(|_| CommandExit::Done).map_err(|error| Error::failed(error.to_string()))
    }
}

impl Overlay for FaultInjector {
    fn describe(&self) -> Description {
        let equipment = self.equipment.iter().map(|(id, _)| id.clone()).collect();
        Description { equipment, ..Description::default() }
    }

    fn configure(&mut self, bindings: Vec<Binding>) -> Result<(), Error> {
        inject(CallSite::Configure);
        let mut places: HashMap<&str, usize> = HashMap::new();
        self.equipment.clear();
        for (index, binding) in bindings.iter().enumerate() {
            let place = *places.entry(&binding.node_id).or_insert(self.equipment.len());
            if place == self.equipment.len() {
                self.equipment.push((binding.node_id.clone(), Vec::new()));
            }
            self.equipment[place].1.push(index);
        }
        self.bindings = bindings;
        Ok(())
    }

    fn draw(&mut self, frame: &OverlayFrame<'_>, canvas: &mut Canvas<'_>) -> Result<(), Error> {
        inject(CallSite::Draw);
        let values: Vec<TagValue> = frame.values().collect();
        for (index, (binding, state)) in self.bindings.iter().zip(&values).enumerate() {
            let text = if state.value.is_some() { "a value" } else { "none" };
            canvas.line(index, binding.node, Severity::Normal, &binding.tag_name, text)?;
        }
        for (equipment, (_, own)) in self.equipment.iter().enumerate() {
            let is_good = |index: &usize| values.get(*index).is_some_and(|v| v.quality.is_good());
            let basis = canvas.basis(own.iter().copied())?;
            let judgment = match own.iter().all(is_good) {
                true => Judgment::NORMAL.assuming("every value is normal"),
                false => Judgment::unknown("a value is not good"),
            };
            canvas.judge(equipment, basis, &judgment)?;
        }
        Ok(())
    }
}

impl MeshOptimizer for FaultInjector {
    /// Collapses the shortest edges first, as far as both ends are live.
    fn optimize(&self, mesh: Mesh<'_>, progress: &mut Progress<'_>) -> Result<CollapseList, Error> {
        progress.report(0.0)?;
        inject(CallSite::Optimize);
        let mut lengths = HashMap::new();
        for &[a, b, c] in mesh.triangles {
            for (a, b) in [(a, b), (b, c), (c, a)] {
                let [p, q] = [a, b].map(|index| mesh.positions[index as usize]);
                let squared: f64 =
                    (0..3).map(|i| (f64::from(p[i]) - f64::from(q[i])).powi(2)).sum();
                lengths.insert((a.min(b), a.max(b)), squared.sqrt() as f32);
            }
        }
        let mut edges: Vec<_> = lengths.into_iter().collect();
        edges.sort_by(|(a, x), (b, y)| x.total_cmp(y).then(a.cmp(b)));
        let mut removed = vec![false; mesh.positions.len()];
        let mut list = CollapseList::default();
        let count = edges.len().max(1) as f32;
        for (index, ((kept, from), error)) in edges.into_iter().enumerate() {
            if index % REPORT_EVERY == 0 {
                progress.report(index as f32 / count)?;
            }
            if !removed[kept as usize] && !removed[from as usize] {
                removed[from as usize] = true;
                list.collapses.push(Collapse { removed: from, kept, error });
            }
        }
        Ok(list)
    }
}

// What `export_plugin!` would write, but for the entry, which is `tables`' own.
impl Exported for FaultInjector {
    const CAPABILITIES: &'static [Capability] = &[
        export::telemetry::<Self>(),
        export::overlay::<Self>(),
        export::mesh_optimizer::<Self>(),
        export::simulator::<Self>(),
        export::command::<Self>(),
        export::chart::<Self>(),
        export::records::<Self>(),
        export::alarms::<Self>(),
        export::notify::<Self>(),
    ];

    fn descriptor() -> &'static Descriptor {
        static DESCRIPTOR: std::sync::OnceLock<Descriptor> = std::sync::OnceLock::new();
        DESCRIPTOR.get_or_init(export::describe::<Self>)
    }
}
