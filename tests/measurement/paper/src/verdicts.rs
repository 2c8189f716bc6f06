//! Verdicts on the paper's claims, each by a figure of the run.

use crate::reference::PrintedRow;
use crate::results::{MAX_CACHED_SHARE, Results};
use crate::run::{LARGE, SMALL};
use crate::study::{Level, SubjectStudy, THETAS};
use crate::theta_change::MAX_SHARE_OF_FRAME;
use report_writer::number_format::{factor, grouped, millis, percent, signed, theta};
use report_writer::{Claim, Verdict};

/// Least mean structural similarity of a picture that counts as "almost full".
const ALMOST_FULL_SSIM: f64 = 0.95;
/// Greatest share of the variance of a factor that is balanced with three others.
const BALANCED_SHARE: f64 = 0.5;
/// Greatest relative difference of vertex numbers at which errors are compared.
const EQUAL_VERTICES: f64 = 0.1;
/// Greatest difference from 1 of a quotient that counts as equal.
const NEAR: f64 = 0.05;

/// Judges the paper's claims.
pub(crate) fn judge(results: &Results) -> Vec<Claim> {
    let mut claims = counts(results);
    claims.extend(frame_rates(results));
    claims.extend(vision(results));
    claims.extend(equations(results));
    claims.extend(borders(results));
    claims.extend(orders(results));
    claims.push(lossless(results));
    claims
}

/// Judges the bars that this project sets itself.
pub(crate) fn bars(results: &Results) -> Vec<Claim> {
    let mut claims = Vec::new();
    for (at, least) in [(0.7, 0.8), (0.85, 0.65)] {
        let ratio = results.frames_of(SMALL, 1).and_then(|times| times.fps_ratio(at));
        let Some((ratio, bound)) = ratio.zip(results.triangle_ratio(at)) else { continue };
        claims.push(bar(
            format!(
                "Where triangles bound the frame (320 x 180), the frame rate at {} rises by at \
                 least {least} of the triangle ratio",
                theta(at)
            ),
            ratio >= least * bound,
            format!("{ratio:.2} of {bound:.2}: {:.2}", ratio / bound),
        ));
    }
    if let Some([large, small]) = results.shares_of_frame() {
        claims.push(bar(
            "A change of theta of the whole scene takes less than a tenth of a frame at theta 0",
            large < MAX_SHARE_OF_FRAME,
            format!(
                "{} ms: {} of a frame at 1280 x 720, {} at 320 x 180",
                millis(results.theta_change.change.p50_ms),
                percent(large),
                percent(small)
            ),
        ));
    }
    let stages = &results.stages;
    if let Some(share) = stages.cached_share() {
        claims.push(bar(
            "With the cache, optimisation takes at most a tenth of its time without",
            share <= MAX_CACHED_SHARE,
            percent(share),
        ));
    }
    claims
}

fn claim(claim: impl Into<String>, holds: bool, figure: impl Into<String>) -> Claim {
    Claim { claim: claim.into(), verdict: Verdict::of_claim(holds), figure: figure.into() }
}

fn bar(words: impl Into<String>, reached: bool, figure: impl Into<String>) -> Claim {
    Claim { claim: words.into(), verdict: Verdict::of_bar(reached), figure: figure.into() }
}

