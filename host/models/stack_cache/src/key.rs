//! Cache keys: content hashes of a mesh and of the optimiser that collapses it.

use std::fmt;

use busbar_geometry::Mesh;
use twox_hash::XxHash3_128;

use crate::mesh_file::section_words;

/// Content hash of the optimiser: everything besides the mesh that decides a result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct OptimizerDigest([u64; 2]);

impl OptimizerDigest {
    /// Hashes all parts: the optimiser's code, version and settings.
    pub fn from_parts(parts: &[&[u8]]) -> Self {
        let digests: Vec<[u64; 3]> = parts.iter().map(|part| digest(part)).collect();
        let [_, low, high] = digest(bytemuck::cast_slice(&digests));
        Self([low, high])
    }

    /// Returns the digest extended by one more part.
    pub fn with_part(self, part: &[u8]) -> Self {
        Self::from_parts(&[bytemuck::cast_slice(&self.0), part])
    }
}

/// Content hash of a mesh and of the optimiser of its stacks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CacheKey(pub(crate) u128);

impl CacheKey {
    /// Hashes a mesh, every attribute of it, together with the optimiser's digest.
    pub fn new(mesh: &Mesh, optimizer: OptimizerDigest) -> Self {
        let sections: Vec<[u32; 4]> = mesh.sections.iter().map(section_words).collect();
        let (topology, attributes) = rayon::join(
            || {
                [
                    digest(bytemuck::cast_slice(&mesh.positions)),
                    digest(bytemuck::cast_slice(&mesh.features)),
                    digest(bytemuck::cast_slice(&mesh.triangles)),
                    digest(bytemuck::cast_slice(&sections)),
                ]
            },
            || {
                [
                    digest(bytemuck::cast_slice(&mesh.wedges.position)),
                    digest(bytemuck::cast_slice(&mesh.wedges.normal)),
                    digest(bytemuck::cast_slice(&mesh.wedges.uv)),
                    digest(bytemuck::cast_slice(&mesh.wedges.section)),
                ]
            },
        );
        let mut text: Vec<u64> = topology.into_iter().chain(attributes).flatten().collect();
        text.extend(optimizer.0);
        Self(XxHash3_128::oneshot(bytemuck::cast_slice(&text)))
    }
}

impl fmt::Display for CacheKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

/// Returns length and hash of an array, so that bytes cannot move from one to the next.
pub(crate) fn digest(bytes: &[u8]) -> [u64; 3] {
    let hash = XxHash3_128::oneshot(bytes);
    [bytes.len() as u64, hash as u64, (hash >> 64) as u64]
}
