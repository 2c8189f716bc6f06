//! The C ABI between host and plugins
