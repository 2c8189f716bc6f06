//! Collapse cost and legality: quadric error, lost area, attributes and link condition.

use busbar_plugin_sdk::Mesh;
use glam::DVec3;
use mesh_shells::{Shells, coarse_cost};

use crate::attributes::{Attributes, WedgeAreas};
use crate::quadric::Quadric;
use crate::surface::{Spoke, Surface};

/// The cosine of the largest turn of a triangle that [`Guards::All`] lets
/// pass: 75 degrees.
const COS_MAX_TURN: f64 = 0.25;
/// Neighbours whose full cost is compared, the most promising first. Further ones are tried only if
/// all of these would break the link condition, and [`Shell::thorough`].
const MAX_CANDIDATES: usize = 3;
/// Weight of area that is lost, against that of faces left behind.
const LOST_AREA_WEIGHT: f64 = 0.6;
/// Weight of area times one minus the cosine of the angle that it turns by:
/// keeps slivers from standing up step by step.
const TURN_WEIGHT: f64 = 0.4;
/// Square of the greatest distance of lost parts, in heights of the triangles.
const HEIGHTS_SQUARED: f64 = 8.0;
/// Weight of the length of an edge: of collapses that change no shape, the
/// shortest comes first. A change of shape by 1/10,000 of the length counts as
/// much.
const LENGTH_WEIGHT: f64 = 1e-8;

/// Least square of the distance at which the misfit of a wedge counts, against the area that the wedge
/// shades. More keeps shading at the expense of outlines.
const SHADED_SHARE: f64 = 0.2;

/// Bits of the fraction that costs of turned shells keep: steps of a half, as a distance a fifth. More
/// would let rounding choose among the vertices of a ring; fewer take rings for equal that are not.
const FRACTION_BITS: u32 = 1;

/// Factor of the cost of a vertex of a ring for each halving that it is to survive.
const HALVING_FACTOR: f64 = 1.5;

/// Weights of the settings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Weights {
    /// Weight of attributes against change of shape.
    pub(crate) attribute: f64,
    /// Weight of borders and seams against area.
    pub(crate) border: f64,
}

/// Rules that a collapse must keep, dropped in this order when a shell has no
/// collapse left that keeps them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Guards {
    /// The link condition, and no triangle turns over.
    #[default]
    All,
    /// Link condition alone: a surface stays a surface.
    Link,
    /// No guards: the rest of the shell is removed.
    None,
}

/// Best target of a vertex, with its cost.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct CollapseTarget {
    /// The vertex it moves onto.
    pub(crate) kept: u32,
    /// Cost that decides the order: fourth power of metres.
    pub(crate) cost: f64,
    /// The part of it that is change of shape.
    pub(crate) shape: f64,
}

/// A triangle that a collapse moves or kills, before it.
struct FaceShape {
    normal: DVec3,
    double_area: f64,
    height_squared: f64,
}

impl FaceShape {
    /// Measures a face by its sides at the vertex. Its height over the longer of these is at most
    /// that over the third.
    fn new([ahead, behind]: [DVec3; 2]) -> Self {
        let normal = ahead.cross(behind);
        let double_area = normal.length();
        let side_squared = ahead.length_squared().max(behind.length_squared());
        let height_squared = double_area * double_area / side_squared.max(f64::MIN_POSITIVE);
        Self { normal, double_area, height_squared }
    }
}

/// Judges collapses of one vertex after the other.
#[derive(Default)]
pub(crate) struct CostEvaluator {
    ring: Vec<Spoke>,
    other_ring: Vec<Spoke>,
    faces: Vec<FaceShape>,
    candidates: Vec<(f64, u32)>,
    choices: Vec<CollapseTarget>,
    wedge_areas: WedgeAreas,
}

/// Mesh of the shells, with attributes and weights.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a, 'm> {
    pub(crate) mesh: &'a Mesh<'m>,
    pub(crate) shells: &'a Shells,
    pub(crate) attributes: Option<&'a Attributes<'m>>,
    pub(crate) weights: Weights,
}

/// The shell that is being simplified.
#[derive(Default)]
pub(crate) struct Shell {
    pub(crate) surface: Surface,
    /// Quadric of each vertex: the features that it must stay near to.
    pub(crate) quadrics: Vec<Quadric>,
    pub(crate) guards: Guards,
    /// Halvings of its ring that each vertex survives; empty where the shell is not turned.
    pub(crate) halvings: Vec<u8>,
    /// Thoroughness: whether all neighbours of a vertex are tried before it is refused.
    pub(crate) thorough: bool,
}

impl Shell {
    /// Reports whether the shell is turned, so that costs are equal up to rounding.
    pub(crate) fn is_turned(&self) -> bool {
        !self.halvings.is_empty()
    }

    /// Returns the cost that decides the order within a turned shell: coarse, and greater for a
    /// vertex that is to survive halvings of its ring.
    pub(crate) fn turned_cost(&self, vertex: u32, cost: f64) -> f64 {
        let halvings = self.halvings.get(vertex as usize).copied().unwrap_or_default();
        coarse_cost(cost * HALVING_FACTOR.powi(halvings.into()), FRACTION_BITS)
    }

