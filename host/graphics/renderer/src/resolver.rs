//! Background resolver: meshes at new cursors are resolved by worker threads beside the frames.
//!
//! A request is a mesh at a cursor, or the way to it. It is worked on by few threads, then waits
//! until a frame has bytes left to upload it. One that is not asked for again
//! is dropped: a camera that flies past leaves no work behind.

use std::collections::{HashMap, HashSet, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use busbar_geometry::{CollapseStacks, ResolvedMesh};
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::RenderError;
use crate::batch::IndexKey;
use crate::mesh_preparation::{LiveTriangles, MeshData, MeshPreparation};
use crate::slender::{SectionRange, SlenderWedges};

/// Requests that are in work or wait for their upload. Further ones are to be repeated in a later
/// frame.
pub const MAX_PENDING_RESOLVES: usize = 256;

/// Bytes that all these may take, unless a single one takes more.
pub const MAX_PENDING_RESOLVE_BYTES: u64 = 256 << 20;

/// Threads that resolve. Half of the cores at most: the frames need theirs.
const MAX_RESOLVE_THREADS: usize = 4;

/// Mesh data that triangles are resolved from.
#[derive(Clone, Copy)]
pub(crate) struct ResolveSource<'a> {
    pub(crate) stacks: &'a Arc<CollapseStacks>,
    /// `None` for a mesh without slender parts.
    pub(crate) slender: Option<&'a Arc<SlenderWedges>>,
    /// Part of a model: other meshes stand in the same place.
    pub(crate) is_part: bool,
    /// Preparation of data for the draw reduction.
    pub(crate) preparation: MeshPreparation,
}

/// The live triangles of a mesh at a cursor, as the index buffer will hold them.
pub(crate) struct ResolvedTriangles {
    /// Corners as wedge indices.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// For each section, its range in `triangles`.
    pub(crate) sections: Vec<SectionRange>,
    /// Data of the draw reduction, where the mesh takes part.
    pub(crate) data: Option<Box<dyn MeshData>>,
}

impl ResolvedTriangles {
    pub(crate) fn new(source: ResolveSource<'_>, cursor: u32) -> Self {
        let ResolveSource { stacks, slender, is_part, preparation } = source;
        let ResolvedMesh { mut triangles, sections, .. } = stacks.resolve(cursor);
        let sections = sections.into_iter().map(|section| match slender {
            Some(slender) => slender.partition(&mut triangles, section),
            None => SectionRange::without_slender(section),
        });
        let sections: Vec<SectionRange> = sections.collect();
        let (mesh, live) = (stacks.mesh(), triangles.as_slice());
        let live = LiveTriangles { mesh, is_part, triangles: live, sections: &sections };
        let data = (preparation.prepare)(live);
        Self { triangles, sections, data }
    }

    pub(crate) fn bytes(&self) -> u64 {
        size_of_val(self.triangles.as_slice()) as u64
    }
}

/// Request to resolve a mesh at a cursor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Request {
    /// The live triangles of a mesh.
    Triangles(IndexKey),
    /// The vertex that stands for each one of a mesh.
    MorphTarget(IndexKey),
}

impl Request {
    pub(crate) fn key(self) -> IndexKey {
        let (Self::Triangles(key) | Self::MorphTarget(key)) = self;
        key
    }

    /// Returns the greatest size of its result, bytes.
    fn max_bytes(self, source: ResolveSource<'_>) -> u64 {
        let mesh = source.stacks.mesh();
        match self {
            Self::Triangles(_) => {
                let data_bytes = (source.preparation.max_bytes)(mesh, source.is_part);
                size_of_val(mesh.triangles.as_slice()) as u64 + data_bytes
            }
            Self::MorphTarget(_) => size_of_val(mesh.wedges.position.as_slice()) as u64,
        }
    }

    fn resolve(self, source: ResolveSource<'_>) -> Resolved {
        match self {
            Self::Triangles(key) => Resolved::Triangles(ResolvedTriangles::new(source, key.cursor)),
            Self::MorphTarget(key) => {
                Resolved::MorphTarget(source.stacks.representative_wedges(key.cursor))
            }
        }
    }
}

