//! The C headers are generated from this crate, compile alone as C and as C++, and have the same
//! layout there.
#![allow(clippy::unwrap_used, reason = "a test that cannot be set up has failed")]

use std::collections::{BTreeMap, BTreeSet};
use std::mem::{offset_of, size_of};
use std::path::{Path, PathBuf};
use std::process::Command;

use busbar_plugin_abi::*;

/// Source files without a header: what they have is for Rust alone.
const RUST_ALONE: [&str; 2] = ["lib", "vocabulary"];

fn crate_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn header_folder() -> PathBuf {
    crate_dir().join("include/busbar")
}

/// Returns the names of the files with this extension in a folder, without it, in their order.
fn stems(folder: &Path, extension: &str) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let paths = entries.map(|entry| entry.unwrap().path());
    let paths = paths.filter(|path| path.extension().is_some_and(|found| found == extension));
    let mut stems: Vec<_> =
        paths.map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned()).collect();
    stems.sort();
    stems
}

/// Header before its includes are known.
struct Generated {
    /// Name of the header, such as `telemetry`.
    name: String,
    text: String,
    /// Names of the structs that it declares, and of all its types.
    structs: BTreeSet<String>,
    types: BTreeSet<String>,
}

/// Returns the words that follow this text at the beginning of a line.
fn names_after<'a>(source: &'a str, start: &'a str) -> impl Iterator<Item = String> + 'a {
    let rest = source.lines().filter_map(move |line| line.strip_prefix(start));
    rest.map(|rest| rest.chars().take_while(char::is_ascii_alphanumeric).collect())
}

/// Generates the header of a source file. Types of other files keep their names.
fn generate(module: &str, numbers: &[String]) -> Generated {
    let path = crate_dir().join("src").join(module).with_extension("rs");
    let source = std::fs::read_to_string(&path).unwrap();
    let name = if module == "entry" { "plugin" } else { module };
    let mut config = cbindgen::Config::from_file(crate_dir().join("cbindgen.toml")).unwrap();
    config.include_guard = Some(format!("BUSBAR_{}_H", name.to_uppercase()));
    let structs: BTreeSet<_> = names_after(&source, "pub struct ").collect();
    let enums = names_after(&source, "pub enum ");
    let types: BTreeSet<_> = structs.iter().cloned().chain(enums).collect();
    config.export.include = types.iter().cloned().collect();
    // A number that the other side writes is declared as its enum.
    for number in numbers {
        let of_enum = number.strip_suffix("Number").unwrap().to_owned();
        config.export.rename.insert(number.clone(), of_enum);
    }
    if module != "entry" {
        let documentation = source.lines().map_while(|line| line.strip_prefix("//!"));
        let lines: String = documentation.map(|line| format!(" *{line}\n")).collect();
        config.header = Some(format!(
            "/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.\n \
             * Generated from plugins/sdk/abi/src/{module}.rs by cbindgen; the test `header` \
             compares the two.\n \
             * SPDX-License-Identifier: MIT OR Apache-2.0\n *\n{lines} */"
        ));
        let capability = CAPABILITIES.iter().find(|known| known.name.to_lowercase() == module);
        config.after_includes = capability.map(|known| {
            format!("\n// Id of the capability.\n#define BUSBAR_{}_ID \"{}\"", known.name, known.id)
        });
    }
    let mut text = Vec::new();
    let builder = cbindgen::Builder::new().with_src(path).with_config(config);
    builder.generate().unwrap().write(&mut text);
    let text = String::from_utf8(text).unwrap().replace("[`", "`").replace("`]", "`");
    Generated { name: name.to_owned(), text, structs, types }
}

