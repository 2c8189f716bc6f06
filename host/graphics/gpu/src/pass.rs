//! Render passes: attachments, draw calls, and their recording.

use std::ops::AddAssign;

use ash::vk;

use crate::draw_command::{COMMAND_BYTES, IndirectCommand};
use crate::image::ImageUse;
use crate::pass_splitting::PassSplitter;
use crate::{
    BindGroup, Buffer, BufferUsage, Format, GpuError, Image, ImageArea, Pipeline, Recorder,
};

/// Clear value of a colour target.
#[derive(Clone, Copy, Debug)]
pub enum ClearColor {
    /// Linear colour and alpha.
    Linear([f32; 4]),
    /// A number, for number formats.
    Integer(u32),
}

/// Attachments of a render pass, all of one size.
pub struct RenderTargets<'a> {
    /// Colour attachment that is drawn into.
    pub color: &'a Image,
    /// Gets the mean of the samples, if the colour has several.
    pub resolve: Option<&'a Image>,
    /// Depth, with as many samples as the colour.
    pub depth: &'a Image,
    /// Store operation of depth after the pass.
    pub depth_store: DepthStore<'a>,
    /// Load operation of colour and depth.
    pub load: LoadOp,
    /// Takes sRGB colours as bytes: shaders encode, and blending and resolving do not
    /// decode.
    pub undecoded: bool,
}

/// Load operation of a pass's attachments.
#[derive(Clone, Copy, Debug)]
pub enum LoadOp {
    /// Clears colour to a value, and depth to infinitely far.
    Clear(ClearColor),
    /// Keeps the contents of the last pass, whose depth was stored.
    Load,
}

/// Store operation of a pass's depth.
#[derive(Clone, Copy)]
pub enum DepthStore<'a> {
    /// Discards depth after the pass.
    Discard,
    /// Stores depth for later passes.
    Store,
    /// Resolves the first sample of each pixel into an image.
    ResolveFirstSample(&'a Image),
}

/// Viewport of clip space on the targets, in pixels; it may be larger than they are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewport {
    /// Upper left corner, pixels.
    pub origin: [f32; 2],
    /// Width and height, pixels.
    pub size: [f32; 2],
}

/// One indexed, instanced draw and all that it needs.
#[derive(Clone)]
pub struct DrawCall<'a> {
    /// Pipeline to draw with.
    pub pipeline: &'a Pipeline,
    /// The groups that the pipeline's layout asks for.
    pub groups: &'a [&'a BindGroup],
    /// Vertices: the pipeline's first vertex buffer.
    pub vertices: &'a Buffer,
    /// Bytes before the first vertex that shaders count from.
    pub vertex_offset: u64,
    /// Added to each index.
    pub first_vertex: u32,
    /// Instances: the pipeline's second vertex buffer.
    pub instances: &'a Buffer,
    /// Indices, 32 bits each.
    pub indices: &'a Buffer,
    /// Range of indices drawn.
    pub index_range: std::ops::Range<u32>,
    /// Range of instances drawn.
    pub instance_range: std::ops::Range<u32>,
    /// Leaves out faces seen from behind.
    pub cull_back: bool,
    /// The transform mirrors, so clockwise is the front.
    pub mirrored: bool,
}

/// A pass being recorded; it ends when dropped.
pub struct RenderPass<'r> {
    recorder: &'r Recorder<'r>,
    device: &'r ash::Device,
    commands: vk::CommandBuffer,
    format: Option<Format>,
    samples: u32,
    bound: BoundState,
    attachments: Attachments,
    /// Splitter of the pass, where the triangles of its parts are limited.
    splitter: Option<PassSplitter>,
}

/// Attachments of a pass as it was begun.
#[derive(Clone, Copy)]
struct Attachments {
    area: vk::Rect2D,
    color: Option<vk::RenderingAttachmentInfo<'static>>,
    depth: vk::RenderingAttachmentInfo<'static>,
}

/// Numbers of draws and of the commands for them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawCount {
    /// Draws that the device runs.
    pub draws: u32,
    /// Commands that ask for them.
    pub commands: u32,
}

impl DrawCount {
    /// A draw with a command of its own.
    pub const ONE: Self = Self { draws: 1, commands: 1 };
}

impl AddAssign for DrawCount {
    fn add_assign(&mut self, more: Self) {
        self.draws += more.draws;
        self.commands += more.commands;
    }
}

