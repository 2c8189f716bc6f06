//! Density of polylines: records go through bins of axes, and a compute pass counts how many
//! go from where to where. What there is of records stays on the device until others come.

use busbar_gpu::{
    BindGroup, BindGroupLayout, Binding, BindingKind, Buffer, BufferUsage, ComputeDescription,
    ComputePipeline, Dispatch, Gpu, GpuError, Recorder, ShaderStage,
};
use busbar_shaders::{DENSITY, DENSITY_BINS, DENSITY_GROUP, DensityStep};

use crate::RenderError;
use crate::layer::ready;

/// Values that one record may have.
pub const MAX_DENSITY_AXES: usize = 32;
/// Records that are counted together: with 32 values each, the 128 MiB that every device
/// lets a shader see.
const CHUNK_RECORDS: usize = 1 << 20;
/// Records of a mask word.
const WORD: usize = 32;

/// What is counted.
#[derive(Clone, Copy, Debug)]
pub struct DensityInput<'a> {
    /// Another one for other values: the same are not uploaded again.
    pub revision: u64,
    /// Values a record; at most [`MAX_DENSITY_AXES`].
    pub axes: usize,
    /// The values, record by record; NaN where there is none, no subnormals.
    pub values: &'a [f32],
    /// Axes that are binned: which they are, and the lower edges of their bins 1, 2 and so
    /// on, ascending.
    pub shown: &'a [(usize, [f32; DENSITY_BINS as usize - 1])],
    /// Pairs of those, by their places.
    pub pairs: &'a [[usize; 2]],
    /// Which records are meant; none where there is no brush.
    pub brushes: &'a [BrushedAxis<'a>],
    /// Whether meeting any of them is enough.
    pub any: bool,
}

/// A condition on the value of one axis.
#[derive(Clone, Copy, Debug)]
pub struct BrushedAxis<'a> {
    /// Which.
    pub axis: usize,
    /// The value lies in one of these, ends included.
    pub ranges: &'a [[f32; 2]],
    /// Whether records without a value are meant too.
    pub with_missing: bool,
}

/// What was counted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DensityCounts {
    /// For each pair, from each bin of the first to each of the second: 129 times 129 counts;
    /// the last bin is that of records without a value.
    pub all: Vec<u32>,
    /// Likewise of the records that are meant.
    pub meant: Vec<u32>,
    /// A bit a record: whether it is meant.
    pub mask: Vec<u32>,
}

/// What counts; made when it is first needed.
pub(crate) struct DensityKit {
    pipeline: ComputePipeline,
    of_values: BindGroupLayout,
    of_counts: BindGroupLayout,
    revision: Option<u64>,
    chunks: Vec<Chunk>,
}

/// Records that are counted together.
struct Chunk {
    group: BindGroup,
    records: usize,
}

/// Counts, and waits for it.
pub(crate) fn count(
    gpu: &mut Gpu,
    kit: &mut Option<DensityKit>,
    input: &DensityInput<'_>,
) -> Result<DensityCounts, RenderError> {
    check(input)?;
    let kit = ready(kit, || DensityKit::new(gpu))?;
    let mut recorder = gpu.begin_transfer()?;
    kit.upload(&mut recorder, input)?;
    let edges: Vec<f32> = input.shown.iter().flat_map(|(_, edges)| *edges).collect();
    let side = DENSITY_BINS as usize + 1;
    let zeros = vec![0u32; (input.pairs.len() * side * side).max(1)];
    let records: usize = kit.chunks.iter().map(|chunk| chunk.records).sum();
    let no_mask = vec![0u32; records.div_ceil(WORD).max(1)];
    let mut upload = |name, usage, bytes: &[u8]| recorder.upload_buffer(name, usage, bytes);
    let edges = upload("density edges", BufferUsage::Storage, bytemuck::cast_slice(&edges))?;
    let plan = plan(input);
    let plan = upload("density plan", BufferUsage::Storage, bytemuck::cast_slice(&plan))?;
    let mut written =
        |name, words: &[u32]| upload(name, BufferUsage::Counted, bytemuck::cast_slice(words));
    let counts = written("density counts", &zeros)?;
    let meant = written("density meant", &zeros)?;
    let mask = written("density mask", &no_mask)?;
    let bindings = [&edges, &plan, &counts, &meant, &mask].map(Binding::Buffer);
    let group = BindGroup::new(&kit.of_counts, &bindings)?;
    let mut pass = recorder.compute_pass("density");
    let mut first = 0;
    for chunk in &kit.chunks {
        let step = DensityStep {
            records: chunk.records as u32,
            axes: input.axes as u32,
            shown: input.shown.len() as u32,
            pairs: input.pairs.len() as u32,
            brushes: input.brushes.len() as u32,
            any: u32::from(input.any),
            first_word: (first / WORD) as u32,
        };
        pass.dispatch(&Dispatch {
            pipeline: &kit.pipeline,
            groups: &[&chunk.group, &group],
            constants: bytemuck::bytes_of(&step),
            workgroups: (chunk.records as u32).div_ceil(DENSITY_GROUP),
        })?;
        first += chunk.records;
    }
    drop(pass);
    let downloads = [&counts, &meant, &mask].map(|buffer| recorder.download_buffer(buffer));
    recorder.submit_and_wait()?;
    let [all, meant, mask] = downloads.map(|download| words(&download?));
    let (mut all, mut meant, mut mask) = (all?, meant?, mask?);
    let (counts, bits) = (input.pairs.len() * side * side, records.div_ceil(WORD));
    all.truncate(counts);
    meant.truncate(counts);
    mask.truncate(bits);
    Ok(DensityCounts { all, meant, mask })
}

