//! Untrusted glTF bytes to meshes, materials and nodes
