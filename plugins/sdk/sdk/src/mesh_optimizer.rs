//! Capability `busbar.mesh-optimizer/1-draft`: sequences of half-edge collapses.

use std::mem::offset_of;
use std::time::Instant;

use busbar_plugin_abi as abi;

use crate::boundary::{checked_mut, checked_ref, slice};
use crate::{Error, Plugin};

/// Optimizer that orders the half-edge collapses of meshes.
pub trait MeshOptimizer: Plugin {
    /// Reports whether the optimizer reads [`Mesh::wedges`]. Where it does not, the host need not
    /// pass half of the mesh, and there are none whatever the host.
    const READS_WEDGES: bool = true;

    /// Computes the whole sequence, the least important collapse first. The same mesh and settings
    /// must give the same sequence everywhere. Several calls may run at once.
    ///
    /// # Errors
    /// [`Error::cancelled`] when `progress` says so; otherwise what failed.
    fn optimize(&self, mesh: Mesh<'_>, progress: &mut Progress<'_>) -> Result<CollapseList, Error>;
}

/// Triangle mesh over welded positions.
#[derive(Clone, Copy, Debug)]
pub struct Mesh<'a> {
    /// Coordinates x, y, z of each position, finite, metres.
    pub positions: &'a [[f32; 3]],
    /// Three different position indices of each triangle.
    pub triangles: &'a [[u32; 3]],
    /// Wedge attributes; `None` where the host gives none, or [`MeshOptimizer::READS_WEDGES`] is
    /// false.
    pub wedges: Option<Wedges<'a>>,
}

/// Attributes of a mesh as parallel arrays, one element a wedge: a position
/// with one set of attributes. Wedges of one position follow one another.
#[derive(Clone, Copy, Debug)]
pub struct Wedges<'a> {
    /// Three wedge indices of each triangle.
    pub corners: &'a [[u32; 3]],
    /// The position that each wedge stands on.
    pub positions: &'a [u32],
    /// Normals, not always of length 1.
    pub normals: &'a [[f32; 3]],
    /// Texture coordinates; zero where there are none.
    pub uvs: &'a [[f32; 2]],
    /// A number for the material of each wedge.
    pub sections: &'a [u32],
}

/// Half-edge collapse of one position onto another.
pub type Collapse = abi::BusbarCollapse;

/// Sequence of collapses, with the times of the stages that made it.
#[derive(Clone, Debug, Default)]
pub struct CollapseList {
    /// Collapses in their order.
    pub collapses: Vec<Collapse>,
    /// True if theta, the proportion of simplified vertices, is that of this mesh. Else the host
    /// shares one theta among all meshes of a model by error.
    pub theta_by_mesh: bool,
    stages: Vec<(&'static str, f64)>,
}

impl CollapseList {
    /// Runs one stage of the work and keeps its time for reports; times of one
    /// name are added up.
    pub fn stage<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        let millis = start.elapsed().as_secs_f64() * 1e3;
        match self.stages.iter_mut().find(|stage| stage.0 == name) {
            Some(stage) => stage.1 += millis,
            None => self.stages.push((name, millis)),
        }
        result
    }

    /// Returns names and milliseconds of the stages, in order.
    pub fn stages(&self) -> &[(&'static str, f64)] {
        &self.stages
    }
}

/// Progress and cancellation of a call.
pub struct Progress<'a> {
    raw: Option<&'a abi::BusbarProgress>,
}

impl<'a> Progress<'a> {
    /// Wraps the ABI struct, whose function and context must belong together.
    pub(crate) fn from_raw(raw: &'a abi::BusbarProgress) -> Self {
        Self { raw: Some(raw) }
    }

    /// Reports the share of the work that is done, 0 to 1.
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

