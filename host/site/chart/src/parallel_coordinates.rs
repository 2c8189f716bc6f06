//! One chart as an operator has arranged it.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::layout::{MISSING_EDGE, depth_of};
use crate::{
    Action, AxisView, Brush, Brushes, DensityRequest, Description, Layout, Record, Records, Size,
    export,
};

/// Limit of records drawn as lines. A larger chart is drawn as density, with at most as many
/// lines for selected records.
pub const MAX_STROKED_RECORDS: usize = 20_000;
/// Seconds in which the chart plays from its first record to its last.
const PLAY_SECONDS: f64 = 30.0;
const NANOS_PER_SECOND: i64 = 1_000_000_000;

/// Chart in parallel coordinates, as an operator has arranged it.
#[derive(Clone, Debug)]
pub struct ParallelCoordinates {
    pub(crate) description: Arc<Description>,
    pub(crate) records: Records,
    /// All axes, from left to right.
    pub(crate) order: Vec<AxisView>,
    pub(crate) layout: Layout,
    pub(crate) size: Size,
    brushes: Brushes,
    pub(crate) playhead: Option<i64>,
    plays: bool,
    pub(crate) shows_clusters: bool,
    /// Equipment, by its index.
    pub(crate) selected: BTreeSet<usize>,
    /// Brushing result of each record; empty where records are too many to compute it at once.
    brushed: Vec<bool>,
    /// Revision number, which grows with every visible change.
    revision: u64,
}

/// Selection of a piece of equipment with its last known record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChartSelection {
    /// Index of the equipment described.
    pub equipment: usize,
    /// Index of the record.
    pub record: usize,
    /// Index of the legend's entry; `None` where the record is too old to speak for the
    /// equipment.
    pub state: Option<u32>,
    /// Age of the record at the instant shown, nanoseconds.
    pub age_nanos: i64,
}

impl ParallelCoordinates {
    /// An empty chart that takes so much room.
    pub fn new(size: Size) -> Self {
        Self {
            description: Arc::default(),
            records: Records::default(),
            order: Vec::new(),
            layout: Layout::default(),
            size,
            brushes: Brushes::default(),
            playhead: None,
            plays: false,
            shows_clusters: false,
            selected: BTreeSet::new(),
            brushed: Vec::new(),
            revision: 0,
        }
    }

    /// Replaces the records. Arrangement and brushes are kept where the axes are the same.
    pub fn set_data(&mut self, description: Arc<Description>, records: Records) {
        if self.description.axes != description.axes {
            let views = description.axes.iter().enumerate();
            self.order = views.map(|(index, axis)| AxisView::new(index, axis)).collect();
            self.brushes = Brushes::default();
        }
        let ids: BTreeSet<&String> =
            self.selected.iter().filter_map(|&at| self.description.equipment.get(at)).collect();
        let there = description.equipment.iter().enumerate();
        self.selected = there.filter(|(_, id)| ids.contains(id)).map(|(at, _)| at).collect();
        (self.description, self.records) = (description, records);
        self.brush();
    }

    /// Returns the description of the chart.
    pub fn description(&self) -> &Arc<Description> {
        &self.description
    }

    /// Returns the records of the chart.
    pub fn records(&self) -> &Records {
        &self.records
    }

    /// Returns all axes from left to right, hidden ones included.
    pub fn order(&self) -> &[AxisView] {
        &self.order
    }

    /// Axes that are shown, from the left to the right.
    pub fn shown_axes(&self) -> Vec<AxisView> {
        self.order.iter().filter(|view| !view.is_hidden).copied().collect()
    }

    /// Returns the layout of the axes.
    pub fn layout(&self) -> Layout {
        self.layout
    }

    /// Returns the height of the axes, metres.
    pub fn height(&self) -> f32 {
        self.size.height
    }

    /// Returns the brushes of the chart.
    pub fn brushes(&self) -> &Brushes {
        &self.brushes
    }

    /// Reports whether a record is brushed.
    pub fn is_brushed(&self, record: usize) -> bool {
        let matches = || self.brushes.matches(self.records.row(record), &self.order);
        self.brushed.get(record).copied().unwrap_or_else(matches)
    }

