//! Geomorphing: meshes between two cursors, so that a change of detail does not pop.
//!
//! The finer mesh is drawn with vertices that go straight to those that stand for them at
//! the coarser cursor. A compute pass puts them there once a frame, for all passes that
//! draw the mesh and all instances that are on the same way equally far.

use std::collections::HashMap;

use busbar_gpu::{
    BindGroup, BindGroupLayout, Binding, BindingKind, Buffer, BufferUsage, ComputeDescription,
    ComputePipeline, Dispatch, Gpu, GpuError, Recorder, ShaderStage,
};
use busbar_shaders::{MORPH, MORPH_GROUP, MorphStep, Vertex};

use crate::RenderError;
use crate::batch::{Batch, IndexKey, MorphKey};
use crate::instance_culling::VisibleInstances;
use crate::layer::get_or_create;
use crate::model::{GpuMesh, GpuModel};

/// Bytes of vertices between two cursors that one frame may show. A storage buffer may
/// be twice as large on every device (Vulkan 1.3, `maxStorageBufferRange`).
pub const MAX_MORPHED_BYTES: u64 = 64 << 20;

/// Bytes that a vertex takes.
pub const VERTEX_BYTES: u64 = size_of::<Vertex>() as u64;

/// Bytes of morph targets kept beyond the needs of the current frame.
const MAX_REPRESENTATIVE_BYTES: u64 = 64 << 20;

/// The vertices that stand for others at a cursor, on the device.
struct MorphTarget {
    /// The mesh's vertices, and for each the one that stands for it.
    group: BindGroup,
    bytes: u64,
    used_at: u64,
}

/// Compute pipeline that moves vertices, made on first use.
struct MorphPipeline {
    compute: ComputePipeline,
    representatives: BindGroupLayout,
    written: BindGroupLayout,
}

/// Output buffer of moved vertices.
struct MorphedVertices {
    buffer: Buffer,
    group: BindGroup,
}

/// Morphs vertices between two cursors.
#[derive(Default)]
pub(crate) struct Morpher {
    pipeline: Option<MorphPipeline>,
    moved: Option<MorphedVertices>,
    representatives: HashMap<IndexKey, MorphTarget>,
    representative_bytes: u64,
    /// Byte offset of the moved vertices, by mesh and morph.
    offsets: HashMap<(IndexKey, MorphKey), u64>,
    /// Counter of the prepared plans.
    clock: u64,
}

/// One compute dispatch of the morph.
struct MorphDispatch<'a> {
    mesh: &'a GpuMesh,
    key: IndexKey,
    morph: MorphKey,
    count: u32,
    /// Vertices before its first.
    start: u32,
}

impl MorphDispatch<'_> {
    /// Returns the key of the coarser mesh.
    fn coarser(&self) -> IndexKey {
        IndexKey { cursor: self.morph.coarser, ..self.key }
    }
}

impl Morpher {
    /// Reports whether the morph target of a cursor is on the device.
    pub(crate) fn is_ready(&self, coarser: IndexKey) -> bool {
        self.representatives.contains_key(&coarser)
    }

    /// Uploads the representative of each vertex of a mesh at a cursor.
    pub(crate) fn insert(
        &mut self,
        recorder: &mut Recorder<'_>,
        models: &[Option<GpuModel>],
        coarser: IndexKey,
        representatives: &[u32],
    ) -> Result<(), RenderError> {
        let mesh = models[coarser.model as usize].as_ref().map(|model| &model.meshes);
        let Some(vertices) = mesh.and_then(|of| of[coarser.mesh as usize].vertices.as_ref()) else {
            return Ok(());
        };
        let bytes: &[u8] = bytemuck::cast_slice(representatives);
        let pipeline = get_or_create(&mut self.pipeline, || MorphPipeline::new(recorder.gpu()))?;
        let buffer =
            recorder.upload_buffer("representative vertices", BufferUsage::Storage, bytes)?;
        let group = BindGroup::new(
            &pipeline.representatives,
            &[Binding::BufferSlice(vertices), Binding::Buffer(&buffer)],
        )?;
        let bytes = bytes.len() as u64;
        let entry = MorphTarget { group, bytes, used_at: self.clock };
        self.representative_bytes += bytes;
        if let Some(replaced) = self.representatives.insert(coarser, entry) {
            self.representative_bytes -= replaced.bytes;
        }
        Ok(())
    }

