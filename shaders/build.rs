//! Compiles each pass to SPIR-V, and generates assertions that the memory layouts of the Rust
//! structs match the shaders.

use std::error::Error;
use std::fmt::Write;
use std::path::Path;

use naga::back::spv;
use naga::valid::{Capabilities, ValidationFlags, Validator};

/// Sources prepended to every pass: WGSL has no include.
const COMMON: [&str; 2] = [FRAME, "common/highlight_pattern.wgsl"];
/// Source of the structs that all passes share.
const FRAME: &str = "common/frame.wgsl";

/// Unit vector towards the sun, world space, y up.
const SUN_DIRECTION: [f32; 3] = [0.3596, 0.7392, 0.5694];

/// Variants with and without shadows, and with and without a section plane, so that passes do
/// not pay for unused features.
const UNSHADOWED: &str = "common/unshadowed.wgsl";
const SHADOWED: &str = "common/shadowed.wgsl";
const WHOLE: &str = "common/whole.wgsl";
const SECTION: &str = "common/section.wgsl";
const SCREEN: &str = "common/screen.wgsl";

/// Source of each pass, name of its SPIR-V constant, and the sources it is combined with.
const PASSES: [(&str, &str, &[&str]); 24] = [
    ("scene/scene.wgsl", "SCENE", &[UNSHADOWED, WHOLE]),
    ("scene/scene.wgsl", "SCENE_SECTION", &[UNSHADOWED, SECTION]),
    ("scene/scene.wgsl", "SCENE_SHADOWED", &[SHADOWED, WHOLE]),
    ("scene/scene.wgsl", "SCENE_SHADOWED_SECTION", &[SHADOWED, SECTION]),
    ("low/low.wgsl", "LOW", &[WHOLE]),
    ("low/low.wgsl", "LOW_SECTION", &[SECTION]),
    ("ground/ground.wgsl", "GROUND", &[UNSHADOWED]),
    ("ground/ground.wgsl", "GROUND_SHADOWED", &[SHADOWED]),
    ("wireframe/wireframe.wgsl", "WIREFRAME", &[WHOLE]),
    ("wireframe/wireframe.wgsl", "WIREFRAME_SECTION", &[SECTION]),
    ("pick/pick.wgsl", "PICK", &[WHOLE]),
    ("pick/pick.wgsl", "PICK_SECTION", &[SECTION]),
    ("shadow/shadow.wgsl", "SHADOW", &[WHOLE]),
    ("shadow/shadow.wgsl", "SHADOW_SECTION", &[SECTION]),
    ("outline/mask.wgsl", "MASK", &[WHOLE]),
    ("outline/mask.wgsl", "MASK_SECTION", &[SECTION]),
    ("outline/outline.wgsl", "OUTLINE", &[SCREEN]),
    ("ambient_occlusion/ambient_occlusion.wgsl", "AMBIENT_OCCLUSION", &[SCREEN]),
    ("panels/panels.wgsl", "PANELS", &[]),
    ("morph/morph.wgsl", "MORPH", &[]),
    ("polylines/polylines.wgsl", "POLYLINES", &[]),
    ("density/density.wgsl", "DENSITY", &[]),
    ("density/rasterize.wgsl", "DENSITY_RASTERIZE", &[]),
    ("density/plane.wgsl", "DENSITY_PLANE", &[]),
];

/// Structs shared with Rust under the same name.
const SHARED_STRUCTS: [&str; 2] = ["FrameUniform", "MaterialUniform"];

/// Push-constant structs shared with Rust, with their pass.
const STEP_STRUCTS: [(&str, &str); 3] =
    [("MORPH", "MorphStep"), ("DENSITY", "DensityStep"), ("DENSITY_RASTERIZE", "RasterizeStep")];

/// Struct of the attributes of vertices and instances.
const VERTEX_INPUT: &str = "VertexInput";

fn main() {
    if let Err(error) = build() {
        // Cargo shows a build script's panic; its `Debug` would escape newlines.
        panic!("{error}");
    }
}

