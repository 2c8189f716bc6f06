//! Fault plan of a process, and the record of calls.

use std::collections::HashMap;
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;
use std::sync::{Mutex, OnceLock, PoisonError};

use anyhow::{Context, Result, ensure};

use crate::codes::{Code, codes_of};

/// Environment variable with the call that fails: see [`VulkanFault`]'s text.
pub const FAULT_VARIABLE: &str = "BUSBAR_VULKAN_FAULT";
/// Environment variable with the file that gets the name of each call, a line each.
pub const CALLS_VARIABLE: &str = "BUSBAR_VULKAN_CALLS";
/// Environment variable with the file that is made when the fault strikes.
pub const STRUCK_VARIABLE: &str = "BUSBAR_VULKAN_STRUCK";

/// Fault of one Vulkan call.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VulkanFault {
    /// Name of the command, such as `vkCreateBuffer`.
    pub command: String,
    /// Zero-based index among the calls of this command in the process.
    pub call: u32,
    /// Result code that the call returns.
    pub code: Code,
}

impl VulkanFault {
    /// Formats the fault as `command:call:code`, for [`FAULT_VARIABLE`].
    pub fn text(&self) -> String {
        format!("{}:{}:{}", self.command, self.call, self.code)
    }

    /// Parses the text that [`VulkanFault::text`] wrote.
    ///
    /// # Errors
    /// When it is no such text, or the command never gives that code.
    pub fn parse(text: &str) -> Result<Self> {
        let mut parts = text.splitn(3, ':');
        let mut next = || parts.next().context("a fault is command:call:code");
        let fault = Self {
            command: next()?.to_owned(),
            call: next()?.parse().context("which call is a number from 0")?,
            code: next()?.parse().context("a code is a number")?,
        };
        let legal = codes_of(&fault.command).contains(&fault.code);
        ensure!(legal, "{} never gives {}", fault.command, fault.code);
        Ok(fault)
    }
}

#[derive(Default)]
struct Calls(HashMap<&'static str, u32>);

/// Counts a call; returns the code with which it is to fail, if it is.
pub(crate) fn count(command: &'static str) -> Option<Code> {
    static CALLS: OnceLock<Mutex<Calls>> = OnceLock::new();
    let mut calls =
        CALLS.get_or_init(Mutex::default).lock().unwrap_or_else(PoisonError::into_inner);
    append(CALLS_VARIABLE, command);
    let seen = calls.0.entry(command).or_default();
    let call = *seen;
    *seen += 1;
    let fault = planned()?;
    if fault.command != command || fault.call != call {
        return None;
    }
    append(STRUCK_VARIABLE, &fault.text());
    Some(fault.code)
}

fn planned() -> Option<&'static VulkanFault> {
    static FAULT: OnceLock<Option<VulkanFault>> = OnceLock::new();
    let read = || {
        // The loader takes the layer out and in again between instances, and a
        // fault strikes once.
        let struck = std::env::var_os(STRUCK_VARIABLE).is_some_and(|f| Path::new(&f).exists());
        let text = std::env::var(FAULT_VARIABLE).ok().filter(|_| !struck)?;
        VulkanFault::parse(&text).ok()
    };
    FAULT.get_or_init(read).as_ref()
}

/// Appends a line to the file that a variable names. A file that cannot be written stays empty,
/// which the test notices.
fn append(variable: &str, line: &str) {
    let Some(path) = std::env::var_os(variable) else { return };
    if let Ok(mut file) = OpenOptions::new().create(true).append(true).open(path) {
        let _ = writeln!(file, "{line}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_is_read_as_it_was_written() {
        let fault = VulkanFault { command: "vkCreateBuffer".into(), call: 3, code: -2 };
        assert_eq!(VulkanFault::parse(&fault.text()).ok(), Some(fault));
        for wrong in ["", "vkCreateBuffer", "vkCreateBuffer:x:-2", "vkCreateBuffer:0:-4", "vk:0:-1"]
        {
            assert!(VulkanFault::parse(wrong).is_err(), "{wrong}");
        }
    }
}
