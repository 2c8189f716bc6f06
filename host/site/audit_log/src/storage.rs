//! File operations of a log in one folder: opened without following links, renamed without
//! replacing. Tests put a file system in memory in its place, to replay power cuts.

use std::fmt;
use std::fs::File;
use std::io::{self, Read, Write};
use std::os::fd::OwnedFd;
use std::path::Path;

use rustix::fs::{Access, AtFlags, Dir, FileType, Mode, OFlags, RenameFlags};
use rustix::io::Errno;

use crate::chain::{Digest256, FileHasher};

/// Limit of entries read from a folder.
const MAX_ENTRIES: usize = 100_000;
const READ_BYTES: usize = 64 * 1024;

/// Device and inode of a file.
pub(crate) type FileId = (u64, u64);

/// The folder of a log.
pub(crate) trait Storage: fmt::Debug + Send {
    /// Names of all entries.
    fn names(&self) -> io::Result<Vec<String>>;
    /// The first bytes of a file, at most so many.
    fn read(&self, name: &str, most: u64) -> io::Result<Vec<u8>>;
    /// Size of a file, and SHA-256 of its first bytes, at most so many.
    fn digest(&self, name: &str, most: u64) -> io::Result<(u64, Digest256)>;
    /// Creates a file to append to. One of this name must not exist.
    fn create(&self, name: &str) -> io::Result<Box<dyn LogFile>>;
    /// Opens a file to append to. It must exist.
    fn open(&self, name: &str) -> io::Result<Box<dyn LogFile>>;
    /// Identity of the file that has this name now.
    fn id_of(&self, name: &str) -> io::Result<Option<FileId>>;
    /// Renames a file. One of the new name must not exist.
    fn rename(&self, from: &str, to: &str) -> io::Result<()>;
    /// Removes a file of the log.
    fn remove(&self, name: &str) -> io::Result<()>;
    /// Waits until entries that were created, renamed and removed are on the disk.
    fn sync_folder(&self) -> io::Result<()>;
}

/// File opened for appending.
pub(crate) trait LogFile: fmt::Debug + Send {
    /// Appends some of the bytes; how many.
    fn append(&mut self, bytes: &[u8]) -> io::Result<usize>;
    /// Waits until all that was appended is on the disk.
    fn sync(&mut self) -> io::Result<()>;
    /// Identity of the file.
    fn id(&self) -> io::Result<FileId>;
}

/// A folder of the machine.
#[derive(Debug)]
pub(crate) struct DiskStorage {
    folder: OwnedFd,
}

impl DiskStorage {
    /// Opens a folder that exists.
    pub(crate) fn open(folder: &Path) -> io::Result<Self> {
        let flags = OFlags::RDONLY | OFlags::DIRECTORY | OFlags::CLOEXEC;
        Ok(Self { folder: rustix::fs::open(folder, flags, Mode::empty())? })
    }

    /// Opens or creates the lock file.
    pub(crate) fn lock_file(&self, name: &str) -> io::Result<File> {
        self.file(name, OFlags::WRONLY | OFlags::CREATE)
    }

    /// Checks that files may be created and renamed in it.
    pub(crate) fn check_writable(&self) -> io::Result<()> {
        let access = Access::WRITE_OK | Access::EXEC_OK;
        Ok(rustix::fs::accessat(&self.folder, ".", access, AtFlags::EACCESS)?)
    }

    /// Opens a regular file of the folder, and nothing that a link leads to.
    fn file(&self, name: &str, flags: OFlags) -> io::Result<File> {
        // A pipe must not keep anybody waiting.
        let flags = flags | OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let opened = rustix::fs::openat(&self.folder, name, flags, Mode::RUSR | Mode::WUSR);
        let file = match opened {
            Ok(file) => File::from(file),
            Err(Errno::LOOP) => {
                return Err(io::Error::other(format!("'{name}' is a link, and none is followed")));
            }
            Err(error) => return Err(error.into()),
        };
        if !file.metadata()?.is_file() {
            return Err(io::Error::other(format!("'{name}' is no regular file")));
        }
        Ok(file)
    }
}

