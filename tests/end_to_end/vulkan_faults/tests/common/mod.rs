//! A short scene, the program that shows it, and the faults that strike it.
#![allow(dead_code, reason = "each test program uses its part of it")]

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;
use std::process::Command;

use busbar_geometry::{RawPrimitive, weld};
use busbar_gltf_export::write_glb;
use busbar_scene::{AlphaMode, Material, Model, ModelNode, Texture, TextureRef, Wrap};
use e2e::{built, built_folder, busbar};
use glam::{DMat4, Vec2, Vec3};
use serde_json::{Value, json};
use tempfile::TempDir;
use vulkan_faults::{
    AS_CARD_VARIABLE, CALLS_VARIABLE, FAULT_VARIABLE, STRUCK_VARIABLE, VulkanFault, codes_of,
    install,
};

/// Environment variable with the number of faults, or "all".
const COUNT_VARIABLE: &str = "BUSBAR_VULKAN_FAULTS";
/// Environment variable with the seed of the random sample of faults.
const SEED_VARIABLE: &str = "BUSBAR_VULKAN_SEED";
const DEFAULT_SEED: u64 = 7;

/// Scene under test in a folder of its own.
pub(crate) struct Subject {
    pub(crate) folder: TempDir,
    /// Flag that makes devices report a graphics card.
    pub(crate) as_card: bool,
}

impl Subject {
    pub(crate) fn new(size: [u32; 2]) -> Self {
        Self::with_view(json!({ "window": { "size": size }, "graphics": { "samples": 4 } }))
    }

    /// Creates a scene with these sections of its configuration; the camera is its own.
    pub(crate) fn with_view(view: Value) -> Self {
        Self::with_sheets(view, 0)
    }

