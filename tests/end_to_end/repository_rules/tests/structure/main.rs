//! The house's rules: who may import whom, who names plugins, who is unsafe,
//! whether documents lead where they say, how large crates are, which files name one another in
//! circles, and how doc comments read.

mod circles;
mod crate_size;
mod dependencies;
mod doc_comments;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use e2e::{finish, workspace_path};
use serde_json::Value;

/// Imports from this workspace that each crate may have.
const ALLOWED: &[(&str, &[&str])] = &[
    (
        "busbar",
        &[
            "busbar_audit_log",
            "busbar_benchmark",
            "busbar_client",
            "busbar_commands",
            "busbar_config",
            "busbar_plugin_check",
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_point_import",
            "busbar_process_heap",
            "busbar_scene_loader",
            "busbar_types",
            "busbar_viewer",
            "busbar_viewer_server",
            "busbar_web",
        ],
    ),
    (
        "busbar_viewer",
        &[
            "busbar_alarms",
            "busbar_camera",
            "busbar_chart",
            "busbar_config",
            "busbar_geometry",
            "busbar_history",
            "busbar_lod",
            "busbar_overlay_picture",
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_records",
            "busbar_renderer",
            "busbar_scene",
            "busbar_scene_loader",
            "busbar_scene_overlays",
            "busbar_site",
            "busbar_tags",
            "busbar_types",
            "busbar_ui",
        ],
    ),
    ("busbar_alarms", &["busbar_overlay_picture", "busbar_tags", "busbar_types"]),
    ("busbar_audit_log", &["busbar_alarms", "busbar_tags", "busbar_types"]),
    (
        "busbar_benchmark",
        &[
            "busbar_config",
            "busbar_geometry",
            "busbar_gltf_export",
            "busbar_scene",
            "busbar_scene_loader",
            "busbar_types",
            "busbar_viewer",
        ],
    ),
    (
        "busbar_camera",
        &[
            "busbar_config",
            "busbar_geometry",
            "busbar_lod",
            "busbar_renderer",
            "busbar_scene",
            "busbar_ui",
        ],
    ),
    ("busbar_chart", &["busbar_types"]),
    ("busbar_client", &["busbar_protocol", "busbar_types"]),
    (
        "busbar_commands",
        &[
            "busbar_config",
            "busbar_geometry",
            "busbar_gltf_export",
            "busbar_gltf_import",
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_point_import",
            "busbar_scene",
            "busbar_scene_loader",
            "busbar_tags",
        ],
    ),
    ("busbar_config", &["busbar_types"]),
    ("busbar_culling", &["busbar_geometry"]),
    ("busbar_density", &["busbar_gpu", "busbar_shaders"]),
    ("busbar_embed", &["busbar_client", "busbar_protocol", "busbar_types"]),
    ("busbar_geometry", &[]),
    ("busbar_gltf_export", &["busbar_geometry", "busbar_scene"]),
    ("busbar_gltf_import", &["busbar_geometry", "busbar_scene"]),
    ("busbar_gpu", &[]),
    ("busbar_history", &["busbar_tags", "busbar_types"]),
    ("busbar_lod", &["busbar_geometry", "busbar_scene"]),
    (
        "busbar_plugin_check",
        &[
            "busbar_alarms",
            "busbar_chart",
            "busbar_geometry",
            "busbar_plugin_abi",
            "busbar_records",
            "busbar_types",
        ],
    ),
    (
        "busbar_plugin_host",
        &[
            "busbar_alarms",
            "busbar_chart",
            "busbar_geometry",
            "busbar_overlay_picture",
            "busbar_plugin_abi",
            "busbar_records",
            "busbar_scene",
            "busbar_tags",
            "busbar_types",
        ],
    ),
    (
        "busbar_plugin_process",
        &[
            "busbar_alarms",
            "busbar_chart",
            "busbar_geometry",
            "busbar_plugin_abi",
            "busbar_plugin_host",
            "busbar_protocol",
            "busbar_records",
            "busbar_tags",
            "busbar_types",
        ],
    ),
    ("busbar_overlay_picture", &["busbar_tags", "busbar_types"]),
    ("busbar_panel_painter", &["busbar_gpu", "busbar_shaders"]),
    ("busbar_point_import", &["busbar_types"]),
    ("busbar_process_heap", &["busbar_huge_pages"]),
    ("busbar_protocol", &["busbar_types"]),
    ("busbar_records", &["busbar_types"]),
    (
        "busbar_renderer",
        &[
            "busbar_culling",
            "busbar_density",
            "busbar_geometry",
            "busbar_gpu",
            "busbar_panel_painter",
            "busbar_scene",
            "busbar_shaders",
        ],
    ),
    ("busbar_scene", &["busbar_geometry"]),
    (
        "busbar_scene_loader",
        &[
            "busbar_alarms",
            "busbar_audit_log",
            "busbar_config",
            "busbar_geometry",
            "busbar_gltf_import",
            "busbar_lod",
            "busbar_overlay_picture",
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_scene",
            "busbar_stack_cache",
            "busbar_tags",
            "busbar_types",
        ],
    ),
    (
        "busbar_scene_overlays",
        &[
            "busbar_camera",
            "busbar_chart",
            "busbar_config",
            "busbar_overlay_picture",
            "busbar_plugin_host",
            "busbar_renderer",
            "busbar_scene",
            "busbar_scene_loader",
            "busbar_site",
            "busbar_tags",
            "busbar_types",
            "busbar_ui",
        ],
    ),
    ("busbar_shaders", &[]),
    (
        "busbar_site",
        &[
            "busbar_alarms",
            "busbar_audit_log",
            "busbar_chart",
            "busbar_config",
            "busbar_history",
            "busbar_overlay_picture",
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_records",
            "busbar_tags",
            "busbar_types",
        ],
    ),
    ("busbar_stack_cache", &["busbar_geometry"]),
    ("busbar_tags", &["busbar_types"]),
    ("busbar_ui", &["busbar_chart", "busbar_records", "busbar_types"]),
    (
        "busbar_viewer_server",
        &[
            "busbar_alarms",
            "busbar_protocol",
            "busbar_scene_loader",
            "busbar_tags",
            "busbar_types",
            "busbar_viewer",
        ],
    ),
    ("busbar_web", &["busbar_client", "busbar_protocol", "busbar_types"]),
    ("busbar_types", &[]),
    ("busbar_plugin_abi", &["busbar_types"]),
    ("busbar_huge_pages", &[]),
    ("busbar_plugin_sdk", &["busbar_huge_pages", "busbar_plugin_abi", "busbar_types"]),
    ("condition", &["busbar_plugin_sdk"]),
    ("contour", &["busbar_plugin_sdk"]),
    ("csv_records", &["busbar_plugin_sdk", "record_source", "text_table"]),
    ("device_server", &["busbar_plugin_sdk"]),
    ("dga", &[]),
    ("energisation", &["busbar_plugin_sdk"]),
    ("fault_injector", &["busbar_plugin_sdk"]),
    ("gas_analysis", &["busbar_plugin_sdk", "dga", "text_table"]),
    ("busbar_link", &[]),
    ("iec104", &["busbar_link", "busbar_plugin_sdk", "device_server"]),
    ("iec61850", &["busbar_link", "busbar_plugin_sdk", "source_units"]),
    ("load_flow", &["busbar_plugin_sdk"]),
    ("mesh_shells", &["busbar_plugin_sdk"]),
    ("modbus_adapter", &["busbar_link", "busbar_plugin_sdk", "device_server"]),
    ("mqtt", &["busbar_link", "busbar_plugin_sdk", "source_units"]),
    ("notifier", &["busbar_link", "busbar_plugin_sdk"]),
    ("opcua", &["busbar_link", "busbar_plugin_sdk", "source_units"]),
    ("power_overlay", &["busbar_plugin_sdk"]),
    ("quadric_collapse", &["busbar_plugin_sdk", "mesh_shells"]),
    ("record_source", &["busbar_plugin_sdk", "source_units", "text_table"]),
    ("replay", &["busbar_plugin_sdk", "source_units", "text_table"]),
    ("sample_generator", &["busbar_plugin_sdk"]),
    ("sf6_density", &["busbar_plugin_sdk"]),
    ("source_units", &["busbar_types"]),
    ("sql_adapter", &["busbar_link", "busbar_plugin_sdk", "source_units", "text_table"]),
    ("sqlite_records", &["busbar_plugin_sdk", "record_source"]),
    ("text_table", &["busbar_types", "source_units"]),
    ("switch_position", &["busbar_plugin_sdk"]),
    ("thermography", &["busbar_plugin_sdk"]),
    ("transformer_thermal", &["busbar_plugin_sdk"]),
    ("weighted_collapse", &["busbar_plugin_sdk", "mesh_shells"]),
    (
        "bench",
        &[
            "busbar_geometry",
            "busbar_gltf_export",
            "busbar_gltf_import",
            "busbar_plugin_host",
            "busbar_plugin_sdk",
            "busbar_scene",
            "corpus",
            "demo_model",
            "report_writer",
            "measure",
            "quadric_collapse",
            "substation",
            "weighted_collapse",
        ],
    ),
    (
        "bench_render",
        &[
            "busbar_commands",
            "busbar_geometry",
            "busbar_gltf_export",
            "busbar_process_heap",
            "busbar_scene_loader",
            "busbar_viewer",
            "report_writer",
            "measure",
            "substation",
        ],
    ),
    ("corpus", &["busbar_geometry", "busbar_gltf_export", "busbar_scene"]),
    ("demo_model", &["busbar_geometry", "busbar_gltf_export", "busbar_scene"]),
    (
        "substation",
        &["busbar_geometry", "busbar_gltf_export", "busbar_scene", "demo_model", "energisation"],
    ),
    ("report_writer", &[]),
    ("measure", &["busbar_geometry"]),
    // It sees a viewer's window alone.
    ("motion", &[]),
    (
        "paper",
        &[
            "busbar_geometry",
            "busbar_gltf_export",
            "busbar_gltf_import",
            "busbar_plugin_host",
            "busbar_renderer",
            "busbar_scene",
            "busbar_scene_loader",
            "busbar_viewer",
            "report_writer",
            "measure",
            "substation",
            "weighted_collapse",
        ],
    ),
    ("e2e", &[]),
    ("device_tests", &[]),
    ("operation_tests", &[]),
    ("plugin_tests", &[]),
    ("repository_rules", &[]),
    ("view_tests", &[]),
    ("fault_proxy", &[]),
    (
        "fleet",
        &[
            "busbar_chart",
            "busbar_gltf_export",
            "busbar_scene_loader",
            "busbar_viewer",
            "substation",
        ],
    ),
    (
        "faults",
        &[
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_scene_loader",
            "busbar_tags",
            "busbar_types",
            "busbar_viewer",
            "report_writer",
            "e2e",
            "fault_injector",
        ],
    ),
    ("fuzz_corpus", &[]),
    (
        "sites",
        &[
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_tags",
            "busbar_types",
            "report_writer",
        ],
    ),
    ("simulated_year", &["busbar_link", "busbar_plugin_sdk", "device_server"]),
    (
        "traffic",
        &[
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_scene_loader",
            "busbar_tags",
            "busbar_types",
            "busbar_viewer",
            "report_writer",
        ],
    ),
    ("peer_process", &[]),
    ("vulkan_faults", &[]),
    ("xtask", &["vulkan_faults"]),
];
/// Imports that tests alone may have besides.
const ALLOWED_IN_TESTS: &[(&str, &[&str])] = &[
    (
        "device_tests",
        &["busbar_plugin_sdk", "busbar_scene_loader", "busbar_viewer", "e2e", "peer_process"],
    ),
    (
        "operation_tests",
        &[
            "busbar_chart",
            "busbar_plugin_check",
            "busbar_process_heap",
            "busbar_scene_loader",
            "busbar_viewer",
            "e2e",
            "fleet",
        ],
    ),
    (
        "plugin_tests",
        &[
            "busbar_chart",
            "busbar_geometry",
            "busbar_gltf_export",
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_scene",
            "busbar_scene_loader",
            "busbar_types",
            "busbar_viewer",
            "dga",
            "e2e",
            "fault_injector",
            "fleet",
            "substation",
        ],
    ),
    ("repository_rules", &["e2e"]),
    (
        "view_tests",
        &[
            "busbar_chart",
            "busbar_geometry",
            "busbar_gltf_export",
            "busbar_gltf_import",
            "busbar_plugin_host",
            "busbar_renderer",
            "busbar_scene",
            "busbar_scene_loader",
            "busbar_types",
            "busbar_viewer",
            "corpus",
            "e2e",
            "substation",
        ],
    ),
    ("busbar_gltf_import", &["busbar_gltf_export"]),
    ("busbar_scene_overlays", &["busbar_geometry"]),
    ("busbar_plugin_host", &["busbar_plugin_sdk"]),
    (
        "fuzz_corpus",
        &[
            "busbar_audit_log",
            "busbar_config",
            "busbar_geometry",
            "busbar_gltf_export",
            "busbar_gltf_import",
            "busbar_plugin_host",
            "busbar_plugin_process",
            "busbar_plugin_sdk",
            "busbar_point_import",
            "busbar_protocol",
            "busbar_stack_cache",
            "busbar_tags",
            "busbar_types",
            "busbar_web",
            "csv_records",
            "gas_analysis",
            "iec104",
            "iec61850",
            "modbus_adapter",
            "mqtt",
            "opcua",
            "replay",
            "sql_adapter",
        ],
    ),
    ("busbar_embed", &["e2e", "vulkan_faults"]),
    ("busbar_web", &["e2e"]),
    ("busbar_point_import", &["demo_model", "substation"]),
    ("iec104", &["fault_proxy", "peer_process", "simulated_year"]),
    ("iec61850", &["fault_proxy", "peer_process"]),
    ("modbus_adapter", &["fault_proxy", "simulated_year"]),
    ("mqtt", &["fault_proxy", "peer_process"]),
    ("notifier", &["peer_process"]),
    ("opcua", &["fault_proxy", "peer_process"]),
    ("corpus", &["busbar_gltf_import"]),
    ("quadric_collapse", &["busbar_geometry"]),
    ("substation", &["busbar_config", "busbar_gltf_import", "busbar_types"]),
    ("vulkan_faults", &["busbar_geometry", "busbar_gltf_export", "busbar_scene", "e2e"]),
];
/// Crates from elsewhere that only these may import, in tests and examples too.
const RESERVED: &[(&str, &[&str])] = &[
    ("ash", &["busbar_gpu"]),
    ("ash-window", &["busbar_gpu"]),
    ("gpu-allocator", &["busbar_gpu"]),
    ("libloading", &["busbar_plugin_check", "busbar_plugin_host"]),
    ("memmap2", &["busbar_plugin_process", "busbar_protocol"]),
    ("seccompiler", &["busbar_plugin_process"]),
    ("basisu", &["busbar_gltf_import"]),
    ("draco-core", &["busbar_gltf_import"]),
    ("winit", &["busbar"]),
    ("egui-winit", &["busbar"]),
    ("csv-core", &["gas_analysis", "text_table"]),
    ("async-opcua", &["opcua"]),
    ("tokio-modbus", &["modbus_adapter"]),
    ("tokio-rustls", &["busbar_link", "sql_adapter"]),
    ("tokio-serial", &["modbus_adapter"]),
    ("rusqlite", &["gas_analysis", "sql_adapter", "sqlite_records", "substation"]),
    ("tokio-postgres", &["sql_adapter"]),
    ("tokio-postgres-rustls", &["sql_adapter"]),
];
/// Reserved crates that others may use in tests and examples.
const RESERVED_BUT_IN_TESTS: [(&str, &str); 1] = [("winit", "busbar_renderer")];
/// Crates that may have unsafe code: they call Vulkan or the system, speak the C ABI or
/// share memory with other processes.
const UNSAFE: [&str; 12] = [
    "host/app/process_heap",
    "host/remote/embed",
    "host/graphics/gpu",
    "host/plugins/plugin_check",
    "host/plugins/plugin_host",
    "host/plugins/plugin_process",
    "host/remote/protocol",
    "plugins/sdk/abi",
    "tests/robustness/fault_injector",
    "plugins/support/huge_pages",
    "plugins/sdk/sdk",
    "tests/end_to_end/vulkan_faults",
];
/// Folders that no crate of the site imports from: it has no camera and draws nothing.
const VIEW_FOLDERS: [&str; 5] =
    ["host/app", "host/graphics", "host/models", "host/scene", "host/view"];
