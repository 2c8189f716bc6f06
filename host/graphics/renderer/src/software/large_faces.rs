//! Occlusion culling behind large faces near the eye.

use std::ops::Range;

use busbar_culling::{
    BoundingSphere, FaceFilter, Frustum, MAX_CORNERS, MaskedDepthBuffer, Occluder,
    is_outside_frustum,
};
use busbar_geometry::Bounds;
use busbar_shaders::Instance;
use glam::{Mat4, Vec4};

use super::mesh_data::SoftwareMesh;
use crate::CameraView;
use crate::draw_reduction::DrawnScene;
use crate::index_cache::IndexCache;
use crate::instance_buckets::{Bucket, BucketKey};
use crate::instance_transform::world_from_mesh;
use crate::model::{GpuMesh, GpuModel};

/// Faces of a frame, those that cover most.
const MAX_FACES: usize = 1024;
/// Faces that are kept in mind until only those are.
const MAX_FOUND: usize = 4 * MAX_FACES;
/// Tolerance of the back-face test, as a share of the eye's distance from the mesh's origin.
const BACK_FACE_TOLERANCE: f32 = 1e-5;

/// Occlusion buffer: large faces near the eye, rasterized into masked depth.
#[derive(Default)]
pub(super) struct OcclusionBuffer {
    clip_from_world: Mat4,
    depth: MaskedDepthBuffer,
    found: Vec<ProjectedFace>,
    /// Corners of all faces, clip space.
    corners: Vec<Vec4>,
}

/// A face in the picture.
struct ProjectedFace {
    pixels: f32,
    /// One over its distance, at its nearest.
    nearest: f32,
    /// Range of its corners in [`OcclusionBuffer::corners`].
    corners: Range<usize>,
}

impl OcclusionBuffer {
    /// Rasterizes the large faces of resolved meshes as occluders; without a camera there are none.
    pub(super) fn rasterize_faces(
        &mut self,
        DrawnScene { models, cache, buckets }: DrawnScene<'_>,
        camera: Option<&CameraView>,
        (size, samples): ([u32; 2], u32),
    ) {
        self.found.clear();
        self.corners.clear();
        let Some(camera) = camera else { return };
        self.clip_from_world = camera.clip_from_world();
        let frustum = Frustum::from_matrix(&self.clip_from_world);
        let filter = FaceFilter::new(camera, size);
        for Bucket { key, entries, spheres, .. } in buckets.buckets() {
            // Of most kinds nothing is near enough, and nothing more is looked up.
            let mut of_bucket = None;
            let near = entries.iter().zip(spheres).filter(|(_, sphere)| filter.is_near(sphere));
            for (entry, sphere) in near.filter(|(_, sphere)| frustum.is_visible(sphere)) {
                let found =
                    of_bucket.get_or_insert_with(|| occluders_of_bucket(models, cache, key));
                let Some((of, occluders)) = found else { break };
                let instance = &buckets.instances[entry.slot as usize];
                self.add_faces_of((instance, sphere), *of, occluders, &filter);
                if self.found.len() >= MAX_FOUND {
                    self.keep_largest();
                }
            }
        }
        self.keep_largest();
        self.found.sort_unstable_by(|a, b| b.nearest.total_cmp(&a.nearest));
        if !self.found.is_empty() {
            self.depth.begin(camera, size, samples);
        }
        for ProjectedFace { corners, .. } in &self.found {
            self.depth.add(self.corners[corners.clone()].iter().copied());
        }
    }

    /// Keeps those that cover most.
    fn keep_largest(&mut self) {
        if self.found.len() <= MAX_FACES {
            return;
        }
        self.found.select_nth_unstable_by(MAX_FACES, |a, b| b.pixels.total_cmp(&a.pixels));
        self.found.truncate(MAX_FACES);
        let mut kept = Vec::with_capacity(self.found.len() * MAX_CORNERS);
        for ProjectedFace { corners, .. } in &mut self.found {
            let first = kept.len();
            kept.extend_from_slice(&self.corners[corners.clone()]);
            *corners = first..kept.len();
        }
        self.corners = kept;
    }

    /// Returns the buffer if it holds any face.
    pub(super) fn non_empty(&self) -> Option<&Self> {
        (!self.found.is_empty()).then_some(self)
    }

    /// Adds the large faces of an instance.
    fn add_faces_of(
        &mut self,
        (instance, sphere): (&Instance, &BoundingSphere),
        (model, mesh): (&GpuModel, &GpuMesh),
        occluders: &[Occluder],
        filter: &FaceFilter,
    ) {
        let stretch = sphere.radius / mesh.sphere.radius;
        let least_area = filter.least_area(sphere) / (stretch * stretch);
        let is_large = |face: &&Occluder| face.area >= least_area;
        // Of most there are none, and nothing more is worked out.
        if !occluders.first().is_some_and(|first| is_large(&first)) {
            return;
        }
        let world_from_mesh = world_from_mesh(instance);
        let clip_from_mesh = self.clip_from_world * world_from_mesh;
        let eye = world_from_mesh.inverse().transform_point3(filter.eye()).extend(1.0);
        let tolerance =
            BACK_FACE_TOLERANCE * (eye.truncate().length() + mesh.sphere.center.length());
        for Occluder { plane, corners, section, .. } in occluders.iter().take_while(is_large) {
            let section = &mesh.stacks.mesh().sections[*section as usize];
            let material = model.material(section.material);
            let is_seen = material.double_sided || plane.dot(eye) > tolerance;
            if !(material.opaque && is_seen) {
                continue;
            }
            let first = self.corners.len();
            self.corners.extend(corners.iter().map(|corner| clip_from_mesh * corner.extend(1.0)));
            let added = &self.corners[first..];
            let (pixels, nearest) = filter.screen_size(added);
            if filter.is_large(pixels) && !is_outside_frustum(added) {
                self.found.push(ProjectedFace {
                    pixels,
                    nearest,
                    corners: first..self.corners.len(),
                });
            } else {
                self.corners.truncate(first);
            }
        }
    }

    /// Reports whether a box of an instance's mesh is wholly occluded.
    #[inline]
    pub(super) fn is_occluded(&self, instance: &Instance, bounds: &Bounds) -> bool {
        !self.is_box_visible(&self.clip_from_mesh(instance), bounds)
    }

    pub(super) fn clip_from_mesh(&self, instance: &Instance) -> Mat4 {
        self.clip_from_world * world_from_mesh(instance)
    }

    #[inline]
    pub(super) fn is_box_visible(&self, clip_from_mesh: &Mat4, bounds: &Bounds) -> bool {
        self.depth.is_visible(clip_from_mesh, bounds)
    }
}

/// Returns the large faces of a bucket that does not morph, with model and mesh; `None` where there
/// are none.
fn occluders_of_bucket<'a>(
    models: &'a [Option<GpuModel>],
    cache: &'a IndexCache,
    key: &BucketKey,
) -> Option<((&'a GpuModel, &'a GpuMesh), &'a [Occluder])> {
    let resolved = cache.get(key.mesh).filter(|_| key.morph.is_none())?;
    let occluders = &*resolved.data::<SoftwareMesh>()?.occluders;
    let model = models[key.mesh.model as usize].as_ref().filter(|_| !occluders.is_empty())?;
    Some(((model, &model.meshes[key.mesh.mesh as usize]), occluders))
}
