//! Models to GLB bytes.