    /// Records that a brush means.
    pub fn brushed(&self) -> impl Iterator<Item = usize> {
        (0..self.records.len()).filter(|&record| self.is_brushed(record))
    }

    /// The instant that is shown; `None` for the present.
    pub fn playhead(&self) -> Option<i64> {
        self.playhead
    }

    /// Reports whether the playhead moves.
    pub fn plays(&self) -> bool {
        self.plays
    }

    /// Reports whether quantile bands of the states are shown.
    pub fn shows_clusters(&self) -> bool {
        self.shows_clusters
    }

    /// Returns a number that grows with every visible change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Reports whether the records are too many for lines, so that a density is drawn.
    pub fn is_dense(&self) -> bool {
        self.records.len() > MAX_STROKED_RECORDS
    }

    /// Returns the request of a density where records are too many for lines; `None` otherwise.
    pub fn density(&self) -> Option<DensityRequest> {
        let views = self.shown_axes();
        self.is_dense().then(|| DensityRequest {
            pairs: self.layout.pairs(views.len()),
            views,
            brushes: self.brushes.clone(),
            playhead: self.playhead,
            order: self.order.clone(),
        })
    }

    /// Returns the feet of each pair of axes in the density's picture, metres.
    pub fn density_axis_positions(&self) -> Vec<[[f32; 3]; 2]> {
        let count = self.shown_axes().len();
        let feet = self.layout.axis_positions(count, self.size);
        let back = self.density_depth();
        let foot = |axis: usize| [feet[axis][0], 0.0, feet[axis][1] + back];
        self.layout.pairs(count).into_iter().map(|[from, to]| [foot(from), foot(to)]).collect()
    }

    /// Returns the depth of the density's picture, metres: at the instant shown where time runs
    /// into the depth, and just behind the lines elsewhere.
    fn density_depth(&self) -> f32 {
        const BEHIND: f32 = 0.01;
        match (self.layout, self.records.span()) {
            (Layout::Time, Some(span)) => {
                depth_of(self.playhead.unwrap_or(span[1]), span, self.size.depth)
            }
            _ => -BEHIND,
        }
    }

    /// Reports whether a record exists at the instant shown.
    pub fn is_known(&self, record: usize) -> bool {
        let record: &Record = &self.records.all()[record];
        self.playhead.is_none_or(|playhead| record.unix_nanos <= playhead)
    }

    /// Applies an operator's action.
    pub fn apply(&mut self, action: &Action) {
        match action {
            Action::SetLayout(layout) => self.layout = *layout,
            Action::AddBrush { brush, alone } => self.brushes.add(brush.clone(), *alone),
            Action::RemoveBrush(index) if *index < self.brushes.list.len() => {
                self.brushes.list.remove(*index);
            }
            Action::RemoveBrush(_) => {}
            Action::ClearBrushes => self.brushes.list.clear(),
            Action::SetBrushOperator(operator) => self.brushes.operator = *operator,
            Action::MoveAxis { from, to } => {
                if (*from).max(*to) < self.order.len() {
                    let moved = self.order.remove(*from);
                    self.order.insert(*to, moved);
                }
            }
            Action::FlipAxis(at) => self.with_axis(*at, |view, _| view.is_flipped ^= true),
            Action::HideAxis(at) => {
                let shown = self.shown_axes().len();
                self.with_axis(*at, |view, _| view.is_hidden = !view.is_hidden && shown > 2);
            }
            Action::SwitchScale(at) => self.with_axis(*at, |view, _| {
                view.log = !view.log && view.low >= f32::MIN_POSITIVE;
            }),
            Action::Rescale(at) => self.rescale(*at),
            Action::SetPlayhead(playhead) => self.playhead = *playhead,
            Action::Play(plays) => {
                self.plays = *plays;
                let span = self.records.span();
                let is_over = |[_, last]: &[i64; 2]| self.playhead.is_none_or(|at| at >= *last);
                if let Some([first, _]) = span.filter(|span| *plays && is_over(span)) {
                    self.playhead = Some(first);
                }
            }
            Action::ShowClusters(shows) => self.shows_clusters = *shows,
        }
        self.brush();
    }

    fn with_axis(&mut self, at: usize, change: impl FnOnce(&mut AxisView, &Description)) {
        if let Some(view) = self.order.get_mut(at) {
            change(view, &self.description);
        }
    }

