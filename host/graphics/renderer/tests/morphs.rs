//! Geomorphs: meshes between two cursors.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

mod common;

use std::sync::Arc;

use busbar_geometry::{CollapseStacks, Mesh, RawPrimitive, weld};
use busbar_renderer::{
    DrawInstance, MAX_MORPHED_BYTES, MeshAtCursor, ModelHandle, Morph, OutlineKind, OutlinedObject,
    Picture, RenderError, Renderer, ResolveRequest,
};
use common::*;
use glam::{Mat4, Vec3};

const FINER: u32 = 40;
const COARSER: u32 = 130;

/// A bumpy sheet, so that no way is flat.
fn sheet() -> Mesh {
    let mut mesh = grid(12, None);
    for position in &mut mesh.positions {
        position.z = 0.3 * (7.0 * position.x).sin() * (5.0 * position.y).cos();
    }
    mesh
}

fn on_the_way(model: ModelHandle, weight: f32) -> DrawInstance {
    let morph = Some(Morph { coarser: COARSER, weight });
    DrawInstance { cursor: FINER, morph, ..instance(model, Mat4::IDENTITY, 1) }
}

fn at(model: ModelHandle, cursor: u32) -> DrawInstance {
    DrawInstance { cursor, ..instance(model, Mat4::IDENTITY, 1) }
}

/// Finer mesh with its vertices morphed on the CPU: reference of the compute pass.
fn bent(stacks: &CollapseStacks, weight: f32) -> Mesh {
    let wedges = &stacks.mesh().wedges;
    let standing = stacks.representative_wedges(COARSER);
    let ways = || standing.iter().enumerate().map(|(wedge, &to)| (wedge, to as usize));
    let position = |wedge: usize| stacks.mesh().positions[wedges.position[wedge] as usize];
    let primitive = RawPrimitive {
        positions: ways().map(|(from, to)| position(from).lerp(position(to), weight)).collect(),
        normals: ways().map(|(a, b)| wedges.normal[a].lerp(wedges.normal[b], weight)).collect(),
        uvs: ways().map(|(a, b)| wedges.uv[a].lerp(wedges.uv[b], weight)).collect(),
        triangles: stacks.resolve(FINER).triangles,
        ..Default::default()
    };
    weld(&[primitive]).unwrap().0
}

/// The greatest difference of a channel.
fn greatest(a: &Picture, b: &Picture) -> u8 {
    a.rgba8.iter().zip(&b.rgba8).map(|(a, b)| a.abs_diff(*b)).max().unwrap()
}

#[test]
fn a_way_begins_as_the_finer_mesh_and_ends_as_the_coarser() {
    with_each_quality(1, |renderer| {
        let model = upload(renderer, sheet(), &[], &[]);
        let finer = picture(renderer, &frame(&[at(model, FINER)]));
        let coarser = picture(renderer, &frame(&[at(model, COARSER)]));
        assert!(greatest(&finer, &coarser) > 60, "there is something to see");
        assert_eq!(picture(renderer, &frame(&[on_the_way(model, 0.0)])), finer);
        let arrived = picture(renderer, &frame(&[on_the_way(model, 1.0)]));
        assert!(greatest(&arrived, &coarser) <= 1, "{}", greatest(&arrived, &coarser));
        assert_eq!(picture(renderer, &frame(&[at(model, FINER)])), finer, "nothing is left");
    });
}

#[test]
fn between_them_it_is_drawn_as_its_twin() {
    with_renderer(4, |renderer| {
        let stacks: Arc<CollapseStacks> = stacks(sheet());
        let model = upload_all(renderer, &[Arc::clone(&stacks)], &[], &[]);
        for weight in [0.1, 0.5, 0.9] {
            let twin = upload(renderer, bent(&stacks, weight), &[], &[]);
            let expected = picture(renderer, &frame(&[at(twin, 0)]));
            let drawn = picture(renderer, &frame(&[on_the_way(model, weight)]));
            assert!(greatest(&drawn, &expected) <= 1, "{weight}: {}", greatest(&drawn, &expected));
        }
    });
}

