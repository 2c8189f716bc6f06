//! Density of polylines (parallel coordinates): compute passes bin records along axes, count the
//! lines between bins, and rasterize the counts into a picture. Records stay on the device until
//! others come.
//!
//! Counting goes by slices of [`SLICE_RECORDS`] records, one at a time beside the frames;
//! what was counted before shows until the next is whole.

mod error;
mod input;
mod pipelines;

use busbar_gpu::{
    BindGroup, BindGroupLayout, Binding, Buffer, BufferUsage, Gpu, GpuError, GpuQueue, Recorder,
    Submission,
};
use busbar_shaders::{DENSITY_COLUMNS, DENSITY_ROWS};

pub use error::DensityError;
pub use input::{
    BrushedAxis, DensityCounts, DensityInput, DensityProgress, DensitySummary, MAX_DENSITY_AXES,
    MAX_DENSITY_BYTES,
};
use input::{SIDE, WORD, check, flips, gates, plan};
use pipelines::{CountTarget, DensityPipelines, RecordChunk};

/// Records that are uploaded and counted at once: with 32 values each 8 MiB, and some 25 ms of
/// a software rasteriser on two busy cores.
pub const SLICE_RECORDS: usize = 1 << 16;

/// GPU state of density counting: pipelines, uploaded records, the running and the last count.
pub struct DensityResources {
    pipelines: DensityPipelines,
    /// Revision of the values on the device.
    revision: Option<u64>,
    chunks: Vec<RecordChunk>,
    running: Option<RunningCount>,
    shown: Option<DensityPicture>,
}

/// Count that is under way, slice by slice.
struct RunningCount {
    arrangement: u64,
    /// Counts of all records, counts of brushed ones, and the mask.
    counts: [Buffer; 3],
    group: BindGroup,
    /// Records that were handed to the device.
    handed: usize,
    /// Submission of the slice before.
    submission: Submission,
    /// Once all were: the picture, and where its summary arrives.
    last: Option<(Buffer, Buffer)>,
}

/// Finished count with its density picture.
struct DensityPicture {
    summary: DensitySummary,
    counts: [Buffer; 3],
    picture: Buffer,
    group: BindGroup,
}

impl DensityResources {
    fn new(gpu: &Gpu) -> Result<Self, DensityError> {
        let pipelines = DensityPipelines::new(gpu)?;
        Ok(Self { pipelines, revision: None, chunks: Vec::new(), running: None, shown: None })
    }

    /// Returns the layout of the group that binds a density picture.
    pub fn picture_layout(&self) -> &BindGroupLayout {
        &self.pipelines.of_picture
    }

    /// Returns the last finished density picture, bound, and its summary.
    pub fn picture(&self) -> Option<(&BindGroup, &DensitySummary)> {
        self.shown.as_ref().map(|shown| (&shown.group, &shown.summary))
    }

    /// Hands the next slice to the device, if it is done with the one before; does not wait.
    fn step(
        &mut self,
        queue: &mut GpuQueue,
        input: &DensityInput<'_>,
    ) -> Result<DensityProgress, DensityError> {
        if self.revision != Some(input.revision) {
            (self.running, self.shown) = (None, None);
            self.chunks.clear();
            self.revision = Some(input.revision);
        }
        let of = input.values.len() / input.axes;
        let progress = |counted, shown: &Option<DensityPicture>| DensityProgress {
            counted,
            of,
            shown: shown.as_ref().map(|picture_shown| picture_shown.summary),
        };
        let is_wanted =
            |picture_shown: &DensityPicture| picture_shown.summary.arrangement == input.arrangement;
        if self.shown.as_ref().is_some_and(is_wanted) {
            self.running = None;
            return Ok(progress(of, &self.shown));
        }
        self.running.take_if(|running| running.arrangement != input.arrangement);
        let running = match &mut self.running {
            Some(running) => running,
            none => none.insert(begin(queue, &self.pipelines, input, of)?),
        };
        if !queue.has_finished(running.submission)? {
            return Ok(progress(running.handed, &self.shown));
        }
        if let Some((picture, summary)) = &running.last {
            let group = BindGroup::new(&self.pipelines.of_picture, &[Binding::Buffer(picture)])?;
            let [peak, brushed_peak, lines, brushed] = words(summary)?[..] else {
                return Err(GpuError::Misuse("a summary of another size").into());
            };
            let arrangement = input.arrangement;
            let pairs = input.pairs.len() as u32;
            let summary = DensitySummary { arrangement, pairs, peak, brushed_peak, lines, brushed };
            let (counts, picture) = (running.counts.clone(), picture.clone());
            self.shown = Some(DensityPicture { summary, counts, picture, group });
            self.running = None;
            return Ok(progress(of, &self.shown));
        }
        let mut recorder = queue.begin_transfer()?;
        hand_slice(&mut recorder, &self.pipelines, &mut self.chunks, running, input)?;
        if running.handed == of {
            running.last = Some(rasterize(&mut recorder, &self.pipelines, running, input)?);
        }
        running.submission = recorder.submit_tracked()?;
        Ok(progress(running.handed, &self.shown))
    }
}

