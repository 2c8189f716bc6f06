//! The lines of records: what is normal in grey, what is not in the colour and pattern of
//! its state; what is brushed and selected in front.

use std::collections::BTreeMap;

use super::axes::depth_of;
use super::{Face, GREY, INK, MISSING_LANE, SELECTION, Shape, Stroke};
use crate::parallel_coordinates::MAX_STROKED_RECORDS;
use crate::{AxisView, Layout, ParallelCoordinates, Pattern, Size, cluster};

/// What a line looks like, by how much it is to be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Rank {
    /// Not brushed, where something is.
    Rest,
    /// An earlier record of its equipment.
    Earlier,
    /// The last known record of its equipment.
    Latest,
    /// Brushed.
    Meant,
    /// Of selected equipment.
    ChartSelection,
}

impl Rank {
    /// Width in points, and how much a normal and an abnormal line cover.
    fn look(self) -> (f32, [f32; 2]) {
        match self {
            Self::Rest => (1.0, [0.1, 0.16]),
            Self::Earlier => (1.0, [0.2, 0.45]),
            Self::Latest => (1.8, [0.75, 1.0]),
            Self::Meant => (1.8, [0.9, 1.0]),
            Self::ChartSelection => (3.0, [1.0, 1.0]),
        }
    }
}

pub(super) fn add(board: &ParallelCoordinates, now: i64, shape: &mut Shape) {
    let views = board.shown_axes();
    let lines = Lines::of(board, &views);
    if board.shows_clusters {
        lines.add_clusters(shape);
    }
    let ranks = ranks(board, now);
    if board.layout == Layout::Time {
        lines.add_ribbons(&ranks, shape);
    }
    let mut drawn: Vec<(Rank, usize)> = ranks.into_iter().map(|(at, rank)| (rank, at)).collect();
    // What is to be seen most comes last, and so in front.
    drawn.sort_unstable();
    for (rank, record) in drawn {
        lines.add_record(record, rank, shape);
    }
}

/// What each record that is drawn is drawn as.
fn ranks(board: &ParallelCoordinates, now: i64) -> BTreeMap<usize, Rank> {
    let has_brush = !board.brushes().is_empty();
    let selected = board.selected.iter().flat_map(|&one| board.records.of_equipment(one));
    // The last ones, where there are too many.
    let selected = selected.map(|&record| record as usize).rev().take(MAX_STROKED_RECORDS);
    let drawn: Vec<usize> = match board.is_dense() {
        true => selected.collect(),
        false => (0..board.records.len()).collect(),
    };
    let rank = |record: usize| match board.is_brushed(record) {
        true => Rank::Meant,
        false if has_brush => Rank::Rest,
        false => Rank::Earlier,
    };
    let known = drawn.into_iter().filter(|&record| board.is_known(record));
    let mut ranks: BTreeMap<usize, Rank> = known.map(|record| (record, rank(record))).collect();
    for known in board.known(now) {
        let Some(rank) = ranks.get_mut(&known.record) else { continue };
        if *rank == Rank::Earlier {
            *rank = Rank::Latest;
        }
        if board.selected.contains(&known.equipment) {
            *rank = Rank::ChartSelection;
        }
    }
    ranks
}

/// Where lines go.
struct Lines<'a> {
    board: &'a ParallelCoordinates,
    views: &'a [AxisView],
    feet: Vec<[f32; 2]>,
    pairs: Vec<[usize; 2]>,
    span: [i64; 2],
}

impl<'a> Lines<'a> {
    fn of(board: &'a ParallelCoordinates, views: &'a [AxisView]) -> Self {
        let feet = board.layout.axis_positions(views.len(), board.size);
        let pairs = board.layout.pairs(views.len());
        Self { board, views, feet, pairs, span: board.records.span().unwrap_or_default() }
    }

    fn at(&self, axis: usize, position: f32, back: f32) -> [f32; 3] {
        let [x, z] = self.feet[axis];
        [x, position * self.board.size.height, z + back]
    }

    /// Where a record is on an axis; in the lane below where it has no value.
    fn place(&self, record: usize, axis: usize) -> [f32; 3] {
        let view = &self.views[axis];
        let position = view.position(self.board.records.row(record)[view.axis]);
        self.at(axis, position.unwrap_or(MISSING_LANE), self.back(record))
    }

