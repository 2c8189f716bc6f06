//! Subcommand `busbar optimize`: one model simplified by one plugin.

use std::process::ExitCode;

use busbar_commands::{OptimizeStats, OptimizedModel};

use crate::arguments::OptimizeOptions;
use crate::exit_codes::EXIT_INTERNAL;
use crate::{output, plugin};

pub(crate) fn run(options: &OptimizeOptions) -> anyhow::Result<ExitCode> {
    let directories = match options.plugin_directory.as_slice() {
        [] => plugin::default_directories()?,
        asked => asked.iter().map(std::path::absolute).collect::<Result<_, _>>()?,
    };
    let settings = options.set.iter().cloned().collect::<serde_json::Map<_, _>>().into();
    let bar = output::progress_bar();
    let model = OptimizedModel::build(
        &options.model,
        &directories,
        &options.plugin,
        &settings,
        &|done, total| output::show_progress(&bar, "collapse stacks", done, total),
    );
    let model = model.inspect_err(|_| bar.finish_and_clear())?;
    let mut stats = model.stats(options.theta);
    if options.round_trip > 0 {
        let total = options.round_trip as usize;
        let lossless = model.round_trip(options.round_trip, &|done| {
            output::show_progress(&bar, "round trips", done as usize, total);
        });
        stats.round_trips = options.round_trip;
        stats.lossless = Some(lossless);
    }
    bar.finish_and_clear();
    if let Some(path) = &options.out {
        output::write_file(path, &model.write(options.theta)?)?;
    }
    if let Some(path) = &options.stats {
        output::write_json(path, &stats)?;
    }
    summarise(&stats);
    if stats.lossless == Some(false) {
        output::line("error: a round trip did not give the imported bytes back");
        return Ok(ExitCode::from(EXIT_INTERNAL));
    }
    Ok(ExitCode::SUCCESS)
}

fn summarise(stats: &OptimizeStats) {
    let full = &stats.imported;
    output::result(&format!(
        "theta {}: {} of {} vertices, {} of {} triangles, {} of {} collapses done",
        stats.theta,
        stats.vertices,
        full.vertices,
        stats.triangles,
        full.triangles,
        stats.cursor,
        stats.collapses,
    ));
    if let Some(lossless) = stats.lossless {
        let verdict = if lossless { "identical" } else { "NOT identical" };
        output::result(&format!("{} round trips: every byte {verdict}", stats.round_trips));
    }
}