/// Returns the words of C code, with the comments left out.
fn code_words(header: &str) -> BTreeSet<&str> {
    let code = header.lines().filter(|line| !line.trim_start().starts_with("//"));
    code.flat_map(|line| line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')).collect()
}

/// Generates all headers, each with includes of the headers whose types it uses.
fn generate_all() -> BTreeMap<String, String> {
    let modules = stems(&crate_dir().join("src"), "rs");
    let modules = modules.iter().filter(|module| !RUST_ALONE.contains(&module.as_str()));
    let modules: Vec<_> = modules.collect();
    let numbers = modules.iter().flat_map(|module| {
        let path = crate_dir().join("src").join(module).with_extension("rs");
        let source = std::fs::read_to_string(path).unwrap();
        names_after(&source, "    Busbar").map(|name| format!("Busbar{name}")).collect::<Vec<_>>()
    });
    let numbers: Vec<_> = numbers.filter(|name| name.ends_with("Number")).collect();
    let all: Vec<_> = modules.iter().map(|module| generate(module, &numbers)).collect();
    let with_includes = |header: &Generated| {
        let words = code_words(&header.text);
        let used = |other: &&Generated| {
            let is_used = other.types.iter().any(|name| words.contains(name.as_str()));
            is_used && other.name != header.name
        };
        let mut text = header.text.clone();
        let mut includes = "#include <stdint.h>\n".to_owned();
        for other in all.iter().filter(used) {
            includes += &format!("#include <busbar/{}.h>\n", other.name);
            for name in other.structs.iter().filter(|name| words.contains(name.as_str())) {
                text = with_struct_tag(&text, name);
            }
        }
        let text = text.replacen("#include <stdint.h>\n", &includes, 1);
        (format!("{}.h", header.name), text)
    };
    all.iter().map(with_includes).collect()
}

/// Names a struct of another header as those of the same one: with `struct`.
fn with_struct_tag(header: &str, name: &str) -> String {
    let line = |line: &str| {
        let is_comment = line.trim_start().starts_with("//");
        let tagged = || line.replace(&format!("{name} "), &format!("struct {name} "));
        if is_comment { line.to_owned() } else { tagged() }
    };
    header.lines().map(|one| line(one) + "\n").collect()
}

/// `BUSBAR_BLESS=1` writes the headers anew.
#[test]
fn headers_are_up_to_date() {
    let generated = generate_all();
    let is_bless = std::env::var_os("BUSBAR_BLESS").is_some();
    for (name, text) in &generated {
        let path = header_folder().join(name);
        if is_bless {
            std::fs::create_dir_all(header_folder()).unwrap();
            std::fs::write(&path, text).unwrap();
        }
        let committed = std::fs::read_to_string(&path).unwrap_or_default();
        assert!(committed == *text, "run the test with BUSBAR_BLESS=1 and commit {name}");
    }
    let kept: Vec<_> =
        stems(&header_folder(), "h").iter().map(|name| format!("{name}.h")).collect();
    assert!(kept.iter().eq(generated.keys()), "a header has no source any more: {kept:?}");
}

#[test]
fn headers_name_the_ids() {
    let has_id = |name: &str, id: &str| {
        let header = std::fs::read_to_string(header_folder().join(name).with_extension("h"));
        assert!(header.unwrap().contains(&format!("_ID \"{id}\"")), "{id}");
    };
    for capability in CAPABILITIES {
        has_id(&capability.name.to_lowercase(), capability.id);
    }
    has_id("plugin", PLUGIN_FACTORY_ID);
    let header = std::fs::read_to_string(header_folder().join("plugin.h")).unwrap();
    assert!(header.contains(ENTRY_SYMBOL.to_str().unwrap()));
}

fn compile(compiler: &str, standard: &str, source: &Path) {
    let output = Command::new(compiler)
        .args([standard, "-Wall", "-Wextra", "-pedantic", "-Werror", "-fsyntax-only"])
        .arg("-I")
        .arg(crate_dir().join("include"))
        .arg(source)
        .output()
        .unwrap_or_else(|error| panic!("{compiler}: {error}; install gcc and g++"));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn each_header_alone_compiles_as_c_and_cpp() {
    let folder = tempfile::tempdir().unwrap();
    for header in stems(&header_folder(), "h") {
        for (compiler, standard, name) in [
            ("gcc", "-std=c99", "alone.c"),
            ("gcc", "-std=c17", "alone.c"),
            ("g++", "-std=c++17", "alone.cc"),
        ] {
            let source = folder.path().join(name);
            // Twice, for its guard; and a declaration, since an empty translation unit is not C.
            let include = format!("#include <busbar/{header}.h>\n");
            let text = format!("{include}{include}extern int only_the_header;\n");
            std::fs::write(&source, text).unwrap();
            compile(compiler, standard, &source);
        }
    }
}

/// Returns the includes of all headers.
fn all_includes() -> String {
    let names = stems(&header_folder(), "h");
    names.iter().map(|name| format!("#include <busbar/{name}.h>\n")).collect()
}

/// Compiles these lines, after the includes of all headers, in both languages.
fn compile_in_both(lines: &str) {
    let mut c = all_includes() + "#include <stddef.h>\n";
    c += "#ifdef __cplusplus\n#define SAME(a, b) static_assert((a) == (b), #a)\n";
    c += "#else\n#define SAME(a, b) _Static_assert((a) == (b), #a)\n#endif\n";
    c += lines;
    let folder = tempfile::tempdir().unwrap();
    for (compiler, standard, name) in
        [("gcc", "-std=c11", "layout.c"), ("g++", "-std=c++17", "layout.cc")]
    {
        let source = folder.path().join(name);
        std::fs::write(&source, &c).unwrap();
        compile(compiler, standard, &source);
    }
}

/// Fields of an enum's numbers are declared by the enum, with the values that Rust has.
#[test]
fn enums_are_typed_with_the_same_values() {
    let mut c = String::new();
    macro_rules! same_values {
        ($($name:ident { $($constant:ident),* $(,)? })*) => {$(
            $(c += &format!("SAME({}, {});\n", stringify!($constant), $constant);)*
            c += &format!("SAME(sizeof({0}), {1});\n", stringify!($name), size_of::<$name>());
        )*};
    }
    same_values! {
        BusbarStatus { BUSBAR_OK, BUSBAR_INVALID_ARGUMENT, BUSBAR_INVALID_SETTINGS,
            BUSBAR_BUFFER_TOO_SMALL, BUSBAR_CANCELLED, BUSBAR_FAILED, BUSBAR_INTERNAL }
        BusbarLogLevel { BUSBAR_LOG_ERROR, BUSBAR_LOG_WARNING, BUSBAR_LOG_INFO, BUSBAR_LOG_DEBUG }
        BusbarLinkState { BUSBAR_LINK_STATE_IDLE, BUSBAR_LINK_STATE_CONNECTING,
            BUSBAR_LINK_STATE_UP, BUSBAR_LINK_STATE_DOWN }
        BusbarValueKind { BUSBAR_VALUE_KIND_NONE, BUSBAR_VALUE_KIND_F64, BUSBAR_VALUE_KIND_I64,
            BUSBAR_VALUE_KIND_BOOL, BUSBAR_VALUE_KIND_DOUBLE_POINT, BUSBAR_VALUE_KIND_TEXT }
        BusbarQuality { BUSBAR_QUALITY_GOOD, BUSBAR_QUALITY_UNCERTAIN, BUSBAR_QUALITY_BAD }
        BusbarReason { BUSBAR_REASON_NONE, BUSBAR_REASON_COMMUNICATION, BUSBAR_REASON_SENSOR,
            BUSBAR_REASON_OUT_OF_RANGE, BUSBAR_REASON_CONFIGURATION, BUSBAR_REASON_NOT_CONNECTED,
            BUSBAR_REASON_NOT_FINITE, BUSBAR_REASON_STALE, BUSBAR_REASON_SOURCE_TIME }
        BusbarPattern { BUSBAR_PATTERN_SOLID, BUSBAR_PATTERN_STRIPED, BUSBAR_PATTERN_CROSSED,
            BUSBAR_PATTERN_DOTTED }
        BusbarSeverity { BUSBAR_SEVERITY_NORMAL, BUSBAR_SEVERITY_WARNING, BUSBAR_SEVERITY_ALARM }
        BusbarVerdict { BUSBAR_VERDICT_NORMAL, BUSBAR_VERDICT_ABNORMAL, BUSBAR_VERDICT_UNKNOWN }
        BusbarDefectSeverity { BUSBAR_DEFECT_SEVERITY_NONE, BUSBAR_DEFECT_SEVERITY_GENERAL,
            BUSBAR_DEFECT_SEVERITY_SERIOUS, BUSBAR_DEFECT_SEVERITY_CRITICAL }
        BusbarSignalShape { BUSBAR_SIGNAL_SHAPE_CONSTANT, BUSBAR_SIGNAL_SHAPE_SINE,
            BUSBAR_SIGNAL_SHAPE_WALK, BUSBAR_SIGNAL_SHAPE_STEPS, BUSBAR_SIGNAL_SHAPE_COUNTER }
        BusbarPrimitiveKind { BUSBAR_PRIMITIVE_KIND_LINE, BUSBAR_PRIMITIVE_KIND_TINT,
            BUSBAR_PRIMITIVE_KIND_STATE }
        BusbarQuantityKind { BUSBAR_QUANTITY_KIND_POSITION, BUSBAR_QUANTITY_KIND_FLOW,
            BUSBAR_QUANTITY_KIND_LEVEL }
        BusbarSimulatedEventKind { BUSBAR_SIMULATED_EVENT_KIND_VALUE,
            BUSBAR_SIMULATED_EVENT_KIND_RELEASE }
        BusbarExitCode { BUSBAR_EXIT_CODE_DONE, BUSBAR_EXIT_CODE_INPUT, BUSBAR_EXIT_CODE_USAGE }
    }
    // Each is an enum to the compiler: C++ takes no plain number for one.
    c += "#ifdef __cplusplus\nstatic BusbarSample sample_of(BusbarValueKind kind) {\n\
          BusbarSample sample = {}; sample.kind = kind; sample.quality = BUSBAR_QUALITY_BAD;\n\
          sample.reason = BUSBAR_REASON_SENSOR; return sample; }\n\
          void use_sample(void) { (void)sample_of(BUSBAR_VALUE_KIND_F64); }\n#endif\n";
    compile_in_both(&c);
}

#[test]
fn layout_is_the_same_in_c_and_cpp() {
    let mut c = String::new();
    macro_rules! same {
        ($($name:ident { $($field:ident),* })*) => {$(
            c += &format!("SAME(sizeof({0}), {1});\n", stringify!($name), size_of::<$name>());
            $(c += &format!("SAME(offsetof({0}, {1}), {2});\n",
                stringify!($name), stringify!($field), offset_of!($name, $field));)*
        )*};
    }
    same! {
        BusbarStr { ptr, len }
        BusbarError { struct_size, message_len, status, message }
        BusbarHost { struct_size, abi_major, abi_minor, context, log }
        BusbarPluginEntry { struct_size, abi_major, abi_minor, init, deinit, get_factory }
        BusbarPluginFactory { struct_size, count, descriptor, create }
        BusbarPluginDescriptor { struct_size, capability_count, id, name, version, description,
            settings_schema, capabilities }
        BusbarPlugin { struct_size, data, destroy, get_capability }
        BusbarMesh { struct_size, position_count, triangle_count, positions, triangles,
            wedge_count, corners, wedge_positions, wedge_normals, wedge_uvs, wedge_sections }
        BusbarCollapse { removed, kept, error }
        BusbarStage { name, millis }
        BusbarCollapseOutput { struct_size, collapse_capacity, collapse_count, stage_capacity,
            stage_count, flags, collapses, stages }
        BusbarProgress { struct_size, context, report }
        BusbarMeshOptimizer { struct_size, flags, optimize }
        BusbarSample { tag, kind, quality, reason, flags, number, integer,
            source_time_unix_nanos, text }
        BusbarTagSpec { tag, kind, reserved, freshness_millis, id, address_json, unit }
        BusbarSampleSink { struct_size, context, publish, report_link, report_scene_time }
        BusbarTelemetry { struct_size, check, start, stop }
        BusbarBinding { node, kind, reserved, limit_low, limit_high, tag_id, tag_name, unit,
            node_id, role }
        BusbarTagValue { kind, quality, reason, origin, number, integer, age_millis, text }
        BusbarOverlayFrame { struct_size, value_count, time_unix_nanos, values }
        BusbarOverlayPrimitive { kind, binding, node, severity, equipment, entry, caption_offset, caption_len,
            text_offset, text_len }
        BusbarOverlayOutput { struct_size, primitive_capacity, primitive_count, text_capacity,
            text_len, primitives, text, quantity_capacity, quantity_count, quantities,
            verdict_capacity, verdict_count, verdicts, basis_capacity, basis_count, basis }
        BusbarOverlayVerdict { equipment, verdict, flags, reason_offset, reason_len,
            basis_offset, basis_count }
        BusbarOverlayQuantity { kind, binding, equipment, mechanism, to_equipment, value }
        BusbarLegendEntry { name, pattern, color }
        BusbarOverlayDescription { struct_size, legend_count, equipment_count, legend, equipment,
            mechanism_count, starts_hidden, mechanisms, contour, finding_count, findings }
        BusbarContour { name, unit, reach_metres, low, high, step }
        BusbarOverlay { struct_size, configure, draw, describe }
        BusbarSimulatedTag { spec, shape, base, amplitude, period_seconds }
        BusbarSimulation { struct_size, faults, seed, update_millis, fault_period_millis,
            fault_millis, scenario_unix_nanos, event_count, link_fault_count, events, link_faults }
        BusbarSimulatedEvent { tag, kind, at_seconds, over_seconds, value }
        BusbarLinkFault { fault, reserved, at_seconds, for_seconds }
        BusbarSimulatorStatus { struct_size, fault, clients, message_len, connections, messages,
            message }
        BusbarSimulator { struct_size, start, stop, status }
        BusbarCommandInfo { struct_size, name, help }
        BusbarCommandCall { struct_size, argument_count, name, arguments }
        BusbarCommandStreams { struct_size, context, read, write, diagnose }
        BusbarCommandResult { struct_size, exit_code }
        BusbarCommand { struct_size, count, describe, run }
        BusbarTextOutput { struct_size, capacity, len, reserved, text }
        BusbarChartRecord { time_unix_nanos, equipment, state }
        BusbarChartPage { struct_size, axis_count, first, capacity, count, total, revision,
            records, values }
        BusbarChart { struct_size, describe, read, explain }
        BusbarRecordRow { time_unix_nanos, severity, flags }
        BusbarRecordPage { struct_size, list, column_count, row_capacity, first, text_capacity,
            row_count, total, revision, rows, ends, text }
        BusbarRecords { struct_size, describe, read }
        BusbarAlarms { struct_size, read }
        BusbarNotify { struct_size, notify }
    }
    assert_eq!(size_of::<BusbarSample>(), 48);
    // What a plugin built before wedges came knows of a mesh: it never moves.
    assert_eq!(offset_of!(BusbarMesh, positions), 16);
    assert_eq!(offset_of!(BusbarMesh, wedge_count), 16 + 2 * size_of::<*const u32>());
    compile_in_both(&c);
}
