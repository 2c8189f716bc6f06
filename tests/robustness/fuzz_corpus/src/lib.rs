//! Regression tests of fuzz targets: kept inputs and seeded mutations of them, run as an ordinary
//! test. The fuzzer takes minutes for it, CI seconds.
//!
//! `corpus/TARGET` has the inputs, `tests/TARGET.rs` what is done with each. The fuzz
//! targets of `tests/robustness/fuzz` are these very files.

mod mutation;

use std::fs;
use std::io;
use std::path::Path;

use fastrand::Rng;

/// Number of mutated inputs in a run.
const ROUNDS: u64 = 10_000;
/// Lowest number of rounds that must be accepted, and that must be refused.
const MIN_EITHER: u64 = ROUNDS / 100;
/// Greatest number of kept inputs of one target, and of their bytes.
const MAX_FILES: usize = 42;
const MAX_BYTES: usize = 12 * 1024;
/// Length limit of a mutated input, bytes.
const MAX_INPUT_BYTES: usize = 16 * 1024;

/// Runs the kept inputs of a target, then mutations of them. `body` says whether it took
/// the input or refused it, and panics where that went wrong.
///
/// # Panics
/// When `body` does, with the input; when there are no inputs, or too many; when nearly
/// all mutations are taken or nearly all refused, which would test nothing.
pub fn check(target: &str, body: impl Fn(&[u8]) -> bool) {
    let kept = kept(target);
    let good: Vec<_> = kept.iter().filter(|(name, input)| run(name, input, &body)).collect();
    assert!(!good.is_empty(), "none of the kept inputs is taken");
    let (mut taken, mut refused) = (0, 0);
    for round in 0..ROUNDS {
        let mut random = Rng::with_seed(round);
        // What is taken leads further than what is not.
        let (name, input) = match random.bool() {
            true => good[random.usize(..good.len())],
            false => &kept[random.usize(..kept.len())],
        };
        let (_, other) = &kept[random.usize(..kept.len())];
        let input = mutation::mutated(input, other, MAX_INPUT_BYTES, &mut random);
        if run(&format!("{name}, round {round}"), &input, &body) {
            taken += 1;
        } else {
            refused += 1;
        }
    }
    assert!(
        taken >= MIN_EITHER && refused >= MIN_EITHER,
        "{taken} inputs taken, {refused} refused: the kept ones are too alike"
    );
}

/// Reads all kept inputs of a target with their names, in order.
fn kept(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target);
    let kept = read_all(&folder)
        .unwrap_or_else(|error| panic!("cannot read {}: {error}", folder.display()));
    let bytes: usize = kept.iter().map(|(_, input)| input.len()).sum();
    assert!(
        (1..=MAX_FILES).contains(&kept.len()) && bytes <= MAX_BYTES,
        "{}: {} inputs of {bytes} bytes; 1 to {MAX_FILES} of at most {MAX_BYTES} are kept",
        folder.display(),
        kept.len()
    );
    kept
}

fn read_all(folder: &Path) -> io::Result<Vec<(String, Vec<u8>)>> {
    let read = |entry: io::Result<fs::DirEntry>| {
        let entry = entry?;
        Ok((entry.file_name().to_string_lossy().into_owned(), fs::read(entry.path())?))
    };
    let mut files: Vec<_> = fs::read_dir(folder)?.map(read).collect::<io::Result<_>>()?;
    files.sort();
    Ok(files)
}

fn run(name: &str, input: &[u8], body: impl Fn(&[u8]) -> bool) -> bool {
    let report = InputReport { name, input };
    let taken = body(input);
    drop(report);
    taken
}

/// Report of the input on a panic.
struct InputReport<'a> {
    name: &'a str,
    input: &'a [u8],
}

impl Drop for InputReport<'_> {
    #[allow(clippy::print_stderr, reason = "it is part of a failed test's words")]
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("the input, {}:\n{}", self.name, self.input.escape_ascii());
        }
    }
}

#[cfg(test)]
#[path = "lib_tests.rs"]
mod tests;
