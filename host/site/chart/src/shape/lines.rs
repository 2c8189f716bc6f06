//! Geometry of record lines: normal records in grey, abnormal ones in the color and pattern of
//! their state; brushed and selected ones in front.

use std::collections::BTreeMap;

use busbar_types::Pattern;

use super::{Face, GREY, INK, SELECTION, Shape, Stroke};
use crate::layout::{MISSING_LANE, depth_of};
use crate::parallel_coordinates::MAX_STROKED_RECORDS;
use crate::{AxisView, Layout, ParallelCoordinates, Size, cluster};

/// Emphasis of a record's line, in ascending order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Emphasis {
    /// Record that is not brushed, where others are.
    Rest,
    /// An earlier record of its equipment.
    Earlier,
    /// The last known record of its equipment.
    Latest,
    /// Record that is brushed.
    Brushed,
    /// Record of selected equipment.
    Selected,
}

impl Emphasis {
    /// Width in points, and how much a normal and an abnormal line cover.
    fn style(self) -> (f32, [f32; 2]) {
        match self {
            Self::Rest => (1.0, [0.1, 0.16]),
            Self::Earlier => (1.0, [0.2, 0.45]),
            Self::Latest => (1.8, [0.75, 1.0]),
            Self::Brushed => (1.8, [0.9, 1.0]),
            Self::Selected => (3.0, [1.0, 1.0]),
        }
    }
}

pub(super) fn add(chart: &ParallelCoordinates, now: i64, shape: &mut Shape) {
    let views = chart.shown_axes();
    let lines = LineBuilder::new(chart, &views);
    if chart.shows_clusters {
        lines.add_clusters(shape);
    }
    let emphases = emphases(chart, now);
    if chart.layout == Layout::Time {
        lines.add_ribbons(&emphases, shape);
    }
    let mut drawn: Vec<(Emphasis, usize)> =
        emphases.into_iter().map(|(at, emphasis)| (emphasis, at)).collect();
    // What is to be seen most comes last, and so in front.
    drawn.sort_unstable();
    for (emphasis, record) in drawn {
        lines.add_record(record, emphasis, shape);
    }
}

/// Ranks each record that is drawn.
fn emphases(chart: &ParallelCoordinates, now: i64) -> BTreeMap<usize, Emphasis> {
    let has_brush = !chart.brushes().is_empty();
    let selected = chart.selected.iter().flat_map(|&one| chart.records.of_equipment(one));
    // The last ones, where there are too many.
    let selected = selected.map(|&record| record as usize).rev().take(MAX_STROKED_RECORDS);
    let drawn: Vec<usize> = match chart.is_dense() {
        true => selected.collect(),
        false => (0..chart.records.len()).collect(),
    };
    let emphasis = |record: usize| match chart.is_brushed(record) {
        true => Emphasis::Brushed,
        false if has_brush => Emphasis::Rest,
        false => Emphasis::Earlier,
    };
    let known = drawn.into_iter().filter(|&record| chart.is_known(record));
    let mut emphases: BTreeMap<usize, Emphasis> =
        known.map(|record| (record, emphasis(record))).collect();
    for known in chart.known(now) {
        let Some(emphasis) = emphases.get_mut(&known.record) else { continue };
        if *emphasis == Emphasis::Earlier {
            *emphasis = Emphasis::Latest;
        }
        if chart.selected.contains(&known.equipment) {
            *emphasis = Emphasis::Selected;
        }
    }
    emphases
}

/// Builder of the lines between axes.
struct LineBuilder<'a> {
    chart: &'a ParallelCoordinates,
    views: &'a [AxisView],
    feet: Vec<[f32; 2]>,
    pairs: Vec<[usize; 2]>,
    span: [i64; 2],
}

impl<'a> LineBuilder<'a> {
    fn new(chart: &'a ParallelCoordinates, views: &'a [AxisView]) -> Self {
        let feet = chart.layout.axis_positions(views.len(), chart.size);
        let pairs = chart.layout.pairs(views.len());
        Self { chart, views, feet, pairs, span: chart.records.span().unwrap_or_default() }
    }

    fn at(&self, axis: usize, position: f32, back: f32) -> [f32; 3] {
        let [x, z] = self.feet[axis];
        [x, position * self.chart.size.height, z + back]
    }

    /// Returns the position of a record on an axis; in the lane below where it has no value.
    fn place(&self, record: usize, axis: usize) -> [f32; 3] {
        let view = &self.views[axis];
        let position = view.position(self.chart.records.row(record)[view.axis]);
        self.at(axis, position.unwrap_or(MISSING_LANE), self.back(record))
    }

    fn back(&self, record: usize) -> f32 {
        let Size { depth, .. } = self.chart.size;
        match self.chart.layout {
            Layout::Time => depth_of(self.chart.records.all()[record].unix_nanos, self.span, depth),
            Layout::Flat | Layout::Focus => 0.0,
        }
    }

    fn add_record(&self, record: usize, emphasis: Emphasis, shape: &mut Shape) {
        let state = &self.chart.description.legend[self.chart.records.all()[record].state as usize];
        let (width, covers) = emphasis.style();
        let (color, pattern, cover) = match (emphasis, state.is_abnormal) {
            (Emphasis::Selected, false) => (SELECTION, Pattern::Solid, 1.0),
            (Emphasis::Brushed, false) => (INK, Pattern::Solid, covers[0]),
            (Emphasis::Rest, _) => (GREY, Pattern::Solid, covers[0]),
            (_, false) => (GREY, Pattern::Solid, covers[0]),
            (_, true) => (state.color, state.pattern, covers[1]),
        };
        for &[from, to] in &self.pairs {
            let (from, to) = (self.place(record, from), self.place(record, to));
            if emphasis == Emphasis::Selected && state.is_abnormal {
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

    /// Connects each record of a piece of equipment to its next: ribbons for brushed or selected
    /// records, lines on every axis for all.
    fn add_ribbons(&self, emphases: &BTreeMap<usize, Emphasis>, shape: &mut Shape) {
        for equipment in 0..self.chart.records.equipment_count() {
            let own = self.chart.records.of_equipment(equipment);
            let is_selected = self.chart.selected.contains(&equipment);
            if self.chart.is_dense() && !is_selected {
                continue;
            }
            for next in own.windows(2) {
                let [a, b] = [next[0] as usize, next[1] as usize];
                let (Some(_), Some(&emphasis)) = (emphases.get(&a), emphases.get(&b)) else {
                    continue;
                };
                let state =
                    &self.chart.description.legend[self.chart.records.all()[b].state as usize];
                let color = match (is_selected, state.is_abnormal) {
                    (_, true) => state.color,
                    (true, false) => SELECTION,
                    (false, false) => GREY,
                };
                let is_raised = is_selected || emphasis == Emphasis::Brushed;
                for &[from, to] in self.pairs.iter().filter(|_| emphasis != Emphasis::Rest) {
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
        let ParallelCoordinates { description, records, .. } = self.chart;
        let is_known = |record| self.chart.is_known(record);
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
