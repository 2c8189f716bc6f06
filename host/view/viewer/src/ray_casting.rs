//! Ray casting against meshes at full detail: picking of surface points.

use busbar_geometry::{Bounds, Mesh};
use busbar_renderer::{CameraView, SectionPlane};
use busbar_scene::{MeshInstance, NodeIndex, SceneGraph};
use glam::{DMat4, DVec3, dvec3};

use busbar_scene_loader::LoadedModel;

/// Half a line, from where the picture begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Ray {
    /// Origin in world space, metres.
    pub(crate) origin: DVec3,
    /// Direction, a unit vector.
    pub(crate) direction: DVec3,
}

impl Ray {
    /// Creates the ray through a position in a picture; position and size are in pixels from the
    /// upper left corner.
    pub(crate) fn through_pixel(view: &CameraView, at: [f64; 2], size: [u32; 2]) -> Self {
        let [projection, camera] = [view.projection, view.camera_from_world].map(|m| m.as_dmat4());
        let world_from_clip: DMat4 = (projection * camera).inverse();
        let [x, y] = [0, 1].map(|axis| at[axis] / f64::from(size[axis].max(1)) * 2.0 - 1.0);
        // The near plane is at depth 1, and what is far beyond it at less.
        let [origin, beyond] = [1.0, 0.5].map(|z| world_from_clip.project_point3(dvec3(x, y, z)));
        Self { origin, direction: (beyond - origin).normalize_or_zero() }
    }

    pub(crate) fn at(&self, distance: f64) -> DVec3 {
        self.origin + self.direction * distance
    }

    /// The point of an edge that the ray's line passes closest by.
    fn closest_of_edge(self, [from, to]: [DVec3; 2]) -> DVec3 {
        let (edge, before) = (to - from, from - self.origin);
        let (slant, length) = (self.direction.dot(edge), edge.length_squared());
        let apart = length - slant * slant;
        let share = (slant * self.direction.dot(before) - edge.dot(before)) / apart;
        // Parallel, all its points are as close.
        if share.is_finite() { from + edge * share.clamp(0.0, 1.0) } else { from }
    }

    /// Returns the distance to a box (slab method); `None` for a miss.
    fn distance_to_bounds(self, bounds: &Bounds) -> Option<f64> {
        let (mut enters, mut leaves) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let [low, high] =
                [bounds.min, bounds.max].map(|corner| f64::from(corner[axis]) - self.origin[axis]);
            let way = self.direction[axis];
            if way == 0.0 {
                if low > 0.0 || high < 0.0 {
                    return None;
                }
                continue;
            }
            let [a, b] = [low / way, high / way];
            (enters, leaves) = (enters.max(a.min(b)), leaves.min(a.max(b)));
        }
        (enters <= leaves).then_some(enters)
    }

    /// Returns the distance to a triangle from either side (T. Möller and B. Trumbore, "Fast,
    /// Minimum Storage Ray/Triangle Intersection", 1997).
    fn distance_to_triangle(self, [a, b, c]: [DVec3; 3]) -> Option<f64> {
        let (ab, ac) = (b - a, c - a);
        let across = self.direction.cross(ac);
        let determinant = ab.dot(across);
        if determinant == 0.0 {
            return None;
        }
        let from = self.origin - a;
        let u = from.dot(across) / determinant;
        let along = from.cross(ab);
        let v = self.direction.dot(along) / determinant;
        let distance = ac.dot(along) / determinant;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance >= 0.0).then_some(distance)
    }
}

/// Surfaces for ray casts: the models of a scene, clipped by its section plane.
#[derive(Clone, Copy)]
pub(crate) struct SceneSurfaces<'a> {
    pub(crate) graph: &'a SceneGraph,
    pub(crate) models: &'a [LoadedModel],
    pub(crate) section: Option<SectionPlane>,
}

impl SceneSurfaces<'_> {
    fn shows(&self, point: DVec3) -> bool {
        self.section.is_none_or(|SectionPlane { normal, distance }| {
            normal.as_dvec3().dot(point) <= f64::from(distance)
        })
    }
}

/// Returns the nearest intersection of a ray with a node at full detail. A ray may miss a node that
/// was drawn coarser or widened. Then the nearest point of one of its edges is returned.
pub(crate) fn surface_point(
    surfaces: &SceneSurfaces<'_>,
    node: NodeIndex,
    ray: &Ray,
) -> Option<DVec3> {
    let hit = distance_to_node(surfaces, node, ray);
    hit.map(|distance| ray.at(distance)).or_else(|| {
        let mut closest: Option<(f64, DVec3)> = None;
        for_each_triangle(
            surfaces,
            node,
            |_| true,
            |corners| {
                let [a, b, c] = corners;
                for edge in [[a, b], [b, c], [c, a]] {
                    let point = ray.closest_of_edge(edge);
                    let along = (point - ray.origin).dot(ray.direction).max(0.0);
                    let aside = ray.at(along).distance(point) / along.max(1e-3);
                    if closest.is_none_or(|(least, _)| aside < least) {
                        closest = Some((aside, point));
                    }
                }
            },
        );
        closest.map(|(_, point)| point)
    })
}

