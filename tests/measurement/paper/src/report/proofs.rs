//! Section on the lossless walk and on picks.

use crate::run::PICK_THETA;
use report_writer::Document;
use report_writer::number_format::{grouped, percent, theta};

use crate::Results;

pub(super) fn write(document: &mut Document, results: &Results) {
    let walk = &results.lossless;
    document.heading("Lossless");
    document.text(format!(
        "{} random moves of the cursor over the whole scene. XXH3-128 of the index bytes at theta \
         0: {} before, {} after: {}. On the way {} live triangles were looked at, and \
         each belonged to the piece of equipment, one of {}, that it was imported with.",
        grouped(walk.moves as u64),
        walk.before,
        walk.after,
        if walk.before == walk.after { "the same" } else { "not the same" },
        grouped(walk.triangles_checked),
        grouped(walk.equipment as u64)
    ));
    let row = |place: &crate::lossless::FixedPlace| {
        vec![
            theta(place.theta),
            grouped(u64::from(place.cursor)),
            place.hash.clone(),
            place.visits.to_string(),
            place.differing.to_string(),
        ]
    };
    document.table(
        "Places visited again and again",
        &["theta", "collapses done", "bytes before the walk", "visits", "with other bytes"],
        walk.visits.iter().map(row).collect(),
    );
    picks(document, results);
}

fn picks(document: &mut Document, results: &Results) {
    let picks = &results.picks;
    let share = |count: usize| percent(count as f64 / picks.pixels.max(1) as f64);
    document.heading("Equipment under the pointer");
    document.text(format!(
        "{} random pixels of the overview, picked through the viewer. At theta 0 {} of them lie on \
         {} pieces of equipment. At {} the pick of {} ({}) is another one.",
        grouped(picks.pixels as u64),
        share(picks.on_equipment),
        grouped(picks.pieces as u64),
        theta(PICK_THETA),
        grouped(picks.changed() as u64),
        share(picks.changed())
    ));
    let row = |(change, count): (&str, usize)| {
        vec![change.to_owned(), grouped(count as u64), share(count)]
    };
    document.table(
        "How picks changed",
        &["change", "pixels", "share"],
        [
            ("equipment to other equipment", picks.to_other),
            ("equipment to background", picks.to_background),
            ("background to equipment", picks.from_background),
        ]
        .map(row)
        .to_vec(),
    );
}
