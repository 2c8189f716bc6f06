//! The outer form of a file: JSON alone, or the GLB container (glTF 2.0,
//! section 4.4).

use crate::error::{ImportError, ImportFault};
use crate::report::Notes;

const GLB_MAGIC: &[u8] = b"glTF";
const JSON_CHUNK: u32 = 0x4E4F_534A;
const BIN_CHUNK: u32 = 0x004E_4942;
const HEADER_BYTES: usize = 12;

/// A file's JSON and, in a GLB, its binary chunk.
pub(crate) struct Container<'a> {
    pub(crate) json: &'a [u8],
    pub(crate) bin: Option<&'a [u8]>,
}

pub(crate) fn open<'a>(bytes: &'a [u8], notes: &mut Notes) -> Result<Container<'a>, ImportError> {
    if !bytes.starts_with(GLB_MAGIC) {
        return Ok(Container { json: bytes, bin: None });
    }
    open_glb(bytes, notes).map_err(|reason| ImportFault::Container(reason).at("its header"))
}

fn open_glb<'a>(bytes: &'a [u8], notes: &mut Notes) -> Result<Container<'a>, String> {
    let version = word(bytes, 4).ok_or("it ends within its header")?;
    let mut length = word(bytes, 8).ok_or("it ends within its header")? as usize;
    if version == 1 {
        return Err("container version 1 of glTF 1.0; version 2 is read".into());
    }
    if version != 2 {
        return Err(format!("container version {version} instead of 2"));
    }
    // Writers that stream know the length in the end alone; chunks have their own.
    if length == 0 {
        notes.add("GLB whose header says no length: read to its end");
        length = bytes.len();
    }
    let Some(mut rest) = bytes.get(HEADER_BYTES..length) else {
        return Err(format!("its header says {length} bytes, but there are {}", bytes.len()));
    };
    let (kind, json) = take_chunk(&mut rest)?.ok_or("it has no chunk")?;
    if kind != JSON_CHUNK {
        return Err("its first chunk is not JSON".into());
    }
    let bin = take_chunk(&mut rest)?.and_then(|(kind, bin)| (kind == BIN_CHUNK).then_some(bin));
    Ok(Container { json, bin })
}

/// Takes the next chunk's type and content, if there is a next chunk.
fn take_chunk<'a>(rest: &mut &'a [u8]) -> Result<Option<(u32, &'a [u8])>, String> {
    if rest.is_empty() {
        return Ok(None);
    }
    let header = word(rest, 0).zip(word(rest, 4));
    let (length, kind) = header.ok_or("it ends within a chunk's header")?;
    let content = &rest[8..];
    let Some(chunk) = content.get(..length as usize) else {
        return Err(format!("a chunk says {length} bytes, but {} are left", content.len()));
    };
    *rest = &content[length as usize..];
    Ok(Some((kind, chunk)))
}

fn word(bytes: &[u8], offset: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(offset..)?.first_chunk()?))
}