/// Result of a request.
pub(crate) enum Resolved {
    Triangles(ResolvedTriangles),
    /// Representative of each wedge, as wedge indices.
    MorphTarget(Vec<u32>),
}

impl Resolved {
    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::Triangles(triangles) => triangles.bytes(),
            Self::MorphTarget(standing) => size_of_val(standing.as_slice()) as u64,
        }
    }
}

type FinishedRequest = (Request, Resolved);

/// Number that tells repeated requests apart: a handle may belong to another model meanwhile.
type Ticket = u64;

/// Worker threads and their pending requests.
pub(crate) struct Resolver {
    pool: ThreadPool,
    pending: HashMap<Request, Pending>,
    /// The most that all pending requests can give.
    pending_bytes: u64,
    /// Results in the order in which they came.
    finished: VecDeque<(Ticket, FinishedRequest)>,
    sender: Sender<(Ticket, FinishedRequest)>,
    receiver: Receiver<(Ticket, FinishedRequest)>,
    next_ticket: Ticket,
}

struct Pending {
    ticket: Ticket,
    bytes: u64,
    dropped: Arc<AtomicBool>,
}

impl Resolver {
    pub(crate) fn new() -> Result<Self, RenderError> {
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let pool = ThreadPoolBuilder::new()
            .num_threads((cores / 2).clamp(1, MAX_RESOLVE_THREADS))
            .thread_name(|index| format!("resolve {index}"))
            .build()
            .map_err(|error| RenderError::NoThreads(error.to_string()))?;
        let (sender, receiver) = channel();
        Ok(Self {
            pool,
            pending: HashMap::new(),
            pending_bytes: 0,
            finished: VecDeque::new(),
            sender,
            receiver,
            next_ticket: 0,
        })
    }

    /// Replaces all requests, the most urgent first; those that were there
    /// already go on.
    pub(crate) fn request<'a>(
        &mut self,
        wanted: impl Iterator<Item = (Request, ResolveSource<'a>)>,
    ) {
        let mut seen = HashSet::new();
        let wanted: Vec<_> = wanted.filter(|(request, _)| seen.insert(*request)).collect();
        self.cancel_where(|request| !seen.contains(request));
        self.drop_cancelled_results();
        for (request, source) in wanted {
            if !self.pending.contains_key(&request) && !self.enqueue(request, source) {
                break;
            }
        }
    }

    /// Gives a request to the workers, unless there are too many.
    fn enqueue(&mut self, request: Request, source: ResolveSource<'_>) -> bool {
        let bytes = request.max_bytes(source);
        let fits = self.pending_bytes + bytes <= MAX_PENDING_RESOLVE_BYTES;
        if self.pending.len() >= MAX_PENDING_RESOLVES || !(fits || self.pending.is_empty()) {
            return false;
        }
        let dropped = Arc::new(AtomicBool::new(false));
        let ticket = self.next_ticket;
        self.next_ticket += 1;
        self.pending.insert(request, Pending { ticket, bytes, dropped: Arc::clone(&dropped) });
        self.pending_bytes += bytes;
        let (stacks, slender) = (Arc::clone(source.stacks), source.slender.map(Arc::clone));
        let ResolveSource { is_part, preparation, .. } = source;
        let sender = self.sender.clone();
        self.pool.spawn_fifo(move || {
            if !dropped.load(Ordering::Relaxed) {
                let slender = slender.as_ref();
                let source = ResolveSource { stacks: &stacks, slender, is_part, preparation };
                let resolved = request.resolve(source);
                // Nobody listens any more when the renderer has gone.
                let _ = sender.send((ticket, (request, resolved)));
            }
        });
        true
    }

    /// Takes the next result of at most `max_bytes`; its request is then done.
    pub(crate) fn take_finished(&mut self, max_bytes: u64) -> Option<FinishedRequest> {
        self.drop_cancelled_results();
        let (_, (request, resolved)) = self.finished.front()?;
        if resolved.bytes() > max_bytes {
            return None;
        }
        self.cancel(*request);
        self.finished.pop_front().map(|(_, answer)| answer)
    }