/// Crates of those folders that the site imports all the same: the checked configuration names tags,
/// alarms and plugins, and nothing of it is drawn.
const SHARED_WITH_SITE: [&str; 1] = ["busbar_config"];
/// Crates from elsewhere that draw, open windows or compute with a camera.
const DRAWING_CRATES: [&str; 5] = ["ash", "egui", "glam", "skrifa", "winit"];

/// Documents whose links are followed.
const DOCUMENTS: [&str; 3] = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md"];

/// Folders of `plugins` whose crates are libraries that a host loads.
const PLUGIN_FOLDERS: [&str; 6] =
    ["charts", "notifications", "optimizers", "overlays", "records", "telemetry"];
/// Folders of `plugins` whose crates are linked into plugins.
const LIBRARY_FOLDERS: [&str; 2] = ["sdk", "support"];

/// A package of the workspace: its folder and what it imports, and how.
struct Package {
    folder: PathBuf,
    /// One of its targets is a library that a host loads.
    is_plugin: bool,
    /// Root files of its libraries and programs.
    roots: Vec<PathBuf>,
    imports: Vec<(String, bool)>,
}

fn packages() -> BTreeMap<String, Package> {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["metadata", "--format-version", "1", "--no-deps", "--offline"]);
    let output = finish(cargo.current_dir(workspace_path(""))).expect_code(0);
    let metadata: Value = serde_json::from_str(&output.stdout).expect("metadata are JSON");
    let text = |value: &Value| value.as_str().expect("it is text").to_owned();
    let packages = metadata["packages"].as_array().expect("metadata have packages");
    let package = |package: &Value| {
        let imports = package["dependencies"].as_array().expect("packages have dependencies");
        let imports = imports.iter().map(|d| (text(&d["name"]), d["kind"] == "dev"));
        let manifest = PathBuf::from(text(&package["manifest_path"]));
        let folder = manifest.parent().expect("it is in a folder").to_owned();
        let targets = package["targets"].as_array().expect("packages have targets");
        let mut kinds = targets.iter().filter_map(|target| target["crate_types"].as_array());
        let is_plugin = kinds.any(|kinds| kinds.iter().any(|kind| kind == "cdylib"));
        let roots = targets.iter().filter(|target| is_shipped(target));
        let roots = roots.map(|target| PathBuf::from(text(&target["src_path"]))).collect();
        let imports = imports.collect();
        (text(&package["name"]), Package { folder, is_plugin, roots, imports })
    };
    packages.iter().map(package).collect()
}

