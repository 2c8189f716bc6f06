//! Section on Figures 5 to 8.

use crate::results::SceneLevel;
use crate::study::{Level, SubjectStudy};
use crate::topology::TopologyCounts;
use report_writer::CaptionedPicture;
use report_writer::Document;
use report_writer::number_format::{grouped, percent, theta};

use crate::Results;

/// Theta of Figures 7 and 8.
pub(super) const LAST: f64 = 0.95;

pub(super) fn write(document: &mut Document, results: &Results) {
    document.heading("Figure 5: the scene");
    let level = |level: &SceneLevel| CaptionedPicture {
        file: level.picture.clone(),
        caption: caption("the scene", level.theta, &level.counts),
    };
    let shown = |wanted: &[f64]| -> Vec<CaptionedPicture> {
        wanted.iter().filter_map(|&theta| results.level(theta)).map(level).collect()
    };
    document.sheet("5a to 5c: theta 0, 70 and 85 %", 1, shown(&[0.0, 0.7, 0.85]));
    document.sheet("Besides: theta 50 and 95 %", 2, shown(&[0.5, 0.95]));

    document.heading("Figures 6 to 8: the power transformer");
    let study = &results.study;
    let note = "One mesh of the station's power transformer, parallel projection";
    document.sheet(note, 2, with_and_without(&study.welded));
    document.text(compare_protection(&study.welded, "The transformer"));
    document.text(
        "The paper's models are not known. To see what border protection does where there are \
         borders, the same transformer without its undersides, which modellers often leave out:",
    );
    document.sheet("The same without undersides", 2, with_and_without(&study.open));
    document.text(compare_protection(&study.open, "Without undersides the transformer"));
    border_handling(document, &study.open);
    split_vertices(document, &study.split);
}

/// Writes the 2 x 2 comparison of {border C} x {w2}.
fn border_handling(document: &mut Document, study: &SubjectStudy) {
    document.heading("Border handling, two by two");
    document.text(
        "Eq. 4 has no second normal on a border, so C must be chosen there: pi or 0. w2 is alpha, or \
         0 without the flag. Transformer without undersides:",
    );
    let combinations = [
        ("C = pi, w2 = alpha", "busbar"),
        ("C = pi, w2 = 0", "cpi_zero"),
        ("C = 0, w2 = alpha", "c0_alpha"),
        ("C = 0, w2 = 0", "unprotected"),
    ];
    let levels =
        || combinations.iter().filter_map(|&(what, id)| Some((what, study.level(id, LAST)?)));
    let title = format!("Theta {}", theta(LAST));
    let rows = levels().map(|(what, level)| level_row(what, level)).collect();
    document.table(&title, &LEVEL_HEAD, rows);
    let picture = |(what, level): (&str, &Level)| CaptionedPicture {
        file: level.picture.clone(),
        caption: caption(what, LAST, &level.counts),
    };
    document.sheet(&title, 2, levels().map(picture).collect());
}

/// Writes the section about unwelded vertex arrays as files hold them.
fn split_vertices(document: &mut Document, study: &SubjectStudy) {
    document.heading("Vertex arrays, literally");
    document.text(format!(
        "\"Convert all model meshes into vertex arrays\", says the paper's first step. Files split \
         a vertex at every seam of normals. Without welding, the same {} triangles have {} \
         vertices and {} border edges: nearly every patch between seams is a piece of its own, \
         that tears off its neighbours and shrinks to a point.",
        grouped(study.full.triangles),
        grouped(study.full.vertices),
        grouped(study.full.border_edges)
    ));
    let rows = study.variants.iter().flat_map(|variant| {
        variant.levels.iter().map(move |level| {
            level_row(&format!("{}; {}", variant.name, theta(level.theta)), level)
        })
    });
    document.table("Split vertices", &LEVEL_HEAD, rows.collect());
    let first = study.variants.iter().filter_map(|variant| {
        let level = variant.levels.first()?;
        let caption = caption(variant.name, level.theta, &level.counts);
        Some(CaptionedPicture { file: level.picture.clone(), caption })
    });
    document.sheet("Split vertices", 2, first.collect());
}

/// Column headings of [`level_row`].
pub(super) const LEVEL_HEAD: [&str; 9] = [
    "way",
    "vertices",
    "triangles",
    "3-D shells kept",
    "flattened",
    "gone",
    "area kept",
    "volume kept",
    "mean error",
];

pub(super) fn level_row(name: &str, level: &Level) -> Vec<String> {
    let counts = &level.counts;
    vec![
        name.to_owned(),
        grouped(counts.vertices),
        grouped(counts.triangles),
        grouped(counts.solid_shells),
        grouped(counts.flattened_shells),
        grouped(counts.vanished_shells),
        percent(level.area_share),
        level.volume_share.map_or_else(|| "-".to_owned(), percent),
        level.error.map_or_else(|| "nothing left".to_owned(), |error| percent(error.mean())),
    ]
}

fn with_and_without(study: &SubjectStudy) -> Vec<CaptionedPicture> {
    let full = caption("Fig. 6, full detail", 0.0, &study.full);
    let mut pictures = pair(&full, &study.picture, Some(&study.wireframe));
    let figures = [
        ("busbar", "Fig. 7, with border protection"),
        ("unprotected", "Fig. 8, without border protection"),
    ];
    for (id, words) in figures {
        if let Some(level) = study.level(id, LAST) {
            let caption = caption(words, LAST, &level.counts);
            pictures.extend(pair(&caption, &level.picture, level.wireframe.as_deref()));
        }
    }
    pictures
}

fn pair(caption: &str, shaded: &str, wireframe: Option<&str>) -> Vec<CaptionedPicture> {
    let picture = |file: &str, caption| CaptionedPicture { file: file.to_owned(), caption };
    let shaded = picture(shaded, caption.to_owned());
    let wireframe = wireframe.map(|file| picture(file, format!("{caption}; wireframe")));
    [Some(shaded), wireframe].into_iter().flatten().collect()
}

pub(super) fn caption(what: &str, at: f64, counts: &TopologyCounts) -> String {
    format!(
        "{what}; theta {}, V = {}, T = {}",
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
             and alpha is 0, so border protection can change nothing: Figures 7 and 8 are one \
             picture, and {} shells keep three dimensions in both. The paper's own scene may have \
             been alike: its 2V - T is that of closed shells.",
            grouped(study.full.shells),
            grouped(with.counts.solid_shells)
        );
    }
    let shells = with.counts.solid_shells.cmp(&without.counts.solid_shells);
    let mean = |level: &Level| level.error.map_or(f64::INFINITY, |error| error.mean());
    format!(
        "{subject} has {} border edges. At {}, with border protection {} of {} shells keep three \
         dimensions, {} are flat and {} gone; without it {}, {} and {}. Border protection keeps {} \
         three-dimensional structure, at {} mean error.{}",
        grouped(study.full.border_edges),
        theta(LAST),
        grouped(with.counts.solid_shells),
        grouped(study.full.shells),
        grouped(with.counts.flattened_shells),
        grouped(with.counts.vanished_shells),
        grouped(without.counts.solid_shells),
        grouped(without.counts.flattened_shells),
        grouped(without.counts.vanished_shells),
        match shells {
            std::cmp::Ordering::Greater => "more",
            std::cmp::Ordering::Equal => "as much",
            std::cmp::Ordering::Less => "less",
        },
        if mean(with) < mean(without) { "a smaller" } else { "no smaller" },
        if shells.is_lt() {
            " With C = pi and F = 1 a border outweighs every other edge, sharp corners included: \
             these collapse first, and a shell sinks into its rim."
        } else {
            ""
        }
    )
}
