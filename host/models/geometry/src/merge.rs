//! Mesh merging: many meshes, each at a cursor, become one mesh that collapses further (HLOD
//! proxies).
//!
//! What lies far off costs by the piece, not by the triangle. The parts' collapses that
//! are left are done in the order of their errors, so that the whole goes down as its
//! parts would, each within the same error.

use std::ops::Range;

use glam::{Mat3, Mat4, Vec3};

use crate::{Collapse, CollapseSequence, CollapseStacks, Mesh, NO_FEATURE, Section, SequenceError};

/// A mesh as part of a greater one.
#[derive(Clone, Debug)]
pub struct MergePart<'a> {
    /// Collapse stacks of the mesh.
    pub stacks: &'a CollapseStacks,
    /// Collapses done beforehand, which cannot be undone in the whole, to those that the
    /// whole may do.
    pub cursors: Range<u32>,
    /// From the part's space to that of the whole; it may mirror.
    pub transform: Mat4,
    /// Greatest scale factor of the transform, by which its errors are multiplied.
    pub stretch: f32,
    /// For each section of the mesh, its material in the whole, below `materials` of
    /// [`merge`].
    pub materials: &'a [u32],
    /// Feature of the whole that the part's feature 0 becomes; others follow it.
    pub first_feature: Option<u32>,
    /// Feature of triangles without a feature of their own.
    pub feature: u32,
}

