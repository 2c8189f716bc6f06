//! Mesh files between the bench and its workers.
//!
//! Little-endian: numbers of positions and triangles, positions, triangles over
//! them; a mesh with attributes goes on with the number of wedges, each one's
//! position, normal, texture coordinates and section, and the triangles' corners
//! as wedges. Workers that want no attributes stop after the triangles.

use std::fs::File;
use std::io::{BufReader, BufWriter, Read, Write};
use std::path::Path;

use anyhow::{Context, Result, ensure};
use busbar_geometry::{Mesh, Topology, Wedges};
use bytemuck::{AnyBitPattern, NoUninit};

/// Greatest number of elements of one array.
const MAX_ELEMENTS: u32 = 1 << 28;

/// Writes a mesh with its attributes.
pub(crate) fn write_mesh(path: &Path, mesh: &Mesh) -> Result<()> {
    let topology = mesh.topology();
    let wedges = &mesh.wedges;
    write(path, |file| {
        put_topology(file, &topology)?;
        put(file, &[wedges.len() as u32])?;
        put(file, &wedges.position)?;
        put(file, &wedges.normal)?;
        put(file, &wedges.uv)?;
        put(file, &wedges.section)?;
        put(file, &mesh.triangles)
    })
}

/// Writes points and triangles.
pub(crate) fn write_level(path: &Path, level: &Topology) -> Result<()> {
    write(path, |file| put_topology(file, level))
}

/// Reads a mesh that [`write_mesh`] wrote; all triangles are in one section.
pub(crate) fn read_mesh(path: &Path) -> Result<Mesh> {
    read(path, |file| {
        let topology = take_topology(file)?;
        let count = take_count(file)?;
        let wedges = Wedges {
            position: take(file, count)?,
            normal: take(file, count)?,
            uv: take(file, count)?,
            section: take(file, count)?,
        };
        let triangles = take(file, topology.triangles.len())?;
        Ok(Mesh { positions: topology.positions, wedges, triangles, ..Mesh::default() })
    })
}

/// Reads points and triangles, and checks that these name those.
pub(crate) fn read_level(path: &Path) -> Result<Topology> {
    read(path, take_topology)
}

fn write(path: &Path, put: impl FnOnce(&mut BufWriter<File>) -> Result<()>) -> Result<()> {
    let file = File::create(path).with_context(|| format!("cannot write {}", path.display()))?;
    let mut file = BufWriter::new(file);
    put(&mut file)?;
    file.flush().with_context(|| format!("cannot write {}", path.display()))
}

fn read<T>(path: &Path, take: impl FnOnce(&mut BufReader<File>) -> Result<T>) -> Result<T> {
    let open = || take(&mut BufReader::new(File::open(path)?));
    open().with_context(|| format!("cannot read {}", path.display()))
}

fn put<T: NoUninit>(file: &mut impl Write, values: &[T]) -> Result<()> {
    Ok(file.write_all(bytemuck::cast_slice(values))?)
}

fn put_topology(file: &mut impl Write, mesh: &Topology) -> Result<()> {
    put(file, &[mesh.positions.len() as u32, mesh.triangles.len() as u32])?;
    put(file, &mesh.positions)?;
    put(file, &mesh.triangles)
}

fn take<T: AnyBitPattern + NoUninit>(file: &mut impl Read, count: usize) -> Result<Vec<T>> {
    let mut values = vec![T::zeroed(); count];
    file.read_exact(bytemuck::cast_slice_mut(&mut values)).context("the file ends early")?;
    Ok(values)
}

fn take_count(file: &mut impl Read) -> Result<usize> {
    let count = take::<u32>(file, 1)?[0];
    ensure!(count <= MAX_ELEMENTS, "{count} elements, at most {MAX_ELEMENTS} are possible");
    Ok(count as usize)
}

fn take_topology(file: &mut impl Read) -> Result<Topology> {
    let (positions, triangles) = (take_count(file)?, take_count(file)?);
    let mesh = Topology { positions: take(file, positions)?, triangles: take(file, triangles)? };
    let bad = mesh.triangles.as_flattened().iter().find(|&&v| v as usize >= positions);
    match bad {
        None => Ok(mesh),
        Some(vertex) => anyhow::bail!("a triangle names vertex {vertex} of {positions}"),
    }
}

#[cfg(test)]
mod tests {
    use busbar_geometry::{RawPrimitive, weld};
    use glam::{Vec2, Vec3};

    use super::*;

    #[test]
    fn what_is_written_is_read() {
        let primitive = RawPrimitive {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            uvs: vec![Vec2::X; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..RawPrimitive::default()
        };
        let mesh = weld(&[primitive]).unwrap().0;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.mesh");
        write_mesh(&path, &mesh).unwrap();
        let read = read_mesh(&path).unwrap();
        assert_eq!((&read.positions, &read.wedges), (&mesh.positions, &mesh.wedges));
        assert_eq!(read.triangles, mesh.triangles);
        assert_eq!(read_level(&path).unwrap(), mesh.topology());
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..60]).unwrap();
        assert!(format!("{:#}", read_level(&path).unwrap_err()).contains("ends early"));
    }
}
