//! Mesh optimizers: capability `busbar.mesh-optimizer/1-draft`.

use std::ffi::c_void;
use std::ptr::null;
use std::sync::Arc;

use busbar_geometry::{Collapse, CollapseSequence, Mesh};
use busbar_plugin_abi as abi;
use glam::{Vec2, Vec3};

use crate::{Instance, PluginError};

/// Stages that a plugin may report.
const MAX_STAGES: usize = 32;
/// Longest name of a stage, bytes, with replacement characters included.
const MAX_STAGE_NAME_BYTES: usize = 72;

/// A plugin that orders collapses. Several meshes may be optimised at once.
#[derive(Clone)]
pub struct MeshOptimizer {
    instance: Arc<Instance>,
    table: &'static abi::BusbarMeshOptimizer,
}

/// A mesh as an optimiser gets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshView<'a> {
    /// Vertex positions after welding.
    pub positions: &'a [Vec3],
    /// Three position indices of each triangle.
    pub triangles: &'a [[u32; 3]],
    /// Wedges of the mesh; none where the optimizer reads none.
    pub wedges: Option<WedgesView<'a>>,
}

/// The wedges of a mesh; those of each position are together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WedgesView<'a> {
    /// Three wedge indices of each triangle.
    pub corners: &'a [[u32; 3]],
    /// The position of each wedge.
    pub position: &'a [u32],
    /// The normal of each.
    pub normal: &'a [Vec3],
    /// Texture coordinates of each.
    pub uv: &'a [Vec2],
    /// The section of each.
    pub section: &'a [u32],
}

impl<'a> WedgesView<'a> {
    /// Borrows the wedges of a mesh.
    pub fn from_mesh(mesh: &'a Mesh) -> Self {
        Self {
            corners: &mesh.triangles,
            position: &mesh.wedges.position,
            normal: &mesh.wedges.normal,
            uv: &mesh.wedges.uv,
            section: &mesh.wedges.section,
        }
    }

    /// Reports whether the lengths of all arrays agree.
    fn is_whole(&self, triangles: usize) -> bool {
        let count = self.position.len();
        self.corners.len() == triangles
            && [self.normal.len(), self.uv.len(), self.section.len()] == [count; 3]
    }
}

/// Number of collapses written by a plugin, unchecked, and the durations of its stages.
#[derive(Clone, Debug)]
pub struct WrittenCollapses {
    /// Number of collapses, at most the capacity of the buffer.
    pub collapses: usize,
    /// Stages that the plugin reported.
    pub stages: Vec<Stage>,
    /// True if theta is a share of the mesh, not of its model.
    pub theta_by_mesh: bool,
}

/// A checked sequence and how long its making took.
#[derive(Clone, Debug)]
pub struct OptimizedMesh {
    /// Collapse sequence of the mesh.
    pub sequence: CollapseSequence,
    /// Stages that the plugin reported.
    pub stages: Vec<Stage>,
}

/// A stage of an optimiser's work: its name and how long it took, milliseconds.
pub type Stage = (String, f64);

/// Validates stages that came from elsewhere against the limits.
///
/// # Errors
/// The rule that they break, in words.
pub fn check_stages(stages: &[Stage]) -> Result<(), &'static str> {
    let fits = |(name, millis): &Stage| name.len() <= MAX_STAGE_NAME_BYTES && millis.is_finite();
    if stages.len() > MAX_STAGES || !stages.iter().all(fits) {
        return Err("it claims stages that no plugin can report");
    }
    Ok(())
}

impl MeshOptimizer {
    /// The capability of an instance.
    ///
    /// # Errors
    /// [`PluginError::WrongCapability`].
    pub fn from_instance(instance: Arc<Instance>) -> Result<Self, PluginError> {
        let table = instance.capability(abi::MESH_OPTIMIZER_ID)?;
        Ok(Self { instance, table })
    }

    /// Reports whether the optimizer reads wedges; it is given none otherwise.
    pub fn reads_wedges(&self) -> bool {
        self.table.flags & abi::BUSBAR_OPTIMIZER_NO_WEDGES == 0
    }

    /// The collapse sequence of a mesh. `progress` gets 0 to 1 and returns
    /// whether to go on. The wedges of each position must be together, as
    /// welding puts them.
    ///
    /// # Errors
    /// What the plugin says, or the rule its result breaks.
    pub fn optimize(
        &self,
        mesh: &Mesh,
        progress: impl FnMut(f32) -> bool,
    ) -> Result<OptimizedMesh, PluginError> {
        let triangles: Vec<_> = mesh.triangles.iter().map(|&t| mesh.corner_positions(t)).collect();
        let view = MeshView {
            positions: &mesh.positions,
            triangles: &triangles,
            wedges: self.reads_wedges().then(|| WedgesView::from_mesh(mesh)),
        };
        let mut room = vec![abi::BusbarCollapse::default(); mesh.positions.len()];
        let WrittenCollapses { collapses, stages, theta_by_mesh } =
            self.optimize_into(view, &mut room, progress)?;
        room.truncate(collapses);
        let entry =
            |c: abi::BusbarCollapse| Collapse { removed: c.removed, kept: c.kept, error: c.error };
        let entries = room.into_iter().map(entry).collect();
        let sequence =
            CollapseSequence::new(entries, mesh.positions.len() as u32).map_err(|source| {
                PluginError::Sequence { id: self.instance.info().id.clone(), source }
            })?;
        let sequence = sequence.with_theta_by_mesh(theta_by_mesh);
        Ok(OptimizedMesh { sequence, stages })
    }

