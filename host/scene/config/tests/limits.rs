//! Limits, load, and texts that nobody wrote.

use std::time::{Duration, Instant};

use busbar_config::{MAX_DIAGNOSTICS, MAX_NESTING_DEPTH, MAX_PLUGINS, parse};
use proptest::prelude::*;
use proptest::test_runner::{Config as RunnerConfig, RngAlgorithm, TestRng, TestRunner};

const EXAMPLE: &str = include_str!("data/example.json");

/// A text with that many tags, each as `tag` writes it.
fn with_tags(count: usize, tag: impl Fn(usize) -> String) -> String {
    let mut text = String::from(
        "{ \"version\": 1, \"plugin_directories\": [\"p\"], \"scene\": [{ \"id\": \"A\" }],
        \"plugins\": { \"plc\": { \"plugin\": \"x\" } }, \"tags\": {",
    );
    for index in 0..count {
        let comma = if index == 0 { "" } else { "," };
        text.push_str(&format!("{comma}\n\"Station.Bay{index}.Value\": {}", tag(index)));
    }
    text.push_str("\n}}");
    text
}

fn valid_tag(index: usize) -> String {
    format!(
        r#"{{ "name": "Value {index}", "type": "f64", "unit": "kV",
        "range": {{ "low": -40, "high": 150 }}, "limits": {{ "low": null, "high": 95 }},
        "freshness_seconds": 3,
        "source": {{ "instance": "plc", "address": {{ "table": "a", "index": {index} }} }} }}"#
    )
}

#[test]
fn fifty_thousand_tags_are_read_in_well_under_a_second() {
    let text = with_tags(50_000, valid_tag);
    let start = Instant::now();
    let config = parse(&text).unwrap();
    let elapsed = start.elapsed();
    println!("50000 tags, {} bytes: {elapsed:?}", text.len());
    assert_eq!(config.tags.len(), 50_000);
    assert!(elapsed < Duration::from_secs(5), "a loaded machine may be slow, but: {elapsed:?}");
}

/// Reading must not take quadratic time, even on one line, even if all is
/// wrong: ten times the text, well under a hundred times the time.
#[test]
fn time_grows_with_the_text_even_if_every_tag_is_wrong() {
    let wrong = |_: usize| r#"{ "type": "f65", "source": { "instance": "plcc" } }"#.to_owned();
    let time = |count| {
        let text = with_tags(count, wrong).replace('\n', " ");
        let runs = (0..3).map(|_| {
            let start = Instant::now();
            let faults = parse(&text).unwrap_err();
            assert_eq!(faults.len(), MAX_DIAGNOSTICS + 1);
            start.elapsed()
        });
        runs.min().unwrap_or_default()
    };
    let (small, large) = (time(3_000), time(30_000));
    println!("3000 wrong tags: {small:?}, 30000: {large:?}");
    assert!(large < small * 50 + Duration::from_millis(100), "{small:?} -> {large:?}");
}

/// Four times the text, all faults on one line: not much more than four times
/// the time, however many faults nobody is shown.
#[track_caller]
fn assert_faults_grow_linearly(count: usize, write: impl Fn(usize) -> String) {
    let time = |count| {
        let text = write(count);
        let runs = (0..3).map(|_| {
            let start = Instant::now();
            let faults = parse(&text).expect_err("faults");
            let elapsed = start.elapsed();
            assert_eq!(faults.len(), MAX_DIAGNOSTICS + 1);
            let more = format!("and {} more faults", count - 1 - MAX_DIAGNOSTICS);
            assert_eq!(faults[MAX_DIAGNOSTICS].cause, more);
            elapsed
        });
        runs.min().unwrap_or_default()
    };
    let (small, large) = (time(count), time(4 * count));
    assert!(large < small * 8 + Duration::from_millis(100), "{small:?} -> {large:?}");
}