    /// Drops results of cancelled requests: those may be finished all the same. A view at rest
    /// takes no results, and must not keep them.
    fn drop_cancelled_results(&mut self) {
        let Self { pending, finished, receiver, .. } = self;
        finished.extend(receiver.try_iter());
        finished.retain(|(ticket, (request, _))| {
            pending.get(request).is_some_and(|pending| pending.ticket == *ticket)
        });
    }

    /// Requests that are not done.
    pub(crate) fn pending_count(&self) -> usize {
        self.pending.len()
    }

    pub(crate) fn cancel_where(&mut self, unwanted: impl Fn(&Request) -> bool) {
        let requests: Vec<Request> = self.pending.keys().copied().filter(unwanted).collect();
        for request in requests {
            self.cancel(request);
        }
    }

    fn cancel(&mut self, request: Request) {
        if let Some(pending) = self.pending.remove(&request) {
            pending.dropped.store(true, Ordering::Relaxed);
            self.pending_bytes -= pending.bytes;
        }
    }
}

impl Drop for Resolver {
    fn drop(&mut self) {
        self.cancel_where(|_| true);
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use busbar_geometry::{Collapse, CollapseSequence, RawPrimitive, weld};
    use glam::Vec3;

    use super::*;

    /// Makes a fan of triangles about one corner.
    fn stacks(triangles: u32) -> Arc<CollapseStacks> {
        let angle = |i: u32| i as f32 / (triangles + 1) as f32;
        let rim = (0..=triangles).map(|i| Vec3::new(angle(i).cos(), angle(i).sin(), 0.0));
        let primitive = RawPrimitive {
            positions: std::iter::once(Vec3::ZERO).chain(rim).collect(),
            triangles: (1..=triangles).map(|i| [0, i, i + 1]).collect(),
            ..Default::default()
        };
        let mesh = weld(&[primitive]).unwrap().0;
        let count = mesh.positions.len() as u32;
        let entries = (1..count).map(|removed| Collapse { removed, kept: 0, error: 0.0 }).collect();
        let sequence = CollapseSequence::new(entries, count).unwrap();
        Arc::new(CollapseStacks::build(mesh, &sequence))
    }

    fn whole(stacks: &Arc<CollapseStacks>) -> ResolveSource<'_> {
        ResolveSource { stacks, slender: None, is_part: false, preparation: MeshPreparation::NONE }
    }

    fn mesh(cursor: u32) -> Request {
        Request::Triangles(IndexKey { model: 0, mesh: 0, cursor })
    }

    fn morph(cursor: u32) -> Request {
        Request::MorphTarget(IndexKey { model: 0, mesh: 0, cursor })
    }