    /// Computes a lower bound of the cost of a collapse.
    #[inline(always)]
    fn least_cost(&self, removed: u32, kept: u32) -> f64 {
        if self.surface.frozen[kept as usize] {
            return f64::INFINITY;
        }
        let quadric = &self.quadrics[removed as usize];
        let target = self.surface.positions[kept as usize];
        let length_squared = target.distance_squared(self.surface.positions[removed as usize]);
        quadric.evaluate(target) + LENGTH_WEIGHT * quadric.area * length_squared
    }
}

impl CostEvaluator {
    /// Computes a lower bound of the cost of any collapse of a vertex. `None` if it cannot go: it
    /// has no triangles, or is a hub.
    pub(crate) fn least_cost(&mut self, shell: &mut Shell, vertex: u32) -> Option<f64> {
        if !shell.surface.ring(vertex, &mut self.ring) {
            return None;
        }
        let open = shell.surface.open[vertex as usize];
        let mut least = f64::INFINITY;
        for spoke in &self.ring {
            least = least.min(shell.least_cost(vertex, spoke.ahead));
            if open {
                least = least.min(shell.least_cost(vertex, spoke.behind));
            }
        }
        least.is_finite().then_some(least)
    }

    /// Chooses the cheapest collapse of a vertex that keeps the guards, by vertex index among equal
    /// ones. The first that costs no more than `enough` will do.
    pub(crate) fn choose(
        &mut self,
        source: Source<'_, '_>,
        shell: &mut Shell,
        vertex: u32,
        enough: f64,
    ) -> Option<CollapseTarget> {
        if !shell.surface.ring(vertex, &mut self.ring) {
            return None;
        }
        self.find_candidates(shell, vertex);
        self.measure_faces(&shell.surface, vertex);
        if source.attributes.is_some() {
            self.wedge_areas.gather(
                self.ring
                    .iter()
                    .zip(&self.faces)
                    .map(|(spoke, face)| (spoke.wedges[0], 0.5 * face.double_area)),
            );
        }
        while !self.candidates.is_empty() {
            self.weigh_candidates(source, shell, vertex, enough);
            for index in 0..self.choices.len() {
                let choice = self.choices[index];
                if self.keeps_link(shell, choice.kept) {
                    return Some(choice);
                }
            }
            if !shell.thorough {
                return None;
            }
        }
        None
    }

    /// Finds the full cost of some candidates, which are candidates no more, and
    /// sorts them by it.
    fn weigh_candidates(
        &mut self,
        source: Source<'_, '_>,
        shell: &Shell,
        vertex: u32,
        enough: f64,
    ) {
        self.choices.clear();
        let mut best = f64::INFINITY;
        while let Some((index, (least, kept))) = self.next_candidate() {
            let found = self.choices.len();
            if found == MAX_CANDIDATES || (found > 0 && best <= least.max(enough)) {
                break;
            }
            self.candidates.swap_remove(index);
            if let Some(choice) = self.cost(source, shell, vertex, kept, least) {
                best = best.min(choice.cost);
                self.choices.push(choice);
            }
        }
        if shell.is_turned() {
            for choice in &mut self.choices {
                choice.cost = shell.turned_cost(vertex, choice.cost);
            }
        }
        self.choices.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    }

    /// Returns the candidate of the least possible cost, with its place. Few are tried before one
    /// is found, so candidates are not sorted.
    fn next_candidate(&self) -> Option<(usize, (f64, u32))> {
        let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let candidates = self.candidates.iter().copied().enumerate();
        candidates.min_by(|a, b| order(&a.1, &b.1))
    }

    /// Reports whether a chosen collapse still satisfies the link condition.
    pub(crate) fn still_keeps_link(&mut self, shell: &mut Shell, vertex: u32, kept: u32) -> bool {
        shell.surface.ring(vertex, &mut self.ring) && self.keeps_link(shell, kept)
    }

    /// Swaps the triangles at the last evaluated vertex with those in `ring`.
    pub(crate) fn swap_ring(&mut self, ring: &mut Vec<Spoke>) {
        std::mem::swap(&mut self.ring, ring);
    }

    /// Finds the neighbours of a vertex, with lower bounds of the cost of a collapse onto them.
    fn find_candidates(&mut self, shell: &mut Shell, vertex: u32) {
        let open = shell.surface.open[vertex as usize];
        self.candidates.clear();
        let mut add = |kept: u32| {
            let cost = shell.least_cost(vertex, kept);
            if cost < f64::INFINITY {
                self.candidates.push((cost, kept));
            }
        };
        for spoke in &self.ring {
            add(spoke.ahead);
            // At an open edge nobody else is behind.
            if open && !self.ring.iter().any(|other| other.ahead == spoke.behind) {
                add(spoke.behind);
            }
        }
    }

    fn measure_faces(&mut self, surface: &Surface, vertex: u32) {
        let origin = surface.positions[vertex as usize];
        self.faces.clear();
        for spoke in &self.ring {
            let ends = [spoke.ahead, spoke.behind];
            self.faces
                .push(FaceShape::new(ends.map(|end| surface.positions[end as usize] - origin)));
        }
    }

