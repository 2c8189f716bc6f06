//! `busbar plugin new`.

use std::process::ExitCode;

use crate::arguments::PluginNewOptions;

pub(crate) fn run(options: &PluginNewOptions) -> anyhow::Result<ExitCode> {
    anyhow::bail!("{options:?}")
}
