//! Welded meshes on disk, by the content of the files that they come from: welding a
//! million triangles takes longer than drawing them. A header, then arrays, in the
//! machine's byte order.

use std::borrow::Cow;
use std::fmt;
use std::io::Read;

use busbar_geometry::{Mesh, Section, Wedges, WeldReport};
use bytemuck::{Pod, Zeroable};
use glam::Vec2;
use twox_hash::XxHash3_128;

use crate::key::digest;
use crate::stack_file::{array, checksum, halves};

/// Magic number of the file type, which also reveals the byte order.
const MAGIC: u64 = 0x6275_7362_6172_4d57;

/// Format version: grows when the format changes, or the result of import or welding.
const VERSION: u64 = 2;

/// Arrays of a file: those as long as the mesh, then sections, ends of names, and names.
const ARRAYS: usize = LARGE_ARRAYS + 3;
const LARGE_ARRAYS: usize = 7;

/// Computes the content hash of a file's parts.
pub fn content_digest(parts: &[&[u8]]) -> u128 {
    let digests: Vec<u64> = parts.iter().flat_map(|part| digest(part)).collect();
    XxHash3_128::oneshot(bytemuck::cast_slice(&digests))
}

/// The content of a file and of all that it names, and the number of a mesh in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MeshKey(u128);

impl MeshKey {
    /// Makes the key of a mesh; `content` is a [`content_digest`].
    pub fn new(content: u128, mesh: usize) -> Self {
        let [low, high] = halves(content);
        Self(XxHash3_128::oneshot(bytemuck::bytes_of(&[low, high, mesh as u64])))
    }
}

impl fmt::Display for MeshKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

/// Welded mesh, the names of its features, and the counts of welding.
#[derive(Clone, Debug, PartialEq)]
pub struct WeldedMesh {
    /// Welded mesh as stored.
    pub mesh: Mesh,
    /// Names of the features, by index.
    pub feature_names: Vec<String>,
    /// Counts of the welding.
    pub report: WeldReport,
}

/// First in the file.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Header {
    magic: u64,
    version: u64,
    key: [u64; 2],
    /// Elements of each of the arrays.
    counts: [u64; ARRAYS],
    /// Numbers of the [`WeldReport`].
    report: [u64; 4],
    /// Over the header before it and the digest of each array.
    checksum: [u64; 2],
}

/// Bytes of an element of each of the arrays.
const ELEMENT_BYTES: [u64; ARRAYS] = [12, 4, 4, 12, 8, 4, 12, 16, 4, 1];

impl Header {
    fn file_bytes(&self) -> Option<u64> {
        let sizes = self.counts.iter().zip(ELEMENT_BYTES);
        let mut sizes = sizes.map(|(count, bytes)| count.checked_mul(bytes));
        sizes.try_fold(size_of::<Self>() as u64, |sum, bytes| sum.checked_add(bytes?))
    }

    fn checksum(&self, digests: impl Iterator<Item = [u64; 3]>) -> [u64; 2] {
        checksum(&Self { checksum: [0; 2], ..*self }, digests)
    }
}

/// Serializes a whole file, in the parts that it is written in.
pub(crate) fn parts<'a>(
    key: MeshKey,
    mesh: &'a Mesh,
    feature_names: &[String],
    report: WeldReport,
) -> Vec<Cow<'a, [u8]>> {
    let no_uvs = mesh.wedges.uv.iter().all(|&uv| uv == Vec2::ZERO);
    let uvs = if no_uvs { &[] } else { &mesh.wedges.uv[..] };
    let sections: Vec<[u32; 4]> = mesh.sections.iter().map(section_words).collect();
    let name_ends: Vec<u32> = feature_names
        .iter()
        .scan(0, |end, name| {
            *end += name.len() as u32;
            Some(*end)
        })
        .collect();
    let large = large_arrays(mesh, uvs).map(Cow::Borrowed);
    let small = [
        bytemuck::cast_slice(&sections).to_vec(),
        bytemuck::cast_slice(&name_ends).to_vec(),
        feature_names.concat().into_bytes(),
    ];
    let arrays: Vec<Cow<'_, [u8]>> = large.into_iter().chain(small.map(Cow::Owned)).collect();
    let mut header = Header {
        magic: MAGIC,
        version: VERSION,
        key: halves(key.0),
        counts: std::array::from_fn(|i| arrays[i].len() as u64 / ELEMENT_BYTES[i]),
        report: report_words(report),
        checksum: [0; 2],
    };
    header.checksum = header.checksum(arrays.iter().map(|array| digest(array)));
    let header = Cow::Owned(bytemuck::bytes_of(&header).to_vec());
    std::iter::once(header).chain(arrays).collect()
}

