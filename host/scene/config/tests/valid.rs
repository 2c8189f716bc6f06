//! A valid configuration and what becomes of it.

use std::time::Duration;

use busbar_config::{
    AlarmOriginConfig, Band, Changes, ConditionConfig, Config, EndConfig, FORMER_NAMES,
    FreshnessBasis, Isolation, LogConfig, LogFormatConfig, MetricsConfig, ModelSceneConfig,
    QualityConfig, RenamedSettings, Section, Severity, TagConditionConfig, ThemeConfig,
    ThetaConfig, ThetaLevelConfig, VerdictSeverityConfig, parse, schema, upgrade,
};
use busbar_types::{DoublePoint, Limit, Priority, Text, Value, ValueKind};
use serde_json::json;

const EXAMPLE: &str = include_str!("data/example.json");
const FORMER: &str = include_str!("data/former_names.json");
const SCHEMA_FILE: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/../../../config/busbar.schema.json");

fn example() -> Config {
    parse(EXAMPLE).unwrap_or_else(|faults| panic!("{faults:#?}"))
}

#[test]
fn the_example_becomes_typed_values() {
    let config = example();
    assert_eq!(config.warnings, []);
    assert_eq!(config.plugin_directories[0].path, "plugins");
    assert_eq!(config.plugins["optimizer"].plugin, "example.optimizer");
    assert_eq!(config.plugins["optimizer"].settings, json!({ "border_protection": true }));
    assert_eq!(config.plugins["labels"].settings, json!({}));
    let transformer = &config.models["transformer"];
    assert_eq!(transformer.file, "models/transformer.glb");
    assert_eq!(transformer.optimizer.as_deref(), Some("optimizer"));
    assert_eq!(transformer.theta, ThetaConfig::Fixed(0.25));
    let breaker = &config.models["breaker"];
    assert_eq!((&breaker.optimizer, &breaker.theta), (&None, &ThetaConfig::Fixed(0.0)));
    assert_eq!(config.overlays[0].plugin, "labels");
    let camera = &config.cameras["overview"];
    assert_eq!((camera.eye, camera.target), ([12.0, 6.0, 14.0], [0.0, 3.0, 0.0]));
    assert_eq!(camera.fov_degrees, 60.0);
    assert_eq!(config.view.camera.as_deref(), Some("overview"));
    assert_eq!(config.view.background, [0xd8, 0xda, 0xdd]);
    assert_eq!((config.view.samples, config.view.size), (Some(1), [640, 480]));
    assert_eq!(config.view.theta_scale, 0.5);
}

#[test]
fn log_and_metrics_are_where_they_are_asked_for() {
    assert_eq!((example().log, example().metrics), (None, None));
    let asked = r#""version": 1, "log": { "file": "a/b.log", "format": "json", "files": 3 },
        "metrics": { "address": "[::1]:9187" },"#;
    let config = parse(&EXAMPLE.replace("\"version\": 1,", asked)).unwrap();
    let (file, format) = ("a/b.log".to_owned(), LogFormatConfig::Json);
    assert_eq!(config.log, Some(LogConfig { file, format, megabytes: 16, files: 3 }));
    let address = "[::1]:9187".parse().unwrap();
    assert_eq!(config.metrics, Some(MetricsConfig { address, public: false }));
}