/// Reports whether a target is a library or a program, not a test, example or build script.
fn is_shipped(target: &Value) -> bool {
    let kinds = target["kind"].as_array().into_iter().flatten().filter_map(Value::as_str);
    kinds.into_iter().any(|kind| kind == "bin" || kind == "proc-macro" || kind.ends_with("lib"))
}

#[test]
fn crates_import_only_what_they_may() {
    let packages = packages();
    let allowed: BTreeMap<_, _> = ALLOWED.iter().copied().collect();
    let in_tests: BTreeMap<_, _> = ALLOWED_IN_TESTS.iter().copied().collect();
    let known: BTreeSet<_> = allowed.keys().copied().collect();
    let found: BTreeSet<_> = packages.keys().map(String::as_str).collect();
    assert_eq!(found, known, "crates that are there, and those of the table");
    for (name, package) in &packages {
        for (import, for_tests) in &package.imports {
            let import = import.as_str();
            let may = allowed[name.as_str()].contains(&import)
                || (*for_tests && in_tests.get(name.as_str()).is_some_and(|i| i.contains(&import)));
            assert!(may || !packages.contains_key(import), "{name} may not import {import}");
        }
    }
}

/// Imports of the crates that choose detail and load scenes, followed to their ends.
#[test]
fn detail_and_loading_know_no_renderer_no_device_and_no_panels() {
    let packages = packages();
    for name in ["busbar_lod", "busbar_scene_loader"] {
        let (mut seen, mut next) = (BTreeSet::new(), vec![name]);
        while let Some(name) = next.pop() {
            if !seen.insert(name) {
                continue;
            }
            let package = &packages[name];
            let drawing = ["ash", "egui", "busbar_gpu", "busbar_renderer", "busbar_ui"];
            let imports = package.imports.iter().filter(|(_, for_tests)| !for_tests);
            for (import, _) in imports {
                assert!(!drawing.contains(&import.as_str()), "{name} imports {import}");
                next.extend(packages.contains_key(import).then_some(import.as_str()));
            }
        }
        assert!(seen.contains("busbar_scene"), "{seen:?}");
    }
}

