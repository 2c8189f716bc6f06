//! Log file rotation: `busbar.log`, `busbar.log.1` and so on, the newest first. Writing never
//! fails, whatever becomes of the file.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Pause after a failed write.
const RETRY: Duration = Duration::from_secs(5);

/// Writer of lines into files of a limited size and number.
pub(super) struct RotatingFile {
    path: PathBuf,
    max_bytes: u64,
    max_files: usize,
    file: Option<File>,
    bytes: u64,
    /// Number of writes lost since the last success, and since when.
    lost: u64,
    failed_at: Option<Instant>,
}

impl RotatingFile {
    /// Creates the writer; opens nothing yet.
    pub(super) fn new(path: PathBuf, max_bytes: u64, max_files: usize) -> Self {
        Self { path, max_bytes, max_files, file: None, bytes: 0, lost: 0, failed_at: None }
    }

    fn append(&mut self, line: &[u8]) -> io::Result<()> {
        if self.file.is_none() {
            let file = OpenOptions::new().create(true).append(true).open(&self.path)?;
            self.bytes = file.metadata()?.len();
            self.file = Some(file);
        }
        if self.bytes > 0 && self.bytes + line.len() as u64 > self.max_bytes {
            self.rotate()?;
        }
        let file = self.file.as_mut().ok_or(io::ErrorKind::NotFound)?;
        // At once, so that no line is cut by the next one.
        file.write_all(line)?;
        self.bytes += line.len() as u64;
        Ok(())
    }

    fn rotate(&mut self) -> io::Result<()> {
        self.file = None;
        for number in (1..self.max_files).rev() {
            let from = numbered(&self.path, number - 1);
            match fs::rename(&from, numbered(&self.path, number)) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
                _ => {}
            }
        }
        self.file = Some(File::create(&self.path)?);
        self.bytes = 0;
        Ok(())
    }

    fn fail(&mut self, error: &io::Error) {
        if self.lost == 0 {
            let path = self.path.display();
            // The log itself cannot say it.
            crate::output::line(&format!(
                "the log '{path}' is not written: {error}; check its folder, its rights and the disk"
            ));
        }
        self.lost += 1;
        self.file = None;
        self.failed_at = Some(Instant::now());
    }
}

fn numbered(path: &Path, number: usize) -> PathBuf {
    if number == 0 {
        return path.to_owned();
    }
    let mut name = OsString::from(path);
    name.push(format!(".{number}"));
    PathBuf::from(name)
}

impl Write for RotatingFile {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if self.failed_at.is_some_and(|at| at.elapsed() < RETRY) {
            self.lost += 1;
            return Ok(line.len());
        }
        match self.append(line) {
            Ok(()) => {
                if self.failed_at.take().is_some() {
                    let lost = std::mem::take(&mut self.lost);
                    tracing::warn!("the log is written again; {lost} lines are lost");
                }
            }
            Err(error) => self.fail(&error),
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_keep_their_size_and_number_and_no_line_is_cut() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("busbar.log");
        for begin in [0, 500] {
            // As after a restart.
            let mut log = RotatingFile::new(path.clone(), 1_000, 3);
            for number in begin..begin + 500 {
                log.write_all(format!("line {number:05}\n").as_bytes()).unwrap();
            }
        }
        let mut files: Vec<_> =
            fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        files.sort();
        assert_eq!(files, ["busbar.log", "busbar.log.1", "busbar.log.2"]);
        let text: String = (0..3)
            .rev()
            .map(|number| fs::read_to_string(numbered(&path, number)).unwrap())
            .inspect(|text| assert!(!text.is_empty() && text.len() <= 1_000))
            .collect();
        let last = text.lines().count();
        let expected = (1000 - last..1000).map(|number| format!("line {number:05}\n"));
        assert_eq!(text, expected.collect::<String>(), "the last lines, all of them");
    }

    #[test]
    fn a_disk_that_is_full_and_a_folder_that_is_not_there_cost_lines_alone() {
        for path in ["/dev/full", "/absent/folder/busbar.log"] {
            let mut log = RotatingFile::new(path.into(), 1_000, 3);
            for _ in 0..10 {
                assert_eq!(log.write(b"line\n").unwrap(), 5);
            }
            assert_eq!(log.lost, 10, "{path}");
        }
    }

    #[test]
    fn it_is_written_again_once_that_is_possible() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("later").join("busbar.log");
        let mut log = RotatingFile::new(path.clone(), 1_000, 3);
        log.write_all(b"lost\n").unwrap();
        fs::create_dir(folder.path().join("later")).unwrap();
        log.failed_at = Instant::now().checked_sub(RETRY);
        log.write_all(b"kept\n").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "kept\n");
        assert_eq!(log.lost, 0);
    }
}
