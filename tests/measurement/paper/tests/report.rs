//! The report's files from made-up results: nothing missing, nothing typed in.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use measure::SurfaceError;
use paper::frames::{FrameRow, FrameTimes};
use paper::image_difference::ImageDifference;
use paper::lossless::{FixedPlace, LosslessWalk};
use paper::machine::Machine;
use paper::picks::PickChanges;
use paper::results::{Results, SceneLevel, Stages};
use paper::series::Series;
use paper::study::{Level, Study, SubjectStudy, THETAS, VariantResult};
use paper::theta_change::ThetaChange;
use paper::topology::TopologyCounts;
use paper::{report, write_report};
use report_writer::{Block, Document, Verdict};

const VARIANTS: [&str; 7] = [
    "busbar",
    "c0_alpha",
    "cpi_zero",
    "unprotected",
    "eq4_printed",
    "eq2_printed",
    "meshoptimizer",
];

fn series(p50_ms: f64) -> Series {
    Series { count: 60, p50_ms, p99_ms: p50_ms * 1.2 }
}

fn counts(theta: f64) -> TopologyCounts {
    let left = |full: f64| (full * (1.0 - theta)).round() as u64;
    TopologyCounts {
        vertices: left(536_141.0),
        triangles: left(1_057_086.0),
        two_v_minus_t: 15_196,
        shells: 3799,
        solid_shells: left(3799.0),
        flattened_shells: 3799 - left(3799.0),
        ..TopologyCounts::default()
    }
}

fn scene_level(theta: f64) -> SceneLevel {
    SceneLevel {
        theta,
        counts: counts(theta),
        difference: ImageDifference {
            ssim: 1.0 - theta * 0.05,
            psnr_db: (theta > 0.0).then_some(30.0),
        },
        picture: format!("scene-{theta}.png"),
    }
}

fn frame_times(size: [u32; 2]) -> FrameTimes {
    let row = |theta: f64| FrameRow {
        theta,
        triangles: counts(theta).triangles,
        frame: series(10.0 + 100.0 * (1.0 - theta)),
    };
    FrameTimes { size, samples: 1, rows: [0.0, 0.5, 0.7, 0.85, 0.95].map(row).to_vec() }
}

fn level(id: &str, theta: f64) -> Level {
    let error = if id == "eq4_printed" { 0.08 } else { 0.01 } * theta;
    let [mean_forth, max_forth, mean_back, max_back] = [1.0, 9.0, 0.5, 4.0].map(|f| f * error);
    Level {
        theta,
        counts: counts(theta),
        error: Some(SurfaceError {
            mean_forth,
            rms_forth: mean_forth,
            max_forth,
            degrees_forth: 0.0,
            mean_back,
            rms_back: mean_back,
            max_back,
            degrees_back: 0.0,
        }),
        area_share: 1.0 - theta / 2.0,
        volume_share: Some(1.0 - theta),
        picture: format!("{id}-{theta}.png"),
        wireframe: (theta == 0.95).then(|| format!("{id}-{theta}-wire.png")),
    }
}

fn study(prefix: &str, border_edges: u64) -> SubjectStudy {
    let variant = |&id: &&'static str| VariantResult {
        id,
        name: id,
        millis: 12.0,
        levels: THETAS.map(|theta| level(id, theta)).to_vec(),
    };
    SubjectStudy {
        full: TopologyCounts { border_edges, ..counts(0.0) },
        picture: format!("{prefix}.png"),
        wireframe: format!("{prefix}-wire.png"),
        variance_shares: [0.05, 0.01, 0.02, 0.92],
        variants: VARIANTS.iter().map(variant).collect(),
    }
}

fn results() -> Results {
    let hash = "0123456789abcdef0123456789abcdef".to_owned();
    let stages: BTreeMap<String, f64> =
        [("import", 400.0), ("optimize", 300.0), ("optimize/sort", 30.0), ("upload", 40.0)]
            .into_iter()
            .map(|(name, millis)| (name.to_owned(), millis))
            .collect();
    let cached = BTreeMap::from([("import".to_owned(), 400.0), ("cache".to_owned(), 15.0)]);
    Results {
        machine: Machine {
            processor: "A processor".into(),
            threads: 2,
            device: "A device <&>".into(),
        },
        quick: true,
        levels: [0.0, 0.5, 0.7, 0.85, 0.95].map(scene_level).to_vec(),
        frames: vec![frame_times([1280, 720]), frame_times([320, 180])],
        stages: Stages { first: stages, second: cached, weld: 100.0 },
        theta_change: ThetaChange {
            resolve: series(3.0),
            change: series(4.0),
            full_frame: series(100.0),
            size: [320, 180],
        },
        study: Study {
            welded: study("welded", 0),
            open: study("open", 900),
            split: study("split", 5000),
        },
        lossless: LosslessWalk {
            moves: 10_000,
            before: hash.clone(),
            after: hash.clone(),
            visits: vec![FixedPlace { theta: 0.7, cursor: 7, hash, visits: 9, differing: 0 }],
            triangles_checked: 5_000_000,
            equipment: 865,
        },
        picks: PickChanges {
            pixels: 10_000,
            on_equipment: 6000,
            pieces: 300,
            to_other: 20,
            to_background: 30,
            from_background: 10,
        },
    }
}