fn build() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    let [x, y, z] = SUN_DIRECTION;
    let sun = format!("const SUN_DIRECTION = vec3<f32>({x}, {y}, {z});\n");
    let mut words = format!(
        "/// Unit vector towards the sun, world space, y up.\n\
         pub const SUN_DIRECTION: [f32; 3] = {SUN_DIRECTION:?};\n"
    );
    let mut layouts = String::new();
    for (path, name, parts) in PASSES {
        let mut source = sun.clone();
        for part in COMMON.iter().chain(parts).chain([&path]) {
            println!("cargo::rerun-if-changed={part}");
            source.push_str(&std::fs::read_to_string(part)?);
        }
        let module = naga::front::wgsl::parse_str(&source)
            .map_err(|error| error.emit_to_string_with_path(&source, path))?;
        writeln!(
            words,
            "/// SPIR-V of `{path}` with {parts:?}.\npub static {name}: &[u32] = &{:?};",
            compile(&module)?
        )?;
        if layouts.is_empty() {
            layouts = assert_layouts(&module, &SHARED_STRUCTS)? + &assert_attributes(&module)?;
        }
        for (_, step) in STEP_STRUCTS.iter().filter(|(pass, _)| *pass == name) {
            layouts += &assert_layouts(&module, &[step])?;
        }
    }
    let out = std::env::var("OUT_DIR")?;
    std::fs::write(Path::new(&out).join("shaders.rs"), words)?;
    std::fs::write(Path::new(&out).join("layouts.rs"), layouts)?;
    Ok(())
}

fn compile(module: &naga::Module) -> Result<Vec<u32>, Box<dyn Error>> {
    let info = Validator::new(ValidationFlags::all(), Capabilities::IMMEDIATES).validate(module)?;
    let mut options = spv::Options { lang_version: (1, 3), ..Default::default() };
    // The projection already looks down Vulkan's y.
    options.flags.remove(spv::WriterFlags::ADJUST_COORDINATE_SPACE);
    Ok(spv::write_vec(module, &info, &options, None)?)
}

/// Locations and types of the vertex input, as constant assertions.
fn assert_attributes(module: &naga::Module) -> Result<String, Box<dyn Error>> {
    let mut text = String::from(
        "const _: () = { let all = [Vertex::ATTRIBUTES.as_slice(), Instance::ATTRIBUTES.as_slice()]; ",
    );
    let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(VERTEX_INPUT));
    let Some((_, naga::Type { inner: naga::TypeInner::Struct { members, .. }, .. })) = found else {
        return Err(format!("{FRAME} defines no struct {VERTEX_INPUT}").into());
    };
    for member in members {
        let Some(naga::Binding::Location { location, .. }) = member.binding else {
            return Err("a vertex input without location".into());
        };
        let naga::TypeInner::Vector { size: naga::VectorSize::Quad, scalar } =
            module.types[member.ty].inner
        else {
            return Err("a vertex input that is no vector of four".into());
        };
        let whole = scalar.kind != naga::ScalarKind::Float;
        writeln!(text, "assert!(has(all, {location}, {whole}));")?;
    }
    let count = members.len();
    writeln!(text, "assert!(all[0].len() + all[1].len() == {count}); }};")?;
    Ok(text)
}

/// Size and member offsets of the shared structs, as constant assertions.
fn assert_layouts(module: &naga::Module, structs: &[&str]) -> Result<String, Box<dyn Error>> {
    let mut text = String::new();
    for name in structs {
        let found = module.types.iter().find(|(_, t)| t.name.as_deref() == Some(*name));
        let Some((_, naga::Type { inner: naga::TypeInner::Struct { members, span }, .. })) = found
        else {
            return Err(format!("no shader defines a struct {name}").into());
        };
        writeln!(text, "const _: () = assert!(size_of::<{name}>() == {span});")?;
        for member in members {
            let field = member.name.as_deref().ok_or("a member without a name")?;
            let offset = member.offset;
            writeln!(
                text,
                "const _: () = assert!(std::mem::offset_of!({name}, {field}) == {offset});"
            )?;
        }
    }
    Ok(text)
}
