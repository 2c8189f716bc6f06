//! The lossless walk, and picks.

use crate::words::{grouped, percent, theta};
use crate::{Document, Results};

pub(super) fn write(document: &mut Document, results: &Results) {
    let walk = &results.lossless;
    document.heading("Lossless");
    document.text(format!(
        "{} random moves of the cursor over the whole scene. XXH3-128 of the index bytes at theta \
         0: {} before, {} after: {}. On the way {} live triangles were looked at, and \
         each belonged to the equipment that it was imported with.",
        grouped(walk.moves as u64),
        walk.before,
        walk.after,
        if walk.before == walk.after { "the same" } else { "not the same" },
        grouped(walk.triangles_checked)
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
        "{} random pixels of the overview, of which {} lie on equipment at theta 0. At {} the pick \
         of {} ({}) changed.",
        grouped(picks.pixels as u64),
        share(picks.on_equipment),
        theta(picks.theta),
        grouped(picks.changed() as u64),
        share(picks.changed())
    ));
    document.table(
        "How picks changed",
        &["from", "to", "pixels", "share"],
        [
            ("equipment", "other equipment", picks.to_other),
            ("equipment", "background", picks.to_background),
            ("background", "equipment", picks.from_background),
        ]
        .map(|(from, to, count)| {
            vec![from.to_owned(), to.to_owned(), grouped(count as u64), share(count)]
        })
        .to_vec(),
    );
    document.text(format!(
        "Rays are cast at the mesh that the viewer draws, through the middle of each pixel. As a \
         check {} picks were made through the viewer as well: {} gave the same equipment.",
        picks.viewer_picks, picks.viewer_agrees
    ));
}
