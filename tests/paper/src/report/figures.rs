//! Figures 5 to 8.

use crate::document::Captioned;
use crate::results::SceneLevel;
use crate::study::{Level, SubjectStudy};
use crate::topology::TopologyCounts;
use crate::words::{grouped, percent, theta};
use crate::{Document, Results};

/// The theta of Figures 7 and 8.
pub(super) const LAST: f64 = 0.95;

pub(super) fn write(document: &mut Document, results: &Results) {
    document.heading("Figure 5: the scene");
    let level = |level: &SceneLevel| Captioned {
        file: level.picture.clone(),
        caption: caption("the scene", level.theta, &level.counts),
    };
    let shown = |wanted: &[f64]| -> Vec<Captioned> {
        wanted.iter().filter_map(|&theta| results.level(theta)).map(level).collect()
    };
    document.sheet("5a to 5c: theta 0, 70 and 85 %", 1, shown(&[0.0, 0.7, 0.85]));
    document.sheet("Besides: theta 50 and 95 %", 2, shown(&[0.5, 0.95]));

    document.heading("Figures 6 to 8: the power transformer");
    let welded = &results.study.welded;
    let mut pictures = pair(
        &format!("Fig. 6, {}", caption("full", 0.0, &welded.full)),
        &welded.picture,
        Some(&welded.wireframe),
    );
    pictures.extend(protected_and_not(welded, ["Fig. 7", "Fig. 8"]));
    document.sheet("One mesh of the station's power transformer, parallel projection", 2, pictures);
    document.text(compare_protection(welded, "The transformer as one welded mesh"));

    let split = &results.study.split;
    document.text(format!(
        "\"Convert all model meshes into vertex arrays\", says the paper's first step. Taken \
         literally, every vertex that a file splits at a seam of normals stays split: of the same \
         {} triangles, {} edges are borders then, and border protection has something to protect. \
         These are the same figures for that mesh.",
        grouped(split.full.triangles),
        grouped(split.full.border_edges)
    ));
    document.sheet(
        "The same with split vertices",
        2,
        protected_and_not(split, ["Fig. 7, split", "Fig. 8, split"]),
    );
    document.text(compare_protection(split, "With split vertices"));
    border_handling(document, results);
}

/// The 2 x 2 of {border C} x {w2}.
fn border_handling(document: &mut Document, results: &Results) {
    document.heading("Border handling, two by two");
    let combinations = [
        ("C = pi, w2 = alpha", "busbar"),
        ("C = pi, w2 = 0", "cpi_zero"),
        ("C = 0, w2 = alpha", "c0_alpha"),
        ("C = 0, w2 = 0", "unprotected"),
    ];
    for (subject, name) in
        [(&results.study.welded, "welded"), (&results.study.split, "split vertices")]
    {
        let rows = combinations.iter().filter_map(|&(what, id)| {
            let level = subject.level(id, LAST)?;
            Some(level_row(what, level))
        });
        let title = format!("Transformer, {name}, theta {}", theta(LAST));
        document.table(&title, &LEVEL_HEAD, rows.collect());
        let pictures = combinations.iter().filter_map(|&(what, id)| {
            let level = subject.level(id, LAST)?;
            let caption = caption(what, LAST, &level.counts);
            Some(Captioned { file: level.picture.clone(), caption })
        });
        document.sheet(&title, 2, pictures.collect());
    }
}

/// Columns of [`level_row`].
pub(super) const LEVEL_HEAD: [&str; 7] =
    ["", "triangles", "3-D shells kept", "flattened", "gone", "volume kept", "mean error"];

pub(super) fn level_row(name: &str, level: &Level) -> Vec<String> {
    let counts = &level.counts;
    vec![
        name.to_owned(),
        grouped(counts.triangles),
        grouped(counts.solid_shells),
        grouped(counts.flattened_shells),
        grouped(counts.vanished_shells),
        percent(level.volume_share),
        level.error.map_or_else(|| "nothing left".to_owned(), |error| percent(error.mean())),
    ]
}

fn protected_and_not(study: &SubjectStudy, names: [&str; 2]) -> Vec<Captioned> {
    let words = ["with border protection", "without border protection"];
    let ids = ["busbar", "unprotected"];
    let mut pictures = Vec::new();
    for ((id, name), words) in ids.into_iter().zip(names).zip(words) {
        if let Some(level) = study.level(id, LAST) {
            let caption = caption(&format!("{name}, {words}"), LAST, &level.counts);
            pictures.extend(pair(&caption, &level.picture, level.wireframe.as_deref()));
        }
    }
    pictures
}

fn pair(caption: &str, shaded: &str, wireframe: Option<&str>) -> Vec<Captioned> {
    let picture = |file: &str, caption| Captioned { file: file.to_owned(), caption };
    let shaded = picture(shaded, caption.to_owned());
    let wireframe = wireframe.map(|file| picture(file, format!("{caption}, wireframe")));
    [Some(shaded), wireframe].into_iter().flatten().collect()
}

pub(super) fn caption(what: &str, at: f64, counts: &TopologyCounts) -> String {
    format!(
        "{what}: theta {}, V = {}, T = {}",
        theta(at),
        grouped(counts.vertices),
        grouped(counts.triangles)
    )
}

fn compare_protection(study: &SubjectStudy, subject: &str) -> String {
    let (Some(with), Some(without)) =
        (study.level("busbar", LAST), study.level("unprotected", LAST))
    else {
        return String::new();
    };
    if study.full.border_edges == 0 {
        return format!(
            "{subject} has no border at all: each of its {} shells is closed. F is 0 on every edge \
             and alpha is 0, so that border protection can change nothing, and Figures 7 and 8 are \
             one picture ({} of {} shells kept in both).",
            grouped(study.full.shells),
            grouped(with.counts.solid_shells),
            grouped(study.full.shells)
        );
    }
    let keeps_more = with.counts.solid_shells > without.counts.solid_shells;
    format!(
        "{subject}, at {}: with border protection {} of {} shells keep three dimensions, {} are \
         flat and {} gone; without it {}, {} and {}. Border protection {} more three-dimensional \
         structure here.",
        theta(LAST),
        grouped(with.counts.solid_shells),
        grouped(study.full.shells),
        grouped(with.counts.flattened_shells),
        grouped(with.counts.vanished_shells),
        grouped(without.counts.solid_shells),
        grouped(without.counts.flattened_shells),
        grouped(without.counts.vanished_shells),
        if keeps_more { "keeps" } else { "does not keep" }
    )
}