    /// Moves the vertices of all morphing batches.
    pub(crate) fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        models: &[Option<GpuModel>],
        plan: &VisibleInstances,
    ) -> Result<(), RenderError> {
        self.clock += 1;
        self.offsets.clear();
        let steps = self.steps(models, plan)?;
        let Some(last) = steps.last() else {
            return Ok(());
        };
        let vertices = u64::from(last.start + last.count);
        for step in &steps {
            let coarser = step.coarser();
            if !self.is_ready(coarser) {
                let representatives = step.mesh.stacks.representative_wedges(coarser.cursor);
                self.insert(recorder, models, coarser, &representatives)?;
            }
        }
        let pipeline = get_or_create(&mut self.pipeline, || MorphPipeline::new(recorder.gpu()))?;
        let is_large_enough =
            |moved: &MorphedVertices| moved.buffer.size() >= vertices * VERTEX_BYTES;
        if !self.moved.as_ref().is_some_and(is_large_enough) {
            let bytes = (vertices * VERTEX_BYTES).next_power_of_two().min(MAX_MORPHED_BYTES);
            self.moved = Some(MorphedVertices::new(recorder.gpu(), pipeline, bytes)?);
        }
        let Some(moved) = &self.moved else { return Ok(()) };
        let mut pass = recorder.compute_pass("morph");
        for step in &steps {
            let Some(representatives) = self.representatives.get_mut(&step.coarser()) else {
                continue;
            };
            representatives.used_at = self.clock;
            let constants = MorphStep {
                vertices: step.count,
                start: step.start,
                weight: f32::from_bits(step.morph.weight),
            };
            pass.dispatch(&Dispatch {
                pipeline: &pipeline.compute,
                groups: &[&representatives.group, &moved.group],
                constants: bytemuck::bytes_of(&constants),
                workgroups: step.count.div_ceil(MORPH_GROUP),
            })?;
        }
        drop(pass);
        self.evict();
        Ok(())
    }

    /// Lists the morphs, each once, with their places in the output.
    fn steps<'a>(
        &mut self,
        models: &'a [Option<GpuModel>],
        plan: &VisibleInstances,
    ) -> Result<Vec<MorphDispatch<'a>>, RenderError> {
        let mut steps = Vec::new();
        let mut vertices = 0;
        for batch in plan.seen() {
            let (Some(morph), Some(model)) = (batch.morph, &models[batch.key.model as usize])
            else {
                continue;
            };
            let mesh = &model.meshes[batch.key.mesh as usize];
            let count = mesh.stacks.mesh().wedges.position.len() as u64;
            let known = self.offsets.contains_key(&(batch.key, morph));
            if known || mesh.vertices.is_none() {
                continue;
            }
            self.offsets.insert((batch.key, morph), vertices * VERTEX_BYTES);
            let start = vertices as u32;
            vertices += count;
            let (asked, limit) = (vertices * VERTEX_BYTES, MAX_MORPHED_BYTES);
            if asked > limit {
                let what = "bytes of vertices on their morph in one frame";
                return Err(RenderError::TooMany { what, asked, limit });
            }
            steps.push(MorphDispatch { mesh, key: batch.key, morph, count: count as u32, start });
        }
        Ok(steps)
    }

    /// Returns the moved vertices of a batch and their byte offset, if it morphs.
    pub(crate) fn vertices_of(&self, batch: &Batch) -> Option<(&Buffer, u64)> {
        let offset = *self.offsets.get(&(batch.key, batch.morph?))?;
        Some((&self.moved.as_ref()?.buffer, offset))
    }

    /// Drops the least recently used targets, down to the limit, but none of this frame.
    fn evict(&mut self) {
        if self.representative_bytes <= MAX_REPRESENTATIVE_BYTES {
            return;
        }
        let idle = self.representatives.iter().filter(|(_, entry)| entry.used_at < self.clock);
        let mut idle: Vec<_> = idle.map(|(key, entry)| (entry.used_at, *key)).collect();
        idle.sort_unstable();
        for (_, key) in idle {
            if self.representative_bytes <= MAX_REPRESENTATIVE_BYTES {
                break;
            }
            if let Some(entry) = self.representatives.remove(&key) {
                self.representative_bytes -= entry.bytes;
            }
        }
    }

    pub(crate) fn remove_where(&mut self, unwanted: impl Fn(&IndexKey) -> bool) {
        self.representatives.retain(|key, _| !unwanted(key));
        self.representative_bytes = self.representatives.values().map(|entry| entry.bytes).sum();
    }

    /// Drops all targets; a frame makes those it needs again.
    pub(crate) fn drop_all(&mut self) {
        self.remove_where(|_| true);
        self.offsets.clear();
        self.moved = None;
    }
}

impl MorphPipeline {
    fn new(gpu: &Gpu) -> Result<Self, GpuError> {
        let representatives =
            BindGroupLayout::new(gpu, &[BindingKind::Storage, BindingKind::Storage])?;
        let written = BindGroupLayout::new(gpu, &[BindingKind::StorageWrite])?;
        let description = ComputeDescription {
            name: "morph",
            stage: ShaderStage { words: MORPH, entry: c"morph_main" },
            groups: &[&representatives, &written],
            constant_bytes: size_of::<MorphStep>(),
        };
        Ok(Self { compute: ComputePipeline::new(gpu, &description)?, representatives, written })
    }
}

impl MorphedVertices {
    fn new(gpu: &Gpu, pipeline: &MorphPipeline, bytes: u64) -> Result<Self, GpuError> {
        let buffer =
            Buffer::new(gpu, "vertices on their morph", BufferUsage::ComputeVertex, bytes)?;
        let group = BindGroup::new(&pipeline.written, &[Binding::Buffer(&buffer)])?;
        Ok(Self { buffer, group })
    }
}
