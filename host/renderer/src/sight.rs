//! What a frame need not draw: it is beside the picture, or hidden.

use std::f32::consts::PI;
use std::ops::Range;

use busbar_geometry::Bounds;
use busbar_shaders::Instance;
use glam::{Mat4, Vec2, Vec3, Vec4};

use crate::CameraView;
use crate::drawn_depth::DrawnDepth;
use crate::frustum::{Ball, Frustum};
use crate::index_cache::IndexCache;
use crate::masked_depth::MaskedDepth;
use crate::model::{GpuMesh, GpuModel};
use crate::occluders::{MAX_CORNERS, Occluder};
use crate::roster::{Kind, Members, Roster};

/// Of a picture, the share that a face must cover to be worth looking behind.
const LEAST_SHARE: f32 = 1.0 / 128.0;
/// Faces of a frame, those that cover most.
const MAX_FACES: usize = 1024;
/// Faces that are kept in mind until only those are.
const MAX_FOUND: usize = 4 * MAX_FACES;
/// An eye no farther before a face, as a share of how far it is from the mesh's origin, may be
/// behind it for all that rounding tells.
const ON_EDGE: f32 = 1e-5;

/// What a camera may see.
pub(crate) struct Sight<'a> {
    pub(crate) frustum: Frustum,
    /// What lies behind it is hidden; `None` where nothing is.
    pub(crate) before: Option<&'a Before>,
}

impl Sight<'_> {
    /// All in the picture, hidden or not.
    pub(crate) fn through(clip_from_world: &Mat4) -> Self {
        Self { frustum: Frustum::of(clip_from_world), before: None }
    }
}

/// What tells what is hidden.
#[derive(Clone, Copy)]
pub(crate) enum Hiding<'a> {
    Faces(&'a Before),
    Drawn(&'a DrawnDepth),
}

impl Hiding<'_> {
    /// Clip space from an instance's mesh, as [`Hiding::may_see_in`] takes it.
    pub(crate) fn clip_from_mesh(self, instance: &Instance) -> Mat4 {
        match self {
            Self::Faces(before) => before.clip_from_mesh(instance),
            Self::Drawn(drawn) => drawn.clip_from_mesh(instance),
        }
    }

    /// Whether anything in a box is in the picture and not hidden.
    #[inline]
    pub(crate) fn may_see_in(self, clip_from_mesh: &Mat4, bounds: &Bounds) -> bool {
        match self {
            Self::Faces(before) => before.may_see_in(clip_from_mesh, bounds),
            Self::Drawn(drawn) => drawn.may_see(clip_from_mesh, bounds),
        }
    }
}

/// Large faces that stand before the rest of the picture, and what they hide.
#[derive(Default)]
pub(crate) struct Before {
    clip_from_world: Mat4,
    depth: MaskedDepth,
    found: Vec<Found>,
    /// Clip space.
    corners: Vec<Vec4>,
}

/// A face in the picture.
struct Found {
    pixels: f32,
    /// One over its distance, at its nearest.
    nearest: f32,
    /// In [`Before::corners`].
    corners: Range<usize>,
}