fn begin(
    queue: &mut GpuQueue,
    pipelines: &DensityPipelines,
    input: &DensityInput<'_>,
    records: usize,
) -> Result<RunningCount, DensityError> {
    let mut recorder = queue.begin_transfer()?;
    let edges: Vec<f32> = input.binned_axes.iter().flat_map(|(_, edges)| *edges).collect();
    let zeros = vec![0u32; (input.pairs.len() * SIDE * SIDE).max(1)];
    let no_mask = vec![0u32; records.div_ceil(WORD).max(1)];
    let mut upload = |name, usage, bytes: &[u8]| recorder.upload_buffer(name, usage, bytes);
    let edges = upload("density edges", BufferUsage::Storage, bytemuck::cast_slice(&edges))?;
    let plan = plan(input);
    let plan = upload("density plan", BufferUsage::Storage, bytemuck::cast_slice(&plan))?;
    let mut written = |name, words: &[u32]| {
        upload(name, BufferUsage::ComputeReadback, bytemuck::cast_slice(words))
    };
    let counts = [
        written("density counts", &zeros)?,
        written("density brushed", &zeros)?,
        written("density mask", &no_mask)?,
    ];
    let [all, brushed, mask] = &counts;
    let bindings = [&edges, &plan, all, brushed, mask].map(Binding::Buffer);
    let group = BindGroup::new(&pipelines.of_counts, &bindings)?;
    let submission = recorder.submit_tracked()?;
    let arrangement = input.arrangement;
    Ok(RunningCount { arrangement, counts, group, handed: 0, submission, last: None })
}

/// Uploads the next slice, unless it is there, and counts it.
fn hand_slice(
    recorder: &mut Recorder<'_>,
    pipelines: &DensityPipelines,
    chunks: &mut Vec<RecordChunk>,
    running: &mut RunningCount,
    input: &DensityInput<'_>,
) -> Result<(), DensityError> {
    let first = running.handed;
    let end = (first + SLICE_RECORDS).min(input.values.len() / input.axes);
    if end == first {
        return Ok(());
    }
    let at = first / SLICE_RECORDS;
    if chunks.len() == at {
        chunks
            .push(pipelines.upload(recorder, &input.values[first * input.axes..end * input.axes])?);
    }
    let (gates, record_filter_words, brush_filter_words) = gates(input, first..end);
    let gates =
        recorder.upload_buffer("gates", BufferUsage::Storage, bytemuck::cast_slice(&gates))?;
    let gates = BindGroup::new(&pipelines.of_values, &[Binding::Buffer(&gates)])?;
    let counted = CountTarget {
        group: &running.group,
        gates: &gates,
        record_filter_words,
        brush_filter_words,
    };
    pipelines.count(recorder, &chunks[at], &counted, input, first..end)?;
    running.handed = end;
    Ok(())
}

/// Rasterizes the counts; returns the picture, and the buffer where its summary arrives.
fn rasterize(
    recorder: &mut Recorder<'_>,
    pipelines: &DensityPipelines,
    running: &RunningCount,
    input: &DensityInput<'_>,
) -> Result<(Buffer, Buffer), DensityError> {
    let cells = 2 * input.pairs.len() * (DENSITY_COLUMNS * DENSITY_ROWS) as usize;
    let mut upload = |name, usage, words: &[u32]| {
        recorder.upload_buffer(name, usage, bytemuck::cast_slice(words))
    };
    let picture = upload("density picture", BufferUsage::ComputeReadback, &vec![0; cells.max(1)])?;
    let summary = upload("density summary", BufferUsage::ComputeReadback, &[0; 4])?;
    let flips = upload("density flips", BufferUsage::Storage, &flips(input))?;
    let [all, brushed, _] = &running.counts;
    let bindings = [all, brushed, &flips, &picture, &summary].map(Binding::Buffer);
    pipelines.rasterize(recorder, &bindings, input.pairs.len() as u32)?;
    let summary = recorder.download_buffer(&summary)?;
    Ok((picture, summary))
}

fn words(download: &Buffer) -> Result<Vec<u32>, GpuError> {
    Ok(bytemuck::pod_collect_to_vec(&download.contents()?))
}

/// Advances the count that is under way; with `waits`, to its end.
///
/// # Errors
/// When values, axes and pairs do not fit each other, memory runs out, or the device is lost.
pub fn advance(
    queue: &mut GpuQueue,
    density: &mut Option<DensityResources>,
    input: &DensityInput<'_>,
    waits: bool,
) -> Result<DensityProgress, DensityError> {
    check(input)?;
    let density = match density {
        Some(density) => density,
        none => none.insert(DensityResources::new(queue.gpu())?),
    };
    loop {
        let progress = density.step(queue, input)?;
        let is_done = density.running.is_none();
        if is_done || !waits {
            return Ok(progress);
        }
        queue.wait()?;
    }
}

/// Counts anew, and waits for it.
///
/// # Errors
/// Returns the errors of [`advance`].
pub fn count(
    queue: &mut GpuQueue,
    density: &mut Option<DensityResources>,
    input: &DensityInput<'_>,
) -> Result<DensityCounts, DensityError> {
    if let Some(density) = density {
        (density.running, density.shown) = (None, None);
    }
    advance(queue, density, input, true)?;
    let picture_shown = density.as_ref().and_then(|density| density.shown.as_ref());
    let picture_shown =
        picture_shown.ok_or(GpuError::Misuse("a count that ended without a result"))?;
    let mut recorder = queue.begin_transfer()?;
    let downloads = picture_shown.counts.each_ref().map(|buffer| recorder.download_buffer(buffer));
    let picture = recorder.download_buffer(&picture_shown.picture)?;
    recorder.submit_and_wait()?;
    let [all, brushed, mask] = downloads.map(|download| words(&download?));
    let (mut all, mut brushed, mut mask, mut picture) = (all?, brushed?, mask?, words(&picture)?);
    let counts = input.pairs.len() * SIDE * SIDE;
    all.truncate(counts);
    brushed.truncate(counts);
    mask.truncate((input.values.len() / input.axes).div_ceil(WORD));
    picture.truncate(2 * input.pairs.len() * (DENSITY_COLUMNS * DENSITY_ROWS) as usize);
    Ok(DensityCounts { all, brushed, mask, picture, summary: picture_shown.summary })
}
