//! The paper's claims, each judged by a figure of the run.

use crate::document::{Claim, Verdict};
use crate::reference::PrintedRow;
use crate::results::Results;
use crate::run::{LARGE, SMALL};
use crate::study::{Level, SubjectStudy};
use crate::theta_change::MAX_SHARE_OF_FRAME;
use crate::words::{factor, grouped, percent, signed, theta};

/// Mean structural similarity from which a picture counts as "almost full".
const ALMOST_FULL_SSIM: f64 = 0.95;
/// A factor is balanced with three others if it explains no more than this.
const BALANCED_SHARE: f64 = 0.5;
/// Counts that differ by less agree: scenes are not the same.
const NEAR: f64 = 0.05;

/// Every claim.
pub(crate) fn judge(results: &Results) -> Vec<Claim> {
    let mut claims = Vec::new();
    claims.extend(counts(results));
    claims.extend(frame_rates(results));
    claims.extend(vision(results));
    claims.extend(equations(results));
    claims.extend(borders(results));
    claims.extend(orders(results));
    claims.extend(running(results));
    claims
}

fn claim(claim: impl Into<String>, holds: bool, figure: impl Into<String>) -> Claim {
    Claim { claim: claim.into(), verdict: Verdict::of(holds), figure: figure.into() }
}

fn counts(results: &Results) -> Vec<Claim> {
    let mut claims = Vec::new();
    for at in [0.7, 0.85] {
        let (Some(level), Some(printed)) = (results.level(at), PrintedRow::at(at)) else {
            continue;
        };
        let counts = level.counts;
        claims.push(claim(
            format!("Table I: {} vertices at {}", grouped(printed.vertices), theta(at)),
            counts.vertices == printed.vertices,
            format!("V - round(theta V) gives {}", grouped(counts.vertices)),
        ));
        let quotient = counts.triangles as f64 / printed.triangles as f64;
        claims.push(claim(
            format!("Table I: {} triangles at {}", grouped(printed.triangles), theta(at)),
            (quotient - 1.0).abs() < NEAR,
            format!("{} here, {quotient:.2} times as many", grouped(counts.triangles)),
        ));
    }
    if let (Some(middle), Some(low)) = (results.level(0.7), results.level(0.85)) {
        let (middle, low) = (middle.counts, low.counts);
        claims.push(claim(
            "Table I: 2V - T grows from 70 to 85 %, as pieces flatten",
            low.two_v_minus_t > middle.two_v_minus_t
                && low.flattened_shells > middle.flattened_shells,
            format!(
                "{} to {}; flattened shells {} to {}",
                signed(middle.two_v_minus_t),
                signed(low.two_v_minus_t),
                grouped(middle.flattened_shells),
                grouped(low.flattened_shells)
            ),
        ));
    }
    claims
}

fn frame_rates(results: &Results) -> Vec<Claim> {
    let mut claims = Vec::new();
    for (at, words) in [
        (0.7, "3.97 times the frame rate at 70 %, by fewer triangles"),
        (0.85, "4.62 times the frame rate at 85 %, which uses what fewer triangles allow"),
    ] {
        let Some(printed) = PrintedRow::at(at) else { continue };
        let share = printed.fps_ratio() / printed.triangle_ratio();
        let ours = |size| {
            let ratio = results.frames_of(size, 1).and_then(|times| times.fps_ratio(at));
            factor(ratio)
        };
        claims.push(claim(
            words,
            (0.8..=1.0).contains(&share),
            format!(
                "its own triangle ratio is {:.2}: {share:.2} of it; ours: {} at 320 x 180, {} at \
                 1280 x 720, of {}",
                printed.triangle_ratio(),
                ours(SMALL),
                ours(LARGE),
                factor(results.triangle_ratio(at))
            ),
        ));
    }
    for (at, bar) in [(0.7, 0.8), (0.85, 0.65)] {
        let ratio = results.frames_of(SMALL, 1).and_then(|times| times.fps_ratio(at));
        let Some((ratio, bound)) = ratio.zip(results.triangle_ratio(at)) else { continue };
        claims.push(claim(
            format!("Our bar: at {} and 320 x 180, {bar} of the triangle ratio", theta(at)),
            ratio >= bar * bound,
            format!("{ratio:.2} of {bound:.2}: {:.2}", ratio / bound),
        ));
    }
    claims
}

fn vision(results: &Results) -> Vec<Claim> {
    let (Some(middle), Some(low)) = (results.level(0.7), results.level(0.85)) else {
        return Vec::new();
    };
    let (middle, low) = (middle.difference.ssim, low.difference.ssim);
    vec![
        claim(
            "\"Almost full\" vision at 70 %",
            middle >= ALMOST_FULL_SSIM,
            format!("SSIM {middle:.3} to theta 0; {ALMOST_FULL_SSIM} counts as almost full"),
        ),
        claim(
            "\"Details lost\" at 85 %",
            low < ALMOST_FULL_SSIM && low < middle,
            format!("SSIM {low:.3}"),
        ),
    ]
}

