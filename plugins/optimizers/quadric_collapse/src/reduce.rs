//! Greedy simplification of one shell down to one vertex, or of a part to a fraction.

use glam::DVec3;
use mesh_shells::regular_order;

use crate::collapse_cost::{CollapseTarget, CostEvaluator, Guards, Shell, Source};
use crate::features;
use crate::pieces::{CutParts, PieceView, Remainder, Triangles, VertexState, center};
use crate::queue::Queue;
use crate::surface::Spoke;

/// Share of a part's inner vertices that is left. A greater share would cost memory, a smaller one
/// would make the cuts show.
const LEFT_OF_PART: f64 = 0.25;

/// Greatest number of vertices of a shell without legal collapse that is removed as a whole.
const MAX_DYING: usize = 32;
/// Greatest number of vertices of a shell whose refused vertices are not looked at again: guards
/// fall.
const MAX_ONE_LOOK: usize = 64;
/// Weight of a shell's area that is lost at its radius when it dies.
const DEATH_WEIGHT: f64 = 0.15;
/// Estimated ratio of a collapse's cost to its lower bound. A guess near the truth spares judging
/// it too early, and often.
const GUESS: f64 = 4.0;
/// Greatest ratio to the cheapest cost at which a collapse is done at once: the cost goes with the
/// square of a distance.
const SLACK: f64 = 2.0;
/// Collapses between two looks at progress.
const WATCH_EVERY: usize = 1024;

/// One collapse, in vertices of the mesh.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Step {
    pub(crate) removed: u32,
    pub(crate) kept: u32,
    /// Rank that orders the sequence: the cost, or if greater the rank of an earlier step that had
    /// a part in it.
    pub(crate) rank: f64,
    /// Metres: the smaller of the root mean square distance from the faces
    /// that the vertex stood for, and the farthest that any vertex it stood
    /// for has moved; the radius of a shell that dies.
    pub(crate) error: f32,
}

/// Planned collapse of a vertex in the queue.
#[derive(Clone, Copy, Debug, Default)]
struct PlannedCollapse {
    choice: CollapseTarget,
    /// Validity: whether its surroundings are as they were when it was judged.
    current: bool,
}

/// Told how many more vertices are done; says whether to go on.
pub(crate) type ProgressCallback<'a> = &'a mut dyn FnMut(usize) -> bool;

/// Buffers for one piece after the other.
#[derive(Default)]
pub(crate) struct Reducer {
    shell: Shell,
    /// Greatest distance moved by the vertices that each vertex stands for, metres.
    moved: Vec<f32>,
    /// The rank of the last step around each vertex.
    ranks: Vec<f64>,
    /// No step from here on has a smaller rank.
    least_rank: f64,
    queue: Queue,
    plans: Vec<PlannedCollapse>,
    evaluator: CostEvaluator,
    ring: Vec<Spoke>,
}

impl Reducer {
    /// Appends the steps that take a shell of the mesh down to one vertex;
    /// returns false if `watch` said stop.
    pub(crate) fn reduce(
        &mut self,
        source: Source<'_, '_>,
        shell: usize,
        steps: &mut Vec<Step>,
        watch: ProgressCallback<'_>,
    ) -> bool {
        let shells = source.shells;
        let vertices = &shells.vertices[shells.vertex_range(shell)];
        let triangles = &shells.triangles[shells.triangle_range(shell)];
        let triangles = Triangles::Mesh(triangles);
        let view = PieceView { vertices, places: &shells.place, triangles };
        self.load(source, &view, &[], center(source.mesh, vertices));
        self.finish(source, steps, watch)
    }

    /// Reduces the remainder of a large shell to one vertex. `places` is as long as the mesh has
    /// vertices; its contents do not matter.
    pub(crate) fn reduce_remainder(
        &mut self,
        source: Source<'_, '_>,
        remainder: &Remainder,
        center: DVec3,
        places: &mut [u32],
        steps: &mut Vec<Step>,
        watch: ProgressCallback<'_>,
    ) -> bool {
        let vertices = (0..).zip(&remainder.vertices);
        vertices.for_each(|(place, &vertex)| places[vertex as usize] = place);
        self.load(source, &remainder.view(places), &remainder.states, center);
        self.finish(source, steps, watch)
    }

