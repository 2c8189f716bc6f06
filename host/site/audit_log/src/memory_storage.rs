//! A file system in memory for tests: it records its operations, so that every power cut can
//! be replayed, and its disk can be full or refuse to sync.

use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex};

use fastrand::Rng;

use crate::anchor::Anchor;
use crate::chain::{Digest256, FileHasher};
use crate::storage::{FileId, LogFile, Storage};

const SECTOR_BYTES: usize = 512;

/// An operation that was made, in order.
#[derive(Clone, Debug)]
pub(crate) enum Operation {
    Create {
        inode: u64,
        name: String,
    },
    Append {
        inode: u64,
        bytes: Vec<u8>,
    },
    Sync {
        inode: u64,
    },
    Rename {
        inode: u64,
        from: String,
        to: String,
    },
    Remove {
        inode: u64,
        name: String,
    },
    SyncFolder,
    /// Records up to a number were said to be durable.
    Claim {
        number: u64,
        anchor: Anchor,
    },
}

/// Content of a disk: names, and bytes by inode.
#[derive(Clone, Debug, Default)]
struct Disk {
    names: BTreeMap<String, u64>,
    contents: BTreeMap<u64, Vec<u8>>,
    next_inode: u64,
    operations: Vec<Operation>,
    /// Bytes that still fit.
    free: Option<u64>,
    failing_syncs: u32,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct MemoryStorage(Arc<Mutex<Disk>>);

/// Order in which what was not synced reaches the disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CrashOrder {
    /// Writes in the order in which they were made; the last one may be cut short.
    Sequential,
    /// Any subset of the writes, in blocks and in any order.
    Reordered,
}

impl MemoryStorage {
    /// A disk with these files, all of them synced.
    pub(crate) fn with_files(files: &BTreeMap<String, Vec<u8>>) -> Self {
        let storage = Self::default();
        for (name, bytes) in files {
            storage.put(name, bytes);
        }
        storage
    }

    pub(crate) fn put(&self, name: &str, bytes: &[u8]) {
        let mut disk = self.0.lock().unwrap();
        let inode = disk.add(name);
        disk.contents.insert(inode, bytes.to_vec());
    }

    pub(crate) fn files(&self) -> BTreeMap<String, Vec<u8>> {
        let disk = self.0.lock().unwrap();
        disk.names
            .iter()
            .map(|(name, inode)| (name.clone(), disk.contents[inode].clone()))
            .collect()
    }

    pub(crate) fn claim(&self, number: u64, anchor: Anchor) {
        self.0.lock().unwrap().operations.push(Operation::Claim { number, anchor });
    }

    pub(crate) fn operations(&self) -> Vec<Operation> {
        self.0.lock().unwrap().operations.clone()
    }

    /// Leaves room for so many bytes.
    pub(crate) fn set_free(&self, free: Option<u64>) {
        self.0.lock().unwrap().free = free;
    }

    pub(crate) fn fail_syncs(&self, count: u32) {
        self.0.lock().unwrap().failing_syncs = count;
    }

    /// The disk after these operations on a disk with these files, and a power cut.
    pub(crate) fn after_power_cut(
        files: &BTreeMap<String, Vec<u8>>,
        operations: &[Operation],
        order: CrashOrder,
        random: &mut Rng,
    ) -> Self {
        let storage = Self::with_files(files);
        storage.0.lock().unwrap().replay(operations, order, random);
        storage
    }
}

impl Disk {
    fn add(&mut self, name: &str) -> u64 {
        self.next_inode += 1;
        self.names.insert(name.to_owned(), self.next_inode);
        self.contents.insert(self.next_inode, Vec::new());
        self.next_inode
    }

    fn replay(&mut self, operations: &[Operation], order: CrashOrder, random: &mut Rng) {
        let last = |is: &dyn Fn(&Operation) -> bool| operations.iter().rposition(is).unwrap_or(0);
        let folder_synced = last(&|operation| matches!(operation, Operation::SyncFolder));
        let mut is_cut = false;
        let mut unsynced: BTreeMap<u64, usize> = BTreeMap::new();
        for (index, operation) in operations.iter().enumerate() {
            let is_kept = index < folder_synced
                || match order {
                    CrashOrder::Sequential => {
                        is_cut |= random.u32(..4) == 0;
                        !is_cut
                    }
                    CrashOrder::Reordered => random.bool(),
                };
            match operation {
                Operation::Create { inode, name } if is_kept => {
                    self.names.insert(name.clone(), *inode);
                    self.contents.entry(*inode).or_default();
                }
                Operation::Create { inode, .. } => drop(self.contents.entry(*inode).or_default()),
                Operation::Rename { inode, from, to } if is_kept => {
                    if self.names.get(from) == Some(inode) {
                        self.names.remove(from);
                    }
                    self.names.insert(to.clone(), *inode);
                }
                Operation::Remove { inode, name }
                    if is_kept && self.names.get(name) == Some(inode) =>
                {
                    self.names.remove(name);
                }
                Operation::Append { inode, bytes } => {
                    let content = self.contents.entry(*inode).or_default();
                    unsynced.entry(*inode).or_insert(content.len());
                    content.extend_from_slice(bytes);
                }
                Operation::Sync { inode } => drop(unsynced.remove(inode)),
                _ => {}
            }
        }
        for (inode, synced) in unsynced {
            let content = self.contents.get_mut(&inode).expect("it was written");
            content.truncate(random.usize(synced..=content.len()));
            if order == CrashOrder::Reordered {
                let end = content.len();
                let mut start = synced;
                while start < end {
                    let next = ((start / SECTOR_BYTES + 1) * SECTOR_BYTES).min(end);
                    if random.u32(..3) == 0 {
                        content[start..next].fill(0);
                    }
                    start = next;
                }
            }
        }
        self.next_inode = self.contents.keys().max().copied().unwrap_or(0);
    }
}