fn counts(results: &Results) -> Vec<Claim> {
    let mut claims = Vec::new();
    for at in [0.7, 0.85] {
        let (Some(level), Some(printed)) = (results.level(at), PrintedRow::at(at)) else {
            continue;
        };
        claims.push(claim(
            format!("Table I: {} vertices at {}", grouped(printed.vertices), theta(at)),
            level.counts.vertices == printed.vertices,
            format!("V - round(theta V) gives {}", grouped(level.counts.vertices)),
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
    for at in [0.7, 0.85] {
        let Some(printed) = PrintedRow::at(at) else { continue };
        let (rate, triangles) = (printed.fps_ratio(), printed.triangle_ratio());
        let ours = |size| factor(results.frames_of(size, 1).and_then(|times| times.fps_ratio(at)));
        claims.push(claim(
            format!("{rate:.2} times the frame rate at {}, in step with triangles", theta(at)),
            (rate / triangles - 1.0).abs() < NEAR,
            format!(
                "its own triangle ratio is {triangles:.2}, which it {}; ours: {} at 320 x 180 and {} \
                 at 1280 x 720, of {}",
                if rate > triangles { "exceeds" } else { "falls short of" },
                ours(SMALL),
                ours(LARGE),
                factor(results.triangle_ratio(at))
            ),
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
    let (welded, open) = (&results.study.welded, &results.study.open);
    let printed = mean_quotients(welded, "eq4_printed", "busbar");
    let flags = mean_quotients(open, "eq2_printed", "busbar");
    let mut claims = vec![
        claim(
            "Eq. 4 as printed puts the less important edges first",
            none_exceeds(&printed, 1.0),
            format!("mean error over that of the mended sign: {}", times(&printed)),
        ),
        claim(
            "It matters whether F is 0 on a border (Eq. 2) or 1 (text)",
            flags.iter().any(|&(_, quotient)| (quotient - 1.0).abs() > NEAR),
            format!(
                "mean error of F = 0 over that of F = 1, without undersides, C = pi on borders: {}",
                times(&flags)
            ),
        ),
    ];
    let largest = welded.variance_shares.iter().copied().fold(0.0, f64::max);
    let [length, flag, area, curvature] = welded.variance_shares.map(percent);
    claims.push(claim(
        "Every factor contributes a balanced value to W",
        largest <= BALANCED_SHARE,
        format!("shares in the variance of W: L {length}, F {flag}, S {area}, C {curvature}"),
    ));
    claims
}

fn borders(results: &Results) -> Vec<Claim> {
    let mut claims = Vec::new();
    let study = &results.study;
    for (study, subject) in
        [(&study.welded, "the transformer"), (&study.open, "the transformer without undersides")]
    {
        claims.extend(keeps_more(
            study,
            format!(
                "Figs. 7 and 8: border protection keeps more 3-D structure at 95 % of {subject}"
            ),
            ["busbar", "unprotected"],
        ));
    }
    claims.extend(keeps_more(
        &study.open,
        "The flag F alone, weighted by alpha, protects borders (C = 0 there)".to_owned(),
        ["c0_alpha", "unprotected"],
    ));
    let split = study.split.level("busbar", 0.85);
    claims.extend(split.map(|level| {
        claim(
            "Step 1, \"convert all model meshes into vertex arrays\", without welding",
            level.counts.solid_shells > 0,
            format!(
                "at 85 % {} of {} shells keep three dimensions, {} triangles are left",
                grouped(level.counts.solid_shells),
                grouped(study.split.full.shells),
                grouped(level.counts.triangles)
            ),
        )
    }));
    claims
}

/// Judges whether the first of two variants keeps more three-dimensional shells at 95 % than the
/// second.
fn keeps_more(study: &SubjectStudy, words: String, [with, without]: [&str; 2]) -> Option<Claim> {
    let (with, without) = (study.level(with, 0.95)?, study.level(without, 0.95)?);
    Some(claim(
        words,
        with.counts.solid_shells > without.counts.solid_shells,
        format!(
            "{} 3-D shells with, {} without, of {}; area {} and {}; mean error {} and {}; {} \
             border edges",
            grouped(with.counts.solid_shells),
            grouped(without.counts.solid_shells),
            grouped(study.full.shells),
            percent(with.area_share),
            percent(without.area_share),
            mean_of(with),
            mean_of(without),
            grouped(study.full.border_edges)
        ),
    ))
}

fn orders(results: &Results) -> Vec<Claim> {
    let study = &results.study.welded;
    let compared = [
        ("reweighted", "A list sorted once needs no weights computed anew"),
        ("guarded", "Collapses need no check for folds"),
        ("meshoptimizer", "The order retains figuration finely, as a peer of today does"),
    ];
    let judged = compared.into_iter().filter_map(|(id, words)| {
        let name = study.variant(id)?.name;
        let quotients = mean_quotients(study, "busbar", id);
        let figure = format!("mean error over that of \"{name}\": {}", times(&quotients));
        Some(claim(words, none_exceeds(&quotients, 1.0 + NEAR), figure))
    });
    judged.collect()
}

fn lossless(results: &Results) -> Claim {
    let walk = &results.lossless;
    let short = |hash: &str| hash.chars().take(12).collect::<String>();
    claim(
        "Reconstruction is lossless",
        walk.is_lossless(),
        format!(
            "{} random moves; hash of the index bytes at theta 0 {} before, {} after",
            grouped(walk.moves as u64),
            short(&walk.before),
            short(&walk.after)
        ),
    )
}

/// Divides the mean errors of one variant by those of another at each theta at which they keep
/// about as many vertices.
fn mean_quotients(study: &SubjectStudy, of: &str, over: &str) -> Vec<(f64, f64)> {
    let quotient = |at| {
        let (of, over) = (study.level(of, at)?, study.level(over, at)?);
        let vertices = of.counts.vertices as f64 / over.counts.vertices as f64;
        let errors = of.error?.mean() / over.error?.mean();
        ((vertices - 1.0).abs() <= EQUAL_VERTICES).then_some((at, errors))
    };
    THETAS.into_iter().filter_map(quotient).collect()
}

/// Reports whether there are quotients and none exceeds `most`.
fn none_exceeds(quotients: &[(f64, f64)], most: f64) -> bool {
    !quotients.is_empty() && quotients.iter().all(|&(_, quotient)| quotient <= most)
}

fn times(quotients: &[(f64, f64)]) -> String {
    let one = |&(at, quotient): &(f64, f64)| format!("{quotient:.2} times (at {})", theta(at));
    quotients.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn mean_of(level: &Level) -> String {
    level.error.map_or_else(|| "none".to_owned(), |error| percent(error.mean()))
}