#[test]
fn reserved_crates_are_imported_by_their_owners_alone() {
    let packages = packages();
    for (reserved, owners) in RESERVED {
        let mut used = false;
        for (name, package) in &packages {
            for (_, for_tests) in package.imports.iter().filter(|(import, _)| import == reserved) {
                let owner = owners.contains(&name.as_str());
                let exempt = *for_tests && RESERVED_BUT_IN_TESTS.contains(&(reserved, name));
                assert!(owner || exempt, "{name} may not import {reserved}");
                used |= owner;
            }
        }
        assert!(used, "{reserved} is imported by nobody: take it off the table");
    }
    let abi = &packages["busbar_plugin_abi"];
    let imports = abi.imports.iter().filter(|(_, for_tests)| !for_tests).map(|(import, _)| import);
    let imports: Vec<_> = imports.collect();
    assert_eq!(imports, ["busbar_types"], "the ABI depends on the vocabulary alone");
    let manifest = fs::read_to_string(packages["busbar_types"].folder.join("Cargo.toml"));
    let manifest = manifest.expect("it is text");
    let (_, table) = manifest.split_once("[dependencies]").expect("it has the table");
    let table = table.split("\n[").next().unwrap_or_default();
    let plain: Vec<_> =
        table.lines().filter(|l| l.contains('=') && !l.contains("optional = true")).collect();
    assert!(plain.is_empty(), "the vocabulary has no dependencies, but {plain:?}");
}

