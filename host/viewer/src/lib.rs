//! The viewer: load, step a frame, pick, report