impl DrawCall<'_> {
    /// Reports whether another draw call uses the same pipeline, buffers, groups and raster state.
    fn shares_state_with(&self, other: &Self) -> bool {
        let state = |draw: &Self| {
            let buffers = [draw.vertices, draw.instances, draw.indices].map(Buffer::raw);
            let ways = (draw.vertex_offset, draw.cull_back, draw.mirrored);
            (draw.pipeline.raw, buffers, ways)
        };
        let groups = |draw: &Self| draw.groups.iter().map(|group| group.raw());
        state(self) == state(other) && groups(self).eq(groups(other))
    }

    fn indirect_command(&self) -> IndirectCommand {
        [
            self.index_range.len() as u32,
            self.instance_range.len() as u32,
            self.index_range.start,
            self.first_vertex,
            self.instance_range.start,
        ]
    }
}

/// Groups that a pipeline takes at most (Vulkan 1.3, limit of `maxBoundDescriptorSets`).
const MAX_GROUPS: usize = 4;

/// State that was bound last, so that it is not bound again.
#[derive(Default)]
struct BoundState {
    pipeline: vk::Pipeline,
    groups: [vk::DescriptorSet; MAX_GROUPS],
    vertices: ([vk::Buffer; 2], u64),
    indices: vk::Buffer,
    culling: Option<(bool, bool)>,
}

impl Recorder<'_> {
    /// Begins a render pass over all of the targets.
    ///
    /// # Errors
    /// When the targets do not fit together.
    pub fn pass(
        &mut self,
        targets: &RenderTargets<'_>,
        viewport: Viewport,
    ) -> Result<RenderPass<'_>, GpuError> {
        self.pass_in(targets, viewport, ImageArea::whole(targets.color))
    }

    /// Begins a pass over a part of the targets; beside it they stay as they are.
    ///
    /// # Errors
    /// When the targets do not fit together or have no such part.
    pub fn pass_in(
        &mut self,
        targets: &RenderTargets<'_>,
        viewport: Viewport,
        area: ImageArea,
    ) -> Result<RenderPass<'_>, GpuError> {
        let RenderTargets { color, resolve, depth, depth_store, load, undecoded } = targets;
        let fits = color.size() == depth.size()
            && color.samples() == depth.samples()
            && depth.format() == Format::Depth32
            && resolve.is_none_or(|r| {
                r.size() == color.size() && r.format() == color.format() && color.samples() > 1
            })
            && depth_store.fits(depth)
            && area.is_within(color.size());
        if !fits {
            return Err(GpuError::Misuse("targets that do not fit together"));
        }
        self.transition(color, ImageUse::ColorTarget);
        let viewed = |image: &Image| {
            if !undecoded {
                return Ok((image.view(), image.format()));
            }
            let fault = GpuError::Misuse("a target without colours in sRGB");
            image.undecoded_view().zip(image.format().undecoded()).ok_or(fault)
        };
        let (view, format) = viewed(color)?;
        let mut color_info =
            attachment(view, ImageUse::ColorTarget).store_op(vk::AttachmentStoreOp::STORE);
        if let Some(resolve) = resolve {
            self.transition(resolve, ImageUse::ColorTarget);
            color_info = color_info
                .store_op(vk::AttachmentStoreOp::DONT_CARE)
                .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                .resolve_image_view(viewed(resolve)?.0)
                .resolve_image_layout(ImageUse::ColorTarget.layout());
        }
        let mut depth_info = self.depth_attachment(depth, *depth_store);
        match load {
            LoadOp::Clear(clear) => color_info = color_info.clear_value(clear.vk()),
            LoadOp::Load => {
                color_info = color_info.load_op(vk::AttachmentLoadOp::LOAD);
                depth_info = depth_info.load_op(vk::AttachmentLoadOp::LOAD);
            }
        }
        Ok(self.begin_pass((color, area), Some((color_info, format)), depth_info, viewport))
    }

    /// Begins a pass that draws depth alone, anew and to be sampled afterwards.
    ///
    /// # Errors
    /// When the image holds no depth.
    pub fn depth_pass(&mut self, depth: &Image) -> Result<RenderPass<'_>, GpuError> {
        if depth.format() != Format::Depth32 {
            return Err(GpuError::Misuse("a depth pass without depth"));
        }
        let viewport =
            Viewport { origin: [0.0; 2], size: depth.size().map(|pixels| pixels as f32) };
        let info = self.depth_attachment(depth, DepthStore::Store);
        Ok(self.begin_pass((depth, ImageArea::whole(depth)), None, info, viewport))
    }

    fn depth_attachment(
        &mut self,
        depth: &Image,
        after: DepthStore<'_>,
    ) -> vk::RenderingAttachmentInfo<'static> {
        self.transition(depth, ImageUse::DepthTarget);
        // Reverse-Z: zero is infinitely far.
        let info = attachment(depth.view(), ImageUse::DepthTarget);
        match after {
            DepthStore::Discard => info.store_op(vk::AttachmentStoreOp::DONT_CARE),
            DepthStore::Store => info.store_op(vk::AttachmentStoreOp::STORE),
            DepthStore::ResolveFirstSample(image) => {
                self.transition(image, ImageUse::DepthResolve);
                info.store_op(vk::AttachmentStoreOp::DONT_CARE)
                    .resolve_mode(vk::ResolveModeFlags::SAMPLE_ZERO)
                    .resolve_image_view(image.view())
                    .resolve_image_layout(ImageUse::DepthResolve.layout())
            }
        }
    }

    /// Begins the rendering. `target` is any image of the pass; images are ready for their use.
    fn begin_pass(
        &mut self,
        (target, area): (&Image, ImageArea),
        color: Option<(vk::RenderingAttachmentInfo<'static>, Format)>,
        depth: vk::RenderingAttachmentInfo<'static>,
        viewport: Viewport,
    ) -> RenderPass<'_> {
        let area = area.to_rect();
        let format = color.map(|(_, format)| format);
        let attachments = Attachments { area, color: color.map(|(info, _)| info), depth };
        let splitter = self.queue.max_triangles_per_pass.map(PassSplitter::new);
        let begun = if splitter.is_some() { attachments.with_store() } else { attachments };
        let samples = target.samples();
        self.begin_label(target.name());
        let commands = self.commands();
        let device = &self.device().raw;
        let viewports = [vk::Viewport {
            x: viewport.origin[0],
            y: viewport.origin[1],
            width: viewport.size[0],
            height: viewport.size[1],
            min_depth: 0.0,
            max_depth: 1.0,
        }];
        begun.begin(device, commands);
        // SAFETY: the commands are being recorded.
        unsafe {
            device.cmd_set_viewport(commands, 0, &viewports);
            device.cmd_set_scissor(commands, 0, &[area]);
        }
        let recorder: &Recorder<'_> = self;
        let bound = BoundState::default();
        RenderPass { recorder, device, commands, format, samples, bound, attachments, splitter }
    }
}