#[test]
fn the_site_knows_no_view() {
    let packages = packages();
    let folder_of = |name: &str| {
        let root = workspace_path("").canonicalize().expect("it is there");
        let folder = packages.get(name)?.folder.canonicalize().expect("it is there");
        Some(folder.strip_prefix(&root).expect("it is in the workspace").to_owned())
    };
    let mut seen = 0;
    for (name, package) in &packages {
        if !folder_of(name).is_some_and(|folder| folder.starts_with("host/site")) {
            continue;
        }
        seen += 1;
        for (import, _) in &package.imports {
            let is_drawing = DRAWING_CRATES.iter().any(|crate_name| {
                import == crate_name || import.starts_with(&format!("{crate_name}-"))
            });
            assert!(!is_drawing, "{name} may not import {import}");
            let of_view = folder_of(import).is_some_and(|folder| {
                VIEW_FOLDERS.iter().any(|of_view| folder.starts_with(of_view))
            });
            let is_shared = SHARED_WITH_SITE.contains(&import.as_str());
            assert!(!of_view || is_shared, "{name} may not import {import} of the view");
        }
    }
    assert!(seen >= 8, "{seen} crates of the site are found");
}

#[test]
fn a_crate_is_named_after_its_folder() {
    for (name, package) in packages() {
        let folder = package.folder.file_name().and_then(|f| f.to_str()).expect("a folder name");
        let short = name.strip_prefix("busbar_").unwrap_or(&name);
        assert!(folder == name || folder == short || name == format!("busbar_plugin_{folder}"));
    }
}

