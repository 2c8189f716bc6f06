//! Verdicts on the figures: bars that are met or missed, and columns in which Busbar is worse than
//! a peer.

use report_writer::{Claim, Document, Verdict};

use crate::levels::method::{BASELINE, OURS};
use crate::levels::{Levels, MethodResult, SubjectResult, THETAS};

/// Greatest ratio of Busbar's mean distance to the baseline's, for each theta.
const MEAN_BARS: [f64; 3] = [0.6, 0.75, 1.0];
/// Greatest ratio of the whole sequence's time to that of the baseline's first level.
const SEQUENCE_BAR: f64 = 1.5;
/// Greatest memory of the optimisation, bytes a triangle.
const MEMORY_BAR: f64 = 200.0;
/// Greatest share of triangles that coincide with another.
const DUPLICATES_BAR: f64 = 0.001;
/// Greatest relative difference of a peer's vertices from the target at which levels are compared.
const EQUAL_VERTICES: f64 = 0.03;
/// Greatest ratio of figures that count as equal.
const NEAR: f64 = 1.02;

/// Column of figures, with the direction that is better.
struct Column {
    name: &'static str,
    /// Noise floor: smaller figures are not compared.
    floor: f64,
    value: fn(&SubjectResult, &MethodResult, usize) -> Option<f64>,
}

const COLUMNS: [Column; 12] = [
    column("mean distance", 1e-9, |_, m, l| Some(m.levels[l].error?.mean_of_both())),
    column("RMS distance", 1e-9, |_, m, l| Some(m.levels[l].error?.rms_of_both())),
    column("greatest distance", 1e-9, |_, m, l| Some(m.levels[l].error?.max())),
    column("normals turned", 1e-3, |_, m, l| Some(m.levels[l].error?.degrees_of_both())),
    column("picture (1 - SSIM)", 1e-5, |_, m, l| Some(1.0 - m.levels[l].picture.ssim)),
    column("silhouette", 1e-5, |_, m, l| Some(m.levels[l].picture.silhouette)),
    column("components lost", 0.5, |s, m, l| {
        Some(f64::from(s.counts.components.saturating_sub(m.levels[l].counts.components)))
    }),
    column("border loops changed", 0.5, |s, m, l| {
        Some(s.counts.border_loops.abs_diff(m.levels[l].counts.border_loops) as f64)
    }),
    column("duplicates", 1e-6, |_, m, l| Some(m.levels[l].counts.duplicates)),
    column("new non-manifold edges", 0.5, |s, m, l| Some(new_non_manifold(s, m, l) as f64)),
    column("seconds, one level", 1e-6, |_, m, l| (l == 0).then_some(m.cost.one_seconds)),
    column("peak memory", 1e6, |_, m, l| (l == 0).then_some(m.cost.peak_bytes as f64)),
];

const fn column(
    name: &'static str,
    floor: f64,
    value: fn(&SubjectResult, &MethodResult, usize) -> Option<f64>,
) -> Column {
    Column { name, floor, value }
}

/// Counts the edges of a level with more than two triangles, beyond those of the original.
pub(super) fn new_non_manifold(
    subject: &SubjectResult,
    method: &MethodResult,
    level: usize,
) -> u64 {
    method.levels[level].counts.non_manifold.saturating_sub(subject.counts.non_manifold)
}

/// Reports whether a peer's level has about the target number of vertices. Busbar's levels never
/// have more, and fewer in use where shells are gone.
fn has_target_vertices(subject: &SubjectResult, theirs: &MethodResult, level: usize) -> bool {
    let found = theirs.levels[level].counts.vertices as f64;
    (found / subject.wanted[level] as f64 - 1.0).abs() <= EQUAL_VERTICES
}

/// Judges the bars of the comparison.
pub(crate) fn bars(levels: &Levels) -> Vec<Claim> {
    let mut claims = Vec::new();
    for subject in levels.subjects.iter().filter(|subject| subject.is_judged) {
        let Some((ours, baseline)) = subject.method(OURS).zip(subject.method(BASELINE)) else {
            continue;
        };
        let name = &subject.name;
        for (index, (theta, bar)) in THETAS.into_iter().zip(MEAN_BARS).enumerate() {
            let means = [ours, baseline].map(|m| m.levels[index].error.map(|e| e.mean_of_both()));
            let [Some(a), Some(b)] = means else { continue };
            claims.push(Claim {
                claim: format!(
                    "{name}, theta {:.0} %: mean distance at most {bar} of {BASELINE}'s",
                    theta * 100.0
                ),
                verdict: Verdict::of_bar(
                    a <= bar * b && has_target_vertices(subject, baseline, index),
                ),
                figure: format!("{:.3}", a / b),
            });
        }
        let times = ours.cost.all_seconds / baseline.cost.one_seconds;
        claims.push(Claim {
            claim: format!(
                "{name}: the whole sequence and its levels in at most {SEQUENCE_BAR} times \
                 {BASELINE}'s one level of 30 %, one core"
            ),
            verdict: Verdict::of_bar(times <= SEQUENCE_BAR),
            figure: format!("{times:.2} times"),
        });
        let bytes = ours.cost.peak_bytes as f64 / subject.counts.triangles as f64;
        claims.push(Claim {
            claim: format!("{name}: at most {MEMORY_BAR} bytes a triangle while it is made"),
            verdict: Verdict::of_bar(bytes <= MEMORY_BAR),
            figure: format!("{bytes:.0} bytes"),
        });
        let worst = ours.levels.iter().map(|level| level.counts.duplicates).fold(0.0, f64::max);
        let edges = (0..THETAS.len()).map(|level| new_non_manifold(subject, ours, level)).max();
        claims.push(Claim {
            claim: format!("{name}: no new non-manifold edge, duplicates at most 0.1 %"),
            verdict: Verdict::of_bar(worst <= DUPLICATES_BAR && edges == Some(0)),
            figure: format!("{:.3} %, {} edges", worst * 100.0, edges.unwrap_or(0)),
        });
    }
    claims
}