impl Attachments {
    fn map(
        self,
        change: impl Fn(vk::RenderingAttachmentInfo<'static>) -> vk::RenderingAttachmentInfo<'static>,
    ) -> Self {
        Self { color: self.color.map(&change), depth: change(self.depth), ..self }
    }

    /// Returns the attachments of a part that another part follows: contents are stored, not
    /// resolved.
    fn with_store(self) -> Self {
        self.map(|info| {
            info.store_op(vk::AttachmentStoreOp::STORE).resolve_mode(vk::ResolveModeFlags::NONE)
        })
    }

    /// Returns the attachments of a later part: contents are loaded.
    fn with_load(self) -> Self {
        self.map(|info| info.load_op(vk::AttachmentLoadOp::LOAD))
    }

    fn has_resolve(&self) -> bool {
        let mut all = self.color.iter().chain([&self.depth]);
        all.any(|info| info.resolve_mode != vk::ResolveModeFlags::NONE)
    }

    fn begin(&self, device: &ash::Device, commands: vk::CommandBuffer) {
        let info = vk::RenderingInfo::default()
            .render_area(self.area)
            .layer_count(1)
            .color_attachments(self.color.as_slice())
            .depth_attachment(&self.depth);
        // SAFETY: the commands are being recorded, outside any pass; the
        // targets are in these layouts and live until the submission is done.
        unsafe { device.cmd_begin_rendering(commands, &info) };
    }
}

impl DepthStore<'_> {
    fn fits(self, depth: &Image) -> bool {
        match self {
            Self::Discard | Self::Store => true,
            Self::ResolveFirstSample(image) => {
                let is_alike = (image.size(), image.format()) == (depth.size(), depth.format());
                is_alike && image.samples() == 1 && depth.samples() > 1
            }
        }
    }
}