#[test]
fn folders_of_plugins_hold_plugins_and_nothing_else() {
    let root = workspace_path("plugins").canonicalize().expect("it is there");
    let mut seen = BTreeSet::new();
    for (name, package) in packages() {
        let Ok(folder) = package.folder.strip_prefix(&root) else { continue };
        let subject = folder.iter().next().and_then(|part| part.to_str()).expect("a subject");
        assert_eq!(folder.iter().count(), 2, "{name}: plugins/SUBJECT/CRATE");
        let holds_plugins = PLUGIN_FOLDERS.contains(&subject);
        assert!(
            holds_plugins || LIBRARY_FOLDERS.contains(&subject),
            "plugins/{subject}: not known"
        );
        assert_eq!(package.is_plugin, holds_plugins, "{name} in plugins/{subject}");
        seen.insert(subject.to_owned());
    }
    assert_eq!(seen.len(), PLUGIN_FOLDERS.len() + LIBRARY_FOLDERS.len(), "{seen:?}");
}

#[test]
fn the_host_names_no_plugin() {
    let plugins: Vec<_> = packages()
        .into_iter()
        .filter(|(_, package)| {
            package.imports.iter().any(|(import, _)| import == "busbar_plugin_sdk")
        })
        .map(|(name, _)| name)
        .collect();
    assert!(plugins.contains(&"modbus_adapter".to_owned()), "{plugins:?}");
    let words = plugins.iter().map(String::as_str).chain(["modbus"]);
    let words: Vec<_> = words.map(str::to_lowercase).collect();
    for path in rust_files(&workspace_path("host")) {
        if is_test(&path) {
            continue;
        }
        let text = fs::read_to_string(&path).expect("sources are text").to_lowercase();
        let text = without_test_modules(&text);
        for word in &words {
            assert!(!text.contains(word), "{} names {word}", path.display());
        }
    }
}