/// Returns the distance along a ray to the nearest surface of a node.
pub(crate) fn distance_to_node(
    surfaces: &SceneSurfaces<'_>,
    node: NodeIndex,
    ray: &Ray,
) -> Option<f64> {
    let mut nearest: Option<f64> = None;
    let may_hit = |bounds: &Bounds| ray.distance_to_bounds(bounds).is_some();
    for_each_triangle(surfaces, node, may_hit, |corners| {
        if let Some(distance) = ray.distance_to_triangle(corners)
            && nearest.is_none_or(|least| distance < least)
            && surfaces.shows(ray.at(distance))
        {
            nearest = Some(distance);
        }
    });
    nearest
}

/// Visits the triangles, in world space, of the instances of a node whose bounds may be
/// wanted; of a feature, its own.
fn for_each_triangle(
    surfaces: &SceneSurfaces<'_>,
    node: NodeIndex,
    is_wanted: impl Fn(&Bounds) -> bool,
    mut visit: impl FnMut([DVec3; 3]),
) {
    let SceneSurfaces { graph, models, .. } = surfaces;
    for instance in graph.instances() {
        let Some(shows) = MeshPart::for_node(graph, &instance, node) else { continue };
        // Rounding must not let it be missed.
        let grown = |b: Bounds| {
            let by = 1e-3 + 1e-5 * b.max.abs().max(b.min.abs()).max_element();
            Bounds { min: b.min - by, max: b.max + by }
        };
        if !graph.bounds_of_mesh(&instance).map(grown).is_some_and(|bounds| is_wanted(&bounds)) {
            continue;
        }
        let model = models.get(instance.model.0 as usize);
        let stacks = model.and_then(|model| model.stacks.get(instance.mesh as usize));
        let Some(mesh) = stacks.map(|stacks| stacks.mesh()) else { continue };
        let to_world = graph.world_from_mesh(&instance).as_dmat4();
        for &triangle in &mesh.triangles {
            if shows.includes(mesh, triangle) {
                let corner = |position: u32| mesh.positions[position as usize].as_dvec3();
                let corners = mesh.corner_positions(triangle).map(corner);
                visit(corners.map(|corner| to_world.transform_point3(corner)));
            }
        }
    }
}

/// Part of an instance's mesh that belongs to a node.
enum MeshPart {
    All,
    Feature(u32),
    WithoutFeature,
}

impl MeshPart {
    fn for_node(graph: &SceneGraph, instance: &MeshInstance, node: NodeIndex) -> Option<Self> {
        match instance.first_feature {
            None => (instance.node == node).then_some(Self::All),
            Some(_) if instance.node == node => Some(Self::WithoutFeature),
            Some(first) if graph.node(node).parent() == Some(instance.node) => {
                node.0.checked_sub(first.0).map(Self::Feature)
            }
            Some(_) => None,
        }
    }

