//! Exit codes of the program besides 0 for success.

/// Exit code of a fault of input or environment.
pub(crate) const EXIT_INPUT: u8 = 1;

/// Exit code of a fault of Busbar.
pub(crate) const EXIT_INTERNAL: u8 = 3;

/// Exit code of wrong use.
pub(crate) const EXIT_USAGE: u8 = 2;
