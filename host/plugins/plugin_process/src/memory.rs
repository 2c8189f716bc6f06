//! Shared memory for data too large for messages: rings and meshes.
//!
//! The host makes all of it and seals its size, so that no plugin's process can
//! cut it short under the host. It maps no mesh and no collapses: what the other side
//! changes afterwards changes no copy. The plugin's process, which trusts the host, has
//! both mapped, so that neither is copied there.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::FileExt;

use busbar_geometry::{Collapse, Mesh};
use busbar_plugin_abi::BusbarCollapse;
use busbar_plugin_host::{MeshView, WedgesView};
use busbar_protocol::memory::create;
pub(crate) use busbar_protocol::memory::zeroed;
use bytemuck::{AnyBitPattern, NoUninit, Pod, Zeroable};
use glam::{Vec2, Vec3};
use memmap2::{Mmap, MmapMut, MmapOptions};
use rustix::fs::{SealFlags, fcntl_add_seals, fcntl_get_seals};
use serde::{Deserialize, Serialize};

/// Triangles that are put together at a time.
const TRIANGLES_AT_ONCE: usize = 1 << 13;

/// Sizes of a mesh as an optimiser gets it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct MeshSizes {
    positions: u32,
    triangles: u32,
    /// 0 for an optimiser that reads none.
    wedges: u32,
}

impl MeshSizes {
    /// Size of all arrays together, bytes.
    fn bytes(self) -> u64 {
        let [positions, triangles, wedges] =
            [self.positions, self.triangles, self.wedges].map(u64::from);
        let shape = positions * size_of::<Vec3>() as u64 + triangles * CORNERS_BYTES;
        if wedges == 0 { shape } else { shape + triangles * CORNERS_BYTES + wedges * WEDGE_BYTES }
    }
}

/// Bytes of a triangle's corners.
const CORNERS_BYTES: u64 = size_of::<[u32; 3]>() as u64;
/// Position, normal, texture coordinates and section.
const WEDGE_BYTES: u64 = (2 * size_of::<u32>() + size_of::<Vec3>() + size_of::<Vec2>()) as u64;

/// Collapse in the memory layout of the ABI.
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

/// Writes a mesh into sealed memory, with wedges or without.
pub(crate) fn write_mesh(mesh: &Mesh, with_wedges: bool) -> io::Result<(MeshSizes, File)> {
    let mut memory = create("mesh")?;
    write(&mut memory, &mesh.positions)?;
    let mut piece = Vec::with_capacity(TRIANGLES_AT_ONCE.min(mesh.triangles.len()));
    for triangles in mesh.triangles.chunks(TRIANGLES_AT_ONCE) {
        piece.clear();
        piece.extend(triangles.iter().map(|&triangle| mesh.corner_positions(triangle)));
        write(&mut memory, &piece)?;
    }
    if with_wedges {
        write(&mut memory, &mesh.triangles)?;
        write(&mut memory, &mesh.wedges.position)?;
        write(&mut memory, &mesh.wedges.normal)?;
        write(&mut memory, &mesh.wedges.uv)?;
        write(&mut memory, &mesh.wedges.section)?;
    }
    let all = SealFlags::SHRINK | SealFlags::GROW | SealFlags::WRITE | SealFlags::SEAL;
    fcntl_add_seals(&memory, all)?;
    let sizes = MeshSizes {
        positions: mesh.positions.len() as u32,
        triangles: mesh.triangles.len() as u32,
        wedges: if with_wedges { mesh.wedges.len() as u32 } else { 0 },
    };
    Ok((sizes, memory))
}

/// Mapped mesh that [`write_mesh`] wrote.
pub(crate) struct SharedMesh {
    memory: Mmap,
    sizes: MeshSizes,
}

impl SharedMesh {
    /// Maps sealed memory with a mesh of these sizes.
    pub(crate) fn map(sizes: MeshSizes, memory: &File) -> io::Result<Self> {
        let needed = SealFlags::SHRINK | SealFlags::WRITE;
        if !fcntl_get_seals(memory)?.contains(needed) {
            return Err(io::Error::other("a mesh that could change meanwhile"));
        }
        if memory.metadata()?.len() != sizes.bytes() {
            return Err(io::Error::other("a mesh of other sizes than its memory"));
        }
        // A private mapping, since older kernels share nothing that is sealed against writing.
        // SAFETY: it is memory, of no disk, and by its seals nobody can write to it or cut it
        // short, nor take the seals off.
        let memory = unsafe { MmapOptions::new().populate().map_copy_read_only(memory)? };
        Ok(Self { memory, sizes })
    }

    /// Borrows the arrays of the mesh.
    pub(crate) fn view(&self) -> MeshView<'_> {
        let MeshSizes { positions, triangles, wedges } = self.sizes;
        let mut arrays = Arrays(&self.memory);
        MeshView {
            positions: arrays.next(positions),
            triangles: arrays.next(triangles),
            wedges: (wedges > 0).then(|| WedgesView {
                corners: arrays.next(triangles),
                position: arrays.next(wedges),
                normal: arrays.next(wedges),
                uv: arrays.next(wedges),
                section: arrays.next(wedges),
            }),
        }
    }
}

/// Arrays that lie one after the other, each of whole words.
struct Arrays<'a>(&'a [u8]);

