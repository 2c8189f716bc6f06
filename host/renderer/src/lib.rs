//! Upload, draw and pick collapse-stacked meshes