    /// Appends the steps that reduce the inside of a part to [`LEFT_OF_PART`], within the limits of
    /// the guards. Returns the remainder, or nothing if `watch` stopped the work.
    pub(crate) fn reduce_part(
        &mut self,
        source: Source<'_, '_>,
        (part, parts): (&Remainder, &CutParts),
        center: DVec3,
        places: &[u32],
        steps: &mut Vec<Step>,
        watch: ProgressCallback<'_>,
    ) -> Option<Remainder> {
        self.load(source, &part.view(places), &part.states, center);
        let frozen = &mut self.shell.surface.frozen;
        for (frozen, &vertex) in frozen.iter_mut().zip(&part.vertices) {
            *frozen = parts.is_on_cut(vertex);
        }
        let inside = frozen.iter().filter(|&&frozen| !frozen).count() as f64;
        let limit = steps.len() + (inside * (1.0 - LEFT_OF_PART)) as usize;
        self.enqueue_all();
        let start = steps.len();
        self.drain(source, start, limit, steps, watch).then(|| self.remainder(part))
    }

    /// Reduces the loaded piece to one vertex.
    fn finish(
        &mut self,
        source: Source<'_, '_>,
        steps: &mut Vec<Step>,
        watch: ProgressCallback<'_>,
    ) -> bool {
        let start = steps.len();
        for guards in [Guards::All, Guards::Link] {
            if !self.exhaust(source, guards, start, steps, watch) {
                return false;
            }
            // What breaks a rule waits until nothing else is left.
            self.least_rank = greatest(steps[start..].iter().map(|step| step.rank), 0.0);
        }
        let dying = steps.len();
        let (rank, error) = self.shell_collapse_cost();
        if !self.exhaust(source, Guards::None, start, steps, watch) {
            return false;
        }
        self.join_rest(start, steps);
        if steps.len() - dying <= MAX_DYING {
            let dying = &mut steps[dying..];
            let rank = greatest(dying.iter().map(|step| step.rank), rank);
            let error = greatest(dying.iter().map(|step| f64::from(step.error)), error.into());
            dying.iter_mut().for_each(|step| (step.rank, step.error) = (rank, error as f32));
        }
        watch((steps.len() - start) % WATCH_EVERY + 1)
    }

    fn load(
        &mut self,
        source: Source<'_, '_>,
        piece: &PieceView<'_>,
        states: &[VertexState],
        center: DVec3,
    ) {
        let Shell { surface, quadrics, halvings, .. } = &mut self.shell;
        surface.load(source.mesh, piece, center);
        features::measure(surface, source.attributes, source.weights.border, quadrics);
        let count = surface.len();
        let order = regular_order(&surface.positions, surface.triangles()).unwrap_or_default();
        *halvings = order.halvings;
        self.queue.reset(count, order.vertices);
        self.plans.clear();
        self.plans.resize(count, PlannedCollapse::default());
        self.moved.clear();
        self.moved.resize(count, 0.0);
        self.ranks.clear();
        self.ranks.resize(count, 0.0);
        self.least_rank = 0.0;
        for (place, state) in states.iter().enumerate() {
            if let Some(quadric) = state.quadric {
                quadrics[place] = quadric;
            }
            surface.open[place] |= state.open;
            self.moved[place] = state.moved;
            self.ranks[place] = state.rank;
        }
    }

    /// Extracts the rest of a part, with the state of its vertices.
    fn remainder(&mut self, part: &Remainder) -> Remainder {
        let mut left = Remainder::default();
        for vertex in 0..self.shell.surface.len() {
            let frozen = self.shell.surface.frozen[vertex];
            if !frozen && self.shell.surface.is_bare(vertex as u32) {
                continue;
            }
            let before = part.states.get(vertex).copied().unwrap_or_default();
            let rank = self.ranks[vertex];
            left.vertices.push(part.vertices[vertex]);
            left.states.push(if frozen {
                VertexState { rank, ..before }
            } else {
                VertexState {
                    quadric: Some(self.shell.quadrics[vertex]),
                    moved: self.moved[vertex],
                    open: self.shell.surface.open[vertex],
                    rank,
                }
            });
        }
        for (corners, wedges) in self.shell.surface.live() {
            left.corners.push(corners);
            if !part.wedges.is_empty() {
                left.wedges.push(wedges);
            }
        }
        left
    }

