use std::time::Duration;

use busbar_overlay_picture::Verdicts;
use busbar_tags::{Moment, Sample, TagSet, TagSpec, TagTable};
use busbar_types::{Value, ValueKind};

use super::*;

const TAG: TagHandle = TagHandle(0);

/// A table whose only tag has this quality.
fn table(quality: Quality) -> TagTable {
    let spec = TagSpec {
        id: "p".into(),
        name: "p".into(),
        kind: ValueKind::F64,
        unit: String::new(),
        range: None,
        freshness: Duration::from_secs(60),
        scale: None,
        dead_band: 0.0,
        expression: None,
    };
    let start = Moment::now();
    let mut table = TagTable::new(Arc::new(TagSet::new(vec![spec]).unwrap()), start);
    table.apply(&Sample::live(TAG, Some(Value::F64(1.0)), quality, start), |_| {});
    table
}

fn board(pieces: &[&str]) -> VerdictBoard {
    let ids: Vec<String> = pieces.iter().map(|&id| id.to_owned()).collect();
    let mut board = VerdictBoard::default();
    board.describe(&[], &ids);
    board
}

fn picture(verdicts: &[(u32, Verdict, &str)]) -> Arc<OverlayPicture> {
    let mut list = Verdicts::default();
    for (equipment, verdict, reason) in verdicts {
        list.push(*equipment, *verdict, reason, &[TAG]);
    }
    Arc::new(OverlayPicture { verdicts: list, ..OverlayPicture::default() })
}

fn shown_verdict(board: &VerdictBoard, equipment: usize) -> (Verdict, bool) {
    let piece = board.pieces[equipment];
    (piece.verdict, piece.was_abnormal)
}

#[test]
fn equipment_without_a_verdict_is_unknown_and_never_normal() {
    let mut board = board(&["a", "b"]);
    assert_eq!(shown_verdict(&board, 0), (Verdict::Unknown, false), "before the first picture");
    let good = table(Quality::Good);
    board.update(&picture(&[(0, Verdict::Normal, "")]), good.snapshot());
    assert_eq!(shown_verdict(&board, 0), (Verdict::Normal, false));
    assert_eq!(
        shown_verdict(&board, 1),
        (Verdict::Unknown, false),
        "the plugin said nothing of it"
    );
    assert_eq!(board.unknown().collect::<Vec<_>>(), [1]);
}

#[test]
fn a_bad_value_withdraws_its_verdict_at_once() {
    let mut board = board(&["a"]);
    let normal = picture(&[(0, Verdict::Normal, "")]);
    board.update(&normal, table(Quality::Good).snapshot());
    assert_eq!(shown_verdict(&board, 0), (Verdict::Normal, false));
    for quality in [Quality::Bad(Reason::Stale), Quality::Uncertain(Reason::SourceTime)] {
        board.update(&normal, table(quality).snapshot());
        assert_eq!(shown_verdict(&board, 0), (Verdict::Unknown, false), "{quality:?}");
    }
}

#[test]
fn abnormal_equipment_stays_abnormal_until_judged_normal() {
    let (good, bad) = (table(Quality::Good), table(Quality::Bad(Reason::Communication)));
    let abnormal = picture(&[(0, Verdict::Abnormal, "too hot")]);
    let unknown = picture(&[(0, Verdict::Unknown, "no load")]);
    let mut board = board(&["a"]);
    board.update(&abnormal, good.snapshot());
    assert_eq!(shown_verdict(&board, 0), (Verdict::Abnormal, false));
    board.update(&unknown, good.snapshot());
    assert_eq!(shown_verdict(&board, 0), (Verdict::Unknown, true), "the plugin cannot judge");
    board.update(&abnormal, bad.snapshot());
    assert_eq!(shown_verdict(&board, 0), (Verdict::Unknown, true), "its value is bad");
    board.mark_unknown();
    assert_eq!(shown_verdict(&board, 0), (Verdict::Unknown, true), "the overlay is late");
    let ids = ["b".to_owned(), "a".to_owned()];
    board.describe(&["a".to_owned()], &ids);
    assert_eq!(shown_verdict(&board, 1), (Verdict::Unknown, true), "settings were edited");
    assert_eq!(shown_verdict(&board, 0), (Verdict::Unknown, false), "another piece has no past");
    board.update(&picture(&[(1, Verdict::Normal, "")]), good.snapshot());
    assert_eq!(shown_verdict(&board, 1), (Verdict::Normal, false));
    board.update(&picture(&[(1, Verdict::Unknown, "no load")]), good.snapshot());
    assert_eq!(shown_verdict(&board, 1), (Verdict::Unknown, false));
}

#[test]
fn of_two_verdicts_the_more_urgent_one_counts() {
    let good = table(Quality::Good);
    let mut board = board(&["a"]);
    let both =
        [(0, Verdict::Normal, ""), (0, Verdict::Abnormal, "hot"), (0, Verdict::Unknown, "x")];
    board.update(&picture(&both), good.snapshot());
    assert_eq!(shown_verdict(&board, 0), (Verdict::Abnormal, false));
}
