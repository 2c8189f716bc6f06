//! Shared memory for what is too large for messages: rings and meshes.
//!
//! The host makes all of it and seals its size, so that no plugin's process can
//! cut it short under the host. Meshes are written and read by calls, not
//! mapped: what the other side changes afterwards changes no copy.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::FileExt;

use busbar_geometry::{Collapse, Mesh, Wedges};
use busbar_protocol::memory::create;
pub(crate) use busbar_protocol::memory::zeroed;
use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};
use rustix::fs::{SealFlags, fcntl_add_seals};
use serde::{Deserialize, Serialize};

/// Sizes of a mesh as an optimiser gets it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct MeshSizes {
    positions: u32,
    wedges: u32,
    triangles: u32,
}

/// A collapse as it lies in shared memory.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct RawCollapse {
    removed: u32,
    kept: u32,
    error: f32,
}

/// Room for the collapses of a mesh.
pub(crate) fn room_for_collapses(mesh: &Mesh) -> io::Result<File> {
    zeroed("collapses", (mesh.positions.len() * size_of::<RawCollapse>()) as u64)
}

/// A mesh in memory that nobody can change.
pub(crate) fn write_mesh(mesh: &Mesh) -> io::Result<(MeshSizes, File)> {
    let mut memory = create("mesh")?;
    write(&mut memory, &mesh.positions)?;
    write(&mut memory, &mesh.wedges.position)?;
    write(&mut memory, &mesh.wedges.normal)?;
    write(&mut memory, &mesh.wedges.uv)?;
    write(&mut memory, &mesh.wedges.section)?;
    write(&mut memory, &mesh.triangles)?;
    let all = SealFlags::SHRINK | SealFlags::GROW | SealFlags::WRITE | SealFlags::SEAL;
    fcntl_add_seals(&memory, all)?;
    let sizes = MeshSizes {
        positions: mesh.positions.len() as u32,
        wedges: mesh.wedges.len() as u32,
        triangles: mesh.triangles.len() as u32,
    };
    Ok((sizes, memory))
}

/// The mesh that [`write_mesh`] wrote, without what no optimiser sees: its
/// sections and features.
pub(crate) fn read_mesh(sizes: MeshSizes, memory: &File) -> io::Result<Mesh> {
    let mut reader = Reader { memory, offset: 0 };
    Ok(Mesh {
        positions: reader.read(sizes.positions)?,
        wedges: Wedges {
            position: reader.read(sizes.wedges)?,
            normal: reader.read(sizes.wedges)?,
            uv: reader.read(sizes.wedges)?,
            section: reader.read(sizes.wedges)?,
        },
        triangles: reader.read(sizes.triangles)?,
        ..Mesh::default()
    })
}

/// Puts collapses into the room made for them.
pub(crate) fn write_collapses(collapses: &[Collapse], memory: &File) -> io::Result<()> {
    let raw = |c: &Collapse| RawCollapse { removed: c.removed, kept: c.kept, error: c.error };
    let raw: Vec<_> = collapses.iter().map(raw).collect();
    memory.write_all_at(bytemuck::cast_slice(&raw), 0)
}

/// Copies `count` collapses out; they are not checked.
pub(crate) fn read_collapses(count: u32, memory: &File) -> io::Result<Vec<Collapse>> {
    let room = memory.metadata()?.len() / size_of::<RawCollapse>() as u64;
    if u64::from(count) > room {
        return Err(io::Error::other("more collapses than there is room for"));
    }
    let raw: Vec<RawCollapse> = Reader { memory, offset: 0 }.read(count)?;
    Ok(raw.iter().map(|c| Collapse { removed: c.removed, kept: c.kept, error: c.error }).collect())
}

fn write<T: NoUninit>(memory: &mut File, values: &[T]) -> io::Result<()> {
    memory.write_all(bytemuck::cast_slice(values))
}

/// Reads arrays that lie one after the other.
struct Reader<'a> {
    memory: &'a File,
    offset: u64,
}

impl Reader<'_> {
    fn read<T: NoUninit + AnyBitPattern>(&mut self, count: u32) -> io::Result<Vec<T>> {
        let mut values = vec![T::zeroed(); count as usize];
        let bytes = bytemuck::cast_slice_mut(&mut values);
        self.memory.read_exact_at(bytes, self.offset)?;
        self.offset += bytes.len() as u64;
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use glam::{Vec2, Vec3};

    use super::*;

    fn mesh() -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            wedges: Wedges {
                position: vec![0, 1, 1, 2],
                normal: vec![Vec3::Z; 4],
                uv: vec![Vec2::new(0.25, 0.5); 4],
                section: vec![0, 0, 1, 0],
            },
            triangles: vec![[0, 1, 3], [0, 2, 3]],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_mesh_comes_back_and_cannot_be_changed() {
        let (sizes, memory) = write_mesh(&mesh()).unwrap();
        assert_eq!(read_mesh(sizes, &memory).unwrap(), mesh());
        assert!(memory.write_all_at(&[1], 0).is_err());
        assert!(memory.set_len(0).is_err());
        let more = MeshSizes { triangles: 3, ..sizes };
        assert!(read_mesh(more, &memory).is_err());
    }

    #[test]
    fn collapses_come_back_and_their_room_keeps_its_size() {
        let memory = room_for_collapses(&mesh()).unwrap();
        let collapses = [Collapse { removed: 2, kept: 0, error: 0.5 }];
        write_collapses(&collapses, &memory).unwrap();
        assert_eq!(read_collapses(1, &memory).unwrap(), collapses);
        assert!(read_collapses(4, &memory).is_err());
        assert!(memory.set_len(0).is_err());
    }
}
