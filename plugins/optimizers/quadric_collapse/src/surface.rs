//! Half-edge connectivity of one piece while it is being simplified.

use busbar_plugin_sdk::Mesh;
use glam::DVec3;

use crate::pieces::{PieceView, Triangles, point};

/// Ends a list of corners, and marks a triangle that has died.
const NONE: u32 = u32::MAX;

/// Triangles at a vertex that are looked at. A vertex with more is a hub: it
/// stays until fewer are left, so that the work a collapse is bounded.
pub(crate) const MAX_RING: usize = 512;

/// Triangles of one piece with, for each vertex, a linked list of the corners
/// there. Corner `3t + k` is the k-th of triangle `t`. Vertices are numbered
/// within the piece, wedges as in the mesh.
#[derive(Default)]
pub(crate) struct Surface {
    /// The vertices as the mesh numbers them, ascending.
    pub(crate) vertices: Vec<u32>,
    /// Positions of the vertices, metres.
    pub(crate) positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Wedges of the corners; empty without attributes.
    wedges: Vec<[u32; 3]>,
    next: Vec<[u32; 3]>,
    first: Vec<u32>,
    /// Open vertices: each has, or took over, an edge without exactly one triangle on either side.
    pub(crate) open: Vec<bool>,
    /// Vertices that stay where they are, and that none moves onto: some of
    /// their triangles are elsewhere.
    pub(crate) frozen: Vec<bool>,
    marks: Vec<u32>,
    mark: u32,
}

/// A triangle as seen from one of its vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spoke {
    /// The vertex that follows counter-clockwise.
    pub(crate) ahead: u32,
    /// The vertex before it.
    pub(crate) behind: u32,
    /// Wedges here, ahead and behind; zero without attributes.
    pub(crate) wedges: [u32; 3],
}

impl Spoke {
    /// Reports whether another vertex's triangle is over the same edge.
    pub(crate) fn is_over(&self, other: &Spoke) -> bool {
        let (a, b) = (self.ahead, self.behind);
        (a, b) == (other.ahead, other.behind) || (b, a) == (other.ahead, other.behind)
    }
}

impl Surface {
    /// Loads a piece of a mesh in place of the last one. Positions are taken relative to `center`:
    /// quadrics far from their origin cancel badly.
    pub(crate) fn load(&mut self, mesh: &Mesh<'_>, piece: &PieceView<'_>, center: DVec3) {
        self.vertices.clear();
        self.vertices.extend(piece.vertices);
        self.positions.clear();
        self.positions.extend(piece.vertices.iter().map(|&v| point(mesh, v) - center));
        self.triangles.clear();
        self.wedges.clear();
        let local = |v: u32| piece.places[v as usize];
        match piece.triangles {
            Triangles::Mesh(indices) => {
                let corners = indices.iter().map(|&t| mesh.triangles[t as usize].map(local));
                self.triangles.extend(corners);
                if let Some(wedges) = &mesh.wedges {
                    self.wedges.extend(indices.iter().map(|&t| wedges.corners[t as usize]));
                }
            }
            Triangles::Own { corners, wedges } => {
                self.triangles.extend(corners.iter().map(|corners| corners.map(local)));
                self.wedges.extend(wedges);
            }
        }
        for (list, value) in [(&mut self.first, NONE), (&mut self.marks, 0)] {
            list.clear();
            list.resize(piece.vertices.len(), value);
        }
        self.mark = 0;
        for flags in [&mut self.open, &mut self.frozen] {
            flags.clear();
            flags.resize(piece.vertices.len(), false);
        }
        self.next.clear();
        self.next.resize(self.triangles.len(), [NONE; 3]);
        for (t, triangle) in self.triangles.iter().enumerate().rev() {
            for (k, &vertex) in triangle.iter().enumerate() {
                let first = &mut self.first[vertex as usize];
                self.next[t][k] = std::mem::replace(first, (3 * t + k) as u32);
            }
        }
    }