#[test]
fn a_key_given_thousands_of_times_takes_no_quadratic_time() {
    assert_faults_grow_linearly(20_000, |count| {
        let members = vec!["\"k\":0"; count].join(",");
        with_tags(1, |_| {
            format!(
                r#"{{ "type": "f64", "source": {{ "instance": "plc", "address": {{ {members} }} }} }}"#
            )
        })
        .replace('\n', " ")
    });
}

#[test]
fn an_id_used_thousands_of_times_takes_no_quadratic_time() {
    // The first of them is the last to be found.
    assert_faults_grow_linearly(10_000, |count| {
        let others = (0..count).map(|i| format!("{{\"id\":\"{i}\"}}"));
        let nodes: Vec<String> = others.chain(vec![r#"{"id":"A"}"#.to_owned(); count]).collect();
        format!(r#"{{ "version": 1, "scene": [{}] }}"#, nodes.join(","))
    });
}

/// Each wrong name is near to many tags.
#[test]
fn suggestions_are_only_sought_for_faults_that_are_shown() {
    let count = 20_000;
    let bindings: Vec<String> = (0..count)
        .map(|i| format!(r#"{{ "tag": "Station.Bay{i}.Valeu", "node": "A" }}"#))
        .collect();
    let bindings = format!("}}, \"bindings\": [{}] }}", bindings.join(","));
    let text = with_tags(count, valid_tag).replace("\n}}", &bindings);
    let start = Instant::now();
    let faults = parse(&text).unwrap_err();
    let elapsed = start.elapsed();
    println!("{count} wrong names: {elapsed:?}");
    assert_eq!(faults.len(), MAX_DIAGNOSTICS + 1);
    assert_eq!(faults[0].remedy, "did you mean 'Station.Bay0.Value'?");
    assert!(elapsed < Duration::from_secs(10), "{elapsed:?}");
}

#[test]
fn faults_beyond_the_limit_are_counted() {
    let count = MAX_DIAGNOSTICS + 5;
    let text = with_tags(count, |_| {
        r#"{ "type": "f65", "source": { "instance": "plc", "address": 0 } }"#.into()
    });
    let faults = parse(&text).unwrap_err();
    assert_eq!(faults.len(), MAX_DIAGNOSTICS + 1);
    assert_eq!(faults[MAX_DIAGNOSTICS].cause, "and 5 more faults");
    let lines: Vec<u32> = faults[..MAX_DIAGNOSTICS].iter().map(|f| f.line).collect();
    assert!(lines.is_sorted());
}

#[test]
fn deep_nesting_is_refused_where_it_gets_too_deep() {
    let nested = |depth: usize| format!("{}{}", "[".repeat(depth), "]".repeat(depth));
    let address = |depth: usize| {
        let tag = format!(
            r#"{{ "type": "f64", "source": {{ "instance": "plc", "address": {} }} }}"#,
            nested(depth)
        );
        with_tags(1, |_| tag.clone())
    };
    // The address is the fifth level.
    assert!(parse(&address(MAX_NESTING_DEPTH - 4)).is_ok());
    let faults = parse(&address(MAX_NESTING_DEPTH - 3)).unwrap_err();
    assert_eq!(faults.len(), 1);
    assert!(faults[0].cause.contains("nested more than 100 deep"), "{faults:#?}");
    assert!(faults[0].pointer.starts_with("/tags/Station.Bay0.Value/source/address/0/0"));
    for depth in [300, 100_000] {
        let faults = parse(&nested(depth)).unwrap_err();
        assert!(faults[0].remedy.contains("nest less deeply"), "{faults:#?}");
    }
}

#[test]
fn too_many_plugins_are_refused() {
    let plugins: Vec<String> =
        (0..=MAX_PLUGINS).map(|i| format!(r#""p{i}": {{ "plugin": "x" }}"#)).collect();
    let overlays: Vec<String> = (0..MAX_PLUGINS).map(|i| format!("\"p{i}\"")).collect();
    let text = format!(
        r#"{{ "version": 1, "scene": [], "plugin_directories": ["p"],
        "overlays": [{}], "plugins": {{ {} }} }}"#,
        overlays.join(","),
        plugins.join(",")
    );
    let faults = parse(&text).unwrap_err();
    assert!(
        faults.iter().any(|f| f.cause == "65 entries are too many" && f.pointer == "/plugins"),
        "{faults:#?}"
    );
}

#[test]
fn too_many_nodes_are_refused() {
    let instances: Vec<String> = (0..1_000_000).map(|i| format!("{{\"id\":\"{i}\"}}")).collect();
    let text = format!(
        r#"{{ "version": 1, "scene": [{{ "id": "A", "instances": [{}] }}] }}"#,
        instances.join(",")
    );
    let faults = parse(&text).unwrap_err();
    assert_eq!(faults.len(), 1);
    assert_eq!(faults[0].cause, "the scene has 1000001 nodes; at most 1000000");
}

/// One change to a text, at a place given in thousandths of its length.
#[derive(Clone, Debug)]
enum Mutation {
    Remove { at: usize, length: usize },
    Insert { at: usize, text: &'static str },
    Copy { at: usize, length: usize, to: usize },
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let texts = prop::sample::select(vec![
        "{",
        "}",
        "[",
        "]",
        ",",
        ":",
        "\"",
        "\\",
        "null",
        "-1",
        "1e999",
        "0.5",
        "\"x\"",
        "é",
        "\0",
        "\\ud800",
        "/*",
        "//",
        "true",
        "{}",
        "[]",
        "\n",
        "99999999999999999999",
        "/",
        "~",
        "\u{feff}",
    ]);
    let at = 0..=1000usize;
    prop_oneof![
        (at.clone(), 1..40usize).prop_map(|(at, length)| Mutation::Remove { at, length }),
        (at.clone(), texts).prop_map(|(at, text)| Mutation::Insert { at, text }),
        (at.clone(), 1..200usize, at).prop_map(|(at, length, to)| Mutation::Copy {
            at,
            length,
            to
        }),
    ]
}

fn mutate(mutations: &[Mutation]) -> String {
    let mut letters: Vec<char> = EXAMPLE.chars().collect();
    for mutation in mutations {
        let place = |at: usize| at * letters.len() / 1000;
        match *mutation {
            Mutation::Remove { at, length } => {
                let start = place(at);
                let end = (start + length).min(letters.len());
                letters.drain(start..end);
            }
            Mutation::Insert { at, text } => {
                let at = place(at);
                letters.splice(at..at, text.chars());
            }
            Mutation::Copy { at, length, to } => {
                let (start, to) = (place(at), place(to));
                let end = (start + length).min(letters.len());
                let copied = letters[start..end].to_vec();
                letters.splice(to..to, copied);
            }
        }
    }
    letters.into_iter().collect()
}

/// Whatever the text: no panic; faults with a place inside it; and what is
/// accepted is also accepted by the schema.
#[test]
fn mutated_texts_never_panic_and_faults_have_a_place() {
    let config = RunnerConfig { cases: 3_000, failure_persistence: None, ..Default::default() };
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let validator = jsonschema::draft202012::new(&busbar_config::schema()).unwrap();
    let property = |mutations: Vec<Mutation>| {
        let text = mutate(&mutations);
        match parse(&text) {
            Ok(_) => {
                let value = serde_json::from_str(&text).unwrap();
                prop_assert!(validator.is_valid(&value));
            }
            Err(faults) => {
                prop_assert!(!faults.is_empty());
                for fault in faults {
                    let line = text.split('\n').nth(fault.line as usize - 1);
                    let width = line.map(|line| line.chars().count());
                    prop_assert!(
                        width.is_some_and(|w| fault.column as usize <= w + 1),
                        "{}",
                        fault
                    );
                    prop_assert!(!fault.cause.is_empty() && !fault.remedy.is_empty());
                }
            }
        }
        Ok(())
    };
    runner.run(&prop::collection::vec(mutation(), 1..6), property).unwrap();
}