    /// Creates a progress without a host, for tests.
    pub fn detached() -> Self {
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
    let (mut view, output) =
        unsafe { (read_mesh(mesh)?, checked_mut(output, "optimize: output")?) };
    if !P::READS_WEDGES {
        // A host that knows no flags gives them: the sequence must be the same there.
        view.wedges = None;
    }
    let raw = match progress.is_null() {
        true => None,
        // SAFETY: as above.
        false => Some(unsafe { checked_ref(progress, "optimize: progress")? }),
    };
    let list = plugin.optimize(view, &mut Progress { raw })?;
    let room = output.collapse_capacity as usize;
    if list.collapses.len() > room {
        return Err(Error::buffer(format!("{} collapses, room for {room}", list.collapses.len())));
    }
    let stages: Vec<_> = list.stages.iter().map(|&(name, millis)| stage(name, millis)).collect();
    let stages = &stages[..stages.len().min(output.stage_capacity as usize)];
    // SAFETY: the host gives room for `capacity` elements behind each pointer.
    unsafe {
        crate::boundary::copy_out(&list.collapses, output.collapses)?;
        crate::boundary::copy_out(stages, output.stages)?;
    }
    output.collapse_count = list.collapses.len() as u32;
    output.stage_count = stages.len() as u32;
    output.flags = if list.theta_by_mesh { abi::BUSBAR_COLLAPSES_THETA_BY_MESH } else { 0 };
    Ok(())
}

fn stage(name: &str, millis: f64) -> abi::BusbarStage {
    let mut stage = abi::BusbarStage { name: [0; 24], millis };
    let len = name.floor_char_boundary(stage.name.len());
    stage.name[..len].copy_from_slice(&name.as_bytes()[..len]);
    stage
}

/// Reads a mesh at the boundary, without its attributes where the host is too
/// old to give them.
///
/// # Safety
/// `mesh` is null or leads to `struct_size` bytes, and its pointers to as many
/// elements as its counts say, all alive for `'a`.
unsafe fn read_mesh<'a>(mesh: *const abi::BusbarMesh) -> Result<Mesh<'a>, Error> {
    if mesh.is_null() || !mesh.is_aligned() {
        return Err(Error::argument("optimize: mesh is null or misaligned"));
    }
    // SAFETY: every version of the struct starts with its size.
    let size = unsafe { mesh.cast::<u32>().read() } as usize;
    if size < offset_of!(abi::BusbarMesh, wedge_count) {
        return Err(Error::argument(format!("optimize: a mesh of {size} bytes is too small")));
    }
    let mut raw = abi::BusbarMesh {
        struct_size: 0,
        position_count: 0,
        triangle_count: 0,
        reserved: 0,
        positions: std::ptr::null(),
        triangles: std::ptr::null(),
        wedge_count: 0,
        wedge_reserved: 0,
        corners: std::ptr::null(),
        wedge_positions: std::ptr::null(),
        wedge_normals: std::ptr::null(),
        wedge_uvs: std::ptr::null(),
        wedge_sections: std::ptr::null(),
    };
    let known = if size < size_of::<abi::BusbarMesh>() {
        offset_of!(abi::BusbarMesh, wedge_count)
    } else {
        size_of::<abi::BusbarMesh>()
    };
    // SAFETY: `known` is at most the size of either struct; all fields are
    // plain numbers and pointers.
    unsafe {
        std::ptr::copy_nonoverlapping(mesh.cast::<u8>(), (&raw mut raw).cast::<u8>(), known);
    }
    let (triangle_count, wedge_count) = (raw.triangle_count as usize, raw.wedge_count as usize);
    // SAFETY: the host gives `count` elements behind each pointer.
    let (positions, triangles) = unsafe {
        (
            slice(raw.positions.cast::<[f32; 3]>(), raw.position_count as usize)?,
            slice(raw.triangles.cast::<[u32; 3]>(), triangle_count)?,
        )
    };
    if triangles.as_flattened().iter().any(|&corner| corner >= raw.position_count) {
        return Err(Error::argument("optimize: a triangle names a position that does not exist"));
    }
    if triangles.iter().any(|[a, b, c]| a == b || b == c || c == a) {
        return Err(Error::argument("optimize: a triangle names a position twice"));
    }
    if wedge_count == 0 {
        return Ok(Mesh { positions, triangles, wedges: None });
    }
    // SAFETY: as above; a host that counts wedges gives all five arrays.
    let wedges = unsafe {
        Wedges {
            corners: slice(raw.corners.cast(), triangle_count)?,
            positions: slice(raw.wedge_positions, wedge_count)?,
            normals: slice(raw.wedge_normals.cast(), wedge_count)?,
            uvs: slice(raw.wedge_uvs.cast(), wedge_count)?,
            sections: slice(raw.wedge_sections, wedge_count)?,
        }
    };
    check_wedges(&wedges, positions.len(), triangles)?;
    Ok(Mesh { positions, triangles, wedges: Some(wedges) })
}

/// Checks the rules that an optimizer may rely on: indices exist, corners stand where the triangles
/// do, and each position has its wedges in one run.
fn check_wedges(
    wedges: &Wedges<'_>,
    position_count: usize,
    triangles: &[[u32; 3]],
) -> Result<(), Error> {
    let mut has_wedge = vec![false; position_count];
    let mut last = None;
    for &position in wedges.positions {
        let Some(seen) = has_wedge.get_mut(position as usize) else {
            return Err(Error::argument("optimize: a wedge names a position that does not exist"));
        };
        if std::mem::replace(seen, true) && last != Some(position) {
            return Err(Error::argument("optimize: wedges of one position are not together"));
        }
        last = Some(position);
    }
    if has_wedge.contains(&false) {
        return Err(Error::argument("optimize: a position has no wedge"));
    }
    let corners = wedges.corners.as_flattened().iter().zip(triangles.as_flattened());
    for (&wedge, position) in corners {
        if wedges.positions.get(wedge as usize) != Some(position) {
            return Err(Error::argument("optimize: a corner's wedge is not at its position"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