fn words(download: &Buffer) -> Result<Vec<u32>, GpuError> {
    Ok(bytemuck::pod_collect_to_vec(&download.contents()?))
}

impl DensityKit {
    fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        use BindingKind::{Storage, Written};
        let of_values = BindGroupLayout::new(gpu, &[Storage])?;
        let of_counts = BindGroupLayout::new(gpu, &[Storage, Storage, Written, Written, Written])?;
        let pipeline = ComputePipeline::new(
            gpu,
            &ComputeDescription {
                name: "density",
                stage: ShaderStage { words: DENSITY, entry: c"count_main" },
                groups: &[&of_values, &of_counts],
                constant_bytes: size_of::<DensityStep>(),
            },
        )?;
        Ok(Self { pipeline, of_values, of_counts, revision: None, chunks: Vec::new() })
    }

    /// Brings values onto the device that are not there yet.
    fn upload(
        &mut self,
        recorder: &mut Recorder<'_>,
        input: &DensityInput<'_>,
    ) -> Result<(), RenderError> {
        if self.revision == Some(input.revision) {
            return Ok(());
        }
        self.revision = None;
        self.chunks.clear();
        for values in input.values.chunks(CHUNK_RECORDS * input.axes) {
            let bytes = bytemuck::cast_slice(values);
            let buffer = recorder.upload_buffer("density values", BufferUsage::Storage, bytes)?;
            let group = BindGroup::new(&self.of_values, &[Binding::Buffer(&buffer)])?;
            self.chunks.push(Chunk { group, records: values.len() / input.axes });
        }
        self.revision = Some(input.revision);
        Ok(())
    }
}

fn check(input: &DensityInput<'_>) -> Result<(), RenderError> {
    let DensityInput { axes, values, shown, pairs, brushes, .. } = *input;
    let (asked, limit) = (axes.max(shown.len()) as u64, MAX_DENSITY_AXES as u64);
    if asked > limit {
        return Err(RenderError::TooMany { what: "axes of records", asked, limit });
    }
    let names = shown.iter().map(|(axis, _)| *axis).chain(brushes.iter().map(|brush| brush.axis));
    let fits = axes > 0
        && values.len() % axes == 0
        && names.into_iter().all(|axis| axis < axes)
        && pairs.iter().flatten().all(|place| *place < shown.len());
    if fits { Ok(()) } else { Err(GpuError::Misuse("records that do not fit their axes").into()) }
}

/// What the shader reads beside edges.
fn plan(input: &DensityInput<'_>) -> Vec<u32> {
    let shown = input.shown.iter().map(|(axis, _)| *axis as u32);
    let pairs = input.pairs.iter().flatten().map(|place| *place as u32);
    let brushes = input.brushes.iter().flat_map(|brush| {
        let head = [brush.axis as u32, brush.ranges.len() as u32, u32::from(brush.with_missing)];
        head.into_iter().chain(brush.ranges.iter().flatten().map(|end| end.to_bits()))
    });
    let mut plan: Vec<u32> = shown.chain(pairs).chain(brushes).collect();
    if plan.is_empty() {
        plan.push(0);
    }
    plan
}
