//! Distinction of states without colour: all pairs of states of equipment, drawn by the renderer
//! and compared in grey.

use std::sync::Arc;

use busbar_geometry::{CollapseSequence, CollapseStacks, RawPrimitive, weld};
use busbar_plugin_host::{Catalog, Overlay};
use busbar_renderer::{
    CameraView, DrawInstance, Frame, ModelHandle, ModelUpload, OutlineKind, OutlinedObject,
    Picture, Quality, Renderer, RendererOptions,
};
use busbar_scene::Material;
use busbar_types::Pattern;
use busbar_viewer::highlight_styles::{self, Highlight};
use e2e::built_folder;
use glam::{Mat4, Vec3};
use serde_json::Value;
use substation::Station;

const SIZE: [u32; 2] = [128, 96];
/// Least visible difference of grey between neighbouring pixels, of 255.
const VISIBLE: f32 = 14.0;
/// Least share of a surface, or of the line around it, that differs between two states.
const MIN_SHARE: f32 = 0.15;
/// Number of pixels on both sides of a border that belong to it.
const BORDER: usize = 3;
/// Linear grey of bodies: paint and zinc, and brown porcelain.
const BODIES: [f32; 2] = [0.55, 0.06];
/// Marks of the gas analysis chart on abnormal equipment (`ChartState`).
const GAS_STATES: [(&str, [u8; 3], Pattern); 3] = [
    ("gas: watch", [176, 128, 0], Pattern::Dotted),
    ("gas: overheating", [214, 84, 16], Pattern::Striped),
    ("gas: discharges", [178, 16, 36], Pattern::Crossed),
];

/// States of equal meaning for different conditions: their severity, or that it is unknown. The
/// words beside them name the condition.
const SAME: [&[&str]; 4] = [
    &["warning", "attention", "general defect", "gas: watch"],
    &["SF6 low", "serious defect", "gas: overheating"],
    &["alarm", "critical defect", "lock-out", "gas: discharges"],
    &["not known", "energised: unknown"],
];

struct Appearance {
    name: String,
    highlight: Highlight,
    outline: Option<OutlineKind>,
}

/// Returns the legends of all overlays of the station, from their plugins as they are built.
fn legends() -> Vec<(String, Highlight)> {
    let station = Station::generate(1).expect("it is sound");
    let configuration = station.live_configuration(|switch| switch.closed);
    let catalog = Catalog::discover(&[built_folder()]);
    let temporary = tempfile::tempdir().expect("a folder");
    let folder = temporary.path().to_str().expect("UTF-8");
    let names = configuration["overlays"].as_array().expect("it has overlays");
    let legend = |name: &Value| {
        let name = name.as_str().expect("a name");
        let plugin = &configuration["plugins"][name];
        let id = plugin["plugin"].as_str().expect("a plugin");
        let settings = plugin.get("settings").cloned().unwrap_or_else(|| serde_json::json!({}));
        let settings = settings.to_string().replace("${folder}", folder);
        let settings = serde_json::from_str(&settings).expect("JSON");
        let overlay = catalog
            .create(name, id, &settings)
            .and_then(|instance| Overlay::configure(instance, Vec::new()))
            .unwrap_or_else(|fault| panic!("{fault}"));
        let entry = |entry: &busbar_plugin_host::LegendEntry| {
            (
                format!("{name}: {}", entry.name),
                highlight_styles::state_style(entry.color, entry.pattern),
            )
        };
        overlay.description().legend.iter().map(entry).collect::<Vec<_>>()
    };
    names.iter().flat_map(legend).collect()
}

/// Lists all tints; those of equal meaning under several names appear once.
fn tints() -> Vec<(String, Highlight)> {
    let own = highlight_styles::ALL.iter().map(|&(name, tint)| (name.to_owned(), tint));
    let gas = GAS_STATES.map(|(name, color, pattern)| {
        (name.to_owned(), highlight_styles::state_style(color, pattern))
    });
    let mut tints: Vec<(String, Highlight)> = Vec::new();
    for (name, tint) in own.chain(legends()).chain(gas) {
        match tints.iter_mut().find(|(_, known)| *known == tint) {
            Some((names, _)) => *names += &format!(" = {name}"),
            None => tints.push((name, tint)),
        }
    }
    tints
}

/// Lists each tint without an outline, under the pointer, and selected.
fn all_appearances() -> Vec<Appearance> {
    let outlines = [None, Some(OutlineKind::Hovered), Some(OutlineKind::Selected)];
    let with_outlines = |(name, highlight): (String, Highlight)| {
        outlines.map(|outline| Appearance {
            name: format!("{name}, {outline:?}"),
            highlight,
            outline,
        })
    };
    // What is selected shows no state, unless something is wrong with it.
    let with_selection = [
        highlight_styles::SELECTION,
        highlight_styles::WARNING,
        highlight_styles::ALARM,
        highlight_styles::UNKNOWN,
    ];
    let is_possible = |appearance: &Appearance| match appearance.outline {
        Some(OutlineKind::Selected) => with_selection.contains(&appearance.highlight),
        _ => appearance.highlight != highlight_styles::SELECTION,
    };
    tints().into_iter().flat_map(with_outlines).filter(is_possible).collect()
}

