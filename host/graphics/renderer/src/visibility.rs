//! Visibility: frustum culling, and occlusion culling behind large faces.

use std::f32::consts::PI;
use std::ops::Range;

use busbar_geometry::Bounds;
use busbar_shaders::Instance;
use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::CameraView;
use crate::first_pass_depth::FirstPassDepth;
use crate::frustum::{BoundingSphere, Frustum};
use crate::index_cache::IndexCache;
use crate::instance_buckets::{Bucket, BucketKey, InstanceBuckets};
use crate::masked_occlusion::MaskedDepthBuffer;
use crate::model::{GpuMesh, GpuModel};
use crate::occluders::{MAX_CORNERS, Occluder};

/// Least share of a picture that an occluding face must cover.
const MIN_SCREEN_SHARE: f32 = 1.0 / 128.0;
/// Faces of a frame, those that cover most.
const MAX_FACES: usize = 1024;
/// Faces that are kept in mind until only those are.
const MAX_FOUND: usize = 4 * MAX_FACES;
/// Tolerance of the back-face test, as a share of the eye's distance from the mesh's origin.
const BACK_FACE_TOLERANCE: f32 = 1e-5;

/// Frustum and occluders that instances are culled against.
pub(crate) struct CullView<'a> {
    pub(crate) frustum: Frustum,
    /// Occluding faces; `None` where nothing is occluded.
    pub(crate) occluders: Option<&'a OcclusionBuffer>,
}

impl CullView<'_> {
    /// Makes a view that culls by the frustum alone.
    pub(crate) fn new(clip_from_world: &Mat4) -> Self {
        Self { frustum: Frustum::from_matrix(clip_from_world), occluders: None }
    }
}

/// Occlusion test against large faces or against the depth of the first pass.
#[derive(Clone, Copy)]
pub(crate) enum OcclusionTest<'a> {
    LargeFaces(&'a OcclusionBuffer),
    FirstPassDepth(&'a FirstPassDepth),
}

impl OcclusionTest<'_> {
    /// Returns the transform from an instance's mesh to clip space, for
    /// [`OcclusionTest::is_box_visible`].
    pub(crate) fn clip_from_mesh(self, instance: &Instance) -> Mat4 {
        match self {
            Self::LargeFaces(buffer) => buffer.clip_from_mesh(instance),
            Self::FirstPassDepth(drawn) => drawn.clip_from_mesh(instance),
        }
    }

    /// Reports whether any part of a box is in the picture and not occluded.
    #[inline]
    pub(crate) fn is_box_visible(self, clip_from_mesh: &Mat4, bounds: &Bounds) -> bool {
        match self {
            Self::LargeFaces(buffer) => buffer.is_box_visible(clip_from_mesh, bounds),
            Self::FirstPassDepth(drawn) => drawn.is_visible(clip_from_mesh, bounds),
        }
    }
}

/// Occlusion buffer: large faces near the eye, rasterized into masked depth.
#[derive(Default)]
pub(crate) struct OcclusionBuffer {
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
    pub(crate) fn rasterize_faces(
        &mut self,
        (models, cache, buckets): (&[Option<GpuModel>], &IndexCache, &InstanceBuckets),
        camera: Option<&CameraView>,
        (size, samples): ([u32; 2], u32),
    ) {
        self.found.clear();
        self.corners.clear();
        let Some(camera) = camera else { return };
        self.clip_from_world = camera.clip_from_world();
        let frustum = Frustum::from_matrix(&self.clip_from_world);
        let square = camera.pixels_per_unit(size[1]).powi(2);
        let least = size[0] as f32 * size[1] as f32 * MIN_SCREEN_SHARE;
        let filter = FaceFilter {
            eye: camera.eye,
            square,
            least,
            near: (1.0 + (PI * square / least).sqrt()).powi(2),
            half: Vec2::new(size[0] as f32, size[1] as f32) * 0.5,
        };
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
    pub(crate) fn non_empty(&self) -> Option<&Self> {
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
        let eye = world_from_mesh.inverse().transform_point3(filter.eye).extend(1.0);
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
            if pixels >= filter.least && !is_outside_frustum(added) {
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
    pub(crate) fn is_occluded(&self, instance: &Instance, bounds: &Bounds) -> bool {
        !self.is_box_visible(&self.clip_from_mesh(instance), bounds)
    }

    fn clip_from_mesh(&self, instance: &Instance) -> Mat4 {
        self.clip_from_world * world_from_mesh(instance)
    }

    #[inline]
    fn is_box_visible(&self, clip_from_mesh: &Mat4, bounds: &Bounds) -> bool {
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
    let occluders = cache.get(key.mesh).filter(|_| key.morph.is_none())?.occluders();
    let model = models[key.mesh.model as usize].as_ref().filter(|_| !occluders.is_empty())?;
    Some(((model, &model.meshes[key.mesh.mesh as usize]), occluders))
}

/// From where one looks.
struct FaceFilter {
    eye: Vec3,
    /// Pixels that a square unit covers a unit away.
    square: f32,
    /// Pixels that a face must cover.
    least: f32,
    /// Greatest squared distance, in squared radii, at which a disc as large as a sphere covers
    /// enough pixels.
    near: f32,
    /// Pixels from the middle of the picture to its edges.
    half: Vec2,
}

impl FaceFilter {
    /// Reports whether any face within a sphere may be large enough to occlude.
    #[inline]
    fn is_near(&self, sphere: &BoundingSphere) -> bool {
        sphere.center.distance_squared(self.eye) <= self.near * sphere.radius * sphere.radius
    }

    /// Returns the least area of a face within a sphere that may cover enough pixels.
    #[inline]
    fn least_area(&self, sphere: &BoundingSphere) -> f32 {
        let distance = (sphere.center.distance(self.eye) - sphere.radius).max(0.0);
        self.least * distance * distance / self.square
    }

    /// Returns the pixels that a face covers by its corners in clip space, also beside the picture,
    /// and one over its least distance. Both are infinite where it reaches behind the eye.
    fn screen_size(&self, corners: &[Vec4]) -> (f32, f32) {
        let least = corners.iter().fold(f32::INFINITY, |least, corner| least.min(corner.w));
        if least <= 0.0 {
            return (f32::INFINITY, f32::INFINITY);
        }
        let place = |corner: &Vec4| Vec2::new(corner.x, corner.y) / corner.w * self.half;
        let mut last = corners.last().map(place).unwrap_or_default();
        let twice = corners
            .iter()
            .map(place)
            .fold(0.0, |twice, place| twice + std::mem::replace(&mut last, place).perp_dot(place));
        (0.5 * twice.abs(), least.recip())
    }
}

/// Reports whether a face is wholly outside the frustum.
fn is_outside_frustum(corners: &[Vec4]) -> bool {
    let all = |is_out: fn(&Vec4) -> bool| corners.iter().all(is_out);
    all(|corner| corner.x > corner.w)
        || all(|corner| corner.x < -corner.w)
        || all(|corner| corner.y > corner.w)
        || all(|corner| corner.y < -corner.w)
        || all(|corner| corner.z > corner.w)
}

/// Returns the instance's transform as a matrix.
pub(crate) fn world_from_mesh(instance: &Instance) -> Mat4 {
    let [x, y, z] = instance.world_from_mesh.map(Vec4::from_array);
    Mat4::from_cols(x, y, z, Vec4::W).transpose()
}
