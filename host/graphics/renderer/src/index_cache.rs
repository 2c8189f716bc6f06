//! Index buffer cache: resolved meshes at cursors, evicted least recently used first.

use std::any::Any;
use std::collections::HashMap;

use busbar_gpu::{BufferArena, BufferSlice, BufferUsage, Recorder};
use smallvec::SmallVec;

use crate::RenderError;
use crate::batch::IndexKey;
use crate::mesh_preparation::MeshData;
use crate::resolver::ResolvedTriangles;
use crate::slender::SectionRange;

/// Bytes of index buffers kept beyond the needs of the current frame.
pub const MAX_CACHED_INDEX_BYTES: u64 = 256 << 20;

/// Bytes of index buffers that one frame may need: some 180 million triangles.
pub const MAX_FRAME_INDEX_BYTES: u64 = 2 << 30;

/// Overhead of an entry besides its indices, bytes, so that empty ones count too.
const ENTRY_BYTES: u64 = 256;

/// Sections that most meshes have at most.
const USUAL_SECTIONS: usize = 2;

/// Live triangles of a mesh at a cursor.
pub(crate) struct ResolvedIndices {
    /// `None` when no triangle lives.
    pub(crate) indices: Option<BufferSlice>,
    /// For each section, its range among them; of most meshes beside the rest.
    pub(crate) sections: SmallVec<[SectionRange; USUAL_SECTIONS]>,
    pub(crate) triangles: u32,
    /// Data of the draw reduction, where the mesh takes part.
    data: Option<Box<dyn MeshData>>,
    bytes: u64,
    made_at: u64,
    /// Clock when the entry was made or drawn last; decides eviction.
    used_at: u64,
    drawn_at: u64,
}

impl ResolvedIndices {
    /// Returns the data that the draw reduction prepared, if it is of this type.
    pub(crate) fn data<T: MeshData>(&self) -> Option<&T> {
        let data: &dyn Any = self.data.as_deref()?;
        data.downcast_ref()
    }
}

/// Least-recently-used cache. A buffer that is evicted is freed once no frame
/// in flight uses it; the gpu crate sees to that.
pub(crate) struct IndexCache {
    /// Looked up for each batch of each frame.
    entries: HashMap<IndexKey, ResolvedIndices, foldhash::fast::RandomState>,
    arena: BufferArena,
    bytes: u64,
    limit_bytes: u64,
    /// Counts frames and picks.
    clock: u64,
    /// Bytes that the current frame has asked for.
    frame_bytes: u64,
    /// Entries that the current frame made.
    made: u32,
}

impl IndexCache {
    pub(crate) fn new(limit_bytes: u64) -> Self {
        Self {
            entries: HashMap::default(),
            arena: BufferArena::new("indices", BufferUsage::Index),
            bytes: 0,
            limit_bytes,
            clock: 0,
            frame_bytes: 0,
            made: 0,
        }
    }

    pub(crate) fn set_limit(&mut self, limit_bytes: u64) {
        self.limit_bytes = limit_bytes;
        self.evict();
    }

    pub(crate) fn limit(&self) -> u64 {
        self.limit_bytes
    }

    /// Drops all entries; a frame makes those it needs again.
    pub(crate) fn drop_all(&mut self) {
        self.entries.clear();
        self.bytes = 0;
    }

    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Begins a frame: later requests belong to it.
    pub(crate) fn begin_frame(&mut self) {
        self.clock += 1;
        self.frame_bytes = 0;
        self.made = 0;
    }

    /// Entries that the current frame made.
    pub(crate) fn made(&self) -> u32 {
        self.made
    }

    /// Uploads a mesh at a cursor. It stays at least until the frame after.
    pub(crate) fn insert(
        &mut self,
        recorder: &mut Recorder<'_>,
        key: IndexKey,
        resolved: ResolvedTriangles,
    ) -> Result<(), RenderError> {
        let entry = upload(recorder, &mut self.arena, resolved, self.clock)?;
        self.made += 1;
        self.bytes += entry.bytes;
        if let Some(replaced) = self.entries.insert(key, entry) {
            self.bytes -= replaced.bytes;
        }
        Ok(())
    }

    /// Marks an entry as used by the current frame, if the frame may have it.
    pub(crate) fn mark_used(&mut self, key: IndexKey) -> Result<(), RenderError> {
        if let Some(entry) = self.entries.get_mut(&key)
            && entry.drawn_at != self.clock
        {
            (entry.used_at, entry.drawn_at) = (self.clock, self.clock);
            self.frame_bytes += entry.bytes;
        }
        if self.frame_bytes > MAX_FRAME_INDEX_BYTES {
            return Err(RenderError::TooMany {
                what: "bytes of triangles in one frame",
                asked: self.frame_bytes,
                limit: MAX_FRAME_INDEX_BYTES,
            });
        }
        Ok(())
    }

    pub(crate) fn get(&self, key: IndexKey) -> Option<&ResolvedIndices> {
        self.entries.get(&key)
    }

    /// Releases empty buffers of the arena.
    pub(crate) fn trim(&mut self) {
        self.arena.trim();
    }

    /// Drops the least recently used entries, down to the limit, but none that the current frame
    /// uses.
    pub(crate) fn evict(&mut self) {
        if self.bytes <= self.limit_bytes {
            return;
        }
        let mut idle: Vec<(u64, IndexKey)> = self
            .entries
            .iter()
            .filter(|(_, entry)| entry.used_at < self.clock)
            .map(|(key, entry)| (entry.used_at, *key))
            .collect();
        idle.sort_unstable();
        for (_, key) in idle {
            if self.bytes <= self.limit_bytes {
                break;
            }
            self.remove(key);
        }
    }

    /// Drops the entries that the current frame made: its commands were abandoned, so the buffers
    /// were never filled.
    pub(crate) fn abandon_frame(&mut self) {
        let clock = self.clock;
        self.remove_where(|_, entry| entry.made_at == clock);
    }

    pub(crate) fn remove_model(&mut self, model: u32) {
        self.remove_where(|key, _| key.model == model);
    }

    fn remove_where(&mut self, wanted: impl Fn(&IndexKey, &ResolvedIndices) -> bool) {
        let keys: Vec<IndexKey> = self
            .entries
            .iter()
            .filter(|(key, entry)| wanted(key, entry))
            .map(|(key, _)| *key)
            .collect();
        for key in keys {
            self.remove(key);
        }
    }

    fn remove(&mut self, key: IndexKey) {
        if let Some(entry) = self.entries.remove(&key) {
            self.bytes -= entry.bytes;
        }
    }
}

fn upload(
    recorder: &mut Recorder<'_>,
    arena: &mut BufferArena,
    resolved: ResolvedTriangles,
    clock: u64,
) -> Result<ResolvedIndices, RenderError> {
    let indices: &[u8] = bytemuck::cast_slice(&resolved.triangles);
    let slice = match indices {
        [] => None,
        _ => Some(recorder.upload_slice(arena, indices)?),
    };
    let (indices_bytes, triangles) = (indices.len() as u64, resolved.triangles.len() as u32);
    let mut data = resolved.data;
    if let Some(data) = &mut data {
        data.attach(slice.as_ref());
    }
    let data_bytes = data.as_ref().map_or(0, |data| data.bytes());
    Ok(ResolvedIndices {
        indices: slice,
        sections: resolved.sections.iter().map(SectionRange::indices).collect(),
        triangles,
        bytes: indices_bytes + data_bytes + ENTRY_BYTES,
        data,
        made_at: clock,
        used_at: clock,
        drawn_at: 0,
    })
}
