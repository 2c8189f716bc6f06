//! Conformance checker of plugins.
//!
//! [`check`] runs each case of a table in a child process of its own, with a time
//! limit and resource limits, and gathers what the cases found. The child calls
//! [`run_case`], which loads the library and does to it what a host, a careless
//! host and an unlucky host would do. A crash is a finding, not the checker's end.
//!
//! The child notes in a journal what it is about to call, so that a finding can say
//! in which function of the plugin a process died or hung.
//!
//! Invariant: no plugin code runs in the process that calls [`check`].
#![doc = include_str!("../DESIGN.md")]

mod calls;
mod cases;
mod environment;
mod fake_host;
mod fake_sink;
mod fake_streams;
mod finding;
mod journal;
mod library;
mod meshes;
mod probe;
mod report;
mod request;
mod schema;
mod supervise;
mod text;

pub use environment::heap_bytes;
pub use finding::Finding;
pub use report::{CaseResult, CaseVerdict, Report};
pub use request::{Options, RequestError, Sample, SampleTag};
pub use supervise::{CheckError, check, run_case};