#[test]
fn scenes_of_models_have_a_name_or_an_index() {
    assert_eq!(example().models["breaker"].scene, None);
    let with = |scene: &str| {
        let model = format!(r#"{{ "file": "models/breaker.gltf", "scene": {scene} }}"#);
        parse(&EXAMPLE.replace(r#"{ "file": "models/breaker.gltf" }"#, &model))
    };
    let chosen = |scene: &str| with(scene).unwrap().models["breaker"].scene.clone();
    assert_eq!(chosen("\"Yard\""), Some(ModelSceneConfig::Name("Yard".to_owned())));
    assert_eq!(chosen("2"), Some(ModelSceneConfig::Index(2)));
    for refused in ["\"\"", "-1", "0.5", "4294967296", "[\"Yard\"]", "true"] {
        let faults = with(refused).unwrap_err();
        assert_eq!(faults.len(), 1, "{refused}: {faults:#?}");
        assert_eq!(faults[0].pointer, "/models/breaker/scene", "{refused}");
    }
    // Another scene is another model.
    let changes = Changes::between(&with("1").unwrap(), &with("2").unwrap());
    assert!(changes.affect(Section::Models));
}

#[test]
fn parts_of_models_move_as_written() {
    let moving = r#"{ "file": "models/breaker.gltf", "moving_parts": [{
        "part": "blade 1", "mechanism": "blade", "modelled": "open",
        "pivot": [0, 2, 1.5], "axis": [1, 0, 0], "degrees": -90 }] }"#;
    let text = EXAMPLE.replace(r#"{ "file": "models/breaker.gltf" }"#, moving);
    let config = parse(&text).unwrap_or_else(|faults| panic!("{faults:#?}"));
    let part = &config.models["breaker"].moving_parts[0];
    assert_eq!((part.part.as_str(), part.mechanism.as_str()), ("blade 1", "blade"));
    assert_eq!((part.modelled, part.pivot), (EndConfig::Open, [0.0, 2.0, 1.5]));
    assert_eq!((part.axis, part.degrees), ([1.0, 0.0, 0.0], -90.0));
    assert_eq!((part.travel, part.scale), ([0.0; 3], [1.0; 3]));
    assert_eq!(part.pointer, "/models/breaker/moving_parts/0");
}

#[test]
fn alarms_are_of_tags_or_of_the_host() {
    let config = example();
    let hot = &config.alarms["T1.Hot"];
    assert_eq!((hot.priority, hot.latched), (Priority::High, false));
    assert_eq!(hot.equipment.as_deref(), Some("=S12D1T1-TA1/tank"));
    assert_eq!((hot.message.as_str(), hot.group.as_deref()), ("Top oil hot", Some("T1")));
    let limit = |limit, at, deadband| ConditionConfig::Limit { limit, at, deadband };
    let condition_of = |tag: &str, condition| TagConditionConfig { tag: tag.into(), condition };
    let expected = AlarmOriginConfig::Tag {
        trigger: condition_of("T1.TopOil", limit(Limit::High, 95.0, 2.0)),
        on_delay_seconds: 4.5,
        off_delay_seconds: 0.0,
        suppressed_by: Some(condition_of("Q1.Position", ConditionConfig::BadQuality)),
    };
    assert_eq!(hot.origin, expected);
    let text = EXAMPLE.replace("\"high\": 95, \"deadband\": 2", "\"bad_quality\": true");
    let text = text.replace(
        "\"Q1.Position\", \"condition\": { \"bad_quality\": true }",
        "\"Q1.Position\", \"condition\": { \"differs\": \"on\" }",
    );
    let AlarmOriginConfig::Tag { suppressed_by: Some(by), .. } =
        parse(&text).unwrap().alarms["T1.Hot"].origin.clone()
    else {
        panic!("it is of a tag and can be suppressed")
    };
    let closed = Value::DoublePoint(DoublePoint::On);
    assert_eq!(by.condition, ConditionConfig::Differs(closed));
    // For a tag that is a text the same word is a text.
    let text = text.replace("\"type\": \"double_point\"", "\"type\": \"text\"");
    let AlarmOriginConfig::Tag { suppressed_by: Some(by), .. } =
        parse(&text).unwrap().alarms["T1.Hot"].origin.clone()
    else {
        panic!("it is of a tag and can be suppressed")
    };
    let on = Value::Text(Text::new("on").unwrap());
    assert_eq!(by.condition, ConditionConfig::Differs(on));
    let delay = |name: &str| match &config.alarms[name].origin {
        AlarmOriginConfig::Tag { on_delay_seconds, .. } => Some(*on_delay_seconds),
        AlarmOriginConfig::Verdict { .. } | AlarmOriginConfig::Mirrored => None,
    };
    assert_eq!(["T1.Hotter", "T1.Silent", "Host.7"].map(delay), [Some(0.0), Some(5.0), None]);
    let handling = &config.alarm_handling;
    assert_eq!(handling.log_directory.as_deref(), Some("log"));
    assert_eq!((handling.max_shelving, handling.log_files), (Duration::from_secs(3_600), 20));
}

#[test]
fn alarms_follow_verdicts_of_overlays() {
    let alarms = r#""Judged": { "verdict": { "instance": "labels", "severity": "alarm",
            "equipment": "=S12D1T1-TA1" }, "off_delay_seconds": 3, "message": "Abnormal",
            "suppressed_by": { "tag": "Q1.Position", "condition": { "equals": "off" } } },
        "Any": { "verdict": { "instance": "labels" }, "message": "Abnormal" },
        "Host.7":"#;
    let text = EXAMPLE.replace("\"Host.7\":", alarms);
    let config = parse(&text).unwrap_or_else(|faults| panic!("{faults:#?}"));
    let judged = &config.alarms["Judged"];
    assert_eq!(judged.equipment.as_deref(), Some("=S12D1T1-TA1"));
    let off = ConditionConfig::Equals(Value::DoublePoint(DoublePoint::Off));
    let expected = AlarmOriginConfig::Verdict {
        overlay: "labels".into(),
        severity: VerdictSeverityConfig::Alarm,
        on_delay_seconds: 0.0,
        off_delay_seconds: 3.0,
        suppressed_by: Some(TagConditionConfig { tag: "Q1.Position".into(), condition: off }),
    };
    assert_eq!(judged.origin, expected);
    let any = &config.alarms["Any"];
    assert_eq!(any.equipment, None, "each piece that it judges");
    let AlarmOriginConfig::Verdict { severity, .. } = any.origin else { panic!("{any:?}") };
    assert_eq!(severity, VerdictSeverityConfig::Warning);
}