    /// Computes the cost of a collapse; `None` if it turns a triangle over.
    ///
    /// To the least cost comes area that is lost (of a border cut short, a
    /// collapsed end of a rod, a thin plate), triangles that turn, and wedges
    /// that do not fit: as far from what stays as the edge is long, but no
    /// farther than some heights of the triangles. Those along a wire are strips,
    /// and its edges much longer than it is thick.
    #[inline]
    fn cost(
        &self,
        source: Source<'_, '_>,
        shell: &Shell,
        removed: u32,
        kept: u32,
        least: f64,
    ) -> Option<CollapseTarget> {
        let positions = &shell.surface.positions;
        let target = positions[kept as usize];
        let mut lost = 0.0;
        let mut turned = 0.0;
        let mut highest_squared = 0.0_f64;
        for (spoke, face) in self.ring.iter().zip(&self.faces) {
            lost += face.double_area;
            highest_squared = highest_squared.max(face.height_squared);
            if spoke.ahead == kept || spoke.behind == kept {
                continue;
            }
            let ends = [spoke.ahead, spoke.behind];
            let moved = FaceShape::new(ends.map(|end| positions[end as usize] - target));
            highest_squared = highest_squared.max(moved.height_squared);
            let turn = face.normal.dot(moved.normal);
            let scale = face.double_area * moved.double_area;
            if shell.guards == Guards::All && turn <= COS_MAX_TURN * scale && face.double_area > 0.0
            {
                return None;
            }
            lost -= moved.double_area;
            if scale > 0.0 {
                turned += face.double_area.max(moved.double_area) * (1.0 - turn / scale);
            }
        }
        let length_squared = target.distance_squared(positions[removed as usize]);
        let mut reach_squared = length_squared.min(HEIGHTS_SQUARED * highest_squared);
        if reach_squared < length_squared {
            let gap_squared = self.gap_squared(&shell.surface, removed, kept);
            reach_squared = reach_squared.max(gap_squared);
        }
        let lost = LOST_AREA_WEIGHT * 0.5 * lost.abs() * reach_squared;
        let mut cost = least + lost + TURN_WEIGHT * 0.5 * turned * reach_squared;
        if let Some(attributes) = source.attributes {
            let onto = shell.surface.vertices[kept as usize];
            // A wrong shade is seen on the whole surface, however short the edge. Turned shells go by
            // the regularity of their rings.
            let shaded = if shell.is_turned() { 0.0 } else { SHADED_SHARE };
            let most = HEIGHTS_SQUARED * highest_squared;
            let reach_squared = |area: f64| reach_squared.max(most.min(shaded * area));
            let misfit = self.wedge_areas.misfit(attributes, &self.ring, kept, onto, reach_squared);
            cost += source.weights.attribute * misfit;
        }
        let shape = shell.quadrics[removed as usize].evaluate(target) + lost;
        Some(CollapseTarget { kept, cost, shape })
    }

    /// Returns the squared distance from a moved vertex to the edges at its new position, at most the
    /// distance moved. Zero at the end of a wire.
    fn gap_squared(&self, surface: &Surface, removed: u32, kept: u32) -> f64 {
        let positions = &surface.positions;
        let [point, target] = [removed, kept].map(|vertex| positions[vertex as usize]);
        let offset = point - target;
        let to_edge = |end: u32| {
            let along = positions[end as usize] - target;
            let share = offset.dot(along) / along.length_squared().max(f64::MIN_POSITIVE);
            (offset - along * share.clamp(0.0, 1.0)).length_squared()
        };
        let ends = self.ring.iter().flat_map(|spoke| [spoke.ahead, spoke.behind]);
        let ends = ends.filter(|&end| end != kept);
        ends.map(to_edge).fold(offset.length_squared(), f64::min)
    }

    /// Checks the link condition (Dey, Edelsbrunner, Guha and Nekhayev 1999) for the gathered ring.
    /// A vertex next to both ends is in a triangle at the edge, and no triangle comes to lie on
    /// another.
    fn keeps_link(&mut self, shell: &mut Shell, kept: u32) -> bool {
        let surface = &mut shell.surface;
        if shell.guards == Guards::None {
            return true;
        }
        if !surface.ring(kept, &mut self.other_ring) {
            return false;
        }
        surface.begin_marks();
        let mut at_edge = 0;
        for spoke in &self.ring {
            surface.mark(spoke.ahead);
            surface.mark(spoke.behind);
            at_edge += usize::from(spoke.ahead == kept || spoke.behind == kept);
        }
        let mut apexes = 0;
        for spoke in &self.other_ring {
            let (ahead, ahead_is_new) = surface.visit(spoke.ahead);
            let (behind, behind_is_new) = surface.visit(spoke.behind);
            apexes += usize::from(ahead_is_new) + usize::from(behind_is_new);
            if apexes > at_edge
                || (ahead && behind && self.ring.iter().any(|other| other.is_over(spoke)))
            {
                return false;
            }
        }
        true
    }
}