fn body(renderer: &mut Renderer, grey: f32) -> ModelHandle {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let square = RawPrimitive {
        positions: vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)],
        normals: vec![Vec3::Z; 4],
        uvs: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material: Some(0),
        ..RawPrimitive::default()
    };
    let (mesh, _) = weld(&[square]).expect("it is sound");
    let count = mesh.positions.len() as u32;
    let sequence = CollapseSequence::new(Vec::new(), count).expect("it is empty");
    let material = Material { base_color: [grey, grey, grey, 1.0], ..Material::default() };
    let stacks = [Arc::new(CollapseStacks::build(mesh, &sequence))];
    let upload = ModelUpload { stacks: &stacks, materials: &[material], textures: &[] };
    renderer.upload_model(upload).expect("it fits")
}

fn picture(
    renderer: &mut Renderer,
    model: ModelHandle,
    appearance: Option<&Appearance>,
) -> Picture {
    let instance = |appearance: &Appearance| DrawInstance {
        model,
        mesh: 0,
        cursor: 0,
        morph: None,
        world_from_mesh: Mat4::IDENTITY,
        object: 1,
        highlight: appearance.highlight,
        first_feature: None,
    };
    let drawn: Vec<DrawInstance> = appearance.into_iter().map(instance).collect();
    let outlined: Vec<OutlinedObject> = appearance
        .and_then(|appearance| appearance.outline)
        .map(|kind| OutlinedObject { object: 1, kind })
        .into_iter()
        .collect();
    let aspect = SIZE[0] as f32 / SIZE[1] as f32;
    let camera = CameraView::look_at(Vec3::Z * 4.0, Vec3::ZERO, Vec3::Y, 0.7, aspect, 0.1);
    let frame = Frame { background: [0.45; 3], outlined: &outlined, ..Frame::new(camera, &drawn) };
    renderer.draw(&frame).expect("it can be drawn");
    renderer.read_picture().expect("it was drawn")
}

/// Computes the luma (ITU-R BT.709) of each pixel.
fn grey(picture: &Picture) -> Vec<f32> {
    let luma =
        |p: &[u8]| 0.2126 * f32::from(p[0]) + 0.7152 * f32::from(p[1]) + 0.0722 * f32::from(p[2]);
    picture.rgba8.chunks_exact(4).map(luma).collect()
}

/// Returns the pixels well within the square, and those about its border.
fn regions(bare: &[f32], empty: &[f32]) -> [Vec<usize>; 2] {
    let [width, height] = SIZE.map(|side| side as usize);
    let is_shape = |x: usize, y: usize| (bare[y * width + x] - empty[y * width + x]).abs() > 1.0;
    let (mut within, mut border) = (Vec::new(), Vec::new());
    for y in BORDER..height - BORDER {
        for x in BORDER..width - BORDER {
            let near = (y - BORDER..=y + BORDER)
                .flat_map(|y| (x - BORDER..=x + BORDER).map(move |x| (x, y)));
            let count = near.filter(|&(x, y)| is_shape(x, y)).count();
            let all = (2 * BORDER + 1) * (2 * BORDER + 1);
            match count {
                0 => {}
                count if count == all => within.push(y * width + x),
                _ => border.push(y * width + x),
            }
        }
    }
    [within, border]
}

fn means_the_same(a: &Appearance, b: &Appearance) -> bool {
    let has = |words: &[&str], appearance: &Appearance| {
        words.iter().any(|word| appearance.name.contains(word))
    };
    a.outline == b.outline && SAME.iter().any(|words| has(words, a) && has(words, b))
}

fn differing(a: &[f32], b: &[f32], region: &[usize]) -> f32 {
    let differs = |&&at: &&usize| (a[at] - b[at]).abs() > VISIBLE;
    region.iter().filter(differs).count() as f32 / region.len() as f32
}

#[test]
fn all_pairs_of_states_are_told_apart_in_grey() {
    let looks = all_appearances();
    assert!(looks.len() >= 24, "{} looks", looks.len());
    let mut alike = Vec::new();
    for quality in [Quality::Low, Quality::High] {
        let options = RendererOptions { quality, validation: true, ..Default::default() };
        let mut renderer = Renderer::headless(options, SIZE).expect("there is a device");
        let log = renderer.validation_log();
        for body_grey in BODIES {
            let model = body(&mut renderer, body_grey);
            let empty = grey(&picture(&mut renderer, model, None));
            let pictures: Vec<Vec<f32>> = looks
                .iter()
                .map(|appearance| grey(&picture(&mut renderer, model, Some(appearance))))
                .collect();
            let regions = regions(&pictures[0], &empty);
            assert!(regions.iter().all(|region| region.len() > 500));
            for (index, a) in looks.iter().enumerate() {
                for (other, b) in looks.iter().enumerate().skip(index + 1) {
                    if means_the_same(a, b) {
                        continue;
                    }
                    let shares = regions
                        .each_ref()
                        .map(|region| differing(&pictures[index], &pictures[other], region));
                    if shares.iter().all(|&share| share < MIN_SHARE) {
                        alike.push(format!(
                            "{} and {} on {body_grey} at {quality:?}: {shares:.2?}",
                            a.name, b.name
                        ));
                    }
                }
            }
        }
        drop(renderer);
        assert_eq!(log.messages(), Vec::<String>::new());
    }
    assert!(alike.is_empty(), "{} pairs look alike:\n{}", alike.len(), alike.join("\n"));
}
