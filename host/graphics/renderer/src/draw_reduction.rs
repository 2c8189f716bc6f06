//! Draw reduction: what a frame leaves out of its draws beyond frustum culling.
//!
//! A graphics card draws faster than a processor sorts: there nothing is left out. Where the
//! processor draws, `software` does what pays.

use std::num::NonZeroU32;
use std::time::Instant;

use busbar_geometry::Bounds;
use busbar_gpu::{DrawCall, Image, Recorder};
use busbar_shaders::Instance;

use crate::batch::DrawPhase;
use crate::index_cache::IndexCache;
use crate::instance_buckets::InstanceBuckets;
use crate::instance_culling::VisibleInstances;
use crate::mesh_preparation::MeshPreparation;
use crate::model::GpuModel;
use crate::section_draw::SectionDraw;
use crate::{CameraView, RenderError};

/// Models, resolved triangles and sorted instances of a frame.
#[derive(Clone, Copy)]
pub(crate) struct DrawnScene<'a> {
    pub(crate) models: &'a [Option<GpuModel>],
    pub(crate) cache: &'a IndexCache,
    pub(crate) buckets: &'a InstanceBuckets,
}

/// View of a frame, as it decides what may be left out.
#[derive(Clone, Copy)]
pub(crate) struct ReducedView<'a> {
    pub(crate) camera: &'a CameraView,
    /// Size of the picture in pixels.
    pub(crate) size: [u32; 2],
    /// Samples a pixel, 1 or 4.
    pub(crate) samples: u32,
    /// See-through surfaces, as of sections and wireframes: nothing is occluded.
    pub(crate) is_seen_through: bool,
}

/// Reduction of the draws of frames. Its defaults leave nothing out.
pub(crate) trait DrawReduction: Send {
    /// Returns the preparation of resolved meshes.
    fn mesh_preparation(&self) -> MeshPreparation {
        MeshPreparation::NONE
    }

    /// Returns the triangles between two ends of a render pass; `None` draws each pass in one.
    fn max_triangles_per_pass(&self) -> Option<NonZeroU32> {
        None
    }

    /// Begins a frame, once its instances are sorted.
    fn begin_frame(&mut self, _scene: DrawnScene<'_>, _view: ReducedView<'_>) {}

    /// Reports whether [`DrawReduction::is_occluded`] may hold for any instance of this frame.
    fn has_occluders(&self) -> bool {
        false
    }

    /// Reports whether all of an instance, whose mesh has these bounds, is occluded.
    fn is_occluded(&self, _instance: &Instance, _bounds: &Bounds) -> bool {
        false
    }

    /// Decides which instances are drawn in the first phase, if there are two.
    fn assign_phases(&self, _scene: DrawnScene<'_>, _plan: &mut VisibleInstances) {}

    /// Begins a phase: makes room for what it draws.
    ///
    /// # Errors
    /// When memory runs out.
    fn begin_phase(
        &mut self,
        _recorder: &Recorder<'_>,
        _cache: &IndexCache,
        _phase: (&VisibleInstances, DrawPhase),
    ) -> Result<(), RenderError> {
        Ok(())
    }

    /// Turns the draws of a phase, in order, into draw calls; `instances` are those of the plan.
    ///
    /// # Errors
    /// When memory cannot be read or written.
    fn reduce<'s>(
        &'s self,
        _instances: &[Instance],
        sections: &[&'s SectionDraw<'s>],
    ) -> Result<Vec<DrawCall<'s>>, RenderError> {
        Ok(sections.iter().map(|section| section.call()).collect())
    }

    /// Ends the first phase, once its depth is drawn: removes occluded instances of the second.
    /// Returns when the device got the phase and when it was finished.
    ///
    /// # Errors
    /// When the device is lost or memory runs out.
    fn end_first_phase(
        &mut self,
        _recorder: &mut Recorder<'_>,
        _depth: &Image,
        _models: &[Option<GpuModel>],
        _plan: &mut VisibleInstances,
    ) -> Result<[Instant; 2], RenderError> {
        Ok([Instant::now(); 2])
    }
}

/// Reduction that leaves nothing out: of graphics cards, and of passes other than frames.
pub(crate) struct NoReduction;

impl DrawReduction for NoReduction {}