#[test]
fn theta_follows_distance_where_it_is_an_object() {
    let policy = r#"{ "distance": [{ "beyond": 0, "theta": 0 }, { "beyond": 40.5, "theta": 1 }] }"#;
    let text = EXAMPLE.replace("\"theta\": 0.25", &format!("\"theta\": {policy}"));
    let level = |beyond, theta| ThetaLevelConfig { beyond, theta };
    let levels = vec![level(0.0, 0.0), level(40.5, 1.0)];
    let expected = ThetaConfig::Distance { levels, hysteresis: 0.05 };
    assert_eq!(parse(&text).unwrap().models["transformer"].theta, expected);
}

#[test]
fn theta_follows_the_error_on_the_screen_where_pixels_are_given() {
    let text = EXAMPLE.replace("\"theta\": 0.25", r#""theta": { "max_error_px": 0.5 }"#);
    let expected = ThetaConfig::ScreenError { max_pixels: 0.5, hysteresis: 0.05 };
    assert_eq!(parse(&text).unwrap().models["transformer"].theta, expected);
}

#[test]
fn a_copy_has_the_theta_of_its_node_unless_it_has_its_own() {
    let thetas = |text: &str| {
        let scene: Vec<_> = parse(text).unwrap().scene.iter().collect();
        [1, 2, 3].map(|node: usize| scene[node].theta.clone())
    };
    let fixed = |theta| Some(ThetaConfig::Fixed(theta));
    assert_eq!(thetas(EXAMPLE), [None, fixed(0.75), None]);
    let node = |theta| {
        let to = format!("\"model\": \"transformer\", \"theta\": {theta}");
        EXAMPLE.replace("\"model\": \"transformer\"", &to)
    };
    assert_eq!(thetas(&node("0")), [fixed(0.0), fixed(0.75), None]);
    let inherited = node("0.5").replace("\"theta\": 0.75, ", "");
    assert_eq!(thetas(&inherited), [fixed(0.5), fixed(0.5), None]);
}

#[test]
fn the_scene_comes_out_flat_with_parents_first_and_instances_expanded() {
    let scene: Vec<_> = example().scene.iter().collect();
    let nodes: Vec<_> = scene
        .iter()
        .map(|n| (n.id.as_str(), n.parent, n.model.as_deref(), n.pointer.as_str()))
        .collect();
    let expected = [
        ("=S12D1", None, None, "/scene/0"),
        ("=S12D1T1-TA1", Some(0), Some("transformer"), "/scene/0/children/0"),
        ("=S12D1T1-TA2", Some(0), Some("transformer"), "/scene/0/children/0/instances/0"),
        ("=S12D1Q1-QA1", None, Some("breaker"), "/scene/1"),
    ];
    assert_eq!(nodes, expected);
    assert_eq!(scene[0].transform.translation, [10.0, 0.0, -5.0]);
    assert_eq!(scene[0].transform.rotation_degrees, [0.0, 90.0, 0.0]);
    assert_eq!(scene[0].transform.scale, [2.0; 3]);
    assert_eq!(scene[1].transform, Default::default());
    assert_eq!(scene[2].transform.scale, [1.0, 2.0, -1.0]);
}

#[test]
fn tags_and_bindings_keep_what_is_theirs() {
    let config = example();
    let oil = &config.tags["T1.TopOil"];
    assert_eq!((oil.name.as_str(), oil.unit.as_str()), ("Top oil", "°C"));
    assert_eq!((oil.value_type, oil.freshness_millis), (ValueKind::F64, 5000));
    assert_eq!(oil.range, Band { low: Some(-40.0), high: Some(150.0) });
    assert_eq!(oil.limits, Band { low: None, high: Some(95.0) });
    assert!(oil.limits.contains(95.0) && !oil.limits.contains(95.1));
    let source = oil.source().expect("a plugin reads it");
    assert_eq!(source.plugin, "plc");
    assert_eq!(source.address, json!({ "register": 7 }));
    assert_eq!(source.pointer, "/tags/T1.TopOil/source");
    let position = &config.tags["Q1.Position"];
    assert_eq!(
        (position.name.as_str(), position.value_type),
        ("Q1.Position", ValueKind::DoublePoint)
    );
    assert_eq!(position.freshness_millis, 3000);
    assert_eq!((position.scale, position.dead_band, position.expression()), (None, 0.0, None));
    let binding = &config.bindings[0];
    assert_eq!((binding.tag.as_str(), binding.role.as_str()), ("T1.TopOil", "value"));
    assert_eq!(binding.node, "=S12D1T1-TA1/bushing 1U");
}

#[test]
fn a_tag_may_be_the_host_programs() {
    let source = r#""source": { "instance": "plc", "address": [1, 2] }"#;
    let text = EXAMPLE.replace(source, r#""set_by_host": true"#);
    let config = parse(&text).expect("it is valid");
    let tag = &config.tags["Q1.Position"];
    assert!(tag.is_host_written() && tag.source().is_none() && tag.expression().is_none());
}

#[test]
fn later_faults_find_their_place() {
    let config = example();
    let pointer = format!("{}/file", config.models["breaker"].pointer);
    let fault = config.positions.diagnostic(pointer, "the file is missing", "make it");
    assert_eq!((fault.line, fault.column), (12, 26));
    assert_eq!(
        fault.render("a.json"),
        "a.json:12:26: error: the file is missing (at /models/breaker/file)\n  remedy: make it"
    );
    let defaulted = config.positions.diagnostic("/plugins/labels/settings/x", "c", "r");
    assert_eq!((defaulted.line, defaulted.column), (8, 15), "at the nearest value around it");
    assert_eq!(defaulted.pointer, "/plugins/labels/settings/x");
    let second = config.positions.diagnostic("/tags/Q1.Position/source/address/1", "c", "r");
    assert_eq!((second.line, second.column), (38, 92));
}

#[test]
fn places_are_found_under_keys_with_escapes_and_slashes() {
    let text = r#"{ "version": 1, "scene": [], "cameras": {
"a/b~\u0063\"": { "eye": [1, 0, 0], "target": [0, 0, 0] } } }"#;
    let config = parse(text).unwrap();
    let pointer = format!("{}/target", config.cameras["a/b~c\""].pointer);
    assert_eq!(pointer, "/cameras/a~1b~0c\"/target");
    assert_eq!(config.positions.locate(&pointer), (2, 47));
}