#[test]
fn instances_go_their_own_way_and_share_it_where_they_are_equally_far() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, sheet(), &[], &[]);
        let moved = |x: f32, drawn: DrawInstance| {
            let scale = Mat4::from_scale(Vec3::splat(0.3));
            DrawInstance { world_from_mesh: Mat4::from_translation(Vec3::X * x) * scale, ..drawn }
        };
        let weights = [0.2, 0.7, 0.2];
        let drawn: Vec<_> =
            (0..3).map(|i| moved(i as f32 * 0.9 - 0.9, on_the_way(model, weights[i]))).collect();
        let stats = renderer.draw(&frame(&drawn)).unwrap();
        assert_eq!(stats.draw_calls, 2, "those that are equally far together");
        let together = renderer.read_picture().unwrap();
        // Each alone, put together by what lies over the background.
        let background = picture(renderer, &frame(&[]));
        let mut expected = background.clone();
        for single in &drawn {
            let alone = picture(renderer, &frame(&[*single]));
            for (at, pixel) in alone.rgba8.chunks_exact(4).enumerate() {
                if pixel != &background.rgba8[at * 4..at * 4 + 4] {
                    expected.rgba8[at * 4..at * 4 + 4].copy_from_slice(pixel);
                }
            }
        }
        assert_eq!(together, expected);
    });
}

#[test]
fn picks_and_outlines_follow_it() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, sheet(), &[], &[]);
        let outlined = [OutlinedObject { object: 1, kind: OutlineKind::Selected }];
        let mut shown = |drawn: DrawInstance| {
            let drawn = [drawn];
            let frame = busbar_renderer::Frame { outlined: &outlined, ..frame(&drawn) };
            (picture(renderer, &frame), renderer.pick_all(&frame).unwrap())
        };
        let (coarser, coarser_ids) = shown(at(model, COARSER));
        let (finer, finer_ids) = shown(at(model, FINER));
        let (arrived, arrived_ids) = shown(on_the_way(model, 1.0));
        assert!(finer != coarser && finer_ids != coarser_ids);
        assert!(greatest(&arrived, &coarser) <= 1);
        assert_eq!(arrived_ids, coarser_ids);
    });
}

#[test]
fn a_way_that_was_asked_for_is_there_in_time() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, sheet(), &[], &[]);
        let coarser = MeshAtCursor { model, mesh: 0, cursor: COARSER };
        assert!(!renderer.has_morph_target(&coarser));
        renderer.request([ResolveRequest::MorphTarget(coarser)].into_iter());
        let start = std::time::Instant::now();
        while !renderer.has_morph_target(&coarser) && start.elapsed().as_secs() < 10 {
            renderer.draw(&frame(&[at(model, FINER)])).unwrap();
        }
        assert!(renderer.has_morph_target(&coarser));
        let asked = picture(renderer, &frame(&[on_the_way(model, 0.5)]));
        renderer.free_memory().unwrap();
        assert!(!renderer.has_morph_target(&coarser), "given back");
        assert_eq!(picture(renderer, &frame(&[on_the_way(model, 0.5)])), asked);
        renderer.remove_model(model);
        assert!(!renderer.has_morph_target(&coarser));
    });
}

#[test]
fn what_is_on_its_way_is_bounded() {
    with_renderer(1, |renderer| {
        let model = upload(renderer, grid(420, None), &[], &[]);
        let bytes = 421 * 421 * busbar_renderer::VERTEX_BYTES;
        let most = MAX_MORPHED_BYTES / bytes;
        let on_ways = |count: u64| -> Vec<_> {
            (0..count).map(|i| on_the_way(model, (i + 1) as f32 / 100.0)).collect()
        };
        renderer.draw(&frame(&on_ways(most))).unwrap();
        let too_many = renderer.draw(&frame(&on_ways(most + 1)));
        assert!(
            matches!(too_many, Err(RenderError::TooMany { limit: MAX_MORPHED_BYTES, .. })),
            "{too_many:?}"
        );
        renderer.draw(&frame(&on_ways(1))).unwrap();
        // Those that are equally far take the room of one.
        renderer.draw(&frame(&vec![on_the_way(model, 0.5); 100])).unwrap();
    });
}

fn upload_all(
    renderer: &mut Renderer,
    stacks: &[Arc<CollapseStacks>],
    materials: &[busbar_scene::Material],
    textures: &[busbar_scene::Texture],
) -> ModelHandle {
    let upload = busbar_renderer::ModelUpload { stacks, materials, textures };
    renderer.upload_model(upload).unwrap()
}
