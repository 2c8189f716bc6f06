//! Level-of-detail extraction: the live triangles of a mesh at a cursor.

use glam::Vec3;

use super::{CollapseStacks, ResolvedMesh};
use crate::Section;

/// Wedges on either side of a wedge that are looked at for a better one.
const MAX_CANDIDATES: usize = 64;
/// Least cosine between the normal of a moved triangle and those of its wedges: 78 degrees. Normals
/// that lean farther make stripes. Others are nearer to the imported shading than to the triangle's.
const MIN_FACING_COSINE: f32 = 0.2;
/// No wedge has this index.
const UNKNOWN: u32 = u32::MAX;

impl CollapseStacks {
    /// Resolves the mesh at a cursor by filtering and relabelling triangles.
    pub fn resolve(&self, cursor: u32) -> ResolvedMesh<'_> {
        let live = self.live_triangles(cursor) as usize;
        if cursor == 0 && live == self.mesh.triangles.len() {
            return self.imported();
        }
        if 3 * live < self.mesh.wedges.len() {
            let mut few = self.filter(cursor, live, |corners| corners);
            if self.climb(few.triangles.as_flattened_mut(), cursor).is_some() {
                for (corners, number) in few.triangles.iter_mut().zip(self.live(cursor)) {
                    *corners = self.fit_wedges(self.mesh.triangles[number as usize], *corners);
                }
                return few;
            }
        }
        let standing = self.representative_wedges(cursor);
        self.filter(cursor, live, |corners| {
            self.fit_wedges(corners, corners.map(|wedge| standing[wedge as usize]))
        })
    }

    /// Returns the mesh without any removed triangle.
    fn imported(&self) -> ResolvedMesh<'_> {
        let range = |s: &Section| s.first_triangle..s.first_triangle + s.triangle_count;
        ResolvedMesh {
            stacks: self,
            triangles: self.mesh.triangles.clone(),
            sections: self.mesh.sections.iter().map(range).collect(),
        }
    }

    /// Filters the live triangles and relabels their corners.
    fn filter(
        &self,
        cursor: u32,
        live: usize,
        stand: impl Fn([u32; 3]) -> [u32; 3],
    ) -> ResolvedMesh<'_> {
        let mut resolved = ResolvedMesh {
            stacks: self,
            triangles: Vec::with_capacity(live),
            sections: Vec::with_capacity(self.mesh.sections.len()),
        };
        for section in &self.mesh.sections {
            let start = resolved.triangles.len() as u32;
            let first = section.first_triangle as usize;
            let all = first..first + section.triangle_count as usize;
            let triangles = self.mesh.triangles[all.clone()].iter();
            let deaths = &self.tables.removal_cursor[all];
            let live = triangles.zip(deaths).filter(|&(_, &death)| death > cursor);
            resolved.triangles.extend(live.map(|(&corners, _)| stand(corners)));
            resolved.sections.push(start..resolved.triangles.len() as u32);
        }
        resolved
    }

    /// Replaces wedges of a moved triangle whose normals lean from it by more than
    /// [`MIN_FACING_COSINE`] allows, each by another one at the same position. A triangle that did
    /// not move keeps its own.
    fn fit_wedges(&self, imported: [u32; 3], standing: [u32; 3]) -> [u32; 3] {
        if imported == standing {
            return standing;
        }
        let wedges = &self.mesh.wedges;
        let normal = self.triangle_normal(standing);
        // Where a triangle is wound against its normals, so are its neighbours.
        let of_corners: Vec3 = imported.iter().map(|&wedge| wedges.normal[wedge as usize]).sum();
        let is_inverted = self.triangle_normal(imported).dot(of_corners) < 0.0;
        let normal = if is_inverted { -normal } else { normal };
        standing.map(|wedge| self.wedge_facing(wedge, normal))
    }

    /// Returns a wedge if its normal leans little from a unit normal. Otherwise returns the wedge of
    /// its position and section with the nearest normal and texture coordinate.
    fn wedge_facing(&self, standing: u32, normal: Vec3) -> u32 {
        let wedges = &self.mesh.wedges;
        let own = standing as usize;
        let cosine = |wedge: usize| wedges.normal[wedge].normalize_or_zero().dot(normal);
        if normal == Vec3::ZERO || cosine(own) >= MIN_FACING_COSINE {
            return standing;
        }
        let misfit = |wedge: usize| 1.0 - cosine(wedge) + wedges.uv[wedge].distance(wedges.uv[own]);
        let is_at_position = |&wedge: &usize| wedges.position[wedge] == wedges.position[own];
        let before = (0..own).rev().take(MAX_CANDIDATES).take_while(is_at_position);
        let after = (own + 1..wedges.len()).take(MAX_CANDIDATES).take_while(is_at_position);
        let mut best = (misfit(own), own);
        for wedge in before.chain(after).filter(|&w| wedges.section[w] == wedges.section[own]) {
            let found = misfit(wedge);
            if found < best.0 {
                best = (found, wedge);
            }
        }
        best.1 as u32
    }

    /// Computes the unit normal of a triangle by its winding; zero without area.
    fn triangle_normal(&self, corners: [u32; 3]) -> Vec3 {
        let positions = self.mesh.corner_positions(corners);
        let [a, b, c] = positions.map(|position| self.mesh.positions[position as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// Moves corners up to their first surviving ancestors, all by one step at a time and without
    /// unpredictable branches. Gives up where that takes more steps than there are wedges.
    fn climb(&self, corners: &mut [u32], cursor: u32) -> Option<()> {
        let surviving = self.surviving(cursor);
        let is_removed = |wedge: u32| self.mesh.wedges.position[wedge as usize] >= surviving;
        let mut pending = vec![0; corners.len()];
        let mut count = 0;
        for (corner, &wedge) in (0..).zip(&*corners) {
            pending[count] = corner;
            count += usize::from(is_removed(wedge));
        }
        pending.truncate(count);
        let mut steps_left = self.mesh.wedges.len();
        while !pending.is_empty() {
            steps_left = steps_left.checked_sub(pending.len())?;
            let mut kept = 0;
            for i in 0..pending.len() {
                let corner = pending[i];
                let parent = self.parent(corners[corner as usize] as usize) as u32;
                corners[corner as usize] = parent;
                pending[kept] = corner;
                kept += usize::from(is_removed(parent));
            }
            pending.truncate(kept);
        }
        Some(())
    }

    /// Returns the representative of each wedge at a cursor.
    pub fn representative_wedges(&self, cursor: u32) -> Vec<u32> {
        let positions = self.mesh.wedges.position.as_slice();
        let surviving = self.surviving(cursor);
        let mut standing = vec![UNKNOWN; positions.len()];
        for wedge in 0..positions.len() {
            // Up to an ancestor that survives, or whose own is known...
            let mut ancestor = wedge;
            while standing[ancestor] == UNKNOWN && positions[ancestor] >= surviving {
                ancestor = self.parent(ancestor);
            }
            let stands = match standing[ancestor] {
                UNKNOWN => ancestor as u32,
                known => known,
            };
            standing[ancestor] = stands;
            // ...and once more to tell all on the way, so that no chain is
            // climbed twice however long it is.
            let mut descendant = wedge;
            while descendant != ancestor {
                standing[descendant] = stands;
                descendant = self.parent(descendant);
            }
        }
        standing
    }

    /// Returns the parent of a wedge, which represents it once its position is removed.
    fn parent(&self, wedge: usize) -> usize {
        let fixed = self.position_count() - self.collapse_count();
        let removed = self.mesh.wedges.position[wedge] - fixed;
        let start = self.tables.parent_start[removed as usize];
        start as usize + usize::from(self.tables.parent_offset[wedge])
    }
}
