//! Ground plane with a metre grid below the equipment.

use busbar_gpu::{
    BindGroup, Buffer, BufferUsage, DrawCall, GpuError, GpuQueue, Pipeline, RenderPass,
};
use busbar_shaders::Vertex;
use glam::Vec3;

use crate::RenderError;

/// Corners of the square that the shader stretches around the eye, and its triangles.
const CORNERS: [[f32; 2]; 4] = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
const TRIANGLES: [u32; 6] = [0, 1, 2, 0, 2, 3];

/// Cells of the coarsest grid, metres: a place is known up to these.
const PERIOD_METRES: f32 = 10.0;

/// Position and extent of the ground plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Height along y, metres.
    pub height: f32,
    /// Radius of the ground around the point below the eye, metres; it fades out towards the edge.
    pub reach: f32,
}

/// GPU resources of the ground plane.
pub(crate) struct GroundResources {
    vertices: Buffer,
    indices: Buffer,
}

impl GroundResources {
    pub(crate) fn new(queue: &mut GpuQueue) -> Result<Self, RenderError> {
        let corner = |[x, z]: [f32; 2]| Vertex {
            position_u: [x, 0.0, z, 0.0],
            normal_v: [0.0, 1.0, 0.0, 0.0],
        };
        let corners = CORNERS.map(corner);
        let mut recorder = queue.begin_transfer()?;
        let vertices = recorder.upload_buffer(
            "ground",
            BufferUsage::Vertex,
            bytemuck::cast_slice(&corners),
        )?;
        let indices = recorder.upload_buffer(
            "ground indices",
            BufferUsage::Index,
            bytemuck::cast_slice(&TRIANGLES),
        )?;
        recorder.submit_and_wait()?;
        Ok(Self { vertices, indices })
    }

    /// Draws the ground over farther surfaces. Any instance buffer will do: none is read.
    pub(crate) fn draw(
        &self,
        pass: &mut RenderPass<'_>,
        pipeline: &Pipeline,
        frame_group: &BindGroup,
        instances: &Buffer,
    ) -> Result<(), GpuError> {
        pass.draw(&DrawCall {
            pipeline,
            groups: &[frame_group],
            vertices: &self.vertices,
            vertex_offset: 0,
            first_vertex: 0,
            instances,
            indices: &self.indices,
            index_range: 0..TRIANGLES.len() as u32,
            instance_range: 0..1,
            // Nobody looks at it from below.
            cull_back: true,
            mirrored: false,
        })
    }
}

/// Returns the shader's ground data: the point below the eye with the radius, and that point within
/// its grid cell. Both are 0 without ground.
pub(crate) fn uniforms(ground: Option<Ground>, eye: Vec3) -> [[f32; 4]; 2] {
    let Some(Ground { height, reach }) = ground else { return [[0.0; 4]; 2] };
    let within = |metres: f32| metres.rem_euclid(PERIOD_METRES);
    [[eye.x, height, eye.z, reach], [within(eye.x), within(eye.z), 0.0, 0.0]]
}