    /// Rescales an axis to the range of brushed values.
    fn rescale(&mut self, at: usize) {
        let brushed: Vec<usize> = self.brushed().collect();
        let Some(view) = self.order.get_mut(at) else { return };
        let values = brushed.into_iter().map(|record| self.records.row(record)[view.axis]);
        let is_usable = |value: &f32| !value.is_nan() && (!view.log || *value > 0.0);
        let values: Vec<f32> = values.filter(is_usable).collect();
        let low = values.iter().copied().reduce(f32::min);
        let high = values.iter().copied().reduce(f32::max);
        let axis = &self.description.axes[view.axis];
        let span = low.zip(high).filter(|(low, high)| low < high);
        (view.low, view.high) = span.unwrap_or((axis.low, axis.high));
        // What begins at 0 or below has no logarithm.
        view.log &= view.low >= f32::MIN_POSITIVE;
    }

    /// Advances the playhead by a time.
    pub fn advance(&mut self, seconds: f64) {
        let (true, Some([first, last])) = (self.plays, self.records.span()) else { return };
        let at = self.playhead.unwrap_or(first);
        let step = (last - first) as f64 * seconds.max(0.0) / PLAY_SECONDS;
        let next = at.saturating_add(step as i64).min(last);
        self.plays = next < last;
        self.playhead = Some(next);
        self.brush();
    }

    /// Marks the lines of equipment.
    pub fn select(&mut self, equipment: BTreeSet<usize>) {
        if self.selected != equipment {
            self.selected = equipment;
            self.revision += 1;
        }
    }

    /// Recomputes the brushed records.
    fn brush(&mut self) {
        self.brushed = match self.is_dense() {
            true => Vec::new(),
            false => self.brushes.select(&self.records, &self.order),
        };
        self.revision += 1;
    }

    /// Returns the last record of each piece of equipment at the instant shown, `now` for the
    /// present; nanoseconds since 1970-01-01 UTC.
    pub fn known(&self, now: i64) -> impl Iterator<Item = ChartSelection> + '_ {
        let at = self.playhead.unwrap_or(now);
        let valid = i64::try_from(self.description.valid_seconds).unwrap_or(i64::MAX);
        let valid = valid.saturating_mul(NANOS_PER_SECOND);
        (0..self.records.equipment_count()).filter_map(move |equipment| {
            let record = self.records.latest(equipment, Some(at))?;
            let Record { unix_nanos, state, .. } = self.records.all()[record];
            let age_nanos = at.saturating_sub(unix_nanos);
            let state = (age_nanos <= valid).then_some(state);
            Some(ChartSelection { equipment, record, state, age_nanos })
        })
    }

    /// Equipment whose last known record a brush means.
    pub fn brushed_equipment(&self, now: i64) -> Vec<usize> {
        let known = self.known(now).filter(|known| self.is_brushed(known.record));
        known.map(|known| known.equipment).collect()
    }

    /// The records that brushes mean as CSV; all that are known where there is no brush.
    pub fn csv(&self) -> String {
        let all = self.brushes.is_empty();
        let is_brushed = |record| self.is_known(record) && (all || self.is_brushed(record));
        export::csv(&self.description, &self.records, is_brushed)
    }

    /// Creates the brush for an interval of positions on a shown axis: 0 at its foot, 1 at its
    /// head. An interval below the foot selects the lane of records without a value.
    pub fn brush_at(&self, shown: usize, positions: [f32; 2]) -> Option<Brush> {
        let view = *self.shown_axes().get(shown)?;
        let [low, high] = [positions[0].min(positions[1]), positions[0].max(positions[1])];
        let with_missing = low < MISSING_EDGE;
        let ends = [view.value_at(low), view.value_at(high)];
        // What is beyond the ends of an axis is drawn there.
        let open = |value: f32| match value {
            value if value <= view.low => f32::MIN,
            value if value >= view.high => f32::MAX,
            value => value,
        };
        let range = [open(ends[0].min(ends[1])), open(ends[0].max(ends[1]))];
        let ranges = if high < 0.0 { Vec::new() } else { vec![range] };
        Some(Brush::Ranges { axis: view.axis, ranges, with_missing })
    }
}
