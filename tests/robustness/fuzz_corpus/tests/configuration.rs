//! Fuzzing of the configuration: any bytes are a usable configuration, or faults that each have a
//! place in the text, a cause and a remedy.

use std::collections::BTreeSet;

use busbar_config::{
    Config, Diagnostic, MAX_COORDINATE_METRES, MAX_DIAGNOSTICS, MAX_ERROR_PIXELS, MIN_ERROR_PIXELS,
    NodeConfig, OriginConfig, Severity, ThetaConfig, parse,
};

/// Runs one input; reports whether the configuration is accepted.
pub fn fuzz_one(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    match parse(text) {
        Ok(config) => {
            assert!(config.warnings.iter().all(|w| w.severity == Severity::Warning));
            check_diagnostics(&config.warnings, text);
            check_references(&config);
            check_numbers(&config);
            true
        }
        Err(diagnostics) => {
            assert!(diagnostics.iter().any(|d| d.severity == Severity::Error));
            check_diagnostics(&diagnostics, text);
            false
        }
    }
}

fn check_diagnostics(diagnostics: &[Diagnostic], text: &str) {
    assert!(diagnostics.len() <= MAX_DIAGNOSTICS + 1);
    let lines: Vec<_> = text.split('\n').collect();
    for diagnostic in diagnostics {
        let Diagnostic { line, column, cause, remedy, .. } = diagnostic;
        assert!(!cause.is_empty() && !remedy.is_empty(), "{diagnostic:?}");
        let found = (*line as usize).checked_sub(1).and_then(|index| lines.get(index));
        let columns = found.map(|line| line.chars().count() + 1);
        assert!(
            columns.is_some_and(|last| (1..=last).contains(&(*column as usize))),
            "{diagnostic:?}"
        );
    }
}

/// Checks that every name refers to an existing item.
fn check_references(config: &Config) {
    let mut ids = BTreeSet::new();
    let nodes: Vec<_> = config.scene.iter().collect();
    for (index, node) in nodes.iter().enumerate() {
        let NodeConfig { id, parent, model, .. } = node;
        assert!(!id.is_empty() && ids.insert(id), "'{id}' is there twice");
        assert!(parent.is_none_or(|parent| parent < index));
        assert!(model.as_ref().is_none_or(|model| config.models.contains_key(model)));
    }
    let plugin = |name: &String| assert!(config.plugins.contains_key(name), "no plugin '{name}'");
    config.models.values().filter_map(|model| model.optimizer.as_ref()).for_each(plugin);
    config.overlays.iter().map(|overlay| &overlay.plugin).for_each(plugin);
    for tag in config.tags.values() {
        match &tag.origin {
            OriginConfig::Source(source) => plugin(&source.plugin),
            OriginConfig::Expression(expression) => assert!(!expression.is_empty()),
            OriginConfig::Host => {}
        }
    }
    for binding in &config.bindings {
        assert!(config.tags.contains_key(&binding.tag), "no tag '{}'", binding.tag);
        let owner = ids.iter().any(|id| {
            let rest = binding.node.strip_prefix(id.as_str());
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
        });
        assert!(owner, "no node '{}'", binding.node);
    }
    assert!(config.view.camera.as_ref().is_none_or(|name| config.cameras.contains_key(name)));
}

/// Checks that numbers are within the limits of the program.
fn check_numbers(config: &Config) {
    let is_near =
        |metres: &f64| metres.is_finite() && metres.abs() <= f64::from(MAX_COORDINATE_METRES);
    for node in config.scene.iter() {
        let transform = &node.transform;
        assert!(transform.translation.iter().all(is_near), "{transform:?}");
        assert!(transform.rotation_degrees.iter().all(|degrees| degrees.is_finite()));
        assert!(transform.scale.iter().all(|scale| scale.is_finite() && *scale != 0.0));
        node.theta.iter().for_each(check_theta);
    }
    config.models.values().for_each(|model| check_theta(&model.theta));
    for tag in config.tags.values() {
        for band in [tag.range, tag.limits] {
            assert!(band.low.zip(band.high).is_none_or(|(low, high)| low < high), "{band:?}");
            assert!(band.low.into_iter().chain(band.high).all(f64::is_finite));
        }
        assert!(tag.freshness_millis > 0 && tag.dead_band >= 0.0);
        assert!(tag.scale.is_none_or(|[factor, offset]| {
            factor.is_finite() && factor != 0.0 && offset.is_finite()
        }));
    }
    for camera in config.cameras.values() {
        assert!(
            camera.eye != camera.target && camera.eye.iter().chain(&camera.target).all(is_near)
        );
        assert!(camera.fov_degrees > 0.0 && camera.fov_degrees < 180.0);
    }
    assert!(config.view.size.iter().all(|pixels| *pixels > 0));
    assert!(
        config.view.target_frame_millis.is_none_or(|target| target > 0.0 && target.is_finite())
    );
}

fn check_theta(theta: &ThetaConfig) {
    let is_share = |theta: f64| (0.0..=1.0).contains(&theta);
    match theta {
        ThetaConfig::Fixed(theta) => assert!(is_share(*theta)),
        ThetaConfig::Distance { levels, hysteresis } => {
            assert!(is_share(*hysteresis) && levels.iter().all(|level| is_share(level.theta)));
            assert!(levels.first().is_some_and(|level| level.beyond == 0.0));
            assert!(levels.is_sorted_by(|a, b| a.beyond < b.beyond && a.theta <= b.theta));
        }
        ThetaConfig::ScreenError { max_pixels, hysteresis } => {
            assert!((MIN_ERROR_PIXELS..=MAX_ERROR_PIXELS).contains(max_pixels));
            assert!(is_share(*hysteresis));
        }
    }
}

#[test]
fn kept_inputs_and_mutations_of_them() {
    fuzz_corpus::check("configuration", fuzz_one);
}
