//! Pipelines that count and lay out.

use std::ops::Range;

use busbar_gpu::{
    BindGroup, BindGroupLayout, Binding, BindingKind, BufferUsage, ComputeDescription,
    ComputePipeline, Dispatch, Gpu, Recorder, ShaderStage,
};
use busbar_shaders::{
    DENSITY, DENSITY_COLUMNS, DENSITY_GROUP, DENSITY_WEAVE, DensityStep, WeaveStep,
};

use super::WORD;
use super::input::{DensityInput, SIDE};
use crate::RenderError;

/// Pipelines and layouts.
pub(super) struct Kit {
    counter: ComputePipeline,
    weaver: ComputePipeline,
    /// Of values, and of gates.
    pub(super) of_values: BindGroupLayout,
    pub(super) of_counts: BindGroupLayout,
    of_weaving: BindGroupLayout,
    pub(super) of_picture: BindGroupLayout,
}

/// Values of records that are counted together.
pub(super) struct Chunk(BindGroup);

/// What a slice is counted into, and which of its records are.
pub(super) struct OfCounts<'a> {
    pub(super) group: &'a BindGroup,
    pub(super) gates: &'a BindGroup,
    pub(super) known_words: u32,
    pub(super) given_words: u32,
}

impl Kit {
    pub(super) fn new(gpu: &Gpu) -> Result<Self, RenderError> {
        use BindingKind::{Storage, Written};
        let of_values = BindGroupLayout::new(gpu, &[Storage])?;
        let of_counts = BindGroupLayout::new(gpu, &[Storage, Storage, Written, Written, Written])?;
        let of_weaving = BindGroupLayout::new(gpu, &[Storage, Storage, Storage, Written, Written])?;
        let pipeline = |name, words, entry, groups: &[_], constant_bytes| {
            let stage = ShaderStage { words, entry };
            ComputePipeline::new(gpu, &ComputeDescription { name, stage, groups, constant_bytes })
        };
        let groups = [&of_values, &of_counts, &of_values];
        let counter =
            pipeline("density", DENSITY, c"count_main", &groups, size_of::<DensityStep>())?;
        let bytes = size_of::<WeaveStep>();
        let weaver =
            pipeline("density weave", DENSITY_WEAVE, c"weave_main", &[&of_weaving], bytes)?;
        let of_picture = BindGroupLayout::new(gpu, &[Storage])?;
        Ok(Self { counter, weaver, of_values, of_counts, of_weaving, of_picture })
    }

    pub(super) fn upload(
        &self,
        recorder: &mut Recorder<'_>,
        values: &[f32],
    ) -> Result<Chunk, RenderError> {
        let bytes = bytemuck::cast_slice(values);
        let buffer = recorder.upload_buffer("density values", BufferUsage::Storage, bytes)?;
        Ok(Chunk(BindGroup::new(&self.of_values, &[Binding::Buffer(&buffer)])?))
    }

    pub(super) fn count(
        &self,
        recorder: &mut Recorder<'_>,
        chunk: &Chunk,
        counted: &OfCounts<'_>,
        input: &DensityInput<'_>,
        records: Range<usize>,
    ) -> Result<(), RenderError> {
        let step = DensityStep {
            records: records.len() as u32,
            axes: input.axes as u32,
            shown: input.shown.len() as u32,
            pairs: input.pairs.len() as u32,
            brushes: input.brushes.len() as u32,
            any: u32::from(input.any),
            first_word: (records.start / WORD) as u32,
            known_words: counted.known_words,
            given_words: counted.given_words,
        };
        recorder.compute_pass("density").dispatch(&Dispatch {
            pipeline: &self.counter,
            groups: &[&chunk.0, counted.group, counted.gates],
            constants: bytemuck::bytes_of(&step),
            workgroups: step.records.div_ceil(DENSITY_GROUP),
        })?;
        Ok(())
    }

    pub(super) fn weave(
        &self,
        recorder: &mut Recorder<'_>,
        bindings: &[Binding<'_>],
        pairs: u32,
    ) -> Result<(), RenderError> {
        let group = BindGroup::new(&self.of_weaving, bindings)?;
        let workgroups = (pairs * DENSITY_COLUMNS * SIDE as u32).div_ceil(DENSITY_GROUP).max(1);
        recorder.compute_pass("density weave").dispatch(&Dispatch {
            pipeline: &self.weaver,
            groups: &[&group],
            constants: bytemuck::bytes_of(&WeaveStep { pairs }),
            workgroups,
        })?;
        Ok(())
    }
}
