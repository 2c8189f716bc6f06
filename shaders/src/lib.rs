//! WGSL shaders, compiled and checked at build time