fn attachment(view: vk::ImageView, usage: ImageUse) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(view)
        .image_layout(usage.layout())
        .load_op(vk::AttachmentLoadOp::CLEAR)
}

impl ClearColor {
    fn vk(self) -> vk::ClearValue {
        let color = match self {
            Self::Linear(float32) => vk::ClearColorValue { float32 },
            Self::Integer(number) => vk::ClearColorValue { uint32: [number, 0, 0, 0] },
        };
        vk::ClearValue { color }
    }
}

impl RenderPass<'_> {
    /// Records one draw call.
    ///
    /// # Errors
    /// When the draw does not fit the pass, its pipeline or its buffers.
    pub fn draw(&mut self, draw: &DrawCall<'_>) -> Result<(), GpuError> {
        self.check_state(draw)?;
        check_ranges(draw)?;
        self.bind(draw);
        self.draw_indexed(draw.indirect_command());
        Ok(())
    }

    /// Draws all in order: those beside each other that are alike but for their ranges by
    /// one command, where the device can.
    ///
    /// # Errors
    /// Returns the errors of [`RenderPass::draw`].
    pub fn draw_all(&mut self, draws: &[DrawCall<'_>]) -> Result<DrawCount, GpuError> {
        let mut count = DrawCount::default();
        for alike in draws.chunk_by(DrawCall::shares_state_with) {
            self.check_state(&alike[0])?;
            alike.iter().try_for_each(check_ranges)?;
            self.bind(&alike[0]);
            count += self.draw_split(alike.iter().map(DrawCall::indirect_command).collect())?;
        }
        Ok(count)
    }

    /// Draws commands of one state, splitting the pass where it is full.
    fn draw_split(&mut self, mut calls: Vec<IndirectCommand>) -> Result<DrawCount, GpuError> {
        let Some(mut splitter) = self.splitter else { return self.draw_commands(&calls) };
        let mut count = DrawCount::default();
        calls.reverse();
        while !calls.is_empty() {
            if splitter.is_full() {
                self.split(self.attachments.with_load().with_store());
                splitter.restart();
            }
            count += self.draw_commands(&splitter.take_commands(&mut calls))?;
        }
        self.splitter = Some(splitter);
        Ok(count)
    }

    /// Flushes the render pass, then resumes it with its attachments preserved.
    fn split(&self, attachments: Attachments) {
        let uses = [ImageUse::ColorTarget, ImageUse::DepthTarget];
        let stages = uses[0].stages() | uses[1].stages();
        let access = uses[0].access() | uses[1].access();
        let barrier = vk::MemoryBarrier2::default()
            .src_stage_mask(stages)
            .src_access_mask(access)
            .dst_stage_mask(stages)
            .dst_access_mask(access);
        // SAFETY: the pass was begun in these commands and not ended yet.
        unsafe { self.device.cmd_end_rendering(self.commands) };
        self.recorder.barriers(&[], &[barrier]);
        attachments.begin(self.device, self.commands);
    }

    fn draw_commands(&self, calls: &[IndirectCommand]) -> Result<DrawCount, GpuError> {
        let (mut left, mut commands) = (calls, 0);
        if calls.len() > 1 && self.recorder.device().adapter.draws_indirectly {
            while !left.is_empty() {
                let Some((buffer, offset, count)) = self.recorder.write_indirect_commands(left)?
                else {
                    break;
                };
                // SAFETY: as in `call`; the buffer holds so many calls from there on, and is
                // not written again before the submission is done.
                unsafe {
                    self.device.cmd_draw_indexed_indirect(
                        self.commands,
                        buffer,
                        offset,
                        count as u32,
                        COMMAND_BYTES,
                    );
                }
                left = &left[count..];
                commands += 1;
            }
        }
        left.iter().for_each(|&call| self.draw_indexed(call));
        commands += left.len() as u32;
        Ok(DrawCount { draws: calls.len() as u32, commands })
    }

    fn draw_indexed(
        &self,
        [indices, instances, first_index, first_vertex, first_instance]: IndirectCommand,
    ) {
        // SAFETY: the commands are being recorded, inside this pass; all that
        // the pipeline needs is bound and checked; what shaders read beyond a
        // buffer is zero, by robust buffer access.
        unsafe {
            self.device.cmd_draw_indexed(
                self.commands,
                indices,
                instances,
                first_index,
                first_vertex.cast_signed(),
                first_instance,
            );
        }
    }

    fn check_state(&self, draw: &DrawCall<'_>) -> Result<(), GpuError> {
        let pipeline = draw.pipeline;
        let made_for = (pipeline.color, pipeline.samples, pipeline.screen);
        if made_for != (self.format, self.samples, false) {
            return Err(GpuError::Misuse("a pipeline made for other targets"));
        }
        if !pipeline.accepts_groups(draw.groups) || draw.groups.len() > MAX_GROUPS {
            return Err(GpuError::Misuse("bind groups made for another pipeline"));
        }
        if !matches!(draw.vertices.usage(), BufferUsage::Vertex | BufferUsage::ComputeVertex)
            || draw.instances.usage() != BufferUsage::HostVertex
            || !matches!(draw.indices.usage(), BufferUsage::Index | BufferUsage::HostIndex)
        {
            return Err(GpuError::Misuse(
                "buffers that hold no vertices, no instances or no indices",
            ));
        }
        Ok(())
    }

    fn bind(&mut self, draw: &DrawCall<'_>) {
        let (device, commands, bound) = (self.device, self.commands, &mut self.bound);
        let graphics = vk::PipelineBindPoint::GRAPHICS;
        // SAFETY: the commands are being recorded, inside this pass; all that is
        // bound belongs to this device and lives until the submission is done.
        unsafe {
            if bound.pipeline != draw.pipeline.raw {
                device.cmd_bind_pipeline(commands, graphics, draw.pipeline.raw);
                bound.pipeline = draw.pipeline.raw;
                bound.groups = Default::default();
            }
            let mut groups = [vk::DescriptorSet::null(); MAX_GROUPS];
            for (slot, group) in groups.iter_mut().zip(draw.groups) {
                *slot = group.raw();
            }
            if bound.groups != groups {
                let (layout, sets) = (draw.pipeline.layout, &groups[..draw.groups.len()]);
                device.cmd_bind_descriptor_sets(commands, graphics, layout, 0, sets, &[]);
                bound.groups = groups;
            }
            let vertices = [draw.vertices.raw(), draw.instances.raw()];
            if bound.vertices != (vertices, draw.vertex_offset) {
                bound.vertices = (vertices, draw.vertex_offset);
                let offsets = [draw.vertex_offset, 0];
                device.cmd_bind_vertex_buffers(commands, 0, &vertices, &offsets);
            }
            if bound.indices != draw.indices.raw() {
                bound.indices = draw.indices.raw();
                device.cmd_bind_index_buffer(commands, bound.indices, 0, vk::IndexType::UINT32);
            }
            let culling = (draw.cull_back, draw.mirrored);
            if bound.culling != Some(culling) {
                bound.culling = Some(culling);
                device.cmd_set_cull_mode(commands, cull_mode(draw.cull_back));
                device.cmd_set_front_face(commands, front_face(draw.mirrored));
            }
        }
    }
}

fn check_ranges(draw: &DrawCall<'_>) -> Result<(), GpuError> {
    if draw.vertex_offset >= draw.vertices.size() {
        return Err(GpuError::Misuse("a draw beyond its vertices"));
    }
    if u64::from(draw.index_range.end) * size_of::<u32>() as u64 > draw.indices.size() {
        return Err(GpuError::Misuse("a draw beyond its indices"));
    }
    Ok(())
}

fn cull_mode(cull_back: bool) -> vk::CullModeFlags {
    if cull_back { vk::CullModeFlags::BACK } else { vk::CullModeFlags::NONE }
}

fn front_face(mirrored: bool) -> vk::FrontFace {
    if mirrored { vk::FrontFace::CLOCKWISE } else { vk::FrontFace::COUNTER_CLOCKWISE }
}

impl Drop for RenderPass<'_> {
    fn drop(&mut self) {
        if self.splitter.is_some() && self.attachments.has_resolve() {
            // No round did.
            self.split(self.attachments.with_load());
        }
        // SAFETY: the pass was begun in these commands and not ended yet.
        unsafe { self.device.cmd_end_rendering(self.commands) };
        self.recorder.end_label();
    }
}
