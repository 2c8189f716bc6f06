//! Capability `busbar.mesh-optimizer/1-draft`: from a triangle mesh to a sequence of half-edge
//! collapses.

use core::ffi::c_void;

use crate::{BusbarError, BusbarPlugin, BusbarStatusNumber};

/// Id of the capability.
pub const MESH_OPTIMIZER_ID: &str = "busbar.mesh-optimizer/1-draft";

/// Triangle mesh over welded positions, and the wedges that split them.
///
/// A *wedge* is one position with one set of attributes; a position on a
/// normal, texture or material seam has several. The fields from `wedge_count`
/// on came later: they are there if `struct_size` reaches over them, and count
/// and pointers are zero where the host has no attributes or the plugin wants
/// none (`BUSBAR_OPTIMIZER_NO_WEDGES`). Either all five arrays are given or none.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarMesh {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Number of positions in `positions`.
    pub position_count: u32,
    /// Number of triangles in `triangles`.
    pub triangle_count: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Coordinates x, y, z of each position, finite, metres.
    pub positions: *const f32,
    /// Three different position indices of each triangle, counter-clockwise.
    pub triangles: *const u32,
    /// Number of wedges: at least one for each position, or 0.
    pub wedge_count: u32,
    /// Reserved; must be zero.
    pub wedge_reserved: u32,
    /// Three wedge indices of each triangle, each standing on the position
    /// that `triangles` names there.
    pub corners: *const u32,
    /// The position of each wedge. Wedges of one position follow one another.
    /// A wedge of a removed position becomes, of the first 64 wedges of the
    /// kept one, that of the same section, then of the least sum of
    /// 1 - cosine of the normals and distance of the coordinates, then the
    /// first.
    pub wedge_positions: *const u32,
    /// x, y, z of the normal of each wedge, finite, not always of length 1.
    pub wedge_normals: *const f32,
    /// u, v of each wedge, finite; zero where there are none.
    pub wedge_uvs: *const f32,
    /// A number for the material of each wedge.
    pub wedge_sections: *const u32,
}

/// Half-edge collapse. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct BusbarCollapse {
    /// Index of the position that is removed. No later entry may name it.
    pub removed: u32,
    /// Index of the position that replaces it; must not have been removed before.
    pub kept: u32,
    /// Geometric error after this collapse, metres: finite, at least 0, never
    /// decreasing along the sequence.
    pub error: f32,
}

/// Time of one stage of the work. Array element.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarStage {
    /// UTF-8 name, padded with zeros.
    pub name: [u8; 24],
    /// Duration of the stage, milliseconds.
    pub millis: f64,
}

/// Flag of a sequence whose proportion of simplified vertices, theta, is that of its mesh. Without
/// it a host shares one theta among all meshes of a model by error.
pub const BUSBAR_COLLAPSES_THETA_BY_MESH: u32 = 1;

/// Buffers for the result. The caller owns them; the plugin fills in the
/// counts.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarCollapseOutput {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Room in `collapses`: at least `position_count`.
    pub collapse_capacity: u32,
    /// Number of collapses written.
    pub collapse_count: u32,
    /// Capacity of `stages`, in elements.
    pub stage_capacity: u32,
    /// Number of stages written.
    pub stage_count: u32,
    /// `BUSBAR_COLLAPSES_...`, written by the plugin, or 0. Bits that a host does not know are
    /// ignored.
    pub flags: u32,
    /// The sequence, in order.
    pub collapses: *mut BusbarCollapse,
    /// Times of the stages, for reports.
    pub stages: *mut BusbarStage,
}

/// Progress and cancellation of a long call.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarProgress {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// Reserved; must be zero.
    pub reserved: u32,
    /// Passed back in `report`.
    pub context: *mut c_void,
    /// `[the thread of the call]` Says how much is done, 0 to 1. Returns 0 if
    /// the plugin must stop and return `BUSBAR_CANCELLED`. May be null.
    pub report: Option<unsafe extern "C" fn(context: *mut c_void, fraction: f32) -> u32>,
}

/// Flag of a plugin whose `optimize` reads positions and triangles alone, so that the host need not
/// pass wedges.
pub const BUSBAR_OPTIMIZER_NO_WEDGES: u32 = 1;

/// Function table of `busbar.mesh-optimizer/1-draft`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct BusbarMeshOptimizer {
    /// Size of this struct, bytes.
    pub struct_size: u32,
    /// `BUSBAR_OPTIMIZER_...`, or 0. Bits that a host does not know are ignored.
    pub flags: u32,
    /// `[any-thread]` Orders the half-edge collapses of a mesh, the least
    /// important first. The same mesh and settings give the same sequence,
    /// bit for bit, on every machine. Borrows everything for the call.
    /// Fails with `BUSBAR_INVALID_ARGUMENT`, `BUSBAR_BUFFER_TOO_SMALL`,
    /// `BUSBAR_CANCELLED`, `BUSBAR_FAILED` or `BUSBAR_INTERNAL`.
    pub optimize: Option<
        unsafe extern "C" fn(
            plugin: *const BusbarPlugin,
            mesh: *const BusbarMesh,
            progress: *const BusbarProgress,
            output: *mut BusbarCollapseOutput,
            error: *mut BusbarError,
        ) -> BusbarStatusNumber,
    >,
}