    /// Collapses all that the guards allow.
    fn exhaust(
        &mut self,
        source: Source<'_, '_>,
        guards: Guards,
        start: usize,
        steps: &mut Vec<Step>,
        watch: ProgressCallback<'_>,
    ) -> bool {
        self.shell.guards = guards;
        self.shell.thorough = false;
        let count = self.shell.surface.len();
        loop {
            let before = steps.len();
            let left = count - (before - start);
            if left < 2 {
                return true;
            }
            self.enqueue_all();
            if !self.drain(source, start, usize::MAX, steps, watch) {
                return false;
            }
            // One refused may be legal by now; but that is looked at only as
            // long as it may free a good part.
            let freed = steps.len() - before;
            if left <= MAX_ONE_LOOK || (self.shell.thorough && freed <= left / 8) {
                return true;
            }
            self.shell.thorough = true;
        }
    }

    fn enqueue_all(&mut self) {
        for vertex in 0..self.shell.surface.len() as u32 {
            if !self.shell.surface.is_bare(vertex) {
                self.enqueue(vertex);
            }
        }
    }

    /// Does the cheapest collapse, time and again, until there are `limit`
    /// steps or nothing to do.
    fn drain(
        &mut self,
        source: Source<'_, '_>,
        start: usize,
        limit: usize,
        steps: &mut Vec<Step>,
        watch: ProgressCallback<'_>,
    ) -> bool {
        let mut watched = steps.len() - start;
        while steps.len() < limit {
            let popped_cost = self.queue.least_cost();
            let Some(removed) = self.queue.pop() else { break };
            let done = steps.len() - start;
            if done / WATCH_EVERY > watched / WATCH_EVERY {
                watched = done;
                if !watch(WATCH_EVERY) {
                    return false;
                }
            }
            let plan = self.plans[removed as usize];
            let (evaluator, shell) = (&mut self.evaluator, &mut self.shell);
            if plan.current && evaluator.still_keeps_link(shell, removed, plan.choice.kept) {
                self.collapse(source, removed, plan.choice, steps);
                continue;
            }
            let enough = match shell.is_turned() {
                true => popped_cost,
                false => self.queue.least_cost() * SLACK,
            };
            let Some(choice) = evaluator.choose(source, shell, removed, enough) else { continue };
            if choice.cost <= enough {
                self.collapse(source, removed, choice, steps);
            } else {
                self.plans[removed as usize] = PlannedCollapse { choice, current: true };
                self.queue.set(removed, choice.cost);
            }
        }
        true
    }

    /// Queues a vertex at a lower bound of its cost.
    fn enqueue(&mut self, vertex: u32) {
        if self.shell.surface.frozen[vertex as usize] {
            return;
        }
        self.plans[vertex as usize].current = false;
        match self.evaluator.least_cost(&mut self.shell, vertex) {
            Some(cost) if self.shell.is_turned() => {
                self.queue.set(vertex, self.shell.turned_cost(vertex, cost));
            }
            Some(cost) => self.queue.set(vertex, cost * GUESS),
            None => self.queue.remove(vertex),
        }
    }

    fn collapse(
        &mut self,
        source: Source<'_, '_>,
        removed: u32,
        choice: CollapseTarget,
        steps: &mut Vec<Step>,
    ) {
        let kept = choice.kept;
        let step = self.step(removed, choice);
        steps.push(step);
        self.evaluator.swap_ring(&mut self.ring);
        let quadric = self.shell.quadrics[removed as usize];
        self.shell.quadrics[kept as usize] += quadric;
        self.shell.surface.collapse(removed, kept, |wedge| {
            source.attributes.map_or(wedge, |attributes| attributes.parent(wedge, step.kept))
        });

        self.shell.surface.begin_marks();
        self.shell.surface.mark(kept);
        for index in 0..self.ring.len() {
            let Spoke { ahead, behind, .. } = self.ring[index];
            for vertex in [ahead, behind] {
                if self.shell.surface.mark(vertex) {
                    let rank = &mut self.ranks[vertex as usize];
                    *rank = rank.max(step.rank);
                    self.refresh(vertex, kept, step, steps);
                }
            }
        }
        // It stands for more: dearer, if anything.
        let before = self.queue.cost(kept);
        self.enqueue(kept);
        if let (Some(before), Some(now)) = (before, self.queue.cost(kept))
            && before > now
        {
            self.queue.set(kept, before);
        }
    }