#[test]
fn the_least_configuration_has_defaults() {
    let config = parse(r#"{ "version": 1, "scene": [] }"#).unwrap();
    assert_eq!((config.view.camera, config.view.background), (None, [0xd8, 0xda, 0xdd]));
    assert_eq!((config.view.quality, config.view.samples), (None, None));
    assert_eq!(config.view.size, [1280, 720]);
    assert_eq!(config.view.theta_scale, 1.0);
    assert!(
        config.scene.iter().next().is_none() && config.plugins.is_empty() && config.tags.is_empty()
    );
}

#[test]
fn quality_and_samples_are_as_somebody_says() {
    let view = |view: &str| {
        parse(&format!(r#"{{ "version": 1, "scene": [], "graphics": {view} }}"#)).unwrap().view
    };
    let low = view(r#"{ "quality": "low" }"#);
    assert_eq!((low.quality, low.samples), (Some(QualityConfig::Low), None));
    assert_eq!(view(r#"{ "quality": "low", "samples": 4 }"#).samples, Some(4));
    let medium = view(r#"{ "quality": "medium", "ground": true }"#);
    assert_eq!(medium.quality, Some(QualityConfig::Medium));
    assert!(medium.ground && !medium.fog);
    let high = view(r#"{ "quality": "high" }"#);
    assert_eq!((high.quality, high.section), (Some(QualityConfig::High), None));
}

#[test]
fn a_section_plane_has_a_normal_of_length_one() {
    let text = r#"{ "version": 1, "scene": [],
        "camera": { "section": { "normal": [1, 0, -1], "distance": 2.5 } } }"#;
    let section = parse(text).unwrap().view.section.unwrap();
    let half = 0.5_f32.sqrt();
    assert!(section.normal.iter().zip([half, 0.0, -half]).all(|(a, b)| (a - b).abs() < 1e-6));
    assert_eq!(section.distance, 2.5);
}

#[test]
fn plugins_run_apart_unless_somebody_says_otherwise() {
    let isolations = |text: &str| {
        let plugins = parse(text).unwrap().plugins;
        ["labels", "optimizer"].map(|name| plugins[name].isolation)
    };
    let (apart, together) = (Isolation::Process, Isolation::None);
    assert_eq!(isolations(EXAMPLE), [apart, apart]);
    let all = EXAMPLE.replace("\"version\": 1", "\"version\": 1, \"isolation\": \"none\"");
    assert_eq!(isolations(&all), [together, together]);
    let plugin = "\"plugin\": \"example.overlay\"";
    let one = |isolation| format!("{plugin}, \"isolation\": \"{isolation}\"");
    assert_eq!(isolations(&EXAMPLE.replace(plugin, &one("none"))), [together, apart]);
    assert_eq!(isolations(&all.replace(plugin, &one("process"))), [apart, together]);

    let config = example();
    assert_eq!(config.signature, None);
    let supervision = config.supervision;
    assert_eq!((supervision.max_deaths, supervision.window_seconds), (3, 600));
    let plugin = &config.plugins["plc"];
    assert_eq!((plugin.network, &plugin.sha256, plugin.memory_megabytes), (None, &None, 4000));
}

#[test]
fn a_plugin_used_nowhere_is_a_warning() {
    let text = EXAMPLE.replace(r#""overlays": ["labels"]"#, r#""overlays": []"#);
    let warnings = parse(&text).unwrap().warnings;
    assert_eq!(warnings.len(), 1);
    let warning = &warnings[0];
    assert_eq!(warning.severity, Severity::Warning);
    assert_eq!((warning.line, warning.column), (8, 5));
    assert_eq!(warning.pointer, "/plugins/labels");
    assert_eq!(warning.cause, "the plugin 'labels' is used nowhere");
}

/// `BUSBAR_BLESS=1` rewrites the committed schema.
#[test]
fn the_committed_schema_is_the_generated_one() {
    let generated = format!("{}\n", serde_json::to_string_pretty(&schema()).unwrap());
    if std::env::var_os("BUSBAR_BLESS").is_some() {
        std::fs::write(SCHEMA_FILE, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(SCHEMA_FILE).unwrap_or_default();
    assert!(committed == generated, "run this test with BUSBAR_BLESS=1 to rewrite {SCHEMA_FILE}");
}

#[test]
fn the_schema_is_valid_and_accepts_the_example() {
    let schema = schema();
    jsonschema::draft202012::meta::validate(&schema).unwrap();
    let validator = jsonschema::draft202012::new(&schema).unwrap();
    let value = serde_json::from_str(EXAMPLE).unwrap();
    validator.validate(&value).unwrap();
    assert!(!validator.is_valid(&json!({ "version": 1 })), "scene is required");
}

#[test]
fn the_schema_describes_every_property() {
    let schema = schema();
    let definitions = schema["$defs"].as_object().unwrap().values().chain([&schema]);
    let mut count = 0;
    for definition in definitions {
        for (name, property) in definition["properties"].as_object().into_iter().flatten() {
            assert!(property["description"].is_string() || name == "scale", "{name}: {property}");
            count += 1;
        }
    }
    assert!(count > 30, "{count}");
}

#[test]
fn equipment_has_names_and_panels_a_look() {
    let text = r#"{
        "version": 1,
        "scene": [{ "id": "=Q1" }],
        "equipment": { "=Q1": { "name": "Line 1", "aliases": ["2211"] } },
        "theme": { "colors": "dark", "scale": 1.25, "font": "site.ttf" }
    }"#;
    let config = parse(text).unwrap();
    let equipment = &config.equipment["=Q1"];
    assert_eq!(
        (equipment.name.as_str(), equipment.aliases.as_slice()),
        ("Line 1", &["2211".to_owned()][..])
    );
    let view = &config.view;
    assert_eq!((view.theme, view.scale), (ThemeConfig::Dark, 1.25));
    assert_eq!(view.font.as_deref(), Some("site.ttf"));
}

#[test]
fn an_instance_says_that_it_is_simulated_and_how_its_freshness_counts() {
    let config = example();
    for plugin in config.plugins.values() {
        assert!(!plugin.simulated && plugin.freshness_by == FreshnessBasis::SourceTime);
    }
    let with = |fields: &str| {
        let mut example: serde_json::Value = serde_json::from_str(EXAMPLE).unwrap();
        let fields: serde_json::Value = serde_json::from_str(fields).unwrap();
        let plugins = example["plugins"].as_object_mut().unwrap();
        let plugin = plugins.values_mut().next().unwrap().as_object_mut().unwrap();
        plugin.extend(fields.as_object().unwrap().clone());
        parse(&example.to_string())
    };
    let config = with(r#"{ "simulated": true, "freshness_by": "reception" }"#).unwrap();
    let plugin = config.plugins.values().next().unwrap();
    assert!(plugin.simulated && plugin.freshness_by == FreshnessBasis::Reception);
    for wrong in [r#"{ "simulated": "yes" }"#, r#"{ "freshness_by": "arrival" }"#] {
        let faults = with(wrong).unwrap_err();
        assert!(faults[0].pointer.starts_with("/plugins/"), "{faults:#?}");
    }
}

#[test]
fn former_names_mean_the_same_and_are_told() {
    let former = parse(FORMER).unwrap_or_else(|faults| panic!("{faults:#?}"));
    let words: Vec<&str> = former.warnings.iter().map(|w| w.cause.as_str()).collect();
    for words_of_one in [
        "'freshness_millis' is called 'freshness_seconds' now",
        "'dead_band' is called 'deadband' now",
        "'plugin' is called 'instance' now, here and at 2 other places",
        "'max_shelving_minutes' is called 'max_shelving_seconds' now",
        "'/alarm_handling/sources' is called '/alarm_sources' now",
        "'/view/camera' is called '/camera/start' now",
        "'/view/target_frame_ms' is called '/graphics/target_frame_seconds' now",
        "'/view/theme' is called '/theme/colors' now",
        "'/view/size' is called '/window/size' now",
        "'restart_millis' is called 'restart_seconds' now",
    ] {
        assert!(words.contains(&words_of_one), "{words_of_one}: {words:#?}");
    }
    assert!(former.warnings.iter().all(|w| w.severity == Severity::Warning && w.line > 1));
    assert_eq!(former.tags["T1.TopOil"].freshness_millis, 5_000);
    assert_eq!(former.tags["T1.TopOil"].dead_band, 0.5);
    assert_eq!(former.view.target_frame_millis, Some(20.0));
    assert_eq!(former.supervision.call_millis, 2_500);
    assert_eq!(former.alarm_handling.sources[0].plugin, "plc");
    // A later fault is placed where the text has the setting.
    let (line, _) = former.positions.locate("/theme/colors");
    assert!(FORMER.lines().nth(line as usize - 1).unwrap().contains("\"theme\": \"dark\""));

    let upgraded = upgrade(FORMER, |_| RenamedSettings::default()).unwrap();
    let present = parse(&upgraded.text).unwrap_or_else(|faults| panic!("{faults:#?}"));
    assert!(present.warnings.is_empty(), "{:#?}", present.warnings);
    let changes = Changes::between(&former, &present);
    assert!(
        changes.iter().all(|change| change.section == Section::AlarmHandling),
        "{changes}: pointers of alarm sources differ, nothing else"
    );
}

#[test]
fn every_former_name_of_the_schema_is_read() {
    let mut seen = 0;
    for definition in schema()["$defs"].as_object().unwrap().values() {
        for property in definition["properties"].as_object().into_iter().flatten() {
            let (key, property) = property;
            let former = property[FORMER_NAMES].as_array().into_iter().flatten();
            for former in former {
                assert_ne!(former, key.as_str());
                seen += 1;
            }
            let unit = key.rsplit('_').next().unwrap_or_default();
            let is_other = ["ms", "millis", "minutes", "hours"].contains(&unit);
            assert!(!is_other, "{key}: durations are in seconds");
        }
    }
    assert!(seen > 20, "{seen}");
}
