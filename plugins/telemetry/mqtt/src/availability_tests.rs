use super::*;

fn guard(pointer: Option<&str>) -> Guard {
    let words = |words: &[&str]| words.iter().map(|word| plain(word)).collect();
    Guard::new(&Availability {
        topic: "s/status".into(),
        covers: "s/#".into(),
        pointer: pointer.map(str::to_owned),
        online: words(&ONLINE),
        offline: words(&OFFLINE),
    })
}

#[test]
fn words_are_known_whatever_their_case() {
    let mut rng = fastrand::Rng::with_seed(39);
    let mut guard = guard(None);
    for _ in 0..5_000 {
        let (word, is_there) = match rng.bool() {
            true => (*rng.choice(&ONLINE).unwrap(), true),
            false => (*rng.choice(&OFFLINE).unwrap(), false),
        };
        let mut text: String =
            word.chars().map(|c| if rng.bool() { c.to_ascii_uppercase() } else { c }).collect();
        match rng.u8(..4) {
            0 => text = format!(" {text}\r\n"),
            1 => text = format!("\"{text}\""),
            _ => {}
        }
        let was_gone = guard.is_gone;
        let notice = guard.take(Some(text.as_bytes()));
        assert_eq!((notice.is_there, guard.is_gone), (is_there, !is_there), "{text}");
        assert_eq!(notice.line.is_some(), was_gone == is_there, "{text}: {:?}", notice.line);
        if let Some((is_warning, line)) = notice.line {
            let named = line.contains(text.trim().trim_matches('"'));
            assert!(!is_warning && named && line.contains("s/status"), "{line}");
        }
    }
}

#[test]
fn values_of_json_are_words_too() {
    let mut guard = guard(Some("/state"));
    for (payload, is_there) in [
        ("{\"state\": true}", true),
        ("{\"state\": 0}", false),
        ("{\"state\": 1.0}", true),
        ("{\"state\": \"Offline\"}", false),
        ("{\"state\": \"UP\"}", true),
        ("{\"state\": null}", false),
        ("{\"state\": {\"a\": 1}}", false),
    ] {
        assert_eq!(guard.take(Some(payload.as_bytes())).is_there, is_there, "{payload}");
    }
}

#[test]
fn a_word_that_nobody_explained_is_told_once_and_counts_as_gone() {
    let mut guard = guard(None);
    let line = |guard: &mut Guard, payload: &[u8]| {
        let notice = guard.take(Some(payload));
        assert!(!notice.is_there && guard.is_gone);
        notice.line
    };
    let (is_warning, text) = line(&mut guard, b"standby").expect("it is new");
    assert!(is_warning && text.contains("'standby'") && text.contains("connected"), "{text}");
    assert_eq!(line(&mut guard, b"standby"), None);
    assert!(line(&mut guard, b"starting").expect("another").1.contains("'starting'"));
    assert!(line(&mut guard, b"\xFF").expect("another").1.contains("not UTF-8"));
    assert!(guard.take(None).line.expect("another").1.contains("too long"));
    assert!(line(&mut guard, &[b'x'; 5000]).expect("another").1.len() < 700);
    assert!(guard.take(Some(b"ONLINE")).is_there);
}
