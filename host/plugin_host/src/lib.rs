//! Plugin discovery, ABI check, lifecycle and capabilities