    /// Notes that a neighbour of a vertex moved. The vertex keeps its place in
    /// the queue, for costs seldom fall, and is judged anew when it comes up;
    /// one whose last triangle died is held by nothing and goes as well.
    fn refresh(&mut self, vertex: u32, kept: u32, step: Step, steps: &mut Vec<Step>) {
        if self.shell.surface.frozen[vertex as usize] {
            return;
        }
        if self.shell.surface.is_bare(vertex) {
            self.queue.remove(vertex);
            let removed = self.shell.surface.vertices[vertex as usize];
            let rank = self.ranks[vertex as usize].max(self.ranks[kept as usize]);
            self.ranks[kept as usize] = rank;
            steps.push(Step { removed, rank, ..step });
        } else if self.queue.contains(vertex) {
            self.plans[vertex as usize].current = false;
        } else {
            self.enqueue(vertex);
        }
    }

    fn step(&mut self, removed: u32, choice: CollapseTarget) -> Step {
        let surface = &self.shell.surface;
        let [from, to] = [removed, choice.kept].map(|v| surface.positions[v as usize]);
        let reach = from.distance(to) as f32 + self.moved[removed as usize];
        let moved = &mut self.moved[choice.kept as usize];
        *moved = moved.max(reach);
        let [removed_rank, kept_rank] = [removed, choice.kept].map(|v| self.ranks[v as usize]);
        let rank = choice.cost.max(removed_rank).max(kept_rank).max(self.least_rank);
        self.ranks[choice.kept as usize] = rank;
        let area = self.shell.quadrics[removed as usize].area;
        let mean = if area > 0.0 { (choice.shape / area).sqrt() as f32 } else { 0.0 };
        Step {
            removed: surface.vertices[removed as usize],
            kept: surface.vertices[choice.kept as usize],
            rank,
            // Positions can be farther apart than f32 reaches.
            error: mean.min(reach).min(f32::MAX),
        }
    }

    /// Computes rank and error of collapsing the rest of the shell to a point.
    fn shell_collapse_cost(&self) -> (f64, f32) {
        let positions = &self.shell.surface.positions;
        let (mut area, mut sum, mut count) = (0.0, DVec3::ZERO, 0.0);
        for triangle in self.shell.surface.triangles() {
            let [a, b, c] = triangle.map(|v| positions[v as usize]);
            area += 0.5 * (b - a).cross(c - a).length();
            sum += a + b + c;
            count += 3.0;
        }
        let center = sum / f64::max(count, 1.0);
        let corners = self.shell.surface.triangles().flatten();
        let radius = corners.map(|v| positions[v as usize].distance(center)).fold(0.0, f64::max);
        (DEATH_WEIGHT * area * radius * radius, (radius as f32).min(f32::MAX))
    }

    /// Joins vertices that the guards or lost triangles left apart.
    fn join_rest(&mut self, start: usize, steps: &mut Vec<Step>) {
        let vertices = &self.shell.surface.vertices;
        if steps.len() - start + 1 == vertices.len() {
            return;
        }
        // Vertices of a shell ascend, so do those that are left.
        let mut removed: Vec<u32> = steps[start..].iter().map(|step| step.removed).collect();
        removed.sort_unstable();
        let is_left = |vertex: &&u32| removed.binary_search(vertex).is_err();
        let mut left = vertices.iter().filter(is_left);
        let Some(&kept) = left.next() else { return };
        let rank = greatest(steps[start..].iter().map(|step| step.rank), self.least_rank);
        let error = steps.last().map_or(0.0, |last| last.error);
        steps.extend(left.map(|&removed| Step { removed, kept, rank, error }));
    }
}

fn greatest(values: impl Iterator<Item = f64>, least: f64) -> f64 {
    values.fold(least, f64::max)
}