impl Before {
    /// Looks for them among what a roster draws of resolved meshes; there are none without a
    /// camera.
    pub(crate) fn find(
        &mut self,
        (models, cache, roster): (&[Option<GpuModel>], &IndexCache, &Roster),
        camera: Option<&CameraView>,
        (size, samples): ([u32; 2], u32),
    ) {
        self.found.clear();
        self.corners.clear();
        let Some(camera) = camera else { return };
        self.clip_from_world = camera.clip_from_world();
        let frustum = Frustum::of(&self.clip_from_world);
        let square = camera.pixels_per_unit(size[1]).powi(2);
        let least = size[0] as f32 * size[1] as f32 * LEAST_SHARE;
        let look = Look {
            eye: camera.eye,
            square,
            least,
            near: (1.0 + (PI * square / least).sqrt()).powi(2),
            half: Vec2::new(size[0] as f32, size[1] as f32) * 0.5,
        };
        for Members { kind, members, balls, .. } in roster.members() {
            // Of most kinds nothing is near enough, and nothing more is looked up.
            let mut of_kind = None;
            let near = members.iter().zip(balls).filter(|(_, ball)| look.is_near(ball));
            for (member, ball) in near.filter(|(_, ball)| frustum.may_see(ball)) {
                let found = of_kind.get_or_insert_with(|| faces_of(models, cache, kind));
                let Some((of, occluders)) = found else { break };
                let instance = &roster.instances[member.slot as usize];
                self.find_of((instance, ball), *of, occluders, &look);
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
        for Found { corners, .. } in &self.found {
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
        for Found { corners, .. } in &mut self.found {
            let first = kept.len();
            kept.extend_from_slice(&self.corners[corners.clone()]);
            *corners = first..kept.len();
        }
        self.corners = kept;
    }

    /// Itself, where there are any.
    pub(crate) fn seen(&self) -> Option<&Self> {
        (!self.found.is_empty()).then_some(self)
    }

    /// Looks for them on an instance.
    fn find_of(
        &mut self,
        (instance, ball): (&Instance, &Ball),
        (model, mesh): (&GpuModel, &GpuMesh),
        occluders: &[Occluder],
        look: &Look,
    ) {
        let stretch = ball.radius / mesh.ball.radius;
        let least_area = look.least_area(ball) / (stretch * stretch);
        let is_large = |face: &&Occluder| face.area >= least_area;
        // Of most there are none, and nothing more is worked out.
        if !occluders.first().is_some_and(|first| is_large(&first)) {
            return;
        }
        let world_from_mesh = world_from_mesh(instance);
        let clip_from_mesh = self.clip_from_world * world_from_mesh;
        let eye = world_from_mesh.inverse().transform_point3(look.eye).extend(1.0);
        let on_edge = ON_EDGE * (eye.truncate().length() + mesh.ball.center.length());
        for Occluder { plane, corners, section, .. } in occluders.iter().take_while(is_large) {
            let section = &mesh.stacks.mesh().sections[*section as usize];
            let material = model.material(section.material);
            let is_seen = material.double_sided || plane.dot(eye) > on_edge;
            if !(material.opaque && is_seen) {
                continue;
            }
            let first = self.corners.len();
            self.corners.extend(corners.iter().map(|corner| clip_from_mesh * corner.extend(1.0)));
            let added = &self.corners[first..];
            let (pixels, nearest) = look.size_of(added);
            if pixels >= look.least && !is_beside(added) {
                self.found.push(Found { pixels, nearest, corners: first..self.corners.len() });
            } else {
                self.corners.truncate(first);
            }
        }
    }

    /// Whether nothing in a box of an instance's mesh is seen.
    #[inline]
    pub(crate) fn hides(&self, instance: &Instance, bounds: &Bounds) -> bool {
        !self.may_see_in(&self.clip_from_mesh(instance), bounds)
    }

    fn clip_from_mesh(&self, instance: &Instance) -> Mat4 {
        self.clip_from_world * world_from_mesh(instance)
    }

    #[inline]
    fn may_see_in(&self, clip_from_mesh: &Mat4, bounds: &Bounds) -> bool {
        self.depth.may_see(clip_from_mesh, bounds)
    }
}

/// The large faces of a kind that is not on its way anywhere, and what they are of; `None`
/// where there are none.
fn faces_of<'a>(
    models: &'a [Option<GpuModel>],
    cache: &'a IndexCache,
    kind: &Kind,
) -> Option<((&'a GpuModel, &'a GpuMesh), &'a [Occluder])> {
    let occluders = cache.get(kind.key).filter(|_| kind.way.is_none())?.occluders();
    let model = models[kind.key.model as usize].as_ref().filter(|_| !occluders.is_empty())?;
    Some(((model, &model.meshes[kind.key.mesh as usize]), occluders))
}

/// From where one looks.
struct Look {
    eye: Vec3,
    /// Pixels that a square unit covers a unit away.
    square: f32,
    /// Pixels that a face must cover.
    least: f32,
    /// Within so many of its squared radii a disc as large as a ball covers them.
    near: f32,
    /// Pixels from the middle of the picture to its edges.
    half: Vec2,
}

impl Look {
    /// Whether anything in a ball may cover as much as is worth looking behind.
    #[inline]
    fn is_near(&self, ball: &Ball) -> bool {
        ball.center.distance_squared(self.eye) <= self.near * ball.radius * ball.radius
    }

    /// The least area anywhere in a ball that may cover as much as is worth looking behind.
    #[inline]
    fn least_area(&self, ball: &Ball) -> f32 {
        let distance = (ball.center.distance(self.eye) - ball.radius).max(0.0);
        self.least * distance * distance / self.square
    }

    /// The pixels that a face covers by its corners in clip space, also beside the picture,
    /// and one over its least distance; no end of either where it reaches behind the eye.
    fn size_of(&self, corners: &[Vec4]) -> (f32, f32) {
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

/// Whether a face is wholly beside the picture, or behind it.
fn is_beside(corners: &[Vec4]) -> bool {
    let all = |is_out: fn(&Vec4) -> bool| corners.iter().all(is_out);
    all(|corner| corner.x > corner.w)
        || all(|corner| corner.x < -corner.w)
        || all(|corner| corner.y > corner.w)
        || all(|corner| corner.y < -corner.w)
        || all(|corner| corner.z > corner.w)
}

/// As a matrix.
pub(crate) fn world_from_mesh(instance: &Instance) -> Mat4 {
    let [x, y, z] = instance.world_from_mesh.map(Vec4::from_array);
    Mat4::from_cols(x, y, z, Vec4::W).transpose()
}
