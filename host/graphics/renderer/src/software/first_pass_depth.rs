//! Depth of the first pass, read back to test occlusion against.

use busbar_culling::{DepthTiles, TILE_PIXELS};
use busbar_gpu::{DepthCopy, Gpu, GpuError, Image, Recorder};

use crate::CameraView;
use crate::layer::get_or_create;
use crate::tile_pixels::tile_pixels;

/// Depth of a part of a picture whose pixels have one sample.
#[derive(Default)]
pub(super) struct FirstPassDepth {
    pub(super) tiles: DepthTiles,
    /// Size of the picture in pixels.
    size: [u32; 2],
    /// Room for the depth of a picture, and of which size.
    copy: Option<(DepthCopy, [u32; 2])>,
}

impl FirstPassDepth {
    /// Begins a frame of a camera without any depth.
    pub(super) fn begin(&mut self, camera: &CameraView, size: [u32; 2]) {
        self.size = size;
        self.tiles.begin(camera, size);
    }

    /// Has the depth copied where it will be asked about, if anywhere.
    pub(super) fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        depth: &Image,
    ) -> Result<(), GpuError> {
        let area = tile_pixels(self.tiles.queried(), TILE_PIXELS, self.size);
        if area.size.contains(&0) {
            return Ok(());
        }
        let copy = self.copy_of(recorder.gpu())?;
        recorder.copy_depth(depth, area, copy)
    }

    /// Returns the read-back buffer for a picture's depth, made anew for another size.
    fn copy_of(&mut self, gpu: &Gpu) -> Result<&mut DepthCopy, GpuError> {
        let Self { copy, size, .. } = self;
        drop(copy.take_if(|(_, made_for)| made_for != size));
        Ok(&mut get_or_create(copy, || Ok::<_, GpuError>((DepthCopy::new(gpu, *size)?, *size)))?.0)
    }

    /// Reads the copied depth back, once the device has written it.
    pub(super) fn read_back(&mut self) -> Result<(), GpuError> {
        let Self { copy: Some((copy, _)), tiles, .. } = self else { return Ok(()) };
        if tiles.queried()[0].is_empty() {
            return Ok(());
        }
        let width = copy.size()[0] as usize;
        copy.read_with(|depths| tiles.read(depths, width))
    }
}
