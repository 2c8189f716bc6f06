//! Pieces that are simplified at a time: a shell, or a part of a large one.
//!
//! A shell with very many triangles is cut into parts. Each is taken down to a
//! fraction of its vertices, but for those on the cuts, which stay as they are,
//! so parts know nothing of each other. What is left of all parts is one piece
//! again, and small enough for the rest, or is cut elsewhere. That bounds the
//! memory, lets threads share a shell, and does not depend on how many they are.

use busbar_plugin_sdk::Mesh;
use glam::DVec3;
use mesh_shells::Shells;

use crate::quadric::Quadric;

/// Place of the first cut, as a share of the triangles, by level. A vertex on one cut is thus
/// inside a part of the next level.
const FIRST_CUT: [f64; 2] = [0.5, 0.38];
/// Marker of a vertex without a part.
const NOWHERE: u32 = u32::MAX;
/// More than one part.
const SHARED: u32 = u32::MAX - 1;

/// A piece of a mesh that is to be loaded.
#[derive(Clone, Copy)]
pub(crate) struct PieceView<'a> {
    /// Vertices of the piece, ascending.
    pub(crate) vertices: &'a [u32],
    /// For each vertex of the mesh that is one of the piece, its place there.
    pub(crate) places: &'a [u32],
    pub(crate) triangles: Triangles<'a>,
}

/// Triangles of a piece.
#[derive(Clone, Copy)]
pub(crate) enum Triangles<'a> {
    /// By their index in the mesh.
    Mesh(&'a [u32]),
    /// Owned geometry after earlier levels: corners, in vertices of the mesh, and wedges (none
    /// without attributes).
    Own { corners: &'a [[u32; 3]], wedges: &'a [[u32; 3]] },
}

/// State of a vertex that passes from piece to piece.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct VertexState {
    /// `None` on a cut, where nothing moved yet.
    pub(crate) quadric: Option<Quadric>,
    /// Greatest distance that it moved for the vertices it stands for, metres.
    pub(crate) moved: f32,
    pub(crate) open: bool,
    /// The rank of the last step around it.
    pub(crate) rank: f64,
}

/// A large shell as it is after some levels of parts.
#[derive(Default)]
pub(crate) struct Remainder {
    /// Vertices that are left, ascending.
    pub(crate) vertices: Vec<u32>,
    /// One a vertex, but none before the first level.
    pub(crate) states: Vec<VertexState>,
    pub(crate) corners: Vec<[u32; 3]>,
    pub(crate) wedges: Vec<[u32; 3]>,
}