    fn includes(&self, mesh: &Mesh, triangle: [u32; 3]) -> bool {
        match self {
            Self::All => true,
            Self::Feature(feature) => mesh.feature(triangle) == Some(*feature),
            Self::WithoutFeature => mesh.feature(triangle).is_none(),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use busbar_geometry::{CollapseSequence, CollapseStacks, RawPrimitive, weld};
    use busbar_scene::{Model, ModelIndex, ModelNode, Placement, Transform};
    use glam::{Vec3, vec3};

    use super::*;

    const CORNERS: [DVec3; 3] = [dvec3(0.0, 0.0, 0.0), dvec3(4.0, 0.0, 0.0), dvec3(0.0, 4.0, 0.0)];

    #[test]
    fn a_triangle_is_hit_inside_and_from_both_sides() {
        for side in [-1.0, 1.0] {
            let ray = |x: f64, y: f64| Ray {
                origin: dvec3(x, y, 5.0 * side),
                direction: DVec3::NEG_Z * side,
            };
            assert_eq!(ray(1.0, 1.0).distance_to_triangle(CORNERS), Some(5.0));
            assert_eq!(ray(3.0, 3.0).distance_to_triangle(CORNERS), None);
            assert_eq!(ray(-0.1, 1.0).distance_to_triangle(CORNERS), None);
        }
        let away = Ray { origin: dvec3(1.0, 1.0, 5.0), direction: DVec3::Z };
        assert_eq!(away.distance_to_triangle(CORNERS), None);
    }

    #[test]
    fn ray_entry_into_a_box_is_correct_along_an_axis_and_from_inside() {
        let bounds = Bounds { min: Vec3::ZERO, max: Vec3::splat(2.0) };
        let ray = |origin: DVec3| Ray { origin, direction: DVec3::X };
        assert_eq!(ray(dvec3(-3.0, 1.0, 0.0)).distance_to_bounds(&bounds), Some(3.0));
        assert_eq!(ray(dvec3(1.0, 1.0, 1.0)).distance_to_bounds(&bounds), Some(0.0));
        assert_eq!(ray(dvec3(-3.0, 3.0, 1.0)).distance_to_bounds(&bounds), None);
        assert_eq!(ray(dvec3(3.0, 1.0, 1.0)).distance_to_bounds(&bounds), None);
    }

    /// Two triangles, one behind the other along z, drawn 10 m to the right.
    fn scene() -> (SceneGraph, Vec<LoadedModel>) {
        let corner = |z: f32| [vec3(0.0, 0.0, z), vec3(4.0, 0.0, z), vec3(0.0, 4.0, z)];
        let primitive = RawPrimitive {
            positions: [corner(0.0), corner(-5.0)].concat(),
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            ..Default::default()
        };
        let mesh = weld(&[primitive]).unwrap().0;
        let sequence = CollapseSequence::new(Vec::new(), mesh.positions.len() as u32).unwrap();
        let node = ModelNode {
            name: "mesh".into(),
            parent: None,
            parent_from_node: glam::DMat4::IDENTITY,
            mesh: Some(0),
        };
        let model = Model { meshes: vec![mesh.clone()], nodes: vec![node], ..Default::default() };
        let placement = Placement {
            id: "plates".into(),
            parent: None,
            transform: Transform { translation: glam::DVec3::X * 10.0, ..Default::default() },
            model: Some(ModelIndex(0)),
            theta: None,
        };
        let graph = SceneGraph::build(&[placement], std::slice::from_ref(&model)).unwrap();
        let stacks = vec![Arc::new(CollapseStacks::build(mesh, &sequence))];
        let mut loaded = LoadedModel::default();
        loaded.stacks = stacks;
        (graph, vec![loaded])
    }

    #[test]
    fn the_nearest_visible_surface_is_hit_or_else_an_edge() {
        let (graph, models) = scene();
        let node = graph.find("plates/mesh").unwrap();
        let met = |x: f64, section| {
            let surfaces = SceneSurfaces { graph: &graph, models: &models, section };
            let ray = Ray { origin: dvec3(x, 1.0, 5.0), direction: DVec3::NEG_Z };
            surface_point(&surfaces, node, &ray)
        };
        assert_eq!(met(11.0, None), Some(dvec3(11.0, 1.0, 0.0)));
        let open = Some(SectionPlane { normal: Vec3::Z, distance: -1.0 });
        assert_eq!(met(11.0, open), Some(dvec3(11.0, 1.0, -5.0)), "what is before is cut away");
        assert_eq!(
            met(11.0, Some(SectionPlane { normal: Vec3::NEG_Z, distance: 1.0 })),
            Some(dvec3(11.0, 1.0, 0.0))
        );
        let beside = met(9.9, None).unwrap();
        let aside = (beside.x - 10.0).abs() + (beside.y - 1.0).abs();
        assert!(aside < 1e-6, "passed by: the closest point of an edge, {beside}");
        let other = graph.find("plates").unwrap();
        let surfaces = SceneSurfaces { graph: &graph, models: &models, section: None };
        let ray = Ray { origin: dvec3(11.0, 1.0, 5.0), direction: DVec3::NEG_Z };
        assert_eq!(surface_point(&surfaces, other, &ray), None, "nothing shows as that node");
    }

    /// A line of sight leads to what its pixel shows, near and far, with and without
    /// perspective, to a fraction of a millimetre.
    #[test]
    fn rays_pass_through_the_points_that_their_pixels_show() {
        let (eye, target, size) = (vec3(120.0, 30.0, -80.0), vec3(100.0, 2.0, -100.0), [1280, 720]);
        let views = [
            CameraView::look_at(eye, target, Vec3::Y, 0.8, 16.0 / 9.0, 0.2),
            CameraView::orthographic(eye, target, Vec3::Y, 40.0, 16.0 / 9.0, 300.0),
        ];
        for view in views {
            for world in [target, vec3(95.0, 0.0, -103.0), vec3(60.0, 8.0, -150.0)] {
                let clip = (view.projection.as_dmat4() * view.camera_from_world.as_dmat4())
                    .project_point3(world.as_dvec3());
                let at = [(clip.x + 1.0) * 640.0, (clip.y + 1.0) * 360.0];
                let ray = Ray::through_pixel(&view, at, size);
                let along = (world.as_dvec3() - ray.origin).dot(ray.direction);
                let aside = ray.at(along).distance(world.as_dvec3());
                assert!(aside < 2e-4 && along > 0.0, "{aside} m beside {world}");
            }
        }
    }
}
