//! Texts and view models of the chart.

use busbar_chart::{Axis, AxisView, Brush, ChartSelection, State};
use busbar_ui::{
    ChartAxisRow, ChartModel, ChartOverlay, EquipmentExplanation, LegendRow, ProjectedChartAxis,
};

use super::SceneChart;
use crate::chart_stats::{ChartAxisStats, ChartEvidence, ChartStats};
use busbar_camera::Projection;

const NANOS_PER_DAY: i64 = 86_400_000_000_000;
/// Values that a tooltip lists.
const MAX_VALUES: usize = 12;

pub(super) fn overlay(chart: &SceneChart, projection: Projection) -> ChartOverlay {
    let shape = &chart.geometry.shape;
    let text = |text: &busbar_chart::Text| {
        Some((chart.on_screen(text.at, projection)?, text.text.clone(), text.kind))
    };
    let order = chart.board.order();
    let places: Vec<usize> = (0..order.len()).filter(|&at| !order[at].is_hidden).collect();
    let axis = |(shown, [foot, head]): (usize, &[[f32; 3]; 2])| {
        let place = *places.get(shown)?;
        Some(ProjectedChartAxis {
            shown,
            place,
            foot: chart.on_screen(*foot, projection)?,
            head: chart.on_screen(*head, projection)?,
            brushed: brushed(chart, &order[place]),
        })
    };
    let axes = shape.axes.iter().enumerate().filter_map(axis).collect();
    ChartOverlay {
        texts: shape.texts.iter().filter_map(text).collect(),
        axes,
        tooltip: chart.hovered.map_or_else(Vec::new, |record| tooltip(chart, record)),
    }
}

/// Brushed intervals of an axis, as positions.
fn brushed(chart: &SceneChart, view: &AxisView) -> Vec<[f32; 2]> {
    let Some((ranges, _)) = chart.board.brushes().on(view.axis) else { return Vec::new() };
    ranges
        .iter()
        .filter_map(|[low, high]| {
            let (a, b) = (view.position(*low)?, view.position(*high)?);
            Some([a.min(b), a.max(b)])
        })
        .collect()
}

fn tooltip(chart: &SceneChart, record: usize) -> Vec<String> {
    let description = chart.board.description();
    let own = chart.board.records().all()[record];
    let mut lines = vec![
        format!("{}  {}", description.equipment[own.equipment as usize], date(own.unix_nanos)),
        description.legend[own.state as usize].name.clone(),
    ];
    let values = chart.board.records().row(record);
    lines.extend(description.axes.iter().zip(values).take(MAX_VALUES).map(|(axis, value)| {
        match value.is_nan() {
            true => format!("{}: none", axis.name),
            false => format!("{}: {} {}", axis.name, number(*value), axis.unit),
        }
    }));
    lines
}

fn name(chart: &SceneChart) -> String {
    match chart.board.description().name.as_str() {
        "" => "Chart".to_owned(),
        name => name.to_owned(),
    }
}

pub(super) fn model(chart: &SceneChart, fault: Option<String>) -> ChartModel {
    let board = &chart.board;
    let description = board.description();
    let [known, meant] = counts(chart);
    let axis = |view: &AxisView| ChartAxisRow {
        name: named(&description.axes[view.axis]),
        is_hidden: view.is_hidden,
        is_flipped: view.is_flipped,
        log: view.log,
    };
    ChartModel {
        name: name(chart),
        fault,
        layout: board.layout(),
        axes: board.order().iter().map(axis).collect(),
        join: board.brushes().operator,
        brushes: board.brushes().list.iter().map(|brush| brush_words(chart, brush)).collect(),
        known,
        meant: (!board.brushes().is_empty()).then_some(meant),
        meant_equipment: brushed_ids(chart),
        density: chart.density.row(),
        legend: description.legend.iter().map(legend_row).collect(),
        span: board.records().span(),
        playhead: board.playhead(),
        shown_at: match board.playhead() {
            None => "the present".to_owned(),
            Some(playhead) => format!("what was known on {}", date(playhead)),
        },
        plays: board.plays(),
        follows: chart.follows,
        shows_clusters: board.shows_clusters(),
    }
}