fn equations(results: &Results) -> Vec<Claim> {
    let mut claims = Vec::new();
    let study = &results.study.welded;
    if let Some(quotient) = mean_quotient(study, "eq4_printed", "busbar", 0.85) {
        claims.push(claim(
            "Eq. 4 as printed puts the less important edges first",
            quotient <= 1.0,
            format!("{quotient:.1} times the mean error of the mended sign, transformer at 85 %"),
        ));
    }
    let split = &results.study.split;
    if let Some(quotient) = mean_quotient(split, "eq2_printed", "busbar", 0.85) {
        claims.push(claim(
            "Eq. 2 as printed (F = 0 on a border) protects borders as the text's F = 1 does",
            (quotient - 1.0).abs() < NEAR || quotient < 1.0,
            format!(
                "{quotient:.2} times the mean error of F = 1, transformer with split vertices at \
                 85 %"
            ),
        ));
    }
    let largest = study.variance_shares.iter().copied().fold(0.0, f64::max);
    let [length, flag, area, curvature] = study.variance_shares.map(percent);
    claims.push(claim(
        "Every factor contributes a balanced value to W",
        largest <= BALANCED_SHARE,
        format!("shares in the variance of W: L {length}, F {flag}, S {area}, C {curvature}"),
    ));
    claims
}

fn borders(results: &Results) -> Vec<Claim> {
    let mut claims = Vec::new();
    let at = 0.95;
    for (study, subject) in [
        (&results.study.welded, "welded transformer"),
        (&results.study.split, "transformer with split vertices"),
    ] {
        let (Some(with), Some(without)) =
            (study.level("busbar", at), study.level("unprotected", at))
        else {
            continue;
        };
        claims.push(claim(
            format!("Figs. 7 and 8: border protection keeps more 3-D structure at 95 %, {subject}"),
            with.counts.solid_shells > without.counts.solid_shells,
            format!(
                "{} 3-D shells with, {} without, of {}; mean error {} and {}; {} border edges",
                grouped(with.counts.solid_shells),
                grouped(without.counts.solid_shells),
                grouped(study.full.shells),
                mean_of(with),
                mean_of(without),
                grouped(study.full.border_edges)
            ),
        ));
    }
    let split = &results.study.split;
    if let (Some(weighted), Some(zero)) =
        (split.level("c0_alpha", at), split.level("unprotected", at))
    {
        let better = weighted.counts.solid_shells > zero.counts.solid_shells;
        claims.push(claim(
            "The flag F alone, weighted by alpha, protects borders (border C = 0)",
            better,
            format!(
                "3-D shells {} with w2 = alpha, {} with w2 = 0; mean error {} and {}",
                grouped(weighted.counts.solid_shells),
                grouped(zero.counts.solid_shells),
                mean_of(weighted),
                mean_of(zero)
            ),
        ));
    }
    claims
}

fn orders(results: &Results) -> Vec<Claim> {
    let study = &results.study.welded;
    let compared = [
        ("reweighted", "A static list L needs no weights computed anew"),
        ("guarded", "Collapses need no check for folds"),
        ("meshoptimizer", "The order retains figuration finely, as a peer of today would"),
    ];
    let judged = compared.into_iter().filter_map(|(id, words)| {
        let quotients: Vec<f64> = [0.7, 0.85, 0.95]
            .into_iter()
            .filter_map(|at| mean_quotient(study, "busbar", id, at))
            .collect();
        let [a, b, c] = <[f64; 3]>::try_from(quotients).ok()?;
        let name = study.variant(id)?.name;
        Some(claim(
            words,
            [a, b, c].into_iter().all(|quotient| quotient <= 1.0 + NEAR),
            format!(
                "{a:.1}, {b:.1} and {c:.1} times the mean error of: {name}, transformer at 70, 85 \
                 and 95 %"
            ),
        ))
    });
    judged.collect()
}

fn running(results: &Results) -> Vec<Claim> {
    let (change, walk) = (&results.theta_change, &results.lossless);
    vec![
        claim(
            "Reconstruction is lossless",
            walk.is_lossless(),
            format!(
                "{} random moves, index bytes at theta 0 {} before and {} after",
                grouped(walk.moves as u64),
                &walk.before[..walk.before.len().min(12)],
                &walk.after[..walk.after.len().min(12)]
            ),
        ),
        claim(
            "Theta can change while roaming (our bar: a tenth of a frame at theta 0)",
            change.share_of_frame() < MAX_SHARE_OF_FRAME,
            format!(
                "{:.1} ms, {} of a frame of {:.1} ms at 320 x 180",
                change.change.p50_ms,
                percent(change.share_of_frame()),
                change.full_frame.p50_ms
            ),
        ),
    ]
}

/// The mean error of one variant over that of another.
fn mean_quotient(study: &SubjectStudy, of: &str, over: &str, at: f64) -> Option<f64> {
    let mean = |id| Some(study.level(id, at)?.error?.mean());
    Some(mean(of)? / mean(over)?)
}

fn mean_of(level: &Level) -> String {
    level.error.map_or_else(|| "none".to_owned(), |error| percent(error.mean()))
}