    /// Returns the number of vertices, dead ones included.
    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }

    /// Reports whether no triangle is left at a vertex.
    pub(crate) fn is_bare(&mut self, vertex: u32) -> bool {
        let mut corner = self.first[vertex as usize];
        while corner != NONE && self.triangles[corner as usize / 3][0] == NONE {
            corner = self.next[corner as usize / 3][corner as usize % 3];
        }
        self.first[vertex as usize] = corner;
        corner == NONE
    }

    /// Writes the triangles at a vertex to `ring`, and takes dead ones out of
    /// its list. Returns false at a hub, a vertex with more than [`MAX_RING`]:
    /// then some are missing.
    #[inline]
    pub(crate) fn ring(&mut self, vertex: u32, ring: &mut Vec<Spoke>) -> bool {
        ring.clear();
        let mut before = NONE;
        let mut corner = self.first[vertex as usize];
        while corner != NONE {
            let (t, k) = (corner as usize / 3, corner as usize % 3);
            let following = self.next[t][k];
            let triangle = &self.triangles[t];
            if triangle[0] != NONE {
                if ring.len() == MAX_RING {
                    return false;
                }
                let (l, m) = (FOLLOWING[k], FOLLOWING[FOLLOWING[k]]);
                let wedges = self.wedges.get(t).map_or([0; 3], |w| [w[k], w[l], w[m]]);
                ring.push(Spoke { ahead: triangle[l], behind: triangle[m], wedges });
                before = corner;
            } else if before == NONE {
                self.first[vertex as usize] = following;
            } else {
                self.next[before as usize / 3][before as usize % 3] = following;
            }
            corner = following;
        }
        true
    }

    /// Iterates over all live triangles, as vertices of the mesh, with their wedges; those are [0;
    /// 3] without attributes.
    pub(crate) fn live(&self) -> impl Iterator<Item = ([u32; 3], [u32; 3])> {
        let live = self.triangles.iter().enumerate().filter(|(_, corners)| corners[0] != NONE);
        live.map(|(t, corners)| {
            let wedges = self.wedges.get(t).copied().unwrap_or_default();
            (corners.map(|v| self.vertices[v as usize]), wedges)
        })
    }

    /// Iterates over all live triangles.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + Clone {
        self.triangles.iter().filter(|t| t[0] != NONE).copied()
    }

    /// Moves a vertex onto another. Triangles that had both die; `wedge_of`
    /// gives the wedge that a moved corner's becomes.
    pub(crate) fn collapse(&mut self, removed: u32, kept: u32, wedge_of: impl Fn(u32) -> u32) {
        let mut corner = std::mem::replace(&mut self.first[removed as usize], NONE);
        while corner != NONE {
            let (t, k) = (corner as usize / 3, corner as usize % 3);
            let following = self.next[t][k];
            let triangle = &mut self.triangles[t];
            if triangle.contains(&kept) {
                triangle[0] = NONE;
            } else if triangle[0] != NONE {
                triangle[k] = kept;
                if let Some(wedges) = self.wedges.get_mut(t) {
                    wedges[k] = wedge_of(wedges[k]);
                }
                self.next[t][k] = std::mem::replace(&mut self.first[kept as usize], corner);
            }
            corner = following;
        }
        self.open[kept as usize] |= self.open[removed as usize];
    }

    /// Begins a set of vertices; the one before is gone.
    pub(crate) fn begin_marks(&mut self) {
        if self.mark >= u32::MAX - 3 {
            self.marks.fill(0);
            self.mark = 0;
        }
        // One for what is in the set, and one for what was visited there.
        self.mark += 2;
    }

    /// Puts a vertex into the set; false if it was in.
    #[inline]
    pub(crate) fn mark(&mut self, vertex: u32) -> bool {
        std::mem::replace(&mut self.marks[vertex as usize], self.mark) < self.mark
    }

    /// Reports whether a vertex is in the set.
    #[inline]
    pub(crate) fn is_marked(&self, vertex: u32) -> bool {
        self.marks[vertex as usize] >= self.mark
    }

    /// Reports whether a vertex is in the set, and whether it was not visited before.
    #[inline]
    pub(crate) fn visit(&mut self, vertex: u32) -> (bool, bool) {
        let mark = &mut self.marks[vertex as usize];
        let (is_in, is_new) = (*mark >= self.mark, *mark == self.mark);
        *mark += u32::from(is_new);
        (is_in, is_new)
    }
}

const FOLLOWING: [usize; 3] = [1, 2, 0];