fn missing() -> io::Error {
    io::ErrorKind::NotFound.into()
}

impl Storage for MemoryStorage {
    fn names(&self) -> io::Result<Vec<String>> {
        Ok(self.0.lock().unwrap().names.keys().cloned().collect())
    }

    fn read(&self, name: &str, most: u64) -> io::Result<Vec<u8>> {
        let disk = self.0.lock().unwrap();
        let bytes = &disk.contents[disk.names.get(name).ok_or_else(missing)?];
        Ok(bytes[..bytes.len().min(most as usize)].to_vec())
    }

    fn digest(&self, name: &str, most: u64) -> io::Result<(u64, Digest256)> {
        let bytes = self.read(name, u64::MAX)?;
        let most = most.min(bytes.len() as u64) as usize;
        let mut hasher = FileHasher::default();
        hasher.update(&bytes[..most]);
        Ok((bytes.len() as u64, hasher.digest()))
    }

    fn create(&self, name: &str) -> io::Result<Box<dyn LogFile>> {
        let mut disk = self.0.lock().unwrap();
        if disk.names.contains_key(name) {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        if disk.free == Some(0) {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let inode = disk.add(name);
        disk.operations.push(Operation::Create { inode, name: name.to_owned() });
        Ok(Box::new(MemoryFile { disk: self.clone(), inode }))
    }

    fn open(&self, name: &str) -> io::Result<Box<dyn LogFile>> {
        let inode = *self.0.lock().unwrap().names.get(name).ok_or_else(missing)?;
        Ok(Box::new(MemoryFile { disk: self.clone(), inode }))
    }

    fn id_of(&self, name: &str) -> io::Result<Option<FileId>> {
        Ok(self.0.lock().unwrap().names.get(name).map(|inode| (0, *inode)))
    }

    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        let mut disk = self.0.lock().unwrap();
        if disk.names.contains_key(to) {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        let inode = disk.names.remove(from).ok_or_else(missing)?;
        disk.names.insert(to.to_owned(), inode);
        let (from, to) = (from.to_owned(), to.to_owned());
        disk.operations.push(Operation::Rename { inode, from, to });
        Ok(())
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        let mut disk = self.0.lock().unwrap();
        let inode = disk.names.remove(name).ok_or_else(missing)?;
        disk.operations.push(Operation::Remove { inode, name: name.to_owned() });
        Ok(())
    }

    fn sync_folder(&self) -> io::Result<()> {
        self.0.lock().unwrap().operations.push(Operation::SyncFolder);
        Ok(())
    }
}

#[derive(Debug)]
struct MemoryFile {
    disk: MemoryStorage,
    inode: u64,
}

impl LogFile for MemoryFile {
    fn append(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut disk = self.disk.0.lock().unwrap();
        let free = disk.free.unwrap_or(u64::MAX);
        if free == 0 {
            return Err(io::ErrorKind::StorageFull.into());
        }
        let count = bytes.len().min(usize::try_from(free).unwrap_or(usize::MAX));
        if let Some(free) = &mut disk.free {
            *free -= count as u64;
        }
        let bytes = bytes[..count].to_vec();
        disk.contents.get_mut(&self.inode).expect("it exists").extend_from_slice(&bytes);
        disk.operations.push(Operation::Append { inode: self.inode, bytes });
        Ok(count)
    }

    fn sync(&mut self) -> io::Result<()> {
        let mut disk = self.disk.0.lock().unwrap();
        if disk.failing_syncs > 0 {
            disk.failing_syncs -= 1;
            return Err(io::Error::other("the disk refuses"));
        }
        disk.operations.push(Operation::Sync { inode: self.inode });
        Ok(())
    }

    fn id(&self) -> io::Result<FileId> {
        Ok((0, self.inode))
    }
}
