//! Invalid texts, and exactly where each is at fault.
//!
//! `«` in a text marks the place of a fault; the test takes the marks out.
//! Faults are listed in the order of the text.

use busbar_config::{Diagnostic, parse, schema};

const EXAMPLE: &str = include_str!("data/example.json");

/// Pointer, words of the cause, words of the remedy.
type Expected = (&'static str, &'static str, &'static str);

#[track_caller]
fn check(marked: &str, expected: &[Expected]) {
    let text = marked.replace('«', "");
    let faults = match parse(&text) {
        Ok(config) => config.warnings,
        Err(faults) => faults,
    };
    let shown: Vec<String> = faults.iter().map(|f| f.render("t")).collect();
    let shown = shown.join("\n");
    assert_eq!(faults.len(), expected.len(), "{marked}\n{shown}");
    let marks = marks(marked);
    assert_eq!(marks.len(), expected.len(), "a mark a fault: {marked}");
    for ((fault, (pointer, cause, remedy)), place) in faults.iter().zip(expected).zip(marks) {
        assert_eq!(fault.pointer, *pointer, "{shown}");
        assert_eq!((fault.line, fault.column), place, "{shown}");
        assert!(fault.cause.contains(cause), "{shown}");
        assert!(fault.remedy.contains(remedy), "{shown}");
    }
}

/// Lines and columns of the marks in the text without them.
fn marks(marked: &str) -> Vec<(u32, u32)> {
    let mut marks = Vec::new();
    for (line, text) in (1..).zip(marked.split('\n')) {
        let mut column = 1;
        for letter in text.chars() {
            if letter == '«' {
                marks.push((line, column));
            } else {
                column += 1;
            }
        }
    }
    marks
}

/// A case of `data/shape.txt` or `data/meaning.txt`.
#[derive(Default)]
struct Case {
    edits: Vec<(&'static str, &'static str)>,
    expected: Vec<Expected>,
}

impl Case {
    fn marked(&self) -> String {
        self.edits.iter().fold(EXAMPLE.to_owned(), |text, (from, to)| {
            assert_eq!(text.matches(from).count(), 1, "{from}");
            text.replace(from, to)
        })
    }

    fn read_all(table: &'static str) -> Vec<Self> {
        let lines = table.lines().filter(|line| !line.starts_with('#'));
        let mut cases = vec![Self::default()];
        let mut from = None;
        for line in lines {
            let rest = line.get(2..).unwrap_or_default();
            let case = cases.last_mut().expect("one to start with");
            match line.get(..1) {
                None => cases.push(Self::default()),
                Some("-") => from = Some(rest),
                Some("+") => case.edits.push((from.take().expect("a '-' before"), rest)),
                Some("=") => case.expected.push(expected(rest)),
                _ => panic!("not understood: {line}"),
            }
        }
        cases.retain(|case| !case.edits.is_empty());
        cases
    }
}

fn expected(line: &'static str) -> Expected {
    let mut parts = line.split(" | ");
    let mut part = || parts.next().expect("pointer | cause | remedy");
    (part(), part(), part())
}

/// Checks a table, and that the schema alone refuses or accepts its texts.
fn check_table(table: &'static str, schema_accepts: bool) {
    let validator = jsonschema::draft202012::new(&schema()).expect("a schema");
    let cases = Case::read_all(table);
    assert!(cases.len() > 15, "{}", cases.len());
    for case in cases {
        let marked = case.marked();
        check(&marked, &case.expected);
        let value = serde_json::from_str(&marked.replace('«', "")).expect("JSON");
        assert_eq!(validator.is_valid(&value), schema_accepts, "{marked}");
    }
}

#[test]
fn shape() {
    check_table(include_str!("data/shape.txt"), false);
}

#[test]
fn meaning() {
    check_table(include_str!("data/meaning.txt"), true);
}

#[test]
fn ids_are_measured_in_bytes() {
    let long = "é".repeat(101);
    check(
        &EXAMPLE.replace(r#""=S12D1","#, &format!("«\"{long}\",")),
        &[("/scene/0/id", "has 202 bytes; at most 200", "shorten it")],
    );
}

/// A scene of nodes in one another, with these transforms.
fn nested(transforms: &[&str]) -> String {
    let node = |(level, transform): (usize, &&str)| {
        format!(r#"{{ "id": "{level}", "transform": {transform}, "children": ["#)
    };
    let nodes: String = transforms.iter().enumerate().map(node).collect();
    format!(r#"{{ "version": 1, "scene": [{nodes}{}] }}"#, "] }".repeat(transforms.len()))
}

const CHILD: &str = "/scene/0/children/0/transform";

#[test]
fn transforms_are_checked_together_with_those_above_them() {
    let [large, small] = [r#"{ "scale": 1e6 }"#, r#"{ "scale": [1, -1e-6, 1] }"#];
    let mut eight = [large; 8];
    eight[1] = r#"«{ "scale": 1e6 }"#;
    check(&nested(&eight), &[(CHILD, "the node is scaled by 1e12 in all", "from 1e-6 to 1e6")]);
    check(&nested(&[large, r#"{ "scale": 1e-6 }"#, large]), &[]);
    check(
        &nested(&[small, r#"«{ "scale": [1, 0.01, 1] }"#]),
        &[(CHILD, "the node is scaled by 1e-8 in all", "from 1e-6 to 1e6")],
    );
    let deep = "/scene/0/children/0/children/0/transform";
    check(
        &nested(&[large, "{}", r#"«{ "translation": [1, 2, -11] }"#, large]),
        &[(deep, "the node stands at -1.1e7 m on the z axis", "within 1e7 m")],
    );
}

#[test]
fn rotations_turn_what_is_below_them() {
    let child = r#"«{ "translation": [2e6, 0, 0] }"#;
    for (degrees, outside) in [
        ("[0, 0, 0]", true),
        ("[0, 180, 0]", false),
        ("[0, 90, 0]", false),
        ("[0, 90, 90]", false),
        ("[90, 90, 0]", false),
        ("[90, 0, 0]", true),
        ("[0, 180, -180]", true),
    ] {
        let parent = format!(r#"{{ "translation": [9e6, 0, 0], "rotation_degrees": {degrees} }}"#);
        let text = nested(&[&parent, child]);
        if outside {
            check(&text, &[(CHILD, "stands at 1.1e7 m on the x axis", "within")]);
        } else {
            check(&text.replace('«', ""), &[]);
        }
    }
    let parent = r#"{ "translation": [9e6, 0, 0], "rotation_degrees": [90, 90, 0] }"#;
    let child = r#"«{ "translation": [0, 2e6, 0] }"#;
    check(&nested(&[parent, child]), &[(CHILD, "stands at 1.1e7 m on the x axis", "within")]);
    // What is at the limits stays there, whatever it is turned by.
    let limit = r#"{ "rotation_degrees": [11, 22, 33], "scale": [1e6, -1e6, 1e-6] }"#;
    check(&nested(&[limit, "{}"]), &[]);
}

#[test]
fn a_transform_at_fault_says_nothing_of_those_below() {
    let below = r#"{ "scale": 1e6 }"#;
    for (above, pointer, cause) in [
        (r#"{ "scale": «1e7 }"#, "/scene/0/transform/scale", "greater"),
        (r#"{ "scale": «0 }"#, "/scene/0/transform/scale", "vanish"),
        (r#"{ "translation": [1, 2, «1e8] }"#, "/scene/0/transform/translation/2", "greater"),
        (r#"{ "rotation_degrees": «"up" }"#, "/scene/0/transform/rotation_degrees", "a text"),
    ] {
        check(&nested(&[above, below, below]), &[(pointer, cause, "")]);
    }
}

#[test]
fn a_height_is_for_cameras_without_perspective() {
    let text = |camera: &str| {
        format!(
            r#"{{ "version": 1, "scene": [], "cameras": {{ "plan": {{
                "eye": [0, 9, 0], "target": [0, 0, 0], {camera} }} }} }}"#
        )
    };
    let fault = ("/cameras/plan/height", "only an orthographic camera has a height", "projection");
    check(&text(r#""height": «20"#), &[fault]);
    let fault = ("/cameras/plan/projection", "", "");
    check(&text(r#""projection": «"isometric""#), &[fault]);
    assert!(busbar_config::parse(&text(r#""projection": "orthographic", "height": 20"#)).is_ok());
}

#[test]
fn names_that_are_keys() {
    let camera = r#"{ "eye": [1, 0, 0], "target": [0, 0, 0] }"#;
    let text = |name: &str| {
        format!("{{ \"version\": 1, \"scene\": [], \"cameras\": {{ «\"{name}\": {camera} }} }}")
    };
    check(&text(""), &[("/cameras/", "the camera has an empty name", "give it a name")]);
    check(&text(r"a\tb"), &[("/cameras/a\tb", "has a control character", "printable")]);
    let long = "x".repeat(201);
    let pointer: &'static str = format!("/cameras/{long}").leak();
    check(&text(&long), &[(pointer, "has 201 bytes; at most 200", "shorten it")]);
}

#[test]
fn syntax() {
    let faults: &[(&str, &str, &str)] = &[
        ("«", "the configuration is empty", "write an object"),
        ("«\u{feff}{}", "byte order mark", "without"),
        ("{ «// no\n}", "comments are not allowed", "remove the comment"),
        ("{ \"a\": [1, 2«,] }", "trailing commas are not allowed", "remove the comma"),
        ("{ \"a\": 1«,\n}", "trailing commas are not allowed", "remove the comma"),
        ("{ \"ä\": 1« \"b\": 2 }", "expected comma", "put a comma"),
        ("{ \"a\" «1 }", "expected colon", "put a colon"),
        ("{\n  \"a\": «nope }", "unexpected word", "correct"),
        ("{\n «'a': 1 }", "single-quoted", "double quotes"),
        ("«{ \"a\": 1", "unterminated object", "close this object"),
        ("{ \"a\": «[1", "unterminated array", "close this array"),
        ("{} «{}", "more than one", "remove what follows"),
        ("{ \"a\": «\"b }", "unterminated string", "correct"),
        ("{ \"a\": 0«1 }", "expected comma", "comma"),
        ("[[«1e999]]", "number out of range", "smaller"),
    ];
    for (marked, cause, remedy) in faults {
        let faults = parse(&marked.replace('«', "")).unwrap_err();
        let [Diagnostic { line, column, pointer, cause: found, remedy: mending, .. }] = &faults[..]
        else {
            panic!("{marked}: {faults:#?}")
        };
        assert!(found.contains(cause) && mending.contains(remedy), "{marked}: {faults:#?}");
        assert_eq!((*line, *column), marks(marked)[0], "{marked}: {faults:#?}");
        assert_eq!(pointer, "");
    }
}

#[test]
fn what_only_the_strict_parser_refuses() {
    for text in ["[\"a\tb\"]", "[[] []]", "[1\u{a0}]", "[\u{b}1]", r#"["\ud800"]"#] {
        let faults = parse(text).unwrap_err();
        assert_eq!(faults.len(), 1, "{text:?}: {faults:#?}");
        assert!(faults[0].cause.starts_with("not valid JSON"), "{text:?}: {faults:#?}");
        assert_eq!(faults[0].line, 1);
    }
}

#[test]
fn keys_given_twice_do_not_hide_other_faults() {
    check(
        r#"{ "version": 1, "scene": [],
 "graphics": { "samples": 4,
 «"samples": «9 },
 «"version": 1 }"#,
        &[
            ("/graphics/samples", "given twice, first at line 2, column 16", "remove one"),
            ("/graphics/samples", "9 is not allowed", "write one of 1, 4"),
            ("/version", "given twice, first at line 1, column 3", "remove one"),
        ],
    );
}

#[test]
fn ten_different_faults_are_ten_diagnostics() {
    check(
        r##"{
  "version": «"1",
  "plugin_directories": ["plugins"],
  "plugins": { "plc": { "plugin": «5 } },
  "models": { "m": «{ "optimizer": "plc", "theta": «2 } },
  "scene": [
    { "id": "A", "model": «"n", «"transfrom": {} },
    { "id": «"A" }
  ],
  "tags": {
    "t": { "type": "i64", "limits": { "low": «9, "high": 1 },
           "source": { "instance": «"plcc", "address": 1 } },
    "u": { "type": "i64", "source": { "instance": "plc", "address": 1 } }
  },
  "bindings": [{ "tag": «"v", "node": "A/x" }]
}"##,
        &[
            ("/version", "must be a whole number, not a text", "1"),
            ("/plugins/plc/plugin", "must be a text, not a number", "example.optimizer"),
            ("/models/m", "'file' is missing", "models/transformer.glb"),
            ("/models/m/theta", "2 is greater than 1", "from 0"),
            ("/scene/0/model", "no model 'n'", "'m'"),
            ("/scene/0/transfrom", "not known", "did you mean 'transform'?"),
            ("/scene/1/id", "used twice", "another id"),
            ("/tags/t/limits/low", "not less", "less"),
            ("/tags/t/source/instance", "no plugin 'plcc'", "did you mean 'plc'?"),
            ("/bindings/0/tag", "no tag 'v'", "'"),
        ],
    );
}

#[test]
fn a_root_that_is_no_object_is_refused() {
    check("«[]", &[("", "the configuration must be an object, not an array", "write an object")]);
}

#[test]
fn equipment_must_exist_and_an_alias_means_one_piece() {
    let text = r#"{
  "version": 1,
  "scene": [{ "id": "=Q1" }, { "id": "=Q2" }],
  "equipment": {
    "=Q1": { "name": "Line 1", "aliases": ["2211", "=Q2"] },
    "=Q2": { "aliases": ["2211", "S1/Q2"] },
    "=Q3": { "name": "Nowhere" }
  }
}"#;
    let faults = busbar_config::parse(text).unwrap_err();
    let causes: Vec<(usize, &str)> =
        faults.iter().map(|fault| (fault.line as usize, fault.cause.as_str())).collect();
    let expected = [
        (5, "the alias '=Q2' is one of '=Q2' already"),
        (6, "the alias '2211' is one of '=Q1' already"),
        (7, "no scene node has the id '=Q3'"),
    ];
    assert_eq!(causes, expected);
}