/// Returns the arrays between the header and the sections, in order.
fn large_arrays<'a>(mesh: &'a Mesh, uvs: &'a [Vec2]) -> [&'a [u8]; LARGE_ARRAYS] {
    [
        bytemuck::cast_slice(&mesh.positions),
        bytemuck::cast_slice(&mesh.features),
        bytemuck::cast_slice(&mesh.wedges.position),
        bytemuck::cast_slice(&mesh.wedges.normal),
        bytemuck::cast_slice(uvs),
        bytemuck::cast_slice(&mesh.wedges.section),
        bytemuck::cast_slice(&mesh.triangles),
    ]
}

/// Reads a mesh from a file of this length; an error says in words what is wrong.
pub(crate) fn read(file: &mut impl Read, length: u64, key: MeshKey) -> Result<WeldedMesh, String> {
    let unreadable = |error: std::io::Error| format!("it cannot be read: {error}");
    let mut header = Header::zeroed();
    if length < size_of::<Header>() as u64 {
        return Err(format!("it is cut short: {length} bytes"));
    }
    file.read_exact(bytemuck::bytes_of_mut(&mut header)).map_err(unreadable)?;
    check(&header, key, length)?;

    let counts = header.counts;
    let positions = array(file, counts[0]).map_err(unreadable)?;
    let features = array(file, counts[1]).map_err(unreadable)?;
    let mut wedges = Wedges {
        position: array(file, counts[2]).map_err(unreadable)?,
        normal: array(file, counts[3]).map_err(unreadable)?,
        uv: array(file, counts[4]).map_err(unreadable)?,
        section: array(file, counts[5]).map_err(unreadable)?,
    };
    let triangles = array(file, counts[6]).map_err(unreadable)?;
    let sections: Vec<[u32; 4]> = array(file, counts[7]).map_err(unreadable)?;
    let name_ends: Vec<u32> = array(file, counts[8]).map_err(unreadable)?;
    let names: Vec<u8> = array(file, counts[9]).map_err(unreadable)?;
    let uvs = std::mem::take(&mut wedges.uv);
    let mut mesh = Mesh { positions, wedges, triangles, sections: Vec::new(), features };
    let small: [&[u8]; 3] =
        [bytemuck::cast_slice(&sections), bytemuck::cast_slice(&name_ends), &names];
    let arrays = large_arrays(&mesh, &uvs).into_iter().chain(small);
    if header.checksum(arrays.map(digest)) != header.checksum {
        return Err("its checksum is wrong".into());
    }
    mesh.wedges.uv =
        if uvs.is_empty() { vec![Vec2::ZERO; mesh.wedges.position.len()] } else { uvs };
    mesh.sections = sections.into_iter().map(section_of).collect();
    let feature_names = split(&names, &name_ends).ok_or("its names are no text")?;
    if !mesh.is_welded(feature_names.len()) {
        return Err("it holds no welded mesh".into());
    }
    Ok(WeldedMesh { mesh, feature_names, report: report_of(header.report) })
}

/// Compares every number with the file's length before any allocation of its size.
fn check(header: &Header, key: MeshKey, length: u64) -> Result<(), String> {
    if header.magic != MAGIC {
        return Err("it is no mesh file of this machine".into());
    }
    if header.version != VERSION {
        return Err(format!("it has version {}, not {VERSION}", header.version));
    }
    if header.key != halves(key.0) {
        return Err("it belongs to another file".into());
    }
    match header.file_bytes() {
        Some(expected) if expected == length => Ok(()),
        _ => Err(format!("it has {length} bytes, which is not what its header says")),
    }
}

/// Splits concatenated names at their ends.
fn split(names: &[u8], ends: &[u32]) -> Option<Vec<String>> {
    let names = std::str::from_utf8(names).ok()?;
    let starts = std::iter::once(0).chain(ends.iter().copied());
    let name = |(start, &end): (u32, &u32)| names.get(start as usize..end as usize);
    let split: Option<Vec<String>> =
        starts.zip(ends).map(|range| name(range).map(str::to_owned)).collect();
    split.filter(|_| ends.last().map_or(0, |&end| end as usize) == names.len())
}

pub(crate) fn section_words(section: &Section) -> [u32; 4] {
    let (named, material) = section.material.map_or((0, 0), |material| (1, material));
    [named, material, section.first_triangle, section.triangle_count]
}

fn section_of([named, material, first_triangle, triangle_count]: [u32; 4]) -> Section {
    Section { material: (named != 0).then_some(material), first_triangle, triangle_count }
}

fn report_words(report: WeldReport) -> [u64; 4] {
    let WeldReport { vertices_in, positions, wedges, coincident_triangles } = report;
    [vertices_in, positions, wedges, coincident_triangles].map(|count| count as u64)
}

fn report_of(words: [u64; 4]) -> WeldReport {
    let [vertices_in, positions, wedges, coincident_triangles] = words.map(|word| word as usize);
    WeldReport { vertices_in, positions, wedges, coincident_triangles }
}