/// Merges parts to a mesh with one section a material, and the collapses that are left.
///
/// # Errors
/// None where errors are numbers: what stacks hold was checked.
pub fn merge(
    parts: &[MergePart<'_>],
    materials: u32,
) -> Result<(Mesh, CollapseSequence), SequenceError> {
    let mut merged = Merger { corners: vec![Vec::new(); materials as usize], ..Merger::default() };
    for part in parts {
        merged.add(part);
    }
    merged.finish()
}

impl CollapseStacks {
    /// Bakes the mesh at a cursor into a new mesh, and returns it with the remaining collapses.
    /// Positions and sections keep their numbers, sections their materials.
    ///
    /// # Errors
    /// Returns the errors of [`merge`].
    pub fn baked_at_cursor(&self, cursor: u32) -> Result<(Mesh, CollapseSequence), SequenceError> {
        let sections = self.mesh().sections.len() as u32;
        let as_it_is = MergePart {
            stacks: self,
            cursors: cursor..self.collapse_count(),
            transform: Mat4::IDENTITY,
            stretch: 1.0,
            materials: &(0..sections).collect::<Vec<u32>>(),
            first_feature: Some(0),
            feature: NO_FEATURE,
        };
        let (mut mesh, left) = merge(&[as_it_is], sections)?;
        for (section, own) in mesh.sections.iter_mut().zip(&self.mesh().sections) {
            section.material = own.material;
        }
        Ok((mesh, left))
    }
}

#[derive(Default)]
struct Merger {
    mesh: Mesh,
    /// Triangles of each material.
    corners: Vec<Vec<[u32; 3]>>,
    collapses: Vec<Collapse>,
}

impl Merger {
    fn add(&mut self, part: &MergePart<'_>) {
        let MergePart { stacks, cursors, .. } = part;
        let cursor = cursors.start;
        let resolved = stacks.resolve(cursor);
        if resolved.triangles.is_empty() {
            return;
        }
        let first_position = self.mesh.positions.len() as u32;
        let surviving = stacks.surviving(cursor);
        self.add_positions(part, surviving);
        let wedge_of = self.add_wedges(part, surviving, first_position);
        let mirrored = part.transform.determinant() < 0.0;
        for (&material, range) in part.materials.iter().zip(&resolved.sections) {
            let corners = &resolved.triangles[as_usize(range)];
            let moved = corners.iter().map(|corners| {
                let [a, b, c] = corners.map(|wedge| wedge_of[wedge as usize]);
                // Seen from the same side as before.
                if mirrored { [a, c, b] } else { [a, b, c] }
            });
            self.corners[material as usize].extend(moved);
        }
        let left = stacks.collapses().enumerate();
        let left = left.take(cursors.end as usize).skip(cursor as usize);
        self.collapses.extend(left.map(|(entry, (removed, kept))| Collapse {
            removed: first_position + removed,
            kept: first_position + kept,
            error: stacks.error_at(entry as u32 + 1) * part.stretch,
        }));
    }

    fn add_positions(&mut self, part: &MergePart<'_>, surviving: u32) {
        let mesh = part.stacks.mesh();
        let moved = |&position: &Vec3| part.transform.transform_point3(position);
        self.mesh.positions.extend(mesh.positions[..surviving as usize].iter().map(moved));
        self.mesh.features.extend((0..surviving as usize).map(|position| {
            let own = mesh.features.get(position).copied().filter(|&f| f != crate::NO_FEATURE);
            own.zip(part.first_feature).map_or(part.feature, |(own, first)| first + own)
        }));
    }

    /// Adds the wedges of positions that survive; where each of the part's now is.
    fn add_wedges(&mut self, part: &MergePart<'_>, surviving: u32, first: u32) -> Vec<u32> {
        let wedges = &part.stacks.mesh().wedges;
        let columns = Mat3::from_mat4(part.transform);
        // Cofactors, as for any transform; a mirror turns them.
        let [x, y, z] = [columns.x_axis, columns.y_axis, columns.z_axis];
        let turn = Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let side = if columns.determinant() < 0.0 { -1.0 } else { 1.0 };
        let mut wedge_of = Vec::with_capacity(wedges.len());
        let merged = &mut self.mesh.wedges;
        for wedge in 0..wedges.len() {
            wedge_of.push(merged.position.len() as u32);
            if wedges.position[wedge] < surviving {
                merged.position.push(first + wedges.position[wedge]);
                merged.normal.push((turn * wedges.normal[wedge] * side).normalize_or_zero());
                merged.uv.push(wedges.uv[wedge]);
                let material = part.materials.get(wedges.section[wedge] as usize);
                merged.section.push(material.copied().unwrap_or_default());
            }
        }
        wedge_of
    }

    fn finish(mut self) -> Result<(Mesh, CollapseSequence), SequenceError> {
        for (material, corners) in (0..).zip(&self.corners) {
            self.mesh.sections.push(Section {
                material: Some(material),
                first_triangle: self.mesh.triangles.len() as u32,
                triangle_count: corners.len() as u32,
            });
            self.mesh.triangles.extend(corners);
        }
        // Stable: those of a part stay in their order.
        self.collapses.sort_by(|a, b| a.error.total_cmp(&b.error));
        let count = self.mesh.positions.len() as u32;
        Ok((self.mesh, CollapseSequence::new(self.collapses, count)?))
    }
}

fn as_usize(range: &Range<u32>) -> Range<usize> {
    range.start as usize..range.end as usize
}

#[cfg(test)]
mod tests {
    use glam::Quat;

    use super::*;
    use crate::{RawPrimitive, weld};

    /// Makes a fan of triangles that collapses onto its hub, in two materials.
    fn fan(spokes: u32, features: bool) -> CollapseStacks {
        let rim = |i: u32| Vec3::new((i as f32).cos(), (i as f32).sin(), 0.0);
        let primitive = |range: Range<u32>, material| RawPrimitive {
            positions: std::iter::once(Vec3::ZERO).chain((0..=spokes).map(rim)).collect(),
            normals: vec![Vec3::Z; spokes as usize + 2],
            triangles: range.map(|i| [0, i + 1, i + 2]).collect(),
            features: if features { vec![1; spokes as usize + 2] } else { Vec::new() },
            material: Some(material),
            ..Default::default()
        };
        let halves = [primitive(0..spokes / 2, 0), primitive(spokes / 2..spokes, 1)];
        let (mesh, _) = weld(&halves).unwrap();
        let hub = mesh.positions.iter().position(|&p| p == Vec3::ZERO).unwrap() as u32;
        let others = (0..mesh.positions.len() as u32).filter(|&p| p != hub);
        let entry = |(i, removed)| Collapse { removed, kept: hub, error: i as f32 * 0.1 };
        let entries = others.enumerate().map(entry).collect();
        let sequence = CollapseSequence::new(entries, mesh.positions.len() as u32).unwrap();
        CollapseStacks::build(mesh, &sequence)
    }

    fn part(stacks: &CollapseStacks, cursor: u32, transform: Mat4) -> MergePart<'_> {
        let stretch = transform.x_axis.length();
        let materials = &[0, 1];
        let cursors = cursor..stacks.collapse_count();
        MergePart {
            stacks,
            cursors,
            transform,
            stretch,
            materials,
            first_feature: None,
            feature: 7,
        }
    }

    /// Returns the live triangles as points, in a canonical order.
    fn points(stacks: &CollapseStacks, cursor: u32, transform: Mat4) -> Vec<[[i64; 3]; 3]> {
        let at = |p: u32| transform.transform_point3(stacks.mesh().positions[p as usize]);
        let rounded = |p: Vec3| p.to_array().map(|x| (f64::from(x) * 1e4).round() as i64);
        let mut found: Vec<_> = stacks
            .resolve(cursor)
            .position_triangles()
            .map(|t| {
                let mut corners = t.map(|p| rounded(at(p)));
                let least = (0..3).min_by_key(|&i| corners[i]).unwrap();
                corners.rotate_left(least);
                corners
            })
            .collect();
        found.sort_unstable();
        found
    }

    #[test]
    fn the_whole_goes_down_as_its_parts_do() {
        let (a, b) = (fan(20, false), fan(31, true));
        let there = Mat4::from_scale_rotation_translation(
            Vec3::splat(2.0),
            Quat::from_rotation_y(1.0),
            Vec3::new(10.0, 0.0, 0.0),
        );
        let parts = [part(&a, 3, Mat4::IDENTITY), part(&b, 0, there)];
        let (mesh, sequence) = merge(&parts, 2).unwrap();
        assert_eq!(sequence.len(), a.collapse_count() - 3 + b.collapse_count());
        let whole = CollapseStacks::build(mesh, &sequence);
        for error in [0.0, 0.3, 0.5, 1.0, 2.5, 9.0] {
            let mut expected = points(&a, a.cursor_for_error(error).max(3), Mat4::IDENTITY);
            expected.extend(points(&b, b.cursor_for_error(error / 2.0), there));
            expected.sort_unstable();
            assert_eq!(points(&whole, whole.cursor_for_error(error), Mat4::IDENTITY), expected);
        }
    }

    #[test]
    fn a_mirrored_part_faces_outwards_still() {
        let fan = fan(4, false);
        let mirror = Mat4::from_scale(Vec3::new(1.0, 1.0, -1.0));
        let (mesh, _) = merge(&[part(&fan, 0, mirror)], 2).unwrap();
        for &corners in &mesh.triangles {
            let [a, b, c] = mesh.corner_positions(corners).map(|p| mesh.positions[p as usize]);
            let normal = mesh.wedges.normal[corners[0] as usize];
            assert!((b - a).cross(c - a).dot(normal) > 0.0);
            assert!(normal.dot(Vec3::NEG_Z) > 0.99);
        }
    }

    #[test]
    fn features_and_materials_are_kept() {
        let (plain, featured) = (fan(4, false), fan(4, true));
        let of_features =
            MergePart { first_feature: Some(100), ..part(&featured, 0, Mat4::IDENTITY) };
        let (mesh, _) = merge(&[part(&plain, 0, Mat4::IDENTITY), of_features], 2).unwrap();
        let mut features: Vec<_> = mesh.triangles.iter().map(|&t| mesh.feature(t)).collect();
        features.sort_unstable();
        features.dedup();
        assert_eq!(features, [Some(7), Some(101)]);
        assert_eq!(mesh.sections.iter().map(|s| s.triangle_count).collect::<Vec<_>>(), [4, 4]);
        for section in &mesh.sections {
            let range = section.first_triangle..section.first_triangle + section.triangle_count;
            for wedge in mesh.triangles[as_usize(&range)].as_flattened() {
                assert_eq!(Some(mesh.wedges.section[*wedge as usize]), section.material);
            }
        }
    }

    #[test]
    fn a_part_goes_no_farther_than_it_may() {
        let fan = fan(20, false);
        let held = MergePart { cursors: 5..5, ..part(&fan, 5, Mat4::IDENTITY) };
        let (mesh, sequence) = merge(&[held, part(&fan, 5, Mat4::IDENTITY)], 2).unwrap();
        assert_eq!(sequence.len(), fan.collapse_count() - 5);
        let whole = CollapseStacks::build(mesh, &sequence);
        let left = whole.resolve(whole.collapse_count()).triangles.len() as u64;
        assert_eq!(left, fan.live_triangles(5));
    }

    #[test]
    fn baking_keeps_sections_and_their_materials() {
        let mut mesh = fan(20, false).into_mesh();
        mesh.sections[0].material = Some(9);
        mesh.sections[1].material = None;
        let none = CollapseSequence::empty(mesh.positions.len() as u32);
        let (baked, _) = CollapseStacks::build(mesh, &none).baked_at_cursor(0).unwrap();
        let materials: Vec<_> = baked.sections.iter().map(|section| section.material).collect();
        assert_eq!(materials, [Some(9), None]);
    }

    #[test]
    fn what_is_all_collapsed_adds_nothing() {
        let fan = fan(4, false);
        let all = part(&fan, fan.collapse_count(), Mat4::IDENTITY);
        let (mesh, sequence) = merge(&[all], 2).unwrap();
        assert!(mesh.positions.is_empty() && sequence.is_empty());
    }
}
