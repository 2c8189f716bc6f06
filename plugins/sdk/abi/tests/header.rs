//! The C header is generated from this crate, compiles as C and as C++, and
//! has the same layout there.

use std::mem::{offset_of, size_of};
use std::path::{Path, PathBuf};
use std::process::Command;

use busbar_plugin_abi::*;

fn crate_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn header_path() -> PathBuf {
    crate_dir().join("include/busbar_plugin.h")
}

/// `BUSBAR_BLESS=1` writes the header anew.
#[test]
fn header_is_up_to_date() {
    let mut config = cbindgen::Config::from_file(crate_dir().join("cbindgen.toml")).unwrap();
    let define =
        |one: &CapabilityDefinition| format!("#define BUSBAR_{}_ID \"{}\"", one.name, one.id);
    let ids: Vec<String> = CAPABILITIES.iter().map(define).collect();
    config.after_includes =
        config.after_includes.map(|text| text.replace("@CAPABILITY_IDS@", &ids.join("\n")));
    config.export.include.extend(CAPABILITIES.iter().map(|one| one.table.to_owned()));
    let mut generated = Vec::new();
    cbindgen::Builder::new()
        .with_crate(crate_dir())
        .with_config(config)
        .generate()
        .unwrap()
        .write(&mut generated);
    let generated = String::from_utf8(generated).unwrap();
    if std::env::var_os("BUSBAR_BLESS").is_some() {
        std::fs::write(header_path(), &generated).unwrap();
    }
    let committed = std::fs::read_to_string(header_path()).unwrap_or_default();
    assert!(committed == generated, "run the test with BUSBAR_BLESS=1 and commit the header");
}

#[test]
fn header_names_the_ids() {
    let header = std::fs::read_to_string(header_path()).unwrap();
    let ids = CAPABILITIES.iter().map(|capability| capability.id);
    for id in ids.chain([PLUGIN_FACTORY_ID]) {
        assert!(header.contains(&format!("_ID \"{id}\"")), "{id}");
    }
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
fn header_alone_compiles_as_c_and_cpp() {
    let folder = tempfile::tempdir().unwrap();
    for (compiler, standard, name) in [
        ("gcc", "-std=c99", "alone.c"),
        ("gcc", "-std=c17", "alone.c"),
        ("g++", "-std=c++17", "alone.cc"),
    ] {
        let source = folder.path().join(name);
        // A declaration, since an empty translation unit is not C.
        std::fs::write(&source, "#include <busbar_plugin.h>\nextern int only_the_header;\n")
            .unwrap();
        compile(compiler, standard, &source);
    }
}

#[test]
fn layout_is_the_same_in_c_and_cpp() {
    let mut c = String::from("#include <busbar_plugin.h>\n#include <stddef.h>\n");
    c += "#ifdef __cplusplus\n#define SAME(a, b) static_assert((a) == (b), #a)\n";
    c += "#else\n#define SAME(a, b) _Static_assert((a) == (b), #a)\n#endif\n";
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
        BusbarSample { tag, kind, quality, reason, value, source_time_unix_nanos }
        BusbarTagSpec { tag, kind, freshness_millis, id, address_json, unit }
        BusbarSampleSink { struct_size, context, publish, report_link, report_scene_time }
        BusbarTelemetry { struct_size, check, start, stop }
        BusbarBinding { node, kind, limit_low, limit_high, tag_id, tag_name, unit, node_id, role }
        BusbarTagValue { kind, quality, reason, origin, value, age_millis }
        BusbarOverlayFrame { struct_size, value_count, time_unix_nanos, values }
        BusbarOverlayPrimitive { kind, binding, node, severity, caption_offset, caption_len,
            text_offset, text_len }
        BusbarOverlayOutput { struct_size, primitive_capacity, primitive_count, text_capacity,
            text_len, primitives, text, quantity_capacity, quantity_count, quantities,
            verdict_capacity, verdict_count, verdicts, basis_capacity, basis_count, basis }
        BusbarOverlayVerdict { equipment, verdict, flags, reason_offset, reason_len,
            basis_offset, basis_count }
        BusbarOverlayQuantity { kind, binding, equipment, other, value }
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
        BusbarNotify { struct_size, notify }
    }
    assert_eq!(size_of::<BusbarSample>(), 24);
    // What a plugin built before wedges came knows of a mesh: it never moves.
    assert_eq!(offset_of!(BusbarMesh, positions), 16);
    assert_eq!(offset_of!(BusbarMesh, wedge_count), 16 + 2 * size_of::<*const u32>());
    let folder = tempfile::tempdir().unwrap();
    for (compiler, standard, name) in
        [("gcc", "-std=c11", "layout.c"), ("g++", "-std=c++17", "layout.cc")]
    {
        let source = folder.path().join(name);
        std::fs::write(&source, &c).unwrap();
        compile(compiler, standard, &source);
    }
}