impl Remainder {
    /// Copies a shell of the mesh.
    pub(crate) fn from_shell(mesh: &Mesh<'_>, shells: &Shells, shell: usize) -> Self {
        let triangles = &shells.triangles[shells.triangle_range(shell)];
        let wedges = |wedges: busbar_plugin_sdk::Wedges<'_>| {
            triangles.iter().map(|&t| wedges.corners[t as usize]).collect()
        };
        Self {
            vertices: shells.vertices[shells.vertex_range(shell)].to_vec(),
            states: Vec::new(),
            corners: triangles.iter().map(|&t| mesh.triangles[t as usize]).collect(),
            wedges: mesh.wedges.map(wedges).unwrap_or_default(),
        }
    }

    /// Returns the piece as it is to be loaded.
    pub(crate) fn view<'a>(&'a self, places: &'a [u32]) -> PieceView<'a> {
        let triangles = Triangles::Own { corners: &self.corners, wedges: &self.wedges };
        PieceView { vertices: &self.vertices, places, triangles }
    }

    /// Joins the remainders of parts. A vertex on a cut takes the first part's state. All parts
    /// know the same of it: that it is on a cut, and the greatest rank of the steps around it.
    pub(crate) fn join(parts: impl Iterator<Item = Self>) -> Self {
        let mut all = Self::default();
        let mut known: Vec<(u32, VertexState)> = Vec::new();
        for part in parts {
            known.extend(part.vertices.into_iter().zip(part.states));
            all.corners.extend(part.corners);
            all.wedges.extend(part.wedges);
        }
        // Stable: of one vertex the first part comes first.
        known.sort_by_key(|&(vertex, _)| vertex);
        for same in known.chunk_by(|a, b| a.0 == b.0) {
            let (vertex, mut state) = same[0];
            state.rank = same.iter().fold(state.rank, |rank, other| rank.max(other.1.rank));
            all.vertices.push(vertex);
            all.states.push(state);
        }
        all
    }

    /// Cuts the triangles into parts of at most `limit`, each a run of the
    /// indices that are returned, with where runs start and the total.
    pub(crate) fn cut(&self, mesh: &Mesh<'_>, limit: usize, level: usize) -> CutParts {
        let mut indices: Vec<u32> = (0..self.corners.len() as u32).collect();
        let mut starts = Vec::new();
        let share = FIRST_CUT[level % FIRST_CUT.len()];
        self.halve(mesh, &mut indices, 0, limit.max(1), share, &mut starts);
        starts.push(indices.len());
        let mut part_of_vertex = vec![NOWHERE; mesh.positions.len()];
        for (part, run) in (0..).zip(starts.windows(2)) {
            for &vertex in indices[run[0]..run[1]].iter().flat_map(|&t| &self.corners[t as usize]) {
                let known = &mut part_of_vertex[vertex as usize];
                *known = if *known == NOWHERE || *known == part { part } else { SHARED };
            }
        }
        CutParts { indices, starts, part_of_vertex }
    }

    /// Cuts triangles across their longest extent, time and again.
    fn halve(
        &self,
        mesh: &Mesh<'_>,
        indices: &mut [u32],
        start: usize,
        limit: usize,
        share: f64,
        starts: &mut Vec<usize>,
    ) {
        if indices.len() <= limit {
            starts.push(start);
            return;
        }
        let first_corner = |t: u32| point(mesh, self.corners[t as usize][0]);
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &t in indices.iter() {
            low = low.min(first_corner(t));
            high = high.max(first_corner(t));
        }
        let axis = (high - low).max_position();
        let middle = ((indices.len() as f64 * share) as usize).clamp(1, indices.len() - 1);
        indices.select_nth_unstable_by(middle, |&a, &b| {
            first_corner(a)[axis].total_cmp(&first_corner(b)[axis]).then(a.cmp(&b))
        });
        let (left, right) = indices.split_at_mut(middle);
        self.halve(mesh, left, start, limit, FIRST_CUT[0], starts);
        self.halve(mesh, right, start + middle, limit, FIRST_CUT[0], starts);
    }
}

/// A remainder, cut into parts.
pub(crate) struct CutParts {
    /// Triangles of the remainder, part by part.
    indices: Vec<u32>,
    starts: Vec<usize>,
    part_of_vertex: Vec<u32>,
}

impl CutParts {
    /// Returns the number of parts.
    pub(crate) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// Takes one part by itself. `places` is as long as the mesh has vertices.
    pub(crate) fn take(&self, whole: &Remainder, part: usize, places: &mut [u32]) -> Remainder {
        // In the order of the remainder: the cuts shuffled them.
        let mut indices = self.indices[self.starts[part]..self.starts[part + 1]].to_vec();
        indices.sort_unstable();
        let corners: Vec<_> = indices.iter().map(|&t| whole.corners[t as usize]).collect();
        let wedges = if whole.wedges.is_empty() {
            Vec::new()
        } else {
            indices.iter().map(|&t| whole.wedges[t as usize]).collect()
        };
        corners.as_flattened().iter().for_each(|&v| places[v as usize] = NOWHERE);
        let mut vertices = Vec::new();
        for &vertex in corners.as_flattened() {
            if std::mem::replace(&mut places[vertex as usize], 0) == NOWHERE {
                vertices.push(vertex);
            }
        }
        vertices.sort_unstable();
        let state = |vertex: &u32| {
            whole.vertices.binary_search(vertex).map_or(VertexState::default(), |i| whole.states[i])
        };
        let states =
            if whole.states.is_empty() { Vec::new() } else { vertices.iter().map(state).collect() };
        (0..).zip(&vertices).for_each(|(place, &vertex)| places[vertex as usize] = place);
        Remainder { vertices, states, corners, wedges }
    }

    /// Reports whether a vertex is in more than one part.
    pub(crate) fn is_on_cut(&self, vertex: u32) -> bool {
        self.part_of_vertex[vertex as usize] == SHARED
    }
}

/// Returns a vertex in double precision, metres.
pub(crate) fn point(mesh: &Mesh<'_>, vertex: u32) -> DVec3 {
    DVec3::from(mesh.positions[vertex as usize].map(f64::from))
}

/// Returns the mean position of a shell's vertices.
pub(crate) fn center(mesh: &Mesh<'_>, vertices: &[u32]) -> DVec3 {
    vertices.iter().map(|&v| point(mesh, v)).sum::<DVec3>() / vertices.len().max(1) as f64
}
