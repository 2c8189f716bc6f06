//! Draw reduction on software rasterizers, where the processor pays for each triangle that is drawn.
//!
//! Large faces hide instances ([`large_faces`]); the nearest instances are drawn first and hide the
//! others by their depth ([`two_pass_occlusion`]); the triangles left are culled and batched by the
//! processor ([`triangle_culling`]).

mod first_pass_depth;
mod large_faces;
mod mesh_data;
mod occlusion_test;
mod triangle_culling;
mod two_pass_occlusion;

use std::cell::Cell;
use std::num::NonZeroU32;
use std::time::Instant;

use busbar_geometry::Bounds;
use busbar_gpu::{Buffer, DrawCall, Image, MAX_FRAMES_IN_FLIGHT, Recorder};
use busbar_shaders::Instance;
use glam::Vec3;

use self::first_pass_depth::FirstPassDepth;
use self::large_faces::OcclusionBuffer;
use self::mesh_data::SoftwareMesh;
use self::occlusion_test::OcclusionTest;
use self::triangle_culling::{TriangleCuller, is_culled, reserve};
use crate::batch::DrawPhase;
use crate::draw_reduction::{DrawReduction, DrawnScene, ReducedView};
use crate::index_cache::IndexCache;
use crate::instance_culling::VisibleInstances;
use crate::mesh_preparation::MeshPreparation;
use crate::model::GpuModel;
use crate::section_draw::SectionDraw;
use crate::{CameraView, RenderError};

/// Triangles between two ends of a pass for each core that draws. Until a pass ends, llvmpipe bins
/// some 200 bytes of each triangle that faces the eye: less than a megabyte, where half of them do.
/// Bins that outgrow the processor's cache wait for memory.
const TRIANGLES_PER_CORE: u32 = 8192;

/// Draw reduction on software rasterizers.
#[derive(Default)]
pub(crate) struct SoftwareReduction {
    large_faces: OcclusionBuffer,
    first_pass_depth: FirstPassDepth,
    /// Index buffers of CPU triangle culling, by frame in flight, made on first use.
    culled_indices: [Option<Buffer>; MAX_FRAMES_IN_FLIGHT],
    camera: Option<CameraView>,
    /// Size of the picture in pixels.
    size: [u32; 2],
    /// Two-pass occlusion culling: whether this frame may use it.
    allows_two_passes: bool,
    phase: Phase,
}

/// Phase of a frame that is drawn.
#[derive(Default)]
struct Phase {
    /// Number of the frame in flight.
    slot: usize,
    /// Depth of the first phase: whether it is there to test against.
    has_depth: bool,
    /// Triangles that were written to the index buffer.
    taken: Cell<u32>,
}

impl SoftwareReduction {
    /// Returns the occlusion test of the phase: the first phase's depth, or large faces.
    fn occlusion_test(&self) -> Option<OcclusionTest<'_>> {
        if self.phase.has_depth {
            return Some(OcclusionTest::FirstPassDepth(&self.first_pass_depth.tiles));
        }
        self.large_faces.non_empty().map(OcclusionTest::LargeFaces)
    }

    /// Returns the one point that all is seen from; `None` for orthographic cameras.
    fn eye(&self) -> Option<Vec3> {
        self.camera.filter(|camera| !camera.is_orthographic()).map(|camera| camera.eye)
    }
}

impl DrawReduction for SoftwareReduction {
    fn mesh_preparation(&self) -> MeshPreparation {
        SoftwareMesh::PREPARATION
    }

    fn max_triangles_per_pass(&self) -> Option<NonZeroU32> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let cores = u32::try_from(cores).unwrap_or(u32::MAX);
        NonZeroU32::new(TRIANGLES_PER_CORE.saturating_mul(cores))
    }

    /// Rasterizes large faces, unless surfaces are see-through. Without perspective distances do
    /// not decide.
    fn begin_frame(&mut self, scene: DrawnScene<'_>, view: ReducedView<'_>) {
        let ReducedView { camera, size, samples, is_seen_through } = view;
        let culls_occluded = !is_seen_through && !camera.is_orthographic();
        self.camera = Some(*camera);
        self.size = size;
        self.allows_two_passes = culls_occluded && samples == 1;
        let picture = (size, samples);
        self.large_faces.rasterize_faces(scene, culls_occluded.then_some(camera), picture);
    }

    fn has_occluders(&self) -> bool {
        self.large_faces.non_empty().is_some()
    }

    fn is_occluded(&self, instance: &Instance, bounds: &Bounds) -> bool {
        self.large_faces.is_occluded(instance, bounds)
    }

    fn assign_phases(&self, scene: DrawnScene<'_>, plan: &mut VisibleInstances) {
        if let Some(eye) = self.eye().filter(|_| self.allows_two_passes) {
            plan.sort_near_first((scene.models, scene.cache), eye);
        }
    }

    fn begin_phase(
        &mut self,
        recorder: &Recorder<'_>,
        cache: &IndexCache,
        (plan, phase): (&VisibleInstances, DrawPhase),
    ) -> Result<(), RenderError> {
        let has_depth = phase == DrawPhase::Second && plan.has_first_phase;
        self.phase = Phase { slot: recorder.slot(), has_depth, taken: Cell::new(0) };
        let occlusion_test = self.occlusion_test();
        let culled = plan.visible_in(phase).filter_map(|batch| {
            let faces = cache.get(batch.key)?.data::<SoftwareMesh>()?.faces.as_ref()?;
            let instances = batch.instances.len() as u32;
            let batch = (instances, batch.morph.is_some());
            is_culled(faces, batch, occlusion_test).then(|| faces.count_of(instances))
        });
        let triangles = culled.sum();
        reserve(&mut self.culled_indices[recorder.slot()], recorder.gpu(), triangles)
    }

    fn reduce<'s>(
        &'s self,
        instances: &[Instance],
        sections: &[&'s SectionDraw<'s>],
    ) -> Result<Vec<DrawCall<'s>>, RenderError> {
        let Phase { slot, taken, .. } = &self.phase;
        let Some(buffer) = &self.culled_indices[*slot] else {
            return Ok(sections.iter().map(|section| section.call()).collect());
        };
        let (eye, occlusion_test) = (self.eye(), self.occlusion_test());
        TriangleCuller { buffer, eye, occlusion_test, taken }.draws(instances, sections)
    }

    fn end_first_phase(
        &mut self,
        recorder: &mut Recorder<'_>,
        depth: &Image,
        models: &[Option<GpuModel>],
        plan: &mut VisibleInstances,
    ) -> Result<[Instant; 2], RenderError> {
        if let Some(camera) = &self.camera {
            self.first_pass_depth.begin(camera, self.size);
        }
        plan.add_occlusion_queries(models, &mut self.first_pass_depth.tiles);
        self.first_pass_depth.record(recorder, depth)?;
        recorder.end_stage("near");
        let handed = Instant::now();
        recorder.flush()?;
        let there = Instant::now();
        self.first_pass_depth.read_back()?;
        plan.remove_occluded(models, &self.first_pass_depth.tiles);
        Ok([handed, there])
    }
}