fn verdict_of(document: &Document, start: &str) -> Verdict {
    let claims = document.blocks.iter().filter_map(|block| match block {
        Block::Claims(claims) => Some(claims),
        _ => None,
    });
    let claim = claims.flatten().find(|claim| claim.claim.starts_with(start));
    claim.unwrap_or_else(|| panic!("no claim starts with '{start}'")).verdict
}

#[test]
fn tables_are_complete_and_nothing_is_not_a_number() {
    let document = report(&results());
    let mut tables = 0;
    for block in &document.blocks {
        if let Block::Table(table) = block {
            tables += 1;
            assert!(!table.rows.is_empty(), "{} is empty", table.caption);
            for row in &table.rows {
                assert_eq!(row.len(), table.head.len(), "{}: {row:?}", table.caption);
            }
        }
    }
    assert!(tables >= 12, "{tables} tables");
    let text = report_writer::markdown(&document) + &report_writer::html(&document);
    for wrong in ["NaN", " inf", ">inf"] {
        assert!(!text.contains(wrong), "{wrong}");
    }
}

#[test]
fn verdicts_follow_the_figures() {
    let mut changed = results();
    let document = report(&changed);
    assert_eq!(verdict_of(&document, "Reconstruction"), Verdict::Confirmed);
    assert_eq!(verdict_of(&document, "Eq. 4"), Verdict::Refuted);
    assert_eq!(verdict_of(&document, "Every factor"), Verdict::Refuted);
    assert_eq!(verdict_of(&document, "A change of theta"), Verdict::Met);
    assert_eq!(verdict_of(&document, "3.97 times"), Verdict::Refuted);
    assert_eq!(verdict_of(&document, "With the cache"), Verdict::Met);

    changed.lossless.after = "ffffffffffffffffffffffffffffffff".to_owned();
    changed.study.welded.variance_shares = [0.25; 4];
    changed.theta_change.change = series(12.0);
    changed.stages.second.insert("cache".to_owned(), 60.0);
    let document = report(&changed);
    assert_eq!(verdict_of(&document, "Reconstruction"), Verdict::Refuted);
    assert_eq!(verdict_of(&document, "Every factor"), Verdict::Confirmed);
    assert_eq!(verdict_of(&document, "A change of theta"), Verdict::Missed);
    assert_eq!(verdict_of(&document, "With the cache"), Verdict::Missed);
}

#[test]
fn the_files_link_to_pictures_that_are_there() {
    let folder = tempfile::tempdir().unwrap();
    let results = results();
    let document = report(&results);
    for picture in document.pictures() {
        fs::write(folder.path().join(picture), "picture").unwrap();
    }
    let [markdown, html, json] = write_report(&results, folder.path()).unwrap();
    let markdown = fs::read_to_string(markdown).unwrap();
    let html = fs::read_to_string(html).unwrap();
    let in_markdown = links(&markdown, "](", ')');
    assert_eq!(links(&html, "<img src=\"", '"').len(), document.pictures().count());
    assert_eq!(in_markdown.len(), document.pictures().count() + 2, "pictures and two charts");
    for link in in_markdown.iter().chain(&links(&html, "src=\"", '"')) {
        assert!(Path::new(folder.path()).join(link).is_file(), "{link}");
    }
    assert!(html.contains("A device &lt;&amp;&gt;") && html.contains("<svg"));
    assert!(!html.contains("<script") && !html.contains("src=\"http"));
    let json: serde_json::Value = serde_json::from_str(&fs::read_to_string(json).unwrap()).unwrap();
    assert_eq!(json["levels"].as_array().unwrap().len(), 5);
    assert_eq!(json["study"]["welded"]["variants"][0]["id"], "busbar");
    assert_eq!(json["lossless"]["moves"], 10_000);
}

fn links(text: &str, start: &str, end: char) -> Vec<String> {
    text.split(start).skip(1).filter_map(|rest| rest.split(end).next()).map(str::to_owned).collect()
}
