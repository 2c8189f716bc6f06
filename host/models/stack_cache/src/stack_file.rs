//! The file format: a header, then arrays, in the machine's byte order.

use std::borrow::Cow;
use std::io::Read;

use busbar_geometry::{Mesh, StackTables};
use bytemuck::{Pod, Zeroable};
use twox_hash::XxHash3_128;

use crate::CacheKey;
use crate::key::digest;

/// Magic number of the file type, which also reveals the byte order.
const MAGIC: u64 = 0x6275_7362_6172_5343;

/// Grows when the format or the meaning of a number in it changes.
const VERSION: u64 = 2;

/// More steps of error than stacks ever have.
const MAX_ERRORS: u64 = 1 << 16;

/// First in the file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Header {
    magic: u64,
    version: u64,
    key: [u64; 2],
    positions: u64,
    wedges: u64,
    triangles: u64,
    collapses: u64,
    errors: u64,
    max_depth: u64,
    /// 1 if theta is a share of the mesh, else 0.
    theta_by_mesh: u64,
    /// Over the header before it and the digest of each array.
    checksum: [u64; 2],
}

impl Header {
    fn file_bytes(&self) -> u64 {
        let words = self.positions + self.collapses + self.triangles + self.errors;
        size_of::<Self>() as u64 + words * size_of::<u32>() as u64 + self.wedges
    }

    fn checksum(&self, digests: impl Iterator<Item = [u64; 3]>) -> [u64; 2] {
        checksum(&Self { checksum: [0; 2], ..*self }, digests)
    }
}

/// Serializes a whole file, in the parts that it is written in.
pub(crate) fn parts<'a>(
    key: CacheKey,
    ranks: &'a [u32],
    tables: &'a StackTables,
) -> Vec<Cow<'a, [u8]>> {
    let mut header = Header {
        magic: MAGIC,
        version: VERSION,
        key: halves(key.0),
        positions: ranks.len() as u64,
        wedges: tables.parent_offset.len() as u64,
        triangles: tables.removal_cursor.len() as u64,
        collapses: tables.parent_start.len() as u64,
        errors: tables.errors.len() as u64,
        max_depth: u64::from(tables.max_depth),
        theta_by_mesh: u64::from(tables.theta_by_mesh),
        checksum: [0; 2],
    };
    let arrays = arrays(ranks, tables);
    header.checksum = header.checksum(arrays.into_iter().map(digest));
    let header = Cow::Owned(bytemuck::bytes_of(&header).to_vec());
    std::iter::once(header).chain(arrays.map(Cow::Borrowed)).collect()
}

/// Reads ranks and tables from a file of this length; an error says in words what is wrong.
pub(crate) fn read(
    file: &mut impl Read,
    length: u64,
    key: CacheKey,
    mesh: &Mesh,
) -> Result<(Vec<u32>, StackTables), String> {
    let unreadable = |error: std::io::Error| format!("it cannot be read: {error}");
    let mut header = Header::zeroed();
    if length < size_of::<Header>() as u64 {
        return Err(format!("it is cut short: {length} bytes"));
    }
    file.read_exact(bytemuck::bytes_of_mut(&mut header)).map_err(unreadable)?;
    check(&header, key, mesh, length)?;

    let ranks: Vec<u32> = array(file, header.positions).map_err(unreadable)?;
    let tables = StackTables {
        parent_start: array(file, header.collapses).map_err(unreadable)?,
        removal_cursor: array(file, header.triangles).map_err(unreadable)?,
        errors: array(file, header.errors).map_err(unreadable)?,
        parent_offset: array(file, header.wedges).map_err(unreadable)?,
        max_depth: header.max_depth as u32,
        theta_by_mesh: header.theta_by_mesh != 0,
    };
    if header.checksum(arrays(&ranks, &tables).into_iter().map(digest)) != header.checksum {
        return Err("its checksum is wrong".into());
    }
    Ok((ranks, tables))
}

/// Returns the arrays after the header, in order.
fn arrays<'a>(ranks: &'a [u32], tables: &'a StackTables) -> [&'a [u8]; 5] {
    [
        bytemuck::cast_slice(ranks),
        bytemuck::cast_slice(&tables.parent_start),
        bytemuck::cast_slice(&tables.removal_cursor),
        bytemuck::cast_slice(&tables.errors),
        &tables.parent_offset,
    ]
}

/// Compares every number with the mesh before any allocation of its size.
fn check(header: &Header, key: CacheKey, mesh: &Mesh, length: u64) -> Result<(), String> {
    if header.magic != MAGIC {
        return Err("it is no cache file of this machine".into());
    }
    if header.version != VERSION {
        return Err(format!("it has version {}, not {VERSION}", header.version));
    }
    let of_mesh = [mesh.positions.len(), mesh.wedges.len(), mesh.triangles.len()];
    let found = [header.positions, header.wedges, header.triangles];
    if header.key != halves(key.0) || found != of_mesh.map(|count| count as u64) {
        return Err("it belongs to another mesh".into());
    }
    if header.collapses > header.positions || header.errors > MAX_ERRORS || header.theta_by_mesh > 1
    {
        return Err("its header is wrong".into());
    }
    match header.file_bytes() {
        expected if expected == length => Ok(()),
        expected => Err(format!("it has {length} bytes instead of {expected}")),
    }
}

/// Elements from a file that is known to have them.
pub(crate) fn array<T: Pod>(file: &mut impl Read, count: u64) -> std::io::Result<Vec<T>> {
    let mut values = vec![T::zeroed(); count as usize];
    file.read_exact(bytemuck::cast_slice_mut(&mut values))?;
    Ok(values)
}

/// Computes the checksum of a header with zero checksum and of the arrays' digests.
pub(crate) fn checksum(header: &impl Pod, digests: impl Iterator<Item = [u64; 3]>) -> [u64; 2] {
    let mut text = bytemuck::bytes_of(header).to_vec();
    digests.for_each(|digest| text.extend_from_slice(bytemuck::cast_slice(&digest)));
    halves(XxHash3_128::oneshot(&text))
}

pub(crate) fn halves(value: u128) -> [u64; 2] {
    [value as u64, (value >> 64) as u64]
}
