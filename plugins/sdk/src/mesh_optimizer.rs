//! Capability `busbar.mesh-optimizer/1`.

use std::time::Instant;

use busbar_plugin_abi as abi;

use crate::{Error, Plugin};

/// Orders the half-edge collapses of meshes.
pub trait MeshOptimizer: Plugin {
    /// The whole sequence, the least important collapse first. The same mesh
    /// and settings must give the same sequence everywhere. Several calls may
    /// run at once.
    ///
    /// # Errors
    /// [`Error::cancelled`] when `progress` says so; otherwise what failed.
    fn optimize(&self, mesh: Mesh<'_>, progress: &mut Progress<'_>) -> Result<CollapseList, Error>;
}

/// A triangle mesh over welded positions.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// x, y, z of each position, finite, metres.
    pub positions: &'a [[f32; 3]],
    /// Three different position indices of each triangle.
    pub triangles: &'a [[u32; 3]],
}

/// One half-edge collapse.
pub type Collapse = abi::BusbarCollapse;

/// A sequence of collapses with the times of the stages that made it.
#[derive(Clone, Debug, Default)]
pub struct CollapseList {
    /// The collapses in order.
    pub collapses: Vec<Collapse>,
    stages: Vec<(&'static str, f64)>,
}

impl CollapseList {
    /// Runs one stage of the work and keeps its time for reports.
    pub fn stage<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.stages.push((name, start.elapsed().as_secs_f64() * 1e3));
        result
    }

    /// The stages run so far with their times in milliseconds.
    pub fn stages(&self) -> &[(&'static str, f64)] {
        &self.stages
    }
}

/// Progress and cancellation of a call.
pub struct Progress<'a> {
    raw: Option<&'a abi::BusbarProgress>,
}

impl Progress<'_> {
    /// Says how much is done, 0 to 1.
    ///
    /// # Errors
    /// [`Error::cancelled`] when the host asked to stop: hand it on.
    pub fn report(&mut self, fraction: f32) -> Result<(), Error> {
        let Some((raw, report)) = self.raw.and_then(|raw| Some((raw, raw.report?))) else {
            return Ok(());
        };
        // SAFETY: context and function belong together and live for the call.
        match unsafe { report(raw.context, fraction) } {
            0 => Err(Error::cancelled()),
            _ => Ok(()),
        }
    }

    /// A progress that nobody watches, for tests.
    pub fn unwatched() -> Self {
        Self { raw: None }
    }
}

/// # Safety
/// Pointers are null or valid as the ABI's `optimize` demands.
pub(crate) unsafe fn run<P: MeshOptimizer>(
    plugin: &P,
    mesh: *const abi::BusbarMesh,
    progress: *const abi::BusbarProgress,
    output: *mut abi::BusbarCollapseOutput,
) -> Result<(), Error> {
    // SAFETY: the caller vouches for the pointers.
    let (mesh, raw, output) = unsafe { (mesh.as_ref(), progress.as_ref(), output.as_mut()) };
    let (Some(mesh), Some(output)) = (mesh, output) else {
        return Err(Error::argument("optimize: mesh or output is null"));
    };
    // SAFETY: the host gives `count` elements behind each pointer.
    let view = unsafe {
        Mesh {
            positions: crate::export::slice(mesh.positions.cast(), mesh.position_count as usize)?,
            triangles: crate::export::slice(mesh.triangles.cast(), mesh.triangle_count as usize)?,
        }
    };
    let out_of_range = |corner: &u32| *corner >= mesh.position_count;
    if view.triangles.iter().flatten().any(out_of_range) {
        return Err(Error::argument("optimize: a triangle names a position that does not exist"));
    }
    let list = plugin.optimize(view, &mut Progress { raw })?;
    let room = output.collapse_capacity as usize;
    if list.collapses.len() > room {
        return Err(Error::buffer(format!("{} collapses, room for {room}", list.collapses.len())));
    }
    let stages: Vec<_> = list.stages.iter().map(|&(name, millis)| stage(name, millis)).collect();
    let stages = &stages[..stages.len().min(output.stage_capacity as usize)];
    // SAFETY: the host gives room for `capacity` elements behind each pointer.
    unsafe {
        crate::export::copy_out(&list.collapses, output.collapses)?;
        crate::export::copy_out(stages, output.stages)?;
    }
    output.collapse_count = list.collapses.len() as u32;
    output.stage_count = stages.len() as u32;
    Ok(())
}

fn stage(name: &str, millis: f64) -> abi::BusbarStage {
    let mut stage = abi::BusbarStage { name: [0; 24], millis };
    let len = name.floor_char_boundary(stage.name.len());
    stage.name[..len].copy_from_slice(&name.as_bytes()[..len]);
    stage
}