    fn wait_for_one(resolver: &mut Resolver, max_bytes: u64) -> Option<FinishedRequest> {
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(10) {
            if let Some(resolved) = resolver.take_finished(max_bytes) {
                return Some(resolved);
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        None
    }

    #[test]
    fn results_are_those_of_resolving_at_once() {
        let (mut resolver, stacks) = (Resolver::new().unwrap(), stacks(100));
        let cursors = [50, 0, 7, 50, 101, 7];
        resolver.request(cursors.iter().map(|&cursor| (mesh(cursor), whole(&stacks))));
        assert_eq!(resolver.pending_count(), 4, "each once");
        for _ in 0..4 {
            let (request, resolved) = wait_for_one(&mut resolver, u64::MAX).unwrap();
            let expected = stacks.resolve(request.key().cursor);
            let Resolved::Triangles(resolved) = resolved else { panic!("triangles") };
            assert_eq!(resolved.triangles, expected.triangles);
            let sections: Vec<_> = resolved.sections.into_iter().map(|range| range.all).collect();
            assert_eq!(sections, expected.sections);
        }
        resolver.request([(morph(50), whole(&stacks))].into_iter());
        let (request, resolved) = wait_for_one(&mut resolver, u64::MAX).unwrap();
        let Resolved::MorphTarget(standing) = resolved else { panic!("standing vertices") };
        assert_eq!((request, standing), (morph(50), stacks.representative_wedges(50)));
        assert_eq!((resolver.pending_count(), resolver.pending_bytes), (0, 0));
    }

    #[test]
    fn a_cancelled_result_goes_without_a_frame_that_takes_results() {
        let (mut resolver, stacks) = (Resolver::new().unwrap(), stacks(1000));
        resolver.request([(mesh(7), whole(&stacks))].into_iter());
        let start = Instant::now();
        // It has arrived, and no frame takes it.
        while resolver.finished.is_empty() && start.elapsed() < Duration::from_secs(10) {
            resolver.request([(mesh(7), whole(&stacks))].into_iter());
        }
        assert_eq!(resolver.finished.len(), 1);
        resolver.request(std::iter::empty());
        assert!(resolver.finished.is_empty());
    }

    #[test]
    fn what_is_not_asked_for_again_is_dropped() {
        let (mut resolver, stacks) = (Resolver::new().unwrap(), stacks(1000));
        resolver.request((0..100).map(|cursor| (mesh(cursor), whole(&stacks))));
        resolver.request([(mesh(99), whole(&stacks)), (mesh(500), whole(&stacks))].into_iter());
        assert_eq!(resolver.pending_count(), 2);
        let mut cursors =
            [(); 2].map(|()| wait_for_one(&mut resolver, u64::MAX).unwrap().0.key().cursor);
        cursors.sort_unstable();
        assert_eq!(cursors, [99, 500]);
        // Everything begun is through the queue once this one is.
        resolver.request([(mesh(501), whole(&stacks))].into_iter());
        assert_eq!(wait_for_one(&mut resolver, u64::MAX).unwrap().0, mesh(501));
        assert!(resolver.take_finished(u64::MAX).is_none());
    }

    #[test]
    fn requests_are_bounded_in_number_and_bytes() {
        let (mut resolver, small) = (Resolver::new().unwrap(), stacks(2000));
        resolver.request((0..2000).map(|cursor| (mesh(cursor), whole(&small))));
        assert_eq!(resolver.pending_count(), MAX_PENDING_RESOLVES);
        let mut done = 0;
        while done < 2000 {
            let (finished, _) = wait_for_one(&mut resolver, u64::MAX).unwrap();
            done += 1;
            let left = (0..2000).filter(|&cursor| cursor > finished.key().cursor);
            resolver.request(left.map(|cursor| (mesh(cursor), whole(&small))));
            assert!(resolver.pending_count() <= MAX_PENDING_RESOLVES);
            done = done.max(finished.key().cursor + 1);
        }
        resolver.pending_bytes = MAX_PENDING_RESOLVE_BYTES;
        resolver.request([(mesh(0), whole(&small))].into_iter());
        assert_eq!(resolver.pending_count(), 1, "one always");
        resolver.request([(mesh(0), whole(&small)), (mesh(1), whole(&small))].into_iter());
        assert_eq!(resolver.pending_count(), 1);
        resolver.pending_bytes -= MAX_PENDING_RESOLVE_BYTES;
    }

    #[test]
    fn a_result_waits_until_it_fits() {
        let (mut resolver, stacks) = (Resolver::new().unwrap(), stacks(100));
        resolver.request([(mesh(0), whole(&stacks))].into_iter());
        let bytes = ResolvedTriangles::new(whole(&stacks), 0).bytes();
        let start = Instant::now();
        while resolver.finished.is_empty() && start.elapsed() < Duration::from_secs(10) {
            assert!(resolver.take_finished(bytes - 1).is_none());
        }
        assert!(resolver.take_finished(bytes - 1).is_none());
        assert_eq!((resolver.pending_count(), resolver.finished.len()), (1, 1));
        assert!(resolver.take_finished(bytes).is_some());
    }
}
