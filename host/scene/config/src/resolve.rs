//! Valid raw values to the configuration that is used.

use std::collections::{BTreeMap, HashMap};

use busbar_types::ValueKind;
use serde::de::DeserializeOwned;
use serde_json::Value;
use serde_path_to_error::Segment;

use crate::Band;
use crate::changes::Fingerprints;
use crate::config::*;
use crate::durations::whole_millis;
use crate::model_scene::RawModelScene;
use crate::moving_parts::RawMovingPart;
use crate::plugins::SignatureConfig;
use crate::raw::*;
use crate::scene::SceneConfig;
use crate::service::RawMetrics;
use crate::view::{CameraConfig, ProjectionConfig, QualityConfig, SectionConfig, ViewConfig};
use crate::{Diagnostic, Positions, join_pointer};

/// A value that the schema accepts and the raw types refuse, such as `720.0`
/// for a whole number.
pub(crate) struct TypeMismatch {
    pub(crate) pointer: String,
    pub(crate) cause: String,
    pub(crate) remedy: String,
}

/// Reads raw values from a value that has been checked.
pub(crate) fn deserialize<T: DeserializeOwned>(value: Value) -> Result<T, TypeMismatch> {
    serde_path_to_error::deserialize(value).map_err(|error| {
        let pointer = error.path().iter().fold(String::new(), |pointer, segment| match segment {
            Segment::Seq { index } => join_pointer(&pointer, index),
            Segment::Map { key } => join_pointer(&pointer, key),
            Segment::Enum { .. } | Segment::Unknown => pointer,
        });
        let cause = error.into_inner().to_string();
        TypeMismatch {
            pointer,
            cause,
            remedy: "write a whole number without decimal point".to_owned(),
        }
    })
}

/// Turns a checked raw configuration into the one that is used.
pub(crate) fn resolve(raw: RawConfig, positions: Positions, warnings: Vec<Diagnostic>) -> Config {
    let kinds: HashMap<String, ValueKind> =
        raw.tags.iter().map(|(id, tag)| (id.clone(), tag.value_type)).collect();
    let kind = |tag: &str| kinds.get(tag).copied();
    Config {
        plugin_directories: indexed(
            raw.plugin_directories,
            "/plugin_directories",
            |path, pointer| DirectoryConfig { path, pointer },
        ),
        supervision: raw.supervision.resolve(),
        signature: raw.signature.map(|raw| SignatureConfig {
            public_key: raw.public_key,
            pointer: "/signature".to_owned(),
        }),
        plugins: named(raw.plugins, "/plugins", |_, plugin, pointer| {
            plugin.resolve(raw.isolation, pointer)
        }),
        models: named(raw.models, "/models", |_, raw, pointer| ModelConfig {
            file: raw.file,
            scene: raw.scene.map(RawModelScene::resolve),
            optimizer: raw.optimizer,
            theta: raw.theta.resolve(),
            moving_parts: indexed(
                raw.moving_parts,
                &join_pointer(&pointer, "moving_parts"),
                RawMovingPart::resolve,
            ),
            pointer,
        }),
        scene: SceneConfig::new(raw.scene, raw.templates),
        equipment: named(raw.equipment, "/equipment", |_, raw, pointer| raw.resolve(pointer)),
        tags: named(raw.tags, "/tags", tag),
        bindings: indexed(raw.bindings, "/bindings", |raw, pointer| BindingConfig {
            tag: raw.tag,
            node: raw.node,
            role: raw.role,
            pointer,
        }),
        alarms: named(raw.alarms, "/alarms", |_, raw, pointer| raw.resolve(pointer, kind)),
        alarm_handling: raw.alarm_handling.resolve(raw.alarm_sources),
        notifications: indexed(raw.notifications, "/notifications", |raw, pointer| {
            NotificationConfig { plugin: raw.instance, pointer }
        }),
        overlays: indexed(raw.overlays, "/overlays", |plugin, pointer| OverlayConfig {
            plugin,
            pointer,
        }),
        records: indexed(raw.records, "/records", |plugin, pointer| RecordsConfig {
            plugin,
            pointer,
        }),
        chart: raw.chart.map(|raw| ChartConfig {
            plugin: raw.instance,
            position: raw.position,
            yaw_degrees: raw.yaw_degrees,
            size: raw.size,
            follows: raw.follow,
            pointer: "/chart".to_owned(),
        }),
        cameras: named(raw.cameras, "/cameras", |_, raw, pointer| CameraConfig {
            eye: raw.eye,
            target: raw.target,
            fov_degrees: raw.fov_degrees,
            projection: match raw.projection {
                RawProjection::Perspective => ProjectionConfig::Perspective,
                RawProjection::Orthographic => {
                    ProjectionConfig::Orthographic { height: raw.height }
                }
            },
            pointer,
        }),
        view: view(raw.camera, raw.graphics, raw.theme, raw.window),
        cache: CacheConfig {
            directory: raw.cache.directory,
            max_megabytes: raw.cache.max_megabytes,
            pointer: "/cache".to_owned(),
        },
        log: raw.log.resolve(),
        metrics: raw.metrics.and_then(RawMetrics::resolve),
        fingerprints: Fingerprints::default(),
        positions,
        warnings,
    }
}