/// Files in a folder of tests, or modules that are tests as a whole.
fn is_test(path: &Path) -> bool {
    path.components().any(|part| part.as_os_str() == "tests")
        || path.file_stem().and_then(|stem| stem.to_str()).is_some_and(|s| s.ends_with("tests"))
}

/// A source without what follows `#[cfg(test)]`, up to the end of that item.
fn without_test_modules(text: &str) -> String {
    let mut kept = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.trim() != "#[cfg(test)]" {
            kept += line;
            kept.push('\n');
            continue;
        }
        let indent = line.len() - line.trim_start().len();
        let is_end = |line: &&str| {
            line.len() - line.trim_start().len() == indent && (line.ends_with(['}', ';']))
        };
        lines.by_ref().find(is_end);
    }
    kept
}

#[test]
fn test_modules_are_cut_out() {
    let text = "a\n#[cfg(test)]\nmod tests {\n    modbus\n}\nb\n    #[cfg(test)]\n    mod m;\nc";
    assert_eq!(without_test_modules(text), "a\nb\nc\n");
}

#[test]
fn unsafe_code_is_where_it_must_be() {
    let roots = ["host", "plugins", "shaders", "tests"].map(workspace_path);
    let exempt = UNSAFE.map(workspace_path);
    let mut seen = 0;
    for path in roots.iter().flat_map(|root| rust_files(root)) {
        if exempt.iter().any(|folder| path.starts_with(folder)) {
            continue;
        }
        seen += 1;
        let text = fs::read_to_string(&path).expect("sources are text");
        let code = text.lines().map(|line| line.split("//").next().unwrap_or_default());
        let words = code.flat_map(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_'));
        // Within quotes it is a name here.
        let keyword = ["un", "safe"].concat();
        assert!(!words.into_iter().any(|word| word == keyword), "{}", path.display());
    }
    assert!(seen > 50, "{seen} sources looked at");
}

#[test]
fn links_of_documents_lead_somewhere() {
    for document in DOCUMENTS {
        let Ok(text) = fs::read_to_string(workspace_path(document)) else { continue };
        for link in links(&text) {
            let target = link.split('#').next().unwrap_or_default();
            let is_elsewhere = target.contains("://") || target.starts_with("mailto:");
            assert!(
                target.is_empty() || is_elsewhere || workspace_path(target).exists(),
                "{document} leads to {link}, which is not there"
            );
        }
    }
}

/// Targets of Markdown links and pictures: `](target)` and `src="target"`.
fn links(text: &str) -> impl Iterator<Item = &str> {
    let after = |start: &'static str, end: char| {
        text.split(start).skip(1).filter_map(move |rest| rest.split(end).next())
    };
    after("](", ')').chain(after("src=\"", '"')).chain(after("href=\"", '"'))
}

#[test]
fn links_are_found() {
    let text = "[a](b.md#c) ![d](e.png) <img src=\"f.png\"> [g](https://h.example)";
    assert_eq!(links(text).collect::<Vec<_>>(), ["b.md#c", "e.png", "https://h.example", "f.png"]);
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        if path.is_dir() && !path.ends_with("target") {
            found.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found
}