impl Storage for DiskStorage {
    fn names(&self) -> io::Result<Vec<String>> {
        let mut names = Vec::new();
        for entry in Dir::read_from(&self.folder)?.take(MAX_ENTRIES) {
            // The log's own names are text.
            if let Ok(name) = entry?.file_name().to_str() {
                names.push(name.to_owned());
            }
        }
        Ok(names)
    }

    fn read(&self, name: &str, most: u64) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.file(name, OFlags::RDONLY)?.take(most).read_to_end(&mut bytes)?;
        Ok(bytes)
    }

    fn digest(&self, name: &str, most: u64) -> io::Result<(u64, Digest256)> {
        let file = self.file(name, OFlags::RDONLY)?;
        let size = file.metadata()?.len();
        let (mut rest, mut hasher) = (file.take(most.min(size)), FileHasher::default());
        let mut buffer = vec![0; READ_BYTES];
        loop {
            match rest.read(&mut buffer)? {
                0 => return Ok((size, hasher.digest())),
                count => hasher.update(&buffer[..count]),
            }
        }
    }

    fn create(&self, name: &str) -> io::Result<Box<dyn LogFile>> {
        let flags = OFlags::WRONLY | OFlags::APPEND | OFlags::CREATE | OFlags::EXCL;
        Ok(Box::new(self.file(name, flags)?))
    }

    fn open(&self, name: &str) -> io::Result<Box<dyn LogFile>> {
        Ok(Box::new(self.file(name, OFlags::WRONLY | OFlags::APPEND)?))
    }

    fn id_of(&self, name: &str) -> io::Result<Option<FileId>> {
        match rustix::fs::statat(&self.folder, name, AtFlags::SYMLINK_NOFOLLOW) {
            Ok(stat) if FileType::from_raw_mode(stat.st_mode) == FileType::RegularFile => {
                Ok(Some((stat.st_dev, stat.st_ino)))
            }
            Ok(_) | Err(Errno::NOENT) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        let folder = &self.folder;
        match rustix::fs::renameat_with(folder, from, folder, to, RenameFlags::NOREPLACE) {
            // Not every file system can refuse to replace; the lock keeps others away.
            Err(Errno::INVAL | Errno::NOSYS) => {
                if rustix::fs::statat(folder, to, AtFlags::SYMLINK_NOFOLLOW).is_ok() {
                    return Err(Errno::EXIST.into());
                }
                Ok(rustix::fs::renameat(folder, from, folder, to)?)
            }
            result => Ok(result?),
        }
    }

    fn remove(&self, name: &str) -> io::Result<()> {
        Ok(rustix::fs::unlinkat(&self.folder, name, AtFlags::empty())?)
    }

    fn sync_folder(&self) -> io::Result<()> {
        Ok(rustix::fs::fsync(&self.folder)?)
    }
}

impl LogFile for File {
    fn append(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.write(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.sync_data()
    }

    fn id(&self) -> io::Result<FileId> {
        let stat = rustix::fs::fstat(self)?;
        Ok((stat.st_dev, stat.st_ino))
    }
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn links_pipes_and_folders_are_refused_and_nothing_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let storage = DiskStorage::open(folder.path()).unwrap();
        fs::write(path("victim"), "untouched").unwrap();
        symlink(path("victim"), path("link")).unwrap();
        symlink(path("absent"), path("dangling")).unwrap();
        fs::create_dir(path("folder")).unwrap();
        let pipe = rustix::fs::mknodat(
            rustix::fs::CWD,
            path("pipe"),
            FileType::Fifo,
            Mode::RUSR | Mode::WUSR,
            0,
        );
        pipe.unwrap();
        for name in ["link", "dangling", "folder", "pipe"] {
            assert!(storage.open(name).is_err(), "{name}");
            assert!(storage.create(name).is_err(), "{name}");
            assert!(storage.read(name, 10).is_err(), "{name}");
            assert!(storage.lock_file(name).is_err(), "{name}");
            assert_eq!(storage.id_of(name).unwrap(), None);
        }
        let told = storage.open("link").unwrap_err().to_string();
        assert!(told.contains("link"), "{told}");
        fs::write(path("a"), "a").unwrap();
        assert!(storage.rename("a", "victim").is_err());
        assert_eq!(fs::read_to_string(path("victim")).unwrap(), "untouched");
        assert!(!path("absent").exists());
    }
}
