//! Link check: the sources of a configuration's tags, listened to for a while without a view.

use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

use busbar_config::TagConfig;
use busbar_plugin_host::LinkReport;
use busbar_plugin_process::{Plugin, RunningTelemetry};
use busbar_scene_loader::{
    DiagnosticsCollector, LoadError, config_folder, create_instances, read_config,
    report_plugin_error, source_policy, tag_specs, telemetry_tags,
};
use busbar_tags::{Moment, QualityCounts, Sample, TagTable};

/// Period at which samples are taken.
const PERIOD: Duration = Duration::from_millis(50);

/// Link of one plugin instance after it was listened to.
pub struct CheckedLink {
    /// The configuration's name of the instance.
    pub name: String,
    /// Link and clock of the source.
    pub link: LinkReport,
    /// Qualities of its tags at the end.
    pub quality: QualityCounts,
}

/// Starts every plugin instance that is the source of a tag, listens for a duration, and returns
/// the state of links and clocks. Only messages that reading requires are sent.
///
/// # Errors
/// Every fault of the configuration and of what it asks of plugins.
pub fn check_links(path: &Path, duration: Duration) -> Result<Vec<CheckedLink>, LoadError> {
    let config = read_config(path)?;
    let mut faults = DiagnosticsCollector::new(&config);
    let is_source = |name: &str| {
        config.tags.values().filter_map(TagConfig::source).any(|source| source.plugin == name)
    };
    let instances = create_instances(&config, &config_folder(path), &mut faults, &is_source);
    let specs = tag_specs(&config);
    let mut running = Vec::new();
    for (name, plugin) in &instances {
        let tags = telemetry_tags(&config, &specs, name);
        match RunningTelemetry::start(plugin, &tags, source_policy(&config, name)) {
            Ok(telemetry) => running.push((telemetry, tags)),
            Err(error) => {
                let pointer = config.plugins.get(name).map_or("", |plugin| &plugin.pointer);
                report_plugin_error(pointer, &error, &mut faults);
            }
        }
    }
    let faulty = |diagnostics| LoadError { file: path.to_owned(), diagnostics };
    let tags = busbar_tags::TagSet::new(specs);
    let (Ok(tags), true) = (tags, !faults.has_errors()) else {
        return Err(faulty(faults.found));
    };
    let mut table = TagTable::new(tags.into(), Moment::now());
    let end = Instant::now() + duration;
    while Instant::now() < end {
        thread::sleep(PERIOD.min(end.saturating_duration_since(Instant::now())));
        for (telemetry, _) in &running {
            telemetry.drain(&mut |sample: &Sample| {
                table.apply(sample, |_| {});
            });
        }
        table.advance(Moment::now(), |_| {});
    }
    let checked = running.iter().map(|(telemetry, tags)| {
        let mut counts = QualityCounts::default();
        for state in tags.iter().filter_map(|tag| table.snapshot().state(tag.tag)) {
            counts.add(state.quality);
        }
        CheckedLink { name: telemetry.name().to_owned(), link: telemetry.link(), quality: counts }
    });
    let checked = checked.collect();
    instances.values().for_each(Plugin::quit);
    Ok(checked)
}