    /// Runs the optimizer with `room` as its buffer, one element a position. The collapses are
    /// not checked.
    ///
    /// # Errors
    /// What the plugin says, or that it claims more than it had room for.
    pub fn optimize_into(
        &self,
        mesh: MeshView<'_>,
        room: &mut [abi::BusbarCollapse],
        mut progress: impl FnMut(f32) -> bool,
    ) -> Result<WrittenCollapses, PluginError> {
        let optimize =
            self.table.optimize.ok_or_else(|| self.instance.violation("`optimize` is null"))?;
        let MeshView { positions, triangles, wedges } = mesh;
        if wedges.is_some_and(|wedges| !wedges.is_whole(triangles.len())) {
            return Err(PluginError::Failed {
                id: self.instance.info().id.clone(),
                settings_at_fault: false,
                message: "the arrays of the mesh differ in length".into(),
            });
        }
        let mut stages = [abi::BusbarStage { name: [0; 24], millis: 0.0 }; MAX_STAGES];
        let mut raw_mesh = abi::BusbarMesh {
            struct_size: size_of::<abi::BusbarMesh>() as u32,
            position_count: positions.len() as u32,
            triangle_count: triangles.len() as u32,
            reserved: 0,
            positions: positions.as_ptr().cast(),
            triangles: triangles.as_ptr().cast(),
            wedge_count: 0,
            wedge_reserved: 0,
            corners: null(),
            wedge_positions: null(),
            wedge_normals: null(),
            wedge_uvs: null(),
            wedge_sections: null(),
        };
        if let Some(wedges) = &wedges {
            raw_mesh.wedge_count = wedges.position.len() as u32;
            raw_mesh.corners = wedges.corners.as_ptr().cast();
            raw_mesh.wedge_positions = wedges.position.as_ptr();
            raw_mesh.wedge_normals = wedges.normal.as_ptr().cast();
            raw_mesh.wedge_uvs = wedges.uv.as_ptr().cast();
            raw_mesh.wedge_sections = wedges.section.as_ptr();
        }
        let mut watch: &mut dyn FnMut(f32) -> bool = &mut progress;
        let raw_progress = abi::BusbarProgress {
            struct_size: size_of::<abi::BusbarProgress>() as u32,
            reserved: 0,
            context: std::ptr::from_mut(&mut watch).cast(),
            report: Some(report_progress),
        };
        let mut output = abi::BusbarCollapseOutput {
            struct_size: size_of::<abi::BusbarCollapseOutput>() as u32,
            collapse_capacity: room.len() as u32,
            collapse_count: 0,
            stage_capacity: MAX_STAGES as u32,
            stage_count: 0,
            flags: 0,
            collapses: room.as_mut_ptr(),
            stages: stages.as_mut_ptr(),
        };
        let mut error = abi::BusbarError::empty();
        // SAFETY: all structs and buffers live for the call and have the sizes
        // they state; the function may be called from any thread.
        let status = unsafe {
            optimize(self.instance.as_ptr(), &raw_mesh, &raw_progress, &mut output, &mut error)
        };
        self.instance.outcome(status, &error)?;

        let collapses = output.collapse_count as usize;
        if collapses > room.len() || output.stage_count as usize > MAX_STAGES {
            return Err(self.instance.violation("it claims more results than it had room for"));
        }
        let stages = stages[..output.stage_count as usize].iter().map(read_stage).collect();
        let theta_by_mesh = output.flags & abi::BUSBAR_COLLAPSES_THETA_BY_MESH != 0;
        Ok(WrittenCollapses { collapses, stages, theta_by_mesh })
    }
}

fn read_stage(stage: &abi::BusbarStage) -> (String, f64) {
    let len = stage.name.iter().position(|&byte| byte == 0).unwrap_or(stage.name.len());
    let millis = if stage.millis.is_finite() { stage.millis } else { 0.0 };
    (String::from_utf8_lossy(&stage.name[..len]).into_owned(), millis)
}

unsafe extern "C" fn report_progress(context: *mut c_void, fraction: f32) -> u32 {
    // SAFETY: `optimize` passes the address of its `watch`, on its own thread.
    let watch = unsafe { context.cast::<&mut dyn FnMut(f32) -> bool>().as_mut() };
    let Some(watch) = watch else { return 1 };
    let fraction = if fraction.is_finite() { fraction.clamp(0.0, 1.0) } else { 0.0 };
    // A panic of the watcher must not cross the border: it stops the work.
    let go_on = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| watch(fraction)));
    u32::from(go_on.unwrap_or(false))
}
