//! Surroundings of a session: the way to dial, and the wall clock.

use std::sync::Arc;
use std::time::SystemTime;

use busbar_link::Dial;

/// Surroundings of a session: dialer and wall clock, replaced in tests.
#[derive(Clone)]
pub(crate) struct World {
    pub(crate) dial: Arc<dyn Dial>,
    pub(crate) wall_clock: fn() -> SystemTime,
}
