use std::sync::atomic::{AtomicU64, Ordering};

use super::*;

const LAYOUT: StateFileLayout =
    StateFileLayout { version: 3, key: "things", max_bytes: 4096, subject: "numbers" };

#[derive(Debug, PartialEq, serde::Serialize, serde::Deserialize)]
struct Level(f64);

impl StoredState for Level {
    fn is_plausible(&self) -> bool {
        self.0 >= 0.0
    }
}

/// Folder of a test, removed at its end.
struct Folder(PathBuf);

impl Folder {
    fn new() -> Self {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let name = format!("busbar-state-file-{}-{count}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        Self(folder)
    }

    fn file(&self) -> PathBuf {
        self.0.join("states.json")
    }

    fn states(&self) -> StateFile<Level> {
        StateFile::new(self.file().to_str().unwrap(), LAYOUT, crate::testing::host())
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        std::fs::remove_dir_all(&self.0).unwrap();
    }
}

fn levels(count: usize) -> BTreeMap<String, Level> {
    (0..count).map(|at| (format!("=Q{at}"), Level(0.1 * at as f64))).collect()
}

#[test]
fn states_are_read_as_they_were_written() {
    let folder = Folder::new();
    assert!(folder.states().read().is_empty(), "there is no file yet");
    folder.states().close(&levels(9));
    assert_eq!(folder.states().read(), levels(9).into_iter().collect());
    let mut file = folder.states();
    file.write(levels(2));
    file.close(&levels(3));
    assert_eq!(folder.states().read().len(), 3, "the last ones");
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 1, "no other file is left");
}

#[test]
fn a_damaged_file_gives_no_states() {
    let folder = Folder::new();
    folder.states().close(&levels(3));
    let text = std::fs::read_to_string(folder.file()).unwrap();
    let damaged = [
        String::new(),
        "null".to_owned(),
        "[]".to_owned(),
        text[..text.len() - 1].to_owned(),
        format!("{text} more"),
        text.replace("\"version\":3", "\"version\":\"3\""),
        text.replace("\"version\":3,", ""),
        text.replace("things", "others"),
        text.replace("0.1", "-0.1"),
        text.replace("0.1", "1e999"),
        text.replace("0.1", "\"0.1\""),
        "[".repeat(3_000),
        " ".repeat(5_000) + &text,
        "\u{feff}".to_owned() + &text,
    ];
    for damaged in damaged {
        assert_ne!(damaged, text);
        std::fs::write(folder.file(), &damaged).unwrap();
        assert!(read::<Level>(&folder.file(), &LAYOUT).is_err(), "{damaged}");
        assert!(folder.states().read().is_empty());
    }
    std::fs::write(folder.file(), [0xff, 0xfe, b'{']).unwrap();
    assert!(read::<Level>(&folder.file(), &LAYOUT).is_err());
    std::fs::remove_file(folder.file()).unwrap();
    std::fs::create_dir(folder.file()).unwrap();
    assert_eq!(read::<Level>(&folder.file(), &LAYOUT), Err("it is no plain file".to_owned()));
}

#[test]
fn states_that_are_too_long_leave_the_file_as_it_was() {
    let folder = Folder::new();
    folder.states().close(&levels(3));
    let mut file = folder.states();
    file.write(levels(1_000));
    file.close(&levels(1_000));
    assert_eq!(folder.states().read().len(), 3);
}

#[test]
fn a_path_that_is_not_absolute_is_a_fault() {
    assert_eq!(state_file_fault("/var/lib/busbar/states.json"), None);
    let fault = state_file_fault("states.json").unwrap();
    assert!(fault.contains("'states.json' is no absolute path"), "{fault}");
}
