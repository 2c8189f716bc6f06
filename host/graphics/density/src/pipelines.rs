//! Compute pipelines of density counting and of the density picture.

use std::ops::Range;

use busbar_gpu::{
    BindGroup, BindGroupLayout, Binding, BindingKind, BufferUsage, ComputeDescription,
    ComputePipeline, Dispatch, Gpu, Recorder, ShaderStage,
};
use busbar_shaders::{
    DENSITY, DENSITY_COLUMNS, DENSITY_GROUP, DENSITY_RASTERIZE, DensityStep, RasterizeStep,
};

use crate::DensityError;
use crate::input::{DensityInput, SIDE, WORD};

/// Compute pipelines and bind group layouts of density counting.
pub(crate) struct DensityPipelines {
    counter: ComputePipeline,
    rasterizer: ComputePipeline,
    /// Layout of values, and of gates.
    pub(crate) of_values: BindGroupLayout,
    pub(crate) of_counts: BindGroupLayout,
    of_rasterizing: BindGroupLayout,
    pub(crate) of_picture: BindGroupLayout,
}

/// Values of records that are counted together.
pub(crate) struct RecordChunk(BindGroup);

/// Target of a slice's counts, and the gates of its records.
pub(crate) struct CountTarget<'a> {
    pub(crate) group: &'a BindGroup,
    pub(crate) gates: &'a BindGroup,
    pub(crate) record_filter_words: u32,
    pub(crate) brush_filter_words: u32,
}

impl DensityPipelines {
    pub(crate) fn new(gpu: &Gpu) -> Result<Self, DensityError> {
        use BindingKind::{Storage, StorageWrite};
        let of_values = BindGroupLayout::new(gpu, &[Storage])?;
        let of_counts = BindGroupLayout::new(
            gpu,
            &[Storage, Storage, StorageWrite, StorageWrite, StorageWrite],
        )?;
        let of_rasterizing =
            BindGroupLayout::new(gpu, &[Storage, Storage, Storage, StorageWrite, StorageWrite])?;
        let pipeline = |name, words, entry, groups: &[_], constant_bytes| {
            let stage = ShaderStage { words, entry };
            ComputePipeline::new(gpu, &ComputeDescription { name, stage, groups, constant_bytes })
        };
        let groups = [&of_values, &of_counts, &of_values];
        let counter =
            pipeline("density", DENSITY, c"count_main", &groups, size_of::<DensityStep>())?;
        let bytes = size_of::<RasterizeStep>();
        let rasterizer = pipeline(
            "density rasterize",
            DENSITY_RASTERIZE,
            c"rasterize_main",
            &[&of_rasterizing],
            bytes,
        )?;
        let of_picture = BindGroupLayout::new(gpu, &[Storage])?;
        Ok(Self { counter, rasterizer, of_values, of_counts, of_rasterizing, of_picture })
    }

    pub(crate) fn upload(
        &self,
        recorder: &mut Recorder<'_>,
        values: &[f32],
    ) -> Result<RecordChunk, DensityError> {
        let bytes = bytemuck::cast_slice(values);
        let buffer = recorder.upload_buffer("density values", BufferUsage::Storage, bytes)?;
        Ok(RecordChunk(BindGroup::new(&self.of_values, &[Binding::Buffer(&buffer)])?))
    }

    pub(crate) fn count(
        &self,
        recorder: &mut Recorder<'_>,
        chunk: &RecordChunk,
        counted: &CountTarget<'_>,
        input: &DensityInput<'_>,
        records: Range<usize>,
    ) -> Result<(), DensityError> {
        let step = DensityStep {
            records: records.len() as u32,
            axes: input.axes as u32,
            binned_axes: input.binned_axes.len() as u32,
            pairs: input.pairs.len() as u32,
            brushes: input.brushes.len() as u32,
            any: u32::from(input.any),
            first_word: (records.start / WORD) as u32,
            record_filter_words: counted.record_filter_words,
            brush_filter_words: counted.brush_filter_words,
        };
        recorder.compute_pass("density").dispatch(&Dispatch {
            pipeline: &self.counter,
            groups: &[&chunk.0, counted.group, counted.gates],
            constants: bytemuck::bytes_of(&step),
            workgroups: step.records.div_ceil(DENSITY_GROUP),
        })?;
        Ok(())
    }

    pub(crate) fn rasterize(
        &self,
        recorder: &mut Recorder<'_>,
        bindings: &[Binding<'_>],
        pairs: u32,
    ) -> Result<(), DensityError> {
        let group = BindGroup::new(&self.of_rasterizing, bindings)?;
        let workgroups = (pairs * DENSITY_COLUMNS * SIDE as u32).div_ceil(DENSITY_GROUP).max(1);
        recorder.compute_pass("density rasterize").dispatch(&Dispatch {
            pipeline: &self.rasterizer,
            groups: &[&group],
            constants: bytemuck::bytes_of(&RasterizeStep { pairs }),
            workgroups,
        })?;
        Ok(())
    }
}