impl<'a> Arrays<'a> {
    fn next<T: AnyBitPattern>(&mut self, count: u32) -> &'a [T] {
        let (array, rest) = self.0.split_at(count as usize * size_of::<T>());
        self.0 = rest;
        bytemuck::cast_slice(array)
    }
}

/// Room for collapses, where the host will find them.
pub(crate) struct CollapseRoom(MmapMut);

impl CollapseRoom {
    /// Maps what [`room_for_collapses`] made.
    pub(crate) fn map(memory: &File) -> io::Result<Self> {
        if !fcntl_get_seals(memory)?.contains(SealFlags::SHRINK) {
            return Err(io::Error::other("room that could be cut short meanwhile"));
        }
        // SAFETY: it is memory, of no disk, and by its seals nobody can cut it short; the host
        // that made it only reads, once it is told that all is written.
        unsafe { MmapMut::map_mut(memory) }.map(Self)
    }

    /// Borrows the whole buffer for collapses.
    pub(crate) fn collapses(&mut self) -> &mut [BusbarCollapse] {
        let room: &mut [RawCollapse] = bytemuck::cast_slice_mut(&mut self.0);
        let (start, count) = (room.as_mut_ptr().cast::<BusbarCollapse>(), room.len());
        // SAFETY: both structs have the same three fields in C's layout, as a test checks, and
        // are valid whatever their bits.
        unsafe { std::slice::from_raw_parts_mut(start, count) }
    }
}

/// Copies `count` collapses out; they are not checked.
pub(crate) fn read_collapses(count: u32, memory: &File) -> io::Result<Vec<Collapse>> {
    let room = memory.metadata()?.len() / size_of::<RawCollapse>() as u64;
    if u64::from(count) > room {
        return Err(io::Error::other("more collapses than there is room for"));
    }
    let mut raw = vec![RawCollapse::zeroed(); count as usize];
    memory.read_exact_at(bytemuck::cast_slice_mut(&mut raw), 0)?;
    let collapse = |c: RawCollapse| Collapse { removed: c.removed, kept: c.kept, error: c.error };
    Ok(raw.into_iter().map(collapse).collect())
}

fn write<T: NoUninit>(memory: &mut File, values: &[T]) -> io::Result<()> {
    memory.write_all(bytemuck::cast_slice(values))
}

#[cfg(test)]
mod tests {
    use std::mem::offset_of;

    use busbar_geometry::Wedges;

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
    fn a_mesh_comes_across_and_cannot_be_changed() {
        let mesh = mesh();
        for with_wedges in [true, false] {
            let (sizes, memory) = write_mesh(&mesh, with_wedges).unwrap();
            let shared = SharedMesh::map(sizes, &memory).unwrap();
            let view = shared.view();
            assert_eq!(view.positions, mesh.positions);
            assert_eq!(view.triangles, [[0, 1, 2], [0, 1, 2]]);
            assert_eq!(view.wedges, with_wedges.then(|| WedgesView::from_mesh(&mesh)));
            assert!(memory.write_all_at(&[1], 0).is_err());
            assert!(memory.set_len(0).is_err());
            let more = MeshSizes { triangles: 3, ..sizes };
            assert!(SharedMesh::map(more, &memory).is_err());
        }
    }

    #[test]
    fn an_empty_mesh_comes_across() {
        let (sizes, memory) = write_mesh(&Mesh::default(), true).unwrap();
        let shared = SharedMesh::map(sizes, &memory).unwrap();
        let nothing = MeshView { positions: &[], triangles: &[], wedges: None };
        assert_eq!(shared.view(), nothing);
        let room = room_for_collapses(&Mesh::default()).unwrap();
        assert!(CollapseRoom::map(&room).unwrap().collapses().is_empty());
    }

    #[test]
    fn nothing_is_mapped_that_could_change() {
        let memory = create("open").unwrap();
        let nothing = MeshSizes { positions: 0, triangles: 0, wedges: 0 };
        assert!(SharedMesh::map(nothing, &memory).is_err());
        assert!(CollapseRoom::map(&memory).is_err());
    }

    #[test]
    fn collapses_come_back_and_their_room_keeps_its_size() {
        let memory = room_for_collapses(&mesh()).unwrap();
        let mut room = CollapseRoom::map(&memory).unwrap();
        assert_eq!(room.collapses().len(), 3);
        room.collapses()[0] = BusbarCollapse { removed: 2, kept: 0, error: 0.5 };
        let collapses = [Collapse { removed: 2, kept: 0, error: 0.5 }];
        assert_eq!(read_collapses(1, &memory).unwrap(), collapses);
        assert!(read_collapses(4, &memory).is_err());
        assert!(memory.set_len(0).is_err());
    }

    #[test]
    fn a_collapse_lies_as_in_the_abi() {
        macro_rules! same {
            ($($field:ident)*) => {$(
                assert_eq!(offset_of!(RawCollapse, $field), offset_of!(BusbarCollapse, $field));
            )*};
        }
        same!(removed kept error);
        assert_eq!(size_of::<RawCollapse>(), size_of::<BusbarCollapse>());
        assert_eq!(align_of::<RawCollapse>(), align_of::<BusbarCollapse>());
    }
}