/// Returns the numbers of known and of brushed records; for a density display, as far as counted.
fn counts(chart: &SceneChart) -> [usize; 2] {
    let board = &chart.board;
    if board.is_dense() {
        return chart.density.counts().unwrap_or_default();
    }
    let known = || (0..board.records().len()).filter(|&record| board.is_known(record));
    [known().count(), known().filter(|&record| board.is_brushed(record)).count()]
}

pub(super) fn stats(chart: &SceneChart, fault: Option<String>) -> ChartStats {
    let description = chart.board.description();
    let state = |one: &ChartSelection| {
        let name = one.state.map(|state| description.legend[state as usize].name.clone());
        (description.equipment[one.equipment].clone(), name)
    };
    let explained = chart.explained.as_ref();
    let evidence = explained.map_or(&[][..], |(_, explanation)| &explanation.evidence);
    ChartStats {
        records: chart.board.records().len(),
        meant: counts(chart)[1],
        is_counting: chart.density.needs_frames(),
        brushed: brushed_ids(chart),
        states: chart.known.iter().flatten().map(state).collect(),
        axes: chart.projected_axes.iter().filter_map(|axis| axis_stats(chart, axis)).collect(),
        explained: explained.map(|(at, _)| description.equipment[*at].clone()),
        verdict: explained.map(|(_, explanation)| explanation.verdict.clone()),
        evidence: evidence
            .iter()
            .map(|one| ChartEvidence {
                method: one.method.clone(),
                result: one.result.clone(),
                agrees: one.agrees,
            })
            .collect(),
        fault,
    }
}

fn axis_stats(chart: &SceneChart, axis: &ProjectedChartAxis) -> Option<ChartAxisStats> {
    let view = chart.board.order().get(axis.place)?;
    let ends = if view.is_flipped { [view.high, view.low] } else { [view.low, view.high] };
    Some(ChartAxisStats {
        name: chart.board.description().axes[view.axis].name.clone(),
        foot: axis.foot.into(),
        head: axis.head.into(),
        ends,
        log: view.log,
    })
}

fn brushed_ids(chart: &SceneChart) -> Vec<String> {
    let ids = &chart.board.description().equipment;
    chart.brushed_known().map(|one| ids[one.equipment].clone()).collect()
}

/// Returns the explanation of the selected equipment.
pub(super) fn explained(chart: &SceneChart) -> Option<EquipmentExplanation> {
    let (at, explanation) = chart.explained.as_ref()?;
    let known = (*chart.known.get(*at)?)?;
    let description = chart.board.description();
    let days = known.age_nanos / NANOS_PER_DAY;
    Some(EquipmentExplanation {
        chart: name(chart),
        id: description.equipment[*at].clone(),
        state: description.legend.get(explanation.state as usize).map(legend_row),
        taken: format!("record of {}, {days} days old", date(explanation.unix_nanos)),
        is_outdated: known.state.is_none(),
        explanation: explanation.clone(),
    })
}

fn brush_words(chart: &SceneChart, brush: &Brush) -> String {
    let axes = &chart.board.description().axes;
    match brush {
        Brush::Ranges { axis, ranges, with_missing } => {
            let range = |[low, high]: &[f32; 2]| match (*low <= f32::MIN, *high >= f32::MAX) {
                (true, true) => "any value".to_owned(),
                (true, false) => format!("up to {}", number(*high)),
                (false, true) => format!("from {}", number(*low)),
                (false, false) => format!("{} to {}", number(*low), number(*high)),
            };
            let mut parts: Vec<String> = ranges.iter().map(range).collect();
            parts.extend(with_missing.then(|| "none".to_owned()));
            format!("{}: {}", axes[*axis].name, parts.join(" or "))
        }
        Brush::Rise { axes: [from, to], range } => {
            let [low, high] = range.map(|share| (share * 100.0).round());
            let (from, to) = (&axes[*from].name, &axes[*to].name);
            format!("{from} to {to}: rises {low} to {high} %")
        }
    }
}

fn legend_row(state: &State) -> LegendRow {
    LegendRow { name: state.name.clone(), color: state.color, pattern: state.pattern }
}

fn named(axis: &Axis) -> String {
    match axis.unit.as_str() {
        "" => axis.name.clone(),
        unit => format!("{} [{unit}]", axis.name),
    }
}

fn number(value: f32) -> String {
    busbar_chart::short(value)
}

fn date(unix_nanos: i64) -> String {
    busbar_chart::date(unix_nanos)
}