/// Writes the report's first lines: the levels at which Busbar is worse than a peer.
pub(crate) fn write_worse(document: &mut Document, levels: &Levels) {
    let mut peers: Vec<&str> = Vec::new();
    for method in levels.subjects.iter().flat_map(|s| &s.methods).filter(|m| m.is_peer) {
        if !peers.contains(&method.id) {
            peers.push(method.id);
        }
    }
    let rows = COLUMNS.iter().map(|column| {
        let cells = peers.iter().map(|peer| describe_losses(levels, column, peer));
        std::iter::once(column.name.to_owned()).chain(cells).collect::<Vec<_>>()
    });
    let rows: Vec<Vec<String>> = rows.collect();
    let is_worse = |cell: &String| cell.contains("worse");
    let count = rows.iter().flat_map(|row| &row[1..]).filter(|cell| is_worse(cell)).count();
    document.text(match count {
        0 => format!("{OURS} is worse than no peer in any column."),
        _ => format!(
            "Where {OURS} is worse: in {count} of {} pairs of a column and a peer, at some theta \
             of some mesh. Of the peer's levels that came within 3 % of the vertices wanted: how \
             many ours is worse than by more than 2 %, by how many times at most, and where.",
            COLUMNS.len() * peers.len()
        ),
    });
    let head: Vec<&str> = std::iter::once("column").chain(peers.iter().copied()).collect();
    document.table(&format!("{OURS} beside each peer"), &head, rows);
}

/// Describes the levels at which Busbar is worse than a peer in one column.
fn describe_losses(levels: &Levels, column: &Column, peer: &str) -> String {
    let (mut compared, mut count, mut most) = (0, 0, (0.0, String::new()));
    for subject in &levels.subjects {
        let Some((ours, theirs)) = subject.method(OURS).zip(subject.method(peer)) else { continue };
        for (level, theta) in THETAS.into_iter().enumerate() {
            let values = [ours, theirs].map(|method| (column.value)(subject, method, level));
            let [Some(a), Some(b)] = values else { continue };
            if !has_target_vertices(subject, theirs, level) {
                continue;
            }
            compared += 1;
            let times = a.max(column.floor) / b.max(column.floor);
            if times > NEAR {
                count += 1;
                if times > most.0 {
                    most = (times, format!("{} {:.0} %", subject.name, theta * 100.0));
                }
            }
        }
    }
    match (compared, count) {
        (0, _) => "not comparable".to_owned(),
        (_, 0) => format!("in none of {compared}"),
        _ => format!("worse in {count} of {compared}, up to {:.2} times ({})", most.0, most.1),
    }
}

#[cfg(test)]
mod tests {
    use measure::{PictureError, SurfaceError};

    use super::*;
    use crate::levels::figures::{Counts, Figures};
    use crate::levels::worker::Cost;

    const COUNTS: Counts = Counts {
        vertices: 1000,
        triangles: 2000,
        components: 3,
        border_loops: 2,
        non_manifold: 0,
        duplicates: 0.0,
    };

    fn method(id: &'static str, mean: f64, seconds: f64) -> MethodResult {
        let error = SurfaceError {
            mean_forth: mean,
            rms_forth: mean,
            max_forth: mean,
            degrees_forth: 1.0,
            mean_back: mean,
            rms_back: mean,
            max_back: mean,
            degrees_back: 1.0,
        };
        let picture = PictureError { ssim: 0.99, silhouette: 0.01 };
        let level = Figures { counts: COUNTS, error: Some(error), picture };
        let cost = Cost {
            one_seconds: seconds,
            all_seconds: seconds,
            peak_bytes: 100_000,
            claimed: Vec::new(),
        };
        MethodResult { id, is_peer: id != OURS, cost, levels: vec![level; 3] }
    }

    fn levels(ours: MethodResult) -> Levels {
        let subject = SubjectResult {
            name: "mesh".to_owned(),
            is_judged: true,
            diagonal: 1.0,
            counts: COUNTS,
            wanted: vec![1000; 3],
            methods: vec![method(BASELINE, 1e-4, 1.0), ours],
            sheet: None,
        };
        Levels { subjects: vec![subject], remarks: Vec::new() }
    }

    #[test]
    fn bars_follow_the_figures() {
        let verdicts = |mean, seconds| {
            bars(&levels(method(OURS, mean, seconds)))
                .iter()
                .map(|claim| claim.verdict == Verdict::Met)
                .collect::<Vec<_>>()
        };
        assert_eq!(verdicts(0.5e-4, 1.4), [true; 6]);
        assert_eq!(verdicts(0.7e-4, 1.6), [false, true, true, false, true, true]);
        let mut few = levels(method(OURS, 0.5e-4, 1.0));
        few.subjects[0].methods[0].levels[0].counts.vertices = 900;
        assert_eq!(bars(&few)[0].verdict, Verdict::Missed, "a peer with fewer is no measure");
    }

    #[test]
    fn what_is_worse_is_said_first() {
        let text = |ours| {
            let mut document = Document::default();
            write_worse(&mut document, &levels(ours));
            report_writer::markdown(&document)
        };
        let good = text(method(OURS, 0.5e-4, 0.5));
        assert!(good.contains("worse than no peer in any column"), "{good}");
        let bad = text(method(OURS, 2e-4, 0.5));
        assert!(bad.contains("worse in 3 of 3, up to 2.00 times (mesh 70 %)"), "{bad}");
        assert!(bad.contains("in none of 1"), "{bad}");
    }
}