    /// Creates a scene with additional sheets in front, of some thousand triangles each.
    pub(crate) fn with_sheets(mut view: Value, sheets: usize) -> Self {
        view["camera"]["start"] = "front".into();
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let file = write_glb(&model()).expect("it can be written");
        let write = |name: &str, bytes: &[u8]| {
            fs::write(folder.path().join(name), bytes).expect("the folder can be written");
        };
        write("model.glb", &file);
        let mut models = json!({ "quads": { "file": "model.glb" } });
        let mut scene = vec![json!({ "id": "=Q1", "model": "quads" })];
        if sheets > 0 {
            write("sheet.glb", &write_glb(&sheet()).expect("it can be written"));
            models["sheet"] = json!({ "file": "sheet.glb" });
        }
        scene.extend((0..sheets).map(|number| {
            // Below the way from the eye to the quads, along all of it.
            let way = 0.3 + 0.4 * number as f64 / sheets as f64;
            let aside = 0.15 * (number % 7) as f64 - 0.45;
            let at = [0.4 - 0.4 * way + aside * way, 0.7 - 1.7 * way, 4.0 - 4.0 * way];
            let transform = json!({ "translation": at, "scale": 0.3 });
            json!({ "id": format!("sheet {number}"), "model": "sheet", "transform": transform })
        }));
        let mut config = json!({
            "version": 1,
            "models": models,
            "scene": scene,
            "cameras": { "front": { "eye": [0.4, 0.7, 4.0], "target": [0.0, 0.0, 0.0],
                "fov_degrees": 40.0 } },
            "cache": { "directory": "cache" },
        });
        for (section, members) in view.as_object().expect("an object") {
            config[section] = members.clone();
        }
        write("scene.json", config.to_string().as_bytes());
        Self { folder, as_card: false }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the command `busbar` with these words, the scene after the first, through the layer;
    /// no fault is set.
    pub(crate) fn command(&self, verb: &str, words: &[&str]) -> Command {
        // Every run compiles its pipelines.
        let _ = fs::remove_dir_all(self.path("cache"));
        let _ = fs::remove_file(self.path("struck"));
        let mut command = busbar();
        command.arg(verb).arg(self.path("scene.json")).args(words).arg("--validation");
        let library = built(built_folder().join("libvulkan_faults.so"));
        install(&mut command, &library, self.folder.path()).expect("the folder can be written");
        if self.as_card {
            command.env(AS_CARD_VARIABLE, "1");
        }
        command
    }

    /// Makes a run count its calls.
    pub(crate) fn count(&self, command: &mut Command) {
        let _ = fs::remove_file(self.path("calls"));
        command.env(CALLS_VARIABLE, self.path("calls"));
    }

    /// Returns the commands that the counting run called, in order.
    pub(crate) fn calls(&self) -> Vec<String> {
        let text = fs::read_to_string(self.path("calls")).expect("the layer writes its calls");
        text.lines().map(str::to_owned).collect()
    }

    pub(crate) fn strike(&self, command: &mut Command, fault: &VulkanFault) {
        command.env(FAULT_VARIABLE, fault.text()).env(STRUCK_VARIABLE, self.path("struck"));
    }

    pub(crate) fn was_struck(&self) -> bool {
        self.path("struck").exists()
    }
}

/// Lists every call with every code that it may return.
pub(crate) fn faults_of(calls: &[String]) -> Vec<VulkanFault> {
    let mut seen: BTreeMap<&str, u32> = BTreeMap::new();
    let mut faults = Vec::new();
    for command in calls {
        let call = seen.entry(command).or_default();
        for &code in codes_of(command) {
            faults.push(VulkanFault { command: command.clone(), call: *call, code });
        }
        *call += 1;
    }
    faults
}

/// Draws a sample of faults: one of each command and code first, `count` in all. The environment
/// may ask for another number, or for all.
pub(crate) fn sample(mut faults: Vec<VulkanFault>, count: usize) -> Vec<VulkanFault> {
    let asked = std::env::var(COUNT_VARIABLE).ok();
    if asked.as_deref() == Some("all") {
        return faults;
    }
    let count = asked.and_then(|asked| asked.parse().ok()).unwrap_or(count);
    let seed = std::env::var(SEED_VARIABLE).ok().and_then(|seed| seed.parse().ok());
    let mut random = fastrand::Rng::with_seed(seed.unwrap_or(DEFAULT_SEED));
    random.shuffle(&mut faults);
    let mut kinds = std::collections::BTreeSet::new();
    let (first, rest): (Vec<_>, Vec<_>) =
        faults.into_iter().partition(|fault| kinds.insert((fault.command.clone(), fault.code)));
    first.into_iter().chain(rest).take(count).collect()
}

/// Reports whether rendering is impossible after the fault, since no driver answers at the start.
pub(crate) fn is_final(fault: &VulkanFault) -> bool {
    const INITIALIZATION_FAILED: i32 = -3;
    const EXTENSION_NOT_PRESENT: i32 = -7;
    const INCOMPATIBLE_DRIVER: i32 = -9;
    match fault.command.as_str() {
        "vkCreateInstance" => matches!(
            fault.code,
            INITIALIZATION_FAILED | EXTENSION_NOT_PRESENT | INCOMPATIBLE_DRIVER
        ),
        "vkEnumeratePhysicalDevices" => fault.code == INITIALIZATION_FAILED,
        _ => false,
    }
}

/// Quads one behind the other: textured, see-through, plain; and one more plain mesh.
fn model() -> Model {
    let quads = [quad(0, 0.0), quad(1, 0.6), quad(2, -0.6)];
    let texture = TextureRef { texture: 0, wrap: [Wrap::Repeat; 2] };
    let checks = (0..64_u32).flat_map(|i| {
        let light = (i % 8 + i / 8).is_multiple_of(2);
        if light { [220, 210, 190, 255] } else { [60, 70, 90, 255] }
    });
    let glass = Material {
        alpha: AlphaMode::Blend,
        base_color: [0.3, 0.6, 0.7, 0.4],
        ..Material::default()
    };
    Model {
        meshes: [&quads[..], &[quad(2, -0.9)]]
            .map(|quads| weld(quads).expect("its points are finite").0)
            .into(),
        materials: vec![
            Material { base_color_texture: Some(texture), ..Material::default() },
            glass,
            Material { base_color: [0.5, 0.45, 0.4, 1.0], ..Material::default() },
        ],
        textures: vec![Texture { width: 8, height: 8, rgba8: checks.collect() }],
        nodes: [("quads", 0), ("quad behind", 1)]
            .map(|(name, mesh)| ModelNode {
                name: name.into(),
                parent: None,
                parent_from_node: DMat4::IDENTITY,
                mesh: Some(mesh),
            })
            .into(),
        ..Model::default()
    }
}

/// Builds a sheet of 2,048 triangles.
fn sheet() -> Model {
    const SIDE: u32 = 32;
    let point = |number: u32| {
        let [x, y] = [number % (SIDE + 1), number / (SIDE + 1)].map(|at| at as f32 / SIDE as f32);
        Vec3::new(x - 0.5, y - 0.5, 0.1 * (x * 9.0).sin())
    };
    let cells = (0..SIDE * SIDE).map(|cell| cell % SIDE + cell / SIDE * (SIDE + 1));
    let sheet = RawPrimitive {
        positions: (0..(SIDE + 1).pow(2)).map(point).collect(),
        triangles: cells
            .flat_map(|a| [[a, a + 1, a + SIDE + 2], [a, a + SIDE + 2, a + SIDE + 1]])
            .collect(),
        ..RawPrimitive::default()
    };
    Model {
        meshes: vec![weld(&[sheet]).expect("its points are finite").0],
        nodes: vec![ModelNode {
            name: "sheet".into(),
            parent: None,
            parent_from_node: DMat4::IDENTITY,
            mesh: Some(0),
        }],
        ..Model::default()
    }
}

fn quad(material: u32, depth: f32) -> RawPrimitive {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let size = 1.0 - depth * 0.5;
    RawPrimitive {
        positions: corners.map(|(x, y)| Vec3::new(x * size, y * size, depth)).to_vec(),
        normals: vec![Vec3::Z; 4],
        uvs: corners.map(|(x, y)| Vec2::new(x, y)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(material),
        ..RawPrimitive::default()
    }
}
