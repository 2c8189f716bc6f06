//! Tests of cameras, and of steering them.

use busbar_lod::LodCamera;

use super::*;

fn screen() -> Rect {
    Rect::from_min_size(Pos2::ZERO, egui::vec2(800.0, 600.0))
}

fn view(camera: &Camera) -> CameraView {
    camera.view(screen(), screen(), None)
}

fn config(projection: ProjectionConfig) -> CameraConfig {
    CameraConfig {
        eye: [12.0, 6.0, 14.0],
        target: [0.0, 3.0, 0.0],
        fov_degrees: 45.0,
        projection,
        pointer: String::new(),
    }
}

#[test]
fn a_configured_eye_and_target_are_recovered() {
    let config = config(ProjectionConfig::Perspective);
    let camera = Camera::from_config(&config, &SceneGraph::default());
    assert!((view(&camera).eye - glam::DVec3::from(config.eye).as_vec3()).length() < 1e-4);
}

#[test]
fn a_configured_height_fills_the_picture_independent_of_depth() {
    let config = config(ProjectionConfig::Orthographic { height: Some(10.0) });
    let camera = Camera::from_config(&config, &SceneGraph::default());
    let wide = Rect::from_min_size(Pos2::ZERO, egui::vec2(1600.0, 900.0));
    let around = Some(Bounds { min: Vec3::splat(-50.0), max: Vec3::splat(50.0) });
    let view = camera.view(wide, wide, around);
    let projection = Projection::new(&view, wide);
    let (back, _, up) = camera.axes();
    for depth in [-40.0, 0.0, 40.0] {
        let at = camera.target + back * depth;
        let [low, high] = [-5.0, 5.0].map(|y| projection.to_screen(at + up * y).unwrap());
        assert!((low.y - 900.0).abs() < 0.1 && high.y.abs() < 0.1, "{low:?} {high:?}");
        let clip = view.clip_from_world() * at.extend(1.0);
        assert!((0.0..1.0).contains(&clip.z), "{depth} m is within the depth range");
    }
    let PixelSize::Metres(pixel) = camera.pixel_size(wide.size()) else {
        panic!("a pixel's size does not depend on the distance")
    };
    assert!((pixel - 10.0 / 900.0).abs() < 1e-6);
}

#[test]
fn the_target_is_in_the_middle_of_the_viewport() {
    let bounds = Bounds { min: Vec3::splat(-1.0), max: Vec3::splat(3.0) };
    let mut camera = Camera::framing(Some(bounds));
    let viewport = Rect::from_min_max(pos2(400.0, 0.0), pos2(800.0, 580.0));
    for projection_mode in [ProjectionMode::Perspective, ProjectionMode::Orthographic] {
        camera.projection_mode = projection_mode;
        camera.frame(Some(bounds));
        let view = camera.view(viewport, screen(), Some(bounds));
        let projection = Projection::new(&view, screen());
        let middle = projection.to_screen(Vec3::splat(1.0)).unwrap();
        assert!(middle.distance(viewport.center()) < 0.01, "{middle:?}");
        for corner in bounds.corners() {
            assert!(viewport.contains(projection.to_screen(corner).unwrap()));
        }
    }
}

#[test]
fn nothing_a_pixel_large_is_seen_larger_than_that() {
    let mut camera = Camera::framing(None);
    for projection_mode in [ProjectionMode::Perspective, ProjectionMode::Orthographic] {
        camera.projection_mode = projection_mode;
        let projection = Projection::new(&view(&camera), screen());
        let (back, right, up) = camera.axes();
        for (x, y) in [(0.0, 0.0), (0.7, 0.0), (0.7, 0.4), (-0.5, -0.35)] {
            let at = camera.eye() + 20.0 * (right * x + up * y - back).normalize();
            let pixel = camera.pixel_size(screen().size());
            let eye = LodCamera { position: camera.eye(), ahead: camera.forward(), pixel };
            let size = eye.pixel_at(&Bounds { min: at, max: at }, 20.0);
            let [from, to] = [at, at + right * size].map(|p| projection.to_screen(p).unwrap());
            let apart = from.distance(to);
            assert!(apart <= 1.0 + 2e-3 && apart > 0.5, "{apart} at {x}, {y}");
        }
    }
}

#[test]
fn panning_keeps_the_point_under_the_pointer() {
    let mut camera = Camera::framing(None);
    for projection_mode in [ProjectionMode::Perspective, ProjectionMode::Orthographic] {
        camera.projection_mode = projection_mode;
        let at = |camera: &Camera| {
            Projection::new(&view(camera), screen()).to_screen(camera.target).unwrap()
        };
        let target = camera.target;
        let before = at(&camera);
        camera.pan(egui::vec2(30.0, -20.0), screen().size());
        let after = Projection::new(&view(&camera), screen()).to_screen(target).unwrap();
        let moved = after - before;
        assert!((moved - egui::vec2(30.0, -20.0)).length() < 0.5, "{moved:?}");
    }
}

#[test]
fn points_behind_the_camera_have_no_screen_position() {
    let camera = Camera::framing(None);
    let view = view(&camera);
    let behind = view.eye + camera.direction();
    assert_eq!(Projection::new(&view, screen()).to_screen(behind), None);
}

#[test]
fn looking_straight_down_has_a_right_and_an_up() {
    let mut camera = Camera::framing(None);
    (camera.yaw, camera.pitch) = (0.0, std::f32::consts::FRAC_PI_2);
    for projection_mode in [ProjectionMode::Perspective, ProjectionMode::Orthographic] {
        camera.projection_mode = projection_mode;
        let projection = Projection::new(&view(&camera), screen());
        let middle = projection.to_screen(camera.target).unwrap();
        let right = projection.to_screen(camera.target + Vec3::X).unwrap() - middle;
        let north = projection.to_screen(camera.target - Vec3::Z).unwrap() - middle;
        assert!(right.x > 1.0 && right.y.abs() < 0.01, "{right:?}");
        assert!(north.y < -1.0 && north.x.abs() < 0.01, "{north:?}");
    }
}