fn tag(id: &str, raw: RawTag, pointer: String) -> TagConfig {
    let range = Band { low: raw.range.low, high: raw.range.high };
    let limits = Band { low: raw.limits.low, high: raw.limits.high };
    TagConfig {
        name: raw.name.unwrap_or_else(|| id.to_owned()),
        value_type: raw.value_type,
        unit: raw.unit,
        range,
        limits,
        simulate: raw.simulate.resolve(raw.value_type, range, limits),
        freshness_millis: whole_millis(raw.freshness_seconds),
        scale: raw.scale.map(|scale| [scale.factor, scale.offset]),
        dead_band: raw.deadband,
        origin: match raw.set_by_host {
            true => OriginConfig::Host,
            false => origin(raw.source, raw.expression, &pointer),
        },
        pointer,
    }
}

/// The rules ensure that there is one of the two.
fn origin(source: Option<RawSource>, expression: Option<String>, pointer: &str) -> OriginConfig {
    match source {
        Some(RawSource { instance: plugin, address }) => {
            let pointer = join_pointer(pointer, "source");
            OriginConfig::Source(SourceConfig { plugin, address, pointer })
        }
        None => OriginConfig::Expression(expression.unwrap_or_default()),
    }
}

fn view(
    camera: RawCameraStart,
    graphics: RawGraphics,
    theme: RawTheme,
    window: RawWindow,
) -> ViewConfig {
    let quality = |quality| match quality {
        RawQuality::Low => QualityConfig::Low,
        RawQuality::Medium => QualityConfig::Medium,
        RawQuality::High => QualityConfig::High,
    };
    ViewConfig {
        camera: camera.start,
        background: colour(&theme.background),
        quality: graphics.quality.map(quality),
        samples: graphics.samples,
        ground: graphics.ground,
        fog: graphics.fog,
        section: camera.section.map(section),
        size: window.size,
        theta_scale: graphics.theta_scale,
        target_frame_millis: Some(graphics.target_frame_seconds * 1_000.0)
            .filter(|&target| target > 0.0),
        morph_seconds: graphics.morph_seconds,
        transition_seconds: camera.transition_seconds as f32,
        inertia: camera.inertia,
        theme: theme.colors,
        scale: theme.scale,
        font: theme.font,
        device: graphics.device,
    }
}

/// The rules ensure that the normal has a length.
fn section(RawSection { normal, distance }: RawSection) -> SectionConfig {
    let length = normal.iter().map(|part| part * part).sum::<f32>().sqrt();
    SectionConfig { normal: normal.map(|part| part / length.max(f32::MIN_POSITIVE)), distance }
}

/// The bytes of `#rrggbb`, a form that the schema ensures.
fn colour(text: &str) -> [u8; 3] {
    let digits = text.trim_start_matches('#');
    let value = u32::from_str_radix(digits, 16).unwrap_or_default();
    let [_, red, green, blue] = value.to_be_bytes();
    [red, green, blue]
}

fn named<R, C>(
    raw: BTreeMap<String, R>,
    pointer: &str,
    mut item: impl FnMut(&str, R, String) -> C,
) -> BTreeMap<String, C> {
    let items = raw.into_iter().map(|(name, raw)| {
        let pointer = join_pointer(pointer, &name);
        let config = item(&name, raw, pointer);
        (name, config)
    });
    items.collect()
}

fn indexed<R, C>(raw: Vec<R>, pointer: &str, mut item: impl FnMut(R, String) -> C) -> Vec<C> {
    let items = raw.into_iter().enumerate();
    items.map(|(index, raw)| item(raw, join_pointer(pointer, index))).collect()
}