    fn back(&self, record: usize) -> f32 {
        let Size { depth, .. } = self.board.size;
        match self.board.layout {
            Layout::Time => depth_of(self.board.records.all()[record].unix_nanos, self.span, depth),
            Layout::Flat | Layout::Focus => 0.0,
        }
    }

    fn add_record(&self, record: usize, rank: Rank, shape: &mut Shape) {
        let state = &self.board.description.legend[self.board.records.all()[record].state as usize];
        let (width, covers) = rank.look();
        let (color, pattern, cover) = match (rank, state.is_abnormal) {
            (Rank::ChartSelection, false) => (SELECTION, Pattern::Solid, 1.0),
            (Rank::Meant, false) => (INK, Pattern::Solid, covers[0]),
            (Rank::Rest, _) => (GREY, Pattern::Solid, covers[0]),
            (_, false) => (GREY, Pattern::Solid, covers[0]),
            (_, true) => (state.color, state.pattern, covers[1]),
        };
        for &[from, to] in &self.pairs {
            let (from, to) = (self.place(record, from), self.place(record, to));
            if rank == Rank::ChartSelection && state.is_abnormal {
                // ChartSelection shows around the colour of the state.
                let halo = Stroke {
                    from,
                    to,
                    width: width + 3.0,
                    color: SELECTION,
                    cover: 0.55,
                    pattern: Pattern::Solid,
                    record: record as u32,
                };
                shape.strokes.push(halo);
            }
            let record = record as u32;
            shape.strokes.push(Stroke { from, to, width, color, cover, pattern, record });
        }
    }

    /// From each record of a piece of equipment to its next: surfaces for what is brushed
    /// or selected, lines on every axis for all.
    fn add_ribbons(&self, ranks: &BTreeMap<usize, Rank>, shape: &mut Shape) {
        for equipment in 0..self.board.records.equipment_count() {
            let own = self.board.records.of_equipment(equipment);
            let is_selected = self.board.selected.contains(&equipment);
            if self.board.is_dense() && !is_selected {
                continue;
            }
            for next in own.windows(2) {
                let [a, b] = [next[0] as usize, next[1] as usize];
                let (Some(_), Some(&rank)) = (ranks.get(&a), ranks.get(&b)) else { continue };
                let state =
                    &self.board.description.legend[self.board.records.all()[b].state as usize];
                let color = match (is_selected, state.is_abnormal) {
                    (_, true) => state.color,
                    (true, false) => SELECTION,
                    (false, false) => GREY,
                };
                let is_raised = is_selected || rank == Rank::Meant;
                for &[from, to] in self.pairs.iter().filter(|_| rank != Rank::Rest) {
                    let corners = [
                        self.place(a, from),
                        self.place(a, to),
                        self.place(b, to),
                        self.place(b, from),
                    ];
                    let cover = if is_raised { 0.35 } else { 0.05 };
                    shape.faces.push(Face { corners, color, cover });
                }
                for axis in 0..self.views.len() {
                    let cover = if is_raised { 0.9 } else { 0.25 };
                    shape.strokes.push(Stroke {
                        from: self.place(a, axis),
                        to: self.place(b, axis),
                        width: if is_raised { 1.6 } else { 1.0 },
                        color,
                        cover,
                        pattern: Pattern::Solid,
                        record: b as u32,
                    });
                }
            }
        }
    }

    fn add_clusters(&self, shape: &mut Shape) {
        let ParallelCoordinates { description, records, .. } = self.board;
        let is_known = |record| self.board.is_known(record);
        for (state, bands) in
            cluster::bands(records, self.views, description.legend.len(), is_known)
        {
            let state = &description.legend[state];
            let color = if state.is_abnormal { state.color } else { GREY };
            for &[from, to] in &self.pairs {
                let Some((a, b)) = bands[from].zip(bands[to]) else { continue };
                let corners = [
                    self.at(from, a[0], -0.01),
                    self.at(to, b[0], -0.01),
                    self.at(to, b[1], -0.01),
                    self.at(from, a[1], -0.01),
                ];
                shape.faces.push(Face { corners, color, cover: 0.22 });
                for [from, to] in [[corners[0], corners[1]], [corners[3], corners[2]]] {
                    shape.strokes.push(Stroke {
                        pattern: state.pattern,
                        ..super::axes::plain(from, to, 1.2, color, 0.8)
                    });
                }
            }
        }
    }
}
