//! The density of records that are too many for lines: counted on the device beside the
//! frames, and where its picture stands.

use busbar_chart::{Brush, BrushOperator, DensityRequest, ParallelCoordinates, bin_edges};
use busbar_renderer::{
    BrushedAxis, DensityInput, DensityPlane, DensityProgress, DensitySummary, RecoveryAction,
    RenderError, Renderer,
};
use busbar_ui::DensityLegend;
use glam::Affine3A;

/// Colors of unbrushed and of brushed lines, sRGB.
const LINES: [u8; 3] = [72, 76, 82];
const MEANT: [u8; 3] = [10, 12, 16];

/// State of the density count.
#[derive(Default)]
pub(super) struct Density {
    /// Requested count, and its number.
    request: Option<DensityRequest>,
    arrangement: u64,
    progress: DensityProgress,
    /// Request and summary of the displayed count.
    shown: Option<(DensityRequest, DensitySummary)>,
    /// Reason why the records cannot be counted.
    fault: Option<String>,
    planes: Vec<DensityPlane>,
}

impl Density {
    /// Continues the count within a frame's budget; with `settles` it waits for the whole count.
    pub(super) fn advance(
        &mut self,
        renderer: &mut Renderer,
        (board, last_read): (&ParallelCoordinates, u64),
        world_from_chart: Affine3A,
        settles: bool,
    ) -> Result<(), RenderError> {
        let Some(wanted) = board.density() else {
            *self = Self { arrangement: self.arrangement, ..Self::default() };
            return Ok(());
        };
        self.request_count(&wanted);
        let Some(request) = &self.request else { return Ok(()) };
        match count(renderer, request, board, (last_read, self.arrangement), settles) {
            Ok(progress) => (self.progress, self.fault) = (progress, None),
            Err(error) if error.recovery_action() == RecoveryAction::None => {
                self.progress = DensityProgress::default();
                self.fault = Some(error.to_string());
            }
            Err(error) => return Err(error),
        }
        match self.progress.shown {
            None => self.shown = None,
            Some(summary) if summary.arrangement == self.arrangement => {
                self.shown = Some((request.clone(), summary));
            }
            Some(_) => {}
        }
        self.place_planes(&wanted, board, world_from_chart);
        Ok(())
    }

    /// Requests a count. While playback runs, a count that has begun is finished first.
    fn request_count(&mut self, wanted: &DensityRequest) {
        let is_counting = self.is_counting();
        let stays = self.request.as_ref().is_some_and(|request| {
            request == wanted || (is_counting && request.differs_only_in_time(wanted))
        });
        if !stays {
            self.request = Some(wanted.clone());
            self.arrangement += 1;
        }
    }

    fn is_counting(&self) -> bool {
        let shown = self.progress.shown.map(|summary| summary.arrangement);
        self.fault.is_none() && shown != Some(self.arrangement)
    }

    /// Reports whether the count needs more frames.
    pub(super) fn needs_frames(&self) -> bool {
        self.request.is_some() && self.is_counting()
    }

    /// Lets the picture stand between the axes that it was counted for, or nowhere.
    fn place_planes(
        &mut self,
        wanted: &DensityRequest,
        board: &ParallelCoordinates,
        world_from_chart: Affine3A,
    ) {
        self.planes.clear();
        let Some((request, summary)) = &self.shown else { return };
        if !request.has_same_axes(wanted) {
            return;
        }
        let is_brushed = summary.brushed > 0 || !wanted.brushes.is_empty();
        let meant = (is_brushed && request.brushes == wanted.brushes).then_some(MEANT);
        let world = |at: [f32; 3]| world_from_chart.transform_point3(at.into());
        let plane = |[from, to]: [[f32; 3]; 2]| DensityPlane {
            from: world(from),
            to: world(to),
            height: board.height(),
            color: LINES,
            brushed: meant,
        };
        self.planes.extend(board.density_axis_positions().into_iter().map(plane));
    }

    pub(super) fn planes(&self) -> &[DensityPlane] {
        &self.planes
    }

    /// Records that are known and those of them that are meant, as far as they are counted.
    pub(super) fn counts(&self) -> Option<[usize; 2]> {
        let (_, summary) = self.shown.as_ref().filter(|_| !self.is_counting())?;
        Some([summary.lines as usize, summary.brushed as usize])
    }

    /// Returns the density part of the chart's legend.
    pub(super) fn row(&self) -> Option<DensityLegend> {
        self.request.as_ref()?;
        let summary = self.shown.as_ref().map(|(_, summary)| *summary).unwrap_or_default();
        Some(DensityLegend {
            counting: self.needs_frames().then_some([self.progress.counted, self.progress.of]),
            most: summary.peak as usize,
            fault: self.fault.clone(),
        })
    }
}

fn count(
    renderer: &mut Renderer,
    request: &DensityRequest,
    board: &ParallelCoordinates,
    (revision, arrangement): (u64, u64),
    settles: bool,
) -> Result<DensityProgress, RenderError> {
    let records = board.records();
    let shown: Vec<_> = request.views.iter().map(|view| (view.axis, bin_edges(view))).collect();
    let flipped: Vec<bool> = request.views.iter().map(|view| view.is_flipped).collect();
    let brushes: Vec<BrushedAxis<'_>> = request
        .brushes
        .list
        .iter()
        .filter_map(|brush| match brush {
            Brush::Ranges { axis, ranges, with_missing } => {
                Some(BrushedAxis { axis: *axis, ranges, with_missing: *with_missing })
            }
            Brush::Rise { .. } => None,
        })
        .collect();
    let known = |record| request.is_known(records, record);
    let given = |record| request.meets_rises(records, record);
    let input = DensityInput {
        revision,
        arrangement,
        axes: records.axes(),
        values: records.values(),
        binned_axes: &shown,
        flipped: &flipped,
        pairs: &request.pairs,
        brushes: &brushes,
        any: request.brushes.operator == BrushOperator::Or,
        record_filter: if request.playhead.is_some() { Some(&known) } else { None },
        brush_filter: if request.has_rises() { Some(&given) } else { None },
    };
    renderer.advance_density(&input, settles)
}
